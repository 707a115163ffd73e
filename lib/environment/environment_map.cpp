#include "lib/environment/environment_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <glm/gtc/constants.hpp>

#include "lib/base/parallel.hpp"
#include "lib/geometry/catmull_rom.hpp"
#include "lib/model/srgb8.hpp"

namespace stx {
namespace {

/// Texels around each picture from across its edges: what the widest filter reads.
constexpr int kBorder = 2;
/// Pictures are halved down to about this many texels a side.
constexpr int kSmallest = 4;
/// EnvironmentMap::pieces(): samples along a side of a piece, at least. With two, a sample that
/// falls beside a piece instead of into it moves light by half a piece and loses none.
constexpr int kSamplesOfPiece = 2;
/// Samples of which the light is held at a time, 20 bytes each.
constexpr int kSamplesAtOnce = 1 << 19;

/// arctan of 0..1, within 2e-8 (Abramowitz & Stegun, 4.4.49).
float arctan(float x) {
    const float s = x * x;
    return x * (1.0f + s * (-0.3333314528f +
                            s * (0.1999355085f +
                                 s * (-0.1420889944f +
                                      s * (0.1065626393f +
                                           s * (-0.0752896400f +
                                                s * (0.0429096138f + s * (-0.0161657367f +
                                                                          s * 0.0028662257f))))))));
}
/// atan2 many times faster than the library's, within 1e-6.
float fastAtan2(float y, float x) {
    const float ax = std::abs(x), ay = std::abs(y);
    const float most = std::max(ax, ay);
    if (!(most > 0.0f)) return 0.0f;
    float angle = arctan(std::min(ax, ay) / most);
    if (ay > ax) angle = glm::half_pi<float>() - angle;
    if (x < 0.0f) angle = glm::pi<float>() - angle;
    return y < 0.0f ? -angle : angle;
}

glm::vec4 valueOf(glm::u8vec4 p) {
    return glm::vec4(p) * (1.0f / 255.0f);
}
glm::vec4 valueOf(glm::vec4 p) {
    return p;
}
/// Premultiplied linear light, in which pictures are averaged.
glm::vec4 lightOf(glm::u8vec4 p) {
    const Srgb8Tables& srgb = srgb8Tables();
    const float a = static_cast<float>(p.a) / 255.0f;
    return {srgb.linear(p.r) * a, srgb.linear(p.g) * a, srgb.linear(p.b) * a, a};
}
glm::vec4 lightOf(glm::vec4 p) {
    return {glm::vec3(p) * p.a, p.a};
}
void fromLight(glm::vec4 light, glm::u8vec4& to) {
    const Srgb8Tables& srgb = srgb8Tables();
    const glm::vec3 c = light.a > 0.0f ? glm::vec3(light) / light.a : glm::vec3(0.0f);
    to = {srgb.code(c.r), srgb.code(c.g), srgb.code(c.b),
          static_cast<std::uint8_t>(std::clamp(light.a, 0.0f, 1.0f) * 255.0f + 0.5f)};
}
void fromLight(glm::vec4 light, glm::vec4& to) {
    to = {light.a > 0.0f ? glm::vec3(light) / light.a : glm::vec3(0.0f), light.a};
}

/// A picture with its border.
template <class P>
struct Level {
    int width = 0, height = 0;
    Image<P> texels;  ///< kBorder more on each side

    Level() = default;
    Level(int w, int h) : width(w), height(h), texels(w + 2 * kBorder, h + 2 * kBorder) {}
    [[nodiscard]] const P& at(int x, int y) const { return texels.at(x + kBorder, y + kBorder); }
    [[nodiscard]] P& at(int x, int y) { return texels.at(x + kBorder, y + kBorder); }

