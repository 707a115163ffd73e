#include "lib/packing/prune.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "lib/base/parallel.hpp"
#include "lib/model/views_over.hpp"
#include "lib/packing/layout.hpp"
#include "lib/packing/packing.hpp"
#include "lib/packing/redundancy.hpp"
#include "lib/packing/views_one_by_one.hpp"
#include "lib/selection/coverage.hpp"

namespace stx {
namespace {

/// Side of the squares that are looked at together, and that a budget left over gives back, pixels.
constexpr int kBlock = 16;
/// Pruned pixels keep their colour, normal and material this near to kept ones.
constexpr int kColourBand = 4;
/// Background pixels this near to pruned ones, and not beside kept ones, are untold as well.
constexpr int kSilhouetteBand = 2;

/// What forEachView() may take to prepare a view beside it: its surface and room for its points,
/// and what is kept of both; see PruneView.
constexpr PeakMemory kPreparing = {"pruning", 40};
/// What is looked at of points, bytes for each pixel of all views at most.
constexpr std::uint64_t kOfPoints = 24;

/// Views by what each adds to the coverage; empty ones last. `points`: of all views.
std::vector<int> rankViews(const std::vector<PruneView>& prepared, std::int64_t points) {
    const auto views = static_cast<std::int64_t>(prepared.size());
    const auto count = std::clamp<std::int64_t>(20'000'000 / (views * views + 1), 200, 8000);
    const std::int64_t stride = std::max<std::int64_t>(1, points / count);
    std::vector<ViewSamples> ofViews(prepared.size());
    parallelFor(0, views, [&](std::int64_t i) {
        const PruneView& p = prepared[i];
        ReferenceView view;
        view.camera = p.camera;
        view.depth = p.depth();
        ofViews[i] = samplesOfView(view, static_cast<std::size_t>(i), stride, [&](int x, int y) {
            const PruneView::Surfel& s = p.surfel(x, y);
            return SurfacePoint{view.depth.at(x, y), s.w, s.gradient};
        });
    });
    std::vector<std::vector<Sighting>> seen(prepared.size());
    parallelFor(0, views, [&](std::int64_t i) {
        const PruneView& p = prepared[i];
        const Image<float> depth = p.depth();
        const CandidateView candidate{p.camera, p.camera, &depth, p.codeStep};
        for (const ViewSamples& of : ofViews)
            for (const SurfaceSample& s : of.samples) seen[i].push_back(sightingOf(candidate, s));
    });
    const auto problem = coverProblem(setAreas(ofViews, seen, stride), seen, 0);
    std::vector<int> rank = chooseCover(problem, static_cast<int>(views), 1.0).chosen;
    std::vector<bool> ranked(prepared.size(), false);
    for (const int v : rank) ranked[v] = true;
    for (int v = 0; v < views; ++v) {
        if (!ranked[v]) rank.push_back(v);
    }
    return rank;
}

std::int64_t countKept(const std::vector<PruneView>& views) {
    std::int64_t n = 0;
    for (const auto& v : views) n += std::count(v.kept.pixels().begin(), v.kept.pixels().end(), 1);
    return n;
}

/// Gives away what others show of a block; `next` is what is kept of the view after it.
void giveAwayBlock(std::vector<PruneView>& views, PruneView& from, const PruneBlock& block,
                   const PruneSettings& settings, Image<std::uint8_t>& next) {
    const BlockPartners partners = partnersOfBlock(views, from, block);
    if (partners.kept.empty()) return;
    std::vector<std::pair<int, Replacement>> shown;  // by view
    for (int y = block.y0; y < block.y1; ++y) {
        for (int x = block.x0; x < block.x1; ++x) {
            if (!from.kept.at(x, y) || from.locked[from.places.at(x, y)]) continue;
            const PrunePixel pixel(from, x, y);
            // Whoever sees past it would outvote the one view that is left to show it.
            std::ptrdiff_t wanted = 1;
            shown.clear();
            for (const int j : partners.kept) {
                const Replacement r = findReplacement(from, pixel, views[j], settings);
                if (!r.found) continue;
                if (shown.empty())
                    wanted += std::ranges::count_if(
                        partners.empty, [&](int k) { return seesPast(views[k], pixel); });
                shown.emplace_back(j, r);
                if (std::ssize(shown) == wanted) break;
            }
            if (std::ssize(shown) < wanted) continue;
            for (const auto& [j, r] : shown) {
                PruneView& to = views[j];
                for (int c = 0; c < 4; ++c)
                    std::atomic_ref(to.locked[to.places.at(r.x + (c & 1), r.y + (c >> 1))])
                        .store(1, std::memory_order_relaxed);
            }
            next.at(x, y) = 0;
            from.errors[from.places.at(x, y)] = static_cast<float>(shown.front().second.error);
        }
    }
}

/// Views from the lowest rank up give away what others show. Locks hold what replaced something.
void giveAway(std::vector<PruneView>& views, const std::vector<int>& rank,
              const PruneSettings& settings) {
    for (auto k = rank.rbegin(); k != rank.rend(); ++k) {
        PruneView& from = views[*k];
        if (from.partners.empty()) continue;
        Image<std::uint8_t> next = from.kept;
        const int width = next.width(), height = next.height();
        parallelFor(0, (height + kBlock - 1) / kBlock, [&](int row) {
            const int y = row * kBlock;
            for (int x = 0; x < width; x += kBlock)
                giveAwayBlock(views, from,
                              {x, y, std::min(x + kBlock, width), std::min(y + kBlock, height)},
                              settings, next);
        });
        from.kept = std::move(next);
        from.findLiveBlocks();
    }
}

/// What is kept with one more ring of points around it.
struct Ring {
    std::vector<Image<std::uint8_t>> kept;  ///< of each view
    std::int64_t added = 0;
};

Ring nextRing(const std::vector<PruneView>& views) {
    Ring ring;
    ring.kept.resize(views.size());
    std::vector<std::int64_t> added(views.size(), 0);
    parallelFor(0, views.size(), [&](std::int64_t i) {
        const PruneView& v = views[i];
        const int width = v.kept.width(), height = v.kept.height();
        ring.kept[i] = v.kept;
        // Kept in this row or one beside it, with a column more on each side.
        std::vector<std::uint8_t> column(static_cast<std::size_t>(width) + 2, 0);
        for (int y = 0; y < height; ++y) {
            const auto here = v.kept.row(y), above = v.kept.row(std::max(0, y - 1)),
                       below = v.kept.row(std::min(height - 1, y + 1));
            const auto grown = ring.kept[i].row(y);
            for (int x = 0; x < width; ++x) column[x + 1] = here[x] | above[x] | below[x];
            for (int x = 0; x < width; ++x) {
                const bool beside = (column[x] | column[x + 1] | column[x + 2]) != 0;
                if (!beside || here[x] || !v.point(x, y)) continue;
                grown[x] = 1;
                ++added[i];
            }
        }
    });
    for (const auto n : added) ring.added += n;
    return ring;
}

double lostError(const std::vector<PruneView>& views) {
    double sum = 0;
    for (const auto& v : views) {
        for (int y = 0; y < v.kept.height(); ++y) {
            for (int x = 0; x < v.kept.width(); ++x) {
                if (v.point(x, y) && !v.kept.at(x, y)) sum += v.errors[v.places.at(x, y)];
            }
        }
    }
    return sum;
}

/// Gives whole blocks back, those with the largest error per pixel first: up to `budget` pixels, or
/// until the error left is at most `mostError`.
void giveBack(std::vector<PruneView>& views, std::int64_t budget, double mostError) {
    struct Block {
        double error;
        std::int64_t pixels;
        int view, x, y;
    };
    std::vector<Block> blocks;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const PruneView& v = views[i];
        for (int y = 0; y < v.kept.height(); y += kBlock) {
            for (int x = 0; x < v.kept.width(); x += kBlock) {
                Block b{0, 0, static_cast<int>(i), x, y};
                for (int py = y; py < std::min(y + kBlock, v.kept.height()); ++py) {
                    for (int px = x; px < std::min(x + kBlock, v.kept.width()); ++px) {
                        if (v.kept.at(px, py) || !v.point(px, py)) continue;
                        b.error += v.errors[v.places.at(px, py)];
                        ++b.pixels;
                    }
                }
                if (b.pixels > 0) blocks.push_back(b);
            }
        }
    }
    std::stable_sort(blocks.begin(), blocks.end(), [](const Block& a, const Block& b) {
        return a.error * static_cast<double>(b.pixels) > b.error * static_cast<double>(a.pixels);
    });
    std::int64_t kept = countKept(views);
    double error = lostError(views);
    for (const Block& b : blocks) {
        if (error <= mostError) break;
        if (kept + b.pixels > budget) continue;
        kept += b.pixels;
        error -= b.error;
        PruneView& v = views[b.view];
        for (int py = b.y; py < std::min(b.y + kBlock, v.kept.height()); ++py) {
            for (int px = b.x; px < std::min(b.x + kBlock, v.kept.width()); ++px) {
                if (v.point(px, py)) v.kept.at(px, py) = 1;
            }
        }
    }
}

template <class Colour>
void smoothFarColours(const Image<std::uint8_t>& state, Image<Colour>& colour) {
    // State 2 = taken away and far from everything kept.
    if (std::find(state.pixels().begin(), state.pixels().end(), 2) == state.pixels().end()) return;
    Image<Colour> work = colour;
    for (std::size_t k = 0; k < state.count(); ++k) {
        if (state.pixels()[k] == 2) work.pixels()[k].a = 0;
    }
    Texture bled(std::move(work));
    bleedColour(bled);
    for (int y = 0; y < state.height(); ++y) {
        for (int x = 0; x < state.width(); ++x) {
            if (state.at(x, y) != 2) continue;
            const auto alpha = colour.at(x, y).a;
            if constexpr (std::is_same_v<Colour, glm::u8vec4>) {
                colour.at(x, y) = bled.rgba8()->at(x, y);
            } else {
                colour.at(x, y) = bled.rgbaFloat()->at(x, y);
            }
            colour.at(x, y).a = alpha;
        }
    }
}

Result<void> checkSettings(const PruneSettings& s) {
    if (s.budget < 0)
        return fail(ErrorCode::usage, "a budget of {} pixels cannot be kept", s.budget);
    if (!(s.minPsnr >= 0) || std::isinf(s.minPsnr))
        return fail(ErrorCode::usage, "the least PSNR is {:g} dB; it must be 0 or more", s.minPsnr);
    if (s.overlap < 0 || s.overlap > 16)
        return fail(ErrorCode::usage, "the overlap is {} pixels; 0 to 16 is possible", s.overlap);
    if (!(s.rateTolerance >= 1) || !(s.depthTolerance > 0 && s.depthTolerance <= 0.1) ||
        !(s.colourTolerance >= 0 && s.colourTolerance <= 1))
        return fail(
            ErrorCode::usage,
            "pruning tolerances out of range: rate {:g} (at least 1), depth {:g} (over 0, at "
            "most 0.1), colour {:g} (0 to 1)",
            s.rateTolerance, s.depthTolerance, s.colourTolerance);
    return {};
}

}  // namespace

