#include "lib/refine/exposure.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "lib/base/parallel.hpp"
#include "lib/geometry/bounds.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/geometry/near_views.hpp"

namespace stx {
namespace {

/// Points of a view at which colours are compared, and those that find who shows the same.
constexpr double kPoints = 600, kPointsOfLeaves = 5000, kRankPoints = 40;
/// With fewer points inside of surfaces (leaves, hair) single pixels are compared.
constexpr std::size_t kFewInside = 60;
/// Views of fewer pixels are left alone: each pixel is so large a part of what is shown that
/// colours differ by where it samples. A ball in exact views of 19x16 was taken for lit otherwise,
/// 2.4 times as clearly as is asked for, a room in such of 19x14 and a torus in such of 41x36; of
/// 29 cases of tests/sweep with larger views the clearest has 0.43.
constexpr std::int64_t kFewPixels = 2000;
/// Views that a view is compared with: those that show most of it.
constexpr std::size_t kComparedWith = 8;
/// Views that show less of each other are not compared.
constexpr int kLeastShown = 2;
/// Surfaces are seen from the front when the cosine to their normal is larger.
constexpr double kFromTheFront = 0.2;
/// The same surface: depths that differ by no more than this share of them, or of the size of all
/// that is shown where that is less: from far away both sides of an object are at one depth. Noise
/// may be more; then fewer points are left.
constexpr double kSamePlace = 0.015;
/// Where colours of 3x3 pixels range over more than this share of their mean and this, sampling
/// tells more than light.
constexpr float kRange = 0.5f, kRangeOfDark = 0.02f;

/// Colours of single pixels, covered in full, or the means of 3x3 on one surface.
class Samples {
  public:
    Samples(std::span<const Camera> cameras, const PartOfView& partOf, int radius)
        : cameras_(cameras), partOf_(partOf), radius_(radius) {
        for (const Camera& c : cameras) cameraFromWorld_.push_back(c.cameraFromWorld());
    }

    [[nodiscard]] std::vector<ColourPoint> pointsOf(std::size_t view) const {
        const Camera& c = cameras_[view];
        const double pixels = static_cast<double>(c.width) * c.height;
        const double wanted = radius_ > 0 ? kPoints : kPointsOfLeaves;
        const int step = std::max(1, static_cast<int>(std::sqrt(pixels / wanted)));
        std::vector<ColourPoint> points;
        for (int y = step / 2; y < c.height; y += step) {
            for (int x = step / 2; x < c.width; x += step) {
                const float depth = depthAt(view, x, y);
                if (!hasPoint(depth)) continue;
                const auto colour = colourAt(view, x, y, depth);
                if (!colour) continue;
                const auto worldAt = [&](int i, int j) {
                    return c.position +
                           c.orientation * c.unproject(i + 0.5, j + 0.5, depthAt(view, i, j));
                };
                const glm::dvec3 world = worldAt(x, y);
                glm::dvec3 normal = towards(c, world);
                if (radius_ > 0 || isAmid(view, x, y, depth))
                    normal = glm::normalize(glm::cross(worldAt(x + 1, y) - worldAt(x - 1, y),
                                                       worldAt(x, y - 1) - worldAt(x, y + 1)));
                points.push_back({world, normal, *colour});
            }
        }
        return points;
    }

    /// Called before shownAt(), with the points of all views.
    void setSizeOf(const ColourPoints& views) {
        Bounds all;
        for (const auto& points : views)
            for (const ColourPoint& point : points) all.add(point.world);
        size_ = 2 * all.radius();
    }

    /// What a view shows of a point; nothing when something else is there.
    [[nodiscard]] std::optional<glm::vec3> shownAt(std::size_t view,
                                                   const ColourPoint& point) const {
        const Camera& c = cameras_[view];
        // The other side of a sheet is another surface.
        if (!(glm::dot(point.normal, towards(c, point.world)) > kFromTheFront)) return {};
        const glm::dvec3 p(cameraFromWorld_[view] * glm::dvec4(point.world, 1));
        if (!c.orthographic && !(p.z < 0)) return {};
        const glm::dvec3 at = c.project(p);
        if (!(at.x >= 0 && at.y >= 0 && at.x < c.width && at.y < c.height)) return {};
        return colourAt(view, static_cast<int>(at.x), static_cast<int>(at.y), at.z);
    }

