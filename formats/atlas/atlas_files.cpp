#include "formats/atlas/atlas_files.hpp"

#include <algorithm>
#include <functional>

#include "formats/atlas/atlas_floats.hpp"
#include "formats/atlas/atlas_json.hpp"
#include "formats/atlas/atlas_textures.hpp"
#include "formats/exr/environment_exr.hpp"
#include "formats/files/named_files.hpp"
#include "formats/files/no_case.hpp"
#include "formats/images/images.hpp"
#include "lib/base/parallel_try.hpp"
#include "lib/model/peak_memory.hpp"

namespace stx {

namespace fs = std::filesystem;

namespace {

constexpr const char* kIndexFile = "atlas.json";
constexpr const char* kEnvironmentFile = "environment.exr";
constexpr const char* kOpaque = "sRGB8-opaque";

bool isExr(const fs::path& path, const AtlasSaveOptions& options) {
    return !options.folder && lowerExtension(path) == ".exr";
}

/// All that a folder of ours may hold, for the replacing of one. Digits stand for any number.
std::vector<std::string> ownNames() {
    std::vector<std::string> names = {kIndexFile, kEnvironmentFile};
    for (const char* attribute :
         {"colour", "depth", "normal", "splat", "metallic_roughness", "emissive"}) {
        for (const char* ending : {".png", "_1.png", ".exr", "_1.exr"})
            names.push_back(std::string(attribute) + ending);
    }
    names.insert(names.end(), {"colour.jpg", "colour_1.jpg"});
    return names;
}

std::string fileName(const AtlasTexture& t) {
    const char* ending = t.coding == "float" ? "exr" : t.coding == kOpaque ? "jpg" : "png";
    return t.page == 0 ? fmt::format("{}.{}", t.attribute, ending)
                       : fmt::format("{}_{}.{}", t.attribute, t.page, ending);
}

/// Everything but the pixels, and which textures there will be; `jpeg` in folders only.
AtlasHeader headerOf(const Atlas& atlas, bool inOneExr, bool jpeg = false) {
    AtlasHeader header;
    Atlas& a = header.atlas;
    a.views = atlas.views;
    a.rectangles = atlas.rectangles;
    a.layout = atlas.layout;
    a.padding = atlas.padding;
    a.bounds = atlas.bounds;
    a.origin = atlas.origin;
    a.title = atlas.title;
    if (atlas.environment && !inOneExr) header.environmentFile = kEnvironmentFile;
    a.time = atlas.time;
    a.duration = atlas.duration;
    a.sourcePixels = atlas.sourcePixels;
    a.keptPixels = atlas.keptPixels;
    a.objects = atlas.objects;
    header.pages = static_cast<int>(atlas.pages.size());
    header.pageWidth = atlas.width();
    header.pageHeight = atlas.height();
    header.linear = atlas.pages[0].texture.isLinear();
    bool floats = inOneExr, only8 = true;
    for (const auto& v : atlas.views) {
        floats = floats || v.depthBits == 32;
        only8 = only8 && v.depthBits == 8;
    }
    for (int i = 0; i < header.pages; ++i) {
        const AtlasPage& page = atlas.pages[i];
        const auto add = [&](const char* attribute, const char* coding) -> AtlasTexture& {
            AtlasTexture& t = header.textures.emplace_back();
            t.attribute = attribute;
            t.page = i;
            t.coding = coding;
            t.width = header.pageWidth;
            t.height = header.pageHeight;
            if (!inOneExr) t.file = fileName(t);
            return t;
        };
        add("colour", header.linear || inOneExr ? "float" : jpeg ? kOpaque : "sRGB8");
        add("depth", floats ? "float" : only8 ? "code8" : "code16");
        if (jpeg) header.textures.back().addSecond();
        if (!page.normal.empty()) add("normal", floats ? "float" : "snorm16");
        if (!page.splatU.empty()) {
            AtlasTexture& t = add("splat", floats ? "float" : "snorm16");
            if (!floats) {
                t.scale = std::max(largestComponent(page.splatU), largestComponent(page.splatV));
                t.addSecond();
            }
        }
        if (!page.metallicRoughness.empty()) add("metallic_roughness", floats ? "float" : "unorm8");
        if (!page.emissive.empty()) {
            AtlasTexture& t = add("emissive", floats ? "float" : "sRGB8-emissive");
            if (!floats) t.scale = emissiveScale(page.emissive);
        }
    }
    return header;
}

Result<Bytes> encodeDepth(const Image<std::uint16_t>& codes, const AtlasTexture& t,
                          const Texture& colour) {
    const int bits = t.coding == "code16" ? 16 : 8;
    Image<std::uint16_t> both;
    if (t.hasSecond()) both = withAlpha(codes, *colour.rgba8(), t, bits == 16 ? 257 : 1);
    const auto values = (t.hasSecond() ? both : codes).pixels();
    if (bits == 16) return encodePng(t.width, t.height, 1, 16, values.data(), false);
    const std::vector<std::uint8_t> bytes(values.begin(), values.end());
    return encodePng(t.width, t.height, 1, 8, bytes.data(), false);
}

/// Called with the number of a page whose depth is not looked at any more.
using DepthIsCoded = std::function<void(int page)>;

Result<Bytes> encodeImage(const Atlas& atlas, const AtlasTexture& t, int jpegQuality,
                          const DepthIsCoded& depthIsCoded, Job& job) {
    const AtlasPage& page = atlas.pages[t.page];
    if (t.coding == kOpaque)
        return encodeJpeg(t.width, t.height, 3, opaqueBytes(page.texture).data(), jpegQuality);
    if (t.attribute == "colour")
        return encodePng(t.width, t.height, 4, 8, page.texture.rgba8()->data(), true);
    if (t.attribute == "depth") {
        const DepthCodes coded = depthCodes(atlas, t.page);
        if (coded.outside) job.note("depth outside of all rectangles was dropped from the atlas");
        if (coded.clamped)
            job.note("depth beyond nearPlane or farPlane was clamped to them in the atlas");
        if (depthIsCoded) depthIsCoded(t.page);
        return encodeDepth(coded.codes, t, page.texture);
    }
    if (t.attribute == "metallic_roughness")
        return encodePng(t.width, t.height, 3, 8, bytesOf(page.metallicRoughness).data(), false);
    if (t.attribute == "emissive")
        return encodePng(t.width, t.height, 3, 8, bytesOf(page.emissive, t.scale).data(), true);
    std::vector<std::uint16_t> rgb(static_cast<std::size_t>(t.width) * t.height * 3);
    if (t.attribute == "normal") {
        codeVectors(page.normal, t.scale, 0, 0, t.width, rgb);
    } else {
        codeVectors(page.splatU, t.scale, 0, 0, t.width, rgb);
        codeVectors(page.splatV, t.scale, t.secondX, t.secondY, t.width, rgb);
    }
    return encodePng(t.width, t.height, 3, 16, rgb.data(), false);
}

/// JPEG has neither floats nor OpenEXR's exact depth beside it.
Result<void> checkJpeg(const AtlasHeader& header, const fs::path& path) {
    const auto refuse = [&](const char* why) {
        return failAt(fmt::format("'{}'", path.string()), ErrorCode::unsupported,
                      "JPEG colour is not possible here, since {}; leave out --colour jpeg", why);
    };
    if (header.linear) return refuse("colour is linear light in floats");
    for (const auto& t : header.textures) {
        if (t.attribute == "depth" && t.coding == "float")
            return refuse("depth has 32 bits, which OpenEXR alone holds");
    }
    return {};
}

Result<void> writeFolder(const Atlas& atlas, const fs::path& path, Job& job,
                         const AtlasSaveOptions& options, const DepthIsCoded& depthIsCoded) {
    const AtlasHeader header = headerOf(atlas, false, options.jpegQuality > 0);
    if (options.jpegQuality > 0) STX_CHECK(checkJpeg(header, path));
    noteCoarseScales(atlas, header.textures, job);
    STX_TRY(auto folder, OutputFolder::create(path, options.output, ownNames()));
    STX_CHECK(parallelTry(0, header.textures.size(), [&](std::size_t i) -> Result<void> {
        const AtlasTexture& t = header.textures[i];
        const fs::path file = folder.temporaryPath() / t.file;
        if (t.coding == "float") return writeFloatImage(header, atlas.pages[t.page], t, file);
        STX_TRY(const auto bytes, encodeImage(atlas, t, options.jpegQuality, depthIsCoded, job));
        return writeFile(file, bytes);
    }));
    if (atlas.environment)
        STX_CHECK(writeEnvironmentExr(*atlas.environment, folder.temporaryPath() / kEnvironmentFile,
                                      job));
    const std::string json = atlasJson(header);
    STX_CHECK(writeFile(folder.temporaryPath() / kIndexFile, std::as_bytes(std::span(json))));
    STX_CHECK(job.checkCancelled());
    return folder.commit();
}

Result<void> writeExr(const Atlas& atlas, const fs::path& path, Job& job,
                      OutputFile::Options options) {
    const AtlasHeader header = headerOf(atlas, true);
    std::vector<std::vector<std::string>> attributes(header.pages);
    for (const auto& t : header.textures) attributes[t.page].push_back(t.attribute);
    std::vector<ExrPart> parts;
    for (int i = 0; i < header.pages; ++i) {
        parts.push_back(exrPartOf(header, attributes[i]));
        parts.back().name = fmt::format("page {}", i);
    }
    parts[0].attributes["stx:version"] = std::int64_t{1};
    parts[0].attributes["stx:kind"] = std::string("atlas");
    parts[0].attributes["stx:atlas"] = atlasJson(header);
    std::optional<ExrEnvironmentPart> environment;
    if (atlas.environment) {
        STX_TRY(environment, environmentPart(*atlas.environment, job));
        joinParts(environment->part, parts);
        parts.push_back(environment->part);
    }
    STX_TRY(auto file, OutputFile::create(path, options));
    STX_TRY(auto writer, ExrWriter::create(file, parts));
    for (int i = 0; i < header.pages; ++i) {
        STX_CHECK(job.checkCancelled());
        STX_CHECK(writePage(writer, i, atlas.pages[i], attributes[i]));
    }
    if (environment) STX_CHECK(writeEnvironmentPart(writer, header.pages, *environment));
    STX_CHECK(writer.finish());
    return file.commit();
}

Result<void> checkPartSize(const ExrReader& reader, int part, const AtlasHeader& header) {
    const ExrPart& p = reader.parts()[part];
    if (p.width == header.pageWidth && p.height == header.pageHeight) return {};
    return failAt(reader.where(), ErrorCode::invalidInput,
                  "part {} has {}x{} pixels, but the atlas' pages {}x{}", part, p.width, p.height,
                  header.pageWidth, header.pageHeight);
}

/// The picture at (x0, y0) of an image that is `width` pixels wide; low bytes where `to` has those.
template <class From, class To>
void takePicture(const std::vector<From>& from, int width, int x0, int y0, Image<To>& to) {
    for (int y = 0; y < to.height(); ++y) {
        const auto* source = from.data() + static_cast<std::size_t>(y + y0) * width + x0;
        for (To& value : to.row(y)) value = static_cast<To>(*source++);
    }
}

/// One image of a folder into its page; alpha that is in the depth texture into `coverage`.
Result<void> readImage(const fs::path& file, const AtlasHeader& header, const AtlasTexture& t,
                       AtlasPage& page, Image<std::uint8_t>& coverage, const Limits& limits) {
    const auto where = fmt::format("'{}'", file.string());
    if (t.coding == "float") {
        STX_TRY(const auto reader, ExrReader::open(file, limits));
        STX_CHECK(checkPartSize(reader, 0, header));
        return readFloats(reader, 0, {t.attribute}, header.linear, page);
    }
    STX_TRY(auto bytes, readFile(file, limits));
    STX_TRY(auto image, decodeImage(bytes, file.string(), limits));
    const int channels = t.attribute == "depth" ? 1 : t.coding == "sRGB8" ? 4 : 3;
    const bool material = t.attribute == "metallic_roughness" || t.attribute == "emissive";
    const int bits = t.attribute == "colour" || t.coding == "code8" || material ? 8 : 16;
    if (image.width != t.width || image.height != t.height || image.channels != channels ||
        image.bits() != bits)
        return failAt(where, ErrorCode::invalidInput,
                      "it has {}x{} pixels of {} channels with {} bits, but atlas.json says {}x{} "
                      "of {} with {}",
                      image.width, image.height, image.channels, image.bits(), t.width, t.height,
                      channels, bits);
    if (t.attribute == "colour") {
        // The depth texture's alpha is put in when all images are read.
        page.texture = Texture(rgba8From(image));
        if (t.coding == kOpaque)
            page.colourFile.jpeg = std::make_shared<const Bytes>(std::move(bytes));
        return {};
    }
    if (t.attribute == "depth") {
        Image<std::uint16_t> codes(header.pageWidth, header.pageHeight);
        if (t.hasSecond()) coverage = Image<std::uint8_t>(codes.width(), codes.height());
        const auto fill = [&](const auto& from) {
            takePicture(from, t.width, 0, 0, codes);
            // 16-bit alpha is the 8-bit one twice.
            if (t.hasSecond()) takePicture(from, t.width, t.secondX, t.secondY, coverage);
        };
        if (bits == 8) fill(std::get<0>(image.values));
        if (bits == 16) fill(std::get<1>(image.values));
        STX_TRY(page.depth, within(where, depthFromCodes(header.atlas, t.page, codes)));
        return {};
    }
    if (material) {
        const auto& bytes8 = std::get<0>(image.values);
        const glm::ivec2 size(t.width, t.height);
        if (t.attribute == "emissive")
            page.emissive = emissiveFrom(bytes8, t.scale, size);
        else
            page.metallicRoughness = metallicRoughnessFrom(bytes8, size);
        return {};
    }
    const auto& rgb = std::get<1>(image.values);
    const glm::ivec2 size(header.pageWidth, header.pageHeight);
    if (t.attribute == "normal") page.normal = vectorsFromCodes(rgb, t.scale, 0, 0, t.width, size);
    if (t.attribute == "splat") {
        page.splatU = vectorsFromCodes(rgb, t.scale, 0, 0, t.width, size);
        page.splatV = vectorsFromCodes(rgb, t.scale, t.secondX, t.secondY, t.width, size);
    }
    return {};
}

/// Rectangles must name views and pages that exist before depth codes are looked up by them.
Result<void> checkRectangles(const AtlasHeader& header, const std::string& where) {
    for (std::size_t i = 0; i < header.atlas.rectangles.size(); ++i) {
        const auto& r = header.atlas.rectangles[i];
        if (r.view >= static_cast<int>(header.atlas.views.size()) || r.page >= header.pages ||
            r.atlasX + r.atlasWidth() > header.pageWidth ||
            r.atlasY + r.atlasHeight() > header.pageHeight)
            return failAt(where, ErrorCode::invalidInput,
                          "rectangles[{}] names a view or page that does not exist, or leaves its "
                          "page",
                          i);
    }
    return {};
}

Result<void> checkMemory(const AtlasHeader& header, const std::string& where,
                         const Limits& limits) {
    std::uint64_t each = 0;
    for (const auto& t : header.textures)
        each += t.attribute == "colour"  ? (header.linear ? 16 : 4)
                : t.attribute == "depth" ? 4
                : t.attribute == "splat" ? 24
                                         : 12;
    const auto pixels = static_cast<std::uint64_t>(header.pageWidth) * header.pageHeight;
    return within(where, limits.checkAllocation(pixels, each, "the atlas"));
}

fs::path setFolderOf(const fs::path& path) {
    return path.filename() == kIndexFile ? path.parent_path() : path;
}

Result<AtlasHeader> exrHeader(const ExrReader& reader, const Limits& limits,
                              AtlasChecks checks = AtlasChecks::all) {
    const auto* json = reader.parts()[0].attribute<std::string>("stx:atlas");
    if (!json || !isExrAtlas(reader))
        return failAt(reader.where(), ErrorCode::invalidInput, "it holds no stx atlas");
    STX_TRY(auto header, atlasFromJson(*json, reader.where() + ": stx:atlas", limits, checks));
    const auto pages =
        static_cast<int>(reader.parts().size()) - (environmentPartOf(reader) >= 0 ? 1 : 0);
    if (pages != header.pages)
        return failAt(reader.where(), ErrorCode::invalidInput,
                      "it has {} parts, but the atlas {} pages", pages, header.pages);
    for (auto& t : header.textures) {
        if (t.coding != "float")
            return failAt(reader.where(), ErrorCode::invalidInput,
                          "the coding of its {} texture is '{}', not float", t.attribute, t.coding);
    }
    if (checks == AtlasChecks::format) return header;
    for (int i = 0; i < header.pages; ++i) STX_CHECK(checkPartSize(reader, i, header));
    STX_CHECK(checkRectangles(header, reader.where()));
    return header;
}

Result<AtlasHeader> folderHeader(const fs::path& path, const Limits& limits,
                                 AtlasChecks checks = AtlasChecks::all) {
    const fs::path index = setFolderOf(path) / kIndexFile;
    rememberNamedFile(index);
    STX_TRY(const auto bytes, readFile(index, limits));
    const auto where = fmt::format("'{}'", index.string());
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    STX_TRY(auto header, atlasFromJson(text, where, limits, checks));
    if (checks == AtlasChecks::all) STX_CHECK(checkRectangles(header, where));
    return header;
}

Result<Atlas> checked(Atlas atlas, const AtlasHeader& header, const std::string& where) {
    STX_CHECK(within(where, atlas.check()));
    for (const AtlasTexture& t : header.textures) {
        // Integer codes stand for distances only; floats may be anything.
        if (t.attribute != "depth" || t.coding != "float") continue;
        for (const float d : atlas.pages[t.page].depth.pixels())
            if (!(d >= 0)) return tl::unexpected(Error(depthError(d).value()).at(where));
    }
    return atlas;
}

Result<Atlas> readFolder(const fs::path& path, Job& job) {
    STX_TRY(const auto header, folderHeader(path, job.limits));
    const fs::path folder = setFolderOf(path);
    const auto where = fmt::format("'{}'", folder.string());
    STX_CHECK(checkMemory(header, where, job.limits));
    Atlas atlas = header.atlas;
    atlas.pages.resize(static_cast<std::size_t>(header.pages));
    std::vector<Image<std::uint8_t>> coverage(atlas.pages.size());
    STX_CHECK(parallelTry(0, header.textures.size(), [&](std::size_t i) -> Result<void> {
        const AtlasTexture& t = header.textures[i];
        STX_TRY(const auto file, within(where, resolveInside(folder, t.file, job.limits)));
        return readImage(file, header, t, atlas.pages[t.page], coverage[t.page], job.limits);
    }));
    for (std::size_t i = 0; i < coverage.size(); ++i) {
        if (!coverage[i].empty()) setAlpha(*atlas.pages[i].texture.rgba8(), coverage[i]);
    }
    STX_SET(atlas.environment, readAtlasEnvironment(path, header, job));
    return checked(std::move(atlas), header, where);
}

Result<Atlas> readExr(const fs::path& path, Job& job) {
    STX_TRY(const auto reader, ExrReader::open(path, job.limits));
    STX_TRY(const auto header, exrHeader(reader, job.limits));
    STX_CHECK(checkMemory(header, reader.where(), job.limits));
    Atlas atlas = header.atlas;
    atlas.pages.resize(static_cast<std::size_t>(header.pages));
    for (int i = 0; i < header.pages; ++i) {
        std::vector<std::string> attributes;
        for (const auto& t : header.textures) {
            if (t.page == i) attributes.push_back(t.attribute);
        }
        STX_CHECK(readFloats(reader, i, attributes, header.linear, atlas.pages[i]));
    }
    if (const int at = environmentPartOf(reader); at >= 0)
        STX_SET(atlas.environment, readEnvironmentPart(reader, at, job));
    return checked(std::move(atlas), header, reader.where());
}

/// A file is an OpenEXR atlas unless it is the folder's index.
bool isFolderPath(const fs::path& path) {
    std::error_code ec;
    return fs::is_directory(path, ec) || path.filename() == kIndexFile;
}

}  // namespace

void AtlasTexture::addSecond() {
    (width <= height ? secondX : secondY) = std::min(width, height);
    width += secondX;
    height += secondY;
}

double AtlasHeader::used() const {
    const auto views = static_cast<int>(atlas.views.size());
    return static_cast<double>(coveredPixels(atlas.rectangles, 0, views)) /
           (static_cast<double>(pageWidth) * pageHeight * pages);
}

namespace {

Result<void> writeAny(const Atlas& atlas, const fs::path& path, Job& job,
                      const AtlasSaveOptions& options, const DepthIsCoded& depthIsCoded) {
    STX_CHECK(atlas.check());
    if (!isExr(path, options)) return writeFolder(atlas, path, job, options, depthIsCoded);
    if (options.jpegQuality > 0)
        return failAt(fmt::format("'{}'", path.string()), ErrorCode::unsupported,
                      "an OpenEXR atlas holds no JPEG; name a folder instead of an .exr file");
    return writeExr(atlas, path, job, options.output);
}

}  // namespace

Result<void> writeAtlas(const Atlas& atlas, const fs::path& path, Job& job,
                        const AtlasSaveOptions& options) {
    return writeAny(atlas, path, job, options, {});
}

Result<void> writeAtlas(Atlas&& atlas, const fs::path& path, Job& job,
                        const AtlasSaveOptions& options) {
    Atlas own = std::move(atlas);
    return writeAny(own, path, job, options, [&own](int page) { own.pages[page].depth = {}; });
}

std::optional<std::uint64_t> bytesToWriteAtlas(const fs::path& path,
                                               const AtlasSaveOptions& options) {
    return isExr(path, options) ? std::optional(peak::kAtlasInExr.perPixel) : std::nullopt;
}

int largestImageSide(const Atlas& atlas, const fs::path& path, const AtlasSaveOptions& options) {
    int side = 0;
    for (const auto& t : headerOf(atlas, isExr(path, options), options.jpegQuality > 0).textures)
        side = std::max({side, t.width, t.height});
    return side;
}

Result<Atlas> readAtlas(const fs::path& path, Job& job) {
    return isFolderPath(path) ? readFolder(path, job) : readExr(path, job);
}

Result<AtlasHeader> readAtlasHeader(const fs::path& path, const Limits& limits,
                                    AtlasChecks checks) {
    if (!isFolderPath(path)) {
        STX_TRY(const auto reader, ExrReader::open(path, limits));
        STX_TRY(auto header, exrHeader(reader, limits, checks));
        // The file does not say which bytes of a part are whose; all are counted as its colour's.
        for (auto& t : header.textures)
            t.bytes = t.attribute == "colour" ? reader.parts()[t.page].bytes : 0;
        return header;
    }
    STX_TRY(auto header, folderHeader(path, limits, checks));
    for (auto& t : header.textures) {
        std::error_code ec;
        if (const auto file = resolveInside(setFolderOf(path), t.file, limits)) {
            const auto size = fs::file_size(*file, ec);
            t.bytes = ec ? 0 : size;
        }
    }
    return header;
}

Result<glm::ivec2> atlasTextureSize(const fs::path& path, const AtlasTexture& texture,
                                    const Limits& limits) {
    const auto sizeOf = [](const ExrPart& part) { return glm::ivec2(part.width, part.height); };
    if (!isFolderPath(path)) {
        STX_TRY(const auto reader, ExrReader::open(path, limits));
        return sizeOf(reader.parts().at(static_cast<std::size_t>(texture.page)));
    }
    STX_TRY(const auto file, resolveInside(setFolderOf(path), texture.file, limits));
    if (texture.coding == "float") {
        STX_TRY(const auto reader, ExrReader::open(file, limits));
        return sizeOf(reader.parts()[0]);
    }
    STX_TRY(const auto bytes, readFile(file, limits));
    STX_TRY(const auto info, within(fmt::format("'{}'", file.string()), probeImage(bytes)));
    return glm::ivec2(info.width, info.height);
}

Result<void> readAtlasTexture(const fs::path& path, const AtlasHeader& header,
                              const AtlasTexture& texture, AtlasPage& page, const Limits& limits) {
    STX_CHECK(checkMemory(header, fmt::format("'{}'", path.string()), limits));
    if (!isFolderPath(path)) {
        STX_TRY(const auto reader, ExrReader::open(path, limits));
        STX_CHECK(checkPartSize(reader, texture.page, header));
        return readFloats(reader, texture.page, {texture.attribute}, header.linear, page);
    }
    STX_TRY(const auto file, resolveInside(setFolderOf(path), texture.file, limits));
    Image<std::uint8_t> coverage;
    return readImage(file, header, texture, page, coverage, limits);
}

Result<std::shared_ptr<const Environment>> readAtlasEnvironment(const fs::path& path,
                                                                const AtlasHeader& header,
                                                                Job& job) {
    if (!header.environmentFile.empty()) {
        STX_TRY(const auto file,
                resolveInside(setFolderOf(path), header.environmentFile, job.limits));
        return readEnvironmentExr(file, job);
    }
    std::shared_ptr<const Environment> none;
    if (isFolderPath(path)) return none;
    STX_TRY(const auto reader, ExrReader::open(path, job.limits));
    const int at = environmentPartOf(reader);
    return at < 0 ? none : readEnvironmentPart(reader, at, job);
}

bool isAtlasFolder(const fs::path& path) {
    std::error_code ec;
    return fs::is_regular_file(setFolderOf(path) / kIndexFile, ec) && isFolderPath(path);
}

bool isExrAtlas(const ExrReader& reader) {
    const auto* kind = reader.parts()[0].attribute<std::string>("stx:kind");
    return kind && *kind == "atlas";
}

}  // namespace stx
