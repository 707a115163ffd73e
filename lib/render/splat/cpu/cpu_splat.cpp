#include "lib/render/splat/cpu/cpu_splat.hpp"

#include <algorithm>
#include <cstring>
#include <span>

#include <tbb/enumerable_thread_specific.h>

#include "lib/base/cpu_device.hpp"
#include "lib/base/parallel.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/render/outline/silhouettes.hpp"
#include "lib/render/splat/cpu/kernels.hpp"
#include "lib/render/splat/others.hpp"
#include "lib/render/splat/paper_rule.hpp"
#include "lib/render/splat/pinholes.hpp"
#include "lib/render/splat/plan.hpp"
#include "lib/render/splat/prepared.hpp"

namespace stx {
namespace {

using namespace splat;

constexpr int kTile = 16;
// What one thread draws at once: its buffers should stay in the second-level cache.
constexpr int kRegionWidth = 256, kRegionRows = 128;
// Blocks are drawn column by column of the picture; pixels.
constexpr int kColumn = 64;
// Pixels of a spool are given back, if they are many, behind so many blocks: some megabytes of it.
constexpr std::size_t kSettled = 32;

// One thread's buffers for a region.
struct Scratch {
    std::vector<float> depth, colour, missing, normals, tileMax;
    std::vector<std::uint64_t> points;
};

class CpuSplatRenderer final : public Renderer {
  public:
    CpuSplatRenderer(const PageSet& set, const RenderSettings& settings, Job& job)
        : set_(set),
          settings_(settings),
          limits_(job.limits),
          wantNormals_(settings.wantNormals()),
          prepared_(prepared(set_, settings)),
          silhouettes_(set_) {
        if (settings.splat == SplatRule::data && settings.does(Stage::nearer)) {
            const StageTimer timer(settings.log.get(), "nearer", true);
            findOthers(set_, prepared_);
        }
        for (const auto& r : prepared_.rectangles) {
            for (const auto& b : r.blocks) opaque_ = opaque_ && b.opaque;
            blockCount_ += r.blocks.size();
        }
        for (const PageView& view : set_.views())
            opaque_ = opaque_ && !(view.unread && view.unread->faint);
        tasks_.resize(blockCount_);
        seen_.resize(blockCount_);
    }

    Result<Frame> render(const Camera& camera) override;
    void reuse(Frame&& frame) override { spare_ = std::move(frame); }
    std::string backend() const override { return "cpu"; }
    std::string device() const override { return cpuDeviceName(); }

  private:
    struct Picture {
        const Camera& camera;
        Lighting lighting;
        Shape shape;
        Frame frame;
        int across = 0;  // regions in a row
    };

    static PreparedPages prepared(const PageSet& set, const RenderSettings& settings) {
        const StageTimer timer(settings.log.get(), "prepare", true);
        return preparePages(set, settings.wantNormals());
    }
    void planFrame(const Camera& camera);
    std::span<const std::uint32_t> byColumn(int width);
    void drawRegion(Picture& picture, int index);
    void resolveBlended(Picture& picture, const Region& region) const;
    void resolvePoints(Picture& picture, const Region& region) const;
    void shade(Picture& picture, int x, int y, glm::vec3 normal) const;

    PageSet set_;
    RenderSettings settings_;
    Limits limits_;
    bool wantNormals_;
    PreparedPages prepared_;
    Silhouettes silhouettes_;
    bool opaque_ = true;
    std::size_t blockCount_ = 0;

    Frame spare_;  // memory for the next frame