void keepOnly(const Image<std::uint8_t>& kept, ReferenceView& view) {
    const int width = kept.width(), height = kept.height();
    Image<std::uint8_t> state(width, height, 0), gone = state;
    bool any = false;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (kept.at(x, y) || !hasPoint(view.depth.at(x, y))) continue;
            any = true;
            state.at(x, y) = 2;
            gone.at(x, y) = 1;
        }
    }
    if (!any) return;
    view.pruned = true;
    if (lacksDepthByMask(view)) view.noDepth = NoDepth::empty;
    // Kept, or a colour that was never measured: what is around such ones tells where they are.
    const auto stays = [&](int x, int y) {
        return kept.at(x, y) != 0 ||
               (view.noDepth == NoDepth::unknown && !gone.at(x, y) && view.texture.at(x, y).a >= 1);
    };
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (!stays(x, y)) continue;
            // Only the rim of a kept region reaches out.
            const bool inner = x > 0 && y > 0 && x + 1 < width && y + 1 < height &&
                               stays(x - 1, y) && stays(x + 1, y) && stays(x, y - 1) &&
                               stays(x, y + 1);
            if (inner) continue;
            for (int ny = std::max(0, y - kColourBand); ny <= std::min(height - 1, y + kColourBand);
                 ++ny) {
                for (int nx = std::max(0, x - kColourBand);
                     nx <= std::min(width - 1, x + kColourBand); ++nx)
                    state.at(nx, ny) = std::min<std::uint8_t>(state.at(nx, ny), 1);
            }
        }
    }
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (kept.at(x, y) || !hasPoint(view.depth.at(x, y))) continue;
            view.depth.at(x, y) = kNoDepth;
            if (auto* c = view.texture.rgba8()) c->at(x, y).a = 255;
            if (auto* c = view.texture.rgbaFloat()) c->at(x, y).a = 1.0f;
            if (view.hasSplats()) view.splatU.at(x, y) = view.splatV.at(x, y) = glm::vec3(0);
            // What filters mix with kept pixels stays as far as colours do: a pixel that is drawn
            // from pruned texels alone would be lit without a normal, or as of smooth plastic.
            if (state.at(x, y) != 2) continue;
            if (view.hasNormals()) view.normal.at(x, y) = glm::vec3(0);
            if (!view.metallicRoughness.empty()) view.metallicRoughness.at(x, y) = glm::vec2(0);
            if (!view.emissive.empty()) view.emissive.at(x, y) = glm::vec3(0);
        }
    }
    // A silhouette whose points are gone says nothing any more: points of other views that lie on
    // it must not be taken for empty space, and no second view vouches for them now.
    const auto near = [&](int x, int y, int reach, const auto& is) {
        for (int ny = std::max(0, y - reach); ny <= std::min(height - 1, y + reach); ++ny) {
            for (int nx = std::max(0, x - reach); nx <= std::min(width - 1, x + reach); ++nx) {
                if (is(nx, ny)) return true;
            }
        }
        return false;
    };
    std::vector<glm::ivec2> untold;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (state.at(x, y) == 2 || hasPoint(view.depth.at(x, y)) ||
                view.texture.at(x, y).a >= 1)
                continue;
            if (near(x, y, kSilhouetteBand, [&](int nx, int ny) { return gone.at(nx, ny) != 0; }) &&
                !near(x, y, 1, [&](int nx, int ny) { return kept.at(nx, ny) != 0; }))
                untold.emplace_back(x, y);
        }
    }
    for (const auto p : untold) {
        if (auto* c = view.texture.rgba8()) c->at(p.x, p.y).a = 255;
        if (auto* c = view.texture.rgbaFloat()) c->at(p.x, p.y).a = 1.0f;
    }
    if (auto* c = view.texture.rgba8()) smoothFarColours(state, *c);
    if (auto* c = view.texture.rgbaFloat()) smoothFarColours(state, *c);
}

