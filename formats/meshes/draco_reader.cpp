#include "formats/meshes/draco_geometry.hpp"
#include "formats/meshes/mesh_builder.hpp"
#include "formats/meshes/readers.hpp"
#include "formats/meshes/vertex_colours.hpp"

namespace stx {

Result<Mesh> readDraco(ByteSpan bytes, ModelFiles& files) {
    MeshBuilder builder(files.job());
    STX_TRY(const auto geometry,
            DracoGeometry::decode(bytes, [&](std::uint64_t n, std::uint64_t each) {
                return builder.charge(n, each, "the Draco stream");
            }));
    using Kind = DracoGeometry::Kind;
    MeshPart part;
    part.where = "the Draco stream";
    part.triangles = geometry.triangles();
    part.points = !geometry.isMesh();
    const auto count = geometry.pointCount();
    int dropped = 0;
    for (const auto& a : geometry.attributes()) {
        const bool isInteger = !a.isFloat;
        if (a.kind == Kind::position && part.positions.empty()) {
            if (a.components != 3)
                return fail(ErrorCode::invalidInput,
                            "the Draco positions have {} components, expected 3", a.components);
            STX_TRY(const auto v, geometry.values(a, false));
            for (std::size_t i = 0; i < count; ++i)
                part.positions.emplace_back(v[i * 3], v[i * 3 + 1], v[i * 3 + 2]);
        } else if (a.kind == Kind::normal && a.components == 3 && part.normals.empty()) {
            STX_TRY(const auto v, geometry.values(a, isInteger));
            for (std::size_t i = 0; i < count; ++i)
                part.normals.emplace_back(v[i * 3], v[i * 3 + 1], v[i * 3 + 2]);
        } else if (a.kind == Kind::texCoord && a.components == 2 && part.uvs.empty()) {
            STX_TRY(const auto v, geometry.values(a, false));
            // The encoder takes them from OBJ and PLY, where v runs up.
            for (std::size_t i = 0; i < count; ++i)
                part.uvs.emplace_back(v[i * 2], 1.0f - v[i * 2 + 1]);
        } else if (a.kind == Kind::colour && a.components >= 1 && a.components <= 4 &&
                   part.colours.empty()) {
            STX_TRY(const auto v, geometry.values(a, isInteger));
            const auto n = static_cast<std::size_t>(a.components);
            for (std::size_t i = 0; i < count; ++i) {
                const float* c = &v[i * n];
                const bool grey = n < 3;
                part.colours.emplace_back(c[0], grey ? c[0] : c[1], grey ? c[0] : c[2],
                                          n == 2   ? c[1]
                                          : n == 4 ? c[3]
                                                   : 1.0f);
            }
            linearFromSrgbColours(part.colours, a.isFloat);
        } else {
            ++dropped;
        }
    }
    if (dropped > 0)
        files.job().note(fmt::format("dropped: {} attributes of the Draco stream", dropped));
    if (part.positions.empty() && count > 0)
        return fail(ErrorCode::invalidInput, "the Draco stream has no positions");
    const int place = files.placeOfColour(builder.textures(), !part.uvs.empty());
    builder.materials().push_back(
        {.name = "default", .baseColourTexture = place, .hasColour = false});
    STX_CHECK(builder.add(std::move(part)));
    return builder.finish();
}

}  // namespace stx
