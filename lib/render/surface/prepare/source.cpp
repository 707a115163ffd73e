#include "lib/render/surface/prepare/source.hpp"

#include <algorithm>
#include <cstring>

#include "lib/base/parallel.hpp"
#include "lib/render/surface/prepare/creases.hpp"
#include "lib/render/surface/prepare/draft.hpp"
#include "lib/render/surface/prepare/outline_levels.hpp"
#include "lib/render/surface/prepare/rims.hpp"
#include "lib/render/surface/prepare/sharpen.hpp"
#include "lib/render/surface/prepare/source_rows.hpp"

namespace stx::surface {
namespace {

/// What smoothing leaves of noise counts as a step of the depth code this large: for links, and
/// else. Chosen by trial on the project's image sets with noise added.
constexpr float kLeftInLinks = 0.25f, kLeftInStep = 0.5f;
/// Likewise of smooth views that disagree (SurfaceScene::blends), for all but links. Of the kitchen
/// of 7-Scenes (two pictures) and open3d-rgbd 0.5 and 8 have 27.24, 25.57 and 37.42 and 27.45,
/// 25.76 and 37.55 dB of Y; noisy views lose with more than 0.5 (pictures.md).
constexpr float kDisagreeingStep = 8.0f;
/// What is off to the side by less than this share of a pixel is where it is seen: background
/// counts as that of exact views. Small views of bars 0.15 pixels off: 30.6 dB, 27.7 without
/// (tests/sweep, 90210:183); statue and oak tree with noise of 0.5 % have 0.43 to 2.4.
constexpr float kLeastBeside = 0.2f;

/// Views that are smooth and disagree: the step `agree` alone found something to do.
bool disagree(const Refined& refined) {
    return refined.doubt > 0 && wasDone(RefineStep::agree, refined) &&
           !wasDone(RefineStep::noise, refined);
}

/// Of orthographic views; 0 for others, whose depth axis does not need it.
double farthestPoint(const PageSet& set, std::size_t view) {
    double farthest = 0.0;
    if (!set.views()[view].camera.orthographic) return farthest;
    for (const PageRectangle& r : set.rectanglesOf(view)) {
        const Image<float>& depth = *set.pages()[static_cast<std::size_t>(r.page)].depth;
        for (int y = r.pageY; y < r.pageY + r.height; ++y)
            for (const float dist : depth.row(y).subspan(static_cast<std::size_t>(r.pageX),
                                                         static_cast<std::size_t>(r.width)))
                if (hasPoint(dist)) farthest = std::max(farthest, static_cast<double>(dist));
    }
    return farthest;
}

/// Calls visit(x, y, texel) for the pixels of a rectangle and `around` more on each side, as far as
/// the view goes, rows on several threads.
template <class Visit>
void forEachPixel(const Source& s, const PageRectangle& r, int around, const Visit& visit) {
    const int x0 = std::max(r.x0 - around, 0), x1 = std::min(r.x1 + around, s.width);
    const int y0 = std::max(r.y0 - around, 0), y1 = std::min(r.y1 + around, s.height);
    parallelForBlocks(y0, y1, 32, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y)
            for (int x = x0; x < x1; ++x) visit(x, y, r.texel(x, y));
    });
}

