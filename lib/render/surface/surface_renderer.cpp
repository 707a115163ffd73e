#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "lib/base/parallel.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/render/compose/behind.hpp"
#include "lib/render/outline/round_outlines.hpp"
#include "lib/render/surface/backend.hpp"
#include "lib/render/surface/fill/fill.hpp"
#include "lib/render/surface/missing_normals.hpp"
#include "lib/render/surface/view_normals.hpp"
#include "lib/surface/depth_gradient.hpp"

namespace stx::surface {
namespace {

// Chosen by trial on the project's image sets.
/// Views with depth for less of the object than this have no picture of their own to give back.
constexpr double kLeastValidShare = 0.9;
/// Scenes fill the frame when this share of the views' borders is covered.
constexpr double kFilledBorder = 0.5;
/// Points are exact whose depth has steps of no more than this share of a pixel's size.
constexpr double kExactStep = 0.25;
/// Holes that no view looks into are filled up to this width, pixels: what is wider may be a gap
/// between parts that too few views look through.
constexpr int kWidestHole = 48;

class SurfaceRenderer final : public Renderer {
  public:
    SurfaceRenderer(const PageSet& set, const RenderSettings& settings, Job& job,
                    std::unique_ptr<SurfaceBackend> backend)
        : scene_(set, settings),
          settings_(settings),
          effort_(effortOf(settings, scene_)),
          job_(job),
          bounds_(boundsOf(scene_)),
          backend_(std::move(backend)) {
        double border = 0;
        for (Source& s : scene_.sources) {
            border += borderCoverage(s) / static_cast<double>(scene_.sources.size());
            s.freeLevel = effort_.freeLevel;
        }
        fillsFrame_ = border > kFilledBorder;
        const bool open = std::any_of(scene_.sources.begin(), scene_.sources.end(),
                                      [](const Source& s) { return s.hasAlpha; });
        if (open && settings.does(Stage::outlines) && pointsAreExact())
            outlines_.emplace(scene_.set);
        if (settings.wantNormals()) findNormals();
    }

    [[nodiscard]] Result<Frame> render(const Camera& camera) override;
    void expect(const Camera& next) override {
        if (backend_->drawsAhead()) expected_ = next;
    }
    void averagedBy(int factor) override { averagedBy_ = factor; }
    [[nodiscard]] std::string backend() const override { return backend_->name(); }
    [[nodiscard]] std::string device() const override { return backend_->device(); }
    [[nodiscard]] Result<void> prepareBackend() { return backend_->prepare(scene_, effort_, job_); }
    /// What is drawn where this renderer's views show nothing.
    [[nodiscard]] std::unique_ptr<SurfaceRenderer>& behind() { return behind_; }

