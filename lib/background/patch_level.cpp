#include "lib/background/patch_level.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/base/parallel.hpp"

namespace stx::behind {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();
constexpr glm::ivec2 kNowhere{-1};
/// Pixels beside a patch that must not be nearer either: their colour may be in it.
constexpr int kAside = 2;
/// What a pixel counts whose colour is itself invented, beside 1 of one that is known.
constexpr float kInvented = 0.1f;
/// Tries by chance in a round, each in half of the square of the one before.
constexpr int kTries = 5;
/// Tries to find any source, each in a square that is larger by kWider.
constexpr int kFirstTries = 40;
constexpr float kFirstReach = 10, kWider = 1.15f;
/// Squared difference of a patch at which its vote counts half.
constexpr float kHalfVote = 0.02f;
constexpr std::int64_t kPatchGrain = 512;

/// A random number that depends on nothing but these (a mixer of MurmurHash3).
std::uint32_t chance(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    std::uint32_t h = a * 0x9e3779b1u ^ (b * 0x85ebca6bu + 0x7f4a7c15u) ^ c * 0xc2b2ae35u;
    h ^= h >> 16;
    h *= 0x85ebca6bu;
    h ^= h >> 13;
    h *= 0xc2b2ae35u;
    return h ^ h >> 16;
}

glm::ivec2 within(glm::ivec2 middle, int reach, glm::ivec2 from, glm::ivec2 to,
                  std::uint32_t random) {
    const glm::ivec2 low = glm::max(middle - reach, from);
    const glm::ivec2 high = glm::max(glm::min(middle + reach, to - 1), low);
    const glm::ivec2 span = high - low + 1;
    return low +
           glm::ivec2(static_cast<int>((random & 0xffff) * static_cast<unsigned>(span.x) >> 16),
                      static_cast<int>((random >> 16) * static_cast<unsigned>(span.y) >> 16));
}

}  // namespace

PatchLevel::PatchLevel(const Layer& layer) {
    const int w = layer.width(), h = layer.height();
    photoFrom_ = layer.border;
    photoTo_ = layer.border + layer.photo;
    source_ = target_ = Image<glm::vec4>(w, h, glm::vec4(0));
    front_ = layer.front;
    far_ = layer.far;
    places_ = Image<Place>(w, h);
    for (std::size_t i = 0; i < places_.count(); ++i) {
        source_.data()[i] = glm::vec4(layer.shown.data()[i], 0);
        target_.data()[i] = source_.data()[i];
        if (!layer.made(i)) continue;
        target_.data()[i] = glm::vec4(layer.colour.data()[i], 0);
        places_.data()[i] = {layer.parallax.data()[i], surfaceTolerance(layer, i)};
    }
    findReach();
    listWanted();
    findKnown();
}

PatchLevel PatchLevel::halfAsLarge() const {
    PatchLevel half;
    const int w = (front_.width() + 1) / 2, h = (front_.height() + 1) / 2;
    half.photoFrom_ = (photoFrom_ + 1) / 2;
    half.photoTo_ = photoTo_ / 2;
    half.source_ = half.target_ = Image<glm::vec4>(w, h, glm::vec4(0));
    half.front_ = half.far_ = Image<float>(w, h, kNoParallax);
    half.places_ = Image<Place>(w, h);
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            glm::vec4 source(0), target(0), made(0);
            float count = 0, wanted = 0, nearest = kNoParallax, farthest = kNever;
            Place place{0, 0};
            for (int k = 0; k < 4; ++k) {
                const int u = 2 * x + k % 2, v = 2 * y + k / 2;
                if (!front_.contains(u, v)) continue;
                count += 1;
                source += source_.at(u, v);
                target += target_.at(u, v);
                nearest = std::max(nearest, front_.at(u, v));
                farthest = std::min(farthest, far_.at(u, v));
                const Place& part = places_.at(u, v);
                if (!(part.tolerance > 0)) continue;
                wanted += 1;
                made += target_.at(u, v);
                place.parallax += part.parallax;
                place.tolerance = std::max(place.tolerance, part.tolerance);
            }
            half.source_.at(x, y) = source / count;
            half.target_.at(x, y) = wanted > 0 ? made / wanted : target / count;
            half.front_.at(x, y) = nearest;
            half.far_.at(x, y) = farthest;
            if (wanted > 0) half.places_.at(x, y) = {place.parallax / wanted, place.tolerance};
        }
    }
    half.findReach();
    half.listWanted();
    half.findKnown();
    return half;
}

