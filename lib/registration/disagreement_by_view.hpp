#pragma once

#include <cstddef>
#include <memory>

#include "lib/base/job.hpp"
#include "lib/model/view_table.hpp"
#include "lib/registration/disagreement.hpp"

namespace stx {

/// measureDepthDisagreement() of views that come one by one and are not kept: each comes twice, and
/// what is kept of it meanwhile is a grid of some thousand points. The same result, to the bit.
class DisagreementByView {
  public:
    explicit DisagreementByView(std::size_t views, const OverlapSettings& settings = {});
    ~DisagreementByView();
    DisagreementByView(const DisagreementByView&) = delete;
    DisagreementByView& operator=(const DisagreementByView&) = delete;

    /// First, each view once, in any order and from any thread.
    void sample(std::size_t index, const Image<float>& depth);
    /// Then each view again, in any order and from any thread; `bundle` has the headers of all. A
    /// view that comes once more is passed over. True for the one that was left last: result() is
    /// there.
    [[nodiscard]] bool compare(std::size_t index, const Image<float>& depth, const Bundle& bundle);
    [[nodiscard]] DepthDisagreement result() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// measureDepthDisagreement() of views that are read one by one, twice. Errors: those of the views,
/// cancelled.
[[nodiscard]] Result<DepthDisagreement> measureDepthDisagreement(const ViewTable& table, Job& job);

}  // namespace stx
