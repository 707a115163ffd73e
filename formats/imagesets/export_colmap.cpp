#include "formats/imagesets/export_colmap.hpp"

#include <atomic>
#include <bit>
#include <map>

#include "formats/files/messages.hpp"
#include "formats/images/images.hpp"
#include "formats/imagesets/colmap.hpp"

namespace stx::imagesets {
namespace {

using std::filesystem::path;

Result<void> writeWhole(const path& file, const std::string& text) {
    return writeFile(file, std::as_bytes(std::span(text)));
}

Result<void> writePicture(const Texture& texture, const path& file) {
    const int width = texture.width(), height = texture.height();
    if (const auto* bytes = texture.rgba8()) {
        STX_TRY(const auto png, encodePng(width, height, 4, 8, bytes->data(), true));
        return writeFile(file, png);
    }
    Rgba8Image coded(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const glm::vec4 c = texture.at(x, y);
            const glm::vec4 s(srgbFromLinear(c.r), srgbFromLinear(c.g), srgbFromLinear(c.b), c.a);
            coded.at(x, y) = glm::u8vec4(glm::clamp(s, 0.0f, 1.0f) * 255.0f + 0.5f);
        }
    STX_TRY(const auto png, encodePng(width, height, 4, 8, coded.data(), true));
    return writeFile(file, png);
}

/// `w&h&1&` and little-endian floats, 0 where there is no point.
Result<void> writeDepth(const Image<float>& depth, const path& file) {
    std::string text = fmt::format("{}&{}&1&", depth.width(), depth.height());
    text.reserve(text.size() + depth.count() * 4);
    for (const float d : depth.pixels()) {
        const auto bits = std::bit_cast<std::uint32_t>(hasPoint(d) ? d : 0.0f);
        for (int shift = 0; shift < 32; shift += 8) text += static_cast<char>(bits >> shift & 255);
    }
    return writeWhole(file, text);
}

/// cameras.txt and images.txt. Views with the same intrinsics share a camera.
std::pair<std::string, std::string> modelOf(const Bundle& bundle,
                                            const std::vector<std::string>& names) {
    std::string cameras =
        fmt::format("{}\n# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n", kWrittenByUs);
    std::string images = fmt::format(
        "{}\n# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME; then a line of points\n",
        kWrittenByUs);
    std::map<std::string, std::size_t> known;
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        const Camera& c = bundle.views[i].camera;
        const auto line =
            fmt::format("PINHOLE {} {} {} {} {} {}", c.width, c.height, c.fx, c.fy, c.cx, c.cy);
        const auto [camera, fresh] = known.emplace(line, known.size() + 1);
        if (fresh) cameras += fmt::format("{} {}\n", camera->second, line);
        // Half a turn about x: from our axes to x right, y down, z forward.
        const glm::dquat q = glm::conjugate(c.orientation * glm::dquat(0, 1, 0, 0));
        const glm::dvec3 t = -(q * (c.position + bundle.origin));
        images += fmt::format("{} {} {} {} {} {} {} {} {} {}.png\n\n", i + 1, q.w, q.x, q.y, q.z,
                              t.x, t.y, t.z, camera->second, names[i]);
    }
    return {std::move(cameras), std::move(images)};
}

}  // namespace

Result<void> exportColmap(const ViewTable& table, const path& folder,
                          const std::vector<std::string>& names, const ExportOptions& options,
                          Job& job) {
    const Bundle& bundle = table.about();
    std::vector<std::string> own{"sparse/cameras.txt", "sparse/images.txt", "sparse/points3D.txt"};
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        if (bundle.views[i].camera.orthographic)
            return fail(ErrorCode::invalidInput,
                        "view '{}' is orthographic; COLMAP has perspective cameras only (--cameras "
                        "transforms has both)",
                        bundle.views[i].name);
        if (bundle.views[i].pruned)
            job.note(
                "the views are pruned, which a COLMAP workspace cannot say: what reads it takes "
                "the "
                "pixels left out for empty ones (--cameras transforms keeps the mark)");
        own.push_back(fmt::format("images/{}.png", names[i]));
        own.push_back(fmt::format("stereo/depth_maps/{}.png.geometric.bin", names[i]));
    }
    STX_TRY(auto output, OutputFolder::create(folder, {options.noClobber}, own));
    const path& root = output.temporaryPath();
    for (const char* sub : {"images", "sparse", "stereo/depth_maps"}) {
        std::error_code ec;
        std::filesystem::create_directories(root / sub, ec);
        if (ec)
            return failAt(inQuotes(folder.string()), ErrorCode::io, "cannot be written: {}",
                          ec.message());
    }
    const auto [cameras, images] = modelOf(bundle, names);
    STX_CHECK(writeWhole(root / "sparse/cameras.txt", cameras));
    STX_CHECK(writeWhole(root / "sparse/images.txt", images));
    // COLMAP opens no model without it.
    STX_CHECK(
        writeWhole(root / "sparse/points3D.txt", fmt::format("{}: no points\n", kWrittenByUs)));
    std::atomic<bool> linear = false, clipped = false;
    const auto write = [&](std::size_t i,
                           const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
        if (view->texture.isLinear()) linear = true;
        if (isBeyondWhite(view->texture)) clipped = true;
        STX_CHECK(writePicture(view->texture, root / fmt::format("images/{}.png", names[i])));
        return writeDepth(view->depth,
                          root / fmt::format("stereo/depth_maps/{}.png.geometric.bin", names[i]));
    };
    STX_CHECK(forEachView(table, peak::kExport, job, write));
    Rgba8Loss{.linear = linear, .clipped = clipped}.note(job);
    return output.commit();
}

}  // namespace stx::imagesets
