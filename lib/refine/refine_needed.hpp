#pragma once

#include "lib/model/view_table.hpp"
#include "lib/refine/exposure.hpp"
#include "lib/refine/refine.hpp"

namespace stx {

/// Whether the file of the views says that they are exact (ViewTable::summaries()), and no step is
/// asked for by name: refine() has nothing to do, and no pixel is looked at for that.
[[nodiscard]] bool saidToBeExact(const ViewTable& table, const RefineSettings& settings);

/// A table whose maker has looked at each of its views already, and kept what they are read for
/// first.
class ViewsLookedAt {
  public:
    virtual ~ViewsLookedAt() = default;
    /// As colourPointsOf() of what the table gives; null: they were not kept.
    [[nodiscard]] virtual const ColourPoints* colourPoints() const = 0;
};

/// Whether refine() may change something in views that are read one by one. False: it would leave
/// them as they are, to the bit. True without a look at pixels of what is captured, whose views
/// only tell side by side. False without a look at pixels where saidToBeExact(). Else views are
/// read once, and with `exposure`, where depth stays as it is, once more, but for ViewsLookedAt;
/// see exposureMaps(). Errors: those of the views, cancelled.
[[nodiscard]] Result<bool> mayRefine(const ViewTable& table, const RefineSettings& settings,
                                     Job& job);

}  // namespace stx
