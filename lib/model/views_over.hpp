#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "lib/model/view_table.hpp"

namespace stx {

/// A view to change: itself where nobody else has it, else a copy.
[[nodiscard]] inline std::shared_ptr<ReferenceView> toChange(
    std::shared_ptr<const ReferenceView> view) {
    if (view.use_count() == 1) return std::const_pointer_cast<ReferenceView>(std::move(view));
    return std::make_shared<ReferenceView>(*view);
}

/// Views that are made from those of another table, one from one.
class ViewsOver : public ViewTable {
  public:
    std::uint64_t bytesHeld() const override { return table_.bytesHeld(); }
    std::string where() const override { return table_.where(); }
    bool knownSound() const override { return table_.knownSound(); }
    int mostAtOnce() const override { return table_.mostAtOnce(); }
    /// Of those that are changed in place, or in a copy.
    std::uint64_t bytesToMake(std::size_t index) const override {
        return std::max(table_.bytesToMake(index), bytesOf(index));
    }

  protected:
    /// `own`: the table, if this is to keep it; may be null.
    ViewsOver(const ViewTable& table, std::unique_ptr<ViewTable>&& own, Bundle headers,
              std::vector<ViewImageKinds> kinds, Planes planes)
        : ViewTable(std::move(headers), std::move(kinds), planes),
          table_(table),
          own_(std::move(own)) {}
    /// With the same headers and kinds.
    ViewsOver(std::unique_ptr<ViewTable>&& table, Planes planes)
        : ViewsOver(*table, std::move(table), headersOf(std::as_const(*table).about()),
                    table->kinds(), planes) {}

    [[nodiscard]] static Planes planesOf(const ViewTable& table) {
        return table.planesKnown() ? Planes::known : Planes::withPixels;
    }

    const ViewTable& table_;

  private:
    std::unique_ptr<ViewTable> own_;
};

}  // namespace stx