    /// The mean of four texels around a position in 0..1, premultiplied.
    [[nodiscard]] glm::vec4 bilinear(float u, float v, bool opaque) const {
        const float x = u * static_cast<float>(width) + (kBorder - 0.5f);
        const float y = v * static_cast<float>(height) + (kBorder - 0.5f);
        const int x0 = std::clamp(static_cast<int>(x), 0, width + 2 * kBorder - 2);
        const int y0 = std::clamp(static_cast<int>(y), 0, height + 2 * kBorder - 2);
        const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
        const P* const p = texels.data() + static_cast<std::size_t>(y0) * texels.width() + x0;
        const P* const q = p + texels.width();
        const float w00 = (1 - fx) * (1 - fy), w10 = fx * (1 - fy), w01 = (1 - fx) * fy,
                    w11 = fx * fy;
        glm::vec4 c00(p[0]), c10(p[1]), c01(q[0]), c11(q[1]);
        constexpr float kUnit = std::is_same_v<P, glm::u8vec4> ? 1.0f / 255.0f : 1.0f;
        if (opaque) return (c00 * w00 + c10 * w10 + c01 * w01 + c11 * w11) * kUnit;
        const float a00 = c00.a * w00, a10 = c10.a * w10, a01 = c01.a * w01, a11 = c11.a * w11;
        const glm::vec3 colour = glm::vec3(c00) * a00 + glm::vec3(c10) * a10 +
                                 glm::vec3(c01) * a01 + glm::vec3(c11) * a11;
        return {colour * (kUnit * kUnit), (a00 + a10 + a01 + a11) * kUnit};
    }

    /// Catmull-Rom over 16 texels, premultiplied and held to what four of them span.
    [[nodiscard]] glm::vec4 cubic(float u, float v) const {
        const float x = u * static_cast<float>(width) + (kBorder - 0.5f);
        const float y = v * static_cast<float>(height) + (kBorder - 0.5f);
        const int x0 = std::clamp(static_cast<int>(x), 1, width + 2 * kBorder - 3);
        const int y0 = std::clamp(static_cast<int>(y), 1, height + 2 * kBorder - 3);
        const auto wx = catmullRomWeights(x - static_cast<float>(x0)),
                   wy = catmullRomWeights(y - static_cast<float>(y0));
        glm::vec4 sum(0.0f), low(INFINITY), high(-INFINITY);
        for (int j = 0; j < 4; ++j) {
            for (int i = 0; i < 4; ++i) {
                glm::vec4 c = valueOf(texels.at(x0 - 1 + i, y0 - 1 + j));
                c = {glm::vec3(c) * c.a, c.a};
                sum += c * (wx[i] * wy[j]);
                if ((i == 1 || i == 2) && (j == 1 || j == 2)) {
                    low = glm::min(low, c);
                    high = glm::max(high, c);
                }
            }
        }
        return glm::clamp(sum, low, high);
    }
};

/// A share of the texels `from` of a line that fall into texel `i` of `to`.
struct Share {
    int first = 0, count = 0;
    float weights[4] = {};
};
Share shareOf(int i, int from, int to) {
    const double begin = static_cast<double>(i) * from / to, end = (i + 1.0) * from / to;
    Share share;
    share.first = static_cast<int>(begin);
    for (int k = share.first; k < end && share.count < 4; ++k)
        share.weights[share.count++] = static_cast<float>(
            (std::min(end, k + 1.0) - std::max(begin, static_cast<double>(k))) / (end - begin));
    return share;
}

template <class P>
Level<P> halved(const Level<P>& large) {
    Level<P> small(std::max(1, large.width / 2), std::max(1, large.height / 2));
    parallelFor(0, small.height, 8, [&](int y) {
        const Share rows = shareOf(y, large.height, small.height);
        for (int x = 0; x < small.width; ++x) {
            const Share columns = shareOf(x, large.width, small.width);
            glm::vec4 light(0.0f);
            for (int j = 0; j < rows.count; ++j)
                for (int i = 0; i < columns.count; ++i)
                    light += lightOf(large.at(columns.first + i, rows.first + j)) *
                             (rows.weights[j] * columns.weights[i]);
            fromLight(light, small.at(x, y));
        }
    });
    return small;
}

/// Pictures of one kind of pixel.
template <class P>
struct Pyramids {
    std::vector<std::vector<Level<P>>> faces;  ///< by CubeFace, or one
    bool opaque = true;

    void add(const Image<P>& picture) {
        std::vector<Level<P>> levels;
        if (!picture.empty()) {
            Level<P> first(picture.width(), picture.height());
            for (int y = 0; y < picture.height(); ++y)
                std::copy(picture.row(y).begin(), picture.row(y).end(), &first.at(0, y));
            levels.push_back(std::move(first));
            while (std::min(levels.back().width, levels.back().height) >= 2 * kSmallest)
                levels.push_back(halved(levels.back()));
            const P whole = [] {
                P p{};
                fromLight(glm::vec4(1.0f), p);
                return p;
            }();
            opaque = opaque && std::ranges::all_of(picture.pixels(),
                                                   [&](const P& p) { return p.a >= whole.a; });
        }
        faces.push_back(std::move(levels));
    }

