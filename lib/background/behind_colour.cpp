#include <array>
#include <cmath>
#include <vector>

#include "lib/background/behind_layer.hpp"
#include "lib/background/membrane.hpp"

namespace stx::behind {
namespace {

/// Rounds of the membrane and how far each carries: a border of 100 blocks is smooth then.
constexpr int kColourRounds = 120;
constexpr float kColourRelaxation = 1.93f;

constexpr std::array<glm::ivec2, 4> kBeside = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

/// What colour goes over from where.
class ColourLinks {
  public:
    explicit ColourLinks(const Layer& layer) : layer_(layer) {}

    /// Both colours are unknown, and go on in each other.
    [[nodiscard]] bool joined(std::size_t a, std::size_t b) const {
        if (!layer_.made(a) || !layer_.made(b) || isAround(a) != isAround(b)) return false;
        const float tolerance = std::max(surfaceTolerance(layer_, a), surfaceTolerance(layer_, b));
        return std::abs(parallax(a) - parallax(b)) <= tolerance;
    }
    /// What the photograph shows at b goes on in a.
    [[nodiscard]] bool goesOn(std::size_t a, std::size_t b) const {
        const float there = known(a, b);
        return there >= 0 && std::abs(parallax(a) - there) <= surfaceTolerance(layer_, a);
    }
    /// It is at that depth or behind it.
    [[nodiscard]] bool isBehind(std::size_t a, std::size_t b) const {
        const float there = known(a, b);
        return there >= 0 && there <= parallax(a) + surfaceTolerance(layer_, a);
    }

  private:
    [[nodiscard]] bool isAround(std::size_t i) const {
        return layer_.part.data()[i] == Part::around;
    }
    [[nodiscard]] float parallax(std::size_t i) const { return layer_.parallax.data()[i]; }
    /// The parallax of what the photograph shows at b, where a may take its colour.
    [[nodiscard]] float known(std::size_t a, std::size_t b) const {
        const Part part = layer_.part.data()[b];
        if (part == Part::mixed || part == Part::around) return kNoParallax;
        if (isAround(a)) return layer_.front.data()[b];
        return part == Part::shown ? layer_.far.data()[b] : kNoParallax;
    }

    const Layer& layer_;
};

/// The numbers of the neighbours of a block that are in the picture; -1: none.
std::array<std::int64_t, 4> besideOf(const Layer& layer, std::size_t block) {
    const int w = layer.width(), x = static_cast<int>(block) % w, y = static_cast<int>(block) / w;
    std::array<std::int64_t, 4> out{};
    for (std::size_t k = 0; k < 4; ++k) {
        const int u = x + kBeside[k].x, v = y + kBeside[k].y;
        out[k] = layer.part.contains(u, v) ? static_cast<std::int64_t>(v) * w + u : -1;
    }
    return out;
}

/// Colours that go from block to block, each round one farther, into those that have none yet.
class Spreading {
  public:
    explicit Spreading(Layer& layer) : layer_(layer), links_(layer), has_(layer.part.count(), 0) {}

    /// Blocks without a colour that `takes` one of the photograph beside them begin.
    template <class Takes>
    void begin(const Takes& takes) {
        for (std::size_t i = 0; i < has_.size(); ++i) {
            if (has_[i] || !layer_.made(i)) continue;
            glm::vec3 sum(0);
            float count = 0;
            for (const auto n : besideOf(layer_, i)) {
                if (n < 0 || !takes(links_, i, static_cast<std::size_t>(n))) continue;
                sum += layer_.shown.data()[n];
                count += 1;
            }
            if (count == 0) continue;
            layer_.colour.data()[i] = sum / count;
            next_.push_back(i);
        }
        for (const std::size_t i : next_) has_[i] = 1;
    }
    /// They go on as far as colours are `joined`, or anywhere.
    void spread(bool anywhere) {
        while (!next_.empty()) {
            std::vector<std::size_t> now;
            std::swap(now, next_);
            for (const std::size_t i : now) {
                for (const auto n : besideOf(layer_, i)) {
                    const auto at = static_cast<std::size_t>(n);
                    if (n < 0 || has_[at] || !layer_.made(at)) continue;
                    if (!anywhere && !links_.joined(i, at)) continue;
                    has_[at] = 1;
                    layer_.colour.data()[at] = layer_.colour.data()[i];
                    next_.push_back(at);
                }
            }
        }
    }
    /// Mixed blocks that nothing reached begin with what the photograph shows there.
    void beginFromMixed() {
        for (std::size_t i = 0; i < has_.size(); ++i) {
            if (has_[i] || layer_.part.data()[i] != Part::mixed) continue;
            layer_.colour.data()[i] = layer_.shown.data()[i];
            has_[i] = 1;
            next_.push_back(i);
        }
    }
    void beginFromAll() {
        for (std::size_t i = 0; i < has_.size(); ++i)
            if (has_[i]) next_.push_back(i);
    }
    /// Blocks that nothing reached are left out.
    void dropOthers() {
        for (std::size_t i = 0; i < has_.size(); ++i)
            if (!has_[i]) layer_.part.data()[i] = Part::shown;
    }

  private:
    Layer& layer_;
    ColourLinks links_;
    std::vector<std::uint8_t> has_;
    std::vector<std::size_t> next_;
};

void firstGuess(Layer& layer) {
    Spreading colours(layer);
    colours.begin(
        [](const ColourLinks& l, std::size_t a, std::size_t b) { return l.goesOn(a, b); });
    colours.spread(false);
    colours.begin(
        [](const ColourLinks& l, std::size_t a, std::size_t b) { return l.isBehind(a, b); });
    colours.spread(false);
    // In gaps that are narrow all is mixed, and still the best that is known of what is there.
    colours.beginFromMixed();
    colours.spread(false);
    colours.beginFromAll();
    colours.spread(true);
    colours.dropOthers();
}

}  // namespace

void inventColour(Layer& layer) {
    firstGuess(layer);
    const ColourLinks links(layer);
    std::vector<std::int32_t> number(layer.part.count(), -1);
    std::int32_t count = 0;
    for (std::size_t i = 0; i < number.size(); ++i)
        if (layer.made(i)) number[i] = count++;
    Membrane<glm::vec3> membrane;
    for (std::size_t i = 0; i < number.size(); ++i) {
        if (number[i] < 0) continue;
        Membrane<glm::vec3>::Unknown unknown;
        unknown.known = glm::vec3(0);
        const auto beside = besideOf(layer, i);
        for (std::size_t k = 0; k < 4; ++k) {
            if (beside[k] < 0) continue;
            const auto n = static_cast<std::size_t>(beside[k]);
            if (links.joined(i, n)) {
                unknown.to[k] = number[n];
                unknown.count += 1;
            } else if (links.goesOn(i, n)) {
                unknown.known += layer.shown.data()[n];
                unknown.count += 1;
            }
        }
        const auto at = static_cast<int>(i);
        membrane.add(unknown, layer.colour.data()[i],
                     (at % layer.width() + at / layer.width()) % 2 != 0);
    }
    membrane.solve(kColourRounds, kColourRelaxation);
    for (std::size_t i = 0; i < number.size(); ++i)
        if (number[i] >= 0) layer.colour.data()[i] = membrane.values[number[i]];
}

}  // namespace stx::behind
