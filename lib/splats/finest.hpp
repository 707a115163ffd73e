#pragma once

#include <vector>

#include "lib/base/image.hpp"
#include "lib/model/bundle.hpp"
#include "lib/splats/merge.hpp"

namespace stx::splats {

/// Takes away discs that another view of the bundle shows finer, as a smaller one in the same
/// surface, and leaves each place to the view that shows it best: a disc of a grazing view is long
/// and blurred, and would be drawn over sharp ones. `discs` are those of the views, in the world of
/// the bundle's cameras. The 16 views whose directions are most alike are asked; views of the
/// background and others do not replace each other. Of the bundle only headers are looked at. What
/// is found of each disc is in a spool, if any.
void keepFinest(const Bundle& bundle, std::vector<Image<Disc>>& discs, PixelSpool* spool = nullptr);

}  // namespace stx::splats
