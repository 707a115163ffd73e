#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "formats/files/text_encoding.hpp"
#include "formats/meshes/mesh_builder.hpp"
#include "formats/meshes/readers.hpp"
#include "formats/meshes/triangulate.hpp"
#include "formats/meshes/vertex_colours.hpp"
#include "lib/base/counted.hpp"

namespace stx {
namespace {

/// The Object File Format of Geomview as text (geomview.org, "OFF files"): `[ST][C][N][4]OFF`,
/// three counts, a line for each vertex, a line for each face.
class OffReader {
  public:
    OffReader(ByteSpan bytes, ModelFiles& files)
        : left_(textOf(bytes)), files_(files), job_(files.job()), builder_(files.job()) {}

    Result<Mesh> read() {
        STX_CHECK(readHeader());
        STX_CHECK(readVertices());
        STX_CHECK(readFaces());
        if (lines_ > 0) job_.note(fmt::format("dropped: lines ({})", lines_));
        if (points_ > 0 && !part_.points)
            job_.note(fmt::format("dropped: points in a mesh of triangles ({})", points_));
        if (faceColours_ > 0)
            job_.note(fmt::format("dropped: colours of faces ({})", faceColours_));
        if (unsaid_ > 0)
            job_.note(
                fmt::format("dropped: numbers behind the coordinates of vertices ({}); where "
                            "they are colours the first line says COFF",
                            unsaid_));
        const int place = files_.placeOfColour(builder_.textures(), !part_.uvs.empty());
        builder_.materials().push_back(
            {.name = "default", .baseColourTexture = place, .hasColour = false});
        part_.where = "OFF";
        if (!part_.points) weldVertices(part_);
        STX_CHECK(builder_.add(std::move(part_)));
        return builder_.finish();
    }

  private:
    template <class... Args>
    [[nodiscard]] tl::unexpected<Error> wrong(fmt::format_string<Args...> format, Args&&... args) {
        return failAt(fmt::format("line {}", lineNumber_), ErrorCode::invalidInput, "{}",
                      fmt::format(format, std::forward<Args>(args)...));
    }

    /// The next line that says something; what follows a # does not. False at the end.
    bool nextLine() {
        while (!left_.empty()) {
            const auto end = left_.find_first_of("\r\n");
            line_ = left_.substr(0, end);
            const bool pair = end != std::string_view::npos && left_.substr(end, 2) == "\r\n";
            left_.remove_prefix(end == std::string_view::npos ? left_.size()
                                                              : end + (pair ? 2 : 1));
            ++lineNumber_;
            line_ = trimmed(line_.substr(0, line_.find('#')));
            if (!line_.empty()) return true;
        }
        return false;
    }
    /// The next word of the line; empty at its end.
    std::string_view nextWord() {
        const auto end = std::min(line_.find_first_of(" \t"), line_.size());
        const auto word = line_.substr(0, end);
        line_ = trimmed(line_.substr(end));
        return word;
    }
    template <class Number>
    std::optional<Number> nextNumber() {
        auto word = nextWord();
        if (word.starts_with('+')) word.remove_prefix(1);
        Number value{};
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
        if (error != std::errc() || end != word.data() + word.size() || word.empty())
            return std::nullopt;
        return value;
    }

    Result<void> readHeader() {
        if (!nextLine()) return wrong("the file says nothing; OFF and three counts are expected");
        // The word may be left out; 4OFF is one, too.
        const auto first = line_.substr(0, line_.find_first_of(" \t"));
        if (first.ends_with("OFF") || first[0] < '0' || first[0] > '9') {
            auto word = nextWord();
            const auto takes = [&word](std::string_view prefix) {
                if (!word.starts_with(prefix)) return false;
                word.remove_prefix(prefix.size());
                return true;
            };
            hasUvs_ = takes("ST");
            hasColours_ = takes("C");
            hasNormals_ = takes("N");
            homogeneous_ = takes("4");
            if (word != "OFF")
                return wrong("found '{}' where OFF is expected; only three dimensions are read",
                             std::string(word.substr(0, 20)));
            if (line_.starts_with("BINARY"))
                return fail(ErrorCode::unsupported,
                            "binary OFF files are not supported; save it as text");
        }
        std::uint64_t counts[2] = {};
        for (auto& count : counts) {
            while (line_.empty()) {
                if (!nextLine())
                    return wrong("the file ends before its counts of vertices and faces");
            }
            const auto number = nextNumber<std::uint64_t>();
            if (!number) return wrong("a count of vertices or faces is expected");
            count = *number;
        }
        // Each vertex and each face takes a line of two characters and its end at least.
        if (counts[0] == 0 || counts[0] > left_.size() / 3 + 1 || counts[1] > left_.size() / 3 + 1)
            return wrong("it claims {} vertices and {} faces, which {} bytes cannot hold",
                         counts[0], counts[1], left_.size());
        vertices_ = counts[0];
        faces_ = counts[1];
        return {};
    }

