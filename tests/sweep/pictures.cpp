#include "tests/sweep/pictures.hpp"

#include <algorithm>

#include "lib/render/factory.hpp"

using namespace stx;

namespace {

constexpr double kSame = 99;      ///< dB of pictures without a difference
constexpr float kCovered = 0.5f;  ///< alpha from which on a pixel counts as covered

double decibels(double squared, double values) {
    return squared > 0 ? std::min(kSame, -10 * std::log10(squared / values)) : kSame;
}

/// The nine pixels around a point in a view are all on the plane through it.
bool showsPlane(const ReferenceView& view, glm::dvec3 point, glm::dvec3 normal) {
    const Camera& camera = view.camera;
    const glm::dvec3 local = glm::dvec3(camera.cameraFromWorld() * glm::dvec4(point, 1));
    if (!(local.z < 0)) return false;
    const glm::dvec3 at = camera.project(local);
    const int x = static_cast<int>(std::floor(at.x)), y = static_cast<int>(std::floor(at.y));
    if (x < 2 || y < 2 || x >= camera.width - 2 || y >= camera.height - 2) return false;
    if (-glm::dot(camera.viewDirection(at.x, at.y), normal) < kGrazing) return false;
    const double near = 0.5 * camera.sampleSpacing(at.z).x;
    for (int v = y - 1; v <= y + 1; ++v) {
        for (int u = x - 1; u <= x + 1; ++u) {
            if (!hasPoint(view.depth.at(u, v))) return false;
            if (std::abs(glm::dot(view.worldPoint(u, v) - point, normal)) > near) return false;
        }
    }
    return true;
}

/// Whether a view has texels of a point of the scene: the middle of the pixel that it falls in
/// shows the same surface, and it lies between the middles of pixels.
bool samples(const Scene& scene, const Camera& camera, const Hit& hit) {
    const glm::dvec3 local = glm::dvec3(camera.cameraFromWorld() * glm::dvec4(hit.point, 1));
    if (!(local.z < 0)) return false;
    const glm::dvec3 at = camera.project(local);
    if (!(at.x >= 0.5 && at.y >= 0.5 && at.x < camera.width - 0.5 && at.y < camera.height - 0.5))
        return false;
    // Steeper than this (84 degrees), a texel is more than ten times as deep as wide.
    constexpr double kHardlySampled = 0.1;
    if (-glm::dot(camera.viewDirection(at.x, at.y), hit.normal) < kHardlySampled) return false;
    const Hit first = scene.trace(camera, at.x, at.y);
    if (!first.any() ||
        !(glm::distance(first.point, hit.point) < 0.01 * camera.sampleSpacing(at.z).x))
        return false;
    return scene.trace(camera, std::floor(at.x) + 0.5, std::floor(at.y) + 0.5).surface ==
           hit.surface;
}

/// Whether a view shows that nothing is at a point: it looks through it.
bool looksThrough(const ReferenceView& view, glm::dvec3 point) {
    const glm::dvec3 local = glm::dvec3(view.camera.cameraFromWorld() * glm::dvec4(point, 1));
    if (!(local.z < 0)) return false;
    const glm::dvec3 at = view.camera.project(local);
    const int x = static_cast<int>(std::floor(at.x)), y = static_cast<int>(std::floor(at.y));
    if (!view.depth.contains(x, y)) return false;
    const float depth = view.depth.at(x, y);
    return !hasPoint(depth) || depth > at.z;
}

/// A ball around all that is there.
struct Around {
    glm::dvec3 centre{0};
    double radius = 0;

    explicit Around(const Scene& scene) {
        const std::vector<glm::vec3> points = scene.points();
        for (const glm::vec3 p : points) centre += glm::dvec3(p) / double(points.size());
        for (const glm::vec3 p : points)
            radius = std::max(radius, glm::distance(glm::dvec3(p), centre));
    }
};

}  // namespace

Result<Frame> drawBundle(const Bundle& bundle, const Camera& camera, const Drawn& how,
                         bool filled) {
    RenderSettings settings;
    settings.mode = how.mode;
    settings.quality = how.quality;
    if (!filled) settings.fill = Fill::none;
    if (!how.refined) settings.refine = RefineSettings::none();
    Job job;
    STX_TRY(const auto renderer, makeRenderer(how.backend, bundle, settings, -1, job));
    return renderer->render(camera);
}