    /// Texels across the edges of an equirectangular picture: beyond a pole is the other side.
    void joinAround() {
        for (Level<P>& l : faces[0]) {
            const auto wrapped = [&](int x) { return ((x % l.width) + l.width) % l.width; };
            for (int y = -kBorder; y < l.height + kBorder; ++y) {
                for (int x = -kBorder; x < l.width + kBorder; ++x) {
                    if (x >= 0 && x < l.width && y >= 0 && y < l.height) continue;
                    const int row = y < 0 ? -1 - y : y >= l.height ? 2 * l.height - 1 - y : y;
                    const int turned = row == y ? x : x + l.width / 2;
                    l.at(x, y) = l.at(wrapped(turned), std::clamp(row, 0, l.height - 1));
                }
            }
        }
    }

    /// Texels across the edges of each face are those of its neighbours in that direction; where
    /// there is none, its own edge goes on.
    void joinFaces() {
        auto joined = faces;
        for (std::size_t f = 0; f < faces.size(); ++f) {
            for (std::size_t k = 0; k < faces[f].size(); ++k) {
                Level<P>& l = joined[f][k];
                for (int y = -kBorder; y < l.height + kBorder; ++y) {
                    for (int x = -kBorder; x < l.width + kBorder; ++x) {
                        if (x >= 0 && x < l.width && y >= 0 && y < l.height) continue;
                        l.at(x, y) = across(f, k, x, y);
                    }
                }
            }
        }
        faces = std::move(joined);
    }

  private:
    P across(std::size_t f, std::size_t k, int x, int y) const {
        const Level<P>& own = faces[f][k];
        const FacePosition at = facePosition(faceDirection(
            static_cast<CubeFace>(f), {(x + 0.5) / own.width, (y + 0.5) / own.height}));
        const auto& others = faces[static_cast<std::size_t>(at.face)];
        if (others.empty() || at.face == static_cast<CubeFace>(f))
            return own.at(std::clamp(x, 0, own.width - 1), std::clamp(y, 0, own.height - 1));
        // Of the smaller pictures of the other face the one that is as large.
        std::size_t level = 0;
        while (level + 1 < others.size() && 2 * others[level + 1].width > 3 * own.width / 2)
            ++level;
        const Level<P>& other = others[level];
        const double px = std::clamp(at.position.x * other.width - 0.5, 0.0, other.width - 1.0);
        const double py = std::clamp(at.position.y * other.height - 0.5, 0.0, other.height - 1.0);
        const int x0 = std::min(static_cast<int>(px), std::max(0, other.width - 2));
        const int y0 = std::min(static_cast<int>(py), std::max(0, other.height - 2));
        const int x1 = std::min(x0 + 1, other.width - 1), y1 = std::min(y0 + 1, other.height - 1);
        const auto fx = static_cast<float>(px - x0), fy = static_cast<float>(py - y0);
        const glm::vec4 light = lightOf(other.at(x0, y0)) * ((1 - fx) * (1 - fy)) +
                                lightOf(other.at(x1, y0)) * (fx * (1 - fy)) +
                                lightOf(other.at(x0, y1)) * ((1 - fx) * fy) +
                                lightOf(other.at(x1, y1)) * (fx * fy);
        P p{};
        fromLight(light, p);
        return p;
    }
};

/// Where a direction is in the pictures, and how many texels lie between neighbouring samples.
struct Place {
    std::size_t face = 0;
    float u = 0, v = 0;
};

Place cubePlace(glm::vec3 d, float& major) {
    const glm::vec3 size = glm::abs(d);
    Place at;
    float a = 0, b = 0;
    if (size.z >= size.x && size.z >= size.y) {
        major = size.z;
        at.face = d.z < 0 ? 0 : 1;
        a = d.z < 0 ? d.x : -d.x;
        b = d.y;
    } else if (size.x >= size.y) {
        major = size.x;
        at.face = d.x < 0 ? 2 : 3;
        a = d.x < 0 ? -d.z : d.z;
        b = d.y;
    } else {
        major = size.y;
        at.face = d.y > 0 ? 4 : 5;
        a = d.x;
        b = d.y > 0 ? d.z : -d.z;
    }
    const float scale = 0.5f / major;
    at.u = 0.5f + a * scale;
    at.v = 0.5f - b * scale;
    return at;
}

Place latlongPlace(glm::vec3 d) {
    return {0, 0.5f + fastAtan2(d.x, -d.z) * (0.5f / glm::pi<float>()),
            0.5f - fastAtan2(d.y, std::sqrt(d.x * d.x + d.z * d.z)) * (1.0f / glm::pi<float>())};
}

template <class P>
glm::vec4 filtered(const Pyramids<P>& pictures, const Place& at, float texels) {
    const auto& levels = pictures.faces[static_cast<std::size_t>(at.face)];
    if (levels.empty()) return glm::vec4(0.0f);
    glm::vec4 p;
    if (!(texels > 1.0f) || levels.size() == 1) {
        p = levels[0].bilinear(at.u, at.v, pictures.opaque);
    } else {
        const float level = std::min(std::log2(texels), static_cast<float>(levels.size() - 1));
        const auto lower = std::min(static_cast<std::size_t>(level), levels.size() - 2);
        const float part = level - static_cast<float>(lower);
        p = levels[lower].bilinear(at.u, at.v, pictures.opaque) * (1.0f - part) +
            levels[lower + 1].bilinear(at.u, at.v, pictures.opaque) * part;
    }
    if (pictures.opaque) p.a = 1.0f;  // weights add up to 1 but for their rounding
    return p;
}

glm::vec4 straight(glm::vec4 p) {
    return p.a > 0.0f ? glm::vec4(glm::vec3(p) / p.a, p.a) : glm::vec4(0.0f);
}

}  // namespace

struct EnvironmentMap::Pictures {
    bool cube = true;
    Pyramids<glm::u8vec4> coded;
    Pyramids<glm::vec4> linear;
    bool isLinear = false;

