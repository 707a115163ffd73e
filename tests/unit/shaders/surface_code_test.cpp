// Surface mode's code that C++ and the shaders share (shaders/shared/) against the processor's
// vectors and against the shaders on a device: the same random sources, three ways.

#include <array>
#include <random>

#include <gtest/gtest.h>

#include "lib/packing/packing.hpp"
#include "lib/render/surface/cpu/fuse.hpp"
#include "lib/render/surface/cpu/fuse_samples.hpp"
#include "lib/render/surface/cpu/raster.hpp"
#include "lib/render/surface/cpu/shade.hpp"
#include "lib/render/surface/prepare/cells.hpp"

#ifdef STX_WITH_GPU
#include "lib/render/surface/gpu/surface_shaders.hpp"
#include "lib/render/surface/gpu/surface_textures.hpp"
#include "tests/unit/shaders/device_fixture.hpp"
#endif

namespace stx::surface::shared {
namespace {

constexpr int kSources = 4, kFrame = 64, kPerPixel = 3;

struct ScalarRaster {
    const Warp& samplesFromSource;
    const DepthAxis& axis;  ///< of the frame
    int S = kPerPixel, SIDE = kTile * kPerPixel;
    bool extend = false;
    std::vector<uint> samples = std::vector<uint>(static_cast<std::size_t>(SIDE) * SIDE, 0u);

    [[nodiscard]] vec4 toSamples(float x, float y, float q) const {
        return samplesFromSource.homogeneous(x, y, q);
    }
    [[nodiscard]] float qLimit() const { return axis.nearest(); }
    [[nodiscard]] const DepthAxis& frameAxis() const { return axis; }
    [[nodiscard]] static float relativeScale(const DepthAxis& a, float q) {
        return a.relativeScale(q);
    }
    [[nodiscard]] uint& sample(int x, int y) {
        return samples[static_cast<std::size_t>(y) * SIDE + x];
    }
    [[nodiscard]] bool mayDraw(int x, int y, float behind) {
        return !extend || sample(x, y) == 0 || (sample(x, y) & kExtensionBit) ||
               uintBitsToFloat(sample(x, y)) < behind;
    }
    void raise(int x, int y, uint value) { sample(x, y) = std::max(sample(x, y), value); }

#include "shaders/shared/surface_cut.glsl"
#include "shaders/shared/surface_raster.glsl"

    void drawAll(const Source& s) {
        for (const Leaf& leaf : s.leaves)
            drawLeaf(leaf.x + 0.5f, leaf.y + 0.5f, leaf.size, leaf.q0, leaf.qx, leaf.qy);
        const auto forPixels = [&](auto member, const auto& draw) {
            for (int y = 0; y < s.height; ++y)
                for (int x = 0; x < s.width; ++x) {
                    const SourceBlock& block =
                        s.blocks[static_cast<std::size_t>(y / kBlock) * s.blocksX + x / kBlock];
                    if ((block.*member)[static_cast<std::size_t>(y % kBlock)] >> x % kBlock & 1)
                        draw(x, y);
                }
        };
        forPixels(&SourceBlock::cells, [&](int x, int y) {
            const auto corner = [&](int i, int j) {
                return toSamples(x + i + 0.5f, y + j + 0.5f, s.q(x + i, y + j));
            };
            BlockBuffer buffer;
            const auto texels = blockTexels(s, x / kBlock * kBlock, y / kBlock * kBlock, buffer);
            const int i = x % kBlock, j = y % kBlock;
            drawCell(cellShape(s, texels, i, j), corner(0, 0), corner(1, 0), corner(1, 1),
                     corner(0, 1), cellNearEdge(texels, i, j) ? kNearEdgeBit : 0u);
        });
        extend = true;
        forPixels(&SourceBlock::edges, [&](int x, int y) {
            const vec2 g = s.gradient(x, y);
            const float q = s.q(x, y);
            const Place at = s.placeOf(x, y);
            drawExtension(
                x + 0.5f, y + 0.5f, q, g.x, g.y, s.space.axis.relativeScale(q),
                s.infoAt(at, 0, 0) & Info::kBesideBackground,
                s.blocks[y / kBlock * s.blocksX + x / kBlock].rims[y % kBlock] >> x % kBlock & 1);
        });
    }
};

struct ScalarFuse : Votes {
    static constexpr int SAMPLES = 16, S = kPerPixel, SIDE = kTile * kPerPixel;
    const DepthAxis& axis;
    int stride;
    TileEntry tile{};

