#include "lib/render/surface/fill/fill.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "lib/base/for_where.hpp"
#include "lib/base/parallel.hpp"
#include "lib/render/surface/fill/fill_half.hpp"
#include "lib/render/surface/fill/fill_rays.hpp"
#include "lib/render/surface/prepare/votes.hpp"

namespace stx::surface {
namespace shared {

/// Votes on what noise may have taken away: only what lies before a noisy surface by far more than
/// is left of its noise is free.
struct WideVotes : SourcePixels {
    static constexpr float kWide = 4.0f;

    [[nodiscard]] float stepOf(int s) const {
        return at(s).beside > 0.0f ? kWide * at(s).step : at(s).step;
    }
#include "shaders/shared/surface_votes.glsl"
};

/// What sources know of places.
struct LookedAt : SourcePixels {
    /// What lies beside the picture of a source by no more than this share of its size, or behind
    /// its far plane by this share of the distance, continues what it saw.
    static constexpr float kBorder = 0.05f;

    /// Whether a source looked at a point without seeing past it, or almost looked at it.
    [[nodiscard]] bool hides(int s, float x, float y, float q) {
        const vec4 h = warp(s, x, y, q);
        const auto farthest = static_cast<float>(axisOf(s).q((1 + kBorder) * at(s).view->farPlane));
        if (!(h.w > 0.0f && h.z >= farthest * h.w)) return false;
        const auto width = static_cast<float>(sizeOf(s).x),
                   height = static_cast<float>(sizeOf(s).y);
        const auto within = [&](float border) {
            return h.x >= -border * width * h.w && h.x <= (1 + border) * width * h.w &&
                   h.y >= -border * height * h.w && h.y <= (1 + border) * height * h.w;
        };
        return within(kBorder) && (!within(0.0f) || voteOf(s, x, y, q) == kNoVote);
    }
#include "shaders/shared/surface_votes.glsl"
};

}  // namespace shared

namespace {

// Where no source is named the value was chosen by trial on the project's image sets and meshes.
// Shares are of q, see DepthAxis::relativeScale().

/// A pixel covered by this share or more is not worth filling.
constexpr float kClosed = 0.999f;
/// A pixel open by more than this share takes the depth of what fills it.
constexpr float kMostlyOpen = 0.5f;
/// Distances to surface are counted up to this, pixels.
constexpr std::uint8_t kFarthestCounted = 255;

// Holes that no source looks into (fillUnseen).
/// How far surface is looked for in each direction around a small hole, pixels, and directions that
/// must meet some, of eight: see enclosed().
constexpr int kSmallReach = 12;
constexpr int kLeastDirections = 6;
/// The ray is looked at from this share of q in front of the nearest rim to this share of q behind
/// the farthest, but no farther than twice its distance (half its q).
constexpr float kInFront = 0.02f, kBehind = 0.05f, kFarthestShare = 0.5f;
/// Depths that are tried on the way, and how many in a row must be hidden.
constexpr int kDepths = 48, kHiddenDepths = 2;
/// Pixels behind a rim that tell its slope, while q changes by no more than this share from the rim
/// to the first of them, and by no more than the other beside that from each to the next.
constexpr int kSlopePixels = 3;
constexpr float kFirstChange = 0.02f, kNextChange = 0.005f;
/// Colours of rims in front of the fill, by more than this share of q, weigh less by this; those of
/// surfaces that end before the pixel by the other.
constexpr float kForeground = 0.01f, kForegroundWeight = 0.1f, kEndedWeight = 0.2f;

// Backgrounds (fillBackground).
/// Depths behind that of a fill that are looked up in the sources, up to kFarthestShare.
constexpr int kFarther = 4;
/// Pixels of a frame, and of those of half its size and less, that are farther than this from any
/// surface are filled from a picture of half the size, nearer ones by rays; from half of it on both
/// are mixed. 8 for frames, too, gains 0.02 dB of a whole frame that a camera outside of the rig
/// sees and takes 1 % of the time of a frame that is filled by half; 4 loses 0.05 dB.
constexpr int kNearSurface = 6, kNearSurfaceOfHalves = 8;
/// Pixels no farther than this from surface have a ray that meets it: the rays are no further
/// apart than a pixel there.
constexpr int kSurelyMet = 2;
/// Where a ray meets surface the pixel behind the first counts, too, when they differ by no more
/// than this share of q.
constexpr float kSameSurface = 0.03f;
/// The farthest hits weigh most. Depths are compared over their range and this share of q, so that
/// equal depths weigh the same; the nearest keep a little weight. Larger ones show the colour of
/// what is in front in gaps behind it; 0.05 for the first costs open3d-rgbd 0.04 dB.
constexpr float kLeastRange = 0.2f, kNearestWeight = 0.01f;

struct Hit {
    glm::vec3 colour;
    float q, distance;
};

struct Fill {
    int x, y;
    glm::vec3 colour;
    float q;
    glm::vec3 normal{0.0f};  ///< zero where unknown
};

/// Where a direction from an open pixel meets surface.
struct Rim {
    Hit hit;
    int x = 0, y = 0;
    float continued = 0;     ///< q of its plane at the open pixel
    bool continues = false;  ///< no source sees past it there
};

void putIn(OpenFrame& frame, const Fill& fill) {
    glm::vec4& pixel = frame.albedo.at(fill.x, fill.y);
    const float open = 1.0f - pixel.a;
    pixel += glm::vec4(fill.colour * open, open);
    float& q = frame.q.at(fill.x, fill.y);
    if (q > 0.0f && open <= kMostlyOpen) return;
    q = fill.q;
    if (frame.normal && fill.normal != glm::vec3(0.0f))
        frame.normal->at(fill.x, fill.y) = fill.normal;
}

bool closed(const OpenFrame& frame, int x, int y) {
    return frame.albedo.at(x, y).a >= kClosed && frame.q.at(x, y) > 0.0f;
}

/// At a pixel, counted by rows.
Hit hitAt(const OpenFrame& frame, std::ptrdiff_t pixel, float distance) {
    const glm::vec4 c = frame.albedo.data()[pixel];
    // What is divided by one stays the same.
    return {c.a == 1.0f ? glm::vec3(c) : glm::vec3(c) / c.a, frame.q.data()[pixel], distance};
}

Hit hitAt(const OpenFrame& frame, int x, int y, float distance) {
    return hitAt(frame, static_cast<std::ptrdiff_t>(y) * frame.q.width() + x, distance);
}

/// The closed ones among up to 64 pixels of a row, a bit each.
std::uint64_t closedBits(const glm::vec4* albedo, const float* q, std::size_t count) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < count; ++i)
        bits |= static_cast<std::uint64_t>(albedo[i].a >= kClosed && q[i] > 0.0f) << i;
    return bits;
}