    /// Premultiplied, in the pictures' own coding.
    [[nodiscard]] glm::vec4 at(glm::vec3 d, float spacing) const {
        float texels = 0;
        Place place;
        if (cube) {
            float major = 1;
            place = cubePlace(d, major);
            const auto of = [&](const auto& faces) {
                const auto& levels = faces[place.face];
                return levels.empty() ? 0 : levels[0].width;
            };
            const int size = isLinear ? of(linear.faces) : of(coded.faces);
            // A texel of a face is as wide as a pixel of a camera in its middle: both are planes.
            texels = spacing * 0.5f * static_cast<float>(size) / (major * std::sqrt(major));
        } else {
            place = latlongPlace(d);
            const float length = std::sqrt(glm::dot(d, d));
            const int height = isLinear ? linear.faces[0][0].height : coded.faces[0][0].height;
            // Towards the poles rows are as dense as anywhere; columns are denser.
            texels = spacing * static_cast<float>(height) /
                     (glm::pi<float>() * length * std::sqrt(length));
        }
        return isLinear ? filtered(linear, place, texels) : filtered(coded, place, texels);
    }

    /// Columns and rows of a face, or of the picture all around; 0 where there is none.
    [[nodiscard]] glm::ivec2 sizeOf(std::size_t face) const {
        const auto of = [&](const auto& faces) {
            const auto& levels = faces[face];
            return levels.empty() ? glm::ivec2(0) : glm::ivec2(levels[0].width, levels[0].height);
        };
        return isLinear ? of(linear.faces) : of(coded.faces);
    }