    ScalarFuse(std::span<const LocalSource> local, const DepthAxis& frameAxis, int samplesStride)
        : Votes{{local}}, axis(frameAxis), stride(samplesStride) {}
    [[nodiscard]] const DepthAxis& frameAxis() const { return axis; }
    [[nodiscard]] static int sourceOf(int k) { return k; }
    [[nodiscard]] uint sampleOf(int k, int i, int j) const {
        return std::bit_cast<uint>(locals[static_cast<std::size_t>(k)]
                                       .samples[static_cast<std::ptrdiff_t>(j) * stride + i]);
    }
#include "shaders/shared/surface_fuse.glsl"
};

struct ScalarShade : SourcePixels {
    static constexpr int MOST = 4;
    FrameEntry frame{};
    std::vector<SourceEntry> sources;

    [[nodiscard]] static int sourceOf(int k) { return k; }
    [[nodiscard]] vec4 colourOf(int, const Place& p, int i, int j) const {
        return p.kept.page ? p.kept.page->texture->at(p.kept.texel(i, j)) : vec4(0.0f);
    }
#include "shaders/shared/surface_shade.glsl"
#include "shaders/shared/surface_votes.glsl"
};

/// A wall that all see, with blocks that are missing, nearer, or noisy in some views.
ReferenceView randomView(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    const auto aside = [&] { return 0.8 * unit(random) - 0.4; };
    const glm::dvec3 eye(aside(), aside(), 3.0 + aside());
    ReferenceView view;
    view.camera = Camera::fromFieldOfView(eye, *lookAt(eye, {0, 0, 0}), {0.7, 0.7}, false, 80, 72);
    view.depthBits = 32;
    view.nearPlane = 1;
    view.farPlane = 9;
    view.depth = Image<float>(80, 72, kNoDepth);
    Rgba8Image colour(80, 72);
    std::vector<double> kinds(100);
    for (double& kind : kinds) kind = unit(random);
    for (int y = 0; y < 72; ++y) {
        for (int x = 0; x < 80; ++x) {
            const auto along = view.camera.viewDirection(x + 0.5, y + 0.5);
            double dist = -eye.z / along.z * glm::dot(along, view.camera.forward());
            const double kind = kinds[static_cast<std::size_t>(y / 8 * 10 + x / 8)];
            const auto byte = [&] { return static_cast<std::uint8_t>(255 * unit(random)); };
            colour.at(x, y) = {byte(), byte(), byte(), 255};
            if (unit(random) < 0.02) colour.at(x, y).a = byte();
            if (kind < 0.15) {
                colour.at(x, y).a = 0;
                continue;
            }
            if (kind < 0.3) dist *= 0.9;
            if (kind > 0.8) dist *= 1 + 0.002 * unit(random);
            view.depth.at(x, y) = static_cast<float>(dist);
        }
    }
    view.texture = Texture(std::move(colour));
    return view;
}

/// Sources, a frame that they are drawn into, and what the processor makes of one of its tiles.
struct Inputs {
    Bundle bundle;
    Atlas atlas;
    std::unique_ptr<SurfaceScene> scene;
    PixelSpace space;
    std::vector<Warp> warps, sampleWarps;  ///< source from frame, samples of the tile from source
    std::vector<glm::dmat4> unwarps;       ///< frame from source
    Ray eye{};
    std::vector<Ray> rays;
    SampleGrid grid{kPerPixel};
    std::vector<std::vector<float>> samples;
    std::vector<LocalSource> locals;
    Pieces pieces;

    [[nodiscard]] const std::vector<Source>& sources() const { return scene->sources; }

