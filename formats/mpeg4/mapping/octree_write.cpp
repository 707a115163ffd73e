#include "formats/mpeg4/mapping/octree_write.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "formats/mpeg4/mapping/octree.hpp"
#include "formats/mpeg4/mapping/texture_images.hpp"
#include "lib/base/parallel_try.hpp"

namespace stx::mpeg4 {
namespace {

/// Points so close to a face of a voxel, in voxels, are taken to lie on it: those of an octree that
/// was read do, but for the rounding of depth codes.
constexpr double kOnFace = 0.1;
/// Neighbouring pixels show one surface when their points are no further apart than this many
/// pixels.
constexpr double kLinked = 4;
/// Voxels put between two neighbouring pixels at most.
constexpr int kMostBetween = 64;

struct OctreeSample {
    std::uint64_t code = 0;  ///< place of the voxel, its bits x y z in turn, x lowest
    glm::u8vec3 colour{0};
};

std::uint64_t spread(std::uint64_t v) {
    std::uint64_t out = 0;
    for (int bit = 0; bit < kMaxOctreeLevels; ++bit) out |= (v >> bit & 1) << (3 * bit);
    return out;
}
std::uint64_t codeOf(glm::ivec3 voxel) {
    return spread(static_cast<std::uint64_t>(voxel.x)) |
           spread(static_cast<std::uint64_t>(voxel.y)) << 1 |
           spread(static_cast<std::uint64_t>(voxel.z)) << 2;
}

/// Calls body(world point, pixel) for each pixel with a point, and for places between pixels of one
/// surface, closer than `voxel`.
template <class Body>
void forEachPoint(const ReferenceView& view, double voxel, Body body) {
    const Camera& c = view.camera;
    const int width = view.depth.width(), height = view.depth.height();
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (!hasPoint(view.depth.at(x, y))) continue;
            const auto pixel = static_cast<std::size_t>(y) * width + x;
            const glm::dvec3 p = view.worldPoint(x, y);
            body(p, pixel);
            const double step = (c.orthographic ? 1.0 : static_cast<double>(view.depth.at(x, y))) /
                                std::min(c.fx, c.fy);
            if (step <= voxel * (1 + 1e-6)) continue;
            if (x + 1 == width || y + 1 == height || !hasPoint(view.depth.at(x + 1, y)) ||
                !hasPoint(view.depth.at(x, y + 1)) || !hasPoint(view.depth.at(x + 1, y + 1)))
                continue;
            const glm::dvec3 right = view.worldPoint(x + 1, y), down = view.worldPoint(x, y + 1),
                             across = view.worldPoint(x + 1, y + 1);
            const double longest =
                std::max({glm::length(right - p), glm::length(down - p), glm::length(across - p),
                          glm::length(across - right), glm::length(across - down)});
            if (longest > kLinked * step || longest <= voxel) continue;
            const int n = std::min(kMostBetween, static_cast<int>(std::ceil(longest / voxel)));
            for (int j = 0; j <= n; ++j) {
                for (int i = 0; i <= n; ++i) {
                    const double u = static_cast<double>(i) / n, v = static_cast<double>(j) / n;
                    body(glm::mix(glm::mix(p, right, u), glm::mix(down, across, u), v),
                         pixel + (u < 0.5 ? 0 : 1) +
                             (v < 0.5 ? 0 : static_cast<std::size_t>(width)));
                }
            }
        }
    }
}

/// Where the cube lies.
struct Grid {
    glm::dvec3 corner{0.0};  ///< the lower one, in the world
    double side = 1, voxel = 1;
    bool onFaces = false;  ///< points may lie on faces of voxels

    /// The voxel of a point, from the corner on. Of the two at a face, a ray along `direction`
    /// meets the one behind it.
    [[nodiscard]] glm::dvec3 placeOf(glm::dvec3 p, glm::dvec3 direction) const {
        const glm::dvec3 at = (p - corner) / voxel;
        glm::dvec3 place = glm::floor(at);
        if (!onFaces) return place;
        const glm::dvec3 off = glm::abs(at - glm::round(at));
        int face = -1;
        for (int axis = 0; axis < 3; ++axis)
            if (std::abs(direction[axis]) > 1e-6 && off[axis] < kOnFace &&
                (face < 0 || off[axis] < off[face]))
                face = axis;
        if (face >= 0) place[face] = std::round(at[face]) - (direction[face] < 0 ? 1 : 0);
        return place;
    }
};

