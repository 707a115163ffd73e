#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace stx {

/// The translucent surfaces at each sample of a tile, from the nearest on.
class Layers {
  public:
    /// What lies behind so many surfaces is left out: a file may stack millions. 40 MB for a tile.
    static constexpr std::size_t kMost = 64;

    struct Layer {
        float nearness = 0;  ///< as of opaque surfaces
        float alpha = 0;     ///< 0..1
        glm::vec3 colour{0.0f};
        std::uint32_t material = 0;
        std::uint32_t slot = 0;  ///< of the triangle
    };

    /// Forgets all; `samples` = 0 as long as a tile has no translucent surface.
    void reset(std::size_t samples) {
        counts_.assign(samples, 0);
        cut_.assign(samples, false);
        layers_.resize(samples * most_);
    }
    [[nodiscard]] bool empty() const { return counts_.empty(); }
    [[nodiscard]] std::span<const Layer> at(std::size_t sample) const {
        if (counts_.empty()) return {};
        return {layers_.data() + sample * most_, counts_[sample]};
    }

    /// Whether surfaces behind the last one of a sample were left out.
    [[nodiscard]] bool isCut(std::size_t sample) const { return !cut_.empty() && cut_[sample]; }

    void add(std::size_t sample, const Layer& layer) {
        if (counts_[sample] == most_ && most_ < kMost) makeRoom();
        Layer* const first = layers_.data() + sample * most_;
        std::uint8_t& count = counts_[sample];
        std::size_t at = 0;
        for (; at < count && first[at].nearness >= layer.nearness; ++at) {
            if (isSame(first[at], layer) || first[at].alpha >= kOpaque) return;
        }
        if (at < count && isSame(first[at], layer)) return;
        if (count == most_) cut_[sample] = true;
        if (at == most_) return;
        if (layer.alpha >= kOpaque) {
            count = static_cast<std::uint8_t>(at + 1);
            cut_[sample] = false;
        } else {
            const std::size_t last = std::min<std::size_t>(count, most_ - 1);
            std::move_backward(first + at, first + last, first + last + 1);
            count = static_cast<std::uint8_t>(last + 1);
        }
        first[at] = layer;
    }

  private:
    static constexpr float kOpaque = 0.998f;

    /// A sample on the edge of two triangles is inside of both, but sees one surface.
    static bool isSame(const Layer& a, const Layer& b) {
        return a.material == b.material &&
               std::abs(a.nearness - b.nearness) <= 1e-6f * std::abs(a.nearness);
    }

    /// Twice as many layers for each sample.
    void makeRoom() {
        std::vector<Layer> wider(layers_.size() * 2);
        for (std::size_t sample = 0; sample < counts_.size(); ++sample)
            std::copy_n(layers_.begin() + static_cast<std::ptrdiff_t>(sample * most_),
                        counts_[sample],
                        wider.begin() + static_cast<std::ptrdiff_t>(sample * most_ * 2));
        layers_ = std::move(wider);
        most_ *= 2;
    }

    std::size_t most_ = 8;  ///< of a sample
    std::vector<Layer> layers_;
    std::vector<std::uint8_t> counts_;
    std::vector<bool> cut_;
};

}  // namespace stx
