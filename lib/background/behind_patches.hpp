#pragma once

#include <cstdint>

#include "lib/background/behind_layer.hpp"
#include "lib/base/job.hpp"

namespace stx::behind {

/// Finds for hidden and mixed blocks and those around the places of the photograph whose patches
/// go on best what is beside them: at that depth or farther, without anything nearer in them
/// (PatchMatch, Barnes et al. 2009, and votes from coarse to fine, Wexler et al. 2007; each round
/// looks at the one before only, so that any number of threads gives the same). `layer` has smooth
/// colours (inventColour()). Errors: cancelled.
[[nodiscard]] Result<Sources> findSources(const Layer& layer, Job& job);

}  // namespace stx::behind