/// Distances along a row to the nearest closed pixel of the row.
void distancesAlong(std::span<const glm::vec4> albedo, std::span<const float> q,
                    std::span<std::uint8_t> row) {
    const auto width = static_cast<int>(row.size());
    std::fill(row.begin(), row.end(), std::uint8_t{0});
    const auto put = [&](int begin, int end) {
        // What is beside the picture is not closed.
        constexpr int kNone = kFarthestCounted;
        const int left = begin > 0 ? begin - 1 : begin - kNone;
        const int right = end < width ? end : end + kNone;
        for (int x = begin; x < end; ++x)
            row[static_cast<std::size_t>(x)] =
                static_cast<std::uint8_t>(std::min({x - left, right - x, kNone}));
    };
    int begin = -1;  // of the open run that x is in, -1 = none
    for (int x = 0; x < width;) {
        const auto first = static_cast<std::size_t>(x);
        const int count = std::min(64, width - x);
        std::uint64_t bits = closedBits(&albedo[first], &q[first], static_cast<std::size_t>(count));
        for (int at = 0; at < count;) {
            // To the next pixel that is of the other kind.
            const std::uint64_t left = (begin < 0 ? ~bits : bits) >> at << at;
            at = std::min(std::countr_zero(left), count);
            if (at == count) break;
            if (begin >= 0) put(begin, x + at);
            begin = begin < 0 ? x + at : -1;
        }
        x += count;
    }
    if (begin >= 0) put(begin, width);
}

