#include "lib/render/surface/gpu/surface_textures.hpp"

#include <bit>

#include "lib/base/parallel.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/render/surface/prepare/cells.hpp"

namespace stx::gpu {
namespace {

using surface::Source;

Result<void> checkSize(std::size_t pages, const EglContext& context, int width, int height) {
    const auto& able = context.abilities();
    if (width > able.maxTextureSize || height > able.maxTextureSize)
        return fail(
            ErrorCode::unsupported,
            "the textures are up to {}x{} pixels, more than '{}' takes ({}x{}); use smaller "
            "views or --backend cpu",
            width, height, context.device().name, able.maxTextureSize, able.maxTextureSize);
    if (static_cast<int>(pages) > able.maxTextureLayers)
        return fail(ErrorCode::unsupported,
                    "{} textures are more than '{}' takes in surface mode ({}); use fewer views or "
                    "--backend cpu",
                    pages, context.device().name, able.maxTextureLayers);
    return {};
}

GlTexture makeLayers(GLenum format, int width, int height, int layers) {
    auto texture = GlTexture::create(GL_TEXTURE_2D_ARRAY);
    glTextureStorage3D(texture.get(), 1, format, width, height, layers);
    glTextureParameteri(texture.get(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(texture.get(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

/// A page as the shaders read it.
Image<glm::uvec4> surfaceTexels(const surface::SurfaceScene& scene,
                                const surface::PreparedPage& page) {
    Image<glm::uvec4> texels(page.q.width(), page.q.height(), glm::uvec4(0u));
    for (const Source& s : scene.sources) {
        Image<std::uint32_t> codes;
        for (const PageRectangle& r : scene.set.rectanglesOf(s.number)) {
            if (&page != &scene.pages[static_cast<std::size_t>(r.page)]) continue;
            if (codes.empty()) codes = cellCodes(s);
            constexpr int kAround = PageSet::kPadding;
            const int x0 = std::max(r.x0 - kAround, 0), x1 = std::min(r.x1 + kAround, s.width);
            const int y0 = std::max(r.y0 - kAround, 0), y1 = std::min(r.y1 + kAround, s.height);
            parallelForBlocks(y0, y1, 32, [&](std::int64_t from, std::int64_t to) {
                for (int y = static_cast<int>(from); y < to; ++y) {
                    for (int x = x0; x < x1; ++x) {
                        const std::size_t texel = r.texel(x, y);
                        const float q = page.q.data()[texel];
                        const std::uint32_t level = s.hasAlpha ? page.levels.data()[texel] : 0u;
                        const glm::vec2 g = q > 0.0f ? s.gradient(x, y) : glm::vec2(0.0f);
                        texels.data()[texel] = {std::bit_cast<std::uint32_t>(q),
                                                std::bit_cast<std::uint32_t>(g.x),
                                                std::bit_cast<std::uint32_t>(g.y),
                                                codes.at(x, y) | level << surface::kLevelShift};
                    }
                }
            });
        }
    }
    return texels;
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
            surface::BlockBuffer buffer;
            const auto texels = surface::blockTexels(s, x0, y0, buffer);
            for (int j = 0; j < yEnd - y0; ++j) {
                for (int i = 0; i < xEnd - x0; ++i) {
                    std::uint32_t& code = codes.at(x0 + i, y0 + j);
                    const std::uint32_t info = texels.info[texels.at(i, j)];
                    code = info >> 4 << surface::kDistanceShift;
                    if (info & surface::Info::kBesideBackground) code |= surface::kBesideBackground;
                    if (info & surface::Info::kCrease) code |= surface::kCreasePixel;
                    if (block.edges[j] >> i & 1) code |= surface::kEdgePixel;
                    if (block.rims[j] >> i & 1) code |= surface::kRimPixel;
                    if (!(block.cells[j] >> i & 1)) continue;
                    code |= surface::cellShape(s, texels, i, j);
                    if (surface::cellNearEdge(texels, i, j)) code |= surface::kCellNearEdge;
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

PlaceTable::PlaceTable(const surface::SurfaceScene& scene) {
    const PageSet& set = scene.set;
    const auto put = [&](int value) { words.push_back(static_cast<std::uint32_t>(value)); };
    for (const Source& s : scene.sources) {
        glm::ivec4 place(s.whole ? static_cast<int>(s.whole - scene.pages.data()) : -1, 0, -1,
                         s.view->depthMayBeUnknown() ? 1 : 0);
        if (!s.whole) {
            const auto firstWord = static_cast<int>(words.size());
            for (const PageRectangle& r : set.rectanglesOf(s.number)) {
                constexpr int kAround = PageSet::kPadding;
                put(std::max(r.x0 - kAround, 0));
                put(std::max(r.y0 - kAround, 0));
                put(std::min(r.x1 + kAround, s.width));
                put(std::min(r.y1 + kAround, s.height));
                const bool turned = r.stepX != 1;
                put(turned ? r.pageX + r.width - 1 + r.y0 : r.pageX - r.x0);
                put(turned ? r.pageY - r.x0 : r.pageY - r.y0);
                put(r.page);
                put(turned ? 1 : 0);
            }
            const auto firstRectangle = static_cast<int>(s.view->firstRectangle);
            std::vector<std::uint32_t> begins;
            for (int by = 0; by < s.blocksY; ++by) {
                for (int bx = 0; bx < s.blocksX; ++bx) {
                    begins.push_back(static_cast<std::uint32_t>(words.size()));
                    for (const auto number :
                         set.near(s.number, bx * surface::kBlock, by * surface::kBlock))
                        put(firstWord + 8 * (static_cast<int>(number) - firstRectangle));
                }
            }
            begins.push_back(static_cast<std::uint32_t>(words.size()));
            place.y = static_cast<int>(words.size());
            words.insert(words.end(), begins.begin(), begins.end());
            const auto bits = set.outside(s.number);
            if (!bits.empty()) place.z = static_cast<int>(words.size());
            for (const std::uint64_t both : bits) {
                words.push_back(static_cast<std::uint32_t>(both));
                words.push_back(static_cast<std::uint32_t>(both >> 32));
            }
        }
        places.push_back(place);
    }
    words.push_back(0);
}

Result<GpuSurfaceScene> GpuSurfaceScene::upload(const surface::SurfaceScene& from,
                                                const EglContext& context, Job& job) {
    int width = 1, height = 1;
    std::size_t leafCount = 0;
    for (const surface::PreparedPage& page : from.pages) {
        width = std::max(width, page.q.width());
        height = std::max(height, page.q.height());
    }
    for (const Source& s : from.sources) leafCount += s.leaves.size();
    STX_CHECK(checkSize(from.pages.size(), context, width, height));
    const bool linear = from.set.linear();
    const auto layers = static_cast<int>(from.pages.size());
    STX_CHECK(job.limits.checkAllocation(
        static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * from.pages.size(),
        linear ? 32 : 20, "the textures of the reference views"));
    if (context.device().software)
        STX_CHECK(checkPeak(peak::kSurfacesBySoftware,
                            static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) *
                                from.pages.size(),
                            0, 0, job.limits));
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
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    for (int i = 0; i < layers; ++i) {
        STX_CHECK(job.checkCancelled());
        const surface::PreparedPage& page = from.pages[static_cast<std::size_t>(i)];
        const Image<glm::uvec4> texels = surfaceTexels(from, page);
        glTextureSubImage3D(scene.surfaces.get(), 0, 0, 0, i, texels.width(), texels.height(), 1,
                            GL_RGBA_INTEGER, GL_UNSIGNED_INT, texels.data());
        if (const auto* bytes = page.texture->rgba8())
            glTextureSubImage3D(scene.colours.get(), 0, 0, 0, i, texels.width(), texels.height(), 1,
                                GL_RGBA, GL_UNSIGNED_BYTE, bytes->data());
        else if (const auto* floats = page.texture->rgbaFloat())
            glTextureSubImage3D(scene.colours.get(), 0, 0, 0, i, texels.width(), texels.height(), 1,
                                GL_RGBA, GL_FLOAT, floats->data());
        STX_CHECK(context.check("uploading the textures"));
        job.progress(i + 1, layers, "uploading textures");
    }
    std::vector<glm::uvec4> leaves;
    leaves.reserve(leafCount + 1);
    for (const Source& s : from.sources) {
        scene.firstLeaf.push_back(static_cast<std::uint32_t>(leaves.size()));
        for (const surface::Leaf& leaf : s.leaves)
            leaves.emplace_back(
                std::bit_cast<std::uint32_t>(leaf.q0), std::bit_cast<std::uint32_t>(leaf.qx),
                std::bit_cast<std::uint32_t>(leaf.qy),
                static_cast<std::uint32_t>(leaf.x) | static_cast<std::uint32_t>(leaf.y) << 16);
    }
    leaves.emplace_back(0u);
    const auto upload = [](const auto& values) {
        GlBuffer buffer = GlBuffer::create();
        glNamedBufferStorage(buffer.get(),
                             static_cast<GLsizeiptr>(values.size() * sizeof(values[0])),
                             values.data(), 0);
        return buffer;
    };
    scene.leaves = upload(leaves);
    PlaceTable table(from);
    scene.table = upload(table.words);
    scene.places = std::move(table.places);
    STX_CHECK(context.check("uploading the planar pieces"));
    return scene;
}

}  // namespace stx::gpu
