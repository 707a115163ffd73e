#include "lib/refine/refine_needed.hpp"

#include <algorithm>
#include <atomic>
#include <vector>

#include "lib/model/some_views.hpp"
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
          views_(someViewsOf(table, part.views)),
          part_(part),
          job_(job),
          now_(part.views.size()),
          depth_(part.left) {}

    Result<bool> any(bool withExposure) {
        if (!withExposure) {
            STX_CHECK(each([](std::size_t) {}));
            return depth_.any();
        }
        const EachView eachView = [this](const auto& body) { return each(body); };
        std::vector<Camera> cameras;
        for (const ViewHeader& view : views_->about().views) cameras.push_back(view.camera);
        const auto partOf = [&](std::size_t k, int, int, int, int) {
            const ReferenceView& view = *now_[k];
            return PixelPart{&view.texture, &view.depth, 0, 1, view.camera.width};
        };
        ColourPoints known;
        if (const auto* looked = dynamic_cast<const ViewsLookedAt*>(&table_);
            looked && looked->colourPoints())
            for (const std::size_t i : part_.views) known.push_back((*looked->colourPoints())[i]);
        STX_TRY(const auto maps,
                exposureMaps(cameras, partOf, eachView, known.empty() ? nullptr : &known));
        return !maps || !std::ranges::all_of(*maps, &ColourMap::changesNothing);
    }

  private:
    /// Goes through the views of the part; the first time with a look at their depth. False where
    /// that is refined: colours need not be looked at any more.
    Result<bool> each(const std::function<void(std::size_t)>& body) {
        std::vector<RefineNeeds> needs(now_.size(), RefineNeeds(part_.left));
        std::atomic<bool> enough = false;
        STX_CHECK(forEachView(
            *views_, peak::kRefine, job_,
            [&](std::size_t k, std::shared_ptr<const ReferenceView> view) -> Result<void> {
                if (enough) return {};
                if (!depthDone_) {
                    needs[k].add(RefineView{view.get(), &view->texture, &view->depth});
                    if (needs[k].surely()) enough = true;
                }
                now_[k] = std::move(view);
                body(k);
                now_[k].reset();
                return {};
            },
            {}, [&] { return enough.load(); }));
        if (depthDone_) return true;
        for (const RefineNeeds& found : needs) depth_.add(found);
        depthDone_ = true;
        return !depth_.any();
    }

    const ViewTable& table_;
    const std::unique_ptr<const ViewTable> views_;
    const Part& part_;
    Job& job_;
    std::vector<std::shared_ptr<const ReferenceView>> now_;
    RefineNeeds depth_;
    bool depthDone_ = false;
};

}  // namespace

bool saidToBeExact(const ViewTable& table, const RefineSettings& settings) {
    return !table.summaries().empty() &&
           std::ranges::none_of(table.about().views,
                                [](const ViewHeader& view) { return view.refined.doubt > 0; }) &&
           std::ranges::none_of(refineSteps(), [&](const RefineStepInfo& info) {
               return settings.of(info.step) == RefineSwitch::on;
           });
}

Result<bool> mayRefine(const ViewTable& table, const RefineSettings& settings, Job& job) {
    RefineSettings once = settings;
    for (const ViewHeader& view : table.about().views) once = once.after(view.refined);
    if (once.on(poses)) return true;
    if (saidToBeExact(table, settings)) return false;
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
