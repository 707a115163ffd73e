#include <cmath>
#include <cstring>

#include <draco/compression/encode.h>
#include <draco/point_cloud/point_cloud_builder.h>

#include "formats/meshes/meshes.hpp"
#include "lib/geometry/bounds.hpp"

namespace stx {
namespace {

Result<void> check(const PointCloud& points) {
    const auto n = points.positions.size();
    if (n == 0) return fail(ErrorCode::invalidInput, "there are no points to write");
    if (n > 0x7fffffff)
        return fail(ErrorCode::invalidInput,
                    "{} points are more than a point file can hold (2^31 - 1)", n);
    if ((!points.colours.empty() && points.colours.size() != n) ||
        (!points.normals.empty() && points.normals.size() != n))
        return fail(ErrorCode::invalidInput,
                    "there are {} points but {} colours and {} normals; all must be as many", n,
                    points.colours.size(), points.normals.size());
    const auto finite = [](glm::vec3 v) {
        return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
    };
    for (std::size_t i = 0; i < n; ++i) {
        if (!finite(points.positions[i]) || (!points.normals.empty() && !finite(points.normals[i])))
            return fail(ErrorCode::invalidInput,
                        "point {} has a position or normal that is not finite", i);
    }
    return {};
}

Bytes encodePly(const PointCloud& points) {
    const bool hasNormals = !points.normals.empty(), hasColours = !points.colours.empty();
    const bool large = points.origin != glm::dvec3(0.0);
    const char* type = large ? "double" : "float";
    std::string header = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
        "property {} x\nproperty {} y\nproperty {} z\n",
        points.positions.size(), type, type, type);
    if (hasNormals) header += "property float nx\nproperty float ny\nproperty float nz\n";
    if (hasColours) header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    if (hasColours && points.alpha) header += "property uchar alpha\n";
    header += "end_header\n";
    const std::size_t colourBytes = !hasColours ? 0 : points.alpha ? 4 : 3;
    const std::size_t positionBytes = large ? 24 : 12;
    const std::size_t each = positionBytes + (hasNormals ? 12 : 0) + colourBytes;
    Bytes bytes(header.size() + each * points.positions.size());
    std::memcpy(bytes.data(), header.data(), header.size());
    auto* at = bytes.data() + header.size();
    for (std::size_t i = 0; i < points.positions.size(); ++i) {
        const glm::dvec3 world = glm::dvec3(points.positions[i]) + points.origin;
        if (large)
            std::memcpy(at, &world, positionBytes);
        else
            std::memcpy(at, &points.positions[i], positionBytes);
        at += positionBytes;
        if (hasNormals) {
            std::memcpy(at, &points.normals[i], 12);
            at += 12;
        }
        if (hasColours) std::memcpy(at, &points.colours[i], colourBytes);
        at += colourBytes;
    }
    return bytes;
}

Result<Bytes> encodeDraco(const PointCloud& points, Job& job, const PointWriteOptions& options) {
    const auto inRange = [](int bits, int least) {
        return bits == 0 || (bits >= least && bits <= 30);
    };
    if (!inRange(options.positionBits, 1) || !inRange(options.normalBits, 2))
        return fail(
            ErrorCode::usage,
            "Draco codes positions with 1 to 30 bits and normals with 2 to 30, not {} and {}",
            options.positionBits, options.normalBits);
    const auto n = static_cast<draco::PointIndex::ValueType>(points.positions.size());
    draco::PointCloudBuilder builder;
    builder.Start(n);
    const int position =
        builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    builder.SetAttributeValuesForAllPoints(position, points.positions.data(), sizeof(glm::vec3));
    if (!points.normals.empty()) {
        const int normal =
            builder.AddAttribute(draco::GeometryAttribute::NORMAL, 3, draco::DT_FLOAT32);
        builder.SetAttributeValuesForAllPoints(normal, points.normals.data(), sizeof(glm::vec3));
    }
    int colour = -1;
    if (!points.colours.empty()) {
        colour = builder.AddAttribute(draco::GeometryAttribute::COLOR, points.alpha ? 4 : 3,
                                      draco::DT_UINT8);
        builder.SetAttributeValuesForAllPoints(colour, points.colours.data(), sizeof(glm::u8vec4));
    }
    const auto cloud = builder.Finalize(false);
    if (!cloud) return fail(ErrorCode::failed, "Draco cannot take {} points", n);

    if (colour >= 0) cloud->attribute(colour)->set_normalized(true);

    draco::Encoder encoder;
    encoder.SetSpeedOptions(3, 3);
    if (options.positionBits > 0)
        encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, options.positionBits);
    if (options.normalBits > 0)
        encoder.SetAttributeQuantization(draco::GeometryAttribute::NORMAL, options.normalBits);
    const bool allQuantised =
        options.positionBits > 0 && (options.normalBits > 0 || points.normals.empty());
    encoder.SetEncodingMethod(allQuantised ? draco::POINT_CLOUD_KD_TREE_ENCODING
                                           : draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
    draco::EncoderBuffer buffer;
    const auto status = encoder.EncodePointCloudToBuffer(*cloud, &buffer);
    if (!status.ok())
        return fail(ErrorCode::failed, "Draco cannot encode {} points: {}", n,
                    status.error_msg_string());
    if (options.positionBits > 0) {
        Bounds bounds;
        for (const auto& p : points.positions) bounds.add(p);
        const auto extent = bounds.max - bounds.min;
        const double largest = std::max({extent.x, extent.y, extent.z});
        job.note(fmt::format("Draco rounds positions to {} bits: by {:.3g} at most",
                             options.positionBits,
                             largest / (std::exp2(options.positionBits) - 1) / 2));
    }
    if (points.origin != glm::dvec3(0.0))
        job.note(fmt::format(
            "Draco holds floats: the points are written without the origin {} {} {}; .ply has the "
            "world's coordinates",
            points.origin.x, points.origin.y, points.origin.z));
    if (options.normalBits > 0 && !points.normals.empty())
        job.note(fmt::format("Draco rounds normals to {} bits", options.normalBits));
    const auto* first = reinterpret_cast<const std::byte*>(buffer.data());
    return Bytes(first, first + buffer.size());
}

}  // namespace

Result<void> writePoints(const std::filesystem::path& path, const PointCloud& points, Job& job,
                         const PointWriteOptions& options) {
    STX_CHECK(check(points));
    auto ending = path.extension().string();
    for (auto& c : ending) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    if (ending == ".ply") return writeFile(path, encodePly(points), options.file);
    if (ending != ".drc")
        return fail(ErrorCode::usage, "points are written as .ply or .drc, not as '{}'",
                    path.filename().string());
    try {
        STX_TRY(const auto bytes, encodeDraco(points, job, options));
        return writeFile(path, bytes, options.file);
    } catch (const std::exception& e) {
        return fail(ErrorCode::failed, "Draco cannot encode the points: {}", e.what());
    }
}

}  // namespace stx
