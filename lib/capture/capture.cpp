#include "lib/capture/capture.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "lib/base/parallel.hpp"
#include "lib/capture/material_sampler.hpp"
#include "lib/model/depth_values.hpp"
#include "lib/model/splat_cloud.hpp"
#include "lib/model/strays.hpp"
#include "lib/model/view_checks.hpp"

namespace stx {
namespace {

/// `clipped` becomes true where a colour is brighter than white by a step or more.
Texture straightTexture(const Image<glm::vec4>& premultiplied, bool& clipped) {
    constexpr float kWhite = 1.0f + 1.0f / 255.0f;
    Rgba8Image image(premultiplied.width(), premultiplied.height());
    for (std::size_t i = 0; i < image.count(); ++i) {
        const glm::vec4 c = premultiplied.pixels()[i];
        if (!(c.w > 0.0f)) continue;
        const glm::vec3 bright = glm::vec3(c) / c.w;
        clipped = clipped || std::max({bright.x, bright.y, bright.z}) >= kWhite;
        const glm::vec3 straight = glm::clamp(bright, 0.0f, 1.0f);
        // Any coverage at all stays above 0, which means background.
        const float alpha = std::max(1.0f, std::round(std::min(c.w, 1.0f) * 255.0f));
        image.pixels()[i] =
            glm::u8vec4(glm::u8vec3(straight * 255.0f + 0.5f), static_cast<std::uint8_t>(alpha));
    }
    Texture texture(std::move(image));
    bleedColour(texture);
    return texture;
}

/// Which materials are blended and not opaque everywhere: by their factor, their texture or their
/// vertices' colours. Each texture is looked at once, however many materials share it.
std::vector<bool> translucentMaterials(const Mesh& mesh) {
    std::vector<std::optional<bool>> glass(mesh.textures.size());
    const auto isGlass = [&](int number) {
        std::optional<bool>& known = glass[static_cast<std::size_t>(number)];
        // What is there or not is a hole, not glass.
        if (!known)
            known =
                std::ranges::any_of(mesh.textures[static_cast<std::size_t>(number)].pixels.pixels(),
                                    [](glm::u8vec4 p) { return p.a > 0 && p.a < 255; });
        return *known;
    };
    std::vector<bool> translucent(mesh.materials.size());
    for (std::size_t i = 0; i < mesh.materials.size(); ++i) {
        const Material& m = mesh.materials[i];
        translucent[i] =
            m.alpha == Material::Alpha::blend &&
            (m.baseColour.a < 1.0f || (m.baseColourTexture >= 0 && isGlass(m.baseColourTexture)));
    }
    if (mesh.colours.empty()) return translucent;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const std::uint32_t material = mesh.triangleMaterial[i];
        if (mesh.materials[material].alpha != Material::Alpha::blend) continue;
        const auto& t = mesh.triangles[i];
        if (mesh.colours[t.x].a < 1.0f || mesh.colours[t.y].a < 1.0f || mesh.colours[t.z].a < 1.0f)
            translucent[material] = true;
    }
    return translucent;
}

/// "material 'a' is", "material 'a' and 2 more are": those of which `what` is true; empty without.
template <class What>
std::string materialsAre(const Mesh& mesh, const What& what) {
    std::string first;
    int count = 0;
    for (std::size_t i = 0; i < mesh.materials.size(); ++i) {
        if (!what(i)) continue;
        if (count++ == 0) first = mesh.materials[i].name;
    }
    if (count == 0) return {};
    return fmt::format("material '{}'{}", first,
                       count == 1   ? " is"
                       : count == 2 ? " and one more are"
                                    : fmt::format(" and {} more are", count - 1));
}

/// Says what becomes of glass: a view has one depth a pixel.
void noteTranslucent(const Mesh& mesh, Job& job) {
    const auto translucent = translucentMaterials(mesh);
    const auto which = materialsAre(mesh, [&](std::size_t i) { return translucent[i]; });
    if (which.empty()) return;
    job.note(which +
             " translucent: a pixel has the depth of the surface that shows most there; its colour "
             "mixes all of them, its alpha says how much they hide");
}

/// Says what views do not keep: that lights leave a colour as it is.
void noteUnlit(const Mesh& mesh, Job& job) {
    const auto which = materialsAre(mesh, [&](std::size_t i) { return mesh.materials[i].unlit; });
    if (which.empty()) return;
    job.note(which +
             " unlit (KHR_materials_unlit), which views do not keep: --light of stx render lights "
             "the colour like paint; drawn from the model itself it stays as it is");
}

}  // namespace