    [[nodiscard]] glm::vec4 sharpAt(glm::vec3 d) const {
        float major = 1;
        const Place place = cube ? cubePlace(d, major) : latlongPlace(d);
        const auto cubic = [&](const auto& faces) {
            const auto& levels = faces[place.face];
            return levels.empty() ? glm::vec4(0.0f) : levels[0].cubic(place.u, place.v);
        };
        return straight(isLinear ? cubic(linear.faces) : cubic(coded.faces));
    }
};

EnvironmentMap::EnvironmentMap() = default;
EnvironmentMap::~EnvironmentMap() = default;

Result<std::shared_ptr<const EnvironmentMap>> EnvironmentMap::make(const Environment& environment,
                                                                   const Limits& limits) {
    STX_CHECK(environment.check());
    std::uint64_t pixels = 0;
    for (const Texture& t : environment.pictures)
        pixels += static_cast<std::uint64_t>(t.width()) * static_cast<std::uint64_t>(t.height());
    const bool linear = environment.linear();
    // Smaller pictures take a third more, borders a little.
    STX_CHECK(limits.checkAllocation(pixels + pixels / 2, linear ? sizeof(glm::vec4) : 4,
                                     "the environment's pictures"));
    std::shared_ptr<EnvironmentMap> map(new EnvironmentMap());
    Environment& d = map->description_;
    d.layout = environment.layout;
    d.orientation = environment.orientation;
    d.skyColours = environment.skyColours;
    d.skyAngles = environment.skyAngles;
    d.groundColours = environment.groundColours;
    d.groundAngles = environment.groundAngles;
    map->environmentFromWorld_ =
        glm::mat3(glm::mat3_cast(glm::conjugate(glm::normalize(environment.orientation))));
    map->linear_ = linear;
    map->behind_ = !d.skyColours.empty() || !d.groundColours.empty();
    if (environment.pictureCount() == 0) return std::shared_ptr<const EnvironmentMap>(map);
    auto pictures = std::make_unique<Pictures>();
    pictures->cube = environment.layout == Environment::Layout::cube;
    pictures->isLinear = linear;
    const auto addAll = [&](auto& pyramids, const auto& imageOf) {
        for (const Texture& t : environment.pictures)
            pyramids.add(t.empty() ? std::remove_cvref_t<decltype(*imageOf(t))>() : *imageOf(t));
        if (pictures->cube)
            pyramids.joinFaces();
        else
            pyramids.joinAround();
    };
    if (linear)
        addAll(pictures->linear, [](const Texture& t) { return t.rgbaFloat(); });
    else
        addAll(pictures->coded, [](const Texture& t) { return t.rgba8(); });
    map->pictures_ = std::move(pictures);
    return std::shared_ptr<const EnvironmentMap>(map);
}

glm::vec3 EnvironmentMap::skyAndGround(float height, float& alpha) const {
    const auto mixed = [](const std::vector<glm::vec3>& colours, const std::vector<double>& angles,
                          float angle) {
        double before = 0;
        for (std::size_t i = 0; i < angles.size(); ++i) {
            if (angle <= angles[i]) {
                const auto part = static_cast<float>(
                    angles[i] > before ? (angle - before) / (angles[i] - before) : 1.0);
                return glm::mix(colours[i], colours[i + 1], part);
            }
            before = angles[i];
        }
        return colours.back();
    };
    alpha = 1.0f;
    const float fromTop = std::acos(std::clamp(height, -1.0f, 1.0f));
    const float fromBottom = glm::pi<float>() - fromTop;
    const Environment& d = description_;
    if (!d.groundAngles.empty() && fromBottom <= d.groundAngles.back())
        return mixed(d.groundColours, d.groundAngles, fromBottom);
    if (!d.skyColours.empty()) return mixed(d.skyColours, d.skyAngles, fromTop);
    alpha = 0.0f;
    return glm::vec3(0.0f);
}

glm::vec4 EnvironmentMap::sampleTurned(glm::vec3 d, float spacing, bool linear) const {
    glm::vec4 p(0.0f);
    if (pictures_) {
        p = pictures_->at(d, spacing);
        if (linear != linear_ && p.a > 0.0f) {
            const glm::vec3 c = p.a == 1.0f ? glm::vec3(p) : glm::vec3(p) / p.a;
            const glm::vec3 other =
                linear ? glm::vec3(linearByTable(c.r), linearByTable(c.g), linearByTable(c.b))
                       : glm::vec3(srgbBeyondOne(c.r), srgbBeyondOne(c.g), srgbBeyondOne(c.b));
            p = glm::vec4(other * p.a, p.a);
        }
    }
    if (!behind_ || p.a >= 1.0f) return p;
    float alpha = 0;
    glm::vec3 colour = skyAndGround(d.y / std::sqrt(glm::dot(d, d)), alpha);
    if (linear)
        colour = {linearByTable(colour.r), linearByTable(colour.g), linearByTable(colour.b)};
    return p + glm::vec4(colour * alpha, alpha) * (1.0f - p.a);
}

glm::vec4 EnvironmentMap::sample(glm::vec3 direction, float footprintRad, bool linear) const {
    return sampleTurned(environmentFromWorld_ * glm::normalize(direction), footprintRad, linear);
}

std::vector<EnvironmentPiece> EnvironmentMap::pieces(int side) const {
    struct Sample {
        std::uint32_t piece;
        float solidAngle;
        glm::vec3 light;  ///< times the solid angle
    };
    const auto count = static_cast<std::size_t>(6) * side * side;
    std::vector<glm::dvec4> sums(count, glm::dvec4(0));
    const glm::mat3 worldFromEnvironment = glm::transpose(environmentFromWorld_);
    const auto pieceOf = [&](glm::vec3 d) {
        float major = 1;
        const Place at = cubePlace(worldFromEnvironment * d, major);
        const auto cell = [&](float x) {
            return std::clamp(static_cast<int>(x * static_cast<float>(side)), 0, side - 1);
        };
        return static_cast<std::uint32_t>((static_cast<int>(at.face) * side + cell(at.v)) * side +
                                          cell(at.u));
    };
    // directionOf(x, y, solidAngle) gives a direction in the environment's own axes. Samples are
    // looked up in parallel and added one after the other, in an order that is always the same.
    std::vector<Sample> samples;
    const auto addUp = [&](int width, int height, const auto& directionOf) {
        const int rows = std::max(1, kSamplesAtOnce / width);
        for (int first = 0; first < height; first += rows) {
            const int end = std::min(height, first + rows);
            samples.resize(static_cast<std::size_t>(end - first) * width);
            parallelFor(first, end, 4, [&](int y) {
                Sample* to = samples.data() + static_cast<std::size_t>(y - first) * width;
                for (int x = 0; x < width; ++x, ++to) {
                    double solidAngle = 0;
                    const glm::vec3 d(directionOf(x, y, solidAngle));
                    to->solidAngle = static_cast<float>(solidAngle);
                    to->piece = pieceOf(d);
                    to->light = glm::vec3(sampleTurned(d, 0, true)) * to->solidAngle;
                }
            });
            for (const Sample& s : samples)
                sums[s.piece] += glm::dvec4(glm::dvec3(s.light), s.solidAngle);
        }
    };
    // How often each of `texels` is sampled so that there are `least` samples.
    const auto often = [](int texels, int least) { return (least + texels - 1) / texels; };
    if (pictures_ && !pictures_->cube) {
        const glm::ivec2 size = pictures_->sizeOf(0);
        const int width = size.x * often(size.x, 4 * side * kSamplesOfPiece);
        const int height = size.y * often(size.y, 2 * side * kSamplesOfPiece);
        // Directions of columns at the horizon.
        std::vector<glm::dvec3> columns;
        for (int x = 0; x < width; ++x)
            columns.push_back(latlongDirection({(x + 0.5) / width, 0.5}));
        addUp(width, height, [&](int x, int y, double& solidAngle) {
            const auto sineAt = [&](double row) {
                return std::cos(glm::pi<double>() * row / height);
            };
            solidAngle = glm::two_pi<double>() / width * (sineAt(y) - sineAt(y + 1.0));
            const double sine = sineAt(y + 0.5);
            const glm::dvec3 across = columns[x] * std::sqrt(std::max(0.0, 1 - sine * sine));
            return glm::dvec3(across.x, sine, across.z);
        });
    } else {
        for (std::size_t f = 0; f < 6; ++f) {
            const int texels = pictures_ ? std::max(1, pictures_->sizeOf(f).x) : 1;
            const int width = texels * often(texels, side * kSamplesOfPiece);
            addUp(width, width, [&](int x, int y, double& solidAngle) {
                const glm::dvec3 d =
                    faceDirection(static_cast<CubeFace>(f), {(x + 0.5) / width, (y + 0.5) / width});
                const double length = glm::length(d);
                solidAngle = 4.0 / width / width / (length * length * length);
                return d / length;
            });
        }
    }
    std::vector<EnvironmentPiece> pieces(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto row = static_cast<int>(i) / side, column = static_cast<int>(i) % side;
        EnvironmentPiece& piece = pieces[i];
        piece.direction = glm::vec3(
            glm::normalize(faceDirection(static_cast<CubeFace>(row / side),
                                         {(column + 0.5) / side, (row % side + 0.5) / side})));
        piece.light = glm::vec3(sums[i]);
        piece.solidAngle = static_cast<float>(sums[i].w);
    }
    return pieces;
}

glm::vec4 EnvironmentMap::pictureAt(glm::vec3 d) const {
    return pictures_ ? pictures_->sharpAt(d) : glm::vec4(0.0f);
}
glm::vec4 EnvironmentMap::pictureAt(glm::vec3 d, float footprintRad) const {
    return pictures_ ? straight(pictures_->at(glm::normalize(d), footprintRad)) : glm::vec4(0.0f);
}

}  // namespace stx