    /// Every other of two: fewer sources than all tell what the tile shows, too.
    int core = kSources;

    /// Odd seeds: the views as rectangles of an atlas.
    explicit Inputs(unsigned seed, int tile) {
        std::mt19937 random(seed);
        for (int i = 0; i < kSources; ++i) bundle.views.push_back(randomView(random));
        Job job;
        if (seed % 2 == 1) {
            atlas = *pack(bundle, {PackSettings::Layout::tight}, job);
            scene = std::make_unique<SurfaceScene>(*PageSet::of(atlas, job));
        } else {
            scene = std::make_unique<SurfaceScene>(bundle);
        }
        for (Source& s : scene->sources) s.beside = 0.5f * static_cast<float>(s.number);
        const glm::dvec3 at(0.1, 0.05, 2.9);
        space = PixelSpace(
            Camera::fromFieldOfView(at, *lookAt(at, {0, 0, 0}), {0.6, 0.6}, false, kFrame, kFrame),
            9.0);
        const glm::ivec2 corner = first(tile);
        glm::dmat4 sampleFromPixel(1.0);
        sampleFromPixel[0][0] = sampleFromPixel[1][1] = kPerPixel;
        sampleFromPixel[3][0] = -corner.x * kPerPixel - 0.5;
        sampleFromPixel[3][1] = -corner.y * kPerPixel - 0.5;
        eye = rayFrom(space, space);
        for (const Source& s : sources()) {
            warps.push_back(warpFrom(s.space.pixelFromWorld * space.worldFromPixel));
            sampleWarps.push_back(
                warpFrom(sampleFromPixel * space.pixelFromWorld * s.space.worldFromPixel));
            unwarps.push_back(space.pixelFromWorld * s.space.worldFromPixel);
            rays.push_back(rayFrom(s.space, space));
            std::vector<std::uint32_t> blocks(s.blocks.size());
            for (std::size_t b = 0; b < blocks.size(); ++b) blocks[b] = static_cast<uint>(b);
            samples.emplace_back(grid.count());
            // What was never written is 0, nothing.
            (void)rasteriseSource(s, sampleWarps.back(), blocks, grid, space.axis,
                                  samples.back().data());
        }
        for (std::size_t i = 0; i < sources().size(); ++i)
            locals.push_back({&sources()[i], warps[i], samples[i].data(), unwarps[i]});
        core = seed / 2 % 2 == 1 ? 2 : kSources;
        fuseTile(locals, grid, space.axis, corner.x, corner.y, pixelsInFrame(0, 0, kTile, kTile),
                 pieces, core);
    }

