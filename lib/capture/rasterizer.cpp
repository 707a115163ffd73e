#include "lib/capture/rasterizer.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "lib/base/parallel.hpp"
#include "lib/base/rounding.hpp"
#include "lib/capture/layers.hpp"
#include "lib/capture/material_sampler.hpp"
#include "lib/capture/tile_kernels.hpp"
#include "lib/capture/triangles.hpp"
#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

/// Pixels; with 4x4 samples a tile's buffers stay in the second-level cache.
constexpr int kTile = 32;
/// Less than this of a surface is not there: half a step of 8 bits.
constexpr float kLeastAlpha = 0.5f / 255.0f;
/// A triangle at most this many samples wide is asked for at all samples around it.
constexpr int kNarrow = 16;
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Samples of n a pixel, the first at 0.5 / n, from a place on, up to another.
int firstSample(double from, int n) {
    return ceilToInt(from * n - 0.5);
}
int lastSample(double to, int n) {
    return floorToInt(to * n - 0.5);
}

/// A part of the picture, pixels; a little larger than what it is of.
struct PictureBounds {
    glm::vec2 low{0.0f}, high{0.0f};

    [[nodiscard]] bool holdsSample(int n) const {
        return firstSample(low.x, n) <= lastSample(high.x, n) &&
               firstSample(low.y, n) <= lastSample(high.y, n);
    }
};

/// A triangle set up for one camera, by 2D homogeneous coordinates (Olano & Greer 1997): edge
/// functions need no division by depth, so triangles that reach behind the viewpoint need no
/// clipping. Shared edges get exactly opposite functions in both triangles (a cross product with
/// its factors swapped is exactly negated), so there are no cracks.
struct SetUp {
    Affine edge[3];   ///< >= 0 inside; proportional to the perspective-correct barycentrics
    Affine nearness;  ///< perspective: 1/dist; orthographic: -dist
    std::uint32_t triangle = 0;
    bool back = false;  ///< its back is seen
    PictureBounds box;
};

class Rasterizer {
  public:
    Rasterizer(const Mesh& mesh, const Camera& camera, const RasterSettings& settings)
        : mesh_(mesh),
          camera_(camera),
          cameraFromWorld_(camera.cameraFromWorld()),
          sampler_(mesh, settings.materials ? Glow::apart : Glow::inColour),
          pixelSamples_(settings.supersampling) {}

    Result<RasterImage> run(const RasterSettings& settings, Job& job);
    /// shownTriangles().
    Result<std::vector<std::uint8_t>> shown(int samples, Job& job);

  private:
    /// Where the vertices are in the picture: pixels_.
    void project();
    /// False for what no sample of `samples` a pixel and side, and no pixel's centre, can see.
    bool boxOf(std::uint32_t triangle, int samples, PictureBounds& out) const;
    /// The same, without what shows its back only, or has no area.
    bool setUp(std::uint32_t triangle, int samples, SetUp& out) const;
    /// What is seen at the samples of a tile.
    struct Tile {
        /// Of the triangles that may show in it; slots are their numbers here. Those of all tiles
        /// at once would be several times the mesh.
        std::vector<SetUp> setUps;
        std::vector<float> depth;        ///< nearness of the opaque surface, and kSpanPadding more
        std::vector<std::uint32_t> ids;  ///< its slot, or kNone; as many
        Layers layers;                   ///< translucent surfaces in front of it
    };
    /// draw(x, y, tile) for each tile that may show something, from several threads.
    template <class Draw>
    Result<void> forEachTile(int samples, Job& job, const Draw& draw);
    void drawSpan(std::uint32_t slot, double y, int from, int to, double step, double origin,
                  std::size_t line, Tile& tile) const;
    void drawLayerSpan(std::uint32_t slot, double y, int from, int to, double step, double origin,
                       std::size_t line, Tile& tile) const;
    void drawTile(int tileX, int tileY, int samples, Tile& tile) const;
    void shadeTile(int tileX, int tileY, const RasterSettings& settings, const Tile& tile,
                   RasterImage& out) const;
    [[nodiscard]] glm::vec4 shadeUniform(const SetUp& s, int px, int py, int samples) const;
    [[nodiscard]] std::optional<glm::vec4> sumOfTextured(const Tile& tile,
                                                         const std::uint32_t* corner, int px,
                                                         int py, int samples) const;
    [[nodiscard]] glm::vec3 lit(const Lighting& lighting, const SetUp& s, glm::vec3 albedo,
                                double x, double y) const;
    static std::uint32_t mainSurface(const Tile& tile, std::size_t sample);
    void resolveCentres(int tileX, int tileY, const Tile& tile, RasterImage& out) const;
    [[nodiscard]] glm::vec3 barycentric(const SetUp& s, double x, double y) const {
        const double e0 = s.edge[0].at(x, y), e1 = s.edge[1].at(x, y), e2 = s.edge[2].at(x, y);
        const double scale = 1.0 / (e0 + e1 + e2);
        return glm::vec3(static_cast<float>(e0 * scale), static_cast<float>(e1 * scale),
                         static_cast<float>(e2 * scale));
    }

