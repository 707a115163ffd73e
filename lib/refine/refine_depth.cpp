#include "lib/refine/refine_depth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "lib/base/cpu_clock.hpp"
#include "lib/base/median.hpp"
#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/geometry/pixel_space.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/refine/agree.hpp"
#include "lib/refine/align.hpp"
#include "lib/refine/colours.hpp"
#include "lib/refine/edges.hpp"
#include "lib/refine/gaps.hpp"
#include "lib/refine/mixed.hpp"
#include "lib/refine/noise.hpp"
#include "lib/refine/silhouettes.hpp"
#include "lib/refine/strays.hpp"
#include "lib/registration/disagreement_by_view.hpp"

namespace stx {
namespace {

/// A quarter of the differences of two views that are each off by one standard deviation are below
/// 0.32 of the root of two. open3d-rgbd 0.0012 of the distance; oak tree, exact, 0.00001 (its
/// median 0.0026).
constexpr float kDoubtOfDisagreement = 2.22f;

/// Coverage below which surface mode takes a ray as free, and above which as stopped: kFreeLevel
/// and kSolidAlpha of shaders/shared/surface_constants.glsl.
constexpr SilhouetteAlpha kLevels{0.4625f, 0.99f};

/// Views of fewer points together are not noisy: one in twenty of their bends is what a handful of
/// pixels happens to have. One of 14 exact views of a torus, of 153 points, was taken for noisy.
constexpr std::int64_t kFewestNoisy = 500;
/// Where views with less than half of the points are noisy, only those are that have so many times
/// what isNoisy() asks for; where those with half of the points are, the others are that have so
/// large a part of it. Two of nine views of a torus with noise of a tenth of a pixel were
/// smoothed: 32.4 dB instead of 41.5 (tests/sweep, 77001:259).
constexpr float kClearlyNoisy = 2.0f;

/// A view while it is refined.
struct Work {
    PixelSpace space;
    Image<float> q;  ///< above 0: DepthAxis::q(); 0 = nothing here, -1 = not known
};

double farthestPoint(const RefineView& view) {
    double farthest = 0;
    for (const float dist : view.depth->pixels())
        if (hasPoint(dist)) farthest = std::max(farthest, static_cast<double>(dist));
    return farthest;
}

Work workOn(const RefineView& view) {
    const int width = view.depth->width(), height = view.depth->height();
    Work w{PixelSpace(view.header->camera,
                      view.header->camera.orthographic ? farthestPoint(view) : 0.0),
           Image<float>(width, height)};
    const DepthAxis axis = w.space.axis;
    const auto* bytes = view.texture->rgba8();
    parallelFor(0, height, 32, [&](int y) {
        const float* depth = view.depth->row(y).data();
        float* q = w.q.row(y).data();
        const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
        for (int x = 0; x < width; ++x) {
            const std::size_t pixel = first + static_cast<std::size_t>(x);
            const bool covered =
                bytes ? bytes->data()[pixel].a == 255 : view.texture->alpha(pixel) >= 1.0f;
            const float none = covered && view.header->depthMayBeUnknown() ? -1.0f : 0.0f;
            const bool point = hasPoint(depth[x]) && depth[x] > 0.0f;
            q[x] = !point         ? none
                   : axis.inverse ? 1.0f / depth[x]
                                  : static_cast<float>(axis.q(depth[x]));
        }
    });
    return w;
}

std::int64_t pointsIn(const Work& w) {
    return std::ranges::count_if(w.q.pixels(), [](float q) { return q > 0.0f; });
}

/// How many points the noisy views have together.
std::int64_t pointsOfNoisy(std::span<const Work> works, std::span<const float> noise) {
    std::int64_t points = 0;
    for (std::size_t k = 0; k < works.size(); ++k)
        if (isNoisy(noise[k], works[k].space.axis)) points += pointsIn(works[k]);
    return points;
}

/// Views of one camera have one noise, which each tells with some error, and small ones not at all
/// (0): what few say is taken away, and what most say given to those that hardly say otherwise.
void settleNoise(std::span<const Work> works, std::span<float> noise) {
    const std::int64_t noisy = pointsOfNoisy(works, noise);
    if (noisy < kFewestNoisy) {
        std::ranges::fill(noise, 0.0f);
        return;
    }
    std::int64_t points = 0;
    std::vector<float> ofNoisy;
    for (std::size_t k = 0; k < works.size(); ++k) {
        points += pointsIn(works[k]);
        if (isNoisy(noise[k], works[k].space.axis)) ofNoisy.push_back(noise[k]);
    }
    const bool most = 2 * noisy >= points;
    const float usual = medianOf(std::move(ofNoisy));
    for (std::size_t k = 0; k < works.size(); ++k) {
        const DepthAxis& axis = works[k].space.axis;
        const bool is = isNoisy(noise[k], axis);
        if (!most && is && !isNoisy(noise[k] / kClearlyNoisy, axis)) noise[k] = 0.0f;
        if (most && !is && (noise[k] == 0.0f || isNoisy(noise[k] * kClearlyNoisy, axis)))
            noise[k] = usual;
    }
}

/// Scene units between depth codes; 0 of floats.
float stepOf(const ViewHeader& view) {
    return view.depthBits < 32 ? static_cast<float>(view.depthCode().step()) : 0.0f;
}

/// Of a camera with depth: not made by a program, which knows where nothing is.
bool isCaptured(const RefineView& view) {
    return view.header->noDepth == NoDepth::unknown && !view.header->pruned;
}

/// Every pixel of a view may be off by the same share.
void doubtAlike(NoisyView& n, const Work& w, float doubt) {
    n.left = doubt;
    n.surface = Image<glm::vec3>(w.q.width(), w.q.height(), glm::vec3(0.0f));
    for (std::size_t i = 0; i < w.q.count(); ++i)
        if (const float q = w.q.data()[i]; q > 0.0f)
            n.surface.data()[i].z = n.left / kDoubt * w.space.axis.relativeScale(q);
}

/// What a step changes in the views, by comparing them before and after it.
class Changes {
  public:
    Changes(std::span<Work> works, RefineStepReport& report, PixelSpool* spool)
        : works_(works), report_(report) {
        for (const Work& w : works) {
            before_.push_back(w.q);
            before_.back().moveTo(spool);
        }
    }
    ~Changes() {
        double moves = report_.meanMove * static_cast<double>(report_.moved);
        int views = 0;
        for (std::size_t v = 0; v < works_.size(); ++v) {
            const Image<float>&a = before_[v], &b = works_[v].q;
            std::int64_t pixels = 0;
            for (std::size_t i = 0; i < a.count(); ++i) {
                const float was = a.data()[i], is = b.data()[i];
                if (was == is) continue;
                ++pixels;
                if (!(was > 0.0f) || !(is > 0.0f)) continue;
                moves += std::abs(is - was) / works_[v].space.axis.relativeScale(was);
                ++report_.moved;
            }
            views += pixels > 0;
            report_.pixels += pixels;
        }
        report_.views = std::max(report_.views, views);
        if (report_.moved > 0) report_.meanMove = moves / static_cast<double>(report_.moved);
    }
    Changes(const Changes&) = delete;
    Changes& operator=(const Changes&) = delete;

