#include "lib/render/splat/gl/gl_renderer.hpp"

#include <glm/gtc/type_ptr.hpp>

#include "lib/base/parallel.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/model/srgb8.hpp"
#include "lib/render/device/egl_context.hpp"
#include "lib/render/device/gl_object.hpp"
#include "lib/render/splat/gl/gl_points.hpp"

namespace stx::gl {
namespace {

using gpu::EglContext;
using gpu::GlFramebuffer;
using gpu::GlTexture;

/// Fixed-function OpenGL has this many lights.
constexpr std::size_t kMaxLights = 8;

struct Targets {
    glm::ivec2 size{0};
    GlTexture colour, depth;
    GlFramebuffer framebuffer;
};

/// Whether fixed functions have not what such light needs; see lightPoints().
bool lightsByPoint(const Lighting& lighting) {
    return lighting.environment || lighting.specular != glm::vec3(0.0f);
}

class GlRenderer final : public Renderer {
  public:
    GlRenderer(std::shared_ptr<EglContext> context, const PageSet& set, RenderSettings settings,
               Limits limits)
        : context_(std::move(context)),
          settings_(std::move(settings)),
          limits_(std::move(limits)),
          points_(makePointArrays(set, settings_.lighting.on())) {}

    ~GlRenderer() override { destroyIn(*context_, targets_); }

    Result<Frame> render(const Camera& camera) override;
    std::string backend() const override { return "gl"; }
    std::string device() const override { return context_->device().name; }

  private:
    Result<void> makeTargets(glm::ivec2 size);
    void setCamera(const Camera& camera) const;
    void setLights(const Camera& camera) const;
    void lightPoints(const Camera& camera);
    void drawGroups(bool lit) const;
    void readColours(Image<glm::vec4>& to) const;