    const Mesh& mesh_;
    const Camera& camera_;
    const glm::dmat4 cameraFromWorld_;
    MaterialSampler sampler_;
    std::vector<glm::vec2> pixels_;  ///< of each vertex; NaN behind the viewpoint
    PixelSamples pixelSamples_;
    mutable std::atomic<bool> cut_ = false;  ///< translucent surfaces that would show are left out
};

void Rasterizer::project() {
    pixels_.resize(mesh_.positions.size());
    // What a float holds well, and far outside of any picture.
    constexpr double kFar = 1e9;
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
        const glm::dvec3 p(cameraFromWorld_ * glm::dvec4(glm::dvec3(mesh_.positions[i]), 1.0));
        if (!(p.z < 0)) {
            pixels_[i] = glm::vec2(std::numeric_limits<float>::quiet_NaN());
            continue;
        }
        const double scale = camera_.orthographic ? 1.0 : -1.0 / p.z;
        pixels_[i] = glm::clamp(glm::dvec2(camera_.fx * p.x * scale + camera_.cx,
                                           -camera_.fy * p.y * scale + camera_.cy),
                                -kFar, kFar);
    }
}

bool Rasterizer::boxOf(std::uint32_t triangle, int samples, PictureBounds& out) const {
    const auto& t = mesh_.triangles[triangle];
    const glm::vec2 a = pixels_[t[0]], b = pixels_[t[1]], c = pixels_[t[2]];
    const glm::vec2 size(camera_.width, camera_.height);
    const int behind = std::isnan(a.x) + std::isnan(b.x) + std::isnan(c.x);
    if (behind == 3) return false;
    if (behind > 0) {
        out = {glm::vec2(0.0f), size};
        return true;
    }
    const glm::vec2 low = glm::min(glm::min(a, b), c), high = glm::max(glm::max(a, b), c);
    if (!(high.x >= 0 && high.y >= 0 && low.x < size.x && low.y < size.y)) return false;
    // More than rounding takes, of floats too; the edges decide.
    const float margin = 0.001f + 1e-6f * std::max(size.x, size.y);
    out = {glm::max(low - margin, 0.0f), glm::min(high + margin, size)};
    // Most of the triangles of a dense mesh lie between the samples.
    return out.holdsSample(samples) || out.holdsSample(1);
}