Pictures::Pictures(const Captured& captured)
    : captured_(captured),
      seenBy_(captured.novel.width, captured.novel.height, 0),
      empty_(captured.novel.width, captured.novel.height, 0),
      guessed_(captured.novel.width, captured.novel.height, 0),
      nearOutline_(captured.novel.width, captured.novel.height, 0) {
    findGuesses();
    findOutlines();
    const Camera& novel = captured.novel;
    const Rgba8Image& truth = *captured.truth.texture.rgba8();
    // A texel is so many novel pixels wide, at half of it outlines may be drawn too large.
    const int margin = 2 + static_cast<int>(std::ceil(captured.from.magnification));
    Image<std::uint8_t> touched(novel.width, novel.height, 0);
    for (int y = 0; y < novel.height; ++y) {
        for (int x = 0; x < novel.width; ++x) {
            if (truth.at(x, y).a == 0) continue;
            for (int v = std::max(0, y - margin); v <= std::min(novel.height - 1, y + margin); ++v)
                for (int u = std::max(0, x - margin); u <= std::min(novel.width - 1, x + margin);
                     ++u)
                    touched.at(u, v) = 1;
        }
    }
    for (int y = 1; y + 1 < novel.height; ++y) {
        for (int x = 1; x + 1 < novel.width; ++x) {
            if (!touched.at(x, y)) empty_.at(x, y) = 255;
            if (truth.at(x, y).a < 255) continue;
            const Hit hit = captured.scene.trace(novel, x + 0.5, y + 0.5);
            if (!hit.any()) continue;
            bool solid = true;
            for (const auto& [dx, dy] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}})
                solid = solid && captured.scene.trace(novel, x + dx + 0.5, y + dy + 0.5).surface ==
                                     hit.surface;
            if (!solid) continue;
            int count = 0;
            for (const ReferenceView& view : captured.bundle.views)
                count += showsPlane(view, hit.point, hit.normal);
            seenBy_.at(x, y) = static_cast<std::uint8_t>(count);
        }
    }
}

void Pictures::findGuesses() {
    const Camera& novel = captured_.novel;
    // What lies within half a texel of a place that no view shows may be drawn from both sides.
    const int margin = static_cast<int>(std::ceil(0.5 * captured_.from.magnification));
    const auto& views = captured_.bundle.views;
    const auto sampled = [&](const Hit& hit) {
        return std::ranges::any_of(views, [&](const ReferenceView& view) {
            return samples(captured_.scene, view.camera, hit);
        });
    };
    // A hole that no view looks through may be closed for all that the views say.
    const Around all(captured_.scene);
    const auto knownOpen = [&](double x, double y) {
        constexpr int kSteps = 64;
        const glm::dvec3 from = novel.position + novel.orientation * novel.unproject(x, y, 0);
        const glm::dvec3 along = novel.viewDirection(x, y);
        const double middle = glm::dot(all.centre - from, along);
        const double aside = glm::distance(all.centre, from + middle * along);
        if (aside >= all.radius) return true;
        const double half = std::sqrt(all.radius * all.radius - aside * aside);
        for (int i = 0; i <= kSteps; ++i) {
            const double t = middle + half * (2.0 * i / kSteps - 1);
            if (t > 0 && std::ranges::none_of(views, [&](const ReferenceView& view) {
                    return looksThrough(view, from + t * along);
                }))
                return false;
        }
        return true;
    };
    const auto look = [&](double x, double y) {
        const Hit hit = captured_.scene.trace(novel, x, y);
        if (hit.any() ? sampled(hit) : knownOpen(x, y)) return;
        const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
        const bool corner = x == column;  // of four pixels
        for (int v = row - margin - corner; v <= row + margin; ++v)
            for (int u = column - margin - corner; u <= column + margin; ++u)
                if (guessed_.contains(u, v)) guessed_.at(u, v) = 1;
    };
    for (int y = 0; y <= novel.height; ++y) {
        for (int x = 0; x <= novel.width; ++x) {
            look(x, y);
            if (x < novel.width && y < novel.height) look(x + 0.5, y + 0.5);
        }
    }
}

Result<const Frame*> Pictures::of(const Drawn& how) {
    const auto found = drawn_.find(how);
    if (found != drawn_.end()) return &found->second;
    STX_TRY(Frame frame, drawBundle(captured_.bundle, captured_.novel, how));
    return &(drawn_[how] = std::move(frame));
}

