#include "formats/meshes/obj_faces.hpp"

#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include <glm/glm.hpp>

#include "formats/files/text_encoding.hpp"
#include "lib/base/whole_number.hpp"

namespace stx {
namespace {

/// Takes the next line off a text, joined where it goes on behind a backslash, without comments,
/// which end where their lines do.
/// `joined` keeps it where it is not as in the text.
std::string_view joinedLine(std::string_view& text, std::string& joined) {
    joined.clear();
    std::string_view line;
    for (bool goesOn = true; goesOn && !text.empty();) {
        const auto end = text.find('\n');
        line = text.substr(0, end);
        line = trimmed(line.substr(0, line.find('#')));
        text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
        goesOn = line.ends_with('\\');
        if (!goesOn && joined.empty()) break;
        joined += goesOn ? line.substr(0, line.size() - 1) : line;
        joined += ' ';
        line = joined;
    }
    return line;
}

/// Calls visit(keyword, what is behind it, the line as it is) for each line until it gives false.
template <class Visit>
bool eachLine(std::string_view text, const Visit& visit) {
    std::string joined;
    while (!text.empty()) {
        const auto before = text;
        std::string_view rest = joinedLine(text, joined);
        const auto key = takeWord(rest);
        if (!visit(key, rest, before.substr(0, before.size() - text.size()))) return false;
    }
    return true;
}

constexpr std::uint32_t kFlat = 0;

/// Numbers the groups by their names.
class Groups {
  public:
    std::uint32_t numberOf(std::string_view name) {
        if (name.empty() || name == "off" || name == "0") return kFlat;
        const auto next = static_cast<std::uint32_t>(known_.size()) + 1;
        return known_.emplace(name, next).first->second;
    }

  private:
    std::map<std::string, std::uint32_t, std::less<>> known_;
};

/// A corner as `vertex/texture coordinate`, and its vertex, counted from 0.
struct Corner {
    std::string_view text;
    std::uint32_t vertex = 0;
};

bool readCorners(std::string_view values, std::size_t vertices, std::vector<Corner>& corners) {
    corners.clear();
    for (auto word = takeWord(values); !word.empty(); word = takeWord(values)) {
        const auto first = word.find('/');
        const auto number = wholeNumber<std::int64_t>(word.substr(0, first));
        if (!number) return false;
        const auto vertex =
            *number < 0 ? *number + static_cast<std::int64_t>(vertices) : *number - 1;
        if (vertex < 0 || vertex >= static_cast<std::int64_t>(vertices)) return false;
        const auto second = first == std::string_view::npos ? first : word.find('/', first + 1);
        corners.push_back({word.substr(0, second), static_cast<std::uint32_t>(vertex)});
    }
    return true;
}

bool readPosition(std::string_view values, glm::dvec3& position) {
    for (int k = 0; k < 3; ++k) {
        auto word = takeWord(values);
        if (word.starts_with('+')) word.remove_prefix(1);
        const auto number = wholeNumber<double>(word);
        if (!number) return false;
        position[k] = *number;
    }
    return true;
}

class Smoother {
  public:
    /// False: not understood.
    bool sum(std::string_view text) {
        return eachFace(text, [&](std::uint32_t group, const auto& corners) {
            const auto normal = areaNormal(corners);
            if (group != kFlat)
                for (const auto& c : corners) sums_[keyOf(group, c.vertex)] += normal;
        });
    }

    /// The text, and in front of it all normals.
    std::string write(std::string_view text) {
        std::string faces;
        std::unordered_map<std::uint64_t, std::uint32_t> numbers;  // of the normals of sums_
        Groups groups;
        std::uint32_t group = kFlat;
        std::vector<Corner> corners;
        std::size_t vertices = 0;
        eachLine(text, [&](auto key, auto values, std::string_view line) {
            if (key == "v") ++vertices;
            if (key == "s") group = groups.numberOf(trimmed(values));
            if (key != "f" || !readCorners(values, vertices, corners)) {
                faces += line;
                return true;
            }
            std::uint32_t own = 0;  // the normal of the face
            faces += 'f';
            for (const auto& c : corners) {
                const auto sum = sums_.find(keyOf(group, c.vertex));
                // Faces on both sides of a sheet leave none.
                const bool smooth = sum != sums_.end() && glm::length(sum->second) > 0;
                auto& number = smooth ? numbers[sum->first] : own;
                if (number == 0) number = add(smooth ? sum->second : areaNormal(corners));
                const bool plain = c.text.find('/') == std::string_view::npos;
                faces += fmt::format(" {}{}/{}", c.text, plain ? "/" : "", number);
            }
            faces += '\n';
            return true;
        });
        return normals_ + faces;
    }