namespace {

/// Gives away what others show, down to the budget; what is kept then.
Result<std::int64_t> giveAwayTo(std::int64_t budget, std::vector<PruneView>& views,
                                const std::vector<int>& rank, const PruneSettings& settings,
                                Job& job) {
    PruneSettings now = settings;
    // A wanted quality is reached from below: the least set first, then blocks come back.
    if (settings.minPsnr > 0 && settings.budget == 0)
        now.rateTolerance = std::max(now.rateTolerance, 2.0);
    giveAway(views, rank, now);
    STX_CHECK(job.checkCancelled());
    bool coarsely = false;
    if (countKept(views) > budget) {
        // Coarser and less alike replacements, rather than an object with holes. From the start:
        // what the first round locked would be in the way.
        for (auto& v : views) v.keepAll();
        now.rateTolerance = 1e6;
        now.colourTolerance = 1;
        giveAway(views, rank, now);
        coarsely = true;
    }
    const std::int64_t kept = countKept(views);
    if (kept > budget)
        return fail(
            ErrorCode::invalidInput,
            "a budget of {} pixels is too small: the views show {} pixels of surface that only "
            "one of them sees, and pruning leaves no holes; allow at least that many",
            budget, kept);
    if (coarsely)
        job.note(
            "the pruning budget is met only by giving away pixels that other views show more "
            "coarsely");
    return kept;
}

/// Views without what another view shows. Nothing else of them changes.
class PrunedViews : public ViewsOver {
  public:
    /// `own`: the table, if this is to keep it; may be null.
    PrunedViews(const ViewTable& table, std::unique_ptr<ViewTable> own, Bundle headers,
                Pruning pruning)
        : ViewsOver(table, std::move(own), std::move(headers), table.kinds(), planesOf(table)),
          pruning_(std::move(pruning)) {}