  private:
    /// Whether the outermost points lie at the outline: those of faulty depth and of coarse depth
    /// codes lie beyond it.
    [[nodiscard]] bool pointsAreExact() const;
    void findNormals();
    /// Unit world normal of a source at pixel position (u, v); zero where it has none.
    [[nodiscard]] glm::vec3 normalAt(const Source& source, float u, float v) const;
    /// The same of all pixels of a frame; see DrawnFrame::origin.
    void normalsAt(const SurfaceFrame& work, const Image<glm::vec3>& origin,
                   Image<glm::vec3>& normal) const;
    [[nodiscard]] std::unique_ptr<SurfaceFrame> plan(const Camera& camera) const {
        const StageTimer timer(settings_.log.get(), "plan");
        auto frame = std::make_unique<SurfaceFrame>(planFrame(scene_, bounds_, effort_, camera));
        frame->wantOrigin = settings_.wantNormals();
        return frame;
    }
    /// The plan of a frame, which has begun, perhaps since the last call.
    [[nodiscard]] Result<std::unique_ptr<SurfaceFrame>> beginFrame(const Camera& camera);
    /// Starts the frame that is expected next.
    void beginExpected(const std::optional<Camera>& next);
    [[nodiscard]] Result<void> checkSize(const Camera& camera) const {
        STX_CHECK(camera.check());
        return job_.limits.checkAllocation(static_cast<std::uint64_t>(camera.width) * camera.height,
                                           sizeof(glm::vec4) + 2 * sizeof(float), "the frame");
    }
    [[nodiscard]] Result<void> drawFrame(const Camera& camera, const std::optional<Camera>& next,
                                         Frame& frame);
    /// What the backend drew: colours, q, and normals when they are wanted.
    [[nodiscard]] Result<void> collect(const SurfaceFrame& work, Frame& frame, Image<float>& q);
    /// Closes holes, or fills what is around.
    void fill(const SurfaceFrame& work, Frame& frame, Image<float>& q);
    /// Not what is behind all that has a depth.
    [[nodiscard]] bool showsMeasured() const { return !(scene_.set.farAway() > 0); }
    /// Draws what is behind where a frame is open.
    [[nodiscard]] Result<void> drawBehind(SurfaceRenderer& behind, const SurfaceFrame& work,
                                          Frame& frame, Image<float>& q);
    /// Those pixels of a frame, and perhaps others; its depth, too.
    [[nodiscard]] Result<Frame> drawPixels(const Camera& camera, std::vector<TilePixels> wanted);
    /// The view that is exactly the camera's, whose picture is its own pixels; -1 = none.
    [[nodiscard]] int viewAt(const Camera& camera) const;
    [[nodiscard]] Frame copyOf(const Source& source) const;
    void light(const Camera& camera, Frame& frame) const;