/// The grid of an octree that we wrote: pictures have a pixel a voxel, and the stated bounds end
/// with voxels.
std::optional<Grid> gridOfPictures(const Bundle& bundle, int resolution) {
    if (!bundle.bounds || bundle.bounds->empty()) return {};
    const double f = bundle.views[0].camera.fx;
    for (const ReferenceView& view : bundle.views)
        if (std::abs(view.camera.fx / f - 1) > 1e-5 || std::abs(view.camera.fy / f - 1) > 1e-5)
            return {};
    const glm::dvec3 size = bundle.bounds->max - bundle.bounds->min;
    const glm::dvec3 count = glm::round(size * f);
    // Coarser voxels than were asked for are no octree of so many levels.
    if (std::max({count.x, count.y, count.z}) * 2 <= resolution) return {};
    for (int axis = 0; axis < 3; ++axis)
        if (count[axis] < 1 || count[axis] > resolution ||
            std::abs(size[axis] * f - count[axis]) > 0.01)
            return {};
    Grid grid;
    grid.voxel = 1 / f;
    grid.side = resolution * grid.voxel;
    grid.onFaces = true;
    grid.corner =
        bundle.bounds->min - glm::floor((glm::dvec3(resolution) - count) / 2.0) * grid.voxel;
    return grid;
}

/// A cube whose side is a power of two and whose voxels begin at multiples of their side: the
/// unit cube for octrees of others that lie in it and are no smaller than a quarter of it.
Grid gridOfPowersOfTwo(const Bundle& bundle, double extent, int resolution) {
    Grid grid;
    grid.onFaces = true;
    // Faces of voxels that were read may lie a rounding outside.
    grid.side = std::exp2(std::ceil(std::log2(extent * (1 - 1e-4))));
    if (grid.side > 0.25) grid.side = std::max(grid.side, 1.0);
    for (;; grid.side *= 2) {
        grid.voxel = grid.side / resolution;
        grid.corner = glm::dvec3(0);
        Bounds used;
        for (const ReferenceView& view : bundle.views)
            for (int y = 0; y < view.depth.height(); ++y)
                for (int x = 0; x < view.depth.width(); ++x)
                    if (hasPoint(view.depth.at(x, y)))
                        used.add(grid.placeOf(view.worldPoint(x, y), view.camera.forward()));
        const glm::dvec3 low = used.min, high = used.max + 1.0;
        const glm::dvec3 room = static_cast<double>(resolution) - (high - low);
        if (room.x < 0 || room.y < 0 || room.z < 0) continue;
        const glm::dvec3 unit(-resolution / 2.0);
        const bool inUnit = grid.side == 1.0 && resolution > 1 &&
                            glm::all(glm::greaterThanEqual(low, unit)) &&
                            glm::all(glm::lessThanEqual(high, -unit));
        grid.corner = (inUnit ? unit : low - glm::floor(room / 2.0)) * grid.voxel;
        return grid;
    }
}

Result<Grid> gridOf(const Bundle& bundle, int resolution) {
    const Bounds points = bundle.computeBounds();
    if (points.empty()) return fail(ErrorCode::invalidInput, "the bundle has no point");
    const glm::dvec3 size = points.max - points.min;
    double extent = std::max({size.x, size.y, size.z});
    const double furthest = std::max(glm::length(points.min), glm::length(points.max));
    if (!(extent > 0)) extent = furthest > 0 ? furthest * 1e-3 : 1;
    if (!(furthest / extent * resolution < 1e14))
        return fail(ErrorCode::unsupported,
                    "the object is too small for its distance from the origin to be cut into {} "
                    "voxels",
                    resolution);
    const bool orthographic =
        std::all_of(bundle.views.begin(), bundle.views.end(),
                    [](const ReferenceView& view) { return view.camera.orthographic; });
    if (orthographic) {
        if (const auto grid = gridOfPictures(bundle, resolution)) return *grid;
        return gridOfPowersOfTwo(bundle, extent, resolution);
    }
    Grid grid;
    grid.voxel = extent / (resolution - 1);
    grid.side = grid.voxel * resolution;
    grid.corner = points.min - (glm::dvec3(grid.side) - size) * 0.5;
    return grid;
}