void fitDepthRange(ReferenceView& view) {
    const DepthSummary points = summariseDepth(view.depth.pixels());
    if (points.points == 0) return;
    float nearest = points.nearest, farthest = std::max(points.farthest, 0.0f);
    // A flat object facing the camera still needs a range.
    if (nearest == farthest) {
        const float slack = farthest > 0 ? farthest * 1e-4f : 1e-6f;
        nearest = std::max(0.0f, nearest - slack);
        farthest += slack;
    }
    view.nearPlane = nearest;
    view.farPlane = farthest;
    if (view.depthBits == 32) return;
    roundToCode(view.depth.pixels(), view.depthCode());
}

namespace {

/// What views of a cloud lose where half of what is behind it is seen: such pixels have no depth.
struct Faint {
    std::atomic<double> covered = 0, withoutDepth = 0;  ///< sums of alpha

    void add(const RasterImage& image) {
        double all = 0, without = 0;
        const auto colours = image.colour.pixels();
        const auto depths = image.depth.pixels();
        for (std::size_t i = 0; i < colours.size(); ++i) {
            all += colours[i].a;
            if (!hasPoint(depths[i])) without += colours[i].a;
        }
        covered += all;
        withoutDepth += without;
    }
    /// Clouds of a Gaussian for each texel lose 0.3 to 1.1 % so, at their outlines, in views of 64
    /// to 512 pixels; 60 blobs whose middles are half seen through, 36 %.
    void note(Job& job) const {
        constexpr double kWorthSaying = 0.05;  // of all that is covered
        if (withoutDepth > kWorthSaying * covered)
            job.note(
                fmt::format("{:.0f} % of what the splats cover lets half or more of what is behind "
                            "through and has no depth: novel views of the bundle lack it",
                            100 * withoutDepth / covered));
    }
};

Result<ReferenceView> capturedView(const Mesh& mesh, const Camera& camera, std::string name,
                                   const CaptureSettings& settings, Faint& faint, Job& job) {
    RasterSettings raster;
    raster.supersampling = settings.supersampling;
    raster.normals = settings.meshNormals;
    raster.materials = settings.materials;
    raster.lighting.beyondOne = true;
    STX_TRY(auto image, rasterise(mesh, camera, raster, job));
    image.code();
    if (mesh.splats) faint.add(image);
    ReferenceView view;
    view.name = std::move(name);
    view.camera = camera;
    view.depthBits = settings.depthBits;
    bool clipped = false;
    view.texture = straightTexture(image.colour, clipped);
    // Harmonics of splats lead beyond white now and then, and viewers of them clip.
    if (clipped && !mesh.splats)
        job.noteOnce("what gives off more light than white is white in views, which have 8 bits");
    view.depth = std::move(image.depth);
    view.normal = std::move(image.normal);
    view.metallicRoughness = std::move(image.metallicRoughness);
    view.emissive = std::move(image.emissive);
    fitDepthRange(view);
    return view;
}

}  // namespace

Result<ReferenceView> captureView(const Mesh& mesh, const Camera& camera, std::string name,
                                  const CaptureSettings& settings, Job& job) {
    Faint faint;
    return capturedView(mesh, camera, std::move(name), settings, faint, job);
}

