#include "lib/model/view_table.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

#include "lib/base/parallel_try.hpp"
#include "lib/model/views_over.hpp"

namespace stx {

Bundle headersOf(const Bundle& bundle) {
    Bundle headers;
    headers.title = bundle.title;
    headers.origin = bundle.origin;
    headers.bounds = bundle.bounds;
    headers.environment = bundle.environment;
    headers.time = bundle.time;
    headers.duration = bundle.duration;
    for (const ReferenceView& view : bundle.views)
        static_cast<ViewHeader&>(headers.views.emplace_back()) = view;
    return headers;
}
namespace {

/// In what a view that came is not as its header was: found, and expected; empty where it is.
std::string difference(const ViewHeader& header, const ViewHeader& found, bool planes) {
    const Camera &is = found.camera, &was = header.camera;
    if (is.width != was.width || is.height != was.height)
        return fmt::format("it has {}x{} pixels, but its header says {}x{}", is.width, is.height,
                           was.width, was.height);
    if (found.depthBits != header.depthBits)
        return fmt::format("its depth has {} bits, but its header says {}", found.depthBits,
                           header.depthBits);
    if (planes && (found.nearPlane != header.nearPlane || found.farPlane != header.farPlane))
        return fmt::format("its planes are {:g} and {:g}, but its header says {:g} and {:g}",
                           found.nearPlane, found.farPlane, header.nearPlane, header.farPlane);
    if (found.name != header.name)
        return fmt::format("its name is '{}', but its header says '{}'", found.name, header.name);
    if (is != was) return "its camera is not that of its header";
    if (found.noDepth != header.noDepth || found.pruned != header.pruned ||
        found.background != header.background || found.refined != header.refined)
        return "its marks (unknown depth, pruned, background, refined) are not those of its header";
    return {};
}

class HeldViews : public ViewTable {
  public:
    explicit HeldViews(Bundle bundle) : ViewTable(std::move(bundle)) {}
    explicit HeldViews(const Bundle* bundle) : ViewTable(bundle) {}

    std::uint64_t bytesHeld() const override {
        std::uint64_t all = 0;
        for (std::size_t i = 0; i < count(); ++i) all += bytesOf(i);
        return all;
    }
    std::uint64_t bytesGiven(std::size_t) const override { return 0; }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job&) const override {
        // Not owned: it lives as long as the table.
        return std::shared_ptr<const ReferenceView>(std::shared_ptr<void>(), &about().views[index]);
    }
};

struct OwnSpool {
    std::unique_ptr<PixelSpool> spool;
};

/// Keeps the spool longer than the bundle, which ViewTable has.
class SpooledViews : private OwnSpool, public ViewTable {
  public:
    SpooledViews(std::vector<ViewImageKinds> kinds, Bundle bundle, std::unique_ptr<PixelSpool> in,
                 std::uint64_t held)
        : OwnSpool{std::move(in)}, ViewTable(std::move(bundle), std::move(kinds)), held_(held) {}

    std::uint64_t bytesHeld() const override { return held_; }
    std::uint64_t bytesGiven(std::size_t) const override { return 0; }
    bool knownSound() const override { return true; }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job&) const override {
        spool->settle();
        return std::shared_ptr<const ReferenceView>(std::shared_ptr<void>(), &about().views[index]);
    }

  private:
    std::uint64_t held_;
};

std::vector<ViewImageKinds> kindsOf(const Bundle& bundle) {
    std::vector<ViewImageKinds> kinds;
    for (const ReferenceView& view : bundle.views) kinds.push_back(ViewImageKinds::of(view));
    return kinds;
}

class ChangedViews : public ViewsOver {
  public:
    ChangedViews(std::unique_ptr<ViewTable> table, std::vector<ViewImageKinds> kinds,
                 ViewChange change)
        // What a change may do to the planes shows in its views only.
        : ViewsOver(*table, std::move(table), headersOf(std::as_const(*table).about()),
                    std::move(kinds), Planes::withPixels),
          change_(std::move(change)) {
        if (change_.header)
            for (ReferenceView& view : about().views) change_.header(view);
    }