    [[nodiscard]] static glm::ivec2 first(int tile) {
        return glm::ivec2(tile % 2, tile / 2) * kTile;
    }
    [[nodiscard]] uint sampleOf(std::size_t source, int x, int y) const {
        return std::bit_cast<uint>(
            samples[source][static_cast<std::size_t>(y) * grid.stride() + x]);
    }
    [[nodiscard]] Piece piece(std::size_t i) const {
        return {pieces.x[i],  pieces.y[i],     pieces.q[i],       pieces.qx[i],
                pieces.qy[i], pieces.share[i], pieces.sources[i], pieces.pixel[i]};
    }
    [[nodiscard]] static glm::vec4 row(const float* m) { return {m[0], m[1], m[2], m[3]}; }
    [[nodiscard]] std::vector<SourceEntry> sourceEntries(
        const std::vector<glm::ivec4>& places = {}) const {
        std::vector<SourceEntry> out;
        for (std::size_t i = 0; i < sources().size(); ++i) {
            const Source& s = sources()[i];
            const float *m = warps[i].m.data(), *r = rays[i].data();
            out.push_back({row(m),
                           row(m + 4),
                           row(m + 8),
                           row(m + 12),
                           row(r),
                           row(r + 4),
                           row(r + 8),
                           glm::ivec4(s.width, s.height, s.hasAlpha, s.blocksX),
                           glm::vec4(1.0f, 1.0f, s.step, kClearlyBehind + s.noise),
                           places.empty() ? glm::ivec4(0) : places[i],
                           glm::vec4(s.beside, s.space.axis.nearest(), s.space.axis.coarse,
                                     s.space.axis.pixel),
                           {unwarps[i][0], unwarps[i][1], unwarps[i][2]}});
        }
        return out;
    }
    [[nodiscard]] FrameEntry frameEntry() const {
        const ShadeSettings settings;
        return {glm::vec4(1.0f, 1.0f, std::numeric_limits<float>::max(), 0),
                row(eye.data()),
                row(eye.data() + 4),
                row(eye.data() + 8),
                glm::vec4(settings.kernel, settings.ridge, 1, settings.edgeWeight),
                glm::ivec4(kFrame, kFrame, 1 << 20, 1 << 20)};
    }
};

/// Samples that differ in what is there or by more than rounding, of both.
int strays(const std::vector<uint>& a, const std::vector<uint>& b) {
    int count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const float qa = std::bit_cast<float>(a[i]), qb = std::bit_cast<float>(b[i]);
        count += (a[i] & 3) != (b[i] & 3) || !(std::abs(qa - qb) <= 1e-4f * qa);
    }
    return count;
}

/// Pieces whose colours differ by more than 1/255.
int strays(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    int count = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        count += !(glm::length(a[i] - b[i]) <= 1.0f / 255.0f);
    return count;
}

std::vector<uint> samplesOf(const Inputs& in, std::size_t source) {
    std::vector<uint> out;
    for (int y = 0; y < in.grid.side(); ++y)
        for (int x = 0; x < in.grid.side(); ++x) out.push_back(in.sampleOf(source, x, y));
    return out;
}

std::vector<uint> scalarSamples(const Inputs& in, std::size_t source) {
    ScalarRaster scalar{in.sampleWarps[source], in.space.axis};
    scalar.drawAll(in.sources()[source]);
    return scalar.samples;
}

std::vector<glm::vec3> scalarColours(const Inputs& in) {
    ScalarShade scalar{{in.locals}, {}, {}};
    scalar.frame = in.frameEntry();
    scalar.sources = in.sourceEntries();
    std::vector<glm::vec3> out;
    for (std::size_t i = 0; i < in.pieces.size(); ++i)
        out.emplace_back(scalar.shadePiece(in.piece(i)));
    return out;
}

std::vector<glm::vec3> vectorColours(const Inputs& in) {
    std::vector<ShadeSource> sources;
    for (std::size_t i = 0; i < in.sources().size(); ++i)
        sources.push_back({&in.sources()[i], in.warps[i], in.rays[i]});
    std::vector<glm::vec3> colours;
    std::vector<std::int8_t> best;
    shadePieces(in.pieces, sources, in.eye, {}, colours, best);
    return colours;
}

// Seeds of sources, each with another tile of the frame.
class SurfaceCode : public testing::TestWithParam<int> {
  protected:
    Inputs in{static_cast<unsigned>(GetParam()), GetParam() % 4};
};
INSTANTIATE_TEST_SUITE_P(Random, SurfaceCode, testing::Range(0, 4));

TEST_P(SurfaceCode, DrawsAsTheProcessorsVectorsDo) {
    for (std::size_t i = 0; i < in.sources().size(); ++i) {
        const auto expected = samplesOf(in, i);
        EXPECT_LT(strays(scalarSamples(in, i), expected), static_cast<int>(expected.size() / 500));
        EXPECT_GT(std::count_if(expected.begin(), expected.end(), [](uint v) { return v != 0; }),
                  static_cast<std::ptrdiff_t>(expected.size() / 4));
    }
}

TEST_P(SurfaceCode, FusesSamplesAsTheProcessorsVectorsDo) {
    const glm::ivec2 corner = Inputs::first(GetParam() % 4);
    ScalarFuse scalar(in.locals, in.space.axis, in.grid.stride());
    scalar.tile = {corner.x, corner.y, 0, kSources, 0, 0, 0, 0};
    for (const Source& s : in.sources()) scalar.tile.step = std::max(scalar.tile.step, s.step);
    const SampledTile tile{in.locals, in.grid, in.space.axis, scalar.tile.step, corner.x, corner.y};
    const std::array<int, kSources> all{0, 1, 2, 3};
    int strays = 0, shown = 0, rejected = 0;
    for (int k = 0; k < kTile * kTile; ++k) {
        const int column = k % kTile, row = k / kTile;
        ShownSamples vectors;
        fuseSamplesOf(tile, all, column, row, vectors);
        for (int n = 0; n < kPerPixel * kPerPixel; ++n) {
            const int i = column * kPerPixel + n % kPerPixel, j = row * kPerPixel + n / kPerPixel;
            float q = 0;
            uint seenBy = 0;
            const bool there = scalar.fuseSample(i, j, q, seenBy);
            strays += there ? vectors.seenBy[n] != seenBy || std::abs(vectors.q[n] - q) > 1e-5f * q
                            : vectors.q[n] != 0.0f;
            float front = 0;
            for (int s = 0; s < kSources; ++s)
                front = std::max(front, std::bit_cast<float>(scalar.sampleOf(s, i, j)));
            shown += there;
            rejected += front > 0.0f && !(q > 0.99f * front);
        }
    }
    EXPECT_LE(strays, shown / 500);
    EXPECT_GT(shown, 4000);
    EXPECT_GT(rejected, 100);
}

TEST_P(SurfaceCode, ShadesAsTheProcessorsVectorsDo) {
    ASSERT_GT(in.pieces.size(), 300u);
    EXPECT_LE(strays(scalarColours(in), vectorColours(in)),
              static_cast<int>(in.pieces.size() / 200));
}

#ifdef STX_WITH_GPU
class SurfaceShaders : public SurfaceCode {
  protected:
    void SetUp() override {
        device = test::Device::open();
        if (!device) GTEST_SKIP() << "no OpenGL 4.5 through EGL here";
        Job job;
        scene = std::move(*gpu::GpuSurfaceScene::upload(*in.scene, *device->context, job));
        glBindTextureUnit(0, scene.surfaces.get());
        glBindTextureUnit(1, scene.colours.get());
        device->uniforms(0, in.frameEntry());
        device->storage(0, in.sourceEntries(scene.places));
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 14, scene.table.get());
        device->storage(5, std::vector<TileEntry>{{Inputs::first(GetParam() % 4).x,
                                                   Inputs::first(GetParam() % 4).y, 0, kSources, 0,
                                                   static_cast<uint>(in.core), 0, 0}});
        std::vector<glm::uvec2> locals;
        for (uint i = 0; i < kSources; ++i) locals.emplace_back(i, i);
        device->storage(6, locals);
    }
    void run(gpu::SurfaceProgram program, GLuint groups, bool core = false) const {
        device->run(gpu::surfaceHeader({kPerPixel, 4, kFreeLevel}, program),
                    {gpu::surfaceStage(program)}, groups, [&] {
                        if (core) glUniform1i(gpu::kFuseCore, 1);
                    });
    }
    std::unique_ptr<test::Device> device;
    gpu::GpuSurfaceScene scene;
};
INSTANTIATE_TEST_SUITE_P(Random, SurfaceShaders, testing::Range(0, 4));

