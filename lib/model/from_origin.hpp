#pragma once

#include <memory>

#include "lib/model/atlas.hpp"
#include "lib/model/sequence.hpp"

namespace stx {

/// The same frames for those who hold points as floats: where floats would round coordinates of
/// the first frame that is asked for (originFor()), cameras and bounds of all frames count from an
/// origin near it, which is added to Bundle::origin. It is found in the bounds; where none are
/// stated, in a box around what the views see between their planes, or around their viewpoints
/// alone while the planes are not known. Else nothing is changed.
[[nodiscard]] std::unique_ptr<Sequence> fromOrigin(std::unique_ptr<Sequence> frames);

/// The same frames, of bundles or files that may count from an origin each: all count from this
/// one, as the frames of a sequence must.
[[nodiscard]] std::unique_ptr<Sequence> fromOrigin(std::unique_ptr<Sequence> frames,
                                                   const glm::dvec3& origin);

/// From where fromOrigin() has these views count, in the world; their own origin where floats hold
/// their coordinates well.
[[nodiscard]] glm::dvec3 originOf(const ViewTable& table);

/// The same views, which count from this origin. The second kind takes nothing: the table must
/// outlive it.
[[nodiscard]] std::unique_ptr<ViewTable> countedFrom(const glm::dvec3& origin,
                                                     std::unique_ptr<ViewTable> table);
[[nodiscard]] std::unique_ptr<ViewTable> countedFrom(const glm::dvec3& origin,
                                                     const ViewTable& table);

/// As fromOrigin(), of an atlas of one model (objectOf()).
void countFromOrigin(Atlas& atlas);

}  // namespace stx