    SurfaceScene scene_;
    RenderSettings settings_;
    Effort effort_;
    Job& job_;
    Bounds bounds_;
    /// By page: of views that bring no normals, when frames want them.
    std::vector<Image<glm::vec3>> normals_;
    bool fillsFrame_ = false;
    int averagedBy_ = 1;
    std::optional<Outlines> outlines_;  ///< where points are exact enough to tell
    std::optional<Camera> expected_;
    std::unique_ptr<SurfaceFrame> begun_;  ///< under way before it was asked for
    std::unique_ptr<SurfaceBackend> backend_;
    std::unique_ptr<SurfaceRenderer> behind_;  ///< may be null
};

Image<float> depthOf(Image<float> q, const DepthAxis& axis) {
    parallelForBlocks(
        0, static_cast<std::int64_t>(q.count()), 1 << 16, [&](std::int64_t from, std::int64_t to) {
            for (std::int64_t i = from; i < to; ++i) {
                float& value = q.data()[i];
                value = value > 0.0f ? static_cast<float>(axis.dist(value)) : kNoDepth;
            }
        });
    return q;
}

/// A pixel whose place is a guess, and its q.
struct Guessed {
    std::size_t pixel;
    float q;  ///< 0 = far away
};

/// Gives all pixels that had another q before the q of what is farthest else: holes beside them are
/// filled from what is measured, and sources know nothing beyond that. What is below `limit` is far
/// away.
std::vector<Guessed> putFarthest(const Image<float>& before, float limit, Image<float>& q) {
    std::vector<Guessed> guessed;
    float farthest = std::numeric_limits<float>::max();
    for (std::size_t i = 0; i < q.count(); ++i) {
        const float value = q.data()[i];
        if (value != before.data()[i])
            guessed.push_back({i, value < limit ? 0.0f : value});
        else if (value > 0.0f)
            farthest = std::min(farthest, value);
    }
    if (farthest < std::numeric_limits<float>::max())
        for (const Guessed& g : guessed) q.data()[g.pixel] = farthest;
    return guessed;
}

bool SurfaceRenderer::pointsAreExact() const {
    const auto isFine = [&](const Source& s) {
        const Camera& camera = s.space.camera;
        const double dist = glm::dot(bounds_.centre() - camera.position, camera.forward());
        const auto pixel = camera.sampleSpacing(std::max(dist, 0.1 * bounds_.radius()));
        return s.step <= kExactStep * std::min(pixel.x, pixel.y);
    };
    return scene_.set.exactDepth() &&
           std::all_of(scene_.sources.begin(), scene_.sources.end(), isFine);
}

void SurfaceRenderer::findNormals() {
    normals_.resize(scene_.pages.size());
    // Views of an atlas share pages.
    for (std::size_t i = 0; i < scene_.sources.size(); ++i) {
        if (scene_.sources[i].view->hasNormals || scene_.sources[i].view->unread) continue;
        for (const PageRectangle& r : scene_.set.rectanglesOf(i)) {
            const auto page = static_cast<std::size_t>(r.page);
            if (!normals_[page].empty()) continue;
            normals_[page] = Image<glm::vec3>(scene_.pages[page].q.width(),
                                              scene_.pages[page].q.height(), glm::vec3(0.0f));
            normals_[page].moveTo(scene_.set.spool());
        }
    }
    const auto ofView = [&](std::size_t i) {
        const ReferenceView view = scene_.set.copyOfView(i);
        DepthSurface surface = depthSurface(view, {});
        continueSlopes(view.camera, surface);  // as in baked views
        const glm::dmat3 worldFromCamera = glm::mat3_cast(view.camera.orientation);
        for (const PageRectangle& r : scene_.set.rectanglesOf(i)) {
            const auto page = static_cast<std::size_t>(r.page);
            // A whole view has no padding: the clipped range is the rectangle.
            const int x0 = std::max(r.x0 - PageSet::kPadding, 0);
            const int x1 = std::min(r.x1 + PageSet::kPadding, view.camera.width);
            const int y0 = std::max(r.y0 - PageSet::kPadding, 0);
            const int y1 = std::min(r.y1 + PageSet::kPadding, view.camera.height);
            parallelForBlocks(y0, y1, 32, [&](std::int64_t from, std::int64_t to) {
                for (int y = static_cast<int>(from); y < to; ++y)
                    for (int x = x0; x < x1; ++x)
                        if (hasPoint(view.depth.at(x, y)))
                            normals_[page].data()[r.texel(x, y)] = glm::vec3(
                                worldFromCamera * planeNormal(view.camera, x, y, surface.w.at(x, y),
                                                              surface.gradient.at(x, y)));
            });
        }
    };
    // Several at once: half of each is done by one thread.
    parallelFor(0, static_cast<std::int64_t>(scene_.sources.size()), [&](std::int64_t n) {
        const auto i = static_cast<std::size_t>(n);
        if (!scene_.sources[i].view->hasNormals && !scene_.sources[i].view->unread) ofView(i);
    });
}

glm::vec3 SurfaceRenderer::normalAt(const Source& source, float u, float v) const {
    const float fu = std::floor(u - 0.5f), fv = std::floor(v - 0.5f);
    const int x0 = static_cast<int>(fu), y0 = static_cast<int>(fv);
    glm::vec3 sum(0.0f);
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) {
            if (!source.contains(x0 + i, y0 + j)) continue;
            const Place place = source.placeOf(x0 + i, y0 + j);
            if (!place.page) continue;
            const auto page = static_cast<std::size_t>(place.page - scene_.pages.data());
            const Image<glm::vec3>& normals =
                source.view->hasNormals ? *scene_.set.pages()[page].normal : normals_[page];
            const float tu = u - 0.5f - fu, tv = v - 0.5f - fv;
            sum += (i ? tu : 1 - tu) * (j ? tv : 1 - tv) * normals.data()[place.texel(0, 0)];
        }
    }
    const float length = glm::length(sum);
    return length > 1e-6f ? sum / length : glm::vec3(0.0f);
}

int SurfaceRenderer::viewAt(const Camera& camera) const {
    // Its pixels do not all have a place and a normal to be lit at: outlines would glow.
    if (settings_.lighting.on()) return -1;
    for (std::size_t i = 0; i < scene_.sources.size(); ++i) {
        const Source& s = scene_.sources[i];
        const bool complete =
            s.whole && !s.view->pruned ? s.validShare >= kLeastValidShare : s.validShare >= 1.0;
        if (complete && sameCamera(s.view->camera, camera)) return static_cast<int>(i);
    }
    return -1;
}

