#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "lib/base/for_where.hpp"
#include "lib/base/parallel.hpp"
#include "lib/render/surface/fill/fill_half.hpp"
#include "lib/render/surface/fill/fill_rays.hpp"
#include "lib/render/surface/fill/open_pixels.hpp"
#include "lib/render/surface/prepare/votes.hpp"

namespace stx::surface {
namespace shared {

/// What sources know of places.
struct LookedAt : SourcePixels {
    /// What lies beside the picture of a source by no more than this share of its size, or behind
    /// its far plane by this share of the distance, continues what it saw.
    static constexpr float kBorder = 0.05f;

    /// Whether a source that does not see past a point looked at it, or almost did.
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
        return within(kBorder);
    }
    [[nodiscard]] bool seesPast(int s, float x, float y, float q) {
        return voteOf(s, x, y, q) != kNoVote && !isOpenBackground(s, x, y, q);
    }
    /// Background views are open where it was never seen what is behind: something hid it.
    [[nodiscard]] bool isOpenBackground(int s, float x, float y, float q) {
        const Source& source = at(s);
        if (!source.view->background) return false;
        const vec4 h = warp(s, x, y, q);
        const ivec2 pixel(floor(vec2(h.x, h.y) / h.w));
        return !source.contains(pixel.x, pixel.y) || !(source.q(pixel.x, pixel.y) > 0.0f);
    }
#include "shaders/shared/surface_votes.glsl"
};

}  // namespace shared

namespace {

// Where no source is named the value was chosen by trial on the project's image sets and meshes.
// Shares are of q, see DepthAxis::relativeScale().

// Backgrounds (fillBackground).
/// Depths behind that of a fill that are looked up in the sources, up to kFarthestShare.
constexpr int kFarther = 4;
/// Pixels of a frame, and of those of half its size and less, that are farther than this from any
/// surface are filled from a picture of half the size, nearer ones by rays; from half of it on both
/// are mixed. 8 for frames, too, gains 0.02 dB of a whole frame that a camera outside of the rig
/// sees and takes 1 % of the time of a frame that is filled by half; 4 loses 0.05 dB.
constexpr int kNearSurface = 6, kNearSurfaceOfHalves = 8;
/// The same of averages that are filled. A camera outside of spheres-miv, at half the size: 39.90
/// dB of the whole frame, with 6 here 39.80; 40.11 where frames are filled before they are
/// averaged, which takes 40 % of the time of a frame instead of 17 %.
constexpr int kNearSurfaceOfAverages = 12;
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

/// The frame at half the size, rounded up: each pixel is the mean of the closed ones among its
/// four, and open where there is none.
Half halved(const OpenFrame& frame, const Image<std::uint8_t>& distances) {
    const int width = (frame.q.width() + 1) / 2, height = (frame.q.height() + 1) / 2;
    Half half{Image<glm::vec4>(width, height, glm::vec4(0.0f)), Image<float>(width, height, 0.0f),
              Image<std::uint8_t>(width, height, 0)};
    parallelForBlocks(0, height, 16, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y) {
            for (int x = 0; x < width; ++x) {
                if (distances.at(2 * x, 2 * y) > 1) continue;  // nor are those beside it closed
                float count = 0;
                for (int k = 0; k < 4; ++k) {
                    const int nx = 2 * x + k % 2, ny = 2 * y + k / 2;
                    if (!frame.q.contains(nx, ny) || distances.at(nx, ny) > 0) continue;
                    const Hit hit = hitAt(frame, nx, ny, 0);
                    half.albedo.at(x, y) += glm::vec4(hit.colour, 1.0f);
                    half.q.at(x, y) += hit.q;
                    count += 1;
                }
                if (count == 0) continue;
                half.albedo.at(x, y) /= count;
                half.q.at(x, y) /= count;
                half.surface.at(x, y) = 1;
            }
        }
    });
    return half;
}

/// The frame averaged by `factor` along each side. Pixels that are open in part have no q: what
/// fills them gives it.
void average(const OpenFrame& frame, int factor, Image<glm::vec4>& albedo, Image<float>& q) {
    albedo = Image<glm::vec4>(frame.q.width() / factor, frame.q.height() / factor);
    q = Image<float>(albedo.width(), albedo.height());
    const float share = 1.0f / static_cast<float>(factor * factor);
    parallelForBlocks(0, q.height(), 8, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y) {
            for (int x = 0; x < q.width(); ++x) {
                glm::vec4 sum(0.0f);
                float qs = 0;
                bool covered = true;
                for (int j = 0; j < factor; ++j) {
                    const glm::vec4* colours = &frame.albedo.at(x * factor, y * factor + j);
                    const float* depths = &frame.q.at(x * factor, y * factor + j);
                    for (int i = 0; i < factor; ++i) {
                        sum += colours[i];
                        qs += depths[i];
                        covered = covered && depths[i] > 0.0f;
                    }
                }
                albedo.at(x, y) = share * sum;
                q.at(x, y) = covered ? share * qs : 0.0f;
            }
        }
    });
}

