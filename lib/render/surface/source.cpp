#include "lib/render/surface/source.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/parallel.hpp"

namespace stx::surface {
namespace {

/// Neighbours whose q differ by less than this share of it are one surface; by more than the
/// second, never; between them, when the slope goes on.
constexpr float kLinkAlways = 0.005f, kLinkNever = 0.03f;
/// A leaf may leave its plane by this many pixels of parallax at a right angle.
constexpr float kPlanarPixels = 0.08f;

/// Whether neighbours b and c lie on one surface, given the pixels before and after them (0 =
/// none). Small steps always do; larger ones when the surface goes on with the same slope.
bool linked(const DepthAxis& axis, float codeStep, float a, float b, float c, float d) {
    if (!(b > 0.0f && c > 0.0f)) return false;
    const float step = c - b, size = std::abs(step);
    const float whole = axis.whole(std::max(b, c));
    if (size < kLinkAlways * whole + 1.5f * codeStep * axis.perUnit(std::max(b, c))) return true;
    if (size >= kLinkNever * whole) return false;
    const float agree = 0.5f * size;
    return (a > 0.0f && std::abs(step - (b - a)) < agree) ||
           (d > 0.0f && std::abs(step - (d - c)) < agree);
}

double farthestPoint(const ReferenceView& view) {
    double farthest = 0.0;
    for (const float dist : view.depth.pixels())
        if (hasPoint(dist)) farthest = std::max(farthest, static_cast<double>(dist));
    return farthest;
}

void findLinks(Source& s) {
    const DepthAxis axis = s.space.axis;
    parallelForBlocks(0, s.height, 32, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y) {
            for (int x = 0; x < s.width; ++x) {
                std::uint8_t bits = 0;
                const auto at = [&](int nx, int ny) {
                    return s.q.contains(nx, ny) ? s.q.at(nx, ny) : 0.0f;
                };
                const float q = s.q.at(x, y);
                if (linked(axis, s.step, at(x - 1, y), q, at(x + 1, y), at(x + 2, y)))
                    bits |= Source::kLinkRight;
                if (linked(axis, s.step, at(x, y - 1), q, at(x, y + 1), at(x, y + 2)))
                    bits |= Source::kLinkDown;
                const auto empty = [&](int nx, int ny) {
                    return s.q.contains(nx, ny) && s.q.at(nx, ny) == 0.0f;
                };
                if (s.q.at(x, y) > 0.0f &&
                    (empty(x - 1, y) || empty(x + 1, y) || empty(x, y - 1) || empty(x, y + 1)))
                    bits |= Source::kBesideBackground;
                s.info.at(x, y) = bits;
            }
        }
    });
}

/// Fills the block's edge masks and the distances to edges.
void findEdges(Source& s) {
    Image<std::uint8_t> distance(s.width, s.height, kFarFromEdge);
    parallelForBlocks(0, s.blocksY, 1, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from) * kBlock; y < std::min<int>(to * kBlock, s.height);
             ++y) {
            for (int x = 0; x < s.width; ++x) {
                const bool point = s.q.at(x, y) > 0.0f;
                const bool all = point && s.linkRight(x, y) && s.linkDown(x, y) && x > 0 && y > 0 &&
                                 s.linkRight(x - 1, y) && s.linkDown(x, y - 1);
                if (all && (!s.hasAlpha || s.alpha(x, y) >= 1.0f)) continue;
                // Where pruning took the neighbour away the surface goes on: that is the border of
                // what is told, but no edge.
                const bool goesOn = point && x > 0 && y > 0 && x + 1 < s.width &&
                                    y + 1 < s.height && (s.linkRight(x, y) || s.pruned(x + 1, y)) &&
                                    (s.linkDown(x, y) || s.pruned(x, y + 1)) &&
                                    (s.linkRight(x - 1, y) || s.pruned(x - 1, y)) &&
                                    (s.linkDown(x, y - 1) || s.pruned(x, y - 1));
                if (!s.pruned(x, y) && !(goesOn && (!s.hasAlpha || s.alpha(x, y) >= 1.0f)))
                    distance.at(x, y) = 0;
                if (!point || all) continue;
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
                const auto in = distance.row(y);
                const auto out = rows.row(y);
                for (int x = 0; x < s.width; ++x)
                    out[x] =
                        std::min({in[std::max(x - 1, 0)], in[x], in[std::min(x + 1, s.width - 1)]});
            }
        });
        parallelForBlocks(0, s.height, 32, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y) {
                const auto above = rows.row(std::max(y - 1, 0));
                const auto here = rows.row(y);
                const auto below = rows.row(std::min(y + 1, s.height - 1));
                const auto out = distance.row(y);
                for (int x = 0; x < s.width; ++x) {
                    const std::uint8_t nearest = std::min({above[x], here[x], below[x]});
                    out[x] = std::min<std::uint8_t>(out[x], static_cast<std::uint8_t>(nearest + 1));
                }
            }
        });
    }
    for (std::size_t i = 0; i < distance.count(); ++i)
        s.info.data()[i] |= static_cast<std::uint8_t>(distance.data()[i] << 4);
}

