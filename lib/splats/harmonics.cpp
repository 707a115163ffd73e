#include "lib/splats/harmonics.hpp"

#include <algorithm>

#include "lib/model/splat_cloud.hpp"

namespace stx::splats {

void harmonicsBasis(glm::dvec3 v, int degree, float* basis) {
    const double x = v.x, y = v.y, z = v.z, xx = x * x, yy = y * y, zz = z * z;
    const double values[15] = {-0.4886025119029199 * y,
                               0.4886025119029199 * z,
                               -0.4886025119029199 * x,
                               1.092548430592079 * x * y,
                               -1.092548430592079 * y * z,
                               0.3153915652525200 * (2 * zz - xx - yy),
                               -1.092548430592079 * x * z,
                               0.5462742152960395 * (xx - yy),
                               -0.5900435899266435 * y * (3 * xx - yy),
                               2.890611442640554 * x * y * z,
                               -0.4570457994644657 * y * (4 * zz - xx - yy),
                               0.3731763325901154 * z * (2 * zz - 3 * xx - 3 * yy),
                               -0.4570457994644657 * x * (4 * zz - xx - yy),
                               1.445305721320277 * z * (xx - yy),
                               -0.5900435899266435 * x * (xx - 3 * yy)};
    std::fill_n(basis, SplatCloud::paddedCount(degree), 0.0f);
    for (int i = 0; i < SplatCloud::coefficientCount(degree); ++i)
        basis[i] = static_cast<float>(values[i]);
}

}  // namespace stx::splats
