#include <algorithm>
#include <utility>

#include "lib/packing/layout.hpp"
#include "lib/packing/views_one_by_one.hpp"

namespace stx {
namespace {

/// The views of several tables, one after the other.
class JoinedViews : public ViewTable {
  public:
    explicit JoinedViews(std::vector<std::unique_ptr<ViewTable>> parts)
        : ViewTable(headersOf(parts), kindsOf(parts),
                    std::ranges::all_of(parts, [](const auto& p) { return p->planesKnown(); })
                        ? Planes::known
                        : Planes::withPixels),
          parts_(std::move(parts)) {
        for (const auto& part : parts_)
            for (std::size_t i = 0; i < part->count(); ++i) places_.emplace_back(part.get(), i);
    }

    std::uint64_t bytesHeld() const override {
        std::uint64_t held = 0;
        for (const auto& part : parts_) held += part->bytesHeld();
        return held;
    }
    std::uint64_t bytesGiven(std::size_t index) const override {
        const auto& [part, i] = places_[index];
        return part->bytesGiven(i);
    }
    std::uint64_t bytesToMake(std::size_t index) const override {
        const auto& [part, i] = places_[index];
        return part->bytesToMake(i);
    }
    int mostAtOnce() const override {
        int most = 0;
        for (const auto& part : parts_)
            if (const int own = part->mostAtOnce(); own > 0 && (most == 0 || own < most))
                most = own;
        return most;
    }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job& job) const override {
        const auto& [part, i] = places_[index];
        return part->view(i, job);
    }

  private:
    using Parts = std::vector<std::unique_ptr<ViewTable>>;
    static Bundle headersOf(const Parts& parts) {
        Bundle headers;
        for (const auto& part : parts)
            for (const ReferenceView& view : std::as_const(*part).about().views)
                static_cast<ViewHeader&>(headers.views.emplace_back()) = view;
        return headers;
    }
    static std::vector<ViewImageKinds> kindsOf(const Parts& parts) {
        std::vector<ViewImageKinds> kinds;
        for (const auto& part : parts)
            kinds.insert(kinds.end(), part->kinds().begin(), part->kinds().end());
        return kinds;
    }

    Parts parts_;
    std::vector<std::pair<const ViewTable*, std::size_t>> places_;  ///< by the view's number
};

/// What pack() would refuse of the names.
Result<void> checkNamesOf(const std::vector<PackTable>& objects) {
    if (objects.empty()) return fail(ErrorCode::usage, "there is no object to pack");
    for (std::size_t i = 0; i < objects.size(); ++i) {
        const PackTable& o = objects[i];
        const auto same = [&](const PackTable& other) { return other.name == o.name; };
        if (o.name.empty())
            return fail(ErrorCode::usage, "object {} has no name; --names gives one to each", i);
        if (std::any_of(objects.begin(), objects.begin() + static_cast<std::ptrdiff_t>(i), same))
            return fail(ErrorCode::usage,
                        "two objects are called '{}'; --names gives each a name of its own",
                        o.name);
    }
    return {};
}

bool isLinear(const PackTable& object) {
    return object.views->kindsOf(0).linear;
}

/// Counts the pixels of an object: points, and those before pruning.
Result<void> countPixels(const PackTable& object, AtlasObject& entry, Job& job) {
    const ViewTable& views = *object.views;
    std::vector<std::int64_t> points(views.count()), pixels(views.count());
    // What there is to say is said when the views are read again.
    Job quiet;
    quiet.workFor(job);
    STX_CHECK(forEachView(
        views, {"an atlas", 0}, quiet,
        [&](std::size_t i, const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
            points[i] = view->pointCount();
            pixels[i] = objectPixels(*view);
            return {};
        }));
    entry.sourcePixels = object.sourcePixels;
    for (std::size_t i = 0; i < points.size(); ++i) {
        entry.keptPixels += points[i];
        if (object.sourcePixels <= 0) entry.sourcePixels += pixels[i];
    }
    if (entry.keptPixels == 0) return fail(ErrorCode::invalidInput, "it has no point to pack");
    return {};
}

}  // namespace

Result<JoinedTables> joinTables(std::vector<PackTable> objects, Job& job) {
    STX_CHECK(checkNamesOf(objects));
    JoinedTables joined;
    std::vector<std::string> environments;
    std::vector<std::unique_ptr<ViewTable>> parts;
    int views = 0;
    for (const PackTable& o : objects) {
        const auto where = [&](const Error& error) {
            return tl::unexpected(error.at(fmt::format("object '{}'", o.name)));
        };
        const Bundle& about = std::as_const(*o.views).about();
        AtlasObject& entry = joined.objects.emplace_back();
        if (const auto ok = countPixels(o, entry, job); !ok) return where(ok.error());
        if (isLinear(o) != isLinear(objects[0]))
            return where({ErrorCode::invalidInput,
                          fmt::format("its colour is {} and that of '{}' {}; pack them into sheets "
                                      "of their own",
                                      isLinear(o) ? "linear light" : "8-bit sRGB", objects[0].name,
                                      isLinear(o) ? "8-bit sRGB" : "linear light"),
                          {}});
        entry.name = o.name;
        entry.title = about.title;
        entry.firstView = views;
        entry.views = static_cast<int>(o.views->count());
        entry.bounds = about.bounds;
        entry.origin = about.origin;
        views += entry.views;
        if (about.environment) environments.push_back(o.name);
    }
    for (PackTable& o : objects) parts.push_back(std::move(o.views));
    joined.views = std::make_unique<JoinedViews>(std::move(parts));
    if (!environments.empty())
        job.note(
            fmt::format("the environment of {} is left out: objects that share an atlas have "
                        "none",
                        fmt::join(environments, ", ")));
    return joined;
}

Result<JoinedObjects> joinObjects(std::vector<PackObject> objects, Job& job) {
    std::vector<PackTable> tables;
    for (const PackObject& o : objects) {
        STX_CHECK(within(fmt::format("object '{}'", o.name), o.bundle.check()));
        tables.push_back({o.name, viewsOf(o.bundle), o.sourcePixels});
    }
    STX_TRY(auto views, joinTables(std::move(tables), job));
    JoinedObjects joined{{}, std::move(views.objects)};
    for (PackObject& o : objects)
        std::ranges::move(o.bundle.views, std::back_inserter(joined.bundle.views));
    return joined;
}

}  // namespace stx
