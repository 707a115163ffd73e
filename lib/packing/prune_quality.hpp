#pragma once

#include <memory>
#include <vector>

#include "lib/packing/prune.hpp"
#include "lib/render/renderer.hpp"

namespace stx {

/// Tells what pruning costs by rendering: surface mode of normal quality, before and after, from up
/// to four of the views' own poses and from half way between each of these and the view nearest to
/// it. Pictures have at most 1024 pixels to a side.
class PruneQuality {
  public:
    /// Renders the whole bundle, which is not needed afterwards. Errors: a bundle that fails
    /// check(), cancelled, memory.
    [[nodiscard]] static Result<PruneQuality> of(const Bundle& whole, Job& job);

    /// PSNR of RGB in dB of a pruned bundle's pictures against the whole one's, on black: of the
    /// worst picture. Infinity when all are identical.
    [[nodiscard]] Result<double> measure(const Bundle& pruned, Job& job) const;

  private:
    std::vector<Camera> cameras_;
    std::vector<Image<glm::u8vec4>> pictures_;  ///< of the whole bundle
};

/// Prunes as far as the worst picture of PruneQuality still reaches `wantedPsnr` (dB, over 0): the
/// blocks that replacements show worst come back until it does. PruneReport::psnr is what was
/// measured. When nothing less than all pixels reaches it, all stay. `settings.minPsnr` is not
/// looked at; a budget that forbids what was asked is an error that names both.
[[nodiscard]] Result<PruneReport> pruneToQuality(Bundle& bundle, const PruneSettings& settings,
                                                 double wantedPsnr, Job& job);

}  // namespace stx
