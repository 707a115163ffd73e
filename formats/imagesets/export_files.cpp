#include "formats/imagesets/export_files.hpp"

#include <algorithm>
#include <cmath>

#include "formats/exr/exr_file.hpp"
#include "formats/files/files.hpp"
#include "formats/files/messages.hpp"
#include "formats/images/images.hpp"
#include "formats/images/npy.hpp"
#include "formats/imagesets/set_view.hpp"
#include "lib/base/unique_names.hpp"

namespace stx::imagesets {

using std::filesystem::path;

namespace {

Result<void> writeExr(const path& file, int width, int height,
                      const std::vector<ExrConstPixels>& pixels) {
    ExrPart part;
    part.width = part.displayWidth = width;
    part.height = part.displayHeight = height;
    for (const ExrConstPixels& p : pixels)
        part.channels.push_back({p.channel, ExrChannel::Type::float32});
    STX_TRY(auto output, OutputFile::create(file));
    STX_TRY(auto writer, ExrWriter::create(output, {part}));
    STX_CHECK(writer.writePart(0, pixels));
    STX_CHECK(writer.finish());
    return output.commit();
}

/// How far a value may be from a code of 16 bits that it came from: what floats leave of 65535.
constexpr float kSameCode = 0.02f;

/// The code of 16 bits of a linear colour's part, or of its alpha, before it is rounded.
float codeOf(float value, bool alpha) {
    const float coded = alpha ? value : srgbFromLinear(value);
    return std::clamp(coded, 0.0f, 1.0f) * 65535.0f;
}

std::vector<glm::u16vec4> codedColours(const RgbaFloatImage& image) {
    std::vector<glm::u16vec4> out(image.count());
    std::ranges::transform(image.pixels(), out.begin(), [](const glm::vec4& c) {
        glm::u16vec4 code;
        for (int k = 0; k < 4; ++k)
            code[k] = static_cast<std::uint16_t>(std::lround(codeOf(c[k], k == 3)));
        return code;
    });
    return out;
}

}  // namespace

std::vector<std::string> fileNames(const Bundle& bundle) {
    std::vector<std::string> names;
    UniqueNames unique("_", 2);
    for (const ReferenceView& view : bundle.views) {
        std::string name;
        for (const char c : view.name) {
            const bool fine = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                              (c >= '0' && c <= '9') || c == '-' || c == '_';
            name += fine ? c : '_';
        }
        if (name.empty()) name = "view";
        names.push_back(unique.take(name.substr(0, 100)));
    }
    return names;
}

Result<void> writeColour(const ReferenceView& view, const path& withoutEnding,
                         const ExportOptions& options) {
    const int width = view.texture.width(), height = view.texture.height();
    if (view.texture.isLinear() && options.linearAsPng) {
        const auto codes = codedColours(*view.texture.rgbaFloat());
        STX_TRY(const auto png, encodePng(width, height, 4, 16, codes.data(), true));
        return writeFile(path(withoutEnding) += ".png", png);
    }
    if (const auto* bytes = view.texture.rgba8()) {
        STX_TRY(const auto png, encodePng(width, height, 4, 8, bytes->data(), true));
        return writeFile(path(withoutEnding) += ".png", png);
    }
    // OpenEXR's colours are premultiplied.
    RgbaFloatImage image = *view.texture.rgbaFloat();
    for (glm::vec4& c : image.pixels()) c = glm::vec4(glm::vec3(c) * c.a, c.a);
    const float* at = &image.data()->x;
    return writeExr(path(withoutEnding) += ".exr", width, height,
                    {{"R", at, 4}, {"G", at + 1, 4}, {"B", at + 2, 4}, {"A", at + 3, 4}});
}

const char* colourEnding(bool linear, const ExportOptions& options) {
    return linear && !options.linearAsPng ? ".exr" : ".png";
}

void ColourLoss::look(const ReferenceView& view, const ExportOptions& options) {
    const RgbaFloatImage* image = view.texture.rgbaFloat();
    if (!image || !options.linearAsPng) return;
    for (const glm::vec4& c : image->pixels()) {
        // What is under no coverage is filled again by who reads it.
        if (c.a <= 0.0f) continue;
        for (int k = 0; k < 4; ++k) {
            const float code = codeOf(c[k], k == 3);
            if (c[k] < 0.0f || c[k] > 1.0f) clipped_ = true;
            if (std::abs(code - std::round(code)) > kSameCode) rounded_ = true;
        }
    }
}

void ColourLoss::note(Job& job) const {
    if (clipped_)
        job.note("linear colour becomes 16-bit sRGB; values above 1 are clipped");
    else if (rounded_)
        job.note("linear colour becomes 16-bit sRGB");
}

double integerDepthUnit(double farthest, const DepthReach& reach, Job& job) {
    // Rounded to so many the farthest distance is off by 0.05 %, a quarter of what counts as one
    // surface (0.2 %).
    constexpr double kFewestSteps = 1000;
    constexpr double kCodes = 65535;
    const bool small = farthest > 0 && farthest < kFewestSteps * kMillimetre;
    const double unit = small ? reach.small * farthest / kCodes
                              : std::max(kMillimetre, reach.large * farthest / kCodes);
    job.note(fmt::format("depth is rounded to steps of {:.3g} scene units{}", unit,
                         unit == kMillimetre
                             ? ""
                             : " (integer_depth_scale), which nerfstudio must be given as "
                               "--depth-unit-scale-factor"));
    return unit;
}

const char* endingOf(ExportOptions::Depth depth) {
    return depth == ExportOptions::Depth::exr   ? ".exr"
           : depth == ExportOptions::Depth::png ? ".png"
                                                : ".npy";
}

Result<void> writeFloatDepth(const ReferenceView& view, const path& file) {
    Image<float> depth = view.depth;
    // Infinity is nothing, for everybody; 0 is not known.
    if (view.depthMayBeUnknown())
        for (std::size_t i = 0; i < depth.count(); ++i)
            if (!hasPoint(depth.data()[i]) && view.texture.at(i).a >= 1.0f) depth.data()[i] = 0;
    if (file.extension() == ".npy") return writeFile(file, encodeNumpy(depth));
    return writeExr(file, depth.width(), depth.height(), {{"Z", depth.data(), 1}});
}

Result<void> writeIntegerDepth(const ReferenceView& view, const path& file,
                               const std::function<double(double)>& code) {
    std::vector<std::uint16_t> codes(view.depth.count());
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const float d = view.depth.data()[i];
        // A valid point never becomes "none".
        codes[i] = !hasPoint(d)
                       ? std::uint16_t{0}
                       : static_cast<std::uint16_t>(std::clamp(std::round(code(d)), 1.0, 65535.0));
    }
    STX_TRY(const auto png,
            encodePng(view.depth.width(), view.depth.height(), 1, 16, codes.data(), false));
    return writeFile(file, png);
}

