#include "formats/meshes/draco_geometry.hpp"

#include <cstring>
#include <exception>
#include <new>

#include <draco/compression/decode.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/metadata/metadata_decoder.h>

namespace stx {
namespace {

struct HeaderCounts {
    std::uint64_t points = 0;
    std::uint64_t faces = 0;
};

/// The counts that a stream's header claims (Draco bitstream specification, sections 3 to 6), so
/// that they are held against the memory limit before the library believes them.
Result<HeaderCounts> readCounts(ByteSpan bytes) {
    const auto damaged = [](const char* what) {
        return fail(ErrorCode::invalidInput, "the Draco stream ends inside its {}", what);
    };
    if (bytes.size() < 11 || std::memcmp(bytes.data(), "DRACO", 5) != 0)
        return fail(ErrorCode::invalidInput, "the data does not begin with a Draco header");
    const int major = std::to_integer<int>(bytes[5]), minor = std::to_integer<int>(bytes[6]);
    const bool isMesh = std::to_integer<int>(bytes[7]) == 1;
    const bool isEdgebreaker = isMesh && std::to_integer<int>(bytes[8]) == 1;
    const int version = major * 256 + minor;
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size(),
                static_cast<std::uint16_t>(version));
    buffer.Advance(9);
    std::uint16_t flags = 0;
    if (!buffer.Decode(&flags)) return damaged("header");
    if (version >= 0x0103 && (flags & 0x8000) != 0) {
        draco::GeometryMetadata metadata;
        draco::MetadataDecoder decoder;
        if (!decoder.DecodeGeometryMetadata(&buffer, &metadata)) return damaged("metadata");
    }
    HeaderCounts counts;
    const auto count = [&](bool varint, std::uint64_t& out) {
        std::uint32_t value = 0;
        if (varint ? !draco::DecodeVarint(&value, &buffer) : !buffer.Decode(&value)) return false;
        out = value;
        return true;
    };
    if (!isMesh) {
        if (!count(false, counts.points)) return damaged("header");
    } else if (!isEdgebreaker) {
        const bool varint = version >= 0x0202;
        if (!count(varint, counts.faces) || !count(varint, counts.points)) return damaged("header");
    } else {
        std::uint8_t traversal = 0;
        std::uint64_t newVertices = 0;
        const bool varint = version >= 0x0200;
        if (!buffer.Decode(&traversal)) return damaged("header");
        if (version < 0x0202 && !count(varint, newVertices)) return damaged("header");
        if (!count(varint, counts.points) || !count(varint, counts.faces)) return damaged("header");
    }
    return counts;
}

DracoGeometry::Kind kindOf(draco::GeometryAttribute::Type type) {
    switch (type) {
        case draco::GeometryAttribute::POSITION:
            return DracoGeometry::Kind::position;
        case draco::GeometryAttribute::NORMAL:
            return DracoGeometry::Kind::normal;
        case draco::GeometryAttribute::COLOR:
            return DracoGeometry::Kind::colour;
        case draco::GeometryAttribute::TEX_COORD:
            return DracoGeometry::Kind::texCoord;
        default:
            return DracoGeometry::Kind::generic;
    }
}

}  // namespace

Result<DracoGeometry> DracoGeometry::decode(ByteSpan bytes, const Charge& charge) {
    DracoGeometry result;
    try {
        STX_TRY(const auto counts, readCounts(bytes));
        // A corner table takes some 80 bytes a face, attributes and their maps some 100 a point.
        STX_CHECK(charge(counts.points, 100));
        STX_CHECK(charge(counts.faces, 80));
        draco::DecoderBuffer buffer;
        buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
        if (!type.ok())
            return fail(ErrorCode::invalidInput, "Draco cannot read the stream: {}",
                        type.status().error_msg_string());
        draco::Decoder decoder;
        result.isMesh_ = type.value() == draco::TRIANGULAR_MESH;
        if (result.isMesh_) {
            auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
            if (!mesh.ok())
                return fail(ErrorCode::invalidInput, "Draco cannot decode the mesh: {}",
                            mesh.status().error_msg_string());
            result.geometry_ = std::move(mesh).value();
        } else {
            auto cloud = decoder.DecodePointCloudFromBuffer(&buffer);
            if (!cloud.ok())
                return fail(ErrorCode::invalidInput, "Draco cannot decode the point cloud: {}",
                            cloud.status().error_msg_string());
            result.geometry_ = std::move(cloud).value();
        }
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::invalidInput, "the Draco stream needs more memory than there is");
    } catch (const std::exception& e) {
        return fail(ErrorCode::invalidInput, "Draco cannot decode the stream: {}", e.what());
    }
    for (int i = 0; i < result.geometry_->num_attributes(); ++i) {
        const auto* a = result.geometry_->attribute(i);
        result.attributes_.push_back(
            {kindOf(a->attribute_type()), i, a->unique_id(), a->num_components(),
             a->data_type() == draco::DT_FLOAT32 || a->data_type() == draco::DT_FLOAT64});
    }
    return result;
}

std::size_t DracoGeometry::pointCount() const {
    return geometry_->num_points();
}

std::vector<glm::uvec3> DracoGeometry::triangles() const {
    std::vector<glm::uvec3> triangles;
    if (!isMesh_) return triangles;
    const auto& mesh = static_cast<const draco::Mesh&>(*geometry_);
    triangles.reserve(mesh.num_faces());
    for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f) {
        const auto& face = mesh.face(f);
        triangles.emplace_back(face[0].value(), face[1].value(), face[2].value());
    }
    return triangles;
}

Result<std::vector<float>> DracoGeometry::values(const Attribute& attribute, bool normalise) const {
    auto* a = geometry_->attribute(attribute.index);
    a->set_normalized(normalise && !attribute.isFloat);
    const auto n = static_cast<std::size_t>(attribute.components);
    std::vector<float> values(pointCount() * n);
    for (draco::PointIndex p(0); p < geometry_->num_points(); ++p) {
        const auto index = a->mapped_index(p);
        if (index.value() >= a->size() ||
            !a->ConvertValue<float>(index, static_cast<std::int8_t>(n), &values[p.value() * n]))
            return fail(ErrorCode::invalidInput, "Draco attribute {} has no value for point {}",
                        attribute.uniqueId, p.value());
    }
    return values;
}

}  // namespace stx