    std::uint64_t bytesToMake(std::size_t index) const override {
        constexpr std::uint64_t kCopyAndMasks = 24;  // for each pixel, beside the view
        return std::max(table_.bytesToMake(index),
                        bytesOf(index) + kCopyAndMasks * pixelsOf(index));
    }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job& job) const override {
        STX_TRY(auto whole, table_.view(index, job));
        auto view = toChange(std::move(whole));
        keepOnly(pruning_.kept[index], *view);
        return view;
    }

  private:
    Pruning pruning_;
};

std::unique_ptr<ViewTable> prunedTable(const ViewTable& table, std::unique_ptr<ViewTable> own,
                                       Pruning pruning) {
    Bundle headers = headersOf(table.about());
    for (std::size_t i = 0; i < headers.views.size(); ++i) {
        if (!pruning.changed[i]) continue;
        headers.views[i].pruned = true;
        headers.views[i].noDepth = pruning.noDepth[i];
    }
    return std::make_unique<PrunedViews>(table, std::move(own), std::move(headers),
                                         std::move(pruning));
}

std::uint64_t pixelsOf(const ViewTable& table) {
    std::uint64_t pixels = 0;
    for (std::size_t i = 0; i < table.count(); ++i) pixels += table.pixelsOf(i);
    return pixels;
}

}  // namespace