Result<void> makeImageFolders(const std::filesystem::path& in,
                              const std::filesystem::path& folder) {
    std::error_code ec;
    for (const char* sub : {"images", "depth"}) {
        std::filesystem::create_directory(in / sub, ec);
        if (ec)
            return failAt(inQuotes(folder.string()), ErrorCode::io, "cannot be written: {}",
                          ec.message());
    }
    return {};
}

Result<std::string> setText(const OutputJson& json) {
    try {
        return json.dump(1) + "\n";
    } catch (const std::exception&) {
        return fail(ErrorCode::invalidInput, "the title or a view's name is not valid UTF-8");
    }
}

void addOwnKeys(OutputJson& json, const ViewHeader& view, glm::dvec3 origin) {
    const glm::dquat& q = view.camera.orientation;
    json["stx:name"] = view.name;
    const glm::dvec3& p = view.camera.position;
    if (origin != glm::dvec3(0.0)) json["stx:position"] = {p.x, p.y, p.z};
    json["stx:quaternion"] = {q.x, q.y, q.z, q.w};
    json["nearPlane"] = view.nearPlane;
    json["farPlane"] = view.farPlane;
    json["depthBits"] = view.depthBits;
    if (view.noDepth == NoDepth::unknown) json["stx:noDepth"] = nameOf(view.noDepth);
    if (!view.refined.steps.empty()) json["stx:refined"] = view.refined.text();
    if (view.pruned) json["stx:pruned"] = true;
    if (view.background) json["stx:background"] = true;
}

OutputJson transformsFrame(const ViewHeader& view, bool linear, const std::string& name,
                           const ExportOptions& options, glm::dvec3 origin) {
    const Camera& c = view.camera;
    OutputJson frame;
    frame["file_path"] = fmt::format("images/{}{}", name, colourEnding(linear, options));
    frame["depth_file_path"] = fmt::format("depth/{}{}", name, endingOf(options.depth));
    frame["camera_model"] = c.orthographic ? "ORTHOGRAPHIC" : "PINHOLE";
    frame["w"] = c.width;
    frame["h"] = c.height;
    frame["fl_x"] = c.fx;
    frame["fl_y"] = c.fy;
    frame["cx"] = c.cx;
    frame["cy"] = c.cy;
    glm::dmat4 m = c.worldFromCamera();
    m[3] += glm::dvec4(origin, 0.0);
    for (int row = 0; row < 4; ++row)
        frame["transform_matrix"].push_back({m[0][row], m[1][row], m[2][row], m[3][row]});
    addOwnKeys(frame, view, origin);
    return frame;
}

}  // namespace stx::imagesets