  private:
    std::span<Work> works_;
    RefineStepReport& report_;
    std::vector<Image<float>> before_;
};

/// What a step took, until the end.
class Clock {
  public:
    explicit Clock(RefineStepReport& report) : report_(report) {}
    ~Clock() { report_.milliseconds += processMilliseconds() - start_; }
    Clock(const Clock&) = delete;
    Clock& operator=(const Clock&) = delete;

  private:
    RefineStepReport& report_;
    double start_ = processMilliseconds();
};

/// The steps of imports where they are asked for later, which know distances and a picture.
struct Repair {
    RefineStep step;
    std::int64_t (*run)(Image<float>& distances, const Texture& picture);
};
constexpr Repair kRepairs[] = {
    {RefineStep::mixed, [](Image<float>& d, const Texture&) { return dropMixedPixels(d); }},
    {RefineStep::gaps, closeDepthGaps},
    {RefineStep::align, alignDepthEdges}};

/// What pruning took is neither a gap nor a depth edge: other views show it. Pixels of a pruned
/// view that have no depth, and those as near to them as the steps look at one by one, get theirs
/// back.
std::int64_t keepAsPruned(const RefineView& view, Image<float>& now) {
    constexpr int kLookedAt = 2;  // pixels to each side: as dropMixedPixels()
    const Image<float>& was = *view.depth;
    std::int64_t changed = 0;
    const auto isBesidePruned = [&](int x, int y) {
        for (int j = std::max(y - kLookedAt, 0); j <= std::min(y + kLookedAt, was.height() - 1);
             ++j)
            for (int i = std::max(x - kLookedAt, 0); i <= std::min(x + kLookedAt, was.width() - 1);
                 ++i)
                if (!hasPoint(was.at(i, j)) && view.texture->at(i, j).a >= 1.0f) return true;
        return false;
    };
    for (int y = 0; y < was.height(); ++y) {
        for (int x = 0; x < was.width(); ++x) {
            if (now.at(x, y) == was.at(x, y)) continue;
            if (isBesidePruned(x, y))
                now.at(x, y) = was.at(x, y);
            else
                ++changed;
        }
    }
    return changed;
}

/// Does one of them; the view gets new distances, kept in `distances`. Gives what it changed.
RefineStepReport repair(const Repair& step, RefineView& view, Image<float>& distances) {
    RefineStepReport report;
    Image<float> now = *view.depth;
    report.pixels = step.run(now, *view.texture);
    if (view.header->pruned) report.pixels = keepAsPruned(view, now);
    report.views = report.pixels > 0;
    for (std::size_t i = 0; i < now.count(); ++i) {
        const float was = view.depth->data()[i], is = now.data()[i];
        if (was == is || !hasPoint(was) || !hasPoint(is)) continue;
        ++report.moved;
        report.meanMove += std::abs(static_cast<double>(is) / was - 1);
    }
    if (report.moved > 0) report.meanMove /= static_cast<double>(report.moved);
    if (report.views > 0) {
        distances = std::move(now);
        view.depth = &distances;
    }
    return report;
}

/// The depth of a view after refining: pixels whose q is the same keep their very value.
std::optional<Image<float>> depthOf(const RefineView& view, const Work& w) {
    const Work before = workOn(view);
    std::optional<Image<float>> out;
    for (std::size_t i = 0; i < w.q.count(); ++i) {
        const float q = w.q.data()[i];
        if (q == before.q.data()[i]) continue;
        if (!out) out = *view.depth;
        out->data()[i] = q > 0.0f ? static_cast<float>(w.space.axis.dist(q)) : kNoDepth;
    }
    return out;
}

/// The views of one moment while they are refined, step by step.
class SideBySide {
  public:
    SideBySide(std::span<const RefineView> given, const RefineSettings& wanted,
               RefineReport& report, const RefineRoom& room)
        : given_(given),
          settings_(wanted),
          report_(report),
          room_(room),
          views_(given.begin(), given.end()),
          repaired_(given.size()),
          works_(given.size()),
          noise_(given.size(), 0.0f),
          noisy_(given.size()),
          out_(given.size()) {
        for (const RefineView& view : given) settings_ = settings_.after(view.header->refined);
    }

