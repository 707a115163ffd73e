#include "lib/splats/transform.hpp"

#include <cmath>

#include <Eigen/Dense>
#include <glm/gtc/packing.hpp>
#include <glm/gtc/quaternion.hpp>

#include "lib/base/parallel.hpp"
#include "lib/splats/harmonics.hpp"

namespace stx {
namespace {

using Turn = Eigen::MatrixXd;

/// The nearest orthogonal map of a linear one, which mirrors where that does.
glm::dmat3 turnOf(const glm::dmat3& linear) {
    Eigen::Matrix3d m;
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) m(r, c) = linear[c][r];
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Matrix3d turn = svd.matrixU() * svd.matrixV().transpose();
    glm::dmat3 out;
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) out[c][r] = turn(r, c);
    return out;
}

/// What turns and mirrors coefficients with the cloud: f'(v) = f(T^-1 v), which determines them by
/// the values in enough directions.
Turn turnOfHarmonics(const glm::dmat3& turn, int degree) {
    constexpr int kDirections = 64;
    const int n = SplatCloud::coefficientCount(degree);
    Eigen::MatrixXd now(kDirections, n), before(kDirections, n);
    for (int i = 0; i < kDirections; ++i) {
        // A Fibonacci sphere.
        const double z = 1.0 - (2.0 * i + 1.0) / kDirections, a = 2.399963229728653 * i,
                     s = std::sqrt(1.0 - z * z);
        const glm::dvec3 v(s * std::cos(a), s * std::sin(a), z);
        float basis[16];
        splats::harmonicsBasis(v, degree, basis);
        for (int k = 0; k < n; ++k) now(i, k) = basis[k];
        splats::harmonicsBasis(glm::transpose(turn) * v, degree, basis);
        for (int k = 0; k < n; ++k) before(i, k) = basis[k];
    }
    return now.householderQr().solve(before);
}

}  // namespace

void transformSplats(SplatCloud& cloud, std::size_t first, const glm::dmat4& worldFromCloud) {
    if (worldFromCloud == glm::dmat4(1.0)) return;
    const glm::dmat3 linear(worldFromCloud);
    const glm::dmat3 turn = turnOf(linear);
    const double scale = std::cbrt(std::abs(glm::determinant(linear)));
    // Without a stretch and a mirror the axes stay.
    double rest = 0;
    for (int c = 0; c < 3; ++c) rest = std::max(rest, glm::length(linear[c] - turn[c] * scale));
    const bool rigid = rest <= 1e-6 * scale && glm::determinant(turn) > 0;
    const glm::dquat rotation = rigid ? glm::quat_cast(turn) : glm::dquat(1, 0, 0, 0);
    const Turn harmonics = cloud.degree > 0 ? turnOfHarmonics(turn, cloud.degree) : Turn();
    const auto padded = static_cast<std::size_t>(SplatCloud::paddedCount(cloud.degree));
    const auto apply = [&](std::size_t i) {
        cloud.positions[i] =
            glm::vec3(worldFromCloud * glm::dvec4(glm::dvec3(cloud.positions[i]), 1.0));
        const glm::vec4 q = cloud.rotations[i];
        const glm::dquat own = glm::normalize(glm::dquat(q.w, q.x, q.y, q.z));
        glm::dquat turned = rotation * own;
        if (rigid) {
            cloud.scales[i] *= static_cast<float>(scale);
        } else {
            glm::dmat3 axes = linear * glm::mat3_cast(own);
            for (int k = 0; k < 3; ++k) axes[k] *= static_cast<double>(cloud.scales[i][k]);
            Eigen::Matrix3d half;
            for (int c = 0; c < 3; ++c)
                for (int r = 0; r < 3; ++r) half(r, c) = axes[c][r];
            const Eigen::JacobiSVD<Eigen::Matrix3d> svd(half, Eigen::ComputeFullU);
            glm::dmat3 frame;
            for (int c = 0; c < 3; ++c) {
                for (int r = 0; r < 3; ++r) frame[c][r] = svd.matrixU()(r, c);
                cloud.scales[i][c] = static_cast<float>(svd.singularValues()(c));
            }
            if (glm::determinant(frame) < 0) frame[2] = -frame[2];
            turned = glm::quat_cast(frame);
        }
        cloud.rotations[i] = glm::vec4(static_cast<float>(turned.x), static_cast<float>(turned.y),
                                       static_cast<float>(turned.z), static_cast<float>(turned.w));
        for (int channel = 0; channel < 3 && padded > 0; ++channel) {
            Eigen::VectorXd values(harmonics.cols());
            for (int k = 0; k < values.size(); ++k)
                values(k) = glm::unpackHalf1x16(
                    cloud.harmonics[(i * 3 + static_cast<std::size_t>(channel)) * padded +
                                    static_cast<std::size_t>(k)]);
            values = harmonics * values;
            for (int k = 0; k < values.size(); ++k)
                cloud.setHarmonic(i, k, channel, static_cast<float>(values(k)));
        }
    };
    parallelFor(first, cloud.positions.size(), 4096, [&](std::size_t i) { apply(i); });
}

}  // namespace stx
