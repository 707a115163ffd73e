// Makes the sample photographs of the project, samples/photos: one picture of solids in a room with
// the depth that belongs to it, written as two kinds of phones do.
//
// Usage: make_sample_photos FOLDER    writes solids_gdepth.jpg and solids_mpf.jpg into it.

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "tests/made_photos.hpp"
#include "tests/sweep/scene.hpp"

namespace {

using namespace stx;

constexpr int kWidth = 640, kHeight = 480, kFocal35 = 32;
/// Phones' depth has fewer pixels than their picture.
constexpr int kStep = 2;

Scene solidsInARoom() {
    const auto turned = [](double angle) { return quatFromAxisAngle({0.2, 1, 0.1, angle}); };
    Scene scene;
    scene.waves = 7;
    scene.solids = {{Solid::Kind::room, {0, 0.6, -1.6}, {1, 0, 0, 0}, {2.2, 1.2, 2}},
                    {Solid::Kind::ball, {-0.5, -0.15, -1.8}, {1, 0, 0, 0}, {0.3, 0, 0}},
                    {Solid::Kind::torus, {0.55, 0.1, -2.1}, turned(1.1), {0.32, 0.1, 0}},
                    {Solid::Kind::box, {0.05, -0.3, -2.5}, turned(0.6), {0.25, 0.25, 0.25}},
                    {Solid::Kind::cone, {0.25, -0.33, -1.5}, {1, 0, 0, 0}, {0.12, 0.17, 0}}};
    return scene;
}

Camera phone() {
    Camera camera;
    camera.width = kWidth;
    camera.height = kHeight;
    // As EXIF has it: of the diagonal of 36x24 mm.
    camera.fx = camera.fy = kFocal35 / std::hypot(36.0, 24.0) * std::hypot(kWidth, kHeight);
    camera.cx = kWidth * 0.5;
    camera.cy = kHeight * 0.5;
    return camera;
}

struct Codes {
    float least = kNoDepth, most = 0;
    std::vector<std::uint8_t> blackNear;  ///< linear in 1 / distance
};

Codes codesOf(const Image<float>& depth) {
    Codes out;
    for (const float d : depth.pixels()) {
        out.least = std::min(out.least, d);
        out.most = std::max(out.most, d);
    }
    const double near = 1.0 / out.least, far = 1.0 / out.most;
    for (int y = kStep / 2; y < kHeight; y += kStep)
        for (int x = kStep / 2; x < kWidth; x += kStep)
            out.blackNear.push_back(static_cast<std::uint8_t>(
                std::lround(255.0 * (near - 1.0 / depth.at(x, y)) / (near - far))));
    return out;
}

Result<void> makePhotos(const std::filesystem::path& folder) {
    const Camera camera = phone();
    const ReferenceView view = look(solidsInARoom(), camera);
    const Codes codes = codesOf(view.depth);
    std::vector<std::uint8_t> rgb, whiteNear;
    for (const glm::u8vec4 c : view.texture.rgba8()->pixels())
        rgb.insert(rgb.end(), {c.r, c.g, c.b});
    for (const std::uint8_t code : codes.blackNear)
        whiteNear.push_back(static_cast<std::uint8_t>(255 - code));
    constexpr int kW = kWidth / kStep, kH = kHeight / kStep;
    STX_TRY(const Bytes colour, encodeJpeg(kWidth, kHeight, 3, rgb.data(), 92));
    STX_TRY(const Bytes png, encodePng(kW, kH, 1, 8, codes.blackNear.data(), false));
    STX_TRY(const Bytes jpeg, encodeJpeg(kW, kH, 1, whiteNear.data(), 98));
    constexpr std::size_t kPart = 60000;  // of extended XMP: a segment holds 65,533 bytes
    const std::string range = fmt::format(
        "D:Near=\"{}\" D:Far=\"{}\" D:Units=\"m\" D:Mime=\"image/png\"", codes.least, codes.most);
    STX_CHECK(writeFile(folder / "solids_gdepth.jpg",
                        made::gdepthPhoto(colour, "RangeInverse", png, {}, range, kPart,
                                          {made::exifSegment(1, kFocal35)})));
    const double small = 32.0 / kWidth;  // its matrix is of a picture of 32x24
    const std::string xmp = made::appleXmp(1.0 / codes.most, 1.0 / codes.least, small * camera.fx,
                                           small * camera.fy, "absolute", 16, 12);
    return writeFile(folder / "solids_mpf.jpg",
                     made::mpf(colour, {made::withSegments(jpeg, {made::xmpSegment(xmp)})},
                               {made::exifSegment(1, kFocal35)}));
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fputs("usage: make_sample_photos FOLDER\n", stderr);
        return 1;
    }
    if (const auto done = makePhotos(argv[1]); !done) {
        std::fprintf(stderr, "%s\n", done.error().text().c_str());
        return 2;
    }
    return 0;
}
