#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "formats/meshes/mesh_builder.hpp"
#include "formats/meshes/ply_values.hpp"
#include "formats/meshes/readers.hpp"
#include "formats/meshes/triangulate.hpp"
#include "formats/meshes/vertex_colours.hpp"

// Assimp's PLY importer keeps one texture coordinate a vertex where the file has one a corner, and
// stops at headers with free blanks; so PLY is read here.

namespace stx {
namespace {

/// What a property of an element means.
enum class Role {
    none,
    x,
    y,
    z,
    nx,
    ny,
    nz,
    red,
    green,
    blue,
    alpha,
    u,
    v,
    indices,
    corners,
    texture
};

Role roleOf(const PlyProperty& p, bool ofFaces) {
    const std::string_view n = p.name;
    if (p.isList) {
        if (!ofFaces) return Role::none;
        if (n == "vertex_indices" || n == "vertex_index") return Role::indices;
        if (n == "texcoord") return Role::corners;
        return Role::none;
    }
    if (n == "red" || n == "r" || n == "diffuse_red") return Role::red;
    if (n == "green" || n == "g" || n == "diffuse_green") return Role::green;
    if (n == "blue" || n == "b" || n == "diffuse_blue") return Role::blue;
    if (n == "alpha" || n == "a" || n == "diffuse_alpha") return Role::alpha;
    if (ofFaces) return n == "texnumber" ? Role::texture : Role::none;
    if (n == "x") return Role::x;
    if (n == "y") return Role::y;
    if (n == "z") return Role::z;
    if (n == "nx") return Role::nx;
    if (n == "ny") return Role::ny;
    if (n == "nz") return Role::nz;
    if (n == "u" || n == "s" || n == "texture_u" || n == "texture_s") return Role::u;
    if (n == "v" || n == "t" || n == "texture_v" || n == "texture_t") return Role::v;
    // Gaussian splats: the first coefficient of spherical harmonics of each colour.
    if (n == "f_dc_0") return Role::red;
    if (n == "f_dc_1") return Role::green;
    if (n == "f_dc_2") return Role::blue;
    return Role::none;
}

/// 255, 65535 or 1: what divides a colour of this type.
double colourScale(PlyType type) {
    switch (type) {
        case PlyType::float32:
        case PlyType::float64:
            return 1.0;
        case PlyType::uint16:
            return 65535.0;
        default:
            return 255.0;
    }
}

/// Colours that a PLY file holds as 16 bits. Some programs write those of 8 bits so.
class ColoursOf16Bits {
  public:
    void add(Role role, PlyType type, double value) {
        if (type != PlyType::uint16) return;
        is_[channelOf(role)] = true;
        largest_ = std::max(largest_, value);
    }
    /// Makes colours that were divided by 65535 those of 255 where all are bytes; a note says so.
    void widenBytes(std::vector<glm::vec4>& colours, Job& job) const {
        // A cloud of which nothing is brighter than 255 of 65535 would be black. 0 and 1 may mean
        // anything.
        if (!(largest_ > 1 && largest_ <= 255)) return;
        // By their whole numbers, so that full stays full.
        for (glm::vec4& c : colours)
            for (int k = 0; k < 4; ++k)
                if (is_[k]) c[k] = std::round(c[k] * 65535.0f) / 255.0f;
        job.note(
            fmt::format("the 16-bit colours of the PLY file reach {} of 65535 only: they are taken "
                        "for 8 bits, 0 to 255",
                        largest_));
    }
    static int channelOf(Role role) { return static_cast<int>(role) - static_cast<int>(Role::red); }

  private:
    std::array<bool, 4> is_{};
    double largest_ = 0;
};

bool hasRole(const PlyElement& ofVertices, Role role) {
    return std::ranges::any_of(ofVertices.properties,
                               [&](const PlyProperty& p) { return roleOf(p, false) == role; });
}

class PlyReader {
  public:
    PlyReader(ByteSpan bytes, PlyHeader header, ModelFiles& files)
        : header_(std::move(header)),
          values_(bytes, header_.dataOffset, header_.coding),
          files_(files),
          builder_(files.job()) {}