bool Rasterizer::setUp(std::uint32_t triangle, int samples, SetUp& out) const {
    if (!boxOf(triangle, samples, out.box)) return false;
    const auto& t = mesh_.triangles[triangle];
    glm::dvec3 v[3];  // (x * w, y * w, w) in pixels
    double dist[3];
    for (int k = 0; k < 3; ++k) {
        const glm::dvec3 p(cameraFromWorld_ * glm::dvec4(glm::dvec3(mesh_.positions[t[k]]), 1.0));
        dist[k] = -p.z;
        const double w = camera_.orthographic ? 1.0 : dist[k];
        v[k] = {camera_.fx * p.x + camera_.cx * w, -camera_.fy * p.y + camera_.cy * w, w};
    }
    const glm::dvec3 first = glm::cross(v[1], v[2]);
    const double det = glm::dot(v[0], first);
    if (!(det != 0) || !std::isfinite(det)) return false;
    // In pixels y runs down, so counter-clockwise front faces have a negative determinant.
    if (det > 0 && !mesh_.materials[mesh_.triangleMaterial[triangle]].doubleSided) return false;
    out.triangle = triangle;
    out.back = det > 0;

    const glm::dvec3 e[3] = {first, glm::cross(v[2], v[0]), glm::cross(v[0], v[1])};
    const double sign = det > 0 ? 1.0 : -1.0;
    for (int k = 0; k < 3; ++k) out.edge[k] = {sign * e[k].x, sign * e[k].y, sign * e[k].z};
    const double inverse = 1.0 / std::abs(det);
    glm::dvec3 n(0.0);
    for (int k = 0; k < 3; ++k)
        n += sign * e[k] * ((camera_.orthographic ? -dist[k] : 1.0) * inverse);
    out.nearness = {n.x, n.y, n.z};
    return true;
}

void Rasterizer::drawSpan(std::uint32_t slot, double y, int from, int to, double step,
                          double origin, std::size_t line, Tile& tile) const {
    const SetUp& s = tile.setUps[slot];
    if (!clipSpan(s.edge, y, step, origin, from, to)) return;
    const double base = s.nearness.b * y + s.nearness.c;
    const bool perspective = !camera_.orthographic;
    const bool holes = sampler_.seeThrough(s.triangle);
    float* const depth = tile.depth.data() + line;
    std::uint32_t* const ids = tile.ids.data() + line;
    if (!holes && to - from >= kFewSamples)
        return nearerSamples({from, to, origin, step, s.nearness.a, base, perspective, slot}, depth,
                             ids);
    for (int i = from; i <= to; ++i) {
        const double x = origin + i * step;
        const auto nearness = static_cast<float>(s.nearness.a * x + base);
        if (perspective ? nearness <= 0.0f : nearness > 0.0f) continue;  // behind the viewpoint
        if (!(nearness > depth[i])) continue;
        if (holes && !sampler_.opaqueAt(s.triangle, barycentric(s, x, y))) continue;
        depth[i] = nearness;
        ids[i] = slot;
    }
}

void Rasterizer::drawLayerSpan(std::uint32_t slot, double y, int from, int to, double step,
                               double origin, std::size_t line, Tile& tile) const {
    const SetUp& s = tile.setUps[slot];
    if (!clipSpan(s.edge, y, step, origin, from, to)) return;
    const double base = s.nearness.b * y + s.nearness.c;
    const bool perspective = !camera_.orthographic;
    for (int i = from; i <= to; ++i) {
        const double x = origin + i * step;
        const auto nearness = static_cast<float>(s.nearness.a * x + base);
        if (perspective ? nearness <= 0.0f : nearness > 0.0f) continue;  // behind the viewpoint
        const auto sample = line + static_cast<std::size_t>(i);
        if (!(nearness > tile.depth[sample])) continue;
        const auto colour = sampler_.colour(s.triangle, barycentric(s, x, y));
        if (!(colour.w > kLeastAlpha)) continue;
        tile.layers.add(sample, {nearness, std::min(colour.w, 1.0f), glm::vec3(colour),
                                 mesh_.triangleMaterial[s.triangle], slot});
    }
}

