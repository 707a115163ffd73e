#include "formats/meshes/mesh_builder.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <unordered_map>

#include "lib/geometry/origin.hpp"
#include "lib/model/strays.hpp"

namespace stx {
namespace {

bool finite(glm::vec2 v) {
    return std::isfinite(v.x) && std::isfinite(v.y);
}
bool finite(glm::vec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
/// As a float, too.
bool finite(glm::dvec3 v) {
    return finite(glm::vec3(v));
}
bool finite(glm::vec4 v) {
    return finite(glm::vec3(v)) && std::isfinite(v.w);
}

glm::dvec3 areaNormal(const std::vector<glm::dvec3>& positions, glm::uvec3 t) {
    const auto a = positions[t.x];
    return glm::cross(positions[t.y] - a, positions[t.z] - a);
}

/// Appends `from` to `to`, which is as long as `before`, or empty when no part had it so far.
template <class T>
void append(std::vector<T>& to, std::size_t before, const std::vector<T>& from, std::size_t count,
            T missing) {
    if (from.empty() && to.empty()) return;
    to.resize(before, missing);
    if (from.empty())
        to.resize(before + count, missing);
    else
        to.insert(to.end(), from.begin(), from.end());
}

template <class T>
void copyVertex(std::vector<T>& values, std::uint32_t from) {
    if (!values.empty()) values.push_back(T(values[from]));
}

constexpr glm::vec3 kNoNormal{0.0f};
constexpr glm::vec4 kAnyTangent{1, 0, 0, 1};

/// Gives the corners of triangles for which missing(vertex) the normal of their face. A vertex that
/// has another face's already is copied: position and normal here, all else by copyOthers(vertex).
template <class Missing, class CopyOthers>
void giveFaceNormals(std::vector<glm::dvec3>& positions, std::vector<glm::uvec3>& triangles,
                     std::vector<glm::vec3>& normals, const Missing& missing,
                     const CopyOthers& copyOthers) {
    for (auto& t : triangles) {
        const auto area = areaNormal(positions, t);
        if (area == glm::dvec3(0.0)) continue;
        const glm::vec3 face(glm::normalize(area));
        for (int k = 0; k < 3; ++k) {
            const auto v = t[k];
            if (!missing(v)) continue;
            if (normals[v] != kNoNormal && normals[v] != face) {
                t[k] = static_cast<std::uint32_t>(positions.size());
                copyVertex(positions, v);
                copyVertex(normals, v);
                copyOthers(v);
            }
            normals[t[k]] = face;
        }
    }
}

/// Twice the signed area of a triangle in its uvs: mirrored ones have the other sign.
double uvArea(const std::vector<glm::vec2>& uvs, glm::uvec3 t) {
    const auto d1 = glm::dvec2(uvs[t.y]) - glm::dvec2(uvs[t.x]);
    const auto d2 = glm::dvec2(uvs[t.z]) - glm::dvec2(uvs[t.x]);
    return d1.x * d2.y - d2.x * d1.y;
}

/// The uvs that textures have of their own, in a part and in the mesh.
constexpr std::pair<std::vector<glm::vec2> MeshPart::*, std::vector<glm::vec2> Mesh::*> kOwnUvs[] =
    {{&MeshPart::normalUvs, &Mesh::normalUvs},
     {&MeshPart::metallicRoughnessUvs, &Mesh::metallicRoughnessUvs},
     {&MeshPart::emissiveUvs, &Mesh::emissiveUvs}};

/// giveFaceNormals() of a part: copies have all that their vertex has.
template <class Missing>
void giveFaceNormals(MeshPart& part, const Missing& missing) {
    giveFaceNormals(part.positions, part.triangles, part.normals, missing, [&](std::uint32_t v) {
        copyVertex(part.tangents, v);
        copyVertex(part.colours, v);
        copyVertex(part.uvs, v);
        for (const auto& [own, _] : kOwnUvs) copyVertex(part.*own, v);
    });
}

}  // namespace

Result<void> MeshBuilder::charge(std::uint64_t count, std::uint64_t bytesEach,
                                 std::string_view what) {
    STX_CHECK(job_.limits.checkAllocation(count, bytesEach, what));
    charged_ += count * bytesEach;
    if (charged_ > job_.limits.maxMemoryBytes)
        return fail(
            ErrorCode::invalidInput,
            "{} brings the model past the memory limit of {} MiB; raise it with --max-memory "
            "if the file is to be trusted",
            what, job_.limits.maxMemoryBytes >> 20);
    return {};
}

Result<void> MeshBuilder::add(MeshPart part) {
    STX_CHECK(job_.checkCancelled());
    const auto fits = [&](const auto& values) {
        return values.empty() || values.size() == part.positions.size();
    };
    if (!fits(part.normals) || !fits(part.tangents) || !fits(part.colours) || !fits(part.uvs) ||
        !std::ranges::all_of(kOwnUvs, [&](const auto& own) { return fits(part.*own.first); }))
        return fail(ErrorCode::invalidInput,
                    "{}: normals, colours or texture coordinates are not as many as the {} "
                    "positions",
                    part.where, part.positions.size());
    if (part.points) dropBrokenPoints(part);
    const auto count = part.positions.size();
    if (count == 0) return {};
    ++parts_;
    for (std::size_t i = 0; i < count; ++i) {
        const auto p = part.positions[i];
        if (!finite(p))
            return fail(ErrorCode::invalidInput,
                        "{}: vertex {} is at ({}, {}, {}); positions must be finite numbers",
                        part.where, i, p.x, p.y, p.z);
    }
    for (std::size_t i = 0; i < part.triangles.size(); ++i) {
        const auto t = part.triangles[i];
        const auto largest = std::max({t.x, t.y, t.z});
        if (largest >= count)
            return fail(ErrorCode::invalidInput,
                        "{}: triangle {} uses vertex {}, but there are only {} vertices",
                        part.where, i, largest, count);
    }
    const auto before = positions_.size();
    STX_CHECK(charge(
        count,
        sizeof(glm::dvec3) + sizeof(glm::vec3) * 2 + sizeof(glm::vec4) * 2 + sizeof(glm::vec2),
        part.where));
    STX_CHECK(charge(part.triangles.size(), sizeof(glm::uvec3) + 4, part.where));
    if (before + count > std::numeric_limits<std::uint32_t>::max())
        return fail(ErrorCode::invalidInput, "{}: the model has more than 2^32 vertices",
                    part.where);
    repair(part);
    if (part.points) paintPoints(part);

    const auto added = part.positions.size();
    append(mesh_.normals, before, part.normals, added, kNoNormal);
    append(mesh_.tangents, before, part.tangents, added, kAnyTangent);
    append(mesh_.colours, before, part.colours, added, glm::vec4(1));
    for (const auto& [ofPart, ofMesh] : kOwnUvs) {
        const auto& own = part.*ofPart;
        auto& all = mesh_.*ofMesh;
        if (own.empty() && all.empty()) continue;
        if (all.empty()) {
            STX_CHECK(charge(before, sizeof(glm::vec2), part.where));
            all = mesh_.uvs;
        }
        STX_CHECK(charge(added, sizeof(glm::vec2), part.where));
        append(all, before, own.empty() ? part.uvs : own, added, glm::vec2(0));
    }
    append(mesh_.uvs, before, part.uvs, added, glm::vec2(0));
    positions_.insert(positions_.end(), part.positions.begin(), part.positions.end());

    const auto base = static_cast<std::uint32_t>(before);
    for (const auto& t : part.triangles) mesh_.triangles.push_back(t + base);
    mesh_.triangleMaterial.resize(mesh_.triangles.size(), part.material);
    if (part.points) {
        for (std::size_t i = 0; i < added; ++i)
            mesh_.points.push_back(base + static_cast<std::uint32_t>(i));
    }
    return {};
}

void MeshBuilder::dropBrokenPoints(MeshPart& part) {
    const auto count = part.positions.size();
    std::vector<bool> broken(count);
    std::uint64_t found = 0;
    for (std::size_t i = 0; i < count; ++i) {
        broken[i] = !finite(part.positions[i]);
        found += broken[i] ? 1 : 0;
    }
    points_ += count;
    brokenPoints_ += found;
    broken.flip();
    if (found > 0) keepVertices(part, broken);
}

/// A Mesh has no material of points: its colour goes into their vertices.
void MeshBuilder::paintPoints(MeshPart& part) {
    if (part.material >= mesh_.materials.size()) return;
    const Material& m = mesh_.materials[part.material];
    if (m.baseColourTexture >= 0)
        job_.note(fmt::format("{}: the texture of material '{}' is not drawn on points", part.where,
                              m.name));
    const glm::vec3 base(m.baseColour), light = m.emissiveTexture < 0 ? m.emissive : glm::vec3(0);
    if (base == glm::vec3(1) && light == glm::vec3(0)) return;
    part.colours.resize(part.positions.size(), glm::vec4(1));
    for (auto& c : part.colours) c = glm::vec4(glm::vec3(c) * base + light, c.a);
}

void MeshBuilder::repair(MeshPart& part) {
    const auto withoutArea = [&](glm::uvec3 t) {
        return t.x == t.y || t.y == t.z || t.x == t.z ||
               areaNormal(part.positions, t) == glm::dvec3(0.0);
    };
    flatTriangles_ += std::erase_if(part.triangles, withoutArea);

    bool broken = false;
    const auto repairUvs = [&](std::vector<glm::vec2>& uvs) {
        for (auto& uv : uvs) {
            if (!finite(uv)) uv = glm::vec2(0), broken = true;
        }
    };
    repairUvs(part.uvs);
    for (const auto& [own, _] : kOwnUvs) repairUvs(part.*own);
    if (broken)
        job_.note(
            fmt::format("{}: texture coordinates that are not finite are taken as 0", part.where));
    broken = false;
    for (auto& c : part.colours) {
        if (!finite(c)) c = glm::vec4(0, 0, 0, 1), broken = true;
    }
    if (broken)
        job_.note(
            fmt::format("{}: vertex colours that are not finite are taken as black", part.where));

    std::size_t brokenNormals = 0;
    for (auto& n : part.normals) {
        const float length = glm::length(n);
        if (std::isfinite(length) && length > 0) {
            n /= length;
        } else {
            n = kNoNormal;
            ++brokenNormals;
        }
    }
    if (brokenNormals == part.normals.size()) {
        part.normals.clear();
    } else if (brokenNormals > 0) {
        std::vector<bool> given(part.normals.size());
        for (std::size_t i = 0; i < given.size(); ++i) given[i] = part.normals[i] != kNoNormal;
        giveFaceNormals(part, [&](std::uint32_t v) { return v >= given.size() || !given[v]; });
    }
    if (brokenNormals > 0 && (part.points || !part.triangles.empty()))
        job_.note(fmt::format(
            "{}: {} normals are no directions; {}", part.where, brokenNormals,
            part.points ? "these points have none" : "those of the triangles are used"));

    for (auto& t : part.tangents) {
        const float length = glm::length(glm::vec3(t));
        t = std::isfinite(length) && length > 0
                ? glm::vec4(glm::vec3(t) / length, t.w < 0 ? -1.0f : 1.0f)
                : kAnyTangent;
    }
    const bool hasNormalMap = !part.triangles.empty() && part.material < mesh_.materials.size() &&
                              mesh_.materials[part.material].normalTexture >= 0;
    if (!hasNormalMap) {
        part.tangents.clear();
        part.normalUvs.clear();
    } else {
        if (part.normals.empty()) addFlatNormals(part);
        if (part.tangents.empty()) addTangents(part);
    }
}

void MeshBuilder::fillNormals() {
    if (mesh_.normals.empty()) return;
    std::vector<bool> given(positions_.size());
    for (std::size_t i = 0; i < given.size(); ++i) given[i] = mesh_.normals[i] != kNoNormal;
    giveFaceNormals(
        positions_, mesh_.triangles, mesh_.normals,
        [&](std::uint32_t v) { return v >= given.size() || !given[v]; },
        [&](std::uint32_t v) {
            copyVertex(mesh_.tangents, v);
            copyVertex(mesh_.colours, v);
            copyVertex(mesh_.uvs, v);
            for (const auto& [_, own] : kOwnUvs) copyVertex(mesh_.*own, v);
        });
}

/// Between a float of the size of the largest coordinate and the next.
double MeshBuilder::largestStep() const {
    double largest = 0;
    for (const auto& p : positions_)
        for (int k = 0; k < 3; ++k) largest = std::max(largest, std::abs(p[k]));
    const auto value = static_cast<float>(largest);
    return std::nextafter(value, std::numeric_limits<float>::infinity()) - value;
}

/// Doubles become floats, from an origin where floats would lose too much.
void MeshBuilder::roundPositions() {
    const auto triangles = mesh_.triangles.size(), count = triangles + mesh_.points.size();
    const auto strays = findStrays(count, [&](std::uint64_t i) -> Piece {
        if (i >= triangles) {
            const auto p = positions_[mesh_.points[i - triangles]];
            return {p, p};
        }
        const auto& t = mesh_.triangles[i];
        const auto a = positions_[t.x], b = positions_[t.y], c = positions_[t.z];
        return {glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))};
    });
    noteStrays(strays, count,
               triangles == 0         ? "points"
               : mesh_.points.empty() ? "triangles"
                                      : "triangles and points",
               mesh_.origin, job_);
    const auto origin = originFor(strays.bounds);
    mesh_.origin += origin;
    if (rounded_ && origin != glm::dvec3(0.0))
        job_.note(fmt::format(
            "the coordinates are too large for 32-bit floats, to which the reader of this format "
            "rounds them, in steps of up to {:.2g}: where that shows, move the model to the origin "
            "or save it as OBJ; the origin {} {} {} is kept beside them",
            largestStep(), mesh_.origin.x, mesh_.origin.y, mesh_.origin.z));
    else
        noteOrigin(mesh_.origin, job_);
    mesh_.positions.reserve(positions_.size());
    for (auto& p : positions_) {
        mesh_.positions.emplace_back(p - origin);
        p = glm::dvec3(mesh_.positions.back());
    }
    // Rounding takes the area of the narrowest ones.
    std::size_t kept = 0;
    for (std::size_t i = 0; i < triangles; ++i) {
        if (areaNormal(positions_, mesh_.triangles[i]) == glm::dvec3(0.0)) continue;
        mesh_.triangles[kept] = mesh_.triangles[i];
        mesh_.triangleMaterial[kept++] = mesh_.triangleMaterial[i];
    }
    flatTriangles_ += triangles - kept;
    mesh_.triangles.resize(kept);
    mesh_.triangleMaterial.resize(kept);
    positions_ = {};
}