  private:
    [[nodiscard]] static glm::dvec3 towards(const Camera& c, glm::dvec3 world) {
        return c.orthographic ? -c.forward() : glm::normalize(c.position - world);
    }
    [[nodiscard]] float depthAt(std::size_t view, int x, int y) const {
        const PixelPart part = partOf_(view, x, y, x, y);
        return part.texture ? part.depth->data()[part.texel(x, y)] : kNoDepth;
    }
    /// Whether the pixels beside one are on its surface: where they are, the other side of a thin
    /// plate can be told from it.
    [[nodiscard]] bool isAmid(std::size_t view, int x, int y, float depth) const {
        const Camera& c = cameras_[view];
        const auto isAt = [&](int i, int j) {
            if (i < 0 || j < 0 || i >= c.width || j >= c.height) return false;
            const float there = depthAt(view, i, j);
            return hasPoint(there) && std::abs(there - depth) < 2 * kSamePlace * depth;
        };
        return isAt(x - 1, y) && isAt(x + 1, y) && isAt(x, y - 1) && isAt(x, y + 1);
    }
    [[nodiscard]] std::optional<glm::vec3> colourAt(std::size_t view, int x, int y,
                                                    double depth) const {
        const Camera& c = cameras_[view];
        const int x0 = x - radius_, y0 = y - radius_, x1 = x + radius_, y1 = y + radius_;
        if (x0 < 0 || y0 < 0 || x1 >= c.width || y1 >= c.height) return {};
        const PixelPart part = partOf_(view, x0, y0, x1, y1);
        if (!part.texture) return {};
        const auto isAt = [&](std::size_t texel, double share) {
            const double there = part.depth->data()[texel];
            return hasPoint(static_cast<float>(there)) &&
                   std::abs(there - depth) < share * std::min(depth, size_);
        };
        if (!isAt(part.texel(x, y), kSamePlace)) return {};
        glm::vec4 sum(0), low(1e9f), high(-1e9f);
        for (int j = y0; j <= y1; ++j) {
            for (int i = x0; i <= x1; ++i) {
                const std::size_t texel = part.texel(i, j);
                const glm::vec4 colour = part.texture->at(texel);
                if (colour.a < 1.0f || !isAt(texel, 2 * kSamePlace)) return {};
                sum += colour;
                low = glm::min(low, colour);
                high = glm::max(high, colour);
            }
        }
        sum /= static_cast<float>((x1 - x0 + 1) * (y1 - y0 + 1));
        for (int k = 0; k < 3; ++k)
            if (high[k] - low[k] > kRange * sum[k] + kRangeOfDark) return {};
        return glm::vec3(sum);
    }

    std::span<const Camera> cameras_;
    const PartOfView& partOf_;
    int radius_;
    std::vector<glm::dmat4> cameraFromWorld_;
    double size_ = std::numeric_limits<double>::infinity();  ///< of all that is shown
};

/// Views that are compared with each other, by pairs, a < b: of each those that show most of it.
std::vector<SharedColours> pairsThatShare(const std::vector<std::vector<std::uint16_t>>& shown) {
    const std::size_t views = shown.size();
    std::set<std::pair<std::size_t, std::size_t>> wanted;
    for (std::size_t v = 0; v < views; ++v) {
        std::vector<std::pair<int, std::size_t>> ranked;
        for (std::size_t other = 0; other < views; ++other)
            if (other != v && shown[other][v] >= kLeastShown)
                ranked.emplace_back(-static_cast<int>(shown[other][v]), other);
        std::sort(ranked.begin(), ranked.end());
        ranked.resize(std::min(ranked.size(), kComparedWith));
        for (const auto& entry : ranked)
            wanted.emplace(std::min(v, entry.second), std::max(v, entry.second));
    }
    std::vector<SharedColours> pairs;
    for (const auto& [a, b] : wanted) pairs.push_back({a, b, {}});
    return pairs;
}

/// What a view shows at a point of another.
struct ColourAt {
    std::uint32_t point = 0;  ///< its number
    glm::vec3 colour;
};
/// By the points' numbers, ascending.
using ColoursAt = std::vector<ColourAt>;

/// Pairs of views that show the same, and their colours there. Looks at each view alone.
class SharedColoursFinder {
  public:
    /// `keeps`: views are read for each look. Then colours are kept when it is found who shows the
    /// same, so that views need not be looked at again.
    SharedColoursFinder(std::span<const Camera> cameras, const PartOfView& partOf,
                        const EachView& each, int radius, bool keeps,
                        const ColourPoints* known = nullptr)
        : cameras_(cameras),
          each_(each),
          keeps_(keeps),
          known_(known != nullptr),
          samples_(cameras, partOf, radius),
          points_(known ? *known : ColourPoints(cameras.size())),
          shown_(cameras.size(), std::vector<std::uint16_t>(cameras.size())),
          colours_(cameras.size()),
          dropped_(cameras.size()) {}