TEST_P(SurfaceShaders, DrawAsTheSharedCodeDoesOnTheProcessor) {
    std::vector<SlotEntry> slots;
    std::vector<glm::uvec4> meshes, edges;
    std::vector<uint> all;
    for (std::size_t i = 0; i < in.sources().size(); ++i) {
        const float* m = in.sampleWarps[i].m.data();
        slots.push_back({Inputs::row(m), Inputs::row(m + 4), Inputs::row(m + 8),
                         Inputs::row(m + 12), glm::ivec4(i, 0, 0, 0)});
        for (std::size_t b = 0; b < in.sources()[i].blocks.size(); ++b) {
            const glm::uvec4 task(i, b, scene.firstLeaf[i] + in.sources()[i].blocks[b].leafBegin,
                                  0);
            meshes.push_back(task);
            edges.push_back(task);
        }
        const auto drawn = scalarSamples(in, i);
        all.insert(all.end(), drawn.begin(), drawn.end());
    }
    FrameEntry frame = in.frameEntry();
    frame.size.z = frame.size.w = static_cast<int>(meshes.size());
    device->uniforms(0, frame);
    device->storage(1, slots);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 3, scene.leaves.get());
    device->storage(4, std::vector<uint>(all.size(), 0u));
    device->storage(2, meshes);
    run(gpu::SurfaceProgram::mesh, static_cast<GLuint>(meshes.size()));
    device->storage(2, edges);
    run(gpu::SurfaceProgram::extensions, static_cast<GLuint>(edges.size()));
    // A shader draws leaves cell by cell, each a little larger: more near their rims.
    EXPECT_LT(strays(device->read<uint>(4, all.size()), all), static_cast<int>(all.size() / 100));
}