/// A material that no triangle has is not a colour of the model, and its maps need no coordinates:
/// all primitives that have it may be drawn with a copy without maps, for lack of them.
void MeshBuilder::dropUnusedTextures() {
    std::vector<bool> used(mesh_.materials.size());
    for (const auto m : mesh_.triangleMaterial)
        if (m < used.size()) used[m] = true;
    for (std::size_t i = 0; i < used.size(); ++i) {
        auto& m = mesh_.materials[i];
        if (used[i]) continue;
        for (int* map : {&m.baseColourTexture, &m.emissiveTexture, &m.metallicRoughnessTexture,
                         &m.normalTexture})
            *map = -1;
    }
}

Result<Mesh> MeshBuilder::finish() {
    if (!mesh_.triangles.empty() || !mesh_.points.empty()) {
        fillNormals();
        roundPositions();
    }
    if (flatTriangles_ > 0)
        job_.note(flatTriangles_ == 1
                      ? "1 triangle has no area and is left out"
                      : fmt::format("{} triangles have no area and are left out", flatTriangles_));
    if (brokenPoints_ > 0 && brokenPoints_ < points_)
        job_.note(fmt::format("{} of {} points are at no finite place and are skipped",
                              brokenPoints_, points_));
    if (mesh_.triangles.empty() && mesh_.points.empty()) {
        if (brokenPoints_ > 0)
            return fail(ErrorCode::invalidInput,
                        "none of the model's {} points is at a finite place; positions must be "
                        "finite numbers",
                        points_);
        // Where coordinates are rounded by more than centimetres, that may have taken the areas.
        constexpr double kCoarseStep = 1.0 / 128;
        if (flatTriangles_ > 0 && rounded_ && largestStep() > kCoarseStep)
            return fail(ErrorCode::invalidInput,
                        "the model has {} triangles, but none with an area, and no points; the "
                        "reader of this format rounds coordinates to 32-bit floats, here in steps "
                        "of up to {:.2g}: move the model to the origin or save it as OBJ",
                        flatTriangles_, largestStep());
        if (flatTriangles_ > 0)
            return fail(ErrorCode::invalidInput,
                        "the model has {} triangles, but none with an area, and no points",
                        flatTriangles_);
        return fail(
            ErrorCode::invalidInput,
            "the model has neither triangles nor points; export its faces or its vertices with it");
    }
    dropUnusedTextures();
    STX_CHECK(mesh_.check());
    return std::move(mesh_);
}