    /// Nothing where not all views were looked at.
    Result<std::optional<std::vector<SharedColours>>> find() {
        if (!known_) {
            STX_TRY(const bool all,
                    each_([&](std::size_t v) { points_[v] = samples_.pointsOf(v); }));
            if (!all) return std::nullopt;
        }
        samples_.setSizeOf(points_);
        // How much of each view another shows.
        const auto lookFor = viewsToLookFor(
            points_.size(), [&](std::size_t v) -> const Camera& { return cameras_[v]; },
            [&](std::size_t v) {
                std::vector<glm::dvec3> places;
                for (const ColourPoint& point : points_[v]) places.push_back(point.world);
                return ShownSphere::around(places);
            });
        STX_TRY(const bool ranked, each_([&](std::size_t at) {
                    for (const std::size_t v : lookFor[at])
                        keeps_ ? rankAndKeep(at, v) : rank(at, v);
                }));
        if (!ranked) return std::nullopt;
        auto pairs = pairsThatShare(shown_);
        STX_TRY(const bool found, findMissing(pairs));
        if (!found) return std::nullopt;
        // Both ways: what is shown at a point is a little blurred beside the point's own colour.
        for (SharedColours& pair : pairs) {
            for (const ColourAt& b : colours_[pair.b][pair.a])
                pair.points.push_back({points_[pair.a][b.point].colour, b.colour});
            for (const ColourAt& a : colours_[pair.a][pair.b])
                pair.points.push_back({a.colour, points_[pair.b][a.point].colour});
        }
        return pairs;
    }

  private:
    using Points = std::vector<ColourPoint>;

    /// Every so many of a view's points rank who shows it, from half as many on.
    [[nodiscard]] static std::size_t rankStep(const Points& points) {
        return static_cast<std::size_t>(
            std::max(1.0, static_cast<double>(points.size()) / kRankPoints));
    }
    void rank(std::size_t at, std::size_t v) {
        const std::size_t step = rankStep(points_[v]);
        for (std::size_t k = step / 2; k < points_[v].size(); k += step)
            shown_[at][v] += samples_.shownAt(at, points_[v][k]) ? 1 : 0;
    }
    void rankAndKeep(std::size_t at, std::size_t v) {
        if (isBeside(at, points_[v])) return;
        ColoursAt found = coloursOf(v, at);
        const std::size_t step = rankStep(points_[v]);
        for (const ColourAt& c : found) shown_[at][v] += c.point % step == step / 2 ? 1 : 0;
        if (found.empty()) return;
        const auto bytes = static_cast<std::int64_t>(found.size() * sizeof(ColourAt));
        if (keptBytes_.fetch_add(bytes) + bytes > kKeptBytes) {
            keptBytes_ -= bytes;
            dropped_[at].insert(v);
            return;
        }
        found.shrink_to_fit();
        colours_[at][v] = std::move(found);
    }
    /// No point of a view can be in the picture of another: all are beyond one of its sides by a
    /// pixel or more, or behind it.
    [[nodiscard]] bool isBeside(std::size_t at, const Points& points) const {
        const Camera& c = cameras_[at];
        if (c.orthographic) return false;
        std::array<bool, 5> beyond{true, true, true, true, true};
        for (const ColourPoint& point : points) {
            const glm::dvec3 p = glm::conjugate(c.orientation) * (point.world - c.position);
            const double w = -p.z, x = c.fx * p.x + c.cx * w, y = -c.fy * p.y + c.cy * w;
            const double inside[] = {w, x + w, (c.width + 1) * w - x, y + w,
                                     (c.height + 1) * w - y};
            for (std::size_t k = 0; k < beyond.size(); ++k) beyond[k] = beyond[k] && inside[k] < 0;
        }
        return std::ranges::any_of(beyond, [](bool all) { return all; });
    }
    [[nodiscard]] ColoursAt coloursOf(std::size_t v, std::size_t at) const {
        ColoursAt found;
        for (std::size_t k = 0; k < points_[v].size(); ++k)
            if (const auto colour = samples_.shownAt(at, points_[v][k]))
                found.push_back({static_cast<std::uint32_t>(k), *colour});
        return found;
    }
    /// Looks for those of the pairs that were not kept. Gives what EachView does.
    Result<bool> findMissing(const std::vector<SharedColours>& pairs) {
        std::vector<std::vector<std::size_t>> missing(points_.size());
        bool any = false;
        for (const SharedColours& pair : pairs) {
            for (const auto& [v, at] : {std::pair(pair.a, pair.b), std::pair(pair.b, pair.a)}) {
                if (keeps_ && !dropped_[at].contains(v)) continue;
                missing[at].push_back(v);
                any = true;
            }
        }
        if (!any) return true;
        return each_([&](std::size_t at) {
            for (const std::size_t v : missing[at]) colours_[at][v] = coloursOf(v, at);
        });
    }

