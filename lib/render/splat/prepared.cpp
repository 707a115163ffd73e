#include "lib/render/splat/prepared.hpp"

#include <cmath>
#include <optional>

#include "lib/base/parallel.hpp"
#include "lib/base/rounding.hpp"
#include "lib/render/scene/glass_pages.hpp"

namespace stx::splat {
namespace {

// Steeper than this, 83 degrees (as a tangent), is a discontinuity, not a surface,
constexpr float kSteepest = 8.0f;
/// but where it goes on: three steps that differ by no more than this share of each are a plane
/// seen edge on. As discontinuities they had no tilt, and the top of a cube from ring:8 was a
/// lattice of holes (19.8 dB, 37.1 so). Two in a row are also what a pixel between two surfaces
/// makes.
constexpr float kAlike = 0.05f;
// Tangent that a rim's tilt is held to; 45 degrees, chosen by trial on the project's image sets.
constexpr float kSteepestRim = 1.0f;
// At a crease the flatter side counts: the other is steeper by this factor and this much. Chosen by
// trial on the project's image sets.
constexpr float kCreaseFactor = 3.0f, kCreaseMore = 0.5f;
/// Pixels that tell the tilt of noisy depth, to each side.
constexpr int kFarther = 3;
/// Depth is noisy where it is off by more than this share of a pixel: of less, next neighbours tell
/// as well, and those further away are on other faces where surfaces are a few pixels wide. Bars of
/// 60 pixels' views: 25.2 dB instead of 23.1 and 20.9 instead of 19.1 (tests/sweep, 61002:34,
/// 90210:110). Statue and oak tree with noise of 0.5 % stay; with 0.6 here the statue loses 0.1.
constexpr double kNoisyOfPixel = 0.4;

std::int16_t coded(float slope) {
    return static_cast<std::int16_t>(
        std::lround(std::clamp(slope, -kSteepest, kSteepest) * kSlopeScale));
}

// Line of sight of a pixel in camera space, with z = -1 (orthographic: the axis).
glm::vec3 rayOf(const Camera& c, int x, int y) {
    if (c.orthographic) return {0, 0, -1};
    return {(x + 0.5 - c.cx) / c.fx, -(y + 0.5 - c.cy) / c.fy, -1.0};
}

// The tilt of a plane with the given normal in camera space, seen along `ray`; none where it is
// seen from behind: a normal that is bent for light says nothing of the surface then.
std::optional<glm::vec2> slopeFromNormal(glm::vec3 n, glm::vec3 ray) {
    const float towards = glm::dot(n, ray);
    if (!(towards < -1e-3f * glm::length(n))) return std::nullopt;
    return glm::vec2(-n.x / towards, n.y / towards);
}

inline glm::vec3 normalFromSlope(glm::vec2 slope, glm::vec3 ray) {
    // The tangents along u and v in camera space, per sample spacing; their product faces the
    // camera.
    const glm::vec3 alongU = glm::vec3(1, 0, 0) + slope.x * ray;
    const glm::vec3 alongV = glm::vec3(0, -1, 0) + slope.y * ray;
    return glm::normalize(glm::cross(alongV, alongU));
}

/// Normals of a row of texels, times 127, in the world.
struct NormalRow {
    std::vector<float> slopeX, slopeY, rayX;
    std::vector<std::int16_t> x, y, z;

    explicit NormalRow(const Camera& camera) {
        const auto width = static_cast<std::size_t>(camera.width);
        slopeX.resize(width);
        slopeY.resize(width);
        for (std::size_t i = 0; i < width; ++i)
            rayX.push_back(rayOf(camera, static_cast<int>(i), 0).x);
        x.resize(width);
        y.resize(width);
        z.resize(width);
    }
    /// Of the slopes. In a loop of its own, of which compilers make vectors.
    void find(const glm::mat3& worldFromCamera, glm::vec2 rayYZ) {
        const glm::mat3 turn = worldFromCamera;
        const float *const sx = slopeX.data(), *const sy = slopeY.data(), *const rx = rayX.data();
        std::int16_t *const toX = x.data(), *const toY = y.data(), *const toZ = z.data();
        const auto count = static_cast<std::ptrdiff_t>(x.size());
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            const glm::vec3 n = turn * normalFromSlope({sx[i], sy[i]}, {rx[i], rayYZ.x, rayYZ.y});
            toX[i] = static_cast<std::int16_t>(roundToInt(n.x * 127.0f));
            toY[i] = static_cast<std::int16_t>(roundToInt(n.y * 127.0f));
            toZ[i] = static_cast<std::int16_t>(roundToInt(n.z * 127.0f));
        }
    }
};

/// The texels of a rectangle and what surrounds it, by pixels of its window.
struct Window {
    const PageRectangle& rectangle;
    const PageView& view;
    const Page& page;
    std::ptrdiff_t origin, stride;