    std::vector<RefinedView> refined() {
        for (const Repair& step : kRepairs)
            if (settings_.on(step.step)) repairAll(step);
        begin();
        findNoise();
        smooth();
        if (settings_.on(RefineStep::edges)) thinEdges();
        // Noise from pixel to pixel; other errors of a sensor are smooth, and only other views
        // tell.
        const bool grainy =
            std::ranges::any_of(noisy_, [](const NoisyView& n) { return n.left > 0; });
        if (!grainy) doubtWhatDisagrees();
        agree(grainy);
        if (report_.changed())
            ofEach([&](std::size_t k) {
                out_[k].depth = depthOf(given_[k], works_[k]);
                works_[k].q = {};
                if (out_[k].depth) out_[k].depth->moveTo(room_.spool);
            });
        return std::move(out_);
    }

  private:
    /// Calls for each view: for all at once in memory, for as many at a time as a spool has room
    /// for.
    template <class Call>
    void ofEach(const Call& call) {
        const auto count = static_cast<std::int64_t>(views_.size());
        const std::int64_t most = room_.atOnce > 0 ? room_.atOnce : count;
        for (std::int64_t first = 0; first < count; first += most)
            parallelFor(first, std::min(first + most, count), [&](std::size_t i) {
                if (room_.spool) room_.spool->settle();
                call(i);
            });
    }