/// Samples of one voxel become one, of their mean colour.
void unite(std::vector<OctreeSample>& samples) {
    std::sort(samples.begin(), samples.end(),
              [](const OctreeSample& a, const OctreeSample& b) { return a.code < b.code; });
    std::size_t out = 0;
    for (std::size_t i = 0; i < samples.size();) {
        glm::vec<3, std::uint64_t> sum(0);
        std::size_t j = i;
        for (; j < samples.size() && samples[j].code == samples[i].code; ++j)
            sum += glm::vec<3, std::uint64_t>(samples[j].colour);
        const std::uint64_t count = j - i;
        samples[out++] = {samples[i].code, glm::u8vec3((sum + count / 2) / count)};
        i = j;
    }
    samples.resize(out);
}

std::vector<std::int32_t> treeOf(const std::vector<OctreeSample>& voxels, int levels) {
    std::vector<std::int32_t> bytes;
    for (int level = 0; level < levels; ++level) {
        const int shift = 3 * (levels - level);
        std::uint64_t last = ~std::uint64_t{0};
        for (const OctreeSample& voxel : voxels) {
            if (voxel.code >> shift != last) bytes.push_back(0);
            last = voxel.code >> shift;
            bytes.back() |= 1 << (voxel.code >> (shift - 3) & 7);
        }
    }
    return bytes;
}

/// The orthographic camera along a view's axis that sees the used voxels, a pixel a voxel.
Result<Camera> cameraAlong(const Camera& view, glm::ivec3 first, glm::ivec3 last, int resolution,
                           int maxSide) {
    const double n = resolution;
    const glm::dmat3 axes = glm::mat3_cast(view.orientation);
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 p =
            glm::dvec3(corner & 1 ? last.x + 1 : first.x, corner & 2 ? last.y + 1 : first.y,
                       corner & 4 ? last.z + 1 : first.z) /
                n -
            0.5;
        const glm::dvec3 local = p * axes;  // right, up, back
        low = glm::min(low, local);
        high = glm::max(high, local);
    }
    const glm::dvec2 size = glm::ceil(glm::dvec2(high - low) * n - 1e-6);
    if (size.x > maxSide || size.y > maxSide)
        return fail(ErrorCode::unsupported,
                    "a picture of the voxels has {:g}x{:g} pixels; at most {} on a side are "
                    "possible (take fewer levels)",
                    size.x, size.y, maxSide);
    Camera c;
    c.orthographic = true;
    c.width = std::max(1, static_cast<int>(size.x));
    c.height = std::max(1, static_cast<int>(size.y));
    c.fx = c.fy = n;
    c.cx = c.width * 0.5;
    c.cy = c.height * 0.5;
    c.orientation = view.orientation;
    c.position = axes * glm::dvec3((low.x + high.x) / 2, (low.y + high.y) / 2, high.z + 1);
    return c;
}

/// Colour of the first voxel behind the centre of a pixel; nothing where there is none.
std::optional<glm::u8vec3> colourBehind(const Camera& camera, int x, int y, const Octree& octree,
                                        const std::vector<OctreeSample>& voxels) {
    glm::ivec3 voxel(0);
    const glm::dvec3 origin =
        camera.position + camera.orientation * camera.unproject(x + 0.5, y + 0.5, 0.0);
    if (!(octree.firstHit(origin, camera.forward(), &voxel) < kNoDepth)) return {};
    const std::uint64_t code = codeOf(voxel);
    const auto found = std::lower_bound(
        voxels.begin(), voxels.end(), code,
        [](const OctreeSample& sample, std::uint64_t wanted) { return sample.code < wanted; });
    if (found == voxels.end() || found->code != code) return {};
    return found->colour;
}

Rgba8Image pictureOf(const Camera& camera, const Octree& octree,
                     const std::vector<OctreeSample>& voxels, const Job& job) {
    Rgba8Image picture(camera.width, camera.height, glm::u8vec4(0));
    for (int y = 0; y < camera.height && !job.cancelled; ++y)
        for (int x = 0; x < camera.width; ++x)
            if (const auto colour = colourBehind(camera, x, y, octree, voxels))
                picture.at(x, y) = glm::u8vec4(*colour, 255);
    Texture texture(std::move(picture));
    bleedColour(texture);
    return std::move(*texture.rgba8());
}