    Window(const PageSet& set, const PageRectangle& r)
        : rectangle(r),
          view(set.views()[r.view]),
          page(set.pages()[r.page]),
          origin(static_cast<std::ptrdiff_t>(r.pageY) * page.width() + r.pageX),
          stride(page.width()) {}

    [[nodiscard]] const Camera& camera() const { return rectangle.window; }
    [[nodiscard]] std::size_t texel(int x, int y) const {
        return static_cast<std::size_t>(origin + y * stride + x);
    }
    [[nodiscard]] float depth(int x, int y) const { return page.depth->data()[texel(x, y)]; }
    [[nodiscard]] float alpha(int x, int y) const { return page.texture->alpha(texel(x, y)); }
};

/// From a pixel to one beside it.
struct Step {
    float slope;  ///< along x or down y, a tangent; of no surface infinite or not a number
    bool same;    ///< one surface
};

/// Of one that is steeper than kSteepest, along `way`, of unit length: whether it is one of three
/// in a row that are alike.
bool goesOn(const Window& w, int x, int y, glm::ivec2 way, float slope) {
    const Camera& c = w.camera();
    const double f = way.x != 0 ? c.fx : c.fy;
    const auto depth = [&](int k) {
        const int i = x + k * way.x, j = y + k * way.y;
        return w.rectangle.shows(i, j) ? w.depth(i, j) : kNoDepth;
    };
    // From pixel k - 1 to k. The tangents of a plane grow with the distance.
    const auto alike = [&](int k) {
        const float from = depth(k - 1), to = depth(k);
        const float there = (to - from) * static_cast<float>(c.orthographic ? f : f / to) *
                            (c.orthographic ? 1.0f : w.depth(x, y) / from);
        return std::abs(there - slope) <= kAlike * std::abs(slope);
    };
    const int on = alike(2) ? 1 + alike(3) : 0, back = alike(0) ? 1 + alike(-1) : 0;
    return on + back >= 2;
}

/// Along (X, Y). A template, so that compilers write out the four ways.
template <int X, int Y>
Step stepTo(const Window& w, int x, int y, float z) {
    const Camera& c = w.camera();
    const double f = X != 0 ? c.fx : c.fy;
    const int i = x + X, j = y + Y;
    const float to = w.rectangle.shows(i, j) ? w.depth(i, j) : kNoDepth;
    // On a plane 1/z is linear in the picture, so the exact tangent divides by the other depth.
    const float slope = (to - z) * static_cast<float>(c.orthographic ? f : f / to);
    return {
        X + Y > 0 ? slope : -slope,
        std::abs(slope) <= kSteepest || (std::isfinite(slope) && goesOn(w, x, y, {X, Y}, slope))};
}

/// The steps from a pixel to the four around it.
struct Steps {
    Step left, right, up, down;