void PatchLevel::listWanted() {
    const int w = front_.width(), h = front_.height();
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x)
            if (wanted(x, y)) list_.emplace_back(x, y);
    sources_ = Image<glm::ivec2>(w, h, kNowhere);
    cost_ = Image<float>(w, h, kNever);
}

/// What of the photograph is beside wanted pixels at their depth counts in full.
void PatchLevel::findKnown() {
    for (glm::vec4& c : target_.pixels()) c.a = 0;
    for (const glm::ivec2 t : list_) {
        const Place& place = places_.at(t.x, t.y);
        const bool around =
            t.x < photoFrom_.x || t.y < photoFrom_.y || t.x >= photoTo_.x || t.y >= photoTo_.y;
        target_.at(t.x, t.y).a = kInvented;
        const glm::ivec2 low = glm::max(t - kRadius, photoFrom_);
        const glm::ivec2 high = glm::min(t + kRadius + 1, photoTo_);
        for (int v = low.y; v < high.y; ++v)
            for (int u = low.x; u < high.x; ++u)
                if (!wanted(u, v) &&
                    std::abs((around ? front_ : far_).at(u, v) - place.parallax) <= place.tolerance)
                    target_.at(u, v).a = 1;
    }
}

void PatchLevel::findReach() {
    constexpr int kReach = kRadius + kAside;
    const int w = front_.width(), h = front_.height();
    Image<float> across(w, h, kNever);
    reach_ = Image<float>(w, h, kNever);
    parallelFor(photoFrom_.y, photoTo_.y, [&](int y) {
        for (int x = photoFrom_.x + kRadius; x < photoTo_.x - kRadius; ++x) {
            float most = 0;
            for (int u = std::max(photoFrom_.x, x - kReach);
                 u <= std::min(photoTo_.x - 1, x + kReach); ++u)
                most = std::max(most, front_.at(u, y) < 0 ? kNever : front_.at(u, y));
            across.at(x, y) = most;
        }
    });
    parallelFor(photoFrom_.y + kRadius, std::max(photoFrom_.y + kRadius, photoTo_.y - kRadius),
                [&](int y) {
                    for (int x = photoFrom_.x + kRadius; x < photoTo_.x - kRadius; ++x) {
                        float most = 0;
                        for (int v = std::max(photoFrom_.y, y - kReach);
                             v <= std::min(photoTo_.y - 1, y + kReach); ++v)
                            most = std::max(most, across.at(x, v));
                        reach_.at(x, y) = most;
                    }
                });
}

bool PatchLevel::mayServe(glm::ivec2 source, const Place& place) const {
    return source.x >= photoFrom_.x && source.y >= photoFrom_.y && source.x < photoTo_.x &&
           source.y < photoTo_.y &&
           reach_.at(source.x, source.y) <= place.parallax + place.tolerance;
}

float PatchLevel::differ(glm::ivec2 target, glm::ivec2 source, float most) const {
    const int w = target_.width(), h = target_.height();
    float sum = 0;
    for (int dy = -kRadius; dy <= kRadius; ++dy) {
        const int y = target.y + dy;
        if (y < 0 || y >= h) continue;
        const int from = std::max(-kRadius, -target.x);
        const int to = std::min(kRadius, w - 1 - target.x);
        const glm::vec4* a = target_.row(y).data() + target.x;
        const glm::vec4* b = source_.row(source.y + dy).data() + source.x;
        for (int dx = from; dx <= to; ++dx) {
            const glm::vec4 d = a[dx] - b[dx];
            sum += a[dx].a * (d.r * d.r + d.g * d.g + d.b * d.b);
        }
        if (sum >= most) return kNever;
    }
    return sum;
}