Draft draftOf(const Source& s) {
    const bool unknown = s.view->depthMayBeUnknown();
    Draft d{Image<float>(s.width, s.height, 0.0f),
            Image<std::uint8_t>(s.width, s.height),
            Image<std::uint8_t>(s.width, s.height, 0),
            {}};
    const auto mark = [&](int x, int y, bool covered) {
        d.covered.at(x, y) = covered ? 1 : 0;
        d.q.at(x, y) = covered && unknown ? -1.0f : 0.0f;
    };
    const auto rectangles = s.set->rectanglesOf(s.number);
    if (!s.whole) {
        parallelForBlocks(0, s.height, 32, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y)
                for (int x = 0; x < s.width; ++x) mark(x, y, s.set->objectOutside(s.number, x, y));
        });
        for (const PageRectangle& r : rectangles) {
            const Texture& texture = *s.pages[r.page].texture;
            forEachPixel(s, r, PageSet::kPadding, [&](int x, int y, std::size_t texel) {
                mark(x, y, texture.alpha(texel) >= 1.0f);
            });
        }
    }
    for (const PageRectangle& r : rectangles) {
        const Texture& texture = *s.pages[r.page].texture;
        const auto* bytes = texture.rgba8();
        const float* depth = s.set->pages()[static_cast<std::size_t>(r.page)].depth->data();
        const DepthAxis axis = s.space.axis;
        const auto width = static_cast<std::size_t>(r.x1 - r.x0);
        parallelForBlocks(r.y0, r.y1, 32, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y) {
                const std::size_t first = r.texel(r.x0, y);
                const auto texel = [&](std::size_t i) {
                    return first +
                           static_cast<std::size_t>(static_cast<std::ptrdiff_t>(i) * r.stepX);
                };
                std::uint8_t* covered = &d.covered.at(r.x0, y);
                float* q = &d.q.at(r.x0, y);
                for (std::size_t i = 0; i < width; ++i)
                    covered[i] =
                        bytes ? bytes->data()[texel(i)].a == 255 : texture.alpha(texel(i)) >= 1.0f;
                if (axis.inverse && r.stepX == 1) {
                    // 1 / dist in floats is what it is in doubles and rounded then.
                    invertDistances(depth + first, covered, width, unknown ? -1.0f : 0.0f, q);
                    continue;
                }
                for (std::size_t i = 0; i < width; ++i) {
                    const float dist = depth[texel(i)];
                    q[i] = hasPoint(dist) && dist > 0.0f ? static_cast<float>(axis.q(dist))
                           : covered[i] != 0 && unknown  ? -1.0f
                                                         : 0.0f;
                }
            }
        });
    }
    return d;
}

/// Puts the draft where the pixels of the view are kept.
void keep(Source& s, Draft&& d, std::vector<PreparedPage>& pages) {
    if (s.whole) {
        PreparedPage& page = pages[static_cast<std::size_t>(s.whole - s.pages)];
        page.q = std::move(d.q);
        page.info = std::move(d.info);
        page.levels = std::move(d.levels);
        PixelSpool* const spool = s.set->spool();
        page.q.moveTo(spool);
        page.info.moveTo(spool);
        page.levels.moveTo(spool);
        return;
    }
    for (const PageRectangle& r : s.set->rectanglesOf(s.number)) {
        PreparedPage& page = pages[static_cast<std::size_t>(r.page)];
        forEachPixel(s, r, PageSet::kPadding, [&](int x, int y, std::size_t texel) {
            page.q.data()[texel] = d.q.at(x, y);
            page.info.data()[texel] = d.info.at(x, y);
            if (s.hasAlpha) page.levels.data()[texel] = d.levels.at(x, y);
        });
    }
}

/// `step`: scene units, of the depth code or what noise makes of it.
void findLinks(const Source& s, Draft& d, float step) {
    const DepthAxis axis = s.space.axis;
    const int width = s.width, height = s.height;
    parallelForBlocks(0, height, 32, [&](std::int64_t from, std::int64_t to) {
        // Beyond the picture lies nothing, which is not the same as background.
        const std::vector<float> nothing(static_cast<std::size_t>(width), 0.0f);
        const auto rowOf = [&](int y) {
            return y >= 0 && y < height ? d.q.row(y).data() : nothing.data();
        };
        for (int y = static_cast<int>(from); y < to; ++y) {
            const float *above = rowOf(y - 1), *here = rowOf(y), *below = rowOf(y + 1),
                        *second = rowOf(y + 2);
            linkRow({above, here, below, second, y == 0, y + 1 == height}, width, axis, step,
                    d.info.row(y).data());
        }
    });
}

