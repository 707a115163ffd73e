#include "lib/refine/refine_needed.hpp"

#include <algorithm>
#include <vector>

#include "lib/refine/exposure.hpp"
#include "lib/refine/refine_depth.hpp"

namespace stx {
namespace {

using enum RefineStep;

/// The views of one moment, or what is behind them.
struct Part {
    std::vector<std::size_t> views;  ///< their numbers in the table
    RefineSettings left;             ///< that is not done yet
};

/// Whether headers say that the views must be looked at side by side.
bool tellsSideBySide(const ViewTable& table, const Part& part) {
    const auto header = [&](std::size_t i) -> const ViewHeader& { return table.about().views[i]; };
    const auto captured = [&](std::size_t i) {
        return header(i).noDepth == NoDepth::unknown && !header(i).pruned;
    };
    const auto doubtful = [&](std::size_t i) { return header(i).refined.doubt > 0; };
    const bool moves = part.left.on(silhouettes) || part.left.on(agree) || part.left.on(colours) ||
                       part.left.on(strays);
    return (moves && std::ranges::any_of(part.views, doubtful)) ||
           (part.left.on(agree) && part.views.size() > 1 &&
            std::ranges::all_of(part.views, captured));
}

/// The same as what matchExposure() and refineDepth() find in memory.
class PartNeeds {
  public:
    PartNeeds(const ViewTable& table, const Part& part, Job& job)
        : table_(table),
          part_(part),
          job_(job),
          numbers_(table.count(), kNone),
          now_(part.views.size()),
          depth_(part.left) {
        for (std::size_t k = 0; k < part.views.size(); ++k) numbers_[part.views[k]] = k;
    }

    Result<bool> any(bool withExposure) {
        if (!withExposure) {
            STX_CHECK(each([](std::size_t) {}));
            return depth_.any();
        }
        std::vector<Camera> cameras;
        for (const std::size_t i : part_.views) cameras.push_back(table_.about().views[i].camera);
        const auto partOf = [&](std::size_t k, int, int, int, int) {
            const ReferenceView& view = *now_[k];
            return PixelPart{&view.texture, &view.depth, 0, 1, view.camera.width};
        };
        const auto eachView = [&](const std::function<void(std::size_t)>& body) {
            return each(body);
        };
        STX_TRY(const auto maps, exposureMaps(cameras, partOf, eachView));
        return depth_.any() || !std::ranges::all_of(maps, &ColourMap::changesNothing);
    }

  private:
    static constexpr std::size_t kNone = ~std::size_t{0};

    /// Goes through the views of the part; the first time with a look at their depth.
    Result<void> each(const std::function<void(std::size_t)>& body) {
        std::vector<RefineNeeds> needs(now_.size(), RefineNeeds(part_.left));
        STX_CHECK(forEachView(
            table_, peak::kRefine, job_,
            [&](std::size_t i, std::shared_ptr<const ReferenceView> view) -> Result<void> {
                const std::size_t k = numbers_[i];
                if (k == kNone) return {};
                if (!depthDone_) needs[k].add(RefineView{view.get(), &view->texture, &view->depth});
                now_[k] = std::move(view);
                body(k);
                now_[k].reset();
                return {};
            }));
        for (const RefineNeeds& found : needs) depth_.add(found);
        depthDone_ = true;
        return {};
    }

    const ViewTable& table_;
    const Part& part_;
    Job& job_;
    std::vector<std::size_t> numbers_;  ///< in the part, of each view of the table
    std::vector<std::shared_ptr<const ReferenceView>> now_;
    RefineNeeds depth_;
    bool depthDone_ = false;
};

}  // namespace

Result<bool> mayRefine(const ViewTable& table, const RefineSettings& settings, Job& job) {
    RefineSettings once = settings;
    for (const ViewHeader& view : table.about().views) once = once.after(view.refined);
    if (once.on(poses)) return true;
    // Read again by whoever uses the views, who says what is to say.
    Job quiet;
    quiet.workFor(job);
    for (const bool background : {false, true}) {
        Part part{{}, settings};
        for (std::size_t i = 0; i < table.count(); ++i) {
            const ViewHeader& view = table.about().views[i];
            if (view.background != background) continue;
            part.views.push_back(i);
            part.left = part.left.after(view.refined);
        }
        if (part.views.empty() || !part.left.any()) continue;
        if (tellsSideBySide(table, part)) return true;
        const bool withExposure = part.left.on(exposure) && part.views.size() > 1 &&
                                  (!background || part.views.size() == table.count());
        STX_TRY(const bool needed, PartNeeds(table, part, quiet).any(withExposure));
        if (needed) return true;
    }
    return false;
}

}  // namespace stx
