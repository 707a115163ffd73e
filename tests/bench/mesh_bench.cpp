// Writes a mesh for measurements: a sphere with bumps, binary PLY without colours.
// Usage: bench_mesh OUT.ply TRIANGLES

#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numbers>
#include <string>
#include <vector>

int main(int count, char** values) {
    const long triangles = count == 3 ? std::atol(values[2]) : 0;
    if (triangles < 8 || triangles > 200000000) {
        std::fprintf(stderr, "usage: bench_mesh OUT.ply TRIANGLES (8 to 200 million)\n");
        return 1;
    }
    // A grid of rows x 2 rows cells, two triangles each.
    const int rows = static_cast<int>(std::lround(std::sqrt(static_cast<double>(triangles) / 4)));
    const int columns = 2 * rows;
    std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                        std::to_string(std::int64_t{rows + 1} * (columns + 1)) +
                        "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                        std::to_string(std::int64_t{2} * rows * columns) +
                        "\nproperty list uchar int vertex_indices\nend_header\n";
    const auto put = [&](const void* from, std::size_t size) {
        bytes.append(static_cast<const char*>(from), size);
    };
    for (int j = 0; j <= rows; ++j) {
        const double latitude = std::numbers::pi * (static_cast<double>(j) / rows - 0.5);
        for (int i = 0; i <= columns; ++i) {
            const double longitude = 2 * std::numbers::pi * i / columns;
            const double r = 1 + 0.05 * std::sin(9 * longitude) * std::sin(7 * latitude) +
                             0.01 * std::sin(60 * longitude) * std::cos(50 * latitude);
            const float p[] = {static_cast<float>(r * std::cos(latitude) * std::sin(longitude)),
                               static_cast<float>(r * std::sin(latitude)),
                               static_cast<float>(r * std::cos(latitude) * std::cos(longitude))};
            put(p, sizeof(p));
        }
    }
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) {
            const std::int32_t a = j * (columns + 1) + i, b = a + columns + 1;
            for (const auto& face : {std::vector{a, a + 1, b + 1}, std::vector{a, b + 1, b}}) {
                bytes.push_back(3);
                put(face.data(), 3 * sizeof(std::int32_t));
            }
        }
    }
    std::FILE* file = std::fopen(values[1], "wb");
    const bool written = file && std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
    if (!file || std::fclose(file) != 0 || !written) {
        std::fprintf(stderr, "cannot write '%s': %s\n", values[1], std::strerror(errno));
        return 2;
    }
    return 0;
}
