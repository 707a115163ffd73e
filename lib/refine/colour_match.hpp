#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lib/model/light_ratio.hpp"

namespace stx {

/// Colours of one view as another light or another camera would have them: gain * c + offset, of
/// stored values (0..1). What makes light brighter by a factor is a gain of linear values, and of
/// sRGB values a gain with a small offset, so one map does for both.
struct ColourMap {
    glm::vec3 gain{1.0f}, offset{0.0f};

    [[nodiscard]] bool changesNothing() const {
        return gain == glm::vec3(1) && offset == glm::vec3(0);
    }
    [[nodiscard]] glm::vec3 operator()(glm::vec3 c) const {
        return glm::max(gain * c + offset, glm::vec3(0));
    }
};

/// Colours of surfaces that two views show, a's and b's.
struct SharedColours {
    std::size_t a = 0, b = 0;
    std::vector<LitPair> points;
};

/// For each of `views` views the map that brings its colours to those of most others, robustly: a
/// line for each pair of views and channel (reduced major axis, which treats both alike; Tukey's
/// biweight), then gains and offsets that fit all pairs best, the median view staying as it is.
/// Views that cannot be told apart from the others keep their colours: no map changes anything
/// unless that of some view moves a typical colour by more than six steps of 8 bits (ten where no
/// pair can contradict another) and by more than four times what pairs contradict each other by. Up
/// to half as much again the maps grow from nothing to all of it.
[[nodiscard]] std::vector<ColourMap> matchColours(std::size_t views,
                                                  std::span<const SharedColours> pairs);

}  // namespace stx