glm::ivec2 PatchLevel::sourceNear(glm::ivec2 target, std::uint32_t seed) const {
    const Place& place = places_.at(target.x, target.y);
    float reach = kFirstReach;
    for (int i = 0; i < kFirstTries; ++i, reach *= kWider) {
        const glm::ivec2 source =
            within(target, static_cast<int>(reach), photoFrom_, photoTo_,
                   chance(static_cast<std::uint32_t>(target.x),
                          static_cast<std::uint32_t>(target.y), seed * 64 + i));
        if (mayServe(source, place)) return source;
    }
    return kNowhere;
}

void PatchLevel::beginNear() {
    for (const glm::ivec2 t : list_) sources_.at(t.x, t.y) = sourceNear(t, 1);
}

void PatchLevel::takeFrom(const PatchLevel& coarser) {
    for (const glm::ivec2 t : list_) {
        const glm::ivec2 from = coarser.sources_.at(t.x / 2, t.y / 2);
        glm::ivec2& source = sources_.at(t.x, t.y);
        source = from == kNowhere ? from : 2 * from + t % 2;
        if (source == kNowhere || !mayServe(source, places_.at(t.x, t.y)))
            source = sourceNear(t, 2);
    }
    vote();
}

void PatchLevel::improve(int hop) {
    const glm::ivec2 hops[4] = {{-hop, 0}, {hop, 0}, {0, -hop}, {0, hop}};
    const int whole = std::max(photoTo_.x - photoFrom_.x, photoTo_.y - photoFrom_.y);
    Image<glm::ivec2> better = sources_;
    ++round_;
    parallelFor(0, list_.size(), kPatchGrain, [&](std::size_t i) {
        const glm::ivec2 t = list_[i];
        const Place& place = places_.at(t.x, t.y);
        glm::ivec2 best = sources_.at(t.x, t.y);
        float least = best == kNowhere ? kNever : differ(t, best, kNever);
        const auto attempt = [&](glm::ivec2 source) {
            if (source == best || !mayServe(source, place)) return;
            const float cost = differ(t, source, least);
            if (!(cost < least)) return;
            least = cost;
            best = source;
        };
        for (const glm::ivec2 step : hops) {
            const glm::ivec2 n = t + step;
            if (!sources_.contains(n.x, n.y)) continue;
            const glm::ivec2 theirs = sources_.at(n.x, n.y);
            if (theirs != kNowhere) attempt(theirs - step);
        }
        int reach = whole / 4;
        for (int k = 0; k < kTries && reach > 0; ++k, reach /= 3)
            attempt(within(best == kNowhere ? t : best, reach, photoFrom_, photoTo_,
                           chance(static_cast<std::uint32_t>(t.x), static_cast<std::uint32_t>(t.y),
                                  round_ * 16 + static_cast<std::uint32_t>(k))));
        better.at(t.x, t.y) = best;
        cost_.at(t.x, t.y) = least;
    });
    sources_ = std::move(better);
}

void PatchLevel::vote() {
    Image<glm::vec4> voted = target_;
    parallelFor(0, list_.size(), kPatchGrain, [&](std::size_t i) {
        const glm::ivec2 t = list_[i];
        const Place& place = places_.at(t.x, t.y);
        glm::vec4 sum(0);
        float weights = 0;
        for (int dy = -kRadius; dy <= kRadius; ++dy) {
            for (int dx = -kRadius; dx <= kRadius; ++dx) {
                const glm::ivec2 n = t + glm::ivec2(dx, dy);
                if (!sources_.contains(n.x, n.y)) continue;
                const glm::ivec2 source = sources_.at(n.x, n.y);
                if (source == kNowhere ||
                    std::abs(places_.at(n.x, n.y).parallax - place.parallax) > place.tolerance)
                    continue;
                const float cost = std::min(cost_.at(n.x, n.y), 1e6f);
                const float weight = 1 / (kHalfVote + cost);
                weights += weight;
                sum += weight * source_.at(source.x - dx, source.y - dy);
            }
        }
        if (weights > 0) {
            glm::vec4& c = voted.at(t.x, t.y);
            c = glm::vec4(glm::vec3(sum) / weights, c.a);
        }
    });
    target_ = std::move(voted);
}

}  // namespace stx::behind
