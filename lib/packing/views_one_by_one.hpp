#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "lib/base/image.hpp"
#include "lib/model/view_table.hpp"
#include "lib/packing/packing.hpp"
#include "lib/packing/prune.hpp"

namespace stx {

/// As pack() of a bundle, of views that are looked at one by one, once, in the tight layout twice.
[[nodiscard]] Result<Atlas> pack(const ViewTable& table, const PackSettings& settings, Job& job);

/// As PackObject and JoinedObjects, of views that are looked at one by one.
struct PackTable {
    std::string name;  ///< not empty
    std::unique_ptr<ViewTable> views;
    std::int64_t sourcePixels = 0;  ///< as PackSettings::sourcePixels
};
struct JoinedTables {
    std::unique_ptr<ViewTable> views;
    std::vector<AtlasObject> objects;
};
/// As joinObjects(). Views are looked at once. Errors: also those of the views.
[[nodiscard]] Result<JoinedTables> joinTables(std::vector<PackTable> objects, Job& job);

/// What pruning keeps of each view.
struct Pruning {
    PruneReport report;
    std::vector<Image<std::uint8_t>> kept;  ///< 1 = a point that stays
    std::vector<bool> changed;              ///< some point goes
    std::vector<NoDepth> noDepth;           ///< of views that change, then
};
/// Takes what pruning does not keep out of the views of a bundle in memory.
void applyPruning(const Pruning& pruning, Bundle& bundle);
/// What pruning takes at its peak, bytes.
[[nodiscard]] std::uint64_t memoryOfPruning(const ViewTable& table);
/// Error (invalidInput) where that is above the limit, with a limit that would do.
[[nodiscard]] Result<void> checkPruning(const ViewTable& table, const Limits& limits);
/// What prune() does, of views that are looked at one by one, once. What is looked at of their
/// points stays in memory meanwhile: 21 bytes for each pixel of the blocks of 16x16 that have some
/// (33 where colour is linear), and one or two for each pixel.
[[nodiscard]] Result<Pruning> findPruning(const ViewTable& table, const PruneSettings& settings,
                                          Job& job);
/// The views without what goes, each when it is asked for.
[[nodiscard]] std::unique_ptr<ViewTable> prunedViews(std::unique_ptr<ViewTable> table,
                                                     Pruning pruning);
/// The same; the table must outlive it.
[[nodiscard]] std::unique_ptr<ViewTable> prunedViews(const ViewTable& table, Pruning pruning);

/// The errors of pack() of whole views (Layout::grid) that are known before a pixel is looked at.
[[nodiscard]] Result<void> checkGrid(const ViewTable& table, const PackSettings& settings,
                                     const Limits& limits);
/// Memory that packing whole views (Layout::grid) and writing the atlas take at their peak, what
/// the table holds included, bytes. Looks at no pixel. Errors: views that cannot fit.
[[nodiscard]] Result<std::uint64_t> memoryOfGrid(const ViewTable& table,
                                                 const PackSettings& settings);

}  // namespace stx