/// Voxels reach past silhouettes, where a picture may have any colour under alpha 0: it gets
/// theirs.
void colourPastSilhouettes(OctreeParts::Picture& picture, const Octree& octree,
                           const std::vector<OctreeSample>& voxels, const Job& job) {
    for (int y = 0; y < picture.camera.height && !job.cancelled; ++y) {
        for (int x = 0; x < picture.camera.width; ++x) {
            glm::u8vec4& pixel = picture.colour.at(x, y);
            if (pixel.a > 0) continue;
            if (const auto colour = colourBehind(picture.camera, x, y, octree, voxels))
                pixel = glm::u8vec4(*colour, 255);
        }
    }
}

}  // namespace

Result<OctreeParts> octreeFromBundle(const Bundle& bundle, int levels, Job& job) {
    if (levels < 1 || levels > kMaxOctreeLevels)
        return fail(ErrorCode::usage, "an octree of {} levels; 1 to {} are possible", levels,
                    kMaxOctreeLevels);
    STX_CHECK(bundle.check());
    const int resolution = 1 << levels;
    STX_TRY(const Grid grid, gridOf(bundle, resolution));
    std::uint64_t count = 0;
    for (const ReferenceView& view : bundle.views)
        forEachPoint(view, grid.voxel, [&](glm::dvec3, std::size_t) { ++count; });
    if (auto ok =
            job.limits.checkAllocation(count, sizeof(OctreeSample),
                                       fmt::format("an octree of {} levels (take fewer)", levels));
        !ok)
        return propagate(ok);
    std::vector<OctreeSample> samples;
    samples.reserve(count);
    std::vector<Rgba8Image> colours;
    glm::ivec3 first(resolution), last(-1);
    for (const ReferenceView& view : bundle.views) {
        STX_CHECK(job.checkCancelled());
        bool clamped = false;
        colours.push_back(rgba8FromTexture(view.texture, clamped));
        const Rgba8Image& colour = colours.back();
        forEachPoint(view, grid.voxel, [&](glm::dvec3 p, std::size_t pixel) {
            const glm::ivec3 voxel = glm::clamp(glm::ivec3(grid.placeOf(p, view.camera.forward())),
                                                glm::ivec3(0), glm::ivec3(resolution - 1));
            first = glm::min(first, voxel);
            last = glm::max(last, voxel);
            samples.push_back({codeOf(voxel), glm::u8vec3(colour.pixels()[pixel])});
        });
    }
    unite(samples);

    OctreeParts parts;
    parts.resolution = resolution;
    parts.side = grid.side;
    parts.centre = grid.corner + grid.side / 2;
    parts.used.min = grid.corner + glm::dvec3(first) * grid.voxel;
    parts.used.max = grid.corner + glm::dvec3(last + 1) * grid.voxel;
    parts.voxels = static_cast<std::int64_t>(samples.size());
    parts.octree = treeOf(samples, levels);
    STX_TRY(const auto octree, Octree::parse(parts.octree, parts.resolution, job.limits));
    parts.pictures.resize(bundle.views.size());
    STX_CHECK(parallelTry(0, bundle.views.size(), [&](std::size_t at) -> Result<void> {
        const ReferenceView& view = bundle.views[at];
        OctreeParts::Picture& picture = parts.pictures[at];
        picture.name = view.name;
        if (view.camera.orthographic) {
            picture.camera = view.camera;
            picture.camera.position = (view.camera.position - parts.centre) / parts.side;
            picture.camera.fx *= parts.side;
            picture.camera.fy *= parts.side;
            picture.colour = std::move(colours[at]);
            colourPastSilhouettes(picture, octree, samples, job);
            return {};
        }
        STX_TRY(picture.camera,
                cameraAlong(view.camera, first, last, resolution, job.limits.maxImageSide));
        picture.colour = pictureOf(picture.camera, octree, samples, job);
        return {};
    }));
    STX_CHECK(job.checkCancelled());
    return parts;
}

}  // namespace stx::mpeg4