/// Lowers the distances of a row to what those of the row before or after it tell.
void distancesAcross(std::uint8_t* __restrict row, const std::uint8_t* __restrict other,
                     int width) {
    // In bytes throughout, which vectors do sixteen at once and more.
    const auto least = [](std::uint8_t a, std::uint8_t b) { return a < b ? a : b; };
    const auto next = [&](std::uint8_t d) {
        return static_cast<std::uint8_t>(least(d, kFarthestCounted - 1) + 1);
    };
    for (int x = 1; x < width - 1; ++x)
        row[x] = least(row[x], next(least(least(other[x - 1], other[x]), other[x + 1])));
    for (const int x : {0, width - 1}) {
        const int before = std::max(x - 1, 0), after = std::min(x + 1, width - 1);
        row[x] = least(row[x], next(least(least(other[before], other[x]), other[after])));
    }
}

/// How far each pixel is from the nearest closed one, the larger of columns and rows, at most
/// kFarthestCounted; 0 for closed ones and no others.
Image<std::uint8_t> distancesToSurface(const OpenFrame& frame) {
    const int width = frame.q.width(), height = frame.q.height();
    Image<std::uint8_t> distances(width, height);
    parallelForBlocks(0, height, 32, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y)
            distancesAlong(frame.albedo.row(y), frame.q.row(y), distances.row(y));
    });
    const auto pass = [&](int y, int before) {
        distancesAcross(distances.row(y).data(), distances.row(before).data(), width);
    };
    for (int y = 1; y < height; ++y) pass(y, y - 1);
    for (int y = height - 1; y-- > 0;) pass(y, y + 1);
    return distances;
}

constexpr std::array<std::array<int, 2>, 8> kDirections = {
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};

/// Whether an opening is small enough to be an unseen part of a surface: surface in all directions
/// but one, or in all but two opposite ones, as in the slits between a machine's cooling fins.
bool enclosed(unsigned directionsMet) {
    const unsigned open = ~directionsMet & 0xffu;
    if ((open & (open - 1)) == 0) return true;
    return open == 0x11u || open == 0x22u || open == 0x44u || open == 0x88u;
}

/// Whether any source sees past a point, in noisy views clearly.
bool isFree(std::span<const LocalSource> sources, float x, float y, float q) {
    if (std::any_of(sources.begin(), sources.end(),
                    [](const LocalSource& s) { return s.source->beside > 0.0f; })) {
        shared::WideVotes votes{{sources}};
        int free = 0;
        for (int s = 0; s < static_cast<int>(sources.size()); ++s) {
            free += votes.voteOf(s, x, y, q);
            if (free >= shared::WideVotes::kWholeVote) return true;
        }
        return false;
    }
    return std::any_of(sources.begin(), sources.end(),
                       [&](const LocalSource& s) { return seesPast(s, x, y, q); });
}

/// The depth of a hidden stretch of the ray through (x, y) between two depths, 0 = none.
float hiddenDepth(std::span<const LocalSource> sources, float x, float y, float qNear, float qFar) {
    int unknown = 0;
    for (int step = 0; step < kDepths; ++step) {
        const float q = qNear + (qFar - qNear) * static_cast<float>(step) / (kDepths - 1);
        unknown = isFree(sources, x, y, q) ? 0 : unknown + 1;
        if (unknown == kHiddenDepths) return q;
    }
    return 0.0f;
}