std::uint64_t memoryOfPruning(const ViewTable& table) {
    return std::max(table.bytesHeld() + kOfPoints * pixelsOf(table),
                    memoryOfEach(table, kPreparing));
}

Result<void> checkPruning(const ViewTable& table, const Limits& limits) {
    return limits.checkAllocation(pixelsOf(table), kOfPoints, kPreparing.what);
}

Result<Pruning> findPruning(const ViewTable& table, const PruneSettings& settings, Job& job) {
    STX_CHECK(checkSettings(settings));
    if (table.whole()) STX_CHECK(table.about().check());
    STX_CHECK(checkPruning(table, job.limits));
    Pruning out;
    PruneReport& report = out.report;
    std::vector<PruneView> views(table.count());
    std::vector<std::int64_t> points(table.count()), object(table.count());
    out.noDepth.resize(table.count());
    STX_CHECK(forEachView(
        table, kPreparing, job,
        [&](std::size_t i, const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
            views[i] = preparePruning(*view);
            points[i] = view->pointCount();
            object[i] = objectPixels(*view);
            out.noDepth[i] = lacksDepthByMask(*view) ? NoDepth::empty : view->noDepth;
            return {};
        }));
    for (std::size_t i = 0; i < views.size(); ++i) {
        report.sourcePixels += object[i];
        report.sourcePoints += points[i];
        const ViewHeader& header = table.about().views[i];
        if (out.noDepth[i] == NoDepth::unknown && !header.pruned && !header.background)
            report.unmeasuredPixels += object[i] - points[i];
    }
    const std::vector<int> rank = rankViews(views, report.sourcePoints);
    for (PruneView& v : views) {
        // In their room: what is freed between the views is seldom given back.
        v.errors = std::move(v.depths);
        v.keepAll();
    }
    STX_CHECK(job.checkCancelled());
    findPartners(views, rank);
    const std::int64_t budget =
        settings.budget > 0 ? settings.budget : std::numeric_limits<std::int64_t>::max();
    STX_TRY(std::int64_t kept, giveAwayTo(budget, views, rank, settings, job));
    for (PruneView& v : views) {
        v.locked = {};
        v.surfels = {};
        v.colours = {};
        v.linear = {};
    }
    for (int ring = 0; ring < settings.overlap; ++ring) {
        Ring grown = nextRing(views);
        if (kept + grown.added > budget) break;
        kept += grown.added;
        for (std::size_t i = 0; i < views.size(); ++i) views[i].kept = std::move(grown.kept[i]);
    }
    const double all = static_cast<double>(std::max<std::int64_t>(report.sourcePoints, 1));
    if (settings.minPsnr > 0) {
        giveBack(views, budget, all * std::pow(10.0, -settings.minPsnr / 10));
    } else if (settings.budget > 0) {
        giveBack(views, budget, 0);
    }
    STX_CHECK(job.checkCancelled());
    report.keptPixels = countKept(views);
    const double error = lostError(views) / all;
    report.psnr = error > 0 ? -10 * std::log10(error) : std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < views.size(); ++i) {
        const std::int64_t left = std::ranges::count(views[i].kept.pixels(), std::uint8_t{1});
        report.emptiedViews += left == 0 ? 1 : 0;
        out.changed.push_back(left < points[i]);
        out.kept.push_back(std::move(views[i].kept));
    }
    return out;
}

Result<PruneReport> prune(Bundle& bundle, const PruneSettings& settings, Job& job) {
    STX_TRY(const Pruning pruning, findPruning(*viewsOf(bundle), settings, job));
    applyPruning(pruning, bundle);
    return pruning.report;
}

void applyPruning(const Pruning& pruning, Bundle& bundle) {
    parallelFor(0, bundle.views.size(),
                [&](std::size_t i) { keepOnly(pruning.kept[i], bundle.views[i]); });
}

std::unique_ptr<ViewTable> prunedViews(std::unique_ptr<ViewTable> table, Pruning pruning) {
    const ViewTable& of = *table;
    return prunedTable(of, std::move(table), std::move(pruning));
}

std::unique_ptr<ViewTable> prunedViews(const ViewTable& table, Pruning pruning) {
    return prunedTable(table, nullptr, std::move(pruning));
}

}  // namespace stx