/// Gives the open pixels of a frame what filled its average.
void putAverage(const Image<glm::vec4>& before, const OpenFrame& filled, int factor,
                OpenFrame& frame) {
    parallelForBlocks(0, filled.q.height(), 8, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from) * factor; y < to * factor; ++y) {
            for (int x = 0; x < filled.q.width(); ++x) {
                const glm::vec4 fill = filled.albedo.at(x, y / factor) - before.at(x, y / factor);
                if (!(fill.a > 1 - kClosed)) continue;
                for (int i = x * factor; i < (x + 1) * factor; ++i)
                    if (frame.albedo.at(i, y).a < kClosed)
                        putIn(frame, {i, y, glm::vec3(fill) / fill.a, filled.q.at(x, y / factor)});
            }
        }
    });
}

/// Goes smoothly from 0 at `t` = 0 to 1 at `t` = 1.
float smoothStep(float t) {
    t = std::clamp(t, 0.0f, 1.0f);
    return t * t * (3 - 2 * t);
}

/// What surface around shows at an open pixel: where rays through the picture, averaged by so much,
/// meet it. False where none does.
bool alongRays(const OpenFrame& frame, const Image<std::uint8_t>& distances, const RayBatch& batch,
               std::size_t pixel, int averaged, FilledPixel& fill) {
    std::array<glm::vec3, kRays> colours;
    std::array<float, kRays> qs, weights;  // weights are distances first
    std::size_t count = 0;
    for (const RayBatch::Rays& rays : batch.rays()) {
        const std::int32_t rim = rays.rim[pixel], behind = rays.behind[pixel];
        if (rim == RayBatch::kNone) continue;
        const Hit hit = hitAt(frame, rim, 0);
        colours[count] = hit.colour;
        qs[count] = hit.q;
        weights[count++] = rays.length[pixel] * static_cast<float>(averaged) + 1;
        if (averaged > 1 || behind == RayBatch::kNone || distances.data()[behind] > 0) continue;
        const Hit second = hitAt(frame, behind, 0);
        if (std::abs(second.q - hit.q) > kSameSurface * frame.space.axis.relativeScale(hit.q))
            continue;
        colours[count - 1] = 0.5f * (hit.colour + second.colour);
    }
    if (count == 0) return false;
    const auto [farthest, nearest] = std::minmax_element(qs.begin(), qs.begin() + count);
    const float front = *nearest;
    const float range = front - *farthest + kLeastRange * frame.space.axis.relativeScale(front);
    // Separate loops, of which compilers make vectors.
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

/// Fills rows of a frame at 1/`scale` of its size out of the same at half that. For one thread.
class RowFiller {
  public:
    struct Of {
        OpenFrame& frame;
        std::span<const LocalSource> sources;
        const Image<std::uint8_t>& distances;  ///< to surface
        const Half& half;
        int scale;
        bool finest;  ///< colours of no larger frame come from it
    };
    RowFiller(const Of& of, const DistanceWords& words)
        : of_(of), places_{{of.sources}}, rays_(words) {}

    void fill(int y) {
        const auto row = of_.distances.row(y);
        open_.assign(row.size() + row.size() % 2, 0);
        std::copy(row.begin(), row.end(), open_.begin());
        of_.half.keepFilled(y, open_, filled_);
        forWhere(
            open_, [](std::uint8_t d) { return d > 0; }, [&](int x) { look(x, y); });
    }
    void finish() { putNear(); }

  private:
    /// Pixels of the frame that one of this one is the average of, along each side.
    [[nodiscard]] int averaged() const { return of_.finest ? of_.scale : 1; }

    void look(int x, int y) {
        if (of_.frame.albedo.at(x, y).a >= kClosed) return;
        const Sample beyond = of_.half.at(x, y);
        const int distance = of_.distances.at(x, y);
        const auto near = static_cast<float>(averaged() > 1 ? kNearSurfaceOfAverages
                                             : of_.finest   ? kNearSurface
                                                            : kNearSurfaceOfHalves);
        // What looks at colours of halves is hardly ever beside surface there.
        const bool unseen = !of_.finest && distance == 1 && !beyond.mixed;
        const float far =
            of_.half.q.empty() ? 0.0f : smoothStep(2.0f * static_cast<float>(distance) / near - 1);
        if (unseen || far >= 1.0f) return put({x, y, beyond.colour, beyond.q}, beyond);
        nearby_[rays_.count()] = {x, y, far, beyond};
        rays_.add(x, y, distance);
        if (rays_.full()) putNear();
    }

    void putNear() {
        rays_.walk();
        for (std::size_t i = 0; i < rays_.count(); ++i) {
            const auto& [x, y, far, beyond] = nearby_[i];
            FilledPixel fill{x, y, beyond.colour, beyond.q};
            if (alongRays(of_.frame, of_.distances, rays_, i, averaged(), fill)) {
                if (far > 0.0f && beyond.q > 0.0f) {
                    fill.colour = glm::mix(fill.colour, beyond.colour, far);
                    fill.q = glm::mix(fill.q, beyond.q, far);
                }
            } else if (!(beyond.q > 0.0f)) {
                continue;
            }
            put(fill, beyond);
        }
        rays_.clear();
    }

    void put(const FilledPixel& fill, const Sample& beyond) {
        if (!beyond.mixed || isHidden(fill)) putIn(of_.frame, fill);
    }

    /// Whether something hid the place from a source. What fills a pixel tells its depth roughly:
    /// what is there may be farther away.
    bool isHidden(const FilledPixel& fill) {
        const float x = (static_cast<float>(fill.x) + 0.5f) * static_cast<float>(of_.scale);
        const float y = (static_cast<float>(fill.y) + 0.5f) * static_cast<float>(of_.scale);
        const int count = static_cast<int>(of_.sources.size());
        const float apart = kFarthestShare * of_.frame.space.axis.relativeScale(fill.q) / kFarther;
        for (int step = 0; step <= kFarther; ++step) {
            const float q = fill.q - apart * static_cast<float>(step);
            if (q > 0.0f && isHiddenAt(x, y, q, count)) return true;
        }
        return false;
    }

    /// Whether something hid it from a source, and no source sees past it.
    bool isHiddenAt(float x, float y, float q, int count) {
        bool hidden = false;
        for (int k = 0; k < count; ++k) {
            const int s = (last_ + k) % count;
            if (places_.seesPast(s, x, y, q)) {
                last_ = s;
                return false;
            }
            hidden = hidden || places_.hides(s, x, y, q);
        }
        return hidden;
    }

    struct Near {
        int x, y;
        float far;
        Sample beyond;
    };
    Of of_;
    shared::LookedAt places_;
    int last_ = 0;  ///< the source that saw past a place, which is likely to see past the next
    RayBatch rays_;
    std::array<Near, kRayBatch> nearby_;
    std::vector<std::uint8_t> open_, filled_;
};

/// fillBackground() of a frame at 1/`scale` of its size; `finest` if it is not itself one that
/// colours of a larger one come from. What lies amid what is filled, or amid what stays open, at
/// half the size is like that; the rest is looked up in the sources.
void fillLevel(OpenFrame& frame, std::span<const LocalSource> sources, int scale, bool finest) {
    const Image<std::uint8_t> distances = distancesToSurface(frame);
    const auto all = distances.pixels();
    if (std::ranges::find(all, std::uint8_t{0}) == all.end()) return;
    const std::uint8_t farthest = *std::ranges::max_element(all);
    if (farthest == 0) return;
    Half half;
    if (farthest > kSurelyMet) {
        half = halved(frame, distances);
        OpenFrame smaller{half.albedo, half.q, frame.space};
        fillLevel(smaller, sources, 2 * scale, false);
    }
    const DistanceWords words(distances);
    // Only closed pixels are read, so that no fill feeds on another.
    parallelForBlocks(0, frame.q.height(), 8, [&](std::int64_t from, std::int64_t to) {
        RowFiller filler({frame, sources, distances, half, scale, finest}, words);
        for (int y = static_cast<int>(from); y < to; ++y) filler.fill(y);
        filler.finish();
    });
}

}  // namespace

void fillBackground(OpenFrame frame, std::span<const LocalSource> sources, int averagedBy) {
    if (averagedBy == 1) return fillLevel(frame, sources, 1, true);
    Image<glm::vec4> albedo;
    Image<float> q;
    average(frame, averagedBy, albedo, q);
    const Image<glm::vec4> before = albedo;
    OpenFrame smaller{albedo, q, frame.space};
    fillLevel(smaller, sources, averagedBy, true);
    putAverage(before, smaller, averagedBy, frame);
}

}  // namespace stx::surface