void Rasterizer::drawTile(int tileX, int tileY, int samples, Tile& tile) const {
    const int side = kTile * samples;
    auto& depth = tile.depth;
    auto& ids = tile.ids;
    auto& layers = tile.layers;
    const std::size_t pixels = static_cast<std::size_t>(side) * side;
    depth.assign(pixels + kSpanPadding, -std::numeric_limits<float>::infinity());
    ids.assign(pixels + kSpanPadding, kNone);
    layers.reset(0);
    const double step = 1.0 / samples;
    const double originX = tileX * kTile + 0.5 * step, originY = tileY * kTile + 0.5 * step;
    struct SampleBox {
        int left, right, top, bottom;
    };
    const auto samplesOf = [&](const SetUp& s) -> SampleBox {
        const glm::dvec2 corner(tileX * kTile, tileY * kTile);
        const glm::dvec2 low = glm::dvec2(s.box.low) - corner,
                         high = glm::dvec2(s.box.high) - corner;
        return {std::max(firstSample(low.x, samples), 0),
                std::min(lastSample(high.x, samples), side - 1),
                std::max(firstSample(low.y, samples), 0),
                std::min(lastSample(high.y, samples), side - 1)};
    };
    const auto drawLines = [&](const SampleBox& box, const auto& drawLine) {
        if (box.left > box.right) return;
        for (int row = box.top; row <= box.bottom; ++row)
            drawLine(originY + row * step, box.left, box.right,
                     static_cast<std::size_t>(row) * side);
    };
    bool translucent = false;
    const auto count = static_cast<std::uint32_t>(tile.setUps.size());
    for (std::uint32_t slot = 0; slot < count; ++slot) {
        const auto& s = tile.setUps[slot];
        if (sampler_.translucent(s.triangle)) {
            translucent = true;
            continue;
        }
        const SampleBox box = samplesOf(s);
        if (box.right - box.left < kNarrow && !sampler_.seeThrough(s.triangle)) {
            nearerInside({s.edge, &s.nearness, box.left, box.right, box.top, box.bottom, originX,
                          originY, step, side, !camera_.orthographic, slot},
                         depth.data(), ids.data());
            continue;
        }
        drawLines(box, [&](double y, int from, int to, std::size_t line) {
            drawSpan(slot, y, from, to, step, originX, line, tile);
        });
    }
    if (!translucent) return;
    layers.reset(pixels);
    for (std::uint32_t slot = 0; slot < count; ++slot) {
        const auto& s = tile.setUps[slot];
        if (!sampler_.translucent(s.triangle)) continue;
        drawLines(samplesOf(s), [&](double y, int from, int to, std::size_t line) {
            drawLayerSpan(slot, y, from, to, step, originX, line, tile);
        });
    }
}

glm::vec3 Rasterizer::lit(const Lighting& lighting, const SetUp& s, glm::vec3 albedo, double x,
                          double y) const {
    const double nearness = s.nearness.at(x, y);
    const double dist = camera_.orthographic ? -nearness : 1.0 / nearness;
    const glm::vec3 position(camera_.position +
                             camera_.orientation * camera_.unproject(x, y, dist));
    const glm::vec3 toEye = -glm::vec3(camera_.viewDirection(x, y));
    return sampler_.lit(lighting, s.triangle, barycentric(s, x, y), s.back, albedo, position,
                        toEye);
}

/// Whether all samples of a pixel see the same triangle, or none.
bool uniform(const std::uint32_t* ids, int samples, int stride) {
    for (int y = 0; y < samples; ++y) {
        for (int x = 0; x < samples; ++x) {
            if (ids[y * stride + x] != *ids) return false;
        }
    }
    return true;
}