Frame SurfaceRenderer::copyOf(const Source& source) const {
    const Camera& camera = source.view->camera;
    Frame frame;
    if (settings_.wantNormals())
        frame.normal = Image<glm::vec3>(camera.width, camera.height, glm::vec3(0.0f));
    frame.colour = Image<glm::vec4>(camera.width, camera.height, glm::vec4(0.0f));
    frame.depth = Image<float>(camera.width, camera.height, kNoDepth);
    for (const PageRectangle& r : scene_.set.rectanglesOf(source.number)) {
        const auto number = static_cast<std::size_t>(r.page);
        const Page& page = scene_.set.pages()[number];
        const auto* normals = source.view->hasNormals ? page.normal
                              : normals_.empty()      ? nullptr
                                                      : &normals_[number];
        // Its own colours, not those that were matched to other views.
        const Texture& texture = scene_.set.captured(number);
        const auto* bytes = texture.rgba8();
        parallelForBlocks(r.y0, r.y1, 32, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y) {
                for (int x = r.x0; x < r.x1; ++x) {
                    const std::size_t texel = r.texel(x, y);
                    const glm::vec4 c = bytes ? glm::vec4(bytes->data()[texel]) * (1.0f / 255.0f)
                                              : texture.rgbaFloat()->data()[texel];
                    frame.colour.at(x, y) = glm::vec4(glm::vec3(c) * c.a, c.a);
                    frame.depth.at(x, y) = page.depth->data()[texel];
                    if (!frame.normal.empty()) frame.normal.at(x, y) = normals->data()[texel];
                }
            }
        });
    }
    return frame;
}

void SurfaceRenderer::light(const Camera& camera, Frame& frame) const {
    const StageTimer timer(settings_.log.get(), "light");
    const int width = frame.colour.width(), height = frame.colour.height();
    const Lighting lighting =
        lightsInWorld(settings_.lighting, lightPose(camera).worldFromCamera());
    const glm::dmat3 worldFromCamera = glm::mat3_cast(camera.orientation);
    borrowNormals(camera, frame);
    parallelForBlocks(0, height, 16, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y) {
            for (int x = 0; x < width; ++x) {
                const float dist = frame.depth.at(x, y);
                glm::vec4& pixel = frame.colour.at(x, y);
                if (!hasPoint(dist) || !(pixel.a > 0.0f)) continue;
                const glm::vec3 toEye(-camera.viewDirection(x + 0.5, y + 0.5));
                glm::vec3& normal = frame.normal.at(x, y);
                // What was filled may have none far and wide.
                if (normal == glm::vec3(0.0f)) normal = toEye;
                const glm::dvec3 world =
                    camera.position + worldFromCamera * camera.unproject(x + 0.5, y + 0.5, dist);
                const glm::vec3 lit = shadePhong(lighting, glm::vec3(pixel) / pixel.a,
                                                 glm::vec3(world), normal, toEye, frame.linear);
                pixel = glm::vec4(lit * pixel.a, pixel.a);
            }
        }
    });
}

Result<std::unique_ptr<SurfaceFrame>> SurfaceRenderer::beginFrame(const Camera& camera) {
    if (auto begun = std::exchange(begun_, nullptr)) {
        if (begun->space.camera == camera) return begun;
        backend_->drop();
    }
    auto frame = plan(camera);
    STX_CHECK(backend_->begin(*frame));
    return frame;
}

void SurfaceRenderer::beginExpected(const std::optional<Camera>& next) {
    if (!next || begun_ || !checkSize(*next) || viewAt(*next) >= 0) return;
    auto frame = plan(*next);
    // What fails here fails again, with a message, when the frame is asked for.
    if (backend_->begin(*frame)) begun_ = std::move(frame);
}