    void repairAll(const Repair& step) {
        const Clock clock(report_.of(step.step));
        std::vector<RefineStepReport> found(views_.size());
        ofEach([&](std::size_t k) {
            found[k] = repair(step, views_[k], repaired_[k]);
            repaired_[k].moveTo(room_.spool);
        });
        for (const RefineStepReport& ofView : found) report_.of(step.step).add(ofView);
    }

    void begin() {
        ofEach([&](std::size_t k) {
            Work& w = works_[k];
            w = workOn(views_[k]);
            // What was taken away is not empty space.
            for (std::size_t i = 0; views_[k].depth != given_[k].depth && i < w.q.count(); ++i)
                if (hasPoint(given_[k].depth->data()[i]) && !hasPoint(views_[k].depth->data()[i]))
                    w.q.data()[i] = -1.0f;
            w.q.moveTo(room_.spool);
            out_[k].lost = report_.of(RefineStep::mixed).views > 0;
            out_[k].refined = views_[k].header->refined;
        });
    }

    void findNoise() {
        const Clock clock(report_.of(RefineStep::noise));
        ofEach([&](std::size_t k) { noise_[k] = depthNoise(works_[k].q, works_[k].space.axis); });
        settleNoise(works_, noise_);
        report_.noise = noise_.empty() ? 0.0 : *std::max_element(noise_.begin(), noise_.end());
    }

    void smooth() {
        bool some = false;
        for (std::size_t k = 0; k < views_.size(); ++k)
            some = some || isNoisy(noise_[k], works_[k].space.axis);
        if (some && settings_.on(RefineStep::noise)) {
            const Clock clock(report_.of(RefineStep::noise));
            const Changes changes(works_, report_.of(RefineStep::noise), room_.spool);
            ofEach([&](std::size_t k) {
                NoisyView& n = noisy_[k];
                n.left = smoothDepth(works_[k].q, works_[k].space.axis, noise_[k], &n.surface);
                n.surface.moveTo(room_.spool);
            });
        }
        ofEach([&](std::size_t k) {
            noisy_[k].space = &works_[k].space;
            noisy_[k].texture = views_[k].texture;
            noisy_[k].q = &works_[k].q;
            if (const float left = views_[k].header->refined.doubt; left > 0) doubt(k, left);
        });
    }

    /// Every pixel of a view may be off by the same share.
    void doubt(std::size_t k, float share) {
        doubtAlike(noisy_[k], works_[k], share);
        noisy_[k].surface.moveTo(room_.spool);
    }

    void thinEdges() {
        const Clock clock(report_.of(RefineStep::edges));
        std::vector<EdgeView> edges;
        for (std::size_t k = 0; k < views_.size(); ++k)
            edges.push_back({&works_[k].space, views_[k].texture, &works_[k].q,
                             stepOf(*views_[k].header),
                             isNoisy(noise_[k], works_[k].space.axis) ? noise_[k] : 0.0f});
        report_.ownColour = colourAtEdges(edges);
        if (!edgesAreFat(static_cast<float>(report_.ownColour))) return;
        const Changes changes(works_, report_.of(RefineStep::edges), room_.spool);
        thinFatEdges(edges, room_.spool);
    }

    /// Captured views that disagree are off by that.
    void doubtWhatDisagrees() {
        if (!settings_.on(RefineStep::agree) || views_.size() < 2 ||
            !std::ranges::all_of(views_, isCaptured))
            return;
        const Clock clock(report_.of(RefineStep::agree));
        const float share = kDoubtOfDisagreement * disagreement();
        ofEach([&](std::size_t k) {
            if (isNoisy(share, works_[k].space.axis)) doubt(k, share);
        });
    }

    /// How far views are apart as they are by now, a share of the distance.
    float disagreement() {
        Bundle headers;
        for (const RefineView& view : views_)
            static_cast<ViewHeader&>(headers.views.emplace_back()) = *view.header;
        DisagreementByView found(views_.size());
        const auto ofDepths = [&](const auto& call) {
            ofEach([&](std::size_t k) {
                const auto changed = depthOf(views_[k], works_[k]);
                call(k, changed ? *changed : *views_[k].depth);
            });
        };
        ofDepths([&](std::size_t k, const Image<float>& depth) { found.sample(k, depth); });
        ofDepths([&](std::size_t k, const Image<float>& depth) {
            (void)found.compare(k, depth, headers);
        });
        return static_cast<float>(found.result().relative);
    }