  private:
    template <class Visit>
    bool eachFace(std::string_view text, const Visit& visit) {
        Groups groups;
        std::uint32_t group = kFlat;
        std::vector<Corner> corners;
        return eachLine(text, [&](auto key, auto values, std::string_view) {
            if (key == "s") {
                group = groups.numberOf(trimmed(values));
            } else if (key == "v") {
                return readPosition(values, positions_.emplace_back());
            } else if (key == "f") {
                if (!readCorners(values, positions_.size(), corners)) return false;
                visit(group, corners);
            }
            return true;
        });
    }

    static std::uint64_t keyOf(std::uint32_t group, std::uint32_t vertex) {
        return std::uint64_t{group} << 32 | vertex;
    }
    /// As long as twice the area.
    [[nodiscard]] glm::dvec3 areaNormal(const std::vector<Corner>& corners) const {
        glm::dvec3 sum(0.0);
        if (corners.empty()) return sum;
        const auto from = positions_[corners[0].vertex];
        for (std::size_t i = 2; i < corners.size(); ++i) {
            sum += glm::cross(positions_[corners[i - 1].vertex] - from,
                              positions_[corners[i].vertex] - from);
        }
        return sum;
    }
    std::uint32_t add(glm::dvec3 normal) {
        const double length = glm::length(normal);
        // A face without area is left out later.
        const glm::vec3 n(length > 0 ? normal / length : glm::dvec3(0, 0, 1));
        normals_ += fmt::format("vn {} {} {}\n", n.x, n.y, n.z);
        return ++count_;
    }

    std::vector<glm::dvec3> positions_;
    std::unordered_map<std::uint64_t, glm::dvec3> sums_;
    std::string normals_;
    std::uint32_t count_ = 0;
};

}  // namespace

ObjFaces objFaces(ByteSpan text) {
    struct Kinds {
        bool bare = false, withUvs = false;
    };
    ObjFaces out;
    bool hasNormals = false, hasGroups = false;
    Groups groups;
    std::map<std::string, Kinds, std::less<>> kinds;  // of the faces of each material in an object
    const auto kindsOf = [&](std::string_view material) {
        return &kinds.emplace(material, Kinds()).first->second;
    };
    std::string material;
    Kinds* current = kindsOf(material);
    const auto endObject = [&] {
        for (const auto& [name, found] : kinds)
            if (found.bare && found.withUvs) out.bareMaterials.insert(name);
        kinds.clear();
        current = kindsOf(material);
    };
    eachLine(textOf(text), [&](auto key, auto values, std::string_view) {
        if (key == "o" || key == "g") endObject();
        if (key == "vn") hasNormals = true;
        if (key == "s") hasGroups = hasGroups || groups.numberOf(trimmed(values)) != kFlat;
        if (key == "usemtl") {
            material = trimmed(values);
            current = kindsOf(material);
        }
        if (key != "f") return true;
        const auto corner = takeWord(values);
        const auto slash = corner.find('/');
        const bool bare = slash == std::string_view::npos || slash + 1 == corner.size() ||
                          corner[slash + 1] == '/';
        (bare ? current->bare : current->withUvs) = true;
        return true;
    });
    endObject();
    out.smoothWithoutNormals = hasGroups && !hasNormals;
    return out;
}

std::optional<Bytes> withSmoothNormals(ByteSpan bytes) {
    const auto text = textOf(bytes);
    Smoother smoother;
    if (!smoother.sum(text)) return std::nullopt;
    const std::string out = smoother.write(text);
    const auto written = std::as_bytes(std::span(out));
    return Bytes(written.begin(), written.end());
}

}  // namespace stx