    Result<Mesh> read() {
        // Faces may come before the vertices that they name.
        const auto isVertex = [](const PlyElement& e) { return e.name == "vertex"; };
        if (std::ranges::count_if(header_.elements, isVertex) > 1)
            return fail(ErrorCode::invalidInput,
                        "the PLY header has two lists of 'vertex'; one is expected");
        if (const auto vertex = std::ranges::find_if(header_.elements, isVertex);
            vertex != header_.elements.end()) {
            vertices_ = vertex->count;
            hasVertexUvs_ = hasRole(*vertex, Role::u) && hasRole(*vertex, Role::v);
        }
        for (const auto& element : header_.elements) {
            if (isVertex(element)) {
                STX_CHECK(readVertices(element));
            } else if (element.name == "face" || element.name == "tristrips") {
                STX_CHECK(readFaces(element));
            } else {
                if (element.count > 0)
                    files_.job().note(fmt::format("dropped: PLY elements '{}' ({})", element.name,
                                                  element.count));
                STX_CHECK(skip(element));
            }
        }
        if (shortFaces_ > 0)
            files_.job().note(
                fmt::format("dropped: faces with less than three corners ({})", shortFaces_));
        if (values_.hasLeftOver())
            files_.job().note("dropped: PLY values behind the last property of a line");
        STX_CHECK(assemble());
        return builder_.finish();
    }

  private:
    static constexpr std::uint32_t kNoTexture = std::numeric_limits<std::uint32_t>::max();
    struct Face {
        std::uint32_t firstCorner = 0;  ///< in corners_
        bool ownUvs = false;            ///< those of its corners, else those of its vertices
        std::uint32_t texture = 0;      ///< of textureFiles, or kNoTexture
        glm::vec4 colour{1.0f};
    };
    struct Corner {
        std::uint32_t vertex = 0;
        glm::vec2 uv{0.0f};
    };

    Result<double> value(const PlyElement& element, std::uint64_t i, PlyType type) {
        double v = 0;
        if (!values_.next(type, v))
            return fail(ErrorCode::invalidInput,
                        "{} {} of {} at byte {}: the file ends, or here stands no number",
                        element.name, i, element.count, values_.offset());
        return v;
    }

    /// Begins an element. A file that ends after a whole line is cut off, too: its missing elements
    /// are not elements with empty lists.
    Result<void> begin(const PlyElement& element, std::uint64_t i) {
        if (values_.beginElement()) return {};
        return fail(ErrorCode::invalidInput, "{} {} of {}: the file ends; it is cut off",
                    element.name, i, element.count);
    }

    /// Length of a list, held against what the file can still hold. Text may leave out those at
    /// the end of a line that are empty.
    Result<std::size_t> length(const PlyElement& element, std::uint64_t i, const PlyProperty& p) {
        if (values_.atLineEnd()) return 0;
        STX_TRY(const double n, value(element, i, p.countType));
        if (!(n >= 0) || n > 1e9 || std::floor(n) != n)
            return fail(ErrorCode::invalidInput, "{} {}: '{}' has {} values", element.name, i,
                        p.name, n);
        return static_cast<std::size_t>(n);
    }

    Result<void> skip(const PlyElement& element) {
        for (std::uint64_t i = 0; i < element.count; ++i) {
            STX_CHECK(begin(element, i));
            for (const auto& p : element.properties) {
                std::size_t n = 1;
                if (p.isList) STX_SET(n, length(element, i, p));
                for (std::size_t k = 0; k < n; ++k) STX_CHECK(value(element, i, p.type));
            }
            values_.endElement();
        }
        return {};
    }

    /// Says what of the vertices is not used.
    void noteDropped(const PlyElement& element, bool splats) {
        if (splats)
            files_.job().note(
                "the file holds Gaussian splats: their centres are read as points of their mean "
                "colour; size, direction, opacity and what depends on the view are dropped");
        const auto names = unusedProperties(element, [&](const PlyProperty& p) {
            return splats || roleOf(p, false) != Role::none;
        });
        if (!names.empty())
            files_.job().note(fmt::format("dropped: PLY properties of vertices ({})", names));
        noteAlpha(colours_);
    }

    void noteAlpha(const std::vector<glm::vec4>& colours) {
        const bool alpha = std::any_of(colours.begin(), colours.end(),
                                       [](const glm::vec4& c) { return c.a < 1.0f; });
        if (alpha) files_.job().note("dropped: the alpha of PLY colours; all is opaque");
    }

