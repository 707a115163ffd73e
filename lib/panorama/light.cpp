#include <algorithm>
#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/panorama/footprints.hpp"
#include "lib/panorama/small_solver.hpp"

namespace stx::panorama {
namespace {

/// Light between these is neither noise nor clipped (linear, before gains).
constexpr float kDarkest = 0.003f, kLightest = 0.8f;

float medianOf(std::vector<float>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

bool boxesMeet(const Footprint& a, const Footprint& b, int gridWidth) {
    if (a.box.y >= b.box.y + b.box.height || b.box.y >= a.box.y + a.box.height) return false;
    return a.column(b.box.x, gridWidth) >= 0 || b.column(a.box.x, gridWidth) >= 0;
}

/// Calls visit(cell in a, cell in b) for each cell that both see.
template <class Visit>
void shared(const Footprint& a, const Footprint& b, int gridWidth, const Visit& visit) {
    const int top = std::max(a.box.y, b.box.y);
    const int bottom = std::min(a.box.y + a.box.height, b.box.y + b.box.height);
    for (int y = top; y < bottom; ++y)
        for (int x = 0; x < a.box.width; ++x) {
            const int other = b.column(a.box.x + x, gridWidth);
            if (other < 0) continue;
            const glm::ivec2 inA(x, y - a.box.y), inB(other, y - b.box.y);
            if (a.inside.at(inA.x, inA.y) > 0 && b.inside.at(inB.x, inB.y) > 0) visit(inA, inB);
        }
}

/// Mean of a square around each pixel, by its weight; three times, which is nearly a bell.
void smooth(Image<glm::vec4>& image, int radius) {
    const int w = image.width(), h = image.height();
    std::vector<glm::vec4> line(static_cast<std::size_t>(std::max(w, h)));
    const auto run = [&](int count, const auto& at) {
        for (int i = 0; i < count; ++i) line[static_cast<std::size_t>(i)] = at(i);
        glm::dvec4 sum(0);
        for (int i = 0; i < std::min(radius, count); ++i)
            sum += glm::dvec4(line[static_cast<std::size_t>(i)]);
        for (int i = 0; i < count; ++i) {
            if (i + radius < count) sum += glm::dvec4(line[static_cast<std::size_t>(i + radius)]);
            if (i - radius - 1 >= 0)
                sum -= glm::dvec4(line[static_cast<std::size_t>(i - radius - 1)]);
            at(i) = glm::vec4(sum / (2.0 * radius + 1));
        }
    };
    for (int pass = 0; pass < 3; ++pass) {
        for (int y = 0; y < h; ++y) run(w, [&](int i) -> glm::vec4& { return image.at(i, y); });
        for (int x = 0; x < w; ++x) run(h, [&](int i) -> glm::vec4& { return image.at(x, i); });
    }
}

}  // namespace

std::vector<glm::dvec3> findGains(const std::vector<Footprint>& prints, int gridWidth) {
    const std::size_t n = prints.size();
    struct Ratio {
        std::size_t a, b;
        glm::dvec3 log;  ///< of a's light over b's
        double weight;
    };
    std::vector<std::vector<Ratio>> rows(n);
    parallelFor(0, static_cast<std::int64_t>(n), [&](std::int64_t i) {
        const auto a = static_cast<std::size_t>(i);
        for (std::size_t b = a + 1; b < n; ++b) {
            if (!boxesMeet(prints[a], prints[b], gridWidth)) continue;
            std::array<std::vector<float>, 3> logs;
            shared(prints[a], prints[b], gridWidth, [&](glm::ivec2 pa, glm::ivec2 pb) {
                const glm::vec3 ca = prints[a].colour.at(pa.x, pa.y);
                const glm::vec3 cb = prints[b].colour.at(pb.x, pb.y);
                for (int c = 0; c < 3; ++c)
                    if (std::min(ca[c], cb[c]) > kDarkest && std::max(ca[c], cb[c]) < kLightest)
                        logs[static_cast<std::size_t>(c)].push_back(std::log(ca[c] / cb[c]));
            });
            if (std::min({logs[0].size(), logs[1].size(), logs[2].size()}) < 30) continue;
            Ratio ratio{a, b, {}, std::sqrt(static_cast<double>(logs[1].size()))};
            for (int c = 0; c < 3; ++c) ratio.log[c] = medianOf(logs[static_cast<std::size_t>(c)]);
            rows[a].push_back(ratio);
        }
    });
    std::vector<glm::dvec3> gains(n, glm::dvec3(1));
    for (int c = 0; c < 3; ++c) {
        std::vector<double> matrix(n * n, 0.0), right(n, 0.0);
        for (std::size_t i = 0; i < n; ++i) matrix[i * n + i] += 0.05;  // no gain in the mean
        for (const auto& row : rows)
            for (const Ratio& r : row) {
                matrix[r.a * n + r.a] += r.weight;
                matrix[r.b * n + r.b] += r.weight;
                matrix[r.a * n + r.b] -= r.weight;
                matrix[r.b * n + r.a] -= r.weight;
                right[r.a] -= r.weight * r.log[c];
                right[r.b] += r.weight * r.log[c];
            }
        if (!solveSymmetric(matrix, right)) continue;
        for (std::size_t i = 0; i < n; ++i) gains[i][c] = std::exp(std::clamp(right[i], -3.0, 3.0));
    }
    return gains;
}

std::vector<Image<glm::vec3>> findCorrections(const std::vector<Footprint>& prints,
                                              const std::vector<glm::dvec3>& gains, int gridWidth) {
    const std::size_t n = prints.size();
    const int height = gridWidth / 2;
    // The mean of all pictures, each weighing more the farther inside a place is.
    Image<glm::vec4> mean(gridWidth, height, glm::vec4(0));
    for (std::size_t k = 0; k < n; ++k) {
        const Footprint& f = prints[k];
        for (int y = 0; y < f.box.height; ++y)
            for (int x = 0; x < f.box.width; ++x) {
                const float w = f.inside.at(x, y);
                if (w <= 0) continue;
                const int column = ((f.box.x + x) % gridWidth + gridWidth) % gridWidth;
                mean.at(column, f.box.y + y) +=
                    w * glm::vec4(withGain(f.colour.at(x, y), gains[k]), 1);
            }
    }
    std::vector<Image<glm::vec3>> out(n);
    parallelFor(0, static_cast<std::int64_t>(n), [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        const Footprint& f = prints[k];
        Image<glm::vec4> logs(f.box.width, f.box.height, glm::vec4(0));
        for (int y = 0; y < f.box.height; ++y)
            for (int x = 0; x < f.box.width; ++x) {
                if (f.inside.at(x, y) <= 0) continue;
                const int column = ((f.box.x + x) % gridWidth + gridWidth) % gridWidth;
                const glm::vec4 all = mean.at(column, f.box.y + y);
                const glm::vec3 raw = f.colour.at(x, y);
                const glm::vec3 own = withGain(raw, gains[k]), other = glm::vec3(all) / all.a;
                const glm::vec3 log = glm::log((other + 0.01f) / (own + 0.01f));
                // What differs by more is something else, not another light.
                if (glm::length(log) > 0.5f) continue;
                logs.at(x, y) = glm::vec4(log, 1);
            }
        // A sixteenth of the picture is smooth enough to leave its details alone.
        smooth(logs, std::max(2, std::min(f.box.width, f.box.height) / 16));
        out[k] = Image<glm::vec3>(f.box.width, f.box.height, glm::vec3(1));
        for (std::size_t p = 0; p < logs.count(); ++p) {
            const glm::vec4 l = logs.pixels()[p];
            if (l.a > 1e-3f) out[k].pixels()[p] = glm::exp(glm::vec3(l) / l.a);
        }
    });
    return out;
}

}  // namespace stx::panorama