/// Whether eight pixels from x on, above 0, all have links to all sides and full alpha, as most
/// have.
bool insideSurface(const Draft& d, int x, int y) {
    const auto eight = [](const std::uint8_t* from) {
        std::uint64_t bytes = 0;
        std::memcpy(&bytes, from, 8);
        return bytes;
    };
    constexpr std::uint64_t kEach = 0x0101010101010101;
    const std::uint8_t* info = &d.info.at(x, y);
    const std::uint64_t both = eight(info) & (eight(info - 1) | ~(kEach * Info::kLinkRight)) &
                               (eight(&d.info.at(x, y - 1)) | ~(kEach * Info::kLinkDown));
    constexpr std::uint64_t kAll = kEach * (Info::kLinkRight | Info::kLinkDown);
    return (both & kAll) == kAll && eight(&d.covered.at(x, y)) == kEach;
}

/// Fills the block's edge masks and the distances to edges.
void findEdges(Source& s, Draft& d) {
    Image<std::uint8_t> distance(s.width, s.height, kFarFromEdge);
    parallelForBlocks(0, s.blocksY, 1, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from) * kBlock; y < std::min<int>(to * kBlock, s.height);
             ++y) {
            for (int x = 0; x < s.width; ++x) {
                if (x > 0 && y > 0 && x + 8 <= s.width && insideSurface(d, x, y)) {
                    x += 7;
                    continue;
                }
                const float q = d.q.at(x, y);
                if (!(q > 0.0f)) {
                    if (!(q < 0.0f)) distance.at(x, y) = 0;
                    continue;
                }
                const bool all = d.linkRight(x, y) && d.linkDown(x, y) && x > 0 && y > 0 &&
                                 d.linkRight(x - 1, y) && d.linkDown(x, y - 1);
                if (all && (!s.hasAlpha || d.covered.at(x, y))) continue;
                // Where pruning took the neighbour away the surface goes on: that is the border of
                // what has depth, but no edge.
                const bool goesOn = x > 0 && y > 0 && x + 1 < s.width && y + 1 < s.height &&
                                    (d.linkRight(x, y) || d.pruned(x + 1, y)) &&
                                    (d.linkDown(x, y) || d.pruned(x, y + 1)) &&
                                    (d.linkRight(x - 1, y) || d.pruned(x - 1, y)) &&
                                    (d.linkDown(x, y - 1) || d.pruned(x, y - 1));
                if (!(goesOn && (!s.hasAlpha || d.covered.at(x, y)))) distance.at(x, y) = 0;
                if (all) continue;
                auto& block =
                    s.blocks[static_cast<std::size_t>(y / kBlock) * s.blocksX + x / kBlock];
                block.edges[y % kBlock] |= static_cast<std::uint16_t>(1u << (x % kBlock));
                block.anyEdge = true;
            }
        }
    });
    Image<std::uint8_t> rows(s.width, s.height);
    for (int round = 1; round < kFarFromEdge; ++round) {
        parallelForBlocks(0, s.height, 32, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y) {
                // Plain loops, of which compilers make vectors.
                const std::uint8_t* in = distance.row(y).data();
                std::uint8_t* out = rows.row(y).data();
                const int last = s.width - 1;
                out[0] = std::min(in[0], in[std::min(1, last)]);
                for (int x = 1; x < last; ++x) {
                    const std::uint8_t beside = std::min(in[x - 1], in[x + 1]);
                    out[x] = std::min(beside, in[x]);
                }
                if (last > 0) out[last] = std::min(in[last - 1], in[last]);
            }
        });
        parallelForBlocks(0, s.height, 32, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y) {
                const std::uint8_t* above = rows.row(std::max(y - 1, 0)).data();
                const std::uint8_t* here = rows.row(y).data();
                const std::uint8_t* below = rows.row(std::min(y + 1, s.height - 1)).data();
                std::uint8_t* out = distance.row(y).data();
                const int width = s.width;
                for (int x = 0; x < width; ++x) {
                    const std::uint8_t beside = std::min(above[x], below[x]);
                    const std::uint8_t least = std::min(beside, here[x]);
                    const auto next = static_cast<std::uint8_t>(least + 1);
                    const std::uint8_t was = out[x];
                    out[x] = next < was ? next : was;
                }
            }
        });
    }
    for (std::size_t i = 0; i < distance.count(); ++i)
        d.info.data()[i] |= static_cast<std::uint8_t>(distance.data()[i] << 4);
}