/// The least-squares plane of (size+1)² pixels, when no pixel leaves it by more than `tolerance`.
bool fitPlane(const Source& s, int x0, int y0, int size, float tolerance, Leaf& leaf) {
    const int n = size + 1;
    for (int y = y0; y <= y0 + size; ++y)
        for (int x = x0; x <= x0 + size; ++x)
            if (s.edgeDistance(x, y) < 3) return false;
    const float anchor = s.q.at(x0, y0);
    float sum = 0, sumX = 0, sumY = 0;
    const float half = static_cast<float>(size) * 0.5f;
    for (int y = 0; y < n; ++y) {
        const float* row = &s.q.at(x0, y0 + y);
        for (int x = 0; x < n; ++x) {
            const float d = row[x] - anchor;
            sum += d;
            sumX += d * (static_cast<float>(x) - half);
            sumY += d * (static_cast<float>(y) - half);
        }
    }
    const float spread =
        static_cast<float>(n) * static_cast<float>(n) * static_cast<float>(n * n - 1) / 12.0f;
    leaf.x = static_cast<std::uint16_t>(x0);
    leaf.y = static_cast<std::uint16_t>(y0);
    leaf.size = static_cast<std::uint16_t>(size);
    leaf.qx = sumX / spread;
    leaf.qy = sumY / spread;
    leaf.q0 = anchor + sum / static_cast<float>(n * n) - half * (leaf.qx + leaf.qy);
    const float limit = tolerance * s.space.axis.whole(anchor);
    for (int y = 0; y < n; ++y) {
        const float* row = &s.q.at(x0, y0 + y);
        for (int x = 0; x < n; ++x) {
            const float on =
                leaf.q0 + leaf.qx * static_cast<float>(x) + leaf.qy * static_cast<float>(y);
            if (!(std::abs(on - row[x]) <= limit)) return false;
        }
    }
    return true;
}

void divide(const Source& s, int x, int y, int size, float tolerance, SourceBlock& block,
            std::vector<Leaf>& leaves) {
    if (x >= s.width - 1 || y >= s.height - 1) return;
    if (size > 1 && x + size < s.width && y + size < s.height) {
        Leaf leaf;
        if (fitPlane(s, x, y, size, tolerance, leaf)) {
            leaves.push_back(leaf);
            return;
        }
    }
    if (size > 1) {
        const int h = size / 2;
        divide(s, x, y, h, tolerance, block, leaves);
        divide(s, x + h, y, h, tolerance, block, leaves);
        divide(s, x, y + h, h, tolerance, block, leaves);
        divide(s, x + h, y + h, h, tolerance, block, leaves);
        return;
    }
    const int links =
        s.linkRight(x, y) + s.linkDown(x, y) + s.linkRight(x, y + 1) + s.linkDown(x + 1, y);
    if (links < 2) return;
    block.cells[y % kBlock] |= static_cast<std::uint16_t>(1u << (x % kBlock));
    block.anyCell = true;
}