namespace {

/// A mesh that is ready to be captured.
struct Subject {
    std::optional<Mesh> withoutStrays;  ///< where the mesh has some
    std::optional<Bounds> bounds;
    ViewImageKinds kinds;
};

/// Says what does not come with it. Errors: a mesh that fails check(), names, cameras.
Result<Subject> subjectOf(const Mesh& whole, const std::vector<Camera>& cameras,
                          const CaptureSettings& settings, Job& job) {
    STX_CHECK(whole.check());
    Subject subject;
    // A stray behind the object would take the range of its view's depth codes for itself.
    const auto strays = findStrays(whole);
    if (!strays.pieces.empty()) {
        subject.withoutStrays = whole;
        STX_CHECK(dropStrays(*subject.withoutStrays, strays, job.limits));
    }
    const Mesh& mesh = subject.withoutStrays ? *subject.withoutStrays : whole;
    noteTranslucent(mesh, job);
    if (!settings.names.empty() && settings.names.size() != cameras.size())
        return fail(ErrorCode::usage, "there are {} names for {} cameras", settings.names.size(),
                    cameras.size());
    if (auto named = checkNames({settings.names.begin(), settings.names.end()}); !named)
        return fail(ErrorCode::usage, "{}", named.error().message);
    for (const auto& c : cameras) STX_CHECK(c.check());
    subject.kinds.normal = settings.meshNormals;
    subject.kinds.metallicRoughness = settings.materials && hasMetallicRoughness(mesh);
    subject.kinds.emissive = settings.materials && emits(mesh);
    subject.bounds = strays.bounds;
    return subject;
}

void noteMaterials(const Mesh& mesh, const ViewImageKinds& kinds, const CaptureSettings& settings,
                   Job& job) {
    noteUnlit(mesh, job);
    if (settings.materials && !kinds.hasMaterial())
        job.note(
            "the model has neither metallic-roughness nor emissive materials; "
            "--materials has nothing to keep");
    if (kinds.emissive)
        job.note(
            "what gives off light has it in the emissive images alone, for engines; pictures by "
            "stx render are without it");
    else if (emits(mesh))
        job.note(
            "what gives off light has it in its colour, which --light of stx render dims like "
            "paint; drawn from the model itself it shines");
}

std::string nameOf(std::size_t view, const CaptureSettings& settings) {
    return settings.names.empty() ? fmt::format("view{:03}", view) : settings.names[view];
}

/// What a view has of the model.
enum class Sight {
    nothing,
    faint,  ///< splats, but nowhere one half of what is behind them is hidden: no depth
    points
};

Sight sightOf(const Mesh& mesh, const ReferenceView& view) {
    if (view.pointCount() > 0) return Sight::points;
    for (std::size_t i = 0; mesh.splats && i < view.depth.count(); ++i)
        if (view.texture.alpha(i) > 0) return Sight::faint;
    return Sight::nothing;
}

/// Says which views are left out.
void noteBlind(const std::vector<Sight>& sights, Job& job) {
    for (std::size_t i = 0; i < sights.size(); ++i) {
        if (sights[i] == Sight::points) continue;
        job.note(fmt::format("view {} sees {} and was left out", i,
                             sights[i] == Sight::nothing
                                 ? "nothing of the model"
                                 : "only splats that let half or more of what is behind them "
                                   "through, has no depth"));
    }
}

/// No camera sees the model.
Error blindError(const std::vector<Camera>& cameras, const std::vector<Sight>& sights) {
    if (std::ranges::find(sights, Sight::faint) != sights.end())
        return {ErrorCode::invalidInput,
                "the splats let half or more of what is behind them through wherever the cameras "
                "see them, so that no view has depth; stx render draws such a cloud, and views "
                "need one that is denser or more opaque",
                {}};
    // Pixels of the narrower side, which leave twelve to the object (ViewFraming::marginPixels):
    // what sees nothing then has another reason.
    constexpr int kLeastSide = 16;
    const auto tooSmall = [](const Camera& c) { return std::min(c.width, c.height) < kLeastSide; };
    if (std::ranges::all_of(cameras, tooSmall))
        return {ErrorCode::invalidInput,
                fmt::format("no pixel of the views meets the model: {}x{} pixels are too few; take "
                            "{}x{} or more",
                            cameras[0].width, cameras[0].height, kLeastSide, kLeastSide),
                {}};
    return {ErrorCode::invalidInput,
            fmt::format("{} the model; check the poses and units",
                        cameras.size() == 1
                            ? "the camera does not see"
                            : fmt::format("none of the {} cameras sees", cameras.size())),
            {}};
}

/// Memory of drawing a view, bytes for each pixel: its colours as floats, and what is kept of them.
constexpr std::uint64_t kDrawing = 24;

class CapturedViews : public ViewTable {
  public:
    CapturedViews(const Mesh& mesh, Bundle headers, std::vector<ViewImageKinds> kinds,
                  const CaptureSettings& settings, std::atomic<bool>& blind, Faint& faint)
        : ViewTable(std::move(headers), std::move(kinds), Planes::withPixels),
          mesh_(mesh),
          settings_(settings),
          blind_(blind),
          faint_(faint) {}