glm::vec4 Rasterizer::shadeUniform(const SetUp& s, int px, int py, int samples) const {
    if (const auto* constant = sampler_.constantColour(s.triangle))
        return glm::vec4(*constant, 1.0f);
    // uv is (U / S, V / S) with U, V, S affine in the pixel: one division a sample.
    const auto* uvs = sampler_.plainTextureUvs(s.triangle);
    const double step = 1.0 / samples;
    glm::vec3 sum(0.0f);
    if (uvs == nullptr) {
        for (int k = 0; k < samples * samples; ++k) {
            const auto b =
                barycentric(s, px + (k % samples + 0.5) * step, py + (k / samples + 0.5) * step);
            sum += glm::vec3(sampler_.colour(s.triangle, b));
        }
    } else {
        const auto& t = mesh_.triangles[s.triangle];
        Affine total, u, v;
        for (int k = 0; k < 3; ++k) {
            const auto& e = s.edge[k];
            const glm::vec2 uv = (*uvs)[t[k]];
            total = {total.a + e.a, total.b + e.b, total.c + e.c};
            u = {u.a + e.a * uv.x, u.b + e.b * uv.x, u.c + e.c * uv.x};
            v = {v.a + e.a * uv.y, v.b + e.b * uv.y, v.c + e.c * uv.y};
        }
        const auto& texture = sampler_.texture(s.triangle);
        if (const auto all = pixelSamples_.sum(texture, u, v, total, px, py))
            return glm::vec4(*all / static_cast<float>(samples * samples), 1.0f);
        for (int sy = 0; sy < samples; ++sy) {
            const double y = py + (sy + 0.5) * step;
            for (int sx = 0; sx < samples; ++sx) {
                const double x = px + (sx + 0.5) * step;
                const double inverse = 1.0 / total.at(x, y);
                sum +=
                    glm::vec3(sampleTexture(texture, {static_cast<float>(u.at(x, y) * inverse),
                                                      static_cast<float>(v.at(x, y) * inverse)}));
            }
        }
    }
    return glm::vec4(sum / static_cast<float>(samples * samples), 1.0f);
}

/// Sum over a pixel whose samples see a few triangles that have a texture and nothing else; nothing
/// where it must be asked sample by sample.
std::optional<glm::vec4> Rasterizer::sumOfTextured(const Tile& tile, const std::uint32_t* corner,
                                                   int px, int py, int samples) const {
    // Only then the samples of a pixel lie at the very same places as those of a tile.
    if (!std::has_single_bit(static_cast<unsigned>(samples))) return {};
    constexpr int kMost = 4;
    PixelColours colours[kMost];
    std::uint32_t slots[kMost];
    int count = 0;
    glm::vec4 sum(0.0f);
    for (int k = 0; k < samples * samples; ++k) {
        const auto id = corner[k / samples * kTile * samples + k % samples];
        if (id == kNone) continue;
        const auto which = static_cast<int>(std::find(slots, slots + count, id) - slots);
        if (which == count) {
            const auto& s = tile.setUps[id];
            const auto* uvs = sampler_.plainTextureUvs(s.triangle);
            if (count == kMost || uvs == nullptr) return {};
            const auto& t = mesh_.triangles[s.triangle];
            if (!pixelSamples_.colours(sampler_.texture(s.triangle), s.edge,
                                       {(*uvs)[t.x], (*uvs)[t.y], (*uvs)[t.z]}, px, py,
                                       colours[count]))
                return {};
            slots[count++] = id;
        }
        sum += glm::vec4(colours[which].at(k), 1.0f);
    }
    return sum;
}

