// Splat mode's code that C++ and the shaders share (shaders/shared/splat_shape.glsl) against the
// processor's vectors and against the shader on a device: the same random points, three ways.

#include <random>

#include <gtest/gtest.h>

#include "lib/render/splat/cpu/kernels.hpp"
#include "lib/render/splat/plan.hpp"

#ifdef STX_WITH_GPU
#include "lib/render/splat/gpu/splat_frame.hpp"
#include "lib/render/splat/gpu/splat_shaders.hpp"
#include "tests/unit/shaders/device_fixture.hpp"

namespace stx::splat::shared {
namespace {
using namespace glsl;
using gpu::FrameUniforms;
using gpu::TaskEntry;
using gpu::ViewEntry;

constexpr int kFrame = 64, kStride = kFrame + 2;
constexpr std::size_t kPadded = static_cast<std::size_t>(kStride) * kStride;
constexpr std::size_t kElements = splat::Region::pixels(kFrame, kStride);

struct ScalarShape {
#include "shaders/shared/splat_shape.glsl"
};

/// What splats leave: the front distance and weighted colours of each pixel, with a border.
struct Drawn {
    std::vector<float> front = std::vector<float>(kElements, kNoDepth);
    std::vector<glm::vec4> sums = std::vector<glm::vec4>(kElements, glm::vec4(0));
};

/// One block of random points under a camera beside their own; odd seeds are orthographic.
struct Inputs {
    Camera view, novel;
    float coefficient;  ///< of the paper's rule; 0 = shapes from the data
    std::vector<float> depth;
    std::vector<glm::u8vec4> colour;
    std::vector<Slope> slopes;
    std::vector<std::uint8_t> sizes;
    PixelMap map;