/// How much q changes from each pixel to the next behind a rim at (x, y), 0 where the surface ends
/// there.
float slopeBehind(const OpenFrame& frame, int x, int y, const std::array<int, 2>& direction) {
    const float rim = frame.q.at(x, y), scale = frame.space.axis.relativeScale(rim);
    float before = rim, slope = 0;
    for (int i = 1; i <= kSlopePixels; ++i) {
        const int nx = x + direction[0] * i, ny = y + direction[1] * i;
        if (!frame.q.contains(nx, ny) || !closed(frame, nx, ny)) break;
        const float q = frame.q.at(nx, ny);
        if (std::abs(q - before - slope) > (i == 1 ? kFirstChange : kNextChange) * scale) break;
        slope = (q - rim) / static_cast<float>(i);
        before = q;
    }
    return slope;
}

/// The rims that the eight directions from (x, y) meet; how many there are, 0 where the opening is
/// neither enclosed() nor at most `widest` pixels wide in all directions. `far`: a bit for each
/// direction that met nothing nearby at the pixel before, which are likely to decide again; becomes
/// this pixel's.
std::size_t rimsAround(const OpenFrame& frame, const Image<std::uint8_t>& distances, int x, int y,
                       int widest, unsigned& far, std::array<Rim, 8>& rims) {
    const int reach = std::max(kSmallReach, widest);
    const int width = distances.width(), height = distances.height();
    const std::uint8_t* const here = distances.row(y).data() + x;
    std::array<int, 8> steps{};  // to the rim, 0 = none
    unsigned nearby = 0;         // a bit for each direction that meets surface in small reach
    unsigned notNearby = 0;
    bool tooWide = false;
    for (const unsigned some : {far, ~far & 0xffu}) {
        for (unsigned left = some; left != 0; left &= left - 1) {
            const auto k = static_cast<std::size_t>(std::countr_zero(left));
            const auto [dx, dy] = kDirections[k];
            const auto room = [](int along, int at, int size) {
                return along == 0 ? size : along > 0 ? size - 1 - at : at;
            };
            const int most = std::min({reach, room(dx, x, width), room(dy, y, height)});
            const std::ptrdiff_t stride = static_cast<std::ptrdiff_t>(dy) * width + dx;
            // No surface is nearer than the distances say.
            for (int step = std::max<int>(*here, 1); step <= most;) {
                const int distance = here[step * stride];
                if (distance == 0) {
                    steps[k] = step;
                    break;
                }
                step += distance;
            }
            const bool isNear = steps[k] > 0 && steps[k] <= kSmallReach;
            (isNear ? nearby : notNearby) |= 1u << k;
            tooWide = tooWide || steps[k] == 0;
            if (tooWide && std::popcount(notNearby) > 8 - kLeastDirections) {
                far = notNearby;
                return 0;
            }
        }
    }
    far = notNearby;
    for (std::size_t k = 0; k < 4; ++k) tooWide = tooWide || steps[k] + steps[k + 4] > widest;
    if (tooWide && !enclosed(nearby)) return 0;
    std::size_t count = 0;
    for (std::size_t k = 0; k < kDirections.size(); ++k) {
        if (steps[k] == 0) continue;
        const int nx = x + kDirections[k][0] * steps[k], ny = y + kDirections[k][1] * steps[k];
        const auto along = static_cast<float>(steps[k]);
        Rim& rim = rims[count++];
        rim = {hitAt(frame, nx, ny, ((k & 1) ? 1.41421356f : 1.0f) * along), nx, ny};
        rim.continued = rim.hit.q - slopeBehind(frame, nx, ny, kDirections[k]) * along;
    }
    return count;
}