TEST_P(SurfaceShaders, FuseAsTheSharedCodeDoesOnTheProcessor) {
    std::vector<uint> samples;
    for (std::size_t i = 0; i < in.sources().size(); ++i) {
        const auto mine = samplesOf(in, i);
        samples.insert(samples.end(), mine.begin(), mine.end());
    }
    device->storage(4, samples);
    constexpr std::size_t kPixels = static_cast<std::size_t>(kTile) * kTile;
    constexpr std::size_t kMost = 2 * kPixels * kPerPixel * kPerPixel;
    device->storage(7, std::vector<Piece>(kMost));
    device->storage(8, std::vector<glm::uvec4>(kPixels));
    device->storage(9, std::vector<uint>{0, 1, 1, 0});
    run(gpu::SurfaceProgram::fuse, kPixels / 256);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    if (in.core < kSources) run(gpu::SurfaceProgram::fuse, kPixels / 256, true);
    const auto pieces = device->read<Piece>(7, kMost);
    const auto ranges = device->read<glm::uvec4>(8, kPixels);
    std::vector<std::vector<Piece>> expected(kPixels);
    for (std::size_t i = 0; i < in.pieces.size(); ++i)
        expected[in.pieces.pixel[i]].push_back(in.piece(i));
    int differing = 0;
    for (std::size_t at = 0; at < kPixels; ++at) {
        const glm::uvec4 range = ranges[at];
        bool same = range.y + range.w == expected[at].size();
        for (std::size_t k = 0; same && k < expected[at].size(); ++k) {
            const Piece &a = pieces[k < range.y ? range.x + k : range.z + (k - range.y)],
                        &b = expected[at][k];
            same = std::abs(a.q - b.q) < 1e-4f * b.q && std::abs(a.x - b.x) < 0.01f &&
                   std::abs(a.qx - b.qx) < 1e-3f * b.q && std::abs(a.share - b.share) < 1e-5f &&
                   a.seenBy == b.seenBy && a.at == at;
        }
        differing += !same;
    }
    EXPECT_LE(differing, static_cast<int>(kPixels / 100));
}

TEST_P(SurfaceShaders, ShadeAsTheSharedCodeDoesOnTheProcessor) {
    std::vector<Piece> pieces;
    for (std::size_t i = 0; i < in.pieces.size(); ++i) pieces.push_back(in.piece(i));
    const auto count = static_cast<uint>(pieces.size());
    device->storage(7, pieces);
    device->storage(9, std::vector<uint>{0, 1, 1, count});
    device->storage(10, std::vector<glm::vec4>(count));
    run(gpu::SurfaceProgram::shade, (count + kShadeGroup - 1) / kShadeGroup);
    std::vector<glm::vec3> colours;
    for (const glm::vec4 c : device->read<glm::vec4>(10, count)) colours.emplace_back(c);
    EXPECT_LE(strays(colours, scalarColours(in)), static_cast<int>(count / 200));
}
#endif

}  // namespace
}  // namespace stx::surface::shared