/// How far the code of the depth makes planes uneven: the median second difference, relative.
float unevenness(const Source& s) {
    std::vector<float> values;
    const int step = std::max(1, s.height / 64);
    for (int y = step / 2; y < s.height; y += step) {
        for (int x = 1; x + 1 < s.width; x += 3) {
            if (s.edgeDistance(x, y) < 3) continue;
            const float q = s.q.at(x, y);
            if (!(q > 0 && s.q.at(x - 1, y) > 0 && s.q.at(x + 1, y) > 0)) continue;
            values.push_back(std::abs(s.q.at(x - 1, y) - 2 * q + s.q.at(x + 1, y)) /
                             s.space.axis.whole(q));
        }
    }
    if (values.empty()) return 0.0f;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

void findLeaves(Source& s) {
    s.noise = std::min(unevenness(s), 0.01f);
    const double focal = std::max(s.space.camera.fx, s.space.camera.fy);
    const double perPixel = 1.0 / (focal * (s.space.axis.inverse ? 1.0 : s.space.axis.unit));
    s.flat = static_cast<float>(
        std::clamp<double>(1.5 * s.noise, kPlanarPixels * perPixel, 3 * kPlanarPixels * perPixel));
    std::vector<std::vector<Leaf>> rows(static_cast<std::size_t>(s.blocksY));
    parallelFor(0, s.blocksY, [&](std::int64_t by) {
        auto& leaves = rows[static_cast<std::size_t>(by)];
        for (int bx = 0; bx < s.blocksX; ++bx) {
            auto& block = s.blocks[static_cast<std::size_t>(by) * s.blocksX + bx];
            const int x0 = bx * kBlock, y0 = static_cast<int>(by) * kBlock;
            float low = std::numeric_limits<float>::max(), high = 0;
            for (int y = y0; y <= std::min(y0 + kBlock, s.height - 1); ++y) {
                for (int x = x0; x <= std::min(x0 + kBlock, s.width - 1); ++x) {
                    const float q = s.q.at(x, y);
                    if (!(q > 0)) continue;
                    low = std::min(low, q);
                    high = std::max(high, q);
                }
            }
            if (!(high > 0)) continue;
            block.qMin = low;
            block.qMax = high;
            block.leafBegin = static_cast<std::uint32_t>(leaves.size());
            divide(s, x0, y0, kBlock, s.flat, block, leaves);
            block.leafEnd = static_cast<std::uint32_t>(leaves.size());
        }
    });
    for (int by = 0; by < s.blocksY; ++by) {
        const auto base = static_cast<std::uint32_t>(s.leaves.size());
        const auto& leaves = rows[static_cast<std::size_t>(by)];
        s.leaves.insert(s.leaves.end(), leaves.begin(), leaves.end());
        for (int bx = 0; bx < s.blocksX; ++bx) {
            auto& block = s.blocks[static_cast<std::size_t>(by) * s.blocksX + bx];
            block.leafBegin += base;
            block.leafEnd += base;
        }
    }
}

/// See Source::told.
double toldShare(const Source& s) {
    std::int64_t points = 0, object = 0;
    for (int y = 0; y < s.height; ++y) {
        for (int x = 0; x < s.width; ++x) {
            points += s.q.at(x, y) > 0.0f;
            object += s.q.at(x, y) > 0.0f || s.alpha(x, y) >= 1.0f;
        }
    }
    return object > 0 ? static_cast<double>(points) / static_cast<double>(object) : 1.0;
}

}  // namespace

PixelSpace::PixelSpace(const Camera& c, double farthest) : camera(c) {
    axis.inverse = !c.orthographic;
    if (c.orthographic) {
        // A depth range as wide as the window makes shares of it mean what they do in perspective.
        axis.unit = 1.2 * std::max(c.width / c.fx, c.height / c.fy);
        axis.origin = farthest + axis.unit;
    }
    // Columns of camera points (X, Y, Z, 1) up to scale over (x, y, q, 1), and back.
    glm::dmat4 cameraFromPixel(0.0), pixelFromCamera(0.0);
    cameraFromPixel[0][0] = 1.0 / c.fx;
    cameraFromPixel[3][0] = -c.cx / c.fx;
    cameraFromPixel[1][1] = -1.0 / c.fy;
    cameraFromPixel[3][1] = c.cy / c.fy;
    pixelFromCamera[0][0] = c.fx;
    pixelFromCamera[1][1] = -c.fy;
    if (axis.inverse) {
        cameraFromPixel[3][2] = -1.0;
        cameraFromPixel[2][3] = 1.0;
        pixelFromCamera[2][0] = -c.cx;
        pixelFromCamera[2][1] = -c.cy;
        pixelFromCamera[3][2] = 1.0;
        pixelFromCamera[2][3] = -1.0;
    } else {
        cameraFromPixel[2][2] = axis.unit;
        cameraFromPixel[3][2] = -axis.origin;
        cameraFromPixel[3][3] = 1.0;
        pixelFromCamera[3][0] = c.cx;
        pixelFromCamera[3][1] = c.cy;
        pixelFromCamera[2][2] = 1.0 / axis.unit;
        pixelFromCamera[3][2] = axis.origin / axis.unit;
        pixelFromCamera[3][3] = 1.0;
    }
    pixelFromWorld = pixelFromCamera * c.cameraFromWorld();
    worldFromPixel = c.worldFromCamera() * cameraFromPixel;
}