/// What fills an open pixel that is hidden from all sources from `hidden` on. The rims' planes are
/// continued into the hole: the nearest that stays hidden is what the pixel shows. Its colour is
/// the mean of the rims, most of those that continue.
Fill continued(const OpenFrame& frame, std::span<const LocalSource> sources, int x, int y,
               float hidden, std::span<Rim> rims) {
    const float foreground = hidden + kForeground * frame.space.axis.relativeScale(hidden);
    const Rim* nearest = nullptr;
    for (Rim& rim : rims) {
        rim.continues =
            rim.continued > 0.0f && !isFree(sources, static_cast<float>(x) + 0.5f,
                                            static_cast<float>(y) + 0.5f, rim.continued);
        if (rim.continues && (!nearest || rim.continued > nearest->continued)) nearest = &rim;
    }
    Fill fill{x, y, glm::vec3(0.0f), hidden};
    if (nearest) {
        fill.q = std::min(nearest->continued, hidden);
        if (frame.normal) fill.normal = frame.normal->at(nearest->x, nearest->y);
    }
    float weights = 0;
    for (const Rim& rim : rims) {
        float weight = 1.0f / (rim.hit.distance * std::sqrt(rim.hit.distance));
        if (rim.hit.q > foreground) weight *= kForegroundWeight;
        if (!rim.continues) weight *= kEndedWeight;
        fill.colour += weight * rim.hit.colour;
        weights += weight;
    }
    fill.colour /= weights;
    return fill;
}

/// The frame at half the size, rounded up: each pixel is the mean of the closed ones among its
/// four, and open where there is none.
void halve(const OpenFrame& frame, const Image<std::uint8_t>& distances, Image<glm::vec4>& albedo,
           Image<float>& q) {
    const int width = (frame.q.width() + 1) / 2, height = (frame.q.height() + 1) / 2;
    albedo = Image<glm::vec4>(width, height, glm::vec4(0.0f));
    q = Image<float>(width, height, 0.0f);
    parallelForBlocks(0, height, 16, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y) {
            for (int x = 0; x < width; ++x) {
                if (distances.at(2 * x, 2 * y) > 1) continue;  // nor are those beside it closed
                float count = 0;
                for (int k = 0; k < 4; ++k) {
                    const int nx = 2 * x + k % 2, ny = 2 * y + k / 2;
                    if (!frame.q.contains(nx, ny) || distances.at(nx, ny) > 0) continue;
                    const Hit hit = hitAt(frame, nx, ny, 0);
                    albedo.at(x, y) += glm::vec4(hit.colour, 1.0f);
                    q.at(x, y) += hit.q;
                    count += 1;
                }
                if (count == 0) continue;
                albedo.at(x, y) /= count;
                q.at(x, y) /= count;
            }
        }
    });
}

/// 0 up to `t` = 0, 1 from `t` = 1 on.
float smoothStep(float t) {
    t = std::clamp(t, 0.0f, 1.0f);
    return t * t * (3 - 2 * t);
}

/// What surface around shows at an open pixel: where rays through the picture meet it. False where
/// none does.
bool alongRays(const OpenFrame& frame, const Image<std::uint8_t>& distances, const RayBatch& batch,
               std::size_t pixel, Fill& fill) {
    std::array<glm::vec3, kRays> colours;
    std::array<float, kRays> qs, weights;  // weights are distances first
    std::size_t count = 0;
    for (const RayBatch::Rays& rays : batch.rays()) {
        const std::int32_t rim = rays.rim[pixel], behind = rays.behind[pixel];
        if (rim == RayBatch::kNone) continue;
        const Hit hit = hitAt(frame, rim, 0);
        colours[count] = hit.colour;
        qs[count] = hit.q;
        weights[count++] = rays.length[pixel] + 1;
        if (behind == RayBatch::kNone || distances.data()[behind] > 0) continue;
        const Hit second = hitAt(frame, behind, 0);
        if (std::abs(second.q - hit.q) > kSameSurface * frame.space.axis.relativeScale(hit.q))
            continue;
        colours[count - 1] = 0.5f * (hit.colour + second.colour);
    }
    if (count == 0) return false;
    const auto [farthest, nearest] = std::minmax_element(qs.begin(), qs.begin() + count);
    const float front = *nearest;
    const float range = front - *farthest + kLeastRange * frame.space.axis.relativeScale(front);
    // All at once in vectors.
    for (std::size_t k = 0; k < count; ++k) {
        const float behind = (front - qs[k]) / range + kNearestWeight;
        weights[k] = behind * behind / (weights[k] * std::sqrt(weights[k]));
    }
    glm::vec3 sum(0.0f);
    float all = 0, depth = 0;
    for (std::size_t k = 0; k < count; ++k) {
        sum += weights[k] * colours[k];
        depth += weights[k] * qs[k];
        all += weights[k];
    }
    fill.colour = sum / all;
    fill.q = depth / all;
    return true;
}