void noteOrigin(glm::dvec3 origin, Job& job) {
    if (origin == glm::dvec3(0.0)) return;
    job.note(
        fmt::format("the coordinates are too large for 32-bit floats: the origin {} {} {} is "
                    "subtracted before they are rounded, and kept beside them",
                    origin.x, origin.y, origin.z));
}

void keepVertices(MeshPart& part, const std::vector<bool>& kept) {
    const auto keep = [&](auto& values) {
        if (values.empty()) return;
        std::size_t count = 0;
        for (std::size_t i = 0; i < kept.size(); ++i) {
            if (kept[i]) values[count++] = values[i];
        }
        values.resize(count);
    };
    keep(part.positions);
    keep(part.normals);
    keep(part.tangents);
    keep(part.colours);
    keep(part.uvs);
    for (const auto& [own, _] : kOwnUvs) keep(part.*own);
}

void addFlatNormals(MeshPart& part) {
    part.normals.assign(part.positions.size(), kNoNormal);
    giveFaceNormals(part, [](std::uint32_t) { return true; });
}

namespace {

/// Doubles the vertices where coordinates that are mirrored meet others: tangents of both would
/// cancel out (MikkTSpace, which glTF 2.0 asks for, does not average them either).
void splitAtMirrors(MeshPart& part, const std::vector<glm::vec2>& uvs) {
    const auto count = part.positions.size();
    constexpr auto kNone = std::numeric_limits<std::uint32_t>::max();
    std::vector<signed char> turn(count, 0);  // of the first triangle at each vertex
    std::vector<std::uint32_t> twin(count, kNone);
    for (auto& t : part.triangles) {
        const double det = uvArea(uvs, t);
        if (det == 0) continue;
        const signed char own = det < 0 ? -1 : 1;
        for (int k = 0; k < 3; ++k) {
            const auto v = t[k];
            if (turn[v] == 0) turn[v] = own;
            if (turn[v] == own) continue;
            if (twin[v] == kNone) {
                twin[v] = static_cast<std::uint32_t>(part.positions.size());
                copyVertex(part.positions, v);
                copyVertex(part.normals, v);
                copyVertex(part.colours, v);
                copyVertex(part.uvs, v);
                for (const auto& [uvsOfMap, _] : kOwnUvs) copyVertex(part.*uvsOfMap, v);
            }
            t[k] = twin[v];
        }
    }
}

}  // namespace