    std::uint64_t bytesToMake(std::size_t index) const override {
        return bytesOf(index) + kDrawing * pixelsOf(index);
    }
    /// All threads draw one view of a cloud: several at a time would need the memory of each.
    int mostAtOnce() const override { return mesh_.splats ? 1 : 0; }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job& job) const override {
        const ViewHeader& header = about().views[index];
        auto view = capturedView(mesh_, header.camera, header.name, settings_, faint_, job);
        if (!view) return tl::unexpected(view.error().at(fmt::format("view {}", index)));
        if (view->pointCount() == 0) {
            blind_ = true;
            return fail(ErrorCode::failed, "view {} sees nothing of the model", index);
        }
        return std::make_shared<ReferenceView>(std::move(*view));
    }

  private:
    const Mesh& mesh_;
    const CaptureSettings& settings_;
    std::atomic<bool>& blind_;
    Faint& faint_;
};

/// What the cameras see.
Result<std::vector<Sight>> sightsOf(const Mesh& mesh, const std::vector<Camera>& cameras,
                                    const CaptureSettings& settings, Job& job) {
    std::vector<Result<Sight>> sees(cameras.size());
    const auto look = [&](std::int64_t i) {
        const auto at = static_cast<std::size_t>(i);
        sees[at] = [&]() -> Result<Sight> {
            STX_TRY(const auto view, captureView(mesh, cameras[at], {}, settings, job));
            return sightOf(mesh, view);
        }();
    };
    const auto count = static_cast<std::int64_t>(cameras.size());
    if (mesh.splats)
        for (std::int64_t i = 0; i < count; ++i) look(i);
    else
        parallelFor(0, count, look);
    std::vector<Sight> sights;
    for (auto& sight : sees) {
        if (!sight) return propagate(sight);
        sights.push_back(*sight);
    }
    return sights;
}

}  // namespace

Result<Bundle> captureBundle(const Mesh& whole, const std::vector<Camera>& cameras,
                             const CaptureSettings& settings, Job& job) {
    STX_TRY(const auto subject, subjectOf(whole, cameras, settings, job));
    const Mesh& mesh = subject.withoutStrays ? *subject.withoutStrays : whole;
    std::uint64_t pixels = 0;
    for (const auto& c : cameras) pixels += static_cast<std::uint64_t>(c.width) * c.height;
    STX_CHECK(
        job.limits.checkAllocation(pixels, subject.kinds.bytesPerPixel(), "the reference views"));
    noteMaterials(mesh, subject.kinds, settings, job);

    const auto n = static_cast<std::int64_t>(cameras.size());
    std::vector<Result<ReferenceView>> views(n, ReferenceView());
    std::atomic<std::int64_t> done = 0;
    Faint faint;
    const auto capture = [&](std::int64_t i) {
        const auto at = static_cast<std::size_t>(i);
        views[i] = capturedView(mesh, cameras[at], nameOf(at, settings), settings, faint, job);
        job.progress(++done, n, "capturing views");
    };
    // All threads draw one view of a cloud: several views at a time would need the memory of each.
    if (mesh.splats)
        for (std::int64_t i = 0; i < n; ++i) capture(i);
    else
        parallelFor(0, n, capture);
    Bundle bundle;
    std::vector<Sight> sights;
    for (std::int64_t i = 0; i < n; ++i) {
        if (!views[i]) return tl::unexpected(views[i].error().at(fmt::format("view {}", i)));
        sights.push_back(sightOf(mesh, *views[i]));
        if (sights.back() == Sight::points) bundle.views.push_back(std::move(*views[i]));
    }
    noteBlind(sights, job);
    if (bundle.views.empty()) return tl::unexpected(blindError(cameras, sights));
    faint.note(job);
    bundle.origin = mesh.origin;
    bundle.bounds = subject.bounds;
    return bundle;
}

