#include <meshoptimizer.h>

#include "formats/meshes/gltf/gltf_file.hpp"

namespace stx::gltf {
namespace {

/// What a compressed bufferView says of itself (EXT_meshopt_compression, "Specifying compressed
/// views").
struct Packed {
    std::uint64_t count = 0, stride = 0;
    std::string mode, filter;
};

Result<void> checkPacked(const Packed& p, const std::string& where) {
    const bool attributes = p.mode == "ATTRIBUTES", triangles = p.mode == "TRIANGLES";
    if (!attributes && !triangles && p.mode != "INDICES")
        return fail(ErrorCode::invalidInput,
                    "{}.mode is '{}', expected ATTRIBUTES, TRIANGLES or INDICES", where, p.mode);
    if (p.count == 0) return fail(ErrorCode::invalidInput, "{}.count must be 1 or more", where);
    if (attributes ? p.stride == 0 || p.stride > 256 || p.stride % 4 != 0
                   : p.stride != 2 && p.stride != 4)
        return fail(ErrorCode::invalidInput, "{}.byteStride is {}, expected {}", where, p.stride,
                    attributes ? "a multiple of 4 up to 256" : "2 or 4");
    if (triangles && p.count % 3 != 0)
        return fail(ErrorCode::invalidInput,
                    "{}.count is {}, which is not a whole number of triangles", where, p.count);
    const bool filterFits =
        p.filter == "NONE" ||
        (attributes && p.filter == "OCTAHEDRAL" && (p.stride == 4 || p.stride == 8)) ||
        (attributes && p.filter == "QUATERNION" && p.stride == 8) ||
        (attributes && p.filter == "EXPONENTIAL");
    if (!filterFits)
        return fail(ErrorCode::invalidInput,
                    "{}.filter '{}' does not go with mode {} and byteStride {}", where, p.filter,
                    p.mode, p.stride);
    return {};
}

}  // namespace

Result<ByteSpan> GltfFile::unpacked(const Json& extension, std::uint64_t view,
                                    const std::string& viewWhere) {
    if (const auto it = unpacked_.find(view); it != unpacked_.end()) return ByteSpan(it->second);
    const auto where = viewWhere + ".extensions.EXT_meshopt_compression";
    Packed p;
    STX_TRY(const auto count, getUint(extension, "count", where));
    STX_TRY(const auto stride, getUint(extension, "byteStride", where));
    STX_TRY(const auto mode, getString(extension, "mode", where));
    STX_TRY(const auto filter, getString(extension, "filter", where));
    p.count = count.value_or(0);
    p.stride = stride.value_or(0);
    p.mode = mode.value_or("");
    p.filter = filter.value_or("NONE");
    STX_CHECK(checkPacked(p, where));

    STX_TRY(const auto bufferIndex, getUint(extension, "buffer", where));
    STX_TRY(const auto length, getUint(extension, "byteLength", where));
    if (!bufferIndex || !length)
        return fail(ErrorCode::invalidInput, "{} lacks its buffer or byteLength", where);
    STX_TRY(const auto offset, getUint(extension, "byteOffset", where));
    STX_TRY(const auto whole, buffer(*bufferIndex, where));
    const auto begin = offset.value_or(0);
    if (begin > whole.size() || *length > whole.size() - begin)
        return fail(ErrorCode::invalidInput,
                    "{} is bytes {} to {} of buffers[{}], which has only {}", where, begin,
                    begin + *length, *bufferIndex, whole.size());
    const auto bytes = whole.subspan(begin, *length);
    STX_CHECK(builder_->charge(p.count, p.stride, where));
    // The best that the codes reach: 16 vertices in a byte for each byte of one; 3 indices in one.
    if (p.count / 64 > bytes.size())
        return fail(ErrorCode::invalidInput, "{}: {} bytes cannot hold {} elements", where,
                    bytes.size(), p.count);

    Bytes out(p.count * p.stride);
    const auto* from = reinterpret_cast<const unsigned char*>(bytes.data());
    int failed = 0;
    if (p.mode == "ATTRIBUTES")
        failed = meshopt_decodeVertexBuffer(out.data(), p.count, p.stride, from, bytes.size());
    else if (p.mode == "TRIANGLES")
        failed = meshopt_decodeIndexBuffer(out.data(), p.count, p.stride, from, bytes.size());
    else
        failed = meshopt_decodeIndexSequence(out.data(), p.count, p.stride, from, bytes.size());
    if (failed != 0)
        return fail(ErrorCode::invalidInput,
                    "{}: the {} bytes are no {} stream of {} elements of {} bytes", where,
                    bytes.size(), p.mode, p.count, p.stride);
    if (p.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(out.data(), p.count, p.stride);
    if (p.filter == "QUATERNION") meshopt_decodeFilterQuat(out.data(), p.count, p.stride);
    if (p.filter == "EXPONENTIAL") meshopt_decodeFilterExp(out.data(), p.count, p.stride);
    return ByteSpan(unpacked_.emplace(view, std::move(out)).first->second);
}

}  // namespace stx::gltf
