#include "lib/environment/environment_light.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <glm/gtc/constants.hpp>

#include "lib/base/parallel.hpp"
#include "shaders/shared/language.hpp"

namespace stx {
namespace {

/// Texels a side of the faces of lobes that shaders have, too.
constexpr int kCoarse = EnvironmentLight::kGlossSide;
/// Pieces a side of the faces that light is added up over: a sun is off by at most 0.6 degrees, and
/// so its light by 1 % of its own where it falls.
constexpr int kPieces = 128;
/// So many pieces along a side are joined to one for lobes of a usual width: half a piece off is 3
/// % of the middle of the narrowest of these.
constexpr int kJoined = 2;
/// Above this exponent a lobe is narrower than kCoarse texels and has faces of its own size.
constexpr float kNarrow = EnvironmentLight::kMostTableShininess;
/// Texels a side of these for the square root of the exponent, so that a lobe falls to a half
/// within 2.5 of them.
constexpr float kNarrowTexels = 4.25f;
/// The largest such faces, up to an exponent of 3600 (half within 1.1 degrees). Beyond that a lobe
/// is averaged by the environment's own footprint.
constexpr int kFinest = 256;
/// What weighs less than this share of a lobe's middle is left out.
constexpr float kLeastWeight = 1e-3f;
/// Texels and pieces a side of the tiles of which it is decided together whether one reaches the
/// other; all faces are whole numbers of these.
constexpr int kTile = 8;

using Pieces = std::vector<EnvironmentPiece>;

/// Pieces of faces of `side`, `by` along each side joined to one.
Pieces joinedPieces(const Pieces& pieces, int side, int by) {
    const int less = side / by;
    Pieces out(pieces.size() / (static_cast<std::size_t>(by) * by));
    for (int row = 0; row < 6 * side; ++row) {
        for (int x = 0; x < side; ++x) {
            const EnvironmentPiece& from = pieces[static_cast<std::size_t>(row) * side + x];
            EnvironmentPiece& to = out[static_cast<std::size_t>(row / by) * less + x / by];
            to.direction += from.direction;
            to.solidAngle += from.solidAngle;
            to.light += from.light;
        }
    }
    for (EnvironmentPiece& piece : out) piece.direction = glm::normalize(piece.direction);
    return out;
}

std::array<glm::vec3, 9> harmonicsOf(const Pieces& pieces) {
    std::array<glm::dvec3, 9> sums{};
    for (const EnvironmentPiece& p : pieces) {
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
        for (int i = 0; i < 9; ++i) sums[i] += glm::dvec3(p.light) * basis[i];
    }
    // Lambert's cosine over pi: 1, 2/3 and 1/4 of the orders; times the basis' own constants.
    const double factors[9] = {0.282095,         0.488603 * 2 / 3, 0.488603 * 2 / 3,
                               0.488603 * 2 / 3, 1.092548 / 4,     1.092548 / 4,
                               0.315392 / 4,     1.092548 / 4,     0.546274 / 4};
    std::array<glm::vec3, 9> out;
    for (std::size_t i = 0; i < 9; ++i) out[i] = glm::vec3(sums[i] * factors[i]);
    return out;
}

/// A tile of a face: kTile x kTile directions.
struct LobeTile {
    int face = 0, x = 0, y = 0;  ///< its first one
    glm::vec3 axis{0.0f};
    float reachRad = 0;  ///< all of it is within this of the axis
};

std::vector<LobeTile> tilesOf(int side) {
    std::vector<LobeTile> tiles;
    for (int f = 0; f < 6; ++f)
        for (int y = 0; y < side; y += kTile)
            for (int x = 0; x < side; x += kTile) {
                const auto at = [&](int i, int j) {
                    return glm::vec3(glm::normalize(faceDirection(
                        static_cast<CubeFace>(f), {(x + i * 1.0) / side, (y + j * 1.0) / side})));
                };
                LobeTile tile{f, x, y, at(kTile / 2, kTile / 2), 0};
                float nearest = 1;
                for (const int i : {0, kTile})
                    for (const int j : {0, kTile})
                        nearest = std::min(nearest, glm::dot(tile.axis, at(i, j)));
                tile.reachRad = std::acos(nearest);
                tiles.push_back(tile);
            }
    return tiles;
}

/// cos^shininess by a table, from where it is kLeastWeight up to 1.
class LobePower {
  public:
    explicit LobePower(double shininess)
        : least_(static_cast<float>(std::pow(static_cast<double>(kLeastWeight), 1 / shininess))) {
        for (int i = 0; i <= kSteps + 1; ++i)
            table_.push_back(static_cast<float>(
                std::pow(std::min(1.0, least_ + (1.0 - least_) * i / kSteps), shininess)));
    }
    /// Cosines below weigh nothing.
    [[nodiscard]] float least() const { return least_; }
    [[nodiscard]] float operator()(float cosine) const {
        const float at = (std::min(cosine, 1.0f) - least_) / (1.0f - least_) * kSteps;
        const auto i = static_cast<std::size_t>(at);
        return table_[i] + (table_[i + 1] - table_[i]) * (at - static_cast<float>(i));
    }