Result<void> withCapturedViews(
    const Mesh& whole, const std::vector<Camera>& cameras, const CaptureSettings& settings,
    Job& job, const std::function<Result<void>(std::unique_ptr<ViewTable> table, Job& job)>& use) {
    STX_TRY(const auto subject, subjectOf(whole, cameras, settings, job));
    const Mesh& mesh = subject.withoutStrays ? *subject.withoutStrays : whole;
    noteMaterials(mesh, subject.kinds, settings, job);
    std::vector<Sight> sights(cameras.size(), Sight::points);
    for (;;) {
        std::vector<std::size_t> numbers;
        for (std::size_t i = 0; i < sights.size(); ++i)
            if (sights[i] == Sight::points) numbers.push_back(i);
        if (numbers.empty()) return tl::unexpected(blindError(cameras, sights));
        Bundle headers;
        headers.origin = mesh.origin;
        headers.bounds = subject.bounds;
        for (const std::size_t i : numbers) {
            ReferenceView& view = headers.views.emplace_back();
            view.name = nameOf(i, settings);
            view.camera = cameras[i];
            view.depthBits = settings.depthBits;
        }
        std::atomic<bool> blind = false;
        Faint faint;
        Job part;
        part.workFor(job);
        part.onProgress = job.onProgress;
        auto done = use(
            std::make_unique<CapturedViews>(
                mesh, std::move(headers),
                std::vector<ViewImageKinds>(numbers.size(), subject.kinds), settings, blind, faint),
            part);
        if (!blind) {
            part.passNotesOn();
            faint.note(job);
            return done;
        }
        STX_CHECK(job.checkCancelled());
        Job quiet;
        quiet.workFor(job);
        STX_TRY(sights, sightsOf(mesh, cameras, settings, quiet));
        noteBlind(sights, job);
    }
}

namespace {

/// Splats that reach less far are framed by their centres, a share of the object's largest side:
/// one pixel of 512, half of what layouts keep free around the object. In a cloud of a Gaussian for
/// each texel of 512x512 (the amphora's) one in 27 reaches farther; at half of it nearly all would.
constexpr double kSmallReach = 2e-3;

/// What cameras frame of a splat: the tips of its reach, or its centre.
void addSplat(const Mesh& mesh, std::uint32_t splat, double small, std::vector<glm::vec3>& points) {
    const glm::vec3 centre = mesh.positions[splat];
    glm::mat3 reach(0.0f);
    if (mesh.splats->mostReach(splat) > small) reach = glm::mat3(mesh.splats->reach(splat));
    for (int k = 0; k < 3; ++k) {
        if (reach[k] == glm::vec3(0.0f)) continue;
        points.push_back(centre + reach[k]);
        points.push_back(centre - reach[k]);
    }
    if (reach == glm::mat3(0.0f)) points.push_back(centre);
}

}  // namespace

std::vector<glm::vec3> drawnPoints(const Mesh& mesh) {
    const auto strays = findStrays(mesh);
    std::size_t next = 0;
    const auto isStray = [&](std::uint64_t piece) {
        if (next == strays.pieces.size() || strays.pieces[next] != piece) return false;
        ++next;
        return true;
    };
    // Each corner once: a dense mesh has six triangles around each.
    std::vector<bool> corner(mesh.positions.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        if (isStray(i)) continue;
        for (int k = 0; k < 3; ++k) corner[mesh.triangles[i][k]] = true;
    }
    std::vector<glm::vec3> points;
    for (std::size_t i = 0; i < corner.size(); ++i)
        if (corner[i]) points.push_back(mesh.positions[i]);
    if (mesh.splats) {
        const glm::dvec3 size = strays.bounds.max - strays.bounds.min;
        const double small = kSmallReach * std::max({size.x, size.y, size.z});
        for (std::size_t i = 0; i < mesh.points.size(); ++i)
            if (!isStray(i)) addSplat(mesh, mesh.points[i], small, points);
        return points;
    }
    // Loose points are drawn as discs or balls, which must fit into the frame, too.
    const float radius = loosePoints(mesh).radius;
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        if (isStray(mesh.triangles.size() + i)) continue;
        const auto p = mesh.points[i];
        for (int axis = 0; axis < 3; ++axis) {
            glm::vec3 offset(0.0f);
            offset[axis] = radius;
            points.push_back(mesh.positions[p] + offset);
            points.push_back(mesh.positions[p] - offset);
        }
    }
    return points;
}

}  // namespace stx