    Result<void> readVertices() {
        STX_CHECK(builder_.charge(vertices_, 100, "the vertices"));
        constexpr float kNoAlpha = std::numeric_limits<float>::quiet_NaN();
        for (std::uint64_t i = 0; i < vertices_; ++i) {
            if (!nextLine())
                return wrong("the file ends after {} of {} vertices; it is cut off", i, vertices_);
            // x y z [w] [normal] [colour of 3 or 4] [u v]
            double values[4] = {0, 0, 0, 1};
            for (int k = 0; k < (homogeneous_ ? 4 : 3); ++k) {
                const auto value = nextNumber<double>();
                if (!value)
                    return wrong("a vertex of {} numbers is expected", homogeneous_ ? 4 : 3);
                values[k] = *value;
            }
            part_.positions.emplace_back(glm::dvec3(values[0], values[1], values[2]) / values[3]);
            if (hasNormals_) {
                STX_TRY(const auto normal, floats<3>("a normal"));
                part_.normals.emplace_back(normal[0], normal[1], normal[2]);
            }
            glm::vec2 uv(0);
            glm::vec4 colour(glm::vec3(1), kNoAlpha);
            if (!hasUvs_ && !hasColours_) {
                if (!line_.empty()) ++unsaid_;
            } else {
                std::vector<float> rest;
                while (!line_.empty()) {
                    const auto value = nextNumber<double>();
                    if (!value || rest.size() == 6) return wrong("the vertex has other words");
                    rest.push_back(static_cast<float>(*value));
                }
                const std::size_t ofUv = hasUvs_ ? 2 : 0;
                const std::size_t ofColour = rest.size() - std::min(ofUv, rest.size());
                if (rest.size() < ofUv || (hasColours_ && ofColour != 3 && ofColour != 4) ||
                    (!hasColours_ && ofColour != 0))
                    return wrong("the vertex has {} behind its place; {} expected",
                                 counted(rest.size(), "number"),
                                 !hasColours_ ? "2 are"
                                 : hasUvs_    ? "5 or 6 are"
                                              : "3 or 4 are");
                for (std::size_t k = 0; k < ofColour; ++k) colour[static_cast<int>(k)] = rest[k];
                if (hasUvs_) uv = {rest[ofColour], 1 - rest[ofColour + 1]};  // v runs up here
            }
            if (hasColours_) part_.colours.push_back(colour);
            if (hasUvs_) part_.uvs.push_back(uv);
        }
        linearFromSrgbColours(part_.colours, true);
        for (auto& c : part_.colours)
            if (std::isnan(c.a)) c.a = 1;
        return {};
    }

    template <int kCount>
    Result<std::array<float, kCount>> floats(const char* what) {
        std::array<float, kCount> values{};
        for (auto& value : values) {
            const auto number = nextNumber<double>();
            if (!number) return wrong("{} of {} numbers is expected", what, kCount);
            value = static_cast<float>(*number);
        }
        return values;
    }

    Result<void> readFaces() {
        std::vector<glm::dvec3> corners;
        std::vector<std::uint32_t> indices;
        std::vector<glm::uvec3> cut;
        std::vector<bool> named(vertices_);  // as points
        std::uint64_t taken = 0;
        for (std::uint64_t f = 0; f < faces_; ++f) {
            if (!nextLine())
                return wrong("the file ends after {} of {} faces; it is cut off", f, faces_);
            const auto count = nextNumber<std::uint64_t>();
            if (!count || *count == 0) return wrong("a face's number of corners is expected");
            if (*count > line_.size())
                return wrong("the face claims {} corners, more than its line holds", *count);
            indices.clear();
            for (std::uint64_t k = 0; k < *count; ++k) {
                const auto index = nextNumber<std::uint64_t>();
                if (!index) return wrong("the face has {} of {} corners", k, *count);
                if (*index >= vertices_)
                    return wrong("the face names vertex {}; there are {}, counted from 0", *index,
                                 vertices_);
                indices.push_back(static_cast<std::uint32_t>(*index));
            }
            if (!line_.empty()) ++faceColours_;
            if (*count < 3) {
                ++(*count == 1 ? points_ : lines_);
                if (*count == 1) named[indices[0]] = true;
                continue;
            }
            corners.clear();
            cut.clear();
            for (const auto i : indices) corners.push_back(part_.positions[i]);
            triangulate(corners, cut);
            if (part_.triangles.size() + cut.size() > taken) {
                taken += 1 << 20;
                STX_CHECK(builder_.charge(1 << 20, 40, "the faces"));
            }
            for (const auto& t : cut)
                part_.triangles.emplace_back(indices[t.x], indices[t.y], indices[t.z]);
        }
        part_.points = part_.triangles.empty() && (points_ > 0 || faces_ == 0);
        if (part_.points && faces_ > 0) keepVertices(part_, named);
        return {};
    }

    std::string_view left_, line_;
    std::uint64_t lineNumber_ = 0;
    ModelFiles& files_;
    Job& job_;
    MeshBuilder builder_;
    MeshPart part_;
    bool hasUvs_ = false, hasColours_ = false, hasNormals_ = false, homogeneous_ = false;
    std::uint64_t vertices_ = 0, faces_ = 0;
    std::uint64_t lines_ = 0, points_ = 0, faceColours_ = 0;
    std::uint64_t unsaid_ = 0;  ///< vertices with more numbers than the first line says
};

}  // namespace

Result<Mesh> readOff(ByteSpan bytes, ModelFiles& files) {
    return OffReader(bytes, files).read();
}

}  // namespace stx