/// fillBackground() of a frame at 1/`scale` of its size. What lies amid what is filled, or amid
/// what stays open, at half the size is like that; the rest is looked up in the sources.
void fillLevel(OpenFrame& frame, std::span<const LocalSource> sources, int scale) {
    const int height = frame.q.height();
    const Image<std::uint8_t> distances = distancesToSurface(frame);
    const auto all = distances.pixels();
    if (std::ranges::find(all, std::uint8_t{0}) == all.end()) return;
    std::uint8_t farthest = 0;
    for (const std::uint8_t d : all) farthest = std::max(farthest, d);
    if (farthest == 0) return;
    Half half;
    if (farthest > kSurelyMet) {
        halve(frame, distances, half.albedo, half.q);
        OpenFrame smaller{half.albedo, half.q, frame.space};
        fillLevel(smaller, sources, 2 * scale);
    }

    const auto near = static_cast<float>(scale == 1 ? kNearSurface : kNearSurfaceOfHalves);
    // Only closed pixels are read, so that no fill feeds on another.
    parallelForBlocks(0, height, 8, [&](std::int64_t from, std::int64_t to) {
        shared::LookedAt places{{sources}};
        int last = 0;  // the source that hid a place, which is likely to hide the next
        const auto toFill = [&](const Fill& fill) {
            const float x = (static_cast<float>(fill.x) + 0.5f) * static_cast<float>(scale);
            const float y = (static_cast<float>(fill.y) + 0.5f) * static_cast<float>(scale);
            const int count = static_cast<int>(sources.size());
            // What fills a pixel tells its depth roughly: what is there may be farther away.
            const float apart = kFarthestShare * frame.space.axis.relativeScale(fill.q) / kFarther;
            for (int k = 0; k < count; ++k) {
                const int s = (last + k) % count;
                for (int step = 0; step <= kFarther; ++step) {
                    const float q = fill.q - apart * static_cast<float>(step);
                    if (!(q > 0.0f) || !places.hides(s, x, y, q)) continue;
                    last = s;
                    return true;
                }
            }
            return false;
        };
        const auto put = [&](const Fill& fill, const Sample& beyond) {
            if (!beyond.mixed || toFill(fill)) putIn(frame, fill);
        };
        struct Near {
            int x, y;
            float far;
            Sample beyond;
        };
        std::array<Near, kRayBatch> nearby;
        RayBatch rays(distances);
        const auto putNear = [&] {
            rays.walk();
            for (std::size_t i = 0; i < rays.count(); ++i) {
                const auto& [x, y, far, beyond] = nearby[i];
                Fill fill{x, y, beyond.colour, beyond.q};
                if (alongRays(frame, distances, rays, i, fill)) {
                    if (far > 0.0f && beyond.q > 0.0f) {
                        fill.colour = glm::mix(fill.colour, beyond.colour, far);
                        fill.q = glm::mix(fill.q, beyond.q, far);
                    }
                } else if (!(beyond.q > 0.0f)) {
                    continue;
                }
                put(fill, beyond);
            }
            rays.clear();
        };
        std::vector<std::uint8_t> open, filled;
        for (int y = static_cast<int>(from); y < to; ++y) {
            const auto look = [&](int x) {
                if (frame.albedo.at(x, y).a >= kClosed) return;
                const Sample beyond = half.at(x, y);
                const int distance = distances.at(x, y);
                // What looks at colours of halves is hardly ever beside surface there.
                const bool unseen = scale > 1 && distance == 1 && !beyond.mixed;
                const float far = half.q.empty()
                                      ? 0.0f
                                      : smoothStep(2.0f * static_cast<float>(distance) / near - 1);
                if (unseen || far >= 1.0f) return put({x, y, beyond.colour, beyond.q}, beyond);
                nearby[rays.count()] = {x, y, far, beyond};
                rays.add(x, y, distance);
                if (rays.full()) putNear();
            };
            const auto row = distances.row(y);
            open.assign(row.size() + row.size() % 2, 0);
            std::copy(row.begin(), row.end(), open.begin());
            half.keepFilled(y, open, filled);
            forWhere(
                open, [](std::uint8_t d) { return d > 0; }, look);
        }
        putNear();
    });
}

}  // namespace

