#include "lib/model/from_origin.hpp"

#include <optional>
#include <utility>

#include "lib/geometry/frustum.hpp"
#include "lib/geometry/origin.hpp"

namespace stx {
namespace {

/// A box around what the views see between their planes, or around their viewpoints.
Bounds boxOfViews(const std::vector<ReferenceView>& views, bool planesKnown) {
    Bounds box;
    for (const ReferenceView& view : views) {
        const Camera& c = view.camera;
        if (!planesKnown) {
            box.add(c.position);
            continue;
        }
        for (const glm::dvec3& corner : frustumCorners(c, view.nearPlane, view.farPlane))
            box.add(corner);
    }
    return box;
}

/// Of a bundle or an atlas.
template <class Model>
glm::dvec3 originOf(const Model& model, bool planesKnown) {
    return originFor(model.bounds && !model.bounds->empty() ? *model.bounds
                                                            : boxOfViews(model.views, planesKnown));
}

/// All but the cameras.
template <class Model>
void moveBounds(Model& model, const glm::dvec3& origin) {
    model.origin += origin;
    if (!model.bounds || model.bounds->empty()) return;
    model.bounds->min -= origin;
    model.bounds->max -= origin;
}

template <class Model>
void moveTo(Model& model, const glm::dvec3& origin) {
    if (origin == glm::dvec3(0.0)) return;
    for (ReferenceView& view : model.views) view.camera.position -= origin;
    moveBounds(model, origin);
}

class FromOrigin : public Sequence {
  public:
    explicit FromOrigin(std::unique_ptr<Sequence> frames) : frames_(std::move(frames)) {
        timeline_ = frames_->timeline();
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, frames_->frame(index, job));
        moveTo(bundle, originBy(bundle, true));
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(auto table, frames_->views(index, job));
        const glm::dvec3 origin = originBy(std::as_const(*table).about(), table->planesKnown());
        if (origin == glm::dvec3(0.0)) return table;
        if (table->whole()) {
            STX_TRY(auto bundle, wholeBundle(std::move(table), job));
            moveTo(bundle, origin);
            return tableOf(std::move(bundle));
        }
        ViewChange move;
        move.header = [origin](ViewHeader& view) { view.camera.position -= origin; };
        move.change = [origin](ReferenceView& view, Job&) -> Result<void> {
            view.camera.position -= origin;
            return {};
        };
        move.takes = {"moving", 0};
        auto moved = changedViews(std::move(table), std::move(move));
        moveBounds(moved->about(), origin);
        return moved;
    }

  private:
    /// Found once: all frames count from the same.
    glm::dvec3 originBy(const Bundle& about, bool planesKnown) {
        if (!origin_) origin_ = originOf(about, planesKnown);
        return *origin_;
    }

    std::unique_ptr<Sequence> frames_;
    std::optional<glm::dvec3> origin_;
};

}  // namespace

std::unique_ptr<Sequence> fromOrigin(std::unique_ptr<Sequence> frames) {
    return std::make_unique<FromOrigin>(std::move(frames));
}

void countFromOrigin(Atlas& atlas) {
    moveTo(atlas, originOf(atlas, true));
}

}  // namespace stx