    std::shared_ptr<EglContext> context_;
    RenderSettings settings_;
    Limits limits_;
    PointArrays points_;
    PointGroups groups_;
    std::vector<glm::vec4> litColours_;  ///< of the points, where an environment lights
    std::unique_ptr<Targets> targets_;
};

Result<void> GlRenderer::makeTargets(glm::ivec2 size) {
    if (targets_ && targets_->size == size) return {};
    const int limit = context_->device().maxTextureSize;
    if (size.x > limit || size.y > limit)
        return fail(ErrorCode::unsupported,
                    "a frame of {}x{} is more than '{}' takes ({}x{}); use --backend gpu or cpu",
                    size.x, size.y, context_->device().name, limit, limit);
    targets_ = std::make_unique<Targets>();
    targets_->colour = GlTexture::create(GL_TEXTURE_2D);
    glTextureStorage2D(targets_->colour.get(), 1, points_.inFloats() ? GL_RGBA32F : GL_RGBA8,
                       size.x, size.y);
    targets_->depth = GlTexture::create(GL_TEXTURE_2D);
    glTextureStorage2D(targets_->depth.get(), 1, GL_DEPTH_COMPONENT32F, size.x, size.y);
    targets_->framebuffer = GlFramebuffer::create();
    const GLuint name = targets_->framebuffer.get();
    glNamedFramebufferTexture(name, GL_COLOR_ATTACHMENT0, targets_->colour.get(), 0);
    glNamedFramebufferTexture(name, GL_DEPTH_ATTACHMENT, targets_->depth.get(), 0);
    STX_CHECK(context_->check("making the frame's targets"));
    if (glCheckNamedFramebufferStatus(name, GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        return fail(ErrorCode::unsupported, "'{}' cannot draw into the frame's textures",
                    context_->device().name);
    targets_->size = size;
    return {};
}

/// Near and far plane with room for the points at either end.
glm::dvec2 depthRange(const PointGroups& groups) {
    return {groups.nearest * 0.99, std::max(groups.farthest, groups.nearest * 1.001) * 1.01};
}

void GlRenderer::setCamera(const Camera& c) const {
    const glm::dvec2 range = depthRange(groups_);
    // Rows come out from the top: y of the picture is upside down in OpenGL's window.
    const double left = -c.cx, right = c.width - c.cx, top = -c.cy, bottom = c.height - c.cy;
    glm::dmat4 projection(0.0);
    const double depth = range.y - range.x;
    if (c.orthographic) {
        projection[0][0] = 2 * c.fx / (right - left);
        projection[1][1] = -2 * c.fy / (bottom - top);
        projection[2][2] = -2 / depth;
        projection[3] = {-(right + left) / (right - left), -(bottom + top) / (bottom - top),
                         -(range.y + range.x) / depth, 1};
    } else {
        projection[0][0] = 2 * c.fx / (right - left);
        projection[1][1] = -2 * c.fy / (bottom - top);
        projection[2] = {(right + left) / (right - left), (bottom + top) / (bottom - top),
                         -(range.y + range.x) / depth, -1};
        projection[3][2] = -2 * range.y * range.x / depth;
    }
    glMatrixMode(GL_PROJECTION);
    glLoadMatrixd(glm::value_ptr(projection));
    glMatrixMode(GL_MODELVIEW);
    Camera shifted = c;
    shifted.position -= points_.centre;
    const glm::dmat4 view = shifted.cameraFromWorld();
    glLoadMatrixd(glm::value_ptr(view));
}

void GlRenderer::setLights(const Camera& camera) const {
    // Positions go through the modelview matrix, whose origin is the centre of the points.
    const Lighting world = lightsInWorld(settings_.lighting, lightPose(camera).worldFromCamera());
    const glm::vec4 ambient(world.ambient, 1.0f), black(0, 0, 0, 1);
    glLightModelfv(GL_LIGHT_MODEL_AMBIENT, &ambient.x);
    glColorMaterial(GL_FRONT_AND_BACK, GL_AMBIENT_AND_DIFFUSE);
    glEnable(GL_COLOR_MATERIAL);
    glEnable(GL_NORMALIZE);
    for (std::size_t i = 0; i < kMaxLights; ++i) {
        const auto name = static_cast<GLenum>(GL_LIGHT0 + i);
        if (i >= world.lights.size()) {
            glDisable(name);
            continue;
        }
        const Light& light = world.lights[i];
        const glm::vec4 colour(light.colour, 1.0f);
        const glm::vec4 place =
            light.kind == Light::Kind::directional
                ? glm::vec4(-light.vector, 0.0f)
                : glm::vec4(glm::vec3(glm::dvec3(light.vector) - points_.centre), 1);
        glLightfv(name, GL_POSITION, &place.x);
        glLightfv(name, GL_AMBIENT, &black.x);
        glLightfv(name, GL_DIFFUSE, &colour.x);
        glLightfv(name, GL_SPECULAR, &black.x);
        glEnable(name);
    }
}

/// Fixed functions have no light from all around, and other highlights (Blinn's, not Phong's): each
/// point gets the colour that all lights together give it, as the other backends give it to each
/// pixel.
void GlRenderer::lightPoints(const Camera& camera) {
    const Lighting world = lightsInWorld(settings_.lighting, lightPose(camera).worldFromCamera());
    litColours_ = points_.coloursF;
    parallelFor(0, litColours_.size(), 4096, [&](std::size_t i) {
        const glm::vec3 normal = points_.normals[i];
        if (normal == glm::vec3(0)) return;
        const glm::dvec3 place = points_.centre + glm::dvec3(points_.positions[i]);
        const glm::dvec3 toEye = camera.orthographic ? -camera.forward() : camera.position - place;
        litColours_[i] =
            glm::vec4(shadePhong(world, glm::vec3(litColours_[i]), glm::vec3(place),
                                 glm::normalize(normal), glm::vec3(glm::normalize(toEye)), true),
                      1.0f);
    });
}

void GlRenderer::drawGroups(bool lit) const {
    const bool lightsOfPoints = lit && lightsByPoint(settings_.lighting);
    lit = lit && !lightsOfPoints;
    const float nothing[4] = {};
    const float farthest = 1.0f;
    glClearNamedFramebufferfv(targets_->framebuffer.get(), GL_COLOR, 0, nothing);
    glClearNamedFramebufferfv(targets_->framebuffer.get(), GL_DEPTH, 0, &farthest);
    glBindFramebuffer(GL_FRAMEBUFFER, targets_->framebuffer.get());
    glViewport(0, 0, targets_->size.x, targets_->size.y);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    if (lit)
        glEnable(GL_LIGHTING);
    else
        glDisable(GL_LIGHTING);
    glEnableClientState(GL_VERTEX_ARRAY);
    glVertexPointer(3, GL_FLOAT, 0, points_.positions.data());
    glEnableClientState(GL_COLOR_ARRAY);
    if (points_.inFloats())
        glColorPointer(4, GL_FLOAT, 0,
                       lightsOfPoints ? litColours_.data() : points_.coloursF.data());
    else
        glColorPointer(4, GL_UNSIGNED_BYTE, 0, points_.colours.data());
    if (lit) {
        glEnableClientState(GL_NORMAL_ARRAY);
        glNormalPointer(GL_FLOAT, 0, points_.normals.data());
    }
    for (const auto& group : groups_.groups) {
        glPointSize(static_cast<float>(group.size));
        // In runs that the driver's 32-bit counts hold.
        constexpr std::size_t kRun = 1u << 28;
        for (std::size_t done = 0; done < group.count; done += kRun)
            glDrawElements(GL_POINTS, static_cast<GLsizei>(std::min(kRun, group.count - done)),
                           GL_UNSIGNED_INT, groups_.indices.data() + group.first + done);
    }
    glDisableClientState(GL_NORMAL_ARRAY);
    glDisableClientState(GL_COLOR_ARRAY);
    glDisableClientState(GL_VERTEX_ARRAY);
    glFinish();
}

void GlRenderer::readColours(Image<glm::vec4>& to) const {
    glReadPixels(0, 0, to.width(), to.height(), GL_RGBA, GL_FLOAT, to.data());
    if (!points_.decoded) return;
    parallelFor(0, to.height(), [&](int row) {
        for (int x = 0; x < to.width(); ++x) {
            glm::vec4& c = to.at(x, row);
            for (int i = 0; i < 3; ++i) c[i] = srgbByTable(c[i]);
        }
    });
}

Result<Frame> GlRenderer::render(const Camera& camera) {
    STX_CHECK(camera.check());
    const auto pixels =
        static_cast<std::uint64_t>(camera.width) * static_cast<std::uint64_t>(camera.height);
    STX_CHECK(limits_.checkAllocation(pixels, 40, "the frame"));
    STX_TRY(auto current, context_->makeCurrent());
    STX_CHECK(makeTargets({camera.width, camera.height}));
    const bool lit = settings_.lighting.on();
    Frame frame;
    frame.linear = points_.linear;
    frame.colour = Image<glm::vec4>(camera.width, camera.height, glm::vec4(0));
    frame.depth = Image<float>(camera.width, camera.height, kNoDepth);

    const Stopwatch watch;
    GLfloat sizes[2] = {1, 1};
    glGetFloatv(GL_ALIASED_POINT_SIZE_RANGE, sizes);
    groupPoints(points_, settings_, camera, static_cast<int>(sizes[1]), groups_);
    if (!groups_.groups.empty()) {
        setCamera(camera);
        if (lit && lightsByPoint(settings_.lighting))
            lightPoints(camera);
        else if (lit)
            setLights(camera);
        drawGroups(lit);
    }
    frame.milliseconds = watch.milliseconds();
    STX_CHECK(context_->check("drawing"));
    if (groups_.groups.empty()) return frame;

    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    readColours(frame.colour);
    glReadPixels(0, 0, camera.width, camera.height, GL_DEPTH_COMPONENT, GL_FLOAT,
                 frame.depth.data());
    const glm::dvec2 range = depthRange(groups_);
    for (float& d : frame.depth.pixels()) {
        if (d >= 1.0f)
            d = kNoDepth;
        else if (camera.orthographic)
            d = static_cast<float>(range.x + d * (range.y - range.x));
        else
            d = static_cast<float>(range.x * range.y / (range.y - d * (range.y - range.x)));
    }
    if (lit) {
        drawGroups(false);
        frame.albedo = Image<glm::vec4>(camera.width, camera.height, glm::vec4(0));
        readColours(frame.albedo);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    STX_CHECK(context_->check("reading the frame back"));
    return frame;
}

}  // namespace

Result<std::unique_ptr<Renderer>> makeGlRenderer(const PageSet& set, const RenderSettings& settings,
                                                 int device, Job& job) {
    if (settings.lighting.lights.size() > kMaxLights)
        return fail(ErrorCode::unsupported,
                    "{} lights; the gl backend has {}, use --backend gpu or cpu",
                    settings.lighting.lights.size(), kMaxLights);
    std::uint64_t points = 0;
    for (const Page& page : set.pages()) points += page.depth->count();
    STX_CHECK(job.limits.checkAllocation(points, lightsByPoint(settings.lighting) ? 80 : 64,
                                         "the vertex arrays of the gl backend"));
    STX_TRY(auto context, EglContext::create(device, EglContext::Profile::compatibility));
    STX_CHECK(context->requireModern("the gl backend", "--backend gpu or cpu"));
    return std::make_unique<GlRenderer>(std::move(context), set, settings, job.limits);
}

}  // namespace stx::gl