void addTangents(MeshPart& part) {
    const auto& uvs = part.normalUvs.empty() ? part.uvs : part.normalUvs;
    if (uvs.empty() || part.normals.empty()) return;
    splitAtMirrors(part, uvs);
    std::vector<glm::dvec3> along(part.positions.size(), glm::dvec3(0)), across = along;
    for (const auto& t : part.triangles) {
        const auto p0 = part.positions[t.x];
        const auto e1 = part.positions[t.y] - p0, e2 = part.positions[t.z] - p0;
        const auto d1 = glm::dvec2(uvs[t.y]) - glm::dvec2(uvs[t.x]);
        const auto d2 = glm::dvec2(uvs[t.z]) - glm::dvec2(uvs[t.x]);
        const double det = uvArea(uvs, t);
        if (det == 0) continue;
        const auto du = (e1 * d2.y - e2 * d1.y) / det, dv = (e2 * d1.x - e1 * d2.x) / det;
        for (int k = 0; k < 3; ++k) {
            along[t[k]] += du;
            across[t[k]] += dv;
        }
    }
    part.tangents.assign(part.positions.size(), kAnyTangent);
    for (std::size_t i = 0; i < part.tangents.size(); ++i) {
        const glm::dvec3 n(part.normals[i]);
        if (part.normals[i] == kNoNormal) continue;  // of no triangle
        auto tangent = along[i] - n * glm::dot(n, along[i]);
        if (!(glm::length(tangent) > 0)) {
            // No direction in the uvs: any one across the normal will do.
            tangent =
                glm::cross(std::abs(n.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0), n);
        }
        tangent = glm::normalize(tangent);
        // v runs down in Mesh, so the bitangent (the direction of green) is the opposite of dP/dv.
        const double handedness = glm::dot(glm::cross(n, tangent), -across[i]) < 0 ? -1.0 : 1.0;
        part.tangents[i] = glm::vec4(glm::vec3(tangent), static_cast<float>(handedness));
    }
}