void Rasterizer::shadeTile(int tileX, int tileY, const RasterSettings& settings, const Tile& tile,
                           RasterImage& out) const {
    const auto& ids = tile.ids;
    const bool plain = !settings.lighting.on() && tile.layers.empty();
    const int samples = settings.supersampling;
    const int side = kTile * samples;
    const double step = 1.0 / samples;
    const float share = 1.0f / static_cast<float>(samples * samples);
    const int x1 = std::min(kTile, camera_.width - tileX * kTile);
    const int y1 = std::min(kTile, camera_.height - tileY * kTile);
    for (int py = 0; py < y1; ++py) {
        for (int px = 0; px < x1; ++px) {
            glm::vec4 sum(0.0f), litSum(0.0f);
            const auto* corner =
                ids.data() + static_cast<std::size_t>(py * samples) * side + px * samples;
            if (plain && uniform(corner, samples, side)) {
                if (*corner == kNone) continue;
                out.colour.at(tileX * kTile + px, tileY * kTile + py) = shadeUniform(
                    tile.setUps[*corner], tileX * kTile + px, tileY * kTile + py, samples);
                continue;
            }
            if (plain) {
                const int x = tileX * kTile + px, y = tileY * kTile + py;
                if (const auto all = sumOfTextured(tile, corner, x, y, samples)) {
                    out.colour.at(x, y) = *all * share;
                    continue;
                }
            }
            for (int k = 0; k < samples * samples; ++k) {
                const int sx = px * samples + k % samples, sy = py * samples + k / samples;
                const auto sample = static_cast<std::size_t>(sy) * side + sx;
                const double x = tileX * kTile + (sx + 0.5) * step;
                const double y = tileY * kTile + (sy + 0.5) * step;
                const auto add = [&](const SetUp& s, glm::vec3 colour, float part) {
                    sum += glm::vec4(colour, 1.0f) * part;
                    if (settings.lighting.on())
                        litSum += glm::vec4(lit(settings.lighting, s, colour, x, y), 1.0f) * part;
                };
                float through = 1.0f;
                for (const auto& layer : tile.layers.at(sample)) {
                    add(tile.setUps[layer.slot], layer.colour, layer.alpha * through);
                    through *= 1.0f - layer.alpha;
                }
                if (through > kLeastAlpha && tile.layers.isCut(sample))
                    cut_.store(true, std::memory_order_relaxed);
                if (ids[sample] == kNone) continue;
                const auto& s = tile.setUps[ids[sample]];
                const auto* constant = sampler_.constantColour(s.triangle);
                add(s,
                    constant ? *constant
                             : glm::vec3(sampler_.colour(s.triangle, barycentric(s, x, y))),
                    through);
            }
            const int x = tileX * kTile + px, y = tileY * kTile + py;
            out.colour.at(x, y) = sum * share;
            if (settings.lighting.on()) out.lit.at(x, y) = litSum * share;
        }
    }
}

/// The surface that is seen most at a sample: where more than half of what lies behind is hidden,
/// else the opaque one, else the nearest. kNone where there is nothing.
std::uint32_t Rasterizer::mainSurface(const Tile& tile, std::size_t sample) {
    // Interpolated alphas of one half are a hair off.
    constexpr float kHalf = 0.5f + 1e-4f;
    const auto layers = tile.layers.at(sample);
    float through = 1.0f;
    for (const auto& layer : layers) {
        through *= 1.0f - layer.alpha;
        if (through <= kHalf) return layer.slot;
    }
    if (tile.ids[sample] != kNone || layers.empty()) return tile.ids[sample];
    return layers.front().slot;
}

void Rasterizer::resolveCentres(int tileX, int tileY, const Tile& tile, RasterImage& out) const {
    const int x1 = std::min(kTile, camera_.width - tileX * kTile);
    const int y1 = std::min(kTile, camera_.height - tileY * kTile);
    for (int py = 0; py < y1; ++py) {
        for (int px = 0; px < x1; ++px) {
            const auto id = mainSurface(tile, static_cast<std::size_t>(py) * kTile + px);
            if (id == kNone) continue;
            const int x = tileX * kTile + px, y = tileY * kTile + py;
            const auto& s = tile.setUps[id];
            const double nearness = s.nearness.at(x + 0.5, y + 0.5);
            out.depth.at(x, y) =
                static_cast<float>(camera_.orthographic ? -nearness : 1.0 / nearness);
            const auto b = barycentric(s, x + 0.5, y + 0.5);
            auto& colour = out.colour.at(x, y);
            // A sliver through the centre that no colour sample met is still a point of the object.
            if (colour.w == 0.0f) {
                colour =
                    glm::vec4(glm::vec3(sampler_.colour(s.triangle, b)), 1.0f) * (1.0f / 16.0f);
                if (!out.lit.empty()) out.lit.at(x, y) = colour;
            }
            if (!out.metallicRoughness.empty())
                out.metallicRoughness.at(x, y) = sampler_.metallicRoughness(s.triangle, b);
            if (!out.emissive.empty()) out.emissive.at(x, y) = sampler_.emissive(s.triangle, b);
            if (!out.normal.empty()) out.normal.at(x, y) = sampler_.normal(s.triangle, b, s.back);
        }
    }
}