std::int64_t Pictures::seenCount(int least) const {
    std::int64_t count = 0;
    for (const std::uint8_t seen : seenBy_.pixels()) count += seen >= least;
    return count;
}

std::optional<double> Pictures::openShare(const Frame& frame, int least) const {
    std::int64_t open = 0, seen = 0;
    for (std::size_t i = 0; i < seenBy_.count(); ++i) {
        if (seenBy_.data()[i] < least) continue;
        ++seen;
        open += frame.colour.data()[i].a < kCovered;
    }
    if (seen < kFewest) return std::nullopt;
    return 100.0 * double(open) / double(seen);
}

std::optional<double> Pictures::drawnShare(const Frame& frame) const {
    std::int64_t drawn = 0, empty = 0;
    for (std::size_t i = 0; i < empty_.count(); ++i) {
        if (empty_.data()[i] == 0 || guessed_.data()[i]) continue;
        ++empty;
        drawn += frame.colour.data()[i].a >= kCovered;
    }
    if (empty < kFewest) return std::nullopt;
    return 100.0 * double(drawn) / double(empty);
}

void Pictures::findOutlines() {
    const Camera& novel = captured_.novel;
    Image<int> surfaces(novel.width, novel.height);
    for (int y = 0; y < novel.height; ++y)
        for (int x = 0; x < novel.width; ++x)
            surfaces.at(x, y) = captured_.scene.trace(novel, x + 0.5, y + 0.5).surface;
    const int margin = static_cast<int>(std::ceil(captured_.from.magnification));
    const auto mark = [&](int x, int y) {
        for (int v = y - margin; v <= y + margin; ++v)
            for (int u = x - margin; u <= x + margin; ++u)
                if (nearOutline_.contains(u, v)) nearOutline_.at(u, v) = 1;
    };
    for (int y = 0; y < novel.height; ++y) {
        for (int x = 0; x < novel.width; ++x) {
            const int here = surfaces.at(x, y);
            if ((x > 0 && surfaces.at(x - 1, y) != here) ||
                (y > 0 && surfaces.at(x, y - 1) != here))
                mark(x, y);
        }
    }
}

double Pictures::squaredError(const Frame& frame, int x, int y, glm::ivec2 first) const {
    const glm::vec4 t =
        glm::vec4(captured_.truth.texture.rgba8()->at(x + first.x, y + first.y)) / 255.0f;
    const glm::vec3 d = glm::vec3(frame.colour.at(x, y)) - glm::vec3(t) * t.a;
    return glm::dot(d, d);
}

double Pictures::psnr(const Frame& frame, glm::ivec2 first) const {
    double squared = 0, judged = 0;
    for (int y = 0; y < frame.colour.height(); ++y) {
        for (int x = 0; x < frame.colour.width(); ++x) {
            if (guessed_.at(x + first.x, y + first.y)) continue;
            judged += 1;
            squared += squaredError(frame, x, y, first);
        }
    }
    return decibels(squared, 3.0 * judged);
}

std::optional<double> Pictures::psnrWhere(const Frame& frame,
                                          const Image<std::uint8_t>& mask) const {
    double squared = 0, judged = 0;
    for (int y = 0; y < frame.colour.height(); ++y) {
        for (int x = 0; x < frame.colour.width(); ++x) {
            if (guessed_.at(x, y) || !mask.at(x, y)) continue;
            judged += 1;
            squared += squaredError(frame, x, y);
        }
    }
    if (judged < double(kFewest)) return std::nullopt;
    return decibels(squared, 3.0 * judged);
}

std::optional<double> Pictures::psnrAwayFromOutlines(const Frame& frame) const {
    Image<std::uint8_t> inside = nearOutline_;
    for (std::uint8_t& pixel : inside.pixels()) pixel = !pixel;
    return psnrWhere(frame, inside);
}

double psnrBetween(const Frame& a, const Frame& b) {
    if (a.colour.size() != b.colour.size()) return 0;
    double squared = 0;
    for (std::size_t i = 0; i < a.colour.count(); ++i) {
        const glm::vec4 d = a.colour.data()[i] - b.colour.data()[i];
        squared += glm::dot(glm::vec3(d), glm::vec3(d));
    }
    return decibels(squared, 3.0 * double(a.colour.count()));
}

double worseBy(double psnr, double than) {
    constexpr double kGood = 48;
    return std::min(than, kGood) - std::min(psnr, kGood);
}
