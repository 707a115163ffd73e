#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "formats/exr/exr_file.hpp"
#include "formats/files/files.hpp"
#include "lib/base/job.hpp"
#include "lib/model/atlas.hpp"

namespace stx {

/// One image of an atlas set.
struct AtlasTexture {
    std::string attribute;  ///< "colour", "depth", "normal", "splat" (splatU and splatV share one),
                            ///< "metallic_roughness" or "emissive"
    int page = 0;
    std::string file;  ///< name in the folder; empty in an OpenEXR atlas
    /// "sRGB8": 8-bit sRGB, straight alpha · "sRGB8-opaque": the same without alpha, which is then
    /// in the depth texture (JPEG) · "code8", "code16": the DepthImage codes of each rectangle's
    /// view (its nearPlane, farPlane, depthBits) · "snorm16": 32768 + 32767 * v / scale of each
    /// component · "unorm8": 8-bit RGB of glTF, G = 255 * roughness, B = 255 * metallic, R = 255
    /// where one of them is not 0 · "sRGB8-emissive": 8-bit sRGB of light / scale, no alpha ·
    /// "float": OpenEXR, as in bundles.
    std::string coding;
    int width = 0, height = 0;  ///< pixels of the image, which may hold two pictures of the page
    /// snorm16: the value of code 65535; sRGB8-emissive: the light of code 255, 1 or more
    double scale = 1.0;
    /// Where pixel (0, 0) of the second picture lies, beside or below the first, which starts at
    /// (0, 0); both 0 = there is none. snorm16 splats: splatU, then splatV; depth: the codes, then
    /// the colour's alpha where it is "sRGB8-opaque" (in 16 bits 257 times the alpha).
    int secondX = 0, secondY = 0;
    std::uint64_t bytes = 0;  ///< as it lies in the file; 0 = not known

    [[nodiscard]] bool hasSecond() const { return secondX > 0 || secondY > 0; }
    /// Doubles the image along its shorter side, to stay within what a GPU takes.
    void addSecond();
};

/// What an atlas says without its pixels.
struct AtlasHeader {
    Atlas atlas;  ///< pages have no images, so its width(), height() and used() are 0
    int pageWidth = 0, pageHeight = 0;
    int pages = 0;
    bool linear = false;
    std::vector<AtlasTexture> textures;  ///< at most 4, and those of materials
    std::string environmentFile;         ///< of a folder: its environment; empty: none

    /// What the index says of a view's camera a second time, for engines; empty where it does not.
    struct Again {
        std::optional<glm::dvec2> fieldOfView = {};  ///< as Camera::fieldOfView()
        std::optional<glm::dvec4> orientation = {};  ///< axis x y z and angle, radians
    };
    std::vector<Again> again;  ///< of each view, with AtlasChecks::format; else empty

    /// Share of the page area that rectangles cover, 0..1.
    [[nodiscard]] double used() const;
};

/// What reading an atlas' header refuses.
enum class AtlasChecks {
    all,     ///< whatever breaks a rule
    format,  ///< only what makes the rest unreadable; the validator reports the broken rules
};

/// How an atlas is written.
struct AtlasSaveOptions {
    /// 1..100: colour of a folder is JPEG of this quality, colour.jpg, and its alpha goes without
    /// loss into the depth texture; 0: PNG, exact.
    int jpegQuality = 0;
    bool folder = false;  ///< even where the name ends in .exr
    OutputFile::Options output = {};
};

/// Writes an atlas: one multi-part OpenEXR file (a part for each page) when the name ends in .exr,
/// in letters of any case and without a slash behind it, else a folder of atlas.json
/// (formats/atlas/atlas.schema.json) and at most four images: colour.png, depth.png, normal.png,
/// splat.png (and, where the views have them, metallic_roughness.png and emissive.png), those of
/// page k > 0 as colour_k.png and so on.
/// The environment is environment.exr, or a part of its own (environment_exr.hpp).
/// 8- and 16-bit depth comes back to the code, normals to 1/32767 and splats to as much of the
/// longest axis of their texture (where that is much for the splats of an object, a note says so);
/// an atlas with a view of 32 depth bits gets .exr images, and everything comes back to the bit.
/// Linear colour is colour.exr. Depth that belongs to no rectangle or its padding is dropped with a
/// note. Colours under alpha 0 are filled again from their neighbours when they come from OpenEXR
/// or go to JPEG. Errors: Atlas::check(); files; unsupported: JPEG where OpenEXR is needed.
[[nodiscard]] Result<void> writeAtlas(const Atlas& atlas, const std::filesystem::path& path,
                                      Job& job, const AtlasSaveOptions& options = {});
/// The same bytes; depth takes no memory any more once it is coded.
[[nodiscard]] Result<void> writeAtlas(Atlas&& atlas, const std::filesystem::path& path, Job& job,
                                      const AtlasSaveOptions& options = {});

/// For PackSettings::bytesToWrite: what writeAtlas() takes beside the pages.
[[nodiscard]] std::optional<std::uint64_t> bytesToWriteAtlas(const std::filesystem::path& path,
                                                             const AtlasSaveOptions& options);

/// Longest side of the images that writeAtlas() makes of an atlas that passes check(), pixels:
/// where an image holds two pictures of a page (AtlasTexture::secondX), it is larger than the page.
[[nodiscard]] int largestImageSide(const Atlas& atlas, const std::filesystem::path& path,
                                   const AtlasSaveOptions& options = {});

/// Reads what writeAtlas() wrote: a folder, its atlas.json, or an .exr file. The images' names
/// resolve inside the folder only. The result passes Atlas::check().
[[nodiscard]] Result<Atlas> readAtlas(const std::filesystem::path& path, Job& job);
/// The same without pixels, in milliseconds.
[[nodiscard]] Result<AtlasHeader> readAtlasHeader(const std::filesystem::path& path,
                                                  const Limits& limits,
                                                  AtlasChecks checks = AtlasChecks::all);

/// The size of one texture's image as it is in the file, whatever the header says; pixels are not
/// decoded. Errors: files, content that is not an image of that coding.
[[nodiscard]] Result<glm::ivec2> atlasTextureSize(const std::filesystem::path& path,
                                                  const AtlasTexture& texture,
                                                  const Limits& limits);
/// Reads one texture, without a check of the depths and without the alpha that "sRGB8-opaque" has
/// elsewhere. Every rectangle of the header must lie inside its view and its page. Errors: files;
/// (invalidInput) another size, channels or bits than the header says.
[[nodiscard]] Result<void> readAtlasTexture(const std::filesystem::path& path,
                                            const AtlasHeader& header, const AtlasTexture& texture,
                                            AtlasPage& page, const Limits& limits);

/// The environment of an atlas; null: it has none. Errors: files, readEnvironmentPart().
[[nodiscard]] Result<std::shared_ptr<const Environment>> readAtlasEnvironment(
    const std::filesystem::path& path, const AtlasHeader& header, Job& job);

/// The path is a folder that holds an atlas.json, or that file itself.
[[nodiscard]] bool isAtlasFolder(const std::filesystem::path& path);
/// An OpenEXR file that holds an atlas and no bundle.
[[nodiscard]] bool isExrAtlas(const ExrReader& reader);

}  // namespace stx