/// The median distance of a view's points, scene units; orthographic: what shares of q are shares
/// of.
float typicalDist(const Source& s, const Draft& d) {
    if (!s.space.axis.inverse) return static_cast<float>(s.space.axis.unit);
    std::vector<float> values;
    for (std::size_t i = 0; i < d.q.count(); i += 7)
        if (d.q.data()[i] > 0.0f) values.push_back(d.q.data()[i]);
    if (values.empty()) return 0.0f;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return 1.0f / *middle;
}

/// A source of whose view the pixels were not read: it shows nothing, and hides what it is asked
/// about, as behind its surface.
void prepareUnread(Source& s) {
    s.hasAlpha = s.view->unread->open;
    s.validShare = s.view->unread->validShare;
    s.placeOfBlock.assign(static_cast<std::size_t>(s.blocksX) * s.blocksY, Source::kAllPruned);
}

/// Links, edges, planar pieces and outlines of a source, from its points.
void prepareSource(Source& s, const RenderSettings& settings, bool blends, bool rims,
                   std::vector<PreparedPage>& pages) {
    s.set->settle();
    const Camera& camera = s.view->camera;
    s.width = camera.width;
    s.height = camera.height;
    s.space = PixelSpace(camera, farthestPoint(*s.set, s.number));
    if (s.view->depthBits < 32) s.step = static_cast<float>(s.view->depthCode().step());
    s.blocksX = (s.width + kBlock - 1) / kBlock;
    s.blocksY = (s.height + kBlock - 1) / kBlock;
    if (s.view->unread) return prepareUnread(s);
    s.blocks.resize(static_cast<std::size_t>(s.blocksX) * s.blocksY);
    Draft d = draftOf(s);
    const DraftCounts counts = countPixels(d.q.data(), d.covered.data(), d.q.count());
    s.hasAlpha = counts.covered < static_cast<std::int64_t>(d.covered.count());
    s.validShare = counts.object > 0
                       ? static_cast<double>(counts.points) / static_cast<double>(counts.object)
                       : 1.0;
    float step = s.step;
    // What smoothing leaves is like the step of a coarser depth code.
    if (const float left = s.view->refined.doubt; left > 0) {
        const float dist = typicalDist(s, d);
        step = std::max(step, kLeftInLinks * left * dist);
        s.step = std::max(s.step, (blends ? kDisagreeingStep : kLeftInStep) * left * dist);
        // Noise along the rays of one view is to the side in another that looks from there.
        const double pixels = s.space.axis.inverse ? s.space.camera.fx / dist : s.space.camera.fx;
        s.beside = static_cast<float>(pixels * left * dist);
        if (s.beside < kLeastBeside) s.beside = 0.0f;
    }
    findLinks(s, d, step);
    findEdges(s, d);
    findLeaves(s, d);
    const auto inThread = StageTimer::Of::thread;
    if (settings.does(Stage::creases)) {
        const StageTimer timer(settings.log.get(), "creases", true, inThread);
        findCreases(s, d);
    }
    if (rims) {
        const StageTimer timer(settings.log.get(), "rims", true, inThread);
        findRims(s, d);
    }
    if (s.hasAlpha) {
        const StageTimer timer(settings.log.get(), "levels", true, inThread);
        d.levels = outlineLevels(s.whole ? *s.whole->texture : s.set->textureOfView(s.number),
                                 settings.does(Stage::levels));
    }
    keep(s, std::move(d), pages);
}