    Steps(const Window& w, int x, int y, float z)
        : left(stepTo<-1, 0>(w, x, y, z)),
          right(stepTo<1, 0>(w, x, y, z)),
          up(stepTo<0, -1>(w, x, y, z)),
          down(stepTo<0, 1>(w, x, y, z)) {}
};

/// The slope along one axis from the steps to both sides: of those on the same surface.
float slopeFrom(const Step& before, const Step& after) {
    const float a = before.slope, b = after.slope;
    if (before.same && after.same) {
        // At the rim of a smooth surface one side is a bend or a crease: trust the flatter.
        if (std::abs(a) > kCreaseFactor * std::abs(b) + kCreaseMore) return b;
        if (std::abs(b) > kCreaseFactor * std::abs(a) + kCreaseMore) return a;
        return 0.5f * (a + b);
    }
    return before.same ? a : after.same ? b : 0.0f;
}

/// The slope along one axis over pixels further away: of noisy depth next neighbours say little.
/// `depth(k)` is the depth k pixels away, `scale` makes a change of it a tangent.
template <class Depth, class Scale>
float slopeFromFarther(const Depth& depth, const Scale& scale, float here) {
    float sum = 0, weights = 0;
    for (const int way : {-1, 1}) {
        float before = here;
        for (int k = 1; k <= kFarther; ++k) {
            const float there = depth(way * k);
            const auto step = static_cast<float>(way) * scale(there);
            if (!(std::abs((there - before) * step) <= kSteepest)) break;
            const float change = (there - here) * step;
            sum += static_cast<float>(k) * change;
            weights += static_cast<float>(k * k);
            before = there;
        }
    }
    return weights > 0 ? sum / weights : 0.0f;
}

glm::vec2 slopeFromDepth(const Window& w, int x, int y, const Steps& steps) {
    const auto& c = w.camera();
    const float z = w.depth(x, y);
    const double pixel = c.orthographic ? 1.0 / c.fx : z / c.fx;
    if (!(w.view.refined.doubt * z > kNoisyOfPixel * pixel))
        return {slopeFrom(steps.left, steps.right), slopeFrom(steps.up, steps.down)};
    const auto depth = [&](int i, int j) {
        return w.rectangle.shows(i, j) ? w.depth(i, j) : kNoDepth;
    };
    const auto scale = [&](double f, float other) {
        return static_cast<float>(c.orthographic ? f : f / other);
    };
    return {slopeFromFarther([&](int k) { return depth(x + k, y); },
                             [&](float other) { return scale(c.fx, other); }, z),
            slopeFromFarther([&](int k) { return depth(x, y + k); },
                             [&](float other) { return scale(c.fy, other); }, z)};
}

struct Surroundings {
    bool linked = true;
    bool rim = false;
};

// See Slope: whether a point and its four neighbours are one surface.
Surroundings surroundings(const Window& w, int x, int y, const Steps& steps) {
    Surroundings out;
    out.linked = w.alpha(x, y) >= 1.0f;
    bool behind[4] = {};
    constexpr glm::ivec2 kSteps[4] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    const bool same[4] = {steps.right.same, steps.left.same, steps.down.same, steps.up.same};
    for (int k = 0; k < 4; ++k) {
        const int i = x + kSteps[k].x, j = y + kSteps[k].y;
        if (!w.rectangle.shows(i, j)) {
            out.linked = false;
            continue;
        }
        if (!same[k] || w.alpha(i, j) < 1.0f) out.linked = false;
        behind[k] = !same[k] && w.depth(i, j) > w.depth(x, y);
    }
    // What is one pixel thin has no rim: it would break into dots.
    const bool thin = (behind[0] && behind[1]) || (behind[2] && behind[3]);
    out.rim = !thin && (behind[0] || behind[1] || behind[2] || behind[3]);
    return out;
}

bool usable(glm::vec3 v) {
    return glm::dot(v, v) > 0.0f;
}

/// `glass`: glassCoverage() of the page.
void prepareRow(const Window& w, const Image<std::uint8_t>& glass, const glm::mat3& cameraFromWorld,
                int y, NormalRow* normals, PreparedPage& out) {
    const Camera& camera = w.camera();
    for (int x = 0; x < camera.width; ++x) {
        const std::size_t i = w.texel(x, y);
        const float z = w.depth(x, y);
        if (!hasPoint(z)) continue;
        const glm::vec3 ray = rayOf(camera, x, y);
        const Steps steps(w, x, y, z);
        const auto at = [i](const Image<glm::vec3>* image) { return image->data()[i]; };
        glm::vec2 slope;
        const bool hasSplat =
            w.view.hasSplats && usable(glm::cross(at(w.page.splatU), at(w.page.splatV)));
        const bool hasNormal = w.view.hasNormals && usable(at(w.page.normal));
        if (hasSplat) {
            const glm::vec3 u = cameraFromWorld * at(w.page.splatU);
            const glm::vec3 v = cameraFromWorld * at(w.page.splatV);
            glm::vec3 n = glm::cross(u, v);
            if (glm::dot(n, ray) > 0) n = -n;
            slope = slopeFromNormal(n, ray).value_or(glm::vec2(0.0f));
            // Area of the ellipse's parallelogram against that of a lattice cell's on the same
            // plane, whose half diagonals just close the lattice: half a cell.
            const auto spacing = camera.sampleSpacing(w.depth(x, y));
            const float cell = static_cast<float>(spacing.x * spacing.y) *
                               glm::length(glm::cross(glm::vec3(1, 0, 0) + slope.x * ray,
                                                      glm::vec3(0, -1, 0) + slope.y * ray));
            const float size =
                std::sqrt(glm::length(glm::cross(u, v)) / std::max(0.5f * cell, 1e-30f));
            out.sizes[i] = static_cast<std::uint8_t>(std::clamp(size, 0.5f, 3.9f) * 64.0f);
        } else {
            std::optional<glm::vec2> given;
            if (hasNormal) given = slopeFromNormal(cameraFromWorld * at(w.page.normal), ray);
            slope = given ? *given : slopeFromDepth(w, x, y, steps);
        }
        const Surroundings around = surroundings(w, x, y, steps);
        // Where a surface turns away its tilt runs off to infinity; a splat that followed it would
        // stick out.
        if (around.rim && !hasSplat)
            slope = glm::clamp(slope, glm::vec2(-kSteepestRim), glm::vec2(kSteepestRim));
        const auto flagged = [](std::int16_t code, bool flag) {
            return static_cast<std::int16_t>((code & ~1) | (flag ? 1 : 0));
        };
        // As with alpha elsewhere (kHides), half of a pixel is enough to hide what is behind.
        const bool isGlass = !glass.empty() && glass.data()[i] >= kHalfGlass;
        out.slopes[i] = {flagged(coded(slope.x), around.linked || isGlass),
                         flagged(coded(slope.y), around.rim)};
        if (normals) {
            normals->slopeX[x] = slope.x;
            normals->slopeY[x] = slope.y;
        }
    }
    if (!normals) return;
    const glm::vec3 ray = rayOf(camera, 0, y);
    normals->find(glm::transpose(cameraFromWorld), {ray.y, ray.z});
    for (int x = 0; x < camera.width; ++x) {
        const std::size_t i = w.texel(x, y), k = static_cast<std::size_t>(x);
        if (!hasPoint(w.depth(x, y))) continue;
        out.normals[i] = {normals->x[k], normals->y[k], normals->z[k], 0};
        if (!w.view.hasNormals || !usable(w.page.normal->data()[i])) continue;
        const glm::vec3 own = glm::normalize(w.page.normal->data()[i]) * 127.0f;
        out.normals[i] = {roundToInt(own.x), roundToInt(own.y), roundToInt(own.z), 0};
    }
}

std::vector<BlockInfo> blocksOfRow(const Window& w, const PreparedPage& page, int v0) {
    const int width = w.camera().width, v1 = std::min(v0 + kBlock, w.camera().height);
    std::vector<BlockInfo> out;
    for (int u0 = 0; u0 < width; u0 += kBlock) {
        BlockInfo b;
        b.u0 = static_cast<std::uint16_t>(u0);
        b.v0 = static_cast<std::uint16_t>(v0);
        b.u1 = static_cast<std::uint16_t>(std::min(u0 + kBlock, width));
        b.v1 = static_cast<std::uint16_t>(v1);
        b.zMin = kNoDepth;
        b.slopeMin = {32767, 32767};
        b.slopeMax = {-32768, -32768};
        b.size = page.sizes.empty() ? 1.0f : 0.0f;
        for (int y = v0; y < v1; ++y) {
            for (int x = u0; x < b.u1; ++x) {
                const float z = w.depth(x, y);
                if (!hasPoint(z)) continue;
                const float alpha = w.alpha(x, y);
                // Points of alpha 0 are not drawn, so kernels have to look at the alpha of such a
                // block.
                b.opaque = b.opaque && alpha >= 1.0f;
                if (!(alpha > 0)) continue;
                const std::size_t i = w.texel(x, y);
                b.zMin = std::min(b.zMin, z);
                b.zMax = std::max(b.zMax, z);
                const Slope s = page.slopes[i];
                b.slopeMin = {std::min(b.slopeMin.u, s.u), std::min(b.slopeMin.v, s.v)};
                b.slopeMax = {std::max(b.slopeMax.u, s.u), std::max(b.slopeMax.v, s.v)};
                if (!page.sizes.empty()) b.size = std::max(b.size, page.sizes[i] / 64.0f);
                b.linked = b.linked && alpha >= 1.0f && (s.u & Slope::kLinked);
                b.glass = b.glass || (alpha < 1.0f && (s.u & Slope::kGlass));
            }
        }
        if (b.zMin < kNoDepth) out.push_back(b);
    }
    return out;
}

}  // namespace