    std::uint64_t bytesToMake(std::size_t index) const override {
        const std::uint64_t each = change_.takes.perPixel + change_.takes.perPixelOfLargest;
        return std::max(table_.bytesToMake(index), table_.bytesOf(index) + each * pixelsOf(index));
    }
    std::vector<ViewSummary> summaries() const override {
        return change_.keepsPixels ? table_.summaries() : std::vector<ViewSummary>();
    }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job& job) const override {
        STX_TRY(auto read, table_.view(index, job));
        auto view = toChange(std::move(read));
        STX_CHECK(within(fmt::format("view {}", index), change_.change(*view, job)));
        return view;
    }

  private:
    ViewChange change_;
};

class OtherHeaders : public ViewsOver {
  public:
    OtherHeaders(std::unique_ptr<ViewTable> table, const std::vector<ViewHeader>& headers)
        : ViewsOver(std::move(table), Planes::known) {
        for (std::size_t i = 0; i < count(); ++i) setHeader(about().views[i], headers[i]);
    }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job& job) const override {
        STX_TRY(auto read, table_.view(index, job));
        auto view = toChange(std::move(read));
        setHeader(*view, about().views[index]);
        return view;
    }

  private:
    static void setHeader(ReferenceView& view, const ViewHeader& header) {
        ViewHeader own = header;
        own.name = std::move(view.name);
        own.camera = view.camera;
        own.colourFile = std::move(view.colourFile);
        static_cast<ViewHeader&>(view) = std::move(own);
    }
};

class WatchedViews : public ViewsOver {
  public:
    WatchedViews(std::unique_ptr<ViewTable> table,
                 std::function<void(std::size_t, const ReferenceView&)> look)
        : ViewsOver(std::move(table), planesOf(*table)), look_(std::move(look)) {}

    std::uint64_t bytesGiven(std::size_t index) const override { return table_.bytesGiven(index); }
    std::uint64_t bytesToMake(std::size_t index) const override {
        return table_.bytesToMake(index);
    }
    std::vector<ViewSummary> summaries() const override { return table_.summaries(); }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job& job) const override {
        STX_TRY(auto view, table_.view(index, job));
        look_(index, *view);
        return view;
    }

  private:
    std::function<void(std::size_t, const ReferenceView&)> look_;
};

}  // namespace

ViewImageKinds ViewImageKinds::of(const ReferenceView& view) {
    return {view.texture.isLinear(),
            !view.normal.empty(),
            !view.splatU.empty(),
            !view.splatV.empty(),
            !view.metallicRoughness.empty(),
            !view.emissive.empty()};
}

std::uint64_t ViewImageKinds::bytesPerPixel() const {
    const std::uint64_t vectors = std::uint64_t{normal} + splatU + splatV + emissive;
    return (linear ? sizeof(glm::vec4) : sizeof(glm::u8vec4)) + sizeof(float) +
           vectors * sizeof(glm::vec3) + (metallicRoughness ? sizeof(glm::vec2) : 0);
}

ViewTable::ViewTable(Bundle headers, std::vector<ViewImageKinds> kinds, Planes planes)
    : own_(std::move(headers)), kinds_(std::move(kinds)), planesKnown_(planes == Planes::known) {}

ViewTable::ViewTable(Bundle whole)
    : own_(std::move(whole)), kinds_(stx::kindsOf(own_)), whole_(true) {}

ViewTable::ViewTable(const Bundle* whole)
    : about_(whole), kinds_(stx::kindsOf(*whole)), whole_(true) {}

Result<std::shared_ptr<const ReferenceView>> ViewTable::view(std::size_t index, Job& job) const {
    STX_TRY(auto view, make(index, job));
    if (whole_) return view;
    const auto place = [&] { return fmt::format("view {}", index); };
    STX_CHECK(within(place(), view->checkHeader()));
    auto differs = difference(about_->views[index], *view, planesKnown_);
    if (differs.empty() && ViewImageKinds::of(*view) != kinds_[index])
        differs =
            "its images (normals, splats, materials, linear colour) are not those of its header";
    if (!differs.empty())
        return failAt(place(), ErrorCode::invalidInput, "{}: the file is damaged; write it anew",
                      differs);
    return view;
}

std::uint64_t ViewTable::bytesOf(std::size_t index) const {
    return kinds_[index].bytesPerPixel() * pixelsOf(index);
}

std::uint64_t ViewTable::pixelsOf(std::size_t index) const {
    const Camera& camera = about_->views[index].camera;
    return static_cast<std::uint64_t>(camera.width) * static_cast<std::uint64_t>(camera.height);
}