/// See Source::placeOfBlock.
std::vector<std::int32_t> placesOfBlocks(const Source& s) {
    std::vector<std::int32_t> places;
    for (int y = 0; y < s.height; y += kBlock) {
        for (int x = 0; x < s.width; x += kBlock) {
            const int x1 = std::min(x + kBlock + 1, s.width - 1);
            const int y1 = std::min(y + kBlock + 1, s.height - 1);
            const auto near = s.set->near(s.number, x, y);
            std::int32_t place = Source::kSeveralPlaces;
            if (near.empty()) {
                int pruned = 0;
                for (int j = y; j <= y1; ++j)
                    for (int i = x; i <= x1; ++i) pruned += s.set->objectOutside(s.number, i, j);
                if (pruned == 0) place = Source::kNothingThere;
                if (pruned == (x1 - x + 1) * (y1 - y + 1)) place = Source::kAllPruned;
            } else if (s.set->reads(s.set->rectangles()[near[0]], std::max(x - 1, 0),
                                    std::max(y - 1, 0), x1, y1)) {
                place = static_cast<std::int32_t>(near[0]);
            }
            places.push_back(place);
        }
    }
    return places;
}

}  // namespace

SurfaceScene::SurfaceScene(const PageSet& pageSet, const RenderSettings& settings) : set(pageSet) {
    {
        const StageTimer timer(settings.log.get(), "prepare", true);
        prepare(settings);
    }
    // One view cannot tell whether its depth is exact; where it is not, sharper is worse.
    if (!settings.does(Stage::sharpen) || sources.size() < 2) return;
    const StageTimer timer(settings.log.get(), "sharpen", true);
    sharpened = sharpenedTextures(*this);
    for (std::size_t i = 0; i < pages.size(); ++i) pages[i].texture = sharpened[i].get();
}

void SurfaceScene::begin() {
    sources.clear();
    sources.resize(set.views().size());
    for (std::size_t i = 0; i < sources.size(); ++i) {
        Source& s = sources[i];
        s.view = &set.views()[i];
        s.number = i;
        s.set = &set;
        s.pages = pages.data();
        if (s.view->whole && !s.view->unread) s.whole = pages.data() + set.rectanglesOf(i)[0].page;
    }
}

void SurfaceScene::prepare(const RenderSettings& settings) {
    pages.resize(set.pages().size());
    for (std::size_t i = 0; i < pages.size(); ++i) pages[i].texture = set.pages()[i].texture;
    begin();
    blends = settings.does(Stage::blend) && std::ranges::any_of(sources, [](const Source& s) {
                 return disagree(s.view->refined);
             });
    // Of several views the others know better where what is in front ends.
    const bool rims = settings.does(Stage::rims) && sources.size() < 2;
    const bool whole = std::ranges::all_of(sources, [](const Source& s) { return s.view->whole; });
    if (whole) {
        parallelFor(0, static_cast<std::int64_t>(sources.size()), [&](std::int64_t i) {
            prepareSource(sources[static_cast<std::size_t>(i)], settings, blends, rims, pages);
        });
        return;
    }
    for (std::size_t i = 0; i < pages.size(); ++i) {
        const Page& page = set.pages()[i];
        pages[i].q = Image<float>(page.width(), page.height(), 0.0f);
        pages[i].info = Image<std::uint8_t>(page.width(), page.height(), 0);
        pages[i].levels = Image<std::uint8_t>(page.width(), page.height(), 0);
    }
    // One after the other: a draft takes the memory of a whole view.
    for (Source& s : sources) prepareSource(s, settings, blends, rims, pages);
    for (Source& s : sources)
        if (!s.whole) s.placeOfBlock = placesOfBlocks(s);
}

}  // namespace stx::surface