  private:
    static constexpr int kSteps = 4096;  ///< far finer than a lobe
    float least_;
    std::vector<float> table_;
};

/// Faces of `size` in which each texel is the mean around it, weighed by cos^shininess; of pieces
/// of faces of `side`.
Environment lobesOf(const Pieces& pieces, int side, float shininess, int size) {
    const LobePower power(shininess);
    const float reach = std::acos(power.least());
    const auto from = tilesOf(side), to = tilesOf(size);
    std::vector<RgbaFloatImage> faces(6, RgbaFloatImage(size, size));
    parallelFor(0, static_cast<std::int64_t>(to.size()), 1, [&](std::int64_t t) {
        const LobeTile& tile = to[t];
        std::vector<const LobeTile*> near;
        for (const LobeTile& other : from) {
            const float apart = reach + tile.reachRad + other.reachRad;
            if (apart >= glm::pi<float>() || glm::dot(tile.axis, other.axis) >= std::cos(apart))
                near.push_back(&other);
        }
        for (int k = 0; k < kTile * kTile; ++k) {
            const int x = tile.x + k % kTile, y = tile.y + k / kTile;
            const glm::vec3 d(glm::normalize(faceDirection(static_cast<CubeFace>(tile.face),
                                                           {(x + 0.5) / size, (y + 0.5) / size})));
            glm::vec3 sum(0.0f);
            float weights = 0;
            for (const LobeTile* other : near)
                for (int row = other->y; row < other->y + kTile; ++row) {
                    const EnvironmentPiece* p =
                        &pieces[(static_cast<std::size_t>(other->face) * side + row) * side +
                                other->x];
                    for (const EnvironmentPiece* end = p + kTile; p < end; ++p) {
                        const float cosine = glm::dot(d, p->direction);
                        if (cosine < power.least()) continue;
                        const float w = power(cosine);
                        sum += p->light * w;
                        weights += p->solidAngle * w;
                    }
                }
            faces[tile.face].at(x, y) =
                glm::vec4(weights > 0 ? sum / weights : glm::vec3(0.0f), 1.0f);
        }
    });
    Environment lobes;
    for (RgbaFloatImage& face : faces) lobes.pictures.emplace_back(std::move(face));
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
    const auto needed = static_cast<int>(
        std::min(std::ceil(kNarrowTexels * std::sqrt(shininess) / kTile) * kTile, 2.0f * kFinest));
    const bool narrow = shininess > kNarrow, own = narrow && needed <= kFinest;
    const int side = own ? std::max(kPieces, needed) : kPieces;
    // A piece, its sum, and a texel of the lobes.
    STX_CHECK(limits.checkAllocation(6ull * static_cast<std::uint64_t>(side) * side,
                                     sizeof(EnvironmentPiece) + 2 * sizeof(glm::dvec4),
                                     "the environment's light"));
    const Pieces pieces = environment->pieces(side);
    auto light = std::make_shared<EnvironmentLight>();
    light->harmonics_ = harmonicsOf(pieces);
    if (own) {
        STX_TRY(light->gloss_,
                EnvironmentMap::make(lobesOf(pieces, side, shininess, side), limits));
    } else if (narrow) {
        light->gloss_ = std::move(environment);
        // Where a lobe has fallen to a half, on both sides.
        light->lobeRad_ = 2.0f * std::acos(std::pow(0.5f, 1.0f / shininess));
    } else if (shininess > 0) {
        STX_TRY(light->gloss_, EnvironmentMap::make(lobesOf(joinedPieces(pieces, side, kJoined),
                                                            side / kJoined, shininess, kCoarse),
                                                    limits));
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
