#include "lib/render/surface/plan/plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "lib/base/parallel.hpp"
#include "lib/render/surface/plan/placement.hpp"
#include "lib/render/surface/plan/places.hpp"

namespace stx::surface {
namespace {

/// For each tile the mean q of the blocks of all sources that may be drawn in it, 0 = none.
std::vector<double> middlesOf(const SurfaceFrame& frame,
                              std::span<const std::vector<PlacedBlocks>> placed) {
    struct Sum {
        double q = 0;
        int blocks = 0;
    };
    // Blocks that are partly behind the camera count only in tiles that have no others.
    const std::size_t tiles = static_cast<std::size_t>(frame.tiles.count());
    std::vector<std::array<Sum, 2>> sums(tiles);
    for (const auto& ofSource : placed) {
        for (const PlacedBlocks& p : ofSource) {
            for (int y = p.tiles.y0; y <= p.tiles.y1; ++y) {
                for (int x = p.tiles.x0; x <= p.tiles.x1; ++x) {
                    Sum& sum =
                        sums[static_cast<std::size_t>(y * frame.tiles.size.x + x)][p.partlyBehind];
                    const auto count = static_cast<int>(p.end - p.begin);
                    sum.q += p.q * count;
                    sum.blocks += count;
                }
            }
        }
    }
    std::vector<double> middles(tiles, 0.0);
    for (std::size_t t = 0; t < tiles; ++t)
        if (const Sum& sum = sums[t][sums[t][0].blocks ? 0 : 1]; sum.blocks)
            middles[t] = sum.q / sum.blocks;
    return middles;
}

/// Chooses `wanted` of the sources that have blocks in a tile. `q` is the mean depth of these
/// blocks (middlesOf()).
std::vector<int> chooseSources(const SurfaceFrame& frame, int tile, double q, int wanted) {
    const glm::dvec4 h =
        frame.space.worldFromPixel *
        glm::dvec4(frame.tiles.x(tile) + kTile * 0.5, frame.tiles.y(tile) + kTile * 0.5, q, 1.0);
    const glm::dvec3 point = glm::dvec3(h) / h.w;
    const auto towards = [&](const Camera& c) {
        return c.orthographic ? c.forward() : glm::normalize(point - c.position);
    };
    const glm::dvec3 look = towards(frame.space.camera);
    // A source may have been taken from where the frame is seen from, and have looked elsewhere.
    // Views of an object often end where it does, and the middle of a tile at its outline is
    // outside.
    const auto inPicture = [&](const FrameSource& f) {
        const Source& s = *f.source;
        const auto x = static_cast<float>(frame.tiles.x(tile)),
                   y = static_cast<float>(frame.tiles.y(tile));
        glm::vec2 least(std::numeric_limits<float>::max()), most = -least;
        for (int corner = 0; corner < 4; ++corner) {
            const glm::vec4 at = f.sourceFromPixel.homogeneous(
                x + (corner & 1 ? kTile : 0), y + (corner & 2 ? kTile : 0), static_cast<float>(q));
            if (!(at.w > 0)) return false;
            least = glm::min(least, glm::vec2(at) / at.w);
            most = glm::max(most, glm::vec2(at) / at.w);
        }
        return most.x >= 0 && most.y >= 0 && least.x <= static_cast<float>(s.width) &&
               least.y <= static_cast<float>(s.height);
    };
    // Sources in order of the angle between their line of sight and the novel one. Those that show
    // nothing in the tile come after all others.
    using Ranked = std::pair<double, int>;
    std::vector<Ranked> left, idle;
    left.reserve(frame.sources.size());
    for (const FrameSource& f : frame.sources)
        left.emplace_back(-glm::dot(look, towards(f.source->space.camera)),
                          static_cast<int>(left.size()));
    std::make_heap(left.begin(), left.end(), std::greater<>());
    const std::size_t most =
        std::min(left.size(),
                 static_cast<std::size_t>(std::min(wanted, kMostTileSources - kSourcesOfPlaces)));
    std::vector<int> chosen;
    while (!left.empty() && chosen.size() < most) {
        std::pop_heap(left.begin(), left.end(), std::greater<>());
        const auto [rank, i] = left.back();
        left.pop_back();
        const FrameSource& f = frame.sources[static_cast<std::size_t>(i)];
        if (inPicture(f) && !(frame.effort.preferShown && f.blocksOf(tile).empty()))
            chosen.push_back(i);
        else
            idle.emplace_back(rank, i);
    }
    std::sort(idle.begin(), idle.end());
    for (std::size_t k = 0; chosen.size() < most; ++k) chosen.push_back(idle[k].second);
    std::sort(chosen.begin(), chosen.end());
    return chosen;
}

/// Adds further sources to those of a tile: it is built once more from all of them, and the mean of
/// both is shown (the stage `mean`).
void addFurtherSources(SurfaceFrame& frame, int tile, double q) {
    std::vector<int>& sources = frame.tileSources[static_cast<std::size_t>(tile)];
    const auto core = static_cast<std::ptrdiff_t>(sources.size());
    for (const int k :
         chooseSources(frame, tile, q, frame.effort.mostGeometry + frame.effort.moreGeometry))
        if (sources.size() < kMostTileSources &&
            !std::binary_search(sources.begin(), sources.begin() + core, k))
            sources.push_back(k);
}

FrameSource sourceIn(const PixelSpace& space, const Source& s) {
    FrameSource f;
    f.source = &s;
    f.pixelFromSource = space.pixelFromWorld * s.space.worldFromPixel;
    f.sourceFromPixel = warpFrom(s.space.pixelFromWorld * space.worldFromPixel);
    f.fromEye = rayFrom(s.space, space);
    return f;
}

/// All sources, in order of the angle under which they and the camera see the middle of the scene.
/// In this order ties are decided later: so the source that shows more of what the camera sees
/// wins, and the picture does not depend on the order of the views in their file.
std::vector<const Source*> sourcesBySide(const SurfaceScene& scene, const Bounds& bounds,
                                         const Camera& camera) {
    std::vector<const Source*> out;
    for (const Source& s : scene.sources) out.push_back(&s);
    if (bounds.empty()) return out;
    const glm::dvec3 middle = bounds.centre();
    const auto towards = [&](const Camera& c) {
        const glm::dvec3 away = middle - c.position;
        const double distance = glm::length(away);
        return c.orthographic || !(distance > 0) ? c.forward() : away / distance;
    };
    const glm::dvec3 look = towards(camera);
    std::vector<double> turned(out.size());
    for (const Source& s : scene.sources)
        turned[s.number] = -glm::dot(look, towards(s.space.camera));
    std::ranges::stable_sort(out, {}, [&](const Source* s) { return turned[s->number]; });
    return out;
}

/// Places the blocks of the sources that are wanted.
void placeAll(SurfaceFrame& frame, const std::vector<char>& wanted) {
    parallelFor(0, static_cast<std::int64_t>(wanted.size()), [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        if (wanted[k]) placeBlocks(frame.sources[k], frame.space, frame.tiles);
    });
}

}  // namespace

Ray rayFrom(const PixelSpace& eye, const PixelSpace& frame) {
    Ray ray{};
    const glm::dmat4& m = frame.worldFromPixel;
    const glm::dvec3 at = eye.camera.position;
    const glm::dvec3 forward = eye.camera.forward();
    for (int axis = 0; axis < 3; ++axis) {
        for (int column = 0; column < 4; ++column) {
            const double value = eye.camera.orthographic
                                     ? (column == 3 ? forward[axis] : 0.0)
                                     : m[column][axis] - at[axis] * m[column][3];
            ray[static_cast<std::size_t>(axis * 4 + column)] = static_cast<float>(value);
        }
    }
    return ray;
}

/// Settings for views that disagree (SurfaceScene::blends): kernels are wider, so that colours that
/// do not match are blurred into each other, and pixels at edges weigh in full, since colours of
/// one view here and of another there are a patchwork. The kitchen of 7-Scenes (two pictures) and
/// open3d-rgbd, dB of Y: as of exact views 27.27, 25.61 and 37.36; edges in full 27.45, 25.76
/// and 37.55; kernels and ridges of 4.5 and 0.03 27.81, 25.94 and 37.61; 5 and 0.1 27.90, 25.99
/// and 37.46; 8 and 1 28.05, 26.07 and 36.56.
constexpr ShadeSettings kBlended{.kernel = 4.5f, .ridge = 0.03f, .edgeWeight = 1.0f};

/// Samples along a side of a pixel of what has guessed planes (Stage::unmeasured). 4 take a quarter
/// more of the time of a frame of the kitchen of 7-Scenes, and give pictures of it and of a room of
/// Open3D between 0.09 dB less and 0.04 dB more.
constexpr int kGuessedSamples = 2;

Effort effortOf(const RenderSettings& settings, const SurfaceScene& scene) {
    Effort e;
    e.places = settings.does(Stage::places);
    e.mean = settings.does(Stage::mean);
    e.settle = settings.does(Stage::settle);
    // More than 8 would look from so far aside that they cost as much as they add (pictures.md).
    if (settings.quality == Quality::best) e.moreGeometry = 8;
    if (scene.blends) e.shade = kBlended;
    if (scene.set.farAway() > 0) e.samplesPerPixel = kGuessedSamples;
    double valid = 0;
    for (const Source& s : scene.sources)
        valid += s.validShare / static_cast<double>(scene.sources.size());
    // Each pruned view may be the only one left that shows some piece of the surface, so that all
    // are needed. Of views with gaps (validShare below 1), as many more are taken as the gaps cost.
    if (scene.set.pruned()) {
        e.mostGeometry = kMostTileSources;
        e.moreGeometry = 0;
        e.freeLevel = kFreeLevelPruned;
        e.preferShown = true;
    } else if (valid < 1 && !(scene.set.farAway() > 0)) {
        // A pixel in a million that is missing, or rounding, must not add a source.
        constexpr double kNothing = 1e-5;
        for (int* most : {&e.mostGeometry, &e.moreGeometry})
            *most = static_cast<int>(
                std::min<double>(kMostTileSources, std::ceil(*most / valid - kNothing)));
    }
    return e;
}

TileGrid::TileGrid(const Camera& camera) {
    const auto along = [](double principal, int pixels, int& begin, int& count) {
        const double whole = std::floor(principal);
        begin = static_cast<int>(whole - kTile * std::ceil(whole / kTile));
        count = (pixels - begin + kTile - 1) / kTile;
    };
    along(camera.cx, camera.width, first.x, size.x);
    along(camera.cy, camera.height, first.y, size.y);
}

glm::dmat4 SurfaceFrame::sampleFromPixel(int tile, int perPixel, int apron) const {
    glm::dmat4 m(1.0);
    m[0][0] = m[1][1] = perPixel;
    m[3][0] = -(tiles.x(tile) - apron) * perPixel - 0.5;
    m[3][1] = -(tiles.y(tile) - apron) * perPixel - 0.5;
    return m;
}

float SurfaceFrame::qLimit() const {
    return space.axis.nearest();
}

void keepPixels(SurfaceFrame& frame, std::vector<TilePixels> wanted) {
    for (std::size_t t = 0; t < frame.tileSources.size(); ++t)
        if (wanted[t] == TilePixels{}) frame.tileSources[t].clear();
    frame.wanted = std::move(wanted);
}

Bounds boundsOf(const SurfaceScene& scene) {
    Bounds bounds;
    for (const Source& s : scene.sources) addBounds(s, bounds);
    return bounds;
}

SurfaceFrame planFrame(const SurfaceScene& scene, const Bounds& bounds, const Effort& effort,
                       const Camera& camera) {
    double farthest = 1.0;
    if (!bounds.empty())
        farthest = std::max(
            1e-6 * bounds.radius(),
            glm::dot(bounds.centre() - camera.position, camera.forward()) + bounds.radius());
    SurfaceFrame f;
    f.space = PixelSpace(camera, farthest, bounds.empty() ? 0.0 : bounds.radius());
    f.tiles = TileGrid(camera);
    f.effort = effort;
    for (const Source* s : sourcesBySide(scene, bounds, camera))
        f.sources.push_back(sourceIn(f.space, *s));
    const std::size_t tiles = static_cast<std::size_t>(f.tiles.count());
    f.tileSources.resize(tiles);
    const bool all = static_cast<int>(f.sources.size()) <= effort.mostGeometry;
    if (all || effort.preferShown) placeAll(f, std::vector<char>(f.sources.size(), 1));
    if (all) {
        std::vector<int> every(f.sources.size());
        std::iota(every.begin(), every.end(), 0);
        for (std::size_t t = 0; t < tiles; ++t)
            if (std::any_of(f.sources.begin(), f.sources.end(), [&](const FrameSource& s) {
                    return !s.blocksOf(static_cast<int>(t)).empty();
                }))
                f.tileSources[t] = every;
        f.tileCore.assign(tiles, static_cast<int>(every.size()));
        return f;
    }
    std::vector<std::vector<PlacedBlocks>> placed(f.sources.size());
    parallelFor(0, static_cast<std::int64_t>(placed.size()), [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        placed[k] = placedBlocks(f.sources[k], f.tiles);
    });
    const std::vector<double> middles = middlesOf(f, placed);
    parallelFor(0, static_cast<std::int64_t>(tiles), [&](std::int64_t i) {
        const auto t = static_cast<std::size_t>(i);
        if (middles[t] > 0)
            f.tileSources[t] =
                chooseSources(f, static_cast<int>(i), middles[t], effort.mostGeometry);
    });
    if (effort.places) addSourcesOfPlaces(f, placed);
    f.tileCore.resize(tiles);
    parallelFor(0, static_cast<std::int64_t>(tiles), [&](std::int64_t i) {
        const auto t = static_cast<std::size_t>(i);
        f.tileCore[t] = static_cast<int>(f.tileSources[t].size());
        if (effort.moreGeometry == 0 || !(middles[t] > 0)) return;
        addFurtherSources(f, static_cast<int>(i), middles[t]);
        if (!effort.mean) f.tileCore[t] = static_cast<int>(f.tileSources[t].size());
    });
    if (!effort.preferShown) {
        std::vector<char> wanted(f.sources.size(), 0);
        for (const auto& chosen : f.tileSources)
            for (const int k : chosen) wanted[static_cast<std::size_t>(k)] = 1;
        placeAll(f, wanted);
    }
    return f;
}

}  // namespace stx::surface