    Result<void> readVertices(const PlyElement& element) {
        std::vector<Role> roles;
        for (const auto& p : element.properties) roles.push_back(roleOf(p, false));
        const auto has = [&](Role r) { return hasRole(element, r); };
        if (!has(Role::x) || !has(Role::y) || !has(Role::z))
            return fail(ErrorCode::invalidInput, "the PLY vertices have no x, y and z");
        STX_CHECK(builder_.charge(element.count, 24 + 12 + 16 + 8, "the PLY vertices"));
        const bool hasNormals = has(Role::nx) && has(Role::ny) && has(Role::nz);
        const bool hasColours = has(Role::red) && has(Role::green) && has(Role::blue);
        for (std::uint64_t i = 0; i < element.count; ++i) {
            std::array<double, 16> v{};
            v[static_cast<std::size_t>(Role::alpha)] = 1.0;
            STX_CHECK(begin(element, i));
            for (std::size_t k = 0; k < roles.size(); ++k) {
                const auto& p = element.properties[k];
                if (p.isList) {
                    STX_TRY(const auto n, length(element, i, p));
                    for (std::size_t j = 0; j < n; ++j) STX_CHECK(value(element, i, p.type));
                    continue;
                }
                STX_TRY(double number, value(element, i, p.type));
                if (roles[k] >= Role::red && roles[k] <= Role::alpha) {
                    colours16_.add(roles[k], p.type, number);
                    number /= colourScale(p.type);
                    floatColours_ = floatColours_ || colourScale(p.type) == 1.0;
                }
                v[static_cast<std::size_t>(roles[k])] = number;
            }
            values_.endElement();
            const auto f = [&](Role r) {
                return static_cast<float>(v[static_cast<std::size_t>(r)]);
            };
            positions_.emplace_back(v[static_cast<std::size_t>(Role::x)],
                                    v[static_cast<std::size_t>(Role::y)],
                                    v[static_cast<std::size_t>(Role::z)]);
            if (hasNormals) normals_.emplace_back(f(Role::nx), f(Role::ny), f(Role::nz));
            if (hasColours)
                colours_.emplace_back(f(Role::red), f(Role::green), f(Role::blue), f(Role::alpha));
            if (hasVertexUvs_) uvs_.emplace_back(f(Role::u), 1.0f - f(Role::v));
        }
        const bool splats = std::any_of(element.properties.begin(), element.properties.end(),
                                        [](const PlyProperty& p) { return p.name == "f_dc_0"; });
        if (splats) {
            // 1 / (2 sqrt(pi)), as Kerbl et al. 2023 code a colour.
            constexpr float kHarmonic = 0.28209479f;
            for (auto& c : colours_)
                c = glm::vec4(glm::clamp(glm::vec3(c) * kHarmonic + 0.5f, 0.0f, 1.0f), 1.0f);
        }
        if (!splats) colours16_.widenBytes(colours_, files_.job());
        linearFromSrgbColours(colours_, floatColours_ && !splats);
        noteDropped(element, splats);
        return {};
    }

    Result<void> readFaces(const PlyElement& element) {
        const bool strips = element.name == "tristrips";
        std::vector<double> indices, cornerUvs;
        for (std::uint64_t i = 0; i < element.count; ++i) {
            indices.clear();
            cornerUvs.clear();
            Face face;
            glm::dvec4 colour(1.0);
            STX_CHECK(begin(element, i));
            for (const auto& p : element.properties) {
                const auto role = roleOf(p, true);
                std::size_t n = 1;
                if (p.isList) STX_SET(n, length(element, i, p));
                for (std::size_t k = 0; k < n; ++k) {
                    STX_TRY(const double number, value(element, i, p.type));
                    if (role == Role::indices) indices.push_back(number);
                    if (role == Role::corners) cornerUvs.push_back(number);
                    // MeshLab says -1 of faces without one.
                    if (role == Role::texture && number < 1e6)
                        face.texture =
                            number >= 0 ? static_cast<std::uint32_t>(number) : kNoTexture;
                    if (role >= Role::red && role <= Role::alpha) {
                        faceColours16_.add(role, p.type, number);
                        colour[ColoursOf16Bits::channelOf(role)] = number / colourScale(p.type);
                        hasFaceColours_ = hasFaceColours_ || role == Role::green;
                        floatFaceColours_ = floatFaceColours_ || colourScale(p.type) == 1.0;
                    }
                }
            }
            values_.endElement();
            face.colour = glm::vec4(colour);
            if (strips) {
                STX_CHECK(addStrips(element, indices));
                continue;
            }
            if (indices.size() < 3) {
                ++shortFaces_;
                continue;
            }
            const bool withUvs = cornerUvs.size() == indices.size() * 2;
            face.ownUvs = withUvs;
            hasCornerUvs_ = hasCornerUvs_ || withUvs;
            if (!withUvs && !hasVertexUvs_) face.texture = kNoTexture;
            hasPlainFaces_ = hasPlainFaces_ || face.texture == kNoTexture;
            face.firstCorner = static_cast<std::uint32_t>(corners_.size());
            for (std::size_t k = 0; k < indices.size(); ++k) {
                STX_TRY(Corner corner, cornerAt(element, i, indices[k]));
                if (withUvs)
                    corner.uv = {static_cast<float>(cornerUvs[k * 2]),
                                 1.0f - static_cast<float>(cornerUvs[k * 2 + 1])};
                corners_.push_back(corner);
            }
            faces_.push_back(face);
            STX_CHECK(builder_.charge(indices.size(), 120, "the PLY faces"));
        }
        return {};
    }

