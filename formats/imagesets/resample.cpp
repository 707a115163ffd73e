#include "formats/imagesets/resample.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/geometry/like_steps.hpp"

namespace stx::imagesets {
namespace {

/// Samples whose distances differ by less belong to one surface; of those that differ by more those
/// of a slope do (likeSteps()).
constexpr float kOneSurface = 0.02f;

/// Columns beyond the edge: the other edge's in closed panoramas, else the last.
struct Edges {
    int width, height;
    bool closed;
    [[nodiscard]] int column(int x) const {
        if (!closed) return std::clamp(x, 0, width - 1);
        return ((x % width) + width) % width;
    }
    [[nodiscard]] int row(int y) const { return std::clamp(y, 0, height - 1); }
};

void catmullRom(double t, double w[4]) {
    w[0] = t * (-0.5 + t * (1.0 - 0.5 * t));
    w[1] = 1.0 + t * t * (-2.5 + 1.5 * t);
    w[2] = t * (0.5 + t * (2.0 - 1.5 * t));
    w[3] = t * t * (-0.5 + 0.5 * t);
}

/// Straight RGBA at a position (pixel centres at .5), interpolated premultiplied.
template <class Get>
glm::vec4 colourAt(const Get& get, const Edges& edges, glm::dvec2 at) {
    const double x = at.x - 0.5, y = at.y - 0.5;
    const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
    double wx[4], wy[4];
    catmullRom(x - ix, wx);
    catmullRom(y - iy, wy);
    glm::dvec4 sum(0);
    glm::vec4 low(1e30f), high(-1e30f);
    for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 4; ++i) {
            const glm::vec4 s = get(edges.column(ix - 1 + i), edges.row(iy - 1 + j));
            const glm::vec4 p(glm::vec3(s) * s.a, s.a);
            sum += glm::dvec4(p) * (wx[i] * wy[j]);
            if ((i == 1 || i == 2) && (j == 1 || j == 2)) {
                low = glm::min(low, p);
                high = glm::max(high, p);
            }
        }
    }
    // No ringing beyond the four samples around.
    const glm::vec4 p = glm::clamp(glm::vec4(sum), low, high);
    return p.a > 0 ? glm::vec4(glm::vec3(p) / p.a, p.a) : glm::vec4(0);
}

/// Whether the samples `from` and the next one along `step` are of one surface: near each other, or
/// on a slope that goes on at both sides, or by two steps at one. Two steps, as a pixel that mixes
/// two surfaces makes one step of an edge two.
bool sameSurface(const Image<float>& depth, const Edges& edges, glm::ivec2 from, glm::ivec2 step) {
    float q[6];  // 1 / distance at two samples before, of the pair, and at two behind it
    for (int i = 0; i < 6; ++i) {
        const glm::ivec2 at = from + (i - 2) * step;
        q[i] = 1.0f / depth.at(edges.column(at.x), edges.row(at.y));
    }
    const float own = q[3] - q[2];
    if (std::abs(own) <= kOneSurface * std::max(q[2], q[3])) return true;
    const float before = q[2] - q[1], after = q[4] - q[3];
    const bool goesOnBefore = likeSteps(own, before), goesOnAfter = likeSteps(own, after);
    return (goesOnBefore && (goesOnAfter || likeSteps(before, q[1] - q[0]))) ||
           (goesOnAfter && likeSteps(after, q[5] - q[4]));
}

float depthAt(const Image<float>& depth, const Edges& edges, glm::dvec2 at) {
    const double x = at.x - 0.5, y = at.y - 0.5;
    const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
    const double tx = x - ix, ty = y - iy;
    double sum = 0;
    float low = kNoDepth, high = 0;
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) {
            const float d = depth.at(edges.column(ix + i), edges.row(iy + j));
            low = std::min(low, d);
            high = std::max(high, d);
            sum += (i ? tx : 1 - tx) * (j ? ty : 1 - ty) / static_cast<double>(d);
        }
    }
    if (hasPoint(high)) {
        const auto same = [&](int i, int j, glm::ivec2 step) {
            return sameSurface(depth, edges, {ix + i, iy + j}, step);
        };
        if (high - low <= kOneSurface * low ||
            (same(0, 0, {1, 0}) && same(0, 1, {1, 0}) && same(0, 0, {0, 1}) && same(1, 0, {0, 1})))
            return static_cast<float>(1.0 / sum);
    }
    return depth.at(edges.column(ix + (tx >= 0.5)), edges.row(iy + (ty >= 0.5)));
}

