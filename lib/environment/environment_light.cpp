#include "lib/environment/environment_light.hpp"

#include <algorithm>
#include <cmath>

#include <glm/gtc/constants.hpp>

#include "lib/base/parallel.hpp"
#include "shaders/shared/language.hpp"

namespace stx {
namespace {

/// Texels a side of the faces that light is added up over.
constexpr int kCoarse = EnvironmentLight::kGlossSide;
/// Above this exponent a lobe is narrower than those: it is averaged by the environment's own
/// footprint.
constexpr float kNarrow = EnvironmentLight::kMostTableShininess;
/// What weighs less than this share of a lobe's middle is left out.
constexpr float kLeastWeight = 1e-3f;

/// A piece of the sphere and the light from there.
struct Piece {
    glm::vec3 direction;
    float solidAngle;
    glm::vec3 light;
};

std::vector<Piece> piecesOf(const EnvironmentMap& map) {
    std::vector<Piece> pieces(6 * kCoarse * kCoarse);
    parallelFor(0, 6 * kCoarse, 4, [&](int row) {
        for (int x = 0; x < kCoarse; ++x) {
            const glm::dvec3 d =
                faceDirection(static_cast<CubeFace>(row / kCoarse),
                              {(x + 0.5) / kCoarse, (row % kCoarse + 0.5) / kCoarse});
            const double length = glm::length(d);
            Piece& piece = pieces[static_cast<std::size_t>(row) * kCoarse + x];
            piece.direction = glm::vec3(d / length);
            piece.solidAngle =
                static_cast<float>(4.0 / (kCoarse * kCoarse) / (length * length * length));
            piece.light = glm::vec3(map.sample(piece.direction, std::sqrt(piece.solidAngle), true));
        }
    });
    return pieces;
}

std::array<glm::vec3, 9> harmonicsOf(const std::vector<Piece>& pieces) {
    std::array<glm::dvec3, 9> sums{};
    for (const Piece& p : pieces) {
        const double x = p.direction.x, y = p.direction.y, z = p.direction.z;
        const double basis[9] = {0.282095,
                                 0.488603 * y,
                                 0.488603 * z,
                                 0.488603 * x,
                                 1.092548 * x * y,
                                 1.092548 * y * z,
                                 0.315392 * (3 * z * z - 1),
                                 1.092548 * x * z,
                                 0.546274 * (x * x - y * y)};
        for (int i = 0; i < 9; ++i) sums[i] += glm::dvec3(p.light) * (basis[i] * p.solidAngle);
    }
    // Lambert's cosine over pi: 1, 2/3 and 1/4 of the orders; times the basis' own constants.
    const double factors[9] = {0.282095,         0.488603 * 2 / 3, 0.488603 * 2 / 3,
                               0.488603 * 2 / 3, 1.092548 / 4,     1.092548 / 4,
                               0.315392 / 4,     1.092548 / 4,     0.546274 / 4};
    std::array<glm::vec3, 9> out;
    for (std::size_t i = 0; i < 9; ++i) out[i] = glm::vec3(sums[i] * factors[i]);
    return out;
}

/// Faces in which each texel is the mean around it, weighed by cos^shininess.
Environment lobesOf(const std::vector<Piece>& pieces, float shininess) {
    // cos^shininess by a table: its steps are far finer than a lobe.
    constexpr int kSteps = 4096;
    std::vector<float> power(kSteps + 2);
    for (int i = 0; i <= kSteps + 1; ++i)
        power[i] = std::pow(std::min(1.0f, static_cast<float>(i) / kSteps), shininess);
    const float least = std::pow(kLeastWeight, 1.0f / shininess);
    Environment lobes;
    for (int f = 0; f < 6; ++f) {
        RgbaFloatImage face(kCoarse, kCoarse);
        parallelFor(0, kCoarse, 1, [&](int y) {
            for (int x = 0; x < kCoarse; ++x) {
                const glm::vec3 d(glm::normalize(faceDirection(
                    static_cast<CubeFace>(f), {(x + 0.5) / kCoarse, (y + 0.5) / kCoarse})));
                glm::vec3 sum(0.0f);
                float weights = 0;
                for (const Piece& p : pieces) {
                    const float cosine = glm::dot(d, p.direction);
                    if (cosine < least) continue;
                    const float at = std::min(cosine, 1.0f) * kSteps;
                    const auto i = static_cast<std::size_t>(at);
                    const float w =
                        (power[i] + (power[i + 1] - power[i]) * (at - static_cast<float>(i))) *
                        p.solidAngle;
                    sum += p.light * w;
                    weights += w;
                }
                face.at(x, y) = glm::vec4(sum / weights, 1.0f);
            }
        });
        lobes.pictures.emplace_back(std::move(face));
    }
    return lobes;
}

/// EnvironmentLight::glossTable() of faces that have its size.
std::vector<glm::vec3> tableOf(const EnvironmentMap& lobes) {
    std::vector<glm::vec3> table;
    table.reserve(6 * (kCoarse + 2) * (kCoarse + 2));
    for (int f = 0; f < 6; ++f)
        for (int y = -1; y <= kCoarse; ++y)
            for (int x = -1; x <= kCoarse; ++x)
                table.emplace_back(lobes.sample(
                    glm::vec3(faceDirection(static_cast<CubeFace>(f),
                                            {(x + 0.5) / kCoarse, (y + 0.5) / kCoarse})),
                    0, true));
    return table;
}

struct Harmonics {
    const std::array<glm::vec3, 9>& values;
    using vec3 = glsl::vec3;
    [[nodiscard]] vec3 harmonic(int i) const { return values[i]; }
#include "shaders/shared/environment_light.glsl"
};

}  // namespace

Result<std::shared_ptr<const EnvironmentLight>> EnvironmentLight::make(
    std::shared_ptr<const EnvironmentMap> environment, float shininess, const Limits& limits) {
    const auto pieces = piecesOf(*environment);
    auto light = std::make_shared<EnvironmentLight>();
    light->harmonics_ = harmonicsOf(pieces);
    if (shininess > kNarrow) {
        light->gloss_ = std::move(environment);
        // Where a lobe has fallen to a half, on both sides.
        light->lobeRad_ = 2.0f * std::acos(std::pow(0.5f, 1.0f / shininess));
    } else if (shininess > 0) {
        STX_TRY(light->gloss_, EnvironmentMap::make(lobesOf(pieces, shininess), limits));
        light->glossTable_ = tableOf(*light->gloss_);
    }
    return std::shared_ptr<const EnvironmentLight>(std::move(light));
}

glm::vec3 EnvironmentLight::diffuse(glm::vec3 normal) const {
    return Harmonics{harmonics_}.harmonicLight(normal);
}

glm::vec3 EnvironmentLight::glossy(glm::vec3 direction) const {
    return gloss_ ? glm::vec3(gloss_->sample(direction, lobeRad_, true)) : glm::vec3(0.0f);
}

}  // namespace stx
