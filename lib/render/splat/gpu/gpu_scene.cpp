#include "lib/render/splat/gpu/gpu_scene.hpp"

#include "lib/model/peak_memory.hpp"
#include "lib/render/splat/others.hpp"

namespace stx::gpu {
namespace {

struct Layout {
    glm::ivec2 cell{1};
    glm::ivec2 grid{1};
    int layers = 1;
};

/// A grid of equal cells, one a page, as square as the pages allow, in as few layers as the device
/// needs. The pages of an atlas are large already: a layer each.
Result<Layout> layOut(const PageSet& set, const EglContext& context) {
    Layout out;
    for (const Page& page : set.pages())
        out.cell = glm::max(out.cell, glm::ivec2(page.width(), page.height()));
    const int limit = std::min(context.abilities().maxTextureSize, 65535);
    if (out.cell.x > limit || out.cell.y > limit)
        return fail(
            ErrorCode::unsupported,
            "the textures are up to {}x{} pixels, more than '{}' takes ({}x{}); use smaller views "
            "or --backend cpu",
            out.cell.x, out.cell.y, context.device().name, limit, limit);
    const int count = static_cast<int>(set.pages().size());
    // Width near height: columns * cell.x ~ rows * cell.y.
    const double side = std::sqrt(static_cast<double>(count) * out.cell.x * out.cell.y);
    out.grid.x = std::clamp(static_cast<int>(std::ceil(side / out.cell.x)), 1,
                            std::min(count, limit / out.cell.x));
    out.grid.y =
        std::clamp((count + out.grid.x - 1) / out.grid.x, 1, std::max(1, limit / out.cell.y));
    if (out.grid.x * out.grid.y < count)
        out.grid = glm::ivec2(limit / out.cell.x, limit / out.cell.y);
    const int perLayer = out.grid.x * out.grid.y;
    out.layers = (count + perLayer - 1) / perLayer;
    if (out.layers > context.abilities().maxTextureLayers)
        return fail(
            ErrorCode::unsupported,
            "{} views of {}x{} need {} texture layers, more than '{}' takes ({}); use fewer "
            "views or --backend cpu",
            count, out.cell.x, out.cell.y, out.layers, context.device().name,
            context.abilities().maxTextureLayers);
    return out;
}

/// `pixels` and `type` are what will be uploaded. OpenGL 3.3: the raster pipeline shares the scene.
GlTexture makeTexture(GLenum format, GLenum pixels, GLenum type, const Layout& layout) {
    auto texture = GlTexture::generate();
    glBindTexture(GL_TEXTURE_2D_ARRAY, texture.get());
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, static_cast<GLint>(format), layout.cell.x * layout.grid.x,
                 layout.cell.y * layout.grid.y, layout.layers, 0, pixels, type, nullptr);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, 0);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return texture;
}

}  // namespace

Result<GpuScene> GpuScene::upload(const PageSet& set, const EglContext& context, bool withNormals,
                                  bool leaveOut, Job& job) {
    STX_TRY(const Layout layout, layOut(set, context));
    GpuScene scene;
    scene.linear = set.linear();
    scene.hasSizes = std::any_of(set.views().begin(), set.views().end(),
                                 [](const PageView& v) { return v.hasSplats; });
    const int bytesEach =
        (scene.linear ? 8 : 4) + 4 + (withNormals ? 4 : 0) + (scene.hasSizes ? 8 : 4);
    const std::int64_t texels = static_cast<std::int64_t>(layout.cell.x) * layout.grid.x *
                                layout.cell.y * layout.grid.y * layout.layers;
    scene.textureBytes = texels * bytesEach;
    STX_CHECK(job.limits.checkAllocation(static_cast<std::uint64_t>(texels),
                                         static_cast<std::uint64_t>(bytesEach),
                                         "the textures of the reference views"));
    if (context.device().software)
        STX_CHECK(checkPeak(peak::kSplatsBySoftware, static_cast<std::uint64_t>(texels), 0, 0,
                            job.limits));
    STX_CHECK(context.check("starting"));
    scene.colour = scene.linear ? makeTexture(GL_RGBA16F, GL_RGBA, GL_FLOAT, layout)
                                : makeTexture(GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, layout);
    scene.depth = makeTexture(GL_R32F, GL_RED, GL_FLOAT, layout);
    if (withNormals) scene.normal = makeTexture(GL_RGBA8_SNORM, GL_RGBA, GL_BYTE, layout);
    scene.slope = scene.hasSizes ? makeTexture(GL_RGBA16I, GL_RGBA_INTEGER, GL_SHORT, layout)
                                 : makeTexture(GL_RG16I, GL_RG_INTEGER, GL_SHORT, layout);
    STX_CHECK(context.check("making the textures of the reference views"));

    splat::PreparedPages prepared = splat::preparePages(set, withNormals);
    if (leaveOut) splat::findOthers(set, prepared);
    const int perLayer = layout.grid.x * layout.grid.y;
    const int count = static_cast<int>(set.pages().size());
    std::vector<glm::ivec3> cells;
    for (int i = 0; i < count; ++i) {
        STX_CHECK(job.checkCancelled());
        const Page& page = set.pages()[i];
        splat::PreparedPage& ready = prepared.pages[i];
        const glm::ivec3 cell((i % perLayer % layout.grid.x) * layout.cell.x,
                              (i % perLayer / layout.grid.x) * layout.cell.y, i / perLayer);
        cells.push_back(cell);
        const auto put = [&](const GlTexture& texture, GLenum format, GLenum type,
                             const void* pixels) {
            glBindTexture(GL_TEXTURE_2D_ARRAY, texture.get());
            glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, cell.x, cell.y, cell.z, page.width(),
                            page.height(), 1, format, type, pixels);
        };
        glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
        if (const auto* image = page.texture->rgba8()) {
            put(scene.colour, GL_RGBA, GL_UNSIGNED_BYTE, image->data());
        } else if (const auto* floats = page.texture->rgbaFloat()) {
            put(scene.colour, GL_RGBA, GL_FLOAT, floats->data());
            for (const auto& p : floats->pixels())
                scene.maxColour = std::max({scene.maxColour, p.r, p.g, p.b});
        }
        put(scene.depth, GL_RED, GL_FLOAT, page.depth->data());
        if (withNormals) put(scene.normal, GL_RGBA, GL_BYTE, ready.normals.data());
        if (!scene.hasSizes) {
            put(scene.slope, GL_RG_INTEGER, GL_SHORT, ready.slopes.data());
        } else {
            std::vector<glm::i16vec4> coded(ready.slopes.size());
            for (std::size_t k = 0; k < coded.size(); ++k)
                coded[k] = {ready.slopes[k].u, ready.slopes[k].v,
                            ready.sizes.empty() ? 64 : ready.sizes[k], 0};
            put(scene.slope, GL_RGBA_INTEGER, GL_SHORT, coded.data());
        }
        ready = {};
        STX_CHECK(context.check("uploading the textures"));
        job.progress(i + 1, count, "uploading textures");
    }
    scene.rectangles = std::move(prepared.rectangles);
    scene.radius = prepared.radius;
    for (const splat::PreparedRectangle& r : scene.rectangles) {
        const PageRectangle& at = *r.rectangle;
        scene.places.push_back(cells[at.page] + glm::ivec3(at.pageX, at.pageY, 0));
        for (const auto& block : r.blocks) scene.translucent = scene.translucent || !block.opaque;
    }
    scene.points = set.pointCount();
    return scene;
}

}  // namespace stx::gpu