    Result<Corner> cornerAt(const PlyElement& element, std::uint64_t i, double index) {
        if (!(index >= 0) || index >= static_cast<double>(vertices_) || std::floor(index) != index)
            return fail(ErrorCode::invalidInput,
                        "{} {} uses vertex {}, but there are only {} vertices", element.name, i,
                        index, vertices_);
        return Corner{static_cast<std::uint32_t>(index)};
    }

    /// Stanford's triangle strips: one list, -1 begins a new strip.
    Result<void> addStrips(const PlyElement& element, const std::vector<double>& indices) {
        std::size_t start = 0;
        STX_CHECK(builder_.charge(indices.size(), 360, "the PLY strips"));
        for (std::size_t k = 0; k < indices.size(); ++k) {
            if (indices[k] == -1) {
                start = k + 1;
                continue;
            }
            if (k < start + 2) continue;
            const bool odd = (k - start) % 2 == 1;
            faces_.push_back({.firstCorner = static_cast<std::uint32_t>(corners_.size())});
            for (const auto from : {odd ? k - 1 : k - 2, odd ? k - 2 : k - 1, k}) {
                STX_TRY(const auto corner, cornerAt(element, 0, indices[from]));
                corners_.push_back(corner);
            }
        }
        return {};
    }

    /// A material for each texture that the file names, or one; behind them one for faces without a
    /// texture, where others have one.
    Result<void> makeMaterials() {
        const bool hasUvs = !uvs_.empty() || hasCornerUvs_;
        if (!header_.textureFiles.empty() && !hasUvs)
            files_.job().note("the PLY file names a texture but has no texture coordinates for it");
        auto& materials = builder_.materials();
        const int place = files_.placeOfColour(builder_.textures(), hasUvs);
        for (const auto& name : header_.textureFiles) {
            Material m{.name = name, .baseColourTexture = place, .hasColour = false};
            if (hasUvs && !files_.replacesColour())
                STX_SET(m.baseColourTexture, files_.textureFromFile(name, {}, builder_.textures()));
            materials.push_back(std::move(m));
        }
        if (materials.empty())
            materials.push_back(
                {.name = "default", .baseColourTexture = place, .hasColour = false});
        textured_ = static_cast<std::uint32_t>(materials.size());
        if (hasUvs && hasPlainFaces_)
            materials.push_back({.name = "without texture", .hasColour = false});
        return {};
    }

    Result<void> addPoints() {
        MeshPart part;
        part.where = "PLY";
        part.positions = std::move(positions_);
        part.normals = std::move(normals_);
        part.colours = std::move(colours_);
        part.points = true;
        return builder_.add(std::move(part));
    }

    /// Corners that are vertices of their own, with the colour of their face if it is given.
    void addCorners(const Face& face, std::uint32_t end, bool faceColour, MeshPart& part) const {
        for (auto c = face.firstCorner; c < end; ++c) {
            const auto v = corners_[c].vertex;
            part.positions.push_back(positions_[v]);
            if (!normals_.empty()) part.normals.push_back(normals_[v]);
            if (faceColour)
                part.colours.push_back(face.colour);
            else if (!colours_.empty())
                part.colours.push_back(colours_[v]);
            if (!uvs_.empty() && !face.ownUvs)
                part.uvs.push_back(uvs_[v]);
            else if (hasCornerUvs_)
                part.uvs.push_back(corners_[c].uv);
        }
    }

