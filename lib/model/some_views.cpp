#include "lib/model/some_views.hpp"

#include <utility>

namespace stx {
namespace {

class SomeViewsOf : public ViewTable {
  public:
    SomeViewsOf(const ViewTable& all, std::vector<std::size_t> numbers)
        : ViewTable(headersOf(all, numbers), kindsOf(all, numbers),
                    all.planesKnown() ? Planes::known : Planes::withPixels),
          all_(all),
          numbers_(std::move(numbers)) {}

    std::uint64_t bytesHeld() const override { return all_.bytesHeld(); }
    std::uint64_t bytesGiven(std::size_t index) const override {
        return all_.bytesGiven(numbers_[index]);
    }
    std::uint64_t bytesToMake(std::size_t index) const override {
        return all_.bytesToMake(numbers_[index]);
    }
    std::vector<ViewSummary> summaries() const override {
        const std::vector<ViewSummary> all = all_.summaries();
        std::vector<ViewSummary> some;
        for (std::size_t k = 0; k < numbers_.size() && !all.empty(); ++k)
            some.push_back(all[numbers_[k]]);
        return some;
    }
    std::string where() const override { return all_.where(); }
    int mostAtOnce() const override { return all_.mostAtOnce(); }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job& job) const override {
        return all_.view(numbers_[index], job);
    }

  private:
    static Bundle headersOf(const ViewTable& all, const std::vector<std::size_t>& numbers) {
        Bundle headers = stx::headersOf(all.about());
        std::vector<ReferenceView> some;
        for (const std::size_t i : numbers) some.push_back(headers.views[i]);
        headers.views = std::move(some);
        return headers;
    }
    static std::vector<ViewImageKinds> kindsOf(const ViewTable& all,
                                               const std::vector<std::size_t>& numbers) {
        std::vector<ViewImageKinds> kinds;
        for (const std::size_t i : numbers) kinds.push_back(all.kindsOf(i));
        return kinds;
    }

    const ViewTable& all_;
    std::vector<std::size_t> numbers_;
};

}  // namespace

std::unique_ptr<ViewTable> someViewsOf(const ViewTable& table, std::vector<std::size_t> numbers) {
    return std::make_unique<SomeViewsOf>(table, std::move(numbers));
}

}  // namespace stx