    // The members below belong to the frame that is being drawn.
    std::vector<RectangleImages> sources_;
    std::vector<BlockTask> tasks_;
    std::vector<std::uint8_t> seen_;
    std::vector<std::uint32_t> order_;
    std::vector<std::vector<std::uint32_t>> bins_;  // tasks of each region, in order
    tbb::enumerable_thread_specific<Scratch> scratch_;
};

RectangleImages sourceOf(const PageRectangle& r, const Page& page, const PreparedPage& prepared,
                         const Camera& novel) {
    const std::size_t first = static_cast<std::size_t>(r.pageY) * page.width() + r.pageX;
    RectangleImages s;
    s.depth = page.depth->data() + first;
    if (const auto* image = page.texture->rgba8())
        s.rgba8 = reinterpret_cast<const std::uint8_t*>(image->data() + first);
    if (const auto* image = page.texture->rgbaFloat())
        s.rgbaFloat = reinterpret_cast<const float*>(image->data() + first);
    s.slopes = prepared.slopes.data() + first;
    if (!prepared.normals.empty())
        s.normals = reinterpret_cast<const std::int8_t*>(prepared.normals.data() + first);
    if (!prepared.sizes.empty()) s.sizes = prepared.sizes.data() + first;
    s.firstPoint = prepared.firstPoint + static_cast<std::uint32_t>(first);
    s.stride = page.width();
    s.before = static_cast<std::ptrdiff_t>(first);
    s.after = static_cast<std::ptrdiff_t>(page.depth->count() - first);
    s.orthographic = r.window.orthographic;
    s.fx = static_cast<float>(r.window.fx);
    s.fy = static_cast<float>(r.window.fy);
    s.map = pixelMap(r.window, novel);
    return s;
}

void CpuSplatRenderer::planFrame(const Camera& camera) {
    sources_.clear();
    for (const PageRectangle& r : set_.rectangles()) {
        const auto page = static_cast<std::size_t>(r.page);
        if (set_.views()[r.view].unread) {
            sources_.emplace_back();
            continue;
        }
        sources_.push_back(sourceOf(r, set_.pages()[page], prepared_.pages[page], camera));
    }
    const ShareLength shares(camera, prepared_.radius);
    std::size_t first = 0;
    for (std::size_t k = 0; k < prepared_.rectangles.size(); ++k) {
        const auto& info = prepared_.rectangles[k];
        parallelFor(0, info.blocks.size(), 512, [&](std::int64_t i) {
            BlockTask& task = tasks_[first + i];
            task.source = static_cast<std::uint32_t>(k);
            seen_[first + i] = planBlock(info, info.blocks[i], sources_[k], camera, shares,
                                         settings_.splat == SplatRule::data, task);
        });
        first += info.blocks.size();
    }
}

// The tasks that are seen, those at the left of the picture first, else in their order: what all
// views add to a column is added while it is in the cache.
std::span<const std::uint32_t> CpuSplatRenderer::byColumn(int width) {
    std::vector<std::uint32_t> first(static_cast<std::size_t>(width / kColumn) + 2, 0);
    for (std::size_t i = 0; i < tasks_.size(); ++i)
        if (seen_[i]) ++first[static_cast<std::size_t>(tasks_[i].x0 / kColumn) + 1];
    for (std::size_t k = 1; k < first.size(); ++k) first[k] += first[k - 1];
    order_.resize(first.back());
    for (std::size_t i = 0; i < tasks_.size(); ++i)
        if (seen_[i]) order_[first[tasks_[i].x0 / kColumn]++] = static_cast<std::uint32_t>(i);
    return order_;
}

Result<Frame> CpuSplatRenderer::render(const Camera& camera) {
    STX_CHECK(camera.check());
    const auto pixels =
        static_cast<std::uint64_t>(camera.width) * static_cast<std::uint64_t>(camera.height);
    STX_CHECK(limits_.checkAllocation(pixels, wantNormals_ ? 48 : 20, "the frame"));
    const Stopwatch watch;
    Picture picture{
        camera, lightsInWorld(settings_.lighting, lightPose(camera).worldFromCamera()), {}, {}, 0};
    parallelFor(0, 2, [&](std::int64_t part) {
        if (part == 0) {
            planFrame(camera);
        } else {
            picture.frame = std::move(spare_);
            spare_ = {};
            const auto sized = [&](auto& image, bool wanted) {
                if (!wanted || image.size() != glm::ivec2(camera.width, camera.height))
                    image = {wanted ? camera.width : 0, wanted ? camera.height : 0};
            };
            sized(picture.frame.colour, true);
            sized(picture.frame.depth, true);
            sized(picture.frame.albedo, wantNormals_);
            sized(picture.frame.normal, wantNormals_);
            picture.frame.linear = set_.linear();
        }
    });
    if (settings_.splat == SplatRule::paper)
        picture.shape.coefficient =
            static_cast<float>(paperCoefficient(prepared_.rectangles, settings_, camera));

    picture.across = (camera.width + kRegionWidth - 1) / kRegionWidth;
    const int regions = picture.across * ((camera.height + kRegionRows - 1) / kRegionRows);
    bins_.resize(static_cast<std::size_t>(regions));
    for (auto& b : bins_) b.clear();
    Extent drawn{camera.width, camera.height, 0, 0};
    for (const std::uint32_t i : byColumn(camera.width)) {
        const BlockTask& task = tasks_[i];
        drawn = {std::min(drawn.x0, task.x0), std::min(drawn.y0, task.y0),
                 std::max(drawn.x1, task.x1 + 1), std::max(drawn.y1, task.y1 + 1)};
        int x0 = task.x0, x1 = task.x1, y0 = task.y0, y1 = task.y1;
        if (picture.shape.coefficient > 0) {
            // Round splats may be larger than the plan, which follows the data.
            const double z = std::max(1e-9f, task.zMin);
            const double radiusThere =
                1 + picture.shape.coefficient / (camera.orthographic ? 1.0 : z);
            // From any pixel the sides of the picture are nearer than both together.
            const int radius = static_cast<int>(std::min(
                {radiusThere, 1.0 + largestSplat(camera), double(camera.width + camera.height)}));
            x0 = std::max(0, x0 - radius);
            x1 = std::min(camera.width - 1, x1 + radius);
            y0 = std::max(0, y0 - radius);
            y1 = std::min(camera.height - 1, y1 + radius);
        }
        for (int y = y0 / kRegionRows; y <= y1 / kRegionRows; ++y)
            for (int x = x0 / kRegionWidth; x <= x1 / kRegionWidth; ++x)
                bins_[y * picture.across + x].push_back(i);
    }
    {
        const StageTimer timer(settings_.log.get(), "draw");
        parallelFor(0, regions, [&](int n) { drawRegion(picture, n); });
    }
    if (settings_.splat == SplatRule::data) {
        const auto& colour = picture.frame.colour;
        if (settings_.does(Stage::closing))
            finishStage(settings_.log.get(), "closing", colour,
                        [&] { closePinholes(picture.frame, set_.pruned(), drawn); });
        if (settings_.does(Stage::coverage))
            finishStage(settings_.log.get(), "coverage", colour,
                        [&] { silhouettes_.carve(picture.frame, camera, drawn); });
    }
    picture.frame.milliseconds = watch.milliseconds();
    return std::move(picture.frame);
}

// The farthest depth in each tile of a region: what lies behind is hidden.
void findTileMax(const Region& region, std::vector<float>& tileMax) {
    const int across = (region.width + kTile - 1) / kTile, down = (region.rows + kTile - 1) / kTile;
    tileMax.assign(static_cast<std::size_t>(across) * down, 0.0f);
    for (int y = 0; y < region.rows; ++y) {
        const float* row = region.depth + static_cast<std::size_t>(y + 1) * region.stride + 1;
        float* out = tileMax.data() + static_cast<std::size_t>(y / kTile) * across;
        for (int t = 0; t < across; ++t) {
            const int end = std::min(region.width, (t + 1) * kTile);
            float m = out[t];
            for (int x = t * kTile; x < end; ++x) m = row[x] > m ? row[x] : m;
            out[t] = m;
        }
    }
}

bool hidden(const BlockTask& t, const Region& region, const std::vector<float>& tileMax) {
    const int across = (region.width + kTile - 1) / kTile;
    const int y0 = std::max(t.y0 - region.top, 0),
              y1 = std::min(t.y1 - region.top, region.rows - 1);
    const int x0 = std::max(t.x0 - region.left, 0),
              x1 = std::min(t.x1 - region.left, region.width - 1);
    for (int y = y0 / kTile; y <= y1 / kTile; ++y)
        for (int x = x0 / kTile; x <= x1 / kTile; ++x)
            if (t.nearest <= tileMax[static_cast<std::size_t>(y) * across + x]) return false;
    return true;
}

void CpuSplatRenderer::drawRegion(Picture& picture, int index) {
    const Camera& camera = picture.camera;
    Scratch& scratch = scratch_.local();
    Region region;
    region.left = index % picture.across * kRegionWidth;
    region.top = index / picture.across * kRegionRows;
    region.width = std::min(kRegionWidth, camera.width - region.left);
    region.rows = std::min(kRegionRows, camera.height - region.top);
    region.stride = region.width + 2;
    region.orthographic = camera.orthographic;
    region.largest = largestSplat(camera);
    const auto& bin = bins_[index];
    if (bin.empty()) {
        for (int y = region.top; y < region.top + region.rows; ++y) {
            const auto fill = [&](auto& image, auto value) {
                if (image.empty()) return;
                auto* row = image.row(y).data() + region.left;
                std::fill(row, row + region.width, value);
            };
            fill(picture.frame.depth, kNoDepth);
            fill(picture.frame.colour, glm::vec4(0.0f));
            fill(picture.frame.albedo, glm::vec4(0.0f));
            fill(picture.frame.normal, glm::vec3(0.0f));
        }
        return;
    }
    const std::size_t count = Region::pixels(region.rows, region.stride);
    if (settings_.splat == SplatRule::point) {
        scratch.points.assign(count, ~std::uint64_t{0});
        region.points = scratch.points.data();
        for (const auto i : bin) drawPoints(sources_[tasks_[i].source], tasks_[i], region);
        resolvePoints(picture, region);
        return;
    }
    scratch.depth.assign(count, kNoDepth);
    scratch.colour.assign(4 * count, 0.0f);
    scratch.missing.assign(count, 0.0f);
    region.depth = scratch.depth.data();
    region.colour = scratch.colour.data();
    region.missing = scratch.missing.data();
    if (wantNormals_) {
        scratch.normals.assign(4 * count, 0.0f);
        region.normals = scratch.normals.data();
    }
    const auto after = [&](std::size_t k) {
        if (k % kSettled == 0) set_.settle();
        if (k + 1 >= bin.size()) return Ahead{};
        const BlockTask& next = tasks_[bin[k + 1]];
        return Ahead{&sources_[next.source], &next};
    };
    for (std::size_t k = 0; k < bin.size(); ++k) {
        const BlockTask& task = tasks_[bin[k]];
        drawDepth(sources_[task.source], task, after(k), picture.shape, region);
    }
    findTileMax(region, scratch.tileMax);
    for (std::size_t k = 0; k < bin.size(); ++k) {
        const BlockTask& task = tasks_[bin[k]];
        if (picture.shape.coefficient <= 0 && hidden(task, region, scratch.tileMax)) continue;
        drawColour(sources_[task.source], task, after(k), picture.shape, region);
    }
    resolveBlended(picture, region);
}

void CpuSplatRenderer::shade(Picture& picture, int x, int y, glm::vec3 normal) const {
    Frame& frame = picture.frame;
    const Camera& camera = picture.camera;
    frame.normal.at(x, y) = normal;
    const glm::vec4 albedo = frame.colour.at(x, y);
    frame.albedo.at(x, y) = albedo;
    if (!settings_.lighting.on() || !(albedo.a > 0) || normal == glm::vec3(0)) return;
    const float depth = frame.depth.at(x, y);
    const glm::dvec3 position =
        camera.position +
        camera.orientation * camera.unproject(x + 0.5, y + 0.5, hasPoint(depth) ? depth : 1.0);
    const glm::vec3 toEye(-camera.viewDirection(x + 0.5, y + 0.5));
    const glm::vec3 lit = shadePhong(picture.lighting, glm::vec3(albedo) / albedo.a,
                                     glm::vec3(position), normal, toEye, frame.linear);
    frame.colour.at(x, y) = glm::vec4(lit * albedo.a, albedo.a);
}

void CpuSplatRenderer::resolveBlended(Picture& picture, const Region& region) const {
    Frame& frame = picture.frame;
    for (int row = 0; row < region.rows; ++row) {
        const int y = region.top + row;
        const std::size_t start = static_cast<std::size_t>(row + 1) * region.stride + 1;
        float* depthOut = frame.depth.row(y).data() + region.left;
        glm::vec4* colourOut = frame.colour.row(y).data() + region.left;
        for (int x = 0; x < region.width; ++x) {
            const std::size_t i = start + x;
            const float* sums = region.colour + 4 * i;
            const float total = sums[3] + region.missing[i];
            float depth = region.depth[i];
            glm::vec4 colour(0.0f);
            if (total > 0) {
                const float scale = 1.0f / total;
                colour = glm::vec4(sums[0], sums[1], sums[2], sums[3]) * scale;
                // Continued colours may leave what a picture holds.
                colour = glm::max(colour, glm::vec4(0.0f));
                if (!frame.linear) colour = glm::min(colour, glm::vec4(colour.a));
            }
            if (!opaque_ && !hasPoint(depth)) {
                // Only faint splats of a silhouette reach here, or only the skirts of full ones.
                if (!(colour.a < kSkirts)) colour = glm::vec4(0.0f);
                if (colour.a > 0)
                    for (const int step : {-1, 1, -region.stride, region.stride})
                        depth = std::min(depth, region.depth[i + step]);
            } else if (!hasPoint(depth)) {
                colour = glm::vec4(0.0f);
            }
            depthOut[x] = depth;
            colourOut[x] = colour;
        }
        if (!wantNormals_) continue;
        glm::vec3* normalOut = frame.normal.row(y).data() + region.left;
        resolveNormals(region.normals + 4 * start, colourOut,
                       static_cast<std::size_t>(region.width), normalOut);
        std::copy_n(colourOut, region.width, frame.albedo.row(y).data() + region.left);
        if (!settings_.lighting.on()) continue;
        for (int x = 0; x < region.width; ++x) shade(picture, region.left + x, y, normalOut[x]);
    }
}

void CpuSplatRenderer::resolvePoints(Picture& picture, const Region& region) const {
    Frame& frame = picture.frame;
    for (int row = 0; row < region.rows; ++row) {
        const int y = region.top + row;
        const std::uint64_t* keys =
            region.points + static_cast<std::size_t>(row + 1) * region.stride + 1;
        std::size_t k = 0;
        for (int column = 0; column < region.width; ++column) {
            const int x = region.left + column;
            const std::uint64_t key = keys[column];
            if (key == ~std::uint64_t{0}) {
                frame.depth.at(x, y) = kNoDepth;
                frame.colour.at(x, y) = glm::vec4(0.0f);
                if (wantNormals_) {
                    frame.albedo.at(x, y) = glm::vec4(0.0f);
                    frame.normal.at(x, y) = glm::vec3(0.0f);
                }
                continue;
            }
            const auto bits = static_cast<std::uint32_t>(key >> 32);
            const auto point = static_cast<std::uint32_t>(key);
            const auto& pages = prepared_.pages;
            while (point < pages[k].firstPoint) --k;
            while (k + 1 < pages.size() && point >= pages[k + 1].firstPoint) ++k;
            const Texture& texture = *set_.pages()[k].texture;
            const std::uint32_t texel = point - pages[k].firstPoint;
            glm::vec4 c = texture.rgba8()
                              ? glm::vec4(texture.rgba8()->pixels()[texel]) * (1.0f / 255.0f)
                              : texture.rgbaFloat()->pixels()[texel];
            std::memcpy(&frame.depth.at(x, y), &bits, sizeof(float));
            frame.colour.at(x, y) = {c.r * c.a, c.g * c.a, c.b * c.a, c.a};
            if (wantNormals_)
                shade(picture, x, y, glm::vec3(pages[k].normals[texel]) * (1.0f / 127.0f));
        }
    }
}

}  // namespace

std::unique_ptr<Renderer> makeCpuSplatRenderer(const PageSet& set, const RenderSettings& settings,
                                               Job& job) {
    return std::make_unique<CpuSplatRenderer>(set, settings, job);
}

}  // namespace stx