    /// What is kept at most, bytes.
    static constexpr std::int64_t kKeptBytes = 16 << 20;

    std::span<const Camera> cameras_;
    const EachView& each_;
    bool keeps_, known_;
    Samples samples_;
    ColourPoints points_;                            ///< of each view
    std::vector<std::vector<std::uint16_t>> shown_;  ///< by `at` and view: of those that rank
    std::vector<std::map<std::size_t, ColoursAt>> colours_;  ///< the same: all that were found
    std::vector<std::set<std::size_t>> dropped_;  ///< the same: what was too much to keep
    std::atomic<std::int64_t> keptBytes_ = 0;
};

Result<std::optional<std::vector<ColourMap>>> mapsOf(std::span<const Camera> cameras,
                                                     const PartOfView& partOf, const EachView& each,
                                                     bool keeps, const ColourPoints* known) {
    STX_TRY(auto pairs, SharedColoursFinder(cameras, partOf, each, 1, keeps, known).find());
    if (!pairs) return std::nullopt;
    const bool small = std::ranges::all_of(cameras, [](const Camera& c) {
        return static_cast<std::int64_t>(c.width) * c.height < kFewPixels;
    });
    if (small) return matchColours(cameras.size(), {});
    std::size_t most = 0;
    for (const SharedColours& pair : *pairs) most = std::max(most, pair.points.size());
    if (most < kFewInside) {
        STX_TRY(pairs, SharedColoursFinder(cameras, partOf, each, 0, keeps).find());
        if (!pairs) return std::nullopt;
    }
    return matchColours(cameras.size(), *pairs);
}

}  // namespace

std::vector<ColourMap> exposureMaps(std::span<const Camera> cameras, const PartOfView& partOf) {
    const auto each = [&](const std::function<void(std::size_t)>& body) -> Result<bool> {
        parallelFor(0, cameras.size(), [&](std::size_t v) { body(v); });
        return true;
    };
    return **mapsOf(cameras, partOf, each, false, nullptr);  // nothing in it fails or ends
}

Result<std::optional<std::vector<ColourMap>>> exposureMaps(std::span<const Camera> cameras,
                                                           const PartOfView& partOf,
                                                           const EachView& each,
                                                           const ColourPoints* known) {
    return mapsOf(cameras, partOf, each, true, known);
}

std::vector<ColourPoint> colourPointsOf(const ReferenceView& view) {
    const PartOfView whole = [&view](std::size_t, int, int, int, int) {
        return PixelPart{&view.texture, &view.depth, 0, 1, view.camera.width};
    };
    return Samples(std::span(&view.camera, 1), whole, 1).pointsOf(0);
}

void applyMap(const ColourMap& map, int x0, int y0, int x1, int y1, Texture& texture,
              RefineStepReport& report) {
    std::array<std::array<std::uint8_t, 256>, 3> table;
    for (int value = 0; value < 256; ++value) {
        const glm::vec3 c = map(glm::vec3(static_cast<float>(value) / 255.0f));
        for (int k = 0; k < 3; ++k)
            table[k][value] = static_cast<std::uint8_t>(std::min(c[k], 1.0f) * 255.0f + 0.5f);
    }
    RefineStepReport change;
    const auto put = [&change](auto& pixel, const auto& now, double white) {
        const auto moved = [&](int k) {
            return std::abs(static_cast<double>(now[k]) - static_cast<double>(pixel[k]));
        };
        const double sum = moved(0) + moved(1) + moved(2);
        change.pixels += sum > 0;
        change.meanMove += sum / (3 * white);
        pixel = now;
    };
    const auto width = static_cast<std::size_t>(texture.width());
    for (int y = y0; y < y1; ++y) {
        for (int x = x0; x < x1; ++x) {
            const std::size_t texel =
                static_cast<std::size_t>(y) * width + static_cast<unsigned>(x);
            if (auto* bytes = texture.rgba8()) {
                glm::u8vec4& c = bytes->data()[texel];
                if (c.a > 0)
                    put(c, glm::u8vec4(table[0][c.r], table[1][c.g], table[2][c.b], c.a), 255);
            }
            if (auto* floats = texture.rgbaFloat()) {
                glm::vec4& c = floats->data()[texel];
                if (c.a > 0) put(c, glm::vec4(map(glm::vec3(c)), c.a), 1);
            }
        }
    }
    change.moved = change.pixels;
    if (change.moved > 0) change.meanMove /= static_cast<double>(change.moved);
    report.add(change);
}

}  // namespace stx