    /// The steps of noisy views.
    void agree(bool grainy) {
        std::vector<std::size_t> numbers;
        std::vector<NoisyView> noisy;
        for (std::size_t k = 0; k < views_.size(); ++k) {
            if (!(noisy_[k].left > 0)) continue;
            numbers.push_back(k);
            noisy.push_back(std::move(noisy_[k]));
        }
        if (noisy.empty()) return;
        PixelSpool* const spool = room_.spool;
        const auto step = [&](RefineStep s, const auto& call) {
            if (!settings_.on(s)) return;
            const Clock clock(report_.of(s));
            const Changes changes(works_, report_.of(s), spool);
            call();
        };
        const auto silhouettes = [&] { keepInSilhouettes(noisy, kLevels, spool); };
        if (grainy) step(RefineStep::silhouettes, silhouettes);
        step(RefineStep::agree, [&] { agreeOnDepth(noisy, spool); });
        if (grainy) {
            step(RefineStep::colours, [&] { agreeOnColours(noisy, spool); });
            step(RefineStep::silhouettes, silhouettes);
            step(RefineStep::strays, [&] { removeStrays(noisy, spool); });
        }
        for (std::size_t n = 0; n < noisy.size(); ++n)
            out_[numbers[n]].refined.doubt = noisy[n].left;
    }

    std::span<const RefineView> given_;
    RefineSettings settings_;
    RefineReport& report_;
    RefineRoom room_;
    std::vector<RefineView> views_;
    std::vector<Image<float>> repaired_;
    std::vector<Work> works_;
    std::vector<float> noise_;
    std::vector<NoisyView> noisy_;
    std::vector<RefinedView> out_;
};

}  // namespace

void RefinedView::giveTo(ViewHeader& view) const {
    view.refined = refined;
    if (refined.doubt > 0 || lost) view.noDepth = NoDepth::unknown;
    if (!depth) return;
    for (const float dist : depth->pixels()) {
        if (!hasPoint(dist)) continue;
        view.nearPlane = std::min(view.nearPlane, static_cast<double>(dist));
        view.farPlane = std::max(view.farPlane, static_cast<double>(dist));
    }
}

Result<RefineRoom> roomIn(PixelSpool& spool, std::uint64_t largest, const Limits& limits) {
    STX_CHECK(checkPeak(peak::kRefine, largest, largest, 0, limits));
    const std::uint64_t views =
        limits.maxMemoryBytes / (peak::kRefine.perPixel * std::max<std::uint64_t>(largest, 1));
    return RefineRoom{&spool, static_cast<std::int64_t>(std::min<std::uint64_t>(views, 1 << 20))};
}

std::vector<RefinedView> refineDepth(std::span<const RefineView> views,
                                     const RefineSettings& settings, RefineReport& report,
                                     const RefineRoom& room) {
    return SideBySide(views, settings, report, room).refined();
}

void RefineNeeds::add(const RefineView& view) {
    if (some_) return;
    // Whether these agree shows only when they are side by side.
    some_ = settings_.on(RefineStep::agree) && isCaptured(view);
    if (some_) return;
    RefineSettings settings = settings_;
    settings.set(RefineStep::edges, false);
    RefineReport report;
    (void)refineDepth({&view, 1}, settings, report);
    some_ = report.changed();
    if (some_) return;
    Work w = workOn(view);
    // Few points of one view are no noise, those of many are: see kFewestNoisy.
    const std::array noise = {depthNoise(w.q, w.space.axis)};
    noisyPoints_ += pointsOfNoisy({&w, 1}, noise);
    if (!settings_.on(RefineStep::edges)) return;
    const auto more = sharesAtEdges({&w.space, view.texture, &w.q, stepOf(*view.header)});
    edgeShares_.insert(edgeShares_.end(), more.begin(), more.end());
}

void RefineNeeds::add(const RefineNeeds& others) {
    some_ = some_ || others.some_;
    noisyPoints_ += others.noisyPoints_;
    edgeShares_.insert(edgeShares_.end(), others.edgeShares_.begin(), others.edgeShares_.end());
}

bool RefineNeeds::any() const {
    return surely() || edgesAreFat(colourAtEdges(edgeShares_));
}

bool RefineNeeds::surely() const {
    return some_ || noisyPoints_ >= kFewestNoisy;
}

}  // namespace stx