    /// Faces as triangles, one part for each texture; points when there are no faces.
    Result<void> assemble() {
        if (corners_.size() > std::numeric_limits<std::uint32_t>::max())
            return fail(ErrorCode::invalidInput, "the PLY file has more than 2^32 corners");
        STX_CHECK(makeMaterials());
        if (faces_.empty()) return addPoints();
        const auto materials = static_cast<std::uint32_t>(builder_.materials().size());
        const bool useFaceColours = hasFaceColours_ && colours_.empty();
        if (hasFaceColours_ && !useFaceColours)
            files_.job().note("dropped: the colours of PLY faces; those of the vertices are drawn");
        if (useFaceColours) {
            std::vector<glm::vec4> colours;
            for (const auto& f : faces_) colours.push_back(f.colour);
            faceColours16_.widenBytes(colours, files_.job());
            noteAlpha(colours);
            linearFromSrgbColours(colours, floatFaceColours_);
            for (std::size_t i = 0; i < faces_.size(); ++i) faces_[i].colour = colours[i];
        }
        std::map<std::uint32_t, MeshPart> parts;
        const bool shared = !hasCornerUvs_ && !useFaceColours && materials == 1;
        std::vector<glm::dvec3> polygon;
        std::vector<glm::uvec3> triangles;
        for (std::size_t f = 0; f < faces_.size(); ++f) {
            const auto& face = faces_[f];
            const auto end = f + 1 < faces_.size() ? faces_[f + 1].firstCorner
                                                   : static_cast<std::uint32_t>(corners_.size());
            polygon.clear();
            triangles.clear();
            for (auto c = face.firstCorner; c < end; ++c)
                polygon.push_back(positions_[corners_[c].vertex]);
            triangulate(polygon, triangles);
            const auto last = face.texture == kNoTexture ? materials : textured_;
            auto& part = parts[std::min(face.texture, last - 1)];
            const auto base = static_cast<std::uint32_t>(part.positions.size());
            for (const auto& t : triangles) {
                if (shared)
                    part.triangles.emplace_back(corners_[face.firstCorner + t.x].vertex,
                                                corners_[face.firstCorner + t.y].vertex,
                                                corners_[face.firstCorner + t.z].vertex);
                else
                    part.triangles.push_back(t + base);
            }
            if (!shared) addCorners(face, end, useFaceColours, part);
        }
        for (auto& [texture, part] : parts) {
            part.where = "PLY";
            part.material = texture;
            if (shared) {
                part.positions = std::move(positions_);
                part.normals = std::move(normals_);
                part.colours = std::move(colours_);
                part.uvs = std::move(uvs_);
            } else {
                weldVertices(part);
            }
            STX_CHECK(builder_.add(std::move(part)));
        }
        return {};
    }

    PlyHeader header_;
    PlyValues values_;
    ModelFiles& files_;
    MeshBuilder builder_;
    std::vector<glm::dvec3> positions_;
    std::vector<glm::vec3> normals_;
    std::vector<glm::vec4> colours_;
    std::vector<glm::vec2> uvs_;
    std::vector<Face> faces_;
    std::vector<Corner> corners_;
    std::uint64_t vertices_ = 0;  ///< as the header says
    bool hasVertexUvs_ = false, hasCornerUvs_ = false, hasPlainFaces_ = false,
         hasFaceColours_ = false;
    std::uint32_t textured_ = 0;  ///< materials that may have a texture
    bool floatColours_ = false, floatFaceColours_ = false;
    ColoursOf16Bits colours16_, faceColours16_;
    std::size_t shortFaces_ = 0;
};

}  // namespace

Result<Mesh> readPly(ByteSpan bytes, ModelFiles& files) {
    STX_TRY(auto header, readPlyHeader(bytes));
    if (isPackedSplatPly(header))
        return fail(ErrorCode::unsupported,
                    "the splats are packed as PlayCanvas does it (.compressed.ply), which is not "
                    "read here; splat-transform (@playcanvas/splat-transform of npm) turns the "
                    "file into a plain .ply");
    if (isSplatPly(header)) return readSplatPly(bytes, header, files.job());
    return PlyReader(bytes, std::move(header), files).read();
}

}  // namespace stx
