#include <cmath>
#include <cstring>

#include <draco/compression/encode.h>
#include <draco/point_cloud/point_cloud_builder.h>

#include "formats/meshes/meshes.hpp"
#include "lib/geometry/bounds.hpp"

namespace stx {
namespace {

Result<void> checkCount(std::size_t n) {
    if (n == 0) return fail(ErrorCode::invalidInput, "there are no points to write");
    if (n > 0x7fffffff)
        return fail(ErrorCode::invalidInput,
                    "{} points are more than a point file can hold (2^31 - 1)", n);
    return {};
}

Result<void> checkValues(const PointCloud& points) {
    const auto n = points.positions.size();
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

/// How the points of a .ply lie in it.
struct PlyRow {
    bool large;  ///< positions are doubles
    std::size_t positionBytes, normalBytes, colourBytes;

    explicit PlyRow(const PlyContents& c)
        : large(c.origin != glm::dvec3(0.0)),
          positionBytes(large ? 24 : 12),
          normalBytes(c.normals ? 12 : 0),
          colourBytes(!c.colours ? 0
                      : c.alpha  ? 4
                                 : 3) {}
    [[nodiscard]] std::size_t bytes() const { return positionBytes + normalBytes + colourBytes; }
};

std::string plyHeader(const PlyContents& contents) {
    const char* type = PlyRow(contents).large ? "double" : "float";
    std::string header = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
        "property {} x\nproperty {} y\nproperty {} z\n",
        contents.count, type, type, type);
    if (contents.normals) header += "property float nx\nproperty float ny\nproperty float nz\n";
    if (contents.colours)
        header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    if (contents.colours && contents.alpha) header += "property uchar alpha\n";
    return header + "end_header\n";
}

Bytes plyRows(const PointCloud& points, const PlyContents& contents) {
    const PlyRow row(contents);
    Bytes bytes(row.bytes() * points.positions.size());
    auto* at = bytes.data();
    for (std::size_t i = 0; i < points.positions.size(); ++i) {
        const glm::dvec3 world = glm::dvec3(points.positions[i]) + contents.origin;
        if (row.large)
            std::memcpy(at, &world, row.positionBytes);
        else
            std::memcpy(at, &points.positions[i], row.positionBytes);
        at += row.positionBytes;
        if (contents.normals) std::memcpy(at, &points.normals[i], row.normalBytes);
        at += row.normalBytes;
        if (contents.colours) std::memcpy(at, &points.colours[i], row.colourBytes);
        at += row.colourBytes;
    }
    return bytes;
}

/// Errors (usage): bits that Draco cannot code with.
Result<void> checkDracoBits(const char* field, int bits, int least) {
    constexpr int kMost = 30;  // of Draco's quantisation
    if (bits == 0 || (bits >= least && bits <= kMost)) return {};
    return fail(ErrorCode::usage,
                "{} is {}; Draco codes with {} to {} bits, and 0 keeps floats exact", field, bits,
                least, kMost);
}

Result<Bytes> encodeDraco(const PointCloud& points, Job& job, const PointWriteOptions& options) {
    STX_CHECK(checkDracoBits("positionBits", options.positionBits, 1));
    STX_CHECK(checkDracoBits("normalBits", options.normalBits, 2));
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

Result<PlyInParts> PlyInParts::create(const std::filesystem::path& path,
                                      const PlyContents& contents, OutputFile::Options options) {
    STX_CHECK(checkCount(contents.count));
    STX_TRY(auto file, OutputFile::create(path, options));
    STX_CHECK(file.write(plyHeader(contents)));
    return PlyInParts(std::move(file), contents);
}

Result<Bytes> PlyInParts::encode(const PointCloud& part) const {
    STX_CHECK(checkValues(part));
    if (!part.positions.empty() &&
        (part.normals.empty() == contents_.normals || part.colours.empty() == contents_.colours))
        return fail(ErrorCode::invalidInput,
                    "some points have normals or colours and others do not; all must be alike");
    return plyRows(part, contents_);
}

Result<void> PlyInParts::add(const Bytes& part) {
    bytes_ += part.size();
    return file_.write(ByteSpan(part));
}

Result<void> PlyInParts::commit() {
    const std::size_t found = bytes_ / PlyRow(contents_).bytes();
    if (found != contents_.count)
        return fail(ErrorCode::invalidInput, "there are {} points, but {} were said to come", found,
                    contents_.count);
    return file_.commit();
}

Result<void> writePoints(const std::filesystem::path& path, const PointCloud& points, Job& job,
                         const PointWriteOptions& options) {
    STX_CHECK(checkCount(points.positions.size()));
    STX_CHECK(checkValues(points));
    auto ending = path.extension().string();
    for (auto& c : ending) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    if (ending == ".ply") {
        STX_TRY(auto file,
                PlyInParts::create(path,
                                   {points.positions.size(), !points.normals.empty(),
                                    !points.colours.empty(), points.alpha, points.origin},
                                   options.file));
        STX_TRY(const auto rows, file.encode(points));
        STX_CHECK(file.add(rows));
        return file.commit();
    }
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
