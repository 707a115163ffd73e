#pragma once

#include <cstdint>
#include <vector>

#include "lib/background/behind_layer.hpp"

namespace stx::behind {

/// One size of the picture in the search for sources (findSources()).
class PatchLevel {
  public:
    /// Half a patch: 7 x 7.
    static constexpr int kRadius = 3;

    explicit PatchLevel(const Layer& layer);
    [[nodiscard]] PatchLevel halfAsLarge() const;

    /// A source close by for each pixel that is asked for.
    void beginNear();
    /// The sources of the level that is half as large, and the colours that they give.
    void takeFrom(const PatchLevel& coarser);
    /// One round: keeps the best of each pixel's source, those that neighbours at `hop` pixels lead
    /// to, and a few by chance.
    void improve(int hop);
    /// Gives each pixel the mean of what the patches around it say.
    void vote();

    [[nodiscard]] Image<glm::ivec2> takeSources() { return std::move(sources_); }

  private:
    PatchLevel() = default;
    /// What belongs to a pixel, side by side.
    struct Place {
        float parallax = kNoParallax, tolerance = 0;
    };

    void findKnown();
    void findReach();
    void listWanted();
    [[nodiscard]] bool wanted(int x, int y) const { return places_.at(x, y).tolerance > 0; }
    [[nodiscard]] bool mayServe(glm::ivec2 source, const Place& place) const;
    [[nodiscard]] float differ(glm::ivec2 target, glm::ivec2 source, float most) const;
    [[nodiscard]] glm::ivec2 sourceNear(glm::ivec2 target, std::uint32_t seed) const;

    glm::ivec2 photoFrom_{0}, photoTo_{0};  ///< the photograph: from, and behind its end
    Image<glm::vec4> source_;               ///< what the photograph shows; .a: nothing
    Image<glm::vec4> target_;               ///< what is wanted; .a: how much a pixel counts
    Image<float> front_, far_;              ///< parallax of the photograph
    Image<float> reach_;  ///< greatest parallax of what a patch would take along; infinite: none
    Image<Place> places_;
    Image<glm::ivec2> sources_;
    Image<float> cost_;
    std::vector<glm::ivec2> list_;  ///< pixels that are wanted, row by row
    std::uint32_t round_ = 0;
};

}  // namespace stx::behind