template <class Draw>
Result<void> Rasterizer::forEachTile(int samples, Job& job, const Draw& draw) {
    const int w = camera_.width, h = camera_.height;
    project();
    const int tilesX = (w + kTile - 1) / kTile, tilesY = (h + kTile - 1) / kTile;
    std::vector<std::vector<std::uint32_t>> bins(static_cast<std::size_t>(tilesX) * tilesY);
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
        PictureBounds box;
        if (!boxOf(t, samples, box)) continue;
        const glm::ivec2 first = glm::ivec2(box.low) / kTile,
                         last = glm::min(glm::ivec2(box.high), glm::ivec2(w, h) - 1) / kTile;
        for (int ty = first.y; ty <= last.y; ++ty) {
            for (int tx = first.x; tx <= last.x; ++tx)
                bins[static_cast<std::size_t>(ty) * tilesX + tx].push_back(t);
        }
    }
    std::atomic<bool> stopped = false;
    parallelForBlocks(0, bins.size(), 8, [&](std::int64_t from, std::int64_t to) {
        Tile tile;
        for (auto i = from; i < to; ++i) {
            if (bins[i].empty()) continue;
            if (job.cancelled.load(std::memory_order_relaxed)) {
                stopped = true;
                return;
            }
            tile.setUps.clear();
            for (const std::uint32_t triangle : bins[i]) {
                SetUp s;
                if (setUp(triangle, samples, s)) tile.setUps.push_back(s);
            }
            draw(static_cast<int>(i % tilesX), static_cast<int>(i / tilesX), tile);
        }
    });
    if (stopped) return job.checkCancelled();
    return {};
}

Result<std::vector<std::uint8_t>> Rasterizer::shown(int samples, Job& job) {
    std::vector<std::uint8_t> out(mesh_.triangles.size());
    const auto mark = [&](const Tile& tile) {
        for (const auto slot : tile.ids)
            if (slot != kNone)
                std::atomic_ref(out[tile.setUps[slot].triangle])
                    .store(1, std::memory_order_relaxed);
    };
    STX_CHECK(forEachTile(samples, job, [&](int tx, int ty, Tile& tile) {
        drawTile(tx, ty, samples, tile);
        mark(tile);
        if (samples == 1) return;
        drawTile(tx, ty, 1, tile);
        mark(tile);
    }));
    return out;
}

Result<RasterImage> Rasterizer::run(const RasterSettings& settings, Job& job) {
    const int w = camera_.width, h = camera_.height;
    RasterImage out;
    out.colour = Image<glm::vec4>(w, h, glm::vec4(0.0f));
    out.depth = Image<float>(w, h, kNoDepth);
    if (settings.lighting.on()) out.lit = out.colour;
    if (settings.normals) out.normal = Image<glm::vec3>(w, h, glm::vec3(0.0f));
    if (settings.materials && hasMetallicRoughness(mesh_))
        out.metallicRoughness = Image<glm::vec2>(w, h, glm::vec2(0.0f));
    if (settings.materials && emits(mesh_)) out.emissive = Image<glm::vec3>(w, h, glm::vec3(0.0f));

    STX_CHECK(forEachTile(settings.supersampling, job, [&](int tx, int ty, Tile& tile) {
        drawTile(tx, ty, settings.supersampling, tile);
        shadeTile(tx, ty, settings, tile, out);
        if (settings.supersampling > 1) drawTile(tx, ty, 1, tile);
        resolveCentres(tx, ty, tile, out);
    }));
    if (cut_)
        job.noteOnce(fmt::format(
            "a pixel shows the nearest {} translucent surfaces; more lie behind each other in the "
            "model, and those behind are left out",
            Layers::kMost));
    return out;
}

}  // namespace

Result<RasterImage> rasteriseTriangles(const Mesh& mesh, const Camera& camera,
                                       const RasterSettings& settings, Job& job) {
    return Rasterizer(mesh, camera, settings).run(settings, job);
}

Result<std::vector<std::uint8_t>> shownTriangles(const Mesh& mesh, const Camera& camera,
                                                 const RasterSettings& settings, Job& job) {
    return Rasterizer(mesh, camera, settings).shown(settings.supersampling, job);
}

std::uint64_t memoryOfTriangle() {
    return sizeof(SetUp);
}

}  // namespace stx