PreparedPages preparePages(const PageSet& set, bool wantNormals) {
    PreparedPages out;
    out.radius = set.bounds().radius();
    const bool splats = std::any_of(set.views().begin(), set.views().end(),
                                    [](const PageView& v) { return v.hasSplats; });
    std::uint32_t firstPoint = 0;
    for (const Page& page : set.pages()) {
        out.pages.emplace_back().firstPoint = firstPoint;
        firstPoint += static_cast<std::uint32_t>(page.depth->count());
    }
    const auto makeRoom = [&](std::size_t i, PixelSpool* spool) {
        const Page& page = set.pages()[i];
        PreparedPage& prepared = out.pages[i];
        const std::size_t count = page.depth->count();
        prepared.slopes = Pixels<Slope>(count, {}, spool);
        if (wantNormals) prepared.normals = Pixels<glm::i8vec4>(count, {}, spool);
        if (splats && page.splatU && page.splatV)
            prepared.sizes = Pixels<std::uint8_t>(count, 64, spool);
    };
    // The rectangles of a page follow each other. It goes into the spool when they are done: what
    // is written there bit by bit takes longer.
    std::optional<std::size_t> inMemory, glassOf;
    Image<std::uint8_t> glass;  // of page glassOf
    const auto moveOut = [&] {
        if (!inMemory || !set.spool()) return;
        PreparedPage& page = out.pages[*inMemory];
        page.slopes = Pixels<Slope>(page.slopes, set.spool());
        page.normals = Pixels<glm::i8vec4>(page.normals, set.spool());
        page.sizes = Pixels<std::uint8_t>(page.sizes, set.spool());
        inMemory.reset();
    };
    for (const PageRectangle& rectangle : set.rectangles()) {
        set.settle();
        if (set.views()[rectangle.view].unread) {
            out.rectangles.emplace_back().rectangle = &rectangle;
            continue;
        }
        const Window w(set, rectangle);
        const auto number = static_cast<std::size_t>(rectangle.page);
        PreparedPage& page = out.pages[number];
        if (inMemory != number) moveOut();
        if (page.slopes.empty()) {
            makeRoom(number, nullptr);
            inMemory = number;
        }
        if (glassOf != number) {
            glass = glassCoverage(*w.page.texture, *w.page.depth);
            glassOf = number;
        }
        const glm::mat3 cameraFromWorld(
            glm::mat3_cast(glm::conjugate(rectangle.window.orientation)));
        parallelForBlocks(0, rectangle.height, 16, [&](std::int64_t from, std::int64_t to) {
            std::optional<NormalRow> normals;
            if (!page.normals.empty()) normals.emplace(w.camera());
            for (auto y = from; y < to; ++y)
                prepareRow(w, glass, cameraFromWorld, static_cast<int>(y),
                           normals ? &*normals : nullptr, page);
        });
        const int rows = (rectangle.height + kBlock - 1) / kBlock;
        std::vector<std::vector<BlockInfo>> perRow(static_cast<std::size_t>(rows));
        parallelFor(0, rows, [&](std::int64_t r) {
            perRow[r] = blocksOfRow(w, page, static_cast<int>(r) * kBlock);
        });
        PreparedRectangle& prepared = out.rectangles.emplace_back();
        prepared.rectangle = &rectangle;
        for (auto& r : perRow) prepared.blocks.insert(prepared.blocks.end(), r.begin(), r.end());
        for (const BlockInfo& b : prepared.blocks) out.glass = out.glass || b.glass;
    }
    moveOut();
    for (std::size_t i = 0; i < out.pages.size(); ++i)
        if (out.pages[i].slopes.empty()) makeRoom(i, set.spool());
    return out;
}

}  // namespace stx::splat
