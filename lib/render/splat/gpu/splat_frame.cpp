#include "lib/render/splat/gpu/splat_frame.hpp"

#include <limits>

#include "lib/base/parallel.hpp"
#include "lib/render/splat/gpu/splat_shaders.hpp"
#include "lib/render/splat/others.hpp"
#include "lib/render/splat/paper_rule.hpp"
#include "lib/render/splat/plan.hpp"

namespace stx::gpu {
namespace {

/// Steps of a weight in the integer sums. A sparse view's weight may be a thousandth of this; where
/// such views are alone their weights must still differ.
constexpr double kLargestWeight = 1048576.0;

/// RectangleImages pixels that fall on one novel pixel where the block is seen as its view saw it.
double density(const splat::PreparedRectangle& info, const splat::BlockInfo& block,
               const splat::BlockTask& task, const Camera& novel) {
    const auto& c = info.camera();
    const double source = c.orthographic ? 1.0 : block.zMin;
    const double target = novel.orthographic ? 1.0 : std::max(1e-9, double(task.zMin));
    return (c.fx * c.fy / (source * source)) * (target * target) / (novel.fx * novel.fy);
}

std::uint32_t tileOf(int x, int y) {
    return static_cast<std::uint32_t>(x / kCullTile) | static_cast<std::uint32_t>(y / kCullTile)
                                                           << 16;
}

FrameUniforms uniformsOf(const GpuScene& scene, const RenderSettings& settings, const Camera& novel,
                         int margin) {
    FrameUniforms u{};
    u.frameSize = {novel.width, novel.height, novel.width + 2, margin};
    u.counts = {static_cast<int>(scene.rectangles.size()), 0, 0, 0};
    u.novelLens = {1.0 / novel.fx, 1.0 / novel.fy, novel.cx, novel.cy};
    const glm::mat3 axes = glm::mat3_cast(glm::quat(novel.orientation));
    u.novelAxisX = glm::vec4(axes[0], novel.orthographic ? 1.0f : 0.0f);
    constexpr float kMost = std::numeric_limits<float>::max();
    u.novelAxisY = glm::vec4(axes[1], settings.lighting.beyondOne ? kMost : 1.0f);
    u.novelAxisZ = glm::vec4(axes[2], 0.0f);
    const double coefficient = settings.splat == SplatRule::paper
                                   ? paperCoefficient(scene.rectangles, settings, novel)
                                   : 0.0;
    u.novelPosition = glm::vec4(novel.position, coefficient);
    const Lighting& lighting = settings.lighting;
    const bool gloss = lighting.specular != glm::vec3(0.0f);
    u.ambient = glm::vec4(lighting.ambient, !lighting.environment ? 0.0f : gloss ? 2.0f : 1.0f);
    u.specular = glm::vec4(settings.lighting.specular, settings.lighting.shininess);
    return u;
}

void addLights(const Lighting& settings, const Camera& pose, SplatFrame& frame) {
    const Lighting lighting = lightsInWorld(settings, pose.worldFromCamera());
    for (const auto& light : lighting.lights)
        frame.lights.push_back(
            {glm::vec4(light.vector, light.kind == Light::Kind::point ? 1.0f : 0.0f),
             glm::vec4(light.colour, 0.0f)});
    frame.uniforms.counts.w = static_cast<int>(frame.lights.size());
    if (lighting.environment) {
        const auto add = [&](const glm::vec3& light) {
            frame.lights.push_back({glm::vec4(0.0f), glm::vec4(light, 0.0f)});
        };
        std::ranges::for_each(lighting.environment->harmonics(), add);
        if (lighting.specular != glm::vec3(0.0f))
            std::ranges::for_each(lighting.environment->glossTable(), add);
    }
}

struct Planned {
    splat::BlockTask task;
    double density = 0;
    bool seen = false;
};

void planBlocks(const splat::PreparedRectangle& info, const splat::RectangleImages& source,
                const Camera& novel, const ShareLength& shares, SplatRule rule,
                std::vector<Planned>& planned) {
    planned.assign(info.blocks.size(), {});
    parallelFor(0, planned.size(), 512, [&](std::int64_t i) {
        Planned& p = planned[i];
        p.seen = splat::planBlock(info, info.blocks[i], source, novel, shares,
                                  rule == SplatRule::data, p.task);
        if (p.seen) p.density = density(info, info.blocks[i], p.task, novel);
    });
}

/// The pixels from `begin` to `end` of a block of rectangle `k`, whose images lie at `place`.
TaskEntry taskEntry(const splat::BlockTask& t, glm::ivec2 begin, glm::ivec2 end, glm::ivec3 place,
                    std::size_t k) {
    const auto pair = [](int x, int y) {
        return static_cast<std::uint32_t>(x) | static_cast<std::uint32_t>(y) << 16;
    };
    return {pair(begin.x, begin.y),
            pair(end.x - begin.x, end.y - begin.y),
            pair(place.x + begin.x, place.y + begin.y),
            static_cast<std::uint32_t>(k) | static_cast<std::uint32_t>(place.z) << 20,
            t.slopeX,
            t.slopeY,
            t.core2,
            t.tolerance,
            t.quality * (t.uniform ? t.density : 1.0f),
            t.uAcross,
            t.vAcross,
            t.uDown,
            t.vDown,
            tileOf(t.x0, t.y0),
            tileOf(t.x1, t.y1),
            t.nearest};
}

}  // namespace

SplatFrame planSplatFrame(const GpuScene& scene, const RenderSettings& settings,
                          const Camera& novel, const Camera& lights, float largest, int margin) {
    SplatFrame frame;
    const ShareLength shares(novel, scene.radius);
    frame.uniforms = uniformsOf(scene, settings, novel, margin);
    std::vector<TaskEntry> small, large;
    double crowd = 0;  // weights of the points that may meet in one pixel, all views together
    std::vector<Planned> planned;
    for (std::size_t k = 0; k < scene.rectangles.size(); ++k) {
        const splat::PreparedRectangle& info = scene.rectangles[k];
        const Camera& c = info.camera();
        splat::RectangleImages source;
        source.orthographic = c.orthographic;
        source.fx = static_cast<float>(c.fx);
        source.fy = static_cast<float>(c.fy);
        source.map = pixelMap(c, novel);
        const PixelMap& m = source.map;
        frame.views.push_back({glm::vec4(m.a0, c.orthographic ? 1.0f : 0.0f), glm::vec4(m.au, c.fx),
                               glm::vec4(m.av, c.fy), glm::vec4(m.b0, 0), glm::vec4(m.bu, 0),
                               glm::vec4(m.bv, 0)});
        planBlocks(info, source, novel, shares, settings.splat, planned);
        double densest = 0, heaviest = 0;
        const glm::ivec3 place = scene.places[k];
        for (const Planned& p : planned) {
            if (!p.seen) continue;
            const splat::BlockTask& t = p.task;
            densest = std::max(densest, p.density);
            // The paper's rule weighs all views alike.
            heaviest =
                std::max(heaviest, settings.splat == SplatRule::data ? double(t.quality) : 1.0);
            const auto add = [&](int u0, int v0, int u1, int v1) {
                const TaskEntry entry = taskEntry(t, {u0, v0}, {u1, v1}, place, k);
                const bool own = settings.splat == SplatRule::data && !t.uniform;
                (!own ? frame.tasks : t.small ? small : large).push_back(entry);
            };
            splat::forNeeded(t, add);
        }
        crowd += std::max(1.0, densest) * heaviest;
    }
    frame.uniformTasks = static_cast<int>(frame.tasks.size());
    frame.smallTasks = static_cast<int>(small.size());
    frame.tasks.insert(frame.tasks.end(), small.begin(), small.end());
    frame.tasks.insert(frame.tasks.end(), large.begin(), large.end());
    // 32-bit sums: colour steps * weight * crowd must stay below 2^31. Four for what a tilt and
    // the kernel's four pixels add.
    const double steps = 255.0;
    const double weight = std::clamp(2147483647.0 / (steps * 4.0 * crowd), 1.0, kLargestWeight);
    frame.uniforms.scales = glm::vec4(std::floor(weight), steps / scene.maxColour, largest, 0);

    addLights(settings.lighting, lights, frame);
    return frame;
}

}  // namespace stx::gpu
