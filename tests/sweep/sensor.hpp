#pragma once

#include <string>

#include "tests/sweep/random.hpp"
#include "tests/sweep/sweep_case.hpp"

/// What cameras with a depth sensor make of exact views.
namespace sensor {

/// Takes the depth of some pixels of a view away: beside edges of depth, at the border, which the
/// depth camera does not see, and of dark and shiny parts. Colours stay. Only of views that are
/// opaque all over: where a picture has alpha, its background is known.
void loseDepth(stx::ReferenceView& view, Random& random);

/// The views of a case as a recording has them, in some of these ways, of which `what` becomes a
/// list: noise that grows with the square of the distance (0.1 to 0.5 % where most of the view is),
/// surfaces in front that reach one to three pixels over what is behind, depth that is missing
/// (loseDepth()), positions that are off by 0.1 to 0.5 % of the distance. All have the truth's
/// light: which one a picture should have is not known else.
[[nodiscard]] stx::Bundle recorded(const Captured& captured, std::string& what);

}  // namespace sensor