Result<void> SurfaceRenderer::drawFrame(const Camera& camera, const std::optional<Camera>& next,
                                        Frame& frame) {
    STX_TRY(const std::unique_ptr<SurfaceFrame> work, beginFrame(camera));
    const PixelSpace& space = work->space;
    beginExpected(next);
    Image<float> q;
    {
        const StageTimer timer(settings_.log.get(), "draw");
        STX_CHECK(collect(*work, frame, q));
    }
    std::vector<Guessed> guessed;
    for (SurfaceRenderer* b = behind_.get(); b; b = b->behind_.get()) {
        if (b->showsMeasured()) {
            STX_CHECK(drawBehind(*b, *work, frame, q));
            continue;
        }
        const Image<float> before = q;
        STX_CHECK(drawBehind(*b, *work, frame, q));
        const double limit = space.axis.q(0.5 * b->scene_.set.farAway());
        guessed = putFarthest(before, static_cast<float>(limit), q);
    }
    fill(*work, frame, q);
    for (const Guessed& g : guessed) q.data()[g.pixel] = g.q;
    frame.depth = depthOf(std::move(q), space.axis);
    if (outlines_ && !behind_)
        finishStage(settings_.log.get(), "outlines", frame.colour,
                    [&] { cutRoundOutlines(*outlines_, camera, frame); });
    return {};
}

void SurfaceRenderer::fill(const SurfaceFrame& work, Frame& frame, Image<float>& q) {
    const PixelSpace& space = work.space;
    std::vector<LocalSource> all;
    for (const FrameSource& f : work.sources) all.push_back({f.source, f.sourceFromPixel, nullptr});
    if (fillsFrame_ && settings_.fill != Fill::none) {
        if (!settings_.does(Stage::surroundings)) return;
        // Cameras of the background looked, too.
        if (behind_ && behind_->showsMeasured())
            for (const Source& s : behind_->scene_.sources)
                all.push_back(
                    {&s, warpFrom(s.space.pixelFromWorld * space.worldFromPixel), nullptr});
        finishStage(settings_.log.get(), "surroundings", frame.colour, [&] {
            fillBackground({frame.colour, q, space}, all, averagedBy_);
        });
    } else if (settings_.does(Stage::holes)) {
        finishStage(settings_.log.get(), "holes", frame.colour, [&] {
            fillUnseen({frame.colour, q, space, frame.normal.empty() ? nullptr : &frame.normal,
                        bounds_.radius()},
                       all, settings_.fill == Fill::none ? 0 : kWidestHole);
        });
    }
}

Result<void> SurfaceRenderer::drawBehind(SurfaceRenderer& behind, const SurfaceFrame& work,
                                         Frame& frame, Image<float>& q) {
    const PixelSpace& space = work.space;
    const int width = frame.colour.width(), height = frame.colour.height();
    std::vector<TilePixels> wanted(static_cast<std::size_t>(work.tiles.count()), TilePixels{});
    bool any = false;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (frame.colour.at(x, y).a >= kCoveredInFull) continue;
            const int number = work.tiles.at({x, y});
            TilePixels& tile = wanted[static_cast<std::size_t>(number)];
            any = true;
            // What was measured may hide what is beside the open pixels, too.
            if (behind.showsMeasured())
                tile.fill(~0u);
            else
                tile[static_cast<std::size_t>(y - work.tiles.y(number))] |=
                    1u << (x - work.tiles.x(number));
        }
    }
    if (!any) return {};
    const StageTimer timer(settings_.log.get(), "behind");
    STX_TRY(const Frame background, behind.drawPixels(space.camera, std::move(wanted)));
    const Image<float> before = depthOf(q, space.axis);
    frame.depth = before;
    putBehind(frame, background, [&](int x, int y, float depth) {
        const auto at = static_cast<float>(space.axis.q(depth));
        return behind.showsMeasured() &&
               std::none_of(work.sources.begin(), work.sources.end(), [&](const FrameSource& f) {
                   return seesPast({f.source, f.sourceFromPixel}, static_cast<float>(x) + 0.5f,
                                   static_cast<float>(y) + 0.5f, at);
               });
    });
    for (std::size_t i = 0; i < q.count(); ++i) {
        const float depth = frame.depth.data()[i];
        if (depth == before.data()[i]) continue;
        q.data()[i] = hasPoint(depth) ? static_cast<float>(space.axis.q(depth)) : 0.0f;
    }
    return {};
}

