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
void moveBounds(Model& model, const glm::dvec3& by) {
    model.origin += by;
    if (!model.bounds || model.bounds->empty()) return;
    model.bounds->min -= by;
    model.bounds->max -= by;
}

template <class Model>
void move(Model& model, const glm::dvec3& by) {
    if (by == glm::dvec3(0.0)) return;
    for (ReferenceView& view : model.views) view.camera.position -= by;
    moveBounds(model, by);
}

class FromOrigin : public Sequence {
  public:
    FromOrigin(std::unique_ptr<Sequence> frames, std::optional<glm::dvec3> origin)
        : frames_(std::move(frames)), origin_(origin) {
        timeline_ = frames_->timeline();
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, frames_->frame(index, job));
        move(bundle, offsetOf(bundle, true));
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(auto table, frames_->views(index, job));
        const glm::dvec3 by = offsetOf(std::as_const(*table).about(), table->planesKnown());
        if (by == glm::dvec3(0.0)) return table;
        if (table->whole()) {
            STX_TRY(auto bundle, wholeBundle(std::move(table), job));
            move(bundle, by);
            return tableOf(std::move(bundle));
        }
        ViewChange change;
        change.header = [by](ViewHeader& view) { view.camera.position -= by; };
        change.change = [by](ReferenceView& view, Job&) -> Result<void> {
            view.camera.position -= by;
            return {};
        };
        change.takes = {"moving", 0};
        auto moved = changedViews(std::move(table), std::move(change));
        moveBounds(moved->about(), by);
        return moved;
    }

  private:
    /// How far the origin of all frames, which is found once, is from that of this one.
    glm::dvec3 offsetOf(const Bundle& about, bool planesKnown) {
        if (!origin_) origin_ = about.origin + originOf(about, planesKnown);
        return *origin_ - about.origin;
    }

    std::unique_ptr<Sequence> frames_;
    std::optional<glm::dvec3> origin_;
};

}  // namespace

std::unique_ptr<Sequence> fromOrigin(std::unique_ptr<Sequence> frames) {
    return std::make_unique<FromOrigin>(std::move(frames), std::nullopt);
}

std::unique_ptr<Sequence> fromOrigin(std::unique_ptr<Sequence> frames, const glm::dvec3& origin) {
    return std::make_unique<FromOrigin>(std::move(frames), origin);
}

void countFromOrigin(Atlas& atlas) {
    move(atlas, originOf(atlas, true));
}

}  // namespace stx
