#include "lib/refine/local_plane.hpp"

#include <algorithm>

namespace stx {

LocalPlane fitAround(const Image<float>& q, int x, int y, int radius, const LocalPlane& near,
                     float band) {
    float n = 0, nn = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0, sq = 0, sxq = 0, syq = 0;
    LocalPlane out = near;
    out.points = 0;
    const float reach = 1.0f / static_cast<float>((radius + 1) * (radius + 1));
    const float inverseBand = 1.0f / band;
    const int y0 = std::max(y - radius, 0), y1 = std::min(y + radius, q.height() - 1);
    const int x0 = std::max(x - radius, 0), x1 = std::min(x + radius, q.width() - 1);
    for (int ny = y0; ny <= y1; ++ny) {
        const auto row = q.row(ny);
        const auto dy = static_cast<float>(ny - y);
        for (int nx = x0; nx <= x1; ++nx) {
            const float there = row[nx];
            if (!(there > 0.0f)) continue;
            const auto dx = static_cast<float>(nx - x);
            const float above = there - near.q0;
            const float e = (above - near.gx * dx - near.gy * dy) * inverseBand;
            const float onSurface = 1.0f - e * e, close = 1.0f - (dx * dx + dy * dy) * reach;
            if (!(onSurface > 0.0f) || !(close > 0.0f)) continue;
            const float w = onSurface * onSurface * close;
            ++out.points;
            n += w;
            nn += w * w;
            sx += w * dx;
            sy += w * dy;
            sxx += w * dx * dx;
            sxy += w * dx * dy;
            syy += w * dy * dy;
            sq += w * above;
            sxq += w * dx * above;
            syq += w * dy * above;
        }
    }
    if (!(n > 0.0f)) return out;
    const float inverse = 1.0f / n;
    out.alike = n * n / nn;
    const float mx = sx * inverse, my = sy * inverse, mq = sq * inverse;
    const float xx = sxx - mx * sx, xy = sxy - mx * sy, yy = syy - my * sy;
    const float xq = sxq - mx * sq, yq = syq - my * sq;
    const float det = xx * yy - xy * xy;
    if (!(det > 0.01f * xx * yy) || !(xx > 0.5f) || !(yy > 0.5f)) {
        // Points on a line, or hardly any: their mean.
        out.q0 = near.q0 + mq - near.gx * mx - near.gy * my;
        return out;
    }
    out.gx = (xq * yy - yq * xy) / det;
    out.gy = (yq * xx - xq * xy) / det;
    out.q0 = near.q0 + mq - out.gx * mx - out.gy * my;
    return out;
}

}  // namespace stx