void fillUnseen(OpenFrame frame, std::span<const LocalSource> sources, int widest) {
    const int reach = std::max(kSmallReach, widest / 2);
    const int height = frame.q.height();
    const Image<std::uint8_t> distances = distancesToSurface(frame);
    std::vector<std::vector<Fill>> rows(static_cast<std::size_t>(height));
    parallelForBlocks(0, height, 8, [&](std::int64_t from, std::int64_t to) {
        unsigned far = 0;
        std::array<Rim, 8> room;
        for (int y = static_cast<int>(from); y < to; ++y) {
            const auto look = [&](int x) {
                if (frame.albedo.at(x, y).a >= kClosed) return;
                // What is covered in part is an outline: filled in some frames and not in others it
                // would flicker.
                const int across = frame.albedo.at(x, y).a > 0.0f ? 0 : widest;
                const std::size_t count = rimsAround(frame, distances, x, y, across, far, room);
                if (count == 0) return;
                const std::span<Rim> rims(room.data(), count);
                float nearest = 0, farthest = std::numeric_limits<float>::max();
                for (const Rim& rim : rims) {
                    nearest = std::max(nearest, rim.hit.q);
                    farthest = std::min(farthest, rim.hit.q);
                }
                const float scale = frame.space.axis.relativeScale(nearest);
                const float hidden =
                    hiddenDepth(sources, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f,
                                nearest + kInFront * scale,
                                std::max(farthest - kBehind * scale, kFarthestShare * farthest));
                if (!(hidden > 0.0f)) return;
                rows[static_cast<std::size_t>(y)].push_back(
                    continued(frame, sources, x, y, hidden, rims));
            };
            // Farther from surface no direction meets any.
            forWhere(
                distances.row(y), [&](std::uint8_t d) { return d > 0 && d <= reach; }, look);
        }
    });
    // At the end, so that no fill feeds on another.
    Image<std::uint8_t> filled(frame.q.width(), height, 0);
    for (const auto& row : rows)
        for (const Fill& fill : row) filled.at(fill.x, fill.y) = 1;
    const auto besideOpen = [&](int x, int y) {
        for (int v = y - 1; v <= y + 1; ++v)
            for (int u = x - 1; u <= x + 1; ++u)
                if (filled.contains(u, v) && !filled.at(u, v) && !(frame.albedo.at(u, v).a > 0.0f))
                    return true;
        return false;
    };
    // Where a source sees past what is beside it, what is open of an outline is open to the view,
    // too: along rays that graze a surface no source tells. Of 67 random cases 22 change, the mean
    // by 0.26 dB, tori by 2 to 5, none down by 0.02.
    for (auto& row : rows)
        std::erase_if(row, [&](const Fill& fill) {
            return frame.albedo.at(fill.x, fill.y).a > 0.0f && besideOpen(fill.x, fill.y);
        });
    for (const auto& row : rows)
        for (const Fill& fill : row) putIn(frame, fill);
}

void fillBackground(OpenFrame frame, std::span<const LocalSource> sources) {
    fillLevel(frame, sources, 1);
}

}  // namespace stx::surface