std::unique_ptr<ViewTable> tableOf(Bundle bundle) {
    return std::make_unique<HeldViews>(std::move(bundle));
}

std::unique_ptr<ViewTable> tableOf(Bundle bundle, std::unique_ptr<PixelSpool> spool,
                                   std::uint64_t held) {
    std::vector<ViewImageKinds> kinds = kindsOf(bundle);
    return std::make_unique<SpooledViews>(std::move(kinds), std::move(bundle), std::move(spool),
                                          held);
}

std::unique_ptr<ViewTable> viewsOf(const Bundle& bundle) {
    return std::make_unique<HeldViews>(&bundle);
}

Result<Bundle> wholeBundle(std::unique_ptr<ViewTable> table, Job& job) {
    if (table->whole()) return std::move(table->about());
    return wholeBundle(*table, job);
}

Result<Bundle> someViews(
    const ViewTable& table, const std::vector<bool>& wanted, PixelSpool* spool, Job& job,
    const std::function<Result<void>(std::size_t, const ReferenceView&)>& look) {
    Bundle bundle = headersOf(table.about());
    const auto all = std::ranges::count(wanted, true);
    std::atomic<std::int64_t> finished = 0;
    const auto read = parallelTry(0, table.count(), [&](std::size_t index) -> Result<void> {
        if (!wanted[index]) return {};
        STX_CHECK(job.checkCancelled());
        STX_TRY(auto view, table.view(index, job));
        if (look) STX_CHECK(look(index, *view));
        bundle.views[index] = std::move(*toChange(std::move(view)));
        bundle.views[index].moveTo(spool);
        job.progress(++finished, all, "reading views");
        return {};
    });
    STX_CHECK(read);
    return bundle;
}

Result<Bundle> wholeBundle(const ViewTable& table, Job& job) {
    if (table.whole()) return table.about();
    std::uint64_t bytes = 0;
    for (std::size_t i = 0; i < table.count(); ++i) bytes += table.bytesOf(i);
    STX_CHECK(within(table.where(), job.limits.checkAllocation(bytes, 1, "the views")));
    return someViews(table, std::vector<bool>(table.count(), true), nullptr, job);
}

Result<Bundle> wholeBundle(const ViewTable& table, PixelSpool& spool, Job& job) {
    Bundle bundle = headersOf(table.about());
    std::atomic<std::int64_t> finished = 0;
    STX_CHECK(forEachView(
        table, {"reading", 0}, job,
        [&](std::size_t index, std::shared_ptr<const ReferenceView> view) -> Result<void> {
            bundle.views[index] = std::move(*toChange(std::move(view)));
            bundle.views[index].moveTo(&spool);
            job.progress(++finished, static_cast<std::int64_t>(table.count()), "reading views");
            return {};
        }));
    return bundle;
}

void noteMaterialLeftOut(const ViewTable& table, Job& job) {
    if (std::ranges::any_of(table.kinds(), &ViewImageKinds::hasMaterial))
        job.note(
            "metallic-roughness and emissive are left out: .exr bundles and atlases alone hold "
            "them");
}

bool allHaveNormals(const ViewTable& table, Job& job) {
    const auto all = static_cast<std::int64_t>(table.count());
    const auto with = std::ranges::count_if(table.kinds(), &ViewImageKinds::normal);
    if (with > 0 && with < all)
        job.note(
            fmt::format("normals are left out, since {} of {} views {} none; stx bake "
                        "--keep-normals makes them where they are missing",
                        all - with, all, all - with == 1 ? "has" : "have"));
    return with == all;
}

std::unique_ptr<ViewTable> changedViews(std::unique_ptr<ViewTable> table, ViewChange change) {
    std::vector<ViewImageKinds> kinds = table->kinds();
    if (change.kinds)
        for (ViewImageKinds& of : kinds) change.kinds(of);
    return std::make_unique<ChangedViews>(std::move(table), std::move(kinds), std::move(change));
}

std::unique_ptr<ViewTable> withHeaders(std::unique_ptr<ViewTable> table,
                                       const std::vector<ViewHeader>& headers) {
    return std::make_unique<OtherHeaders>(std::move(table), headers);
}