    Inputs(unsigned seed, bool paper) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> unit(0, 1);
        const bool flat = seed % 2;
        view = Camera::fromFieldOfView({0, 0, 3}, *lookAt({0, 0, 3}, {0, 0, 0}), {0.4, 0.4}, false,
                                       kBlock, kBlock);
        const glm::dvec3 eye(unit(random) - 0.5, unit(random) - 0.5, 2.5 + unit(random));
        const double field = flat ? 1.8 : 0.6;
        novel = Camera::fromFieldOfView(eye, *lookAt(eye, {0, 0, 0}), {field, field}, flat, kFrame,
                                        kFrame);
        coefficient = !paper ? 0.0f : flat ? 4.0f : 12.0f;
        map = pixelMap(view, novel);
        for (int i = 0; i < kBlock * kBlock; ++i) {
            const auto byte = [&] { return static_cast<std::uint8_t>(255 * unit(random)); };
            const int x = i % kBlock, y = i / kBlock;
            const bool rim = x == 0 || y == 0 || x == kBlock - 1 || y == kBlock - 1;
            const auto slope = [&](bool flag) {
                const int code = static_cast<int>((unit(random) - 0.5) * 2 * kSlopeScale);
                return static_cast<std::int16_t>((code & ~1) | (flag ? 1 : 0));
            };
            depth.push_back(unit(random) < 0.1 ? kNoDepth
                                               : static_cast<float>(3 + 0.02 * unit(random)));
            colour.emplace_back(byte(), byte(), byte(), 255);
            slopes.push_back({slope(!rim && unit(random) < 0.7), slope(unit(random) < 0.2)});
            sizes.push_back(static_cast<std::uint8_t>(20 + 120 * unit(random)));
        }
    }
    [[nodiscard]] ViewEntry viewEntry() const {
        return {glm::vec4(map.a0, 0.0f), glm::vec4(map.au, view.fx), glm::vec4(map.av, view.fy),
                glm::vec4(map.b0, 0),    glm::vec4(map.bu, 0),       glm::vec4(map.bv, 0)};
    }
    [[nodiscard]] static TaskEntry taskEntry() {
        TaskEntry task{};
        task.count = kBlock | kBlock << 16;
        task.tolerance = 0.01f;
        task.quality = 1.0f;
        return task;
    }
};

Drawn drawScalar(const Inputs& in) {
    Drawn out;
    ScalarShape shape;
    for (const int pass : {1, 2}) {
        for (int i = 0; i < kBlock * kBlock; ++i) {
            const auto k = static_cast<std::size_t>(i);
            ScalarShape::Point p{};
            p.task = Inputs::taskEntry();
            p.view = in.viewEntry();
            p.source = in.depth[k];
            p.flatFrame = in.novel.orthographic;
            p.opaque = true;
            p.largest = kLargest;
            const int u = i % kBlock, v = i / kBlock;
            if (!hasPoint(p.source) ||
                !shape.placePoint(p, static_cast<float>(u), static_cast<float>(v)))
                continue;
            ScalarShape::Splat s{};
            if (in.coefficient > 0)
                s = shape.paperSplat(p, in.coefficient);
            else if (!shape.ownSplat(p, in.slopes[k].u, in.slopes[k].v, in.sizes[k] / 64.0f, false,
                                     s))
                continue;
            vec2 low = floor(p.pixel), high = low + 1.0f;
            if (!s.small) {
                low = glm::ceil(p.pixel - s.reach);
                high = floor(p.pixel + s.reach);
            }
            low = max(low, vec2(0.0f));
            high = min(high, vec2(kFrame - 1.0f));
            glm::vec4 across(0), down(0);
            if (s.steps.x != 0 || s.steps.w != 0) {
                const glm::vec4 du = glm::vec4(in.colour[k + 1]) - glm::vec4(in.colour[k - 1]);
                const glm::vec4 dv =
                    glm::vec4(in.colour[k + kBlock]) - glm::vec4(in.colour[k - kBlock]);
                across = s.steps.x * du + s.steps.y * dv;
                down = s.steps.z * du + s.steps.w * dv;
            }
            for (float y = low.y; y <= high.y; ++y) {
                for (float x = low.x; x <= high.x; ++x) {
                    const vec2 d = vec2(x, y) - p.pixel;
                    const float q = shape.squaredRadius(s, d);
                    const float dist = shape.depthAt(p.dist, s.slope, d);
                    const auto at = static_cast<std::size_t>((y + 1) * kStride + x + 1);
                    if (pass == 1) {
                        if (q <= s.core2) out.front[at] = std::min(out.front[at], dist);
                        continue;
                    }
                    const float kernel = shape.kernelAt(s, d, q) * s.quality;
                    if (!(kernel > 0) || !(dist <= out.front[at] * 1.01f)) continue;
                    const glm::vec4 c = glm::vec4(in.colour[k]) + d.x * across + d.y * down;
                    out.sums[at] += kernel * glm::vec4(glm::vec3(c), 255.0f);
                }
            }
        }
    }
    return out;
}

Drawn drawVectors(const Inputs& in) {
    RectangleImages source;
    source.depth = in.depth.data();
    source.rgba8 = reinterpret_cast<const std::uint8_t*>(in.colour.data());
    source.slopes = in.slopes.data();
    source.sizes = in.sizes.data();
    source.stride = kBlock;
    source.after = kBlock * kBlock;
    source.fx = static_cast<float>(in.view.fx);
    source.fy = static_cast<float>(in.view.fy);
    source.map = in.map;
    BlockTask task;
    task.u1 = task.v1 = kBlock;
    task.uniform = task.small = false;
    Drawn out;
    std::vector<float> missing(out.front.size());
    Region region;
    region.width = region.rows = kFrame;
    region.stride = kStride;
    region.orthographic = in.novel.orthographic;
    region.depth = out.front.data();
    region.colour = &out.sums[0].x;
    region.missing = missing.data();
    drawDepth(source, task, {}, {in.coefficient}, region);
    drawColour(source, task, {}, {in.coefficient}, region);
    return out;
}

template <class T>
gpu::GlTexture textureOf(GLuint unit, GLenum stored, GLenum format, GLenum type,
                         const std::vector<T>& pixels) {
    auto texture = gpu::GlTexture::create(GL_TEXTURE_2D_ARRAY);
    glTextureStorage3D(texture.get(), 1, stored, kBlock, kBlock, 1);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTextureSubImage3D(texture.get(), 0, 0, 0, 0, kBlock, kBlock, 1, format, type, pixels.data());
    glTextureParameteri(texture.get(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(texture.get(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glBindTextureUnit(unit, texture.get());
    return texture;
}

Drawn drawOnDevice(const Inputs& in, test::Device& device) {
    std::vector<glm::i16vec4> coded;
    for (std::size_t i = 0; i < in.slopes.size(); ++i)
        coded.emplace_back(in.slopes[i].u, in.slopes[i].v, in.sizes[i], 0);
    const auto colour = textureOf(0, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, in.colour);
    const auto depth = textureOf(1, GL_R32F, GL_RED, GL_FLOAT, in.depth);
    const auto slopes = textureOf(3, GL_RGBA16I, GL_RGBA_INTEGER, GL_SHORT, coded);
    FrameUniforms frame{};
    frame.frameSize = {kFrame, kFrame, kStride, 0};
    frame.counts = {1, 1, 0, 0};
    frame.novelAxisX.w = in.novel.orthographic ? 1.0f : 0.0f;
    frame.novelPosition.w = in.coefficient;
    frame.scales = {65536, 255, kLargest, 0};
    device.uniforms(0, frame);
    device.storage(0, std::vector{in.viewEntry()});
    device.storage(1, std::vector{Inputs::taskEntry()});
    device.storage(3, std::vector<float>(kPadded, kNoDepth));
    device.storage(4, std::vector<glm::ivec4>(kPadded, glm::ivec4(0)));
    gpu::SplatVariant variant;
    variant.sizes = true;
    for (const int pass : {1, 2})
        device.run(gpu::splatHeader(
                       variant, pass,
                       in.coefficient > 0 ? gpu::SplatShape::paper : gpu::SplatShape::ellipse),
                   gpu::splatStages(false, gpu::SplatProgram::splats), 1);
    Drawn out;
    out.front = device.read<float>(3, kPadded);
    const auto sums = device.read<glm::ivec4>(4, kPadded);
    for (std::size_t i = 0; i < kPadded; ++i)
        out.sums[i] = glm::vec4(sums[i]) * glm::vec4(1, 1, 1, 255) / 65536.0f;
    return out;
}

/// Pixels whose front differs by more than rounding, or whose colour by more than 2/255; at most
/// one in a hundred may.
void expectSame(const Drawn& a, const Drawn& b) {
    int strays = 0, drawn = 0;
    for (int y = 0; y < kFrame; ++y) {
        for (int x = 0; x < kFrame; ++x) {
            const auto i = static_cast<std::size_t>((y + 1) * kStride + x + 1);
            drawn += hasPoint(a.front[i]);
            const bool sameFront = hasPoint(a.front[i])
                                       ? std::abs(a.front[i] - b.front[i]) <= 1e-4f * a.front[i]
                                       : !hasPoint(b.front[i]);
            bool sameColour = (a.sums[i].a > 1.0f) == (b.sums[i].a > 1.0f);
            if (sameColour && a.sums[i].a > 1.0f)
                for (int c = 0; c < 3; ++c)
                    sameColour = sameColour && std::abs(a.sums[i][c] / a.sums[i].a -
                                                        b.sums[i][c] / b.sums[i].a) <= 2.0f / 255;
            strays += !sameFront || !sameColour;
        }
    }
    EXPECT_GT(drawn, 500);
    EXPECT_LE(strays, drawn / 100);
}

class SplatCode : public testing::TestWithParam<int> {
  protected:
    Inputs in{static_cast<unsigned>(GetParam()), GetParam() >= 4};
};
INSTANTIATE_TEST_SUITE_P(Random, SplatCode, testing::Range(0, 6));

TEST_P(SplatCode, DrawsAsTheProcessorsVectorsDo) {
    expectSame(drawVectors(in), drawScalar(in));
}

TEST_P(SplatCode, DrawsAsTheShaderDoes) {
    const auto device = test::Device::open();
    if (!device) GTEST_SKIP() << "no OpenGL 4.5 through EGL here";
    expectSame(drawScalar(in), drawOnDevice(in, *device));
}

}  // namespace
}  // namespace stx::splat::shared
#endif