Warp warpFrom(const glm::dmat4& m) {
    Warp w;
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            w.m[static_cast<std::size_t>(row * 4 + column)] = static_cast<float>(m[column][row]);
    return w;
}

glm::vec2 Source::gradient(int x, int y) const {
    const float here = q.at(x, y);
    const auto choose = [](bool a, float da, bool b, float db) {
        if (a && b) {
            if (std::abs(da) < 0.5f * std::abs(db)) return da;
            if (std::abs(db) < 0.5f * std::abs(da)) return db;
            return 0.5f * (da + db);
        }
        return a ? da : b ? db : 0.0f;
    };
    const bool left = x > 0 && linkRight(x - 1, y), right = linkRight(x, y);
    const bool up = y > 0 && linkDown(x, y - 1), down = linkDown(x, y);
    return {
        choose(left, left ? here - q.at(x - 1, y) : 0.0f, right,
               right ? q.at(x + 1, y) - here : 0.0f),
        choose(up, up ? here - q.at(x, y - 1) : 0.0f, down, down ? q.at(x, y + 1) - here : 0.0f)};
}

Source prepareSource(const ReferenceView& view) {
    Source s;
    s.view = &view;
    s.width = view.depth.width();
    s.height = view.depth.height();
    s.space = PixelSpace(view.camera, farthestPoint(view));
    if (view.depthBits < 32) s.step = static_cast<float>(view.depthCode().step());
    s.q = Image<float>(s.width, s.height);
    s.info = Image<std::uint8_t>(s.width, s.height);
    s.blocksX = (s.width + kBlock - 1) / kBlock;
    s.blocksY = (s.height + kBlock - 1) / kBlock;
    s.blocks.resize(static_cast<std::size_t>(s.blocksX) * s.blocksY);
    std::vector<char> rowHasAlpha(static_cast<std::size_t>(s.height), 0);
    parallelForBlocks(0, s.height, 32, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y) {
            for (int x = 0; x < s.width; ++x) {
                const float dist = view.depth.at(x, y);
                if (hasPoint(dist) && dist > 0.0f)
                    s.q.at(x, y) = static_cast<float>(s.space.axis.q(dist));
                else if (view.pruned && s.alpha(x, y) >= 1.0f)
                    s.q.at(x, y) = -1.0f;
                if (s.alpha(x, y) < 1.0f) rowHasAlpha[static_cast<std::size_t>(y)] = 1;
            }
        }
    });
    s.hasAlpha = std::find(rowHasAlpha.begin(), rowHasAlpha.end(), 1) != rowHasAlpha.end();
    s.told = toldShare(s);
    findLinks(s);
    findEdges(s);
    findLeaves(s);
    return s;
}

double borderCoverage(const Source& s) {
    std::int64_t points = 0, all = 0;
    const auto count = [&](int x, int y) {
        ++all;
        // Full alpha without a depth is a pixel whose distance is not told: it was pruned, or a
        // sensor missed it. The scene goes on there all the same.
        points += s.q.at(x, y) > 0.0f || s.alpha(x, y) >= 1.0f;
    };
    for (int x = 0; x < s.width; ++x) {
        count(x, 0);
        count(x, s.height - 1);
    }
    for (int y = 0; y < s.height; ++y) {
        count(0, y);
        count(s.width - 1, y);
    }
    return static_cast<double>(points) / static_cast<double>(all);
}

}  // namespace stx::surface
