// A program of somebody else: renders a captured triangle and checks that something is there.
#include <cstdio>

#include <formats/images/images.hpp>
#include <lib/capture/capture.hpp>
#include <lib/geometry/view_layout.hpp>

int main() {
    stx::Mesh mesh;
    mesh.materials.emplace_back();
    mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    mesh.triangleMaterial = {0};
    stx::Job job;
    const auto cameras = stx::layoutCameras(*stx::parseViewLayout("ring:2"), {}, mesh.positions);
    const auto bundle = stx::captureBundle(mesh, *cameras, {}, job);
    if (!bundle || bundle->pointCount() < 1000) return 1;
    const auto* texture = bundle->views[0].texture.rgba8();
    const auto png =
        stx::encodePng(texture->width(), texture->height(), 4, 8, texture->data(), true);
    if (!png) std::fprintf(stderr, "%s\n", png.error().text().c_str());
    return png ? 0 : 1;
}