/// Fills a picture from another: `source(x, y)` gives the position in the source of the centre of a
/// pixel, or nothing; `scale(x, y)` multiplies its distance.
template <class Source, class Scale>
TextureAndDepth remap(const Texture& texture, const Image<float>& depth, int width, int height,
                      bool closed, const Source& source, const Scale& scale) {
    const Edges edges{depth.width(), depth.height(), closed};
    Image<float> outDepth(width, height, kNoDepth);
    const auto run = [&](auto image, const auto& get, const auto& store) {
        parallelForBlocks(0, height, 16, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y) {
                for (int x = 0; x < width; ++x) {
                    const std::optional<glm::dvec2> at = source(x + 0.5, y + 0.5);
                    if (!at) continue;
                    image.at(x, y) = store(colourAt(get, edges, *at));
                    const float d = depthAt(depth, edges, *at);
                    if (hasPoint(d))
                        outDepth.at(x, y) = static_cast<float>(d * scale(x + 0.5, y + 0.5));
                }
            }
        });
        return Texture(std::move(image));
    };
    Texture out;
    if (const auto* bytes = texture.rgba8()) {
        out = run(
            Rgba8Image(width, height),
            [&](int x, int y) { return glm::vec4(bytes->at(x, y)) / 255.0f; },
            [](glm::vec4 c) { return glm::u8vec4(glm::clamp(c, 0.0f, 1.0f) * 255.0f + 0.5f); });
    } else {
        const auto* floats = texture.rgbaFloat();
        out = run(
            RgbaFloatImage(width, height), [&](int x, int y) { return floats->at(x, y); },
            [](glm::vec4 c) { return c; });
    }
    return {std::move(out), std::move(outDepth)};
}

/// Mean over the covered area along one axis: the share of each source pixel in [from, to).
template <class Visit>
void overSpan(double from, double to, int count, const Visit& visit) {
    const int first = std::clamp(static_cast<int>(std::floor(from)), 0, count - 1);
    for (int i = first; i < count && i < to; ++i) {
        const double share = std::min<double>(i + 1, to) - std::max<double>(i, from);
        if (share > 0) visit(i, share);
    }
}

}  // namespace

Texture resizeTexture(const Texture& texture, int width, int height) {
    const double sx = static_cast<double>(texture.width()) / width;
    const double sy = static_cast<double>(texture.height()) / height;
    if (sx <= 1 && sy <= 1) {
        const Image<float> none(texture.width(), texture.height(), 1.0f);
        return remap(
                   texture, none, width, height, false,
                   [&](double x, double y) {
                       return std::optional<glm::dvec2>(glm::dvec2(x * sx, y * sy));
                   },
                   [](double, double) { return 1.0; })
            .first;
    }
    const auto run = [&](auto image, const auto& store) {
        parallelForBlocks(0, height, 16, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y) {
                for (int x = 0; x < width; ++x) {
                    glm::dvec4 sum(0);
                    double area = 0;
                    overSpan(y * sy, (y + 1) * sy, texture.height(), [&](int j, double h) {
                        overSpan(x * sx, (x + 1) * sx, texture.width(), [&](int i, double w) {
                            const glm::dvec4 c(texture.at(i, j));
                            sum += glm::dvec4(glm::dvec3(c) * c.a, c.a) * (w * h);
                            area += w * h;
                        });
                    });
                    const glm::dvec4 p = sum / area;
                    image.at(x, y) =
                        store(p.a > 0 ? glm::vec4(glm::dvec3(p) / p.a, p.a) : glm::vec4(0));
                }
            }
        });
        return Texture(std::move(image));
    };
    if (texture.rgba8())
        return run(Rgba8Image(width, height), [](glm::vec4 c) {
            return glm::u8vec4(glm::clamp(c, 0.0f, 1.0f) * 255.0f + 0.5f);
        });
    return run(RgbaFloatImage(width, height), [](glm::vec4 c) { return c; });
}

TextureAndDepth undistort(const Texture& texture, const Image<float>& depth, const Camera& camera,
                          const Lens& lens, const PixelRectangle& part) {
    return remap(
        texture, depth, part.width, part.height, false,
        [&](double x, double y) -> std::optional<glm::dvec2> {
            const glm::dvec2 ideal(part.x + x, part.y + y);
            if (!lens.isShown(camera, ideal)) return std::nullopt;
            return lens.realFromIdeal(camera, ideal);
        },
        [](double, double) { return 1.0; });
}

TextureAndDepth faceOfPanorama(const Texture& texture, const Image<float>& rayLength,
                               const Camera& face, const Camera& pose, const Panorama& panorama) {
    const glm::dquat poseFromFace = glm::conjugate(pose.orientation) * face.orientation;
    const glm::dvec2 size(rayLength.width(), rayLength.height());
    return remap(
        texture, rayLength, face.width, face.height, panorama.closed(),
        [&](double x, double y) -> std::optional<glm::dvec2> {
            const glm::dvec2 at = panorama.position(poseFromFace * face.unproject(x, y, 1.0));
            if (!(at.x >= 0 && at.y >= 0 && at.x <= 1 && at.y <= 1)) return std::nullopt;
            return at * size;
        },
        [&](double x, double y) { return 1.0 / glm::length(face.unproject(x, y, 1.0)); });
}

}  // namespace stx::imagesets