std::unique_ptr<ViewTable> watchedViews(
    std::unique_ptr<ViewTable> table,
    std::function<void(std::size_t index, const ReferenceView& view)> look) {
    return std::make_unique<WatchedViews>(std::move(table), std::move(look));
}

namespace {

/// Of a view that comes and is worked on, beside what the table holds.
std::uint64_t memoryOfOne(const ViewTable& table, std::size_t index, const PeakMemory& work) {
    const std::uint64_t working = (work.perPixel + work.perPixelOfLargest) * table.pixelsOf(index);
    return std::max(table.bytesToMake(index), table.bytesGiven(index) + working);
}

std::uint64_t mostAtOnce(const ViewTable& table, const PeakMemory& work) {
    for (std::size_t i = 0; work.oneByOneFrom > 0 && i < table.count(); ++i)
        if (table.pixelsOf(i) >= work.oneByOneFrom) return 1;
    const auto threads = static_cast<std::uint64_t>(threadCount());
    return table.mostAtOnce() > 0
               ? std::min(threads, static_cast<std::uint64_t>(table.mostAtOnce()))
               : threads;
}

}  // namespace

std::uint64_t heldWhole(const Limits& limits) {
    constexpr std::uint64_t kMost = 64u << 20, kPartOfLimit = 8;
    return std::min(kMost, limits.maxMemoryBytes / kPartOfLimit);
}

std::uint64_t memoryOfEach(const ViewTable& table, const PeakMemory& work) {
    std::uint64_t most = 0;
    for (std::size_t i = 0; i < table.count(); ++i)
        most = std::max(most, memoryOfOne(table, i, work));
    return table.bytesHeld() +
           most * std::min<std::uint64_t>(mostAtOnce(table, work), table.count());
}

std::uint64_t memoryFromSpool(const ViewTable& table, const PeakMemory& work,
                              const Limits& limits) {
    std::uint64_t most = 1;
    for (std::size_t i = 0; i < table.count(); ++i)
        most = std::max(most, memoryOfOne(table, i, work));
    const std::uint64_t limit = limits.maxMemoryBytes;
    const std::uint64_t beside = table.bytesHeld() + limit / kSpoolPart;
    const std::uint64_t room = limit > beside ? (limit - beside) / most : 0;
    const auto count = std::max<std::uint64_t>(table.count(), 1);
    return beside +
           most * std::clamp<std::uint64_t>(room, 1, std::min(mostAtOnce(table, work), count));
}

std::uint64_t memoryOfAll(const ViewTable& table, const PeakMemory& work) {
    std::uint64_t bytes = 0, largest = 0;
    for (std::size_t i = 0; i < table.count(); ++i) {
        bytes += table.bytesOf(i) + work.perPixel * table.pixelsOf(i);
        largest = std::max(largest, table.pixelsOf(i));
    }
    return bytes + work.perPixelOfLargest * largest;
}

Result<void> forEachView(
    const ViewTable& table, const PeakMemory& work, Job& job,
    const std::function<Result<void>(std::size_t, std::shared_ptr<const ReferenceView>)>& each,
    const std::function<Result<void>(std::size_t)>& inOrder, const std::function<bool()>& enough) {
    const std::size_t count = table.count();
    if (count == 0) return {};
    const std::uint64_t held = table.bytesHeld();
    std::uint64_t most = 1;  // that a view takes
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint64_t pixels = table.pixelsOf(i), takes = memoryOfOne(table, i, work);
        STX_CHECK(checkPeak({work.what, 0}, pixels, pixels, held + takes, job.limits));
        most = std::max(most, takes);
    }
    const auto room = (job.limits.maxMemoryBytes - held) / most;
    const std::uint64_t atOnce = std::clamp<std::uint64_t>(room, 1, mostAtOnce(table, work));
    for (std::size_t first = 0; first < count; first += atOnce) {
        if (enough && enough()) return {};
        const std::size_t end = std::min<std::size_t>(first + atOnce, count);
        const auto read = parallelTry(first, end, [&](std::size_t index) -> Result<void> {
            STX_CHECK(job.checkCancelled());
            STX_TRY(auto view, table.view(index, job));
            return each(index, std::move(view));
        });
        STX_CHECK(read);
        for (std::size_t i = first; inOrder && i < end; ++i) STX_CHECK(inOrder(i));
    }
    return {};
}

}  // namespace stx