Result<Frame> SurfaceRenderer::drawPixels(const Camera& camera, std::vector<TilePixels> wanted) {
    auto work = plan(camera);
    keepPixels(*work, std::move(wanted));
    STX_CHECK(backend_->begin(*work));
    Frame frame;
    Image<float> q;
    STX_CHECK(collect(*work, frame, q));
    frame.depth = depthOf(std::move(q), work->space.axis);
    return frame;
}

void SurfaceRenderer::normalsAt(const SurfaceFrame& work, const Image<glm::vec3>& origin,
                                Image<glm::vec3>& normal) const {
    std::vector<ViewNormals> views(work.sources.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
        const Source& s = *work.sources[i].source;
        if (!s.whole) continue;
        const auto page = static_cast<std::size_t>(s.whole - scene_.pages.data());
        views[i] = {(s.view->hasNormals ? *scene_.set.pages()[page].normal : normals_[page]).data(),
                    s.width, s.height};
    }
    parallelForBlocks(
        0, static_cast<std::int64_t>(origin.count()), 4096,
        [&](std::int64_t from, std::int64_t to) {
            const auto first = static_cast<std::size_t>(from), end = static_cast<std::size_t>(to);
            if (normalsBetween(origin.pixels().subspan(first, end - first), views,
                               normal.data() + first))
                return;
            for (std::size_t i = first; i < end; ++i) {
                const glm::vec3 at = origin.data()[i];
                if (at.x < 0) continue;
                const auto number = static_cast<std::size_t>(at.x);
                if (!isBetween(views[number], at.y, at.z))
                    normal.data()[i] = normalAt(*work.sources[number].source, at.y, at.z);
            }
        });
}

Result<void> SurfaceRenderer::collect(const SurfaceFrame& work, Frame& frame, Image<float>& q) {
    const Camera& camera = work.space.camera;
    frame.colour = Image<glm::vec4>(camera.width, camera.height, glm::vec4(0.0f));
    q = Image<float>(camera.width, camera.height, 0.0f);
    Image<glm::vec3> origin;
    if (work.wantOrigin) {
        origin = Image<glm::vec3>(camera.width, camera.height, glm::vec3(-1, 0, 0));
        frame.normal = Image<glm::vec3>(camera.width, camera.height, glm::vec3(0.0f));
    }
    STX_CHECK(backend_->finish({frame.colour, q, origin}));
    STX_CHECK(job_.checkCancelled());
    if (work.wantOrigin) normalsAt(work, origin, frame.normal);
    return {};
}

Result<Frame> SurfaceRenderer::render(const Camera& camera) {
    const auto next = std::exchange(expected_, std::nullopt);
    STX_CHECK(checkSize(camera));
    const Stopwatch watch;
    Frame frame;
    if (const int same = viewAt(camera); same >= 0) {
        beginExpected(next);
        frame = copyOf(scene_.sources[static_cast<std::size_t>(same)]);
    } else {
        STX_CHECK(drawFrame(camera, next, frame));
    }
    frame.linear = scene_.set.linear();
    if (settings_.wantNormals()) frame.albedo = frame.colour;
    if (settings_.lighting.on()) light(camera, frame);
    frame.milliseconds = watch.milliseconds();
    return frame;
}

}  // namespace

Result<std::unique_ptr<Renderer>> makeSurfaceRenderer(
    const PageSet& set, const RenderSettings& settings, Job& job,
    const std::function<Result<std::unique_ptr<SurfaceBackend>>()>& makeBackend) {
    std::unique_ptr<SurfaceRenderer> first;
    std::unique_ptr<SurfaceRenderer>* place = &first;
    for (const PageSet* part = &set; part; part = part->behind()) {
        STX_TRY(auto backend, makeBackend());
        *place = std::make_unique<SurfaceRenderer>(*part, settings, job, std::move(backend));
        STX_CHECK((*place)->prepareBackend());
        place = &(*place)->behind();
    }
    return std::unique_ptr<Renderer>(std::move(first));
}

}  // namespace stx::surface
