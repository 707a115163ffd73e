#include "lib/model/from_origin.hpp"

#include <optional>
#include <utility>

#include "lib/geometry/frustum.hpp"
#include "lib/geometry/origin.hpp"
#include "lib/model/views_over.hpp"

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

/// What to subtract from the coordinates of a bundle or an atlas.
template <class Model>
glm::dvec3 nearOrigin(const Model& model, bool planesKnown) {
    return originFor(model.bounds && !model.bounds->empty() ? *model.bounds
                                                            : boxOfViews(model.views, planesKnown));
}

template <class Model>
void move(Model& model, const glm::dvec3& by) {
    if (by == glm::dvec3(0.0)) return;
    model.origin += by;
    for (ReferenceView& view : model.views) view.camera.position -= by;
    if (!model.bounds || model.bounds->empty()) return;
    model.bounds->min -= by;
    model.bounds->max -= by;
}

/// Views of a table that are read when they are asked for, from another origin.
class MovedViews : public ViewsOver {
  public:
    /// `own`: as ViewsOver has it.
    MovedViews(const ViewTable& table, std::unique_ptr<ViewTable> own, const glm::dvec3& by)
        : ViewsOver(table, std::move(own), headersOf(table.about()), table.kinds(),
                    planesOf(table)),
          by_(by) {
        move(about(), by);
    }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job& job) const override {
        STX_TRY(auto read, table_.view(index, job));
        auto view = toChange(std::move(read));
        view->camera.position -= by_;
        return view;
    }

  private:
    glm::dvec3 by_;
};

class FromOrigin : public Sequence {
  public:
    FromOrigin(std::unique_ptr<Sequence> frames, std::optional<glm::dvec3> origin)
        : frames_(std::move(frames)), origin_(origin) {
        timeline_ = frames_->timeline();
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, frames_->frame(index, job));
        if (!origin_) origin_ = bundle.origin + nearOrigin(bundle, true);
        move(bundle, *origin_ - bundle.origin);
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(auto table, frames_->views(index, job));
        if (!origin_) origin_ = originOf(*table);
        return countedFrom(*origin_, std::move(table));
    }

  private:
    std::unique_ptr<Sequence> frames_;
    std::optional<glm::dvec3> origin_;  ///< of all frames, found once
};

}  // namespace

std::unique_ptr<Sequence> fromOrigin(std::unique_ptr<Sequence> frames) {
    return std::make_unique<FromOrigin>(std::move(frames), std::nullopt);
}

std::unique_ptr<Sequence> fromOrigin(std::unique_ptr<Sequence> frames, const glm::dvec3& origin) {
    return std::make_unique<FromOrigin>(std::move(frames), origin);
}

glm::dvec3 originOf(const ViewTable& table) {
    return table.about().origin + nearOrigin(table.about(), table.planesKnown());
}

std::unique_ptr<ViewTable> countedFrom(const glm::dvec3& origin, std::unique_ptr<ViewTable> table) {
    const glm::dvec3 by = origin - std::as_const(*table).about().origin;
    if (by == glm::dvec3(0.0)) return table;
    if (!table->whole()) return std::make_unique<MovedViews>(*table, std::move(table), by);
    move(table->about(), by);
    return table;
}

std::unique_ptr<ViewTable> countedFrom(const glm::dvec3& origin, const ViewTable& table) {
    return std::make_unique<MovedViews>(table, nullptr, origin - table.about().origin);
}

void countFromOrigin(Atlas& atlas) {
    move(atlas, nearOrigin(atlas, true));
}

}  // namespace stx
