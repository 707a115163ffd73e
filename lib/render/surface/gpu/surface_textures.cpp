#include "lib/render/surface/gpu/surface_textures.hpp"

#include <bit>

#include "lib/base/parallel.hpp"
#include "lib/render/surface/cpu/raster.hpp"

namespace stx::gpu {
namespace {

using surface::Source;

Result<void> checkSize(std::span<const Source> sources, const EglContext& context, int width,
                       int height) {
    const auto& able = context.abilities();
    if (width > able.maxTextureSize || height > able.maxTextureSize)
        return fail(ErrorCode::unsupported,
                    "the views are up to {}x{} pixels, more than '{}' takes ({}x{}); use smaller "
                    "views or --backend cpu",
                    width, height, context.device().name, able.maxTextureSize, able.maxTextureSize);
    if (static_cast<int>(sources.size()) > able.maxTextureLayers)
        return fail(ErrorCode::unsupported,
                    "{} views are more than '{}' takes in surface mode ({}); use fewer views or "
                    "--backend cpu",
                    sources.size(), context.device().name, able.maxTextureLayers);
    return {};
}

GlTexture makeLayers(GLenum format, int width, int height, int layers) {
    auto texture = GlTexture::create(GL_TEXTURE_2D_ARRAY);
    glTextureStorage3D(texture.get(), 1, format, width, height, layers);
    glTextureParameteri(texture.get(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(texture.get(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

}  // namespace

Image<std::uint32_t> cellCodes(const Source& s) {
    Image<std::uint32_t> codes(s.width, s.height, 0);
    parallelFor(0, s.blocksY, [&](std::int64_t by) {
        for (int bx = 0; bx < s.blocksX; ++bx) {
            const auto& block = s.blocks[static_cast<std::size_t>(by) * s.blocksX + bx];
            const int x0 = bx * surface::kBlock, y0 = static_cast<int>(by) * surface::kBlock;
            const int xEnd = std::min(x0 + surface::kBlock, s.width);
            const int yEnd = std::min(y0 + surface::kBlock, s.height);
            for (int y = y0; y < yEnd; ++y) {
                for (int x = x0; x < xEnd; ++x) {
                    std::uint32_t& code = codes.at(x, y);
                    code = static_cast<std::uint32_t>(s.edgeDistance(x, y))
                           << surface::kDistanceShift;
                    if (s.info.at(x, y) & Source::kBesideBackground)
                        code |= surface::kBesideBackground;
                    if (block.edges[y - y0] >> (x - x0) & 1) code |= surface::kEdgePixel;
                    if (!(block.cells[y - y0] >> (x - x0) & 1)) continue;
                    code |= surface::cellShape(s, x, y);
                    if (surface::cellNearEdge(s, x, y)) code |= surface::kCellNearEdge;
                }
            }
            for (std::uint32_t k = block.leafBegin; k < block.leafEnd; ++k) {
                const surface::Leaf& leaf = s.leaves[k];
                for (int y = leaf.y; y < leaf.y + leaf.size; ++y)
                    for (int x = leaf.x; x < leaf.x + leaf.size; ++x)
                        codes.at(x, y) |= surface::kLeafCell | (k - block.leafBegin)
                                                                   << surface::kLeafShift;
            }
        }
    });
    return codes;
}

Result<GpuSurfaceScene> GpuSurfaceScene::upload(std::span<const Source> sources,
                                                const EglContext& context, Job& job) {
    int width = 1, height = 1;
    std::size_t leafCount = 0;
    for (const Source& s : sources) {
        width = std::max(width, s.width);
        height = std::max(height, s.height);
        leafCount += s.leaves.size();
    }
    STX_CHECK(checkSize(sources, context, width, height));
    const bool linear = !sources.empty() && sources[0].view->texture.isLinear();
    const auto layers = static_cast<int>(sources.size());
    STX_CHECK(job.limits.checkAllocation(
        static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * sources.size(),
        linear ? 32 : 20, "the textures of the reference views"));
    if (static_cast<std::int64_t>(leafCount * sizeof(glm::uvec4)) >
        context.abilities().maxStorageBytes)
        return fail(ErrorCode::unsupported,
                    "the views have {} planar pieces, more than a buffer of '{}' takes; use "
                    "smaller views or --backend cpu",
                    leafCount, context.device().name);
    GpuSurfaceScene scene;
    STX_CHECK(context.check("starting"));
    scene.surfaces = makeLayers(GL_RGBA32UI, width, height, layers);
    scene.colours = makeLayers(linear ? GL_RGBA32F : GL_RGBA8, width, height, layers);
    STX_CHECK(context.check("making the textures of the reference views"));
    std::vector<glm::uvec4> leaves;
    leaves.reserve(leafCount + 1);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    for (int i = 0; i < layers; ++i) {
        STX_CHECK(job.checkCancelled());
        const Source& s = sources[static_cast<std::size_t>(i)];
        Image<glm::uvec4> texels(s.width, s.height);
        const Image<std::uint32_t> codes = cellCodes(s);
        parallelForBlocks(0, s.height, 32, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y) {
                for (int x = 0; x < s.width; ++x) {
                    const float q = s.q.at(x, y);
                    const glm::vec2 g = q > 0.0f ? s.gradient(x, y) : glm::vec2(0.0f);
                    texels.at(x, y) = {std::bit_cast<std::uint32_t>(q),
                                       std::bit_cast<std::uint32_t>(g.x),
                                       std::bit_cast<std::uint32_t>(g.y), codes.at(x, y)};
                }
            }
        });
        glTextureSubImage3D(scene.surfaces.get(), 0, 0, 0, i, s.width, s.height, 1, GL_RGBA_INTEGER,
                            GL_UNSIGNED_INT, texels.data());
        if (const auto* bytes = s.view->texture.rgba8())
            glTextureSubImage3D(scene.colours.get(), 0, 0, 0, i, s.width, s.height, 1, GL_RGBA,
                                GL_UNSIGNED_BYTE, bytes->data());
        else if (const auto* floats = s.view->texture.rgbaFloat())
            glTextureSubImage3D(scene.colours.get(), 0, 0, 0, i, s.width, s.height, 1, GL_RGBA,
                                GL_FLOAT, floats->data());
        scene.firstLeaf.push_back(static_cast<std::uint32_t>(leaves.size()));
        for (const surface::Leaf& leaf : s.leaves)
            leaves.emplace_back(
                std::bit_cast<std::uint32_t>(leaf.q0), std::bit_cast<std::uint32_t>(leaf.qx),
                std::bit_cast<std::uint32_t>(leaf.qy),
                static_cast<std::uint32_t>(leaf.x) | static_cast<std::uint32_t>(leaf.y) << 16);
        STX_CHECK(context.check("uploading the reference views"));
        job.progress(i + 1, layers, "uploading views");
    }
    leaves.emplace_back(0u);
    scene.leaves = GlBuffer::create();
    glNamedBufferStorage(scene.leaves.get(),
                         static_cast<GLsizeiptr>(leaves.size() * sizeof(glm::uvec4)), leaves.data(),
                         0);
    STX_CHECK(context.check("uploading the planar pieces"));
    return scene;
}

}  // namespace stx::gpu
