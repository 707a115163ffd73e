#pragma once

#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/images/images.hpp"
#include "formats/meshes/meshes.hpp"
#include "lib/capture/material_sampler.hpp"
#include "tests/shared_data.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {

struct ReadModel {
    Mesh mesh;
    std::vector<std::string> notes;

    [[nodiscard]] bool hasNote(const std::string& words) const {
        for (const auto& n : notes) {
            if (n.find(words) != std::string::npos) return true;
        }
        return false;
    }
};

/// Reads a model that must be readable.
inline ReadModel readGood(const std::filesystem::path& path, const MeshOptions& options = {}) {
    Job job;
    auto mesh = readMesh(path, job, options);
    if (!mesh) {
        ADD_FAILURE() << mesh.error().text();
        return {};
    }
    return {std::move(*mesh), job.takeNotes()};
}

inline ReadModel readGoodText(const std::string& text, const std::string& name) {
    Job job;
    const auto* first = reinterpret_cast<const std::byte*>(text.data());
    auto mesh = readMesh(Bytes(first, first + text.size()), name, job);
    if (!mesh) {
        ADD_FAILURE() << mesh.error().text();
        return {};
    }
    return {std::move(*mesh), job.takeNotes()};
}

/// The error of a model that must not be readable.
inline Error readBadText(const std::string& text, const std::string& name, Limits limits = {}) {
    Job job;
    job.limits = limits;
    const auto* first = reinterpret_cast<const std::byte*>(text.data());
    auto mesh = readMesh(Bytes(first, first + text.size()), name, job);
    if (mesh) {
        ADD_FAILURE() << "was read, with " << mesh->triangles.size() << " triangles";
        return {};
    }
    return mesh.error();
}

inline void write(const std::filesystem::path& file, const std::string& text) {
    std::ofstream(file, std::ios::binary) << text;
}

/// A 2 x 1 picture.
inline void writePair(const std::filesystem::path& file, glm::u8vec4 left, glm::u8vec4 right) {
    Rgba8Image image(2, 1);
    image.at(0, 0) = left;
    image.at(1, 0) = right;
    const auto png = encodePng(2, 1, 4, 8, image.data(), true);
    ASSERT_TRUE(png);
    ASSERT_TRUE(writeFile(file, *png));
}

/// The middle of the first triangle.
inline glm::vec4 colourOf(const Mesh& mesh) {
    return MaterialSampler(mesh).colour(0, glm::vec3(1.0f / 3.0f));
}

/// A triangle with a material of these lines.
inline ReadModel objWith(const TemporaryFolder& folder, const std::string& material) {
    write(folder / "a.mtl", "newmtl paint\n" + material);
    write(folder / "a.obj",
          "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl paint\n"
          "f 1/1 2/2 3/3\n");
    return readGood(folder / "a.obj");
}

inline std::string base64(const std::vector<unsigned char>& bytes) {
    const char* alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        unsigned v = bytes[i] << 16;
        if (i + 1 < bytes.size()) v |= bytes[i + 1] << 8;
        if (i + 2 < bytes.size()) v |= bytes[i + 2];
        text += alphabet[v >> 18];
        text += alphabet[v >> 12 & 63];
        text += i + 1 < bytes.size() ? alphabet[v >> 6 & 63] : '=';
        text += i + 2 < bytes.size() ? alphabet[v & 63] : '=';
    }
    return text;
}

/// Builds a glTF text with everything in data URIs.
class GltfText {
  public:
    nlohmann::json root = {{"asset", {{"version", "2.0"}}},
                           {"scenes", {{{"nodes", {0}}}}},
                           {"nodes", {{{"mesh", 0}}}},
                           {"meshes", {{{"primitives", nlohmann::json::array()}}}}};

    template <class T>
    int view(const std::vector<T>& values, int stride = 0) {
        while (bytes_.size() % 4 != 0) bytes_.push_back(0);
        const auto at = bytes_.size();
        bytes_.resize(at + values.size() * sizeof(T));
        std::memcpy(bytes_.data() + at, values.data(), values.size() * sizeof(T));
        nlohmann::json v = {
            {"buffer", 0}, {"byteOffset", at}, {"byteLength", values.size() * sizeof(T)}};
        if (stride > 0) v["byteStride"] = stride;
        root["bufferViews"].push_back(v);
        return static_cast<int>(root["bufferViews"].size()) - 1;
    }
    int accessor(nlohmann::json a) {
        root["accessors"].push_back(std::move(a));
        return static_cast<int>(root["accessors"].size()) - 1;
    }
    template <class T>
    int accessor(const std::vector<T>& values, int componentType, const std::string& type,
                 int count, bool normalized = false) {
        const int v = view(values);
        return accessor({{"bufferView", v},
                         {"componentType", componentType},
                         {"type", type},
                         {"count", count},
                         {"normalized", normalized}});
    }
    nlohmann::json& primitive() { return root["meshes"][0]["primitives"][0]; }
    /// A quad of two triangles in z = 0 from (0, 0) to (1, 1) with TEXCOORD_0 = (x, y).
    void addQuad() {
        const int position =
            accessor(std::vector<float>{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, 5126, "VEC3", 4);
        const int uv = accessor(std::vector<float>{0, 0, 1, 0, 1, 1, 0, 1}, 5126, "VEC2", 4);
        const int index = accessor(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3}, 5123, "SCALAR", 6);
        root["meshes"][0]["primitives"].push_back(
            {{"attributes", {{"POSITION", position}, {"TEXCOORD_0", uv}}}, {"indices", index}});
    }
    /// A 2 x 1 PNG: red, then half-transparent green; images[0] and textures[0].
    void addTexture() {
        root["images"] = {{{"uri",
                            "data:image/png;base64,"
                            "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAYAAAD0In+KAAAAD0lEQVR42mP4"
                            "z8DwHwgbABB5A37EGHKQAAAAAElFTkSuQmCC"}}};
        root["textures"] = {{{"source", 0}}};
    }
    [[nodiscard]] std::string text() const {
        auto copy = root;
        if (!bytes_.empty())
            copy["buffers"] = {{{"byteLength", bytes_.size()},
                                {"uri", "data:application/octet-stream;base64," + base64(bytes_)}}};
        return copy.dump();
    }

  private:
    std::vector<unsigned char> bytes_;
};

inline void expectNear(glm::vec3 a, glm::vec3 b, float tolerance = 1e-6f) {
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], tolerance) << "component " << k;
}
inline void expectNear(glm::vec2 a, glm::vec2 b, float tolerance = 1e-6f) {
    for (int k = 0; k < 2; ++k) EXPECT_NEAR(a[k], b[k], tolerance) << "component " << k;
}

}  // namespace stx