void weldVertices(MeshPart& part) {
    // The bits of position (doubles), normal, colour and uv.
    struct Key {
        std::uint32_t words[6 + 3 + 4 + 2];
        bool operator==(const Key& other) const {
            return std::memcmp(words, other.words, sizeof words) == 0;
        }
    };
    struct Hash {
        std::size_t operator()(const Key& key) const {
            std::uint64_t h = 1469598103934665603ull;
            for (const auto word : key.words) {
                h = (h ^ word) * 1099511628211ull;
                h ^= h >> 29;
            }
            return h;
        }
    };
    if (part.points || part.triangles.empty()) return;
    std::unordered_map<Key, std::uint32_t, Hash> known;
    known.reserve(part.positions.size());
    MeshPart out;
    std::vector<std::uint32_t> target(part.positions.size(), ~0u);
    const auto place = [&](std::uint32_t v) {
        if (target[v] != ~0u) return target[v];
        Key key{};
        std::memcpy(key.words, &part.positions[v], 24);
        if (!part.normals.empty()) std::memcpy(key.words + 6, &part.normals[v], 12);
        if (!part.colours.empty()) std::memcpy(key.words + 9, &part.colours[v], 16);
        if (!part.uvs.empty()) std::memcpy(key.words + 13, &part.uvs[v], 8);
        const auto [it, isNew] =
            known.try_emplace(key, static_cast<std::uint32_t>(out.positions.size()));
        if (isNew) {
            out.positions.push_back(part.positions[v]);
            if (!part.normals.empty()) out.normals.push_back(part.normals[v]);
            if (!part.colours.empty()) out.colours.push_back(part.colours[v]);
            if (!part.uvs.empty()) out.uvs.push_back(part.uvs[v]);
        }
        return target[v] = it->second;
    };
    for (auto& t : part.triangles) {
        for (int k = 0; k < 3; ++k) t[k] = place(t[k]);
    }
    part.positions = std::move(out.positions);
    part.normals = std::move(out.normals);
    part.colours = std::move(out.colours);
    part.uvs = std::move(out.uvs);
}

}  // namespace stx
