#include "lib/capture/rasterizer.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"
#include "lib/capture/capture.hpp"
#include "lib/geometry/view_layout.hpp"

namespace stx {
namespace {

/// A unit sphere of latitude and longitude quads: many shared edges and slivers at the poles.
Mesh sphereMesh(int n, glm::vec3 centre = {}, float radius = 1.0f) {
    Mesh m;
    m.materials.emplace_back();
    for (int j = 0; j <= n; ++j) {
        for (int i = 0; i <= 2 * n; ++i) {
            const float t = 3.14159265f * j / n, p = 3.14159265f * i / n;
            const glm::vec3 d(std::sin(t) * std::sin(p), std::cos(t), std::sin(t) * std::cos(p));
            m.positions.push_back(centre + d * radius);
            m.normals.push_back(d);
        }
    }
    const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (2 * n + 1) + i); };
    for (int j = 0; j < n; ++j) {
        for (int i = 0; i < 2 * n; ++i) {
            m.triangles.emplace_back(at(i, j), at(i, j + 1), at(i + 1, j));
            m.triangles.emplace_back(at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
        }
    }
    m.triangleMaterial.assign(m.triangles.size(), 0);
    return m;
}

Camera lookingAt(glm::dvec3 eye, int size, double fov = 0.8, bool orthographic = false) {
    return Camera::fromFieldOfView(eye, *lookAt(eye, {0, 0, 0}),
                                   glm::dvec2(orthographic ? 3.0 : fov), orthographic, size, size);
}

TEST(Rasterise, SphereHasItsAnalyticDepthAndNoCracks) {
    Job job;
    for (const bool orthographic : {false, true}) {
        const auto camera = lookingAt({1, 2, 3}, 128, 0.8, orthographic);
        RasterSettings settings;
        settings.normals = true;
        const auto image = rasterise(sphereMesh(96), camera, settings, job);
        ASSERT_TRUE(image) << image.error().text();
        int inside = 0;
        for (int y = 0; y < 128; ++y) {
            for (int x = 0; x < 128; ++x) {
                // Ray against the sphere, in camera space.
                const glm::dvec3 a = camera.unproject(x + 0.5, y + 0.5, orthographic ? 0.0 : 1.0);
                const glm::dvec3 origin = orthographic ? a : glm::dvec3(0),
                                 direction = orthographic ? glm::dvec3(0, 0, -1) : a;
                const glm::dvec3 c(camera.cameraFromWorld() * glm::dvec4(0, 0, 0, 1));
                const double b = glm::dot(direction, origin - c),
                             aa = glm::dot(direction, direction);
                const double disc = b * b - aa * (glm::dot(origin - c, origin - c) - 0.98);
                if (disc <= 0.05) continue;
                const double full = b * b - aa * (glm::dot(origin - c, origin - c) - 1.0);
                const double t = (-b - std::sqrt(full)) / aa;
                ++inside;
                EXPECT_NEAR(image->depth.at(x, y), t, 4e-3) << x << ' ' << y;
                EXPECT_FLOAT_EQ(image->colour.at(x, y).w, 1.0f) << "a crack at " << x << ' ' << y;
                const glm::dvec3 p =
                    camera.position + camera.orientation * (origin + direction * t);
                EXPECT_GT(glm::dot(glm::vec3(p), image->normal.at(x, y)), 0.999f);
            }
        }
        EXPECT_GT(inside, 3000);
    }
}

TEST(Rasterise, CoverageIsTheAreaShare) {
    // A half plane whose edge crosses pixels at x = 8.25 pixels: coverage 1/4 in that column.
    Mesh m;
    m.materials.emplace_back();
    m.positions = {{-10, -10, 0}, {0.25f, -10, 0}, {0.25f, 10, 0}, {-10, 10, 0}};
    m.triangles = {{0, 1, 2}, {0, 2, 3}};
    m.triangleMaterial = {0, 0};
    const auto camera = Camera::fromFieldOfView({0, 0, 5}, {1, 0, 0, 0}, {16, 16}, true, 16, 16);
    Job job;
    const auto image = rasterise(m, camera, {}, job);
    ASSERT_TRUE(image);
    EXPECT_FLOAT_EQ(image->colour.at(7, 4).w, 1.0f);
    EXPECT_FLOAT_EQ(image->colour.at(8, 4).w, 0.25f);
    EXPECT_FLOAT_EQ(image->colour.at(9, 4).w, 0.0f);
    EXPECT_FALSE(hasPoint(image->depth.at(8, 4))) << "the centre misses: coverage without depth";
    EXPECT_FLOAT_EQ(image->depth.at(7, 4), 5.0f);
}

TEST(Rasterise, TrianglesThatReachBehindTheCameraNeedNoClipping) {
    // A ground plane from far in front to far behind the viewpoint.
    Mesh m;
    m.materials.emplace_back();
    m.positions = {{-100, -1, -100}, {100, -1, -100}, {100, -1, 100}, {-100, -1, 100}};
    m.triangles = {{0, 1, 2}, {0, 2, 3}};
    m.triangleMaterial = {0, 0};
    const auto camera = Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {1.2, 1.2}, false, 64, 64);
    Job job;
    const auto image = rasterise(m, camera, {}, job);
    ASSERT_TRUE(image);
    for (int x = 0; x < 64; ++x) {
        EXPECT_FALSE(hasPoint(image->depth.at(x, 20))) << "sky";
        const double dist = 1.0 / ((63.5 - camera.cy) / camera.fy);
        EXPECT_NEAR(image->depth.at(x, 63), dist, 1e-4);
    }
}

/// A square in z = 0 that faces +Z, and a normal map that bends its normal to (0.9, 0, 0.436).
Mesh steepSquare() {
    Mesh m;
    m.materials.emplace_back();
    m.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    m.normals.assign(4, {0, 0, 1});
    m.tangents.assign(4, {1, 0, 0, 1});
    m.uvs.assign(4, {0.5f, 0.5f});
    m.triangles = {{0, 1, 2}, {0, 2, 3}};
    m.triangleMaterial = {0, 0};
    m.textures.push_back({Rgba8Image(1, 1, {242, 128, 183, 255})});
    m.materials[0].normalTexture = 0;
    return m;
}

TEST(Rasterise, NormalsAreOfTheSideThatIsSeenAlsoWhereTheyPointAway) {
    Job job;
    RasterSettings settings;
    settings.normals = true;
    Light light;
    light.vector = {-1, 0, 0};
    settings.lighting.lights = {light};
    const auto look = [&](const Mesh& mesh, glm::dvec3 eye) {
        auto image = rasterise(mesh, lookingAt(eye, 16), settings, job);
        EXPECT_TRUE(image) << image.error().text();
        return std::pair(image->normal.at(8, 8), image->lit.at(8, 8).x);
    };
    const glm::vec3 bent = glm::normalize(glm::vec3(242, 128, 183) / 127.5f - 1.0f);
    // The bent normal points away from the first eye.
    const glm::dvec3 left(-4, 0, 1.5), right(4, 0, 1.5), below(4, 0, -1.5);
    ASSERT_LT(glm::dot(glm::dvec3(bent), left), 0.0);
    Mesh mesh = steepSquare();
    for (const bool wound : {true, false}) {
        SCOPED_TRACE(wound);
        for (const auto& eye : {left, right}) {
            const auto [normal, brightness] = look(mesh, eye);
            EXPECT_LT(glm::length(normal - bent), 1e-5f);
            EXPECT_GT(brightness, 0.9f) << "the light falls on it from the right";
        }
        const auto [normal, brightness] = look(mesh, below);
        EXPECT_LT(glm::length(normal + bent), 1e-5f) << "of a back face they are reversed";
        EXPECT_LT(brightness, 0.6f);
        // In formats where winding means nothing, the vertices' normals tell the front.
        for (auto& t : mesh.triangles) std::swap(t.y, t.z);
    }
}

TEST(Rasterise, SmoothNormalsOfACoarseSpherePointOutwardsUpToItsRim) {
    Job job;
    RasterSettings settings;
    settings.normals = true;
    const auto image = rasterise(sphereMesh(6), lookingAt({1, 2, 3}, 96), settings, job);
    ASSERT_TRUE(image) << image.error().text();
    const auto camera = lookingAt({1, 2, 3}, 96);
    for (int y = 0; y < 96; ++y) {
        for (int x = 0; x < 96; ++x) {
            const float z = image->depth.at(x, y);
            if (!hasPoint(z)) continue;
            const glm::dvec3 p =
                camera.position + camera.orientation * camera.unproject(x + 0.5, y + 0.5, z);
            EXPECT_GT(glm::dot(image->normal.at(x, y), glm::vec3(glm::normalize(p))), 0.9f)
                << x << ' ' << y;
        }
    }
}

TEST(Rasterise, BackFacesOfSingleSidedMaterialsAreOpen) {
    Mesh m = sphereMesh(16);
    m.materials[0].doubleSided = false;
    Job job;
    const auto outside = rasterise(m, lookingAt({0, 0, 4}, 32), {}, job);
    ASSERT_TRUE(outside);
    EXPECT_TRUE(hasPoint(outside->depth.at(16, 16))) << "front faces are drawn";
    EXPECT_NEAR(outside->depth.at(16, 16), 3.0, 0.02);
    for (auto& t : m.triangles) std::swap(t.y, t.z);
    const auto inverted = rasterise(m, lookingAt({0, 0, 4}, 32), {}, job);
    EXPECT_NEAR(inverted->depth.at(16, 16), 5.0, 0.02) << "turned inside out, the far wall shows";
}

TEST(Rasterise, LightThatASurfaceGivesOffIsAddedToWhatFallsOnIt) {
    const Camera camera = lookingAt({0, 0, 3}, 16);
    Mesh mesh = sphereMesh(32);
    RasterSettings settings;
    settings.lighting.ambient = glm::vec3(0.5f);
    settings.lighting.lights = {{Light::Kind::directional, {0, 0, 1}, glm::vec3(1), false}};
    const auto litMiddle = [&] {
        Job job;
        const auto image = rasterise(mesh, camera, settings, job);
        EXPECT_TRUE(image) << image.error().text();
        return image ? linearFromSrgb(image->lit.at(8, 8).x) : -1.0f;
    };
    Material& m = mesh.materials[0];
    m.baseColour = glm::vec4(0.2f, 0.2f, 0.2f, 1);
    EXPECT_NEAR(litMiddle(), 0.1f, 1e-3f);
    m.emissive = glm::vec3(0.3f);
    EXPECT_NEAR(litMiddle(), 0.4f, 1e-3f);
    m.emissive = glm::vec3(3.0f);
    EXPECT_FLOAT_EQ(litMiddle(), 1.0f);
    settings.lighting.beyondOne = true;
    EXPECT_NEAR(litMiddle(), 3.1f, 1e-2f);
    m.emissive = glm::vec3(0.0f);
    m.unlit = true;
    EXPECT_NEAR(litMiddle(), 0.2f, 1e-3f);
}

TEST(Rasterise, LightBeyondWhiteIsKeptOrClippedAfterBlending) {
    // A sheet that shines three times as bright as white hides half of a black one.
    Mesh mesh;
    for (const float z : {0.0f, 1.0f}) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.insert(mesh.positions.end(),
                              {{-2, -2, z}, {2, -2, z}, {2, 2, z}, {-2, 2, z}});
        mesh.triangles.insert(mesh.triangles.end(),
                              {{first, first + 1, first + 2}, {first, first + 2, first + 3}});
    }
    mesh.triangleMaterial = {0, 0, 1, 1};
    Material black, shining;
    black.baseColour = shining.baseColour = {0, 0, 0, 1};
    shining.emissive = glm::vec3(3, 1, 0);
    mesh.materials = {black, shining};
    const auto middle = [&](float alpha, bool beyondOne) {
        mesh.materials[1].baseColour.a = alpha;
        mesh.materials[1].alpha = alpha < 1 ? Material::Alpha::blend : Material::Alpha::opaque;
        RasterSettings settings;
        settings.lighting.beyondOne = beyondOne;
        Job job;
        const auto image = rasterise(mesh, lookingAt({0, 0, 4}, 16), settings, job);
        EXPECT_TRUE(image) << image.error().text();
        return image ? image->colour.at(8, 8) : glm::vec4(-1.0f);
    };
    const float three = srgbFromLinear(3.0f);
    EXPECT_NEAR(middle(1, true).x, three, 1e-5f);
    EXPECT_NEAR(middle(1, true).y, 1, 1e-5f);
    EXPECT_NEAR(middle(0.4f, true).x, 0.4f * three, 1e-5f);
    EXPECT_EQ(middle(1, false), glm::vec4(1, 1, 0, 1));
    EXPECT_NEAR(middle(0.4f, false).x, 0.4f * three, 1e-5f) << "not clipped before it is blended";
    EXPECT_EQ(middle(0.9f, false).x, 1.0f);
}

TEST(Rasterise, AlphaMaskCutsHoles) {
    Mesh m;
    Material cut;
    cut.baseColourTexture = 0;
    cut.alpha = Material::Alpha::mask;
    m.materials = {cut};
    MeshTexture texture;
    texture.nearest = true;
    texture.pixels = Rgba8Image(2, 1);
    texture.pixels.at(0, 0) = {255, 0, 0, 255};
    texture.pixels.at(1, 0) = {0, 255, 0, 0};
    m.textures = {texture};
    m.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    m.uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    m.triangles = {{0, 1, 2}, {0, 2, 3}};
    m.triangleMaterial = {0, 0};
    Job job;
    const auto image = rasterise(m, lookingAt({0, 0, 4}, 64), {}, job);
    ASSERT_TRUE(image);
    EXPECT_TRUE(hasPoint(image->depth.at(25, 32)));
    EXPECT_FLOAT_EQ(image->colour.at(25, 32).x, 1.0f);
    EXPECT_FALSE(hasPoint(image->depth.at(39, 32)));
    EXPECT_EQ(image->colour.at(39, 32).w, 0.0f);
}

TEST(Rasterise, TheSameBytesOnAnyNumberOfThreads) {
    Job job;
    const auto camera = lookingAt({2, 1, 3}, 200);
    Image<glm::vec4> first;
    for (const int threads : {1, 2, 7}) {
        const ThreadLimit limit(threads);
        const auto image = rasterise(sphereMesh(40), camera, {}, job);
        ASSERT_TRUE(image);
        if (first.empty()) first = image->colour;
        EXPECT_TRUE(first == image->colour);
    }
}

TEST(Capture, FitsThePlanesAndRoundsToTheCode) {
    Job job;
    CaptureSettings settings;
    for (const int bits : {8, 16}) {
        settings.depthBits = bits;
        const auto view =
            captureView(sphereMesh(64), lookingAt({0, 0, 4}, 128), "v", settings, job);
        ASSERT_TRUE(view);
        ASSERT_TRUE(view->check()) << view->check().error().text();
        EXPECT_NEAR(view->nearPlane, 3.0, 2e-3);
        EXPECT_NEAR(view->farPlane, 4.0, 0.3);
        const auto code = view->depthCode();
        std::uint32_t least = 1 << 20, most = 0;
        for (const float d : view->depth.pixels()) {
            if (!hasPoint(d)) continue;
            const auto c = code.encode(d);
            least = std::min(least, c);
            most = std::max(most, c);
            EXPECT_EQ(static_cast<float>(code.decode(c)), d);
        }
        EXPECT_EQ(least, 1u);
        EXPECT_EQ(most, code.dmax);
    }
}

TEST(Capture, BleedsColourPastTheSilhouette) {
    Job job;
    Mesh m = sphereMesh(32);
    m.materials[0].baseColour = {1, 0, 0, 1};
    const auto view = captureView(m, lookingAt({0, 0, 4}, 64), "v", {}, job);
    ASSERT_TRUE(view);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            EXPECT_EQ(view->texture.rgba8()->at(x, y).x, 255) << x << ' ' << y;
            EXPECT_EQ(view->texture.rgba8()->at(x, y).y, 0);
        }
    }
}

TEST(Capture, PointCloudsBecomeClosedSurfaces) {
    Mesh sphere = sphereMesh(48);
    Mesh cloud;
    cloud.positions = sphere.positions;
    for (std::uint32_t i = 0; i < cloud.positions.size(); ++i) cloud.points.push_back(i);
    Job job;
    const auto image = rasterise(cloud, lookingAt({0, 0, 4}, 96), {}, job);
    ASSERT_TRUE(image);
    for (int y = 40; y < 56; ++y) {
        for (int x = 40; x < 56; ++x) EXPECT_NEAR(image->depth.at(x, y), 3.0, 0.1);
    }
}

/// A wall of points in layers, in places with several points, with squares in front and behind.
Mesh layeredCloud(int side) {
    Mesh mesh;
    const auto add = [&](glm::vec3 at, glm::vec4 colour) {
        mesh.positions.push_back(at);
        mesh.colours.push_back(colour);
        return static_cast<std::uint32_t>(mesh.positions.size() - 1);
    };
    // From the back, so that later ones hide those before; and each place twice.
    for (int layer = 0; layer < 6; ++layer) {
        for (int k = 0; k < side * side; ++k) {
            const glm::vec2 at = glm::vec2(k % side, k / side) * (2.0f / side) - 1.0f;
            const float wave = 0.1f * std::sin(5.0f * at.x) * std::cos(4.0f * at.y);
            const auto shade = static_cast<float>(k % 7 + layer) / 13.0f;
            mesh.points.push_back(add({at, 0.1f * static_cast<float>(layer / 2) + wave},
                                      {shade, 1.0f - shade, 0, 1}));
        }
    }
    for (const float z : {-0.3f, 0.4f}) {
        const float low = z < 0 ? -1.2f : 0.1f, high = z < 0 ? 1.2f : 0.4f;
        const auto a = add({low, low, z}, {0, 0, 1, 1}), b = add({high, low, z}, {0, 0, 1, 1}),
                   c = add({high, high, z}, {1, 1, 1, 1});
        mesh.triangles.emplace_back(a, b, c);
        mesh.triangleMaterial.push_back(0);
    }
    mesh.materials.emplace_back();
    return mesh;
}

TEST(Capture, CloudsInPiecesAreTheSamePictures) {
    // Discs, and balls that are apart.
    for (const int side : {60, 9}) {
        const Mesh cloud = layeredCloud(side);
        ASSERT_EQ(loosePoints(cloud).apart, side == 9);
        for (const bool orthographic : {false, true}) {
            const Camera camera = lookingAt({0.5, 0.3, 3}, 64, 0.8, orthographic);
            RasterSettings settings;
            settings.normals = true;
            Job all, little;
            little.limits.maxMemoryBytes = side == 60 ? 4u << 20 : 1u << 20;
            const auto whole = rasterise(cloud, camera, settings, all);
            const auto pieces = rasterise(cloud, camera, settings, little);
            ASSERT_TRUE(whole && pieces) << (pieces ? "" : pieces.error().message);
            const auto same = [](const auto& a, const auto& b) {
                return std::ranges::equal(std::as_bytes(a.pixels()), std::as_bytes(b.pixels()));
            };
            EXPECT_TRUE(same(whole->colour, pieces->colour)) << side;
            EXPECT_TRUE(same(whole->depth, pieces->depth)) << side;
            EXPECT_TRUE(same(whole->normal, pieces->normal)) << side;
        }
    }
}

TEST(Capture, CloudsThatShowTooManyPointsAreRefused) {
    const Mesh cloud = layeredCloud(60);
    Job job;
    job.limits.maxMemoryBytes = 256 << 10;
    const auto image = rasterise(cloud, lookingAt({0.5, 0.3, 3}, 64), {}, job);
    ASSERT_FALSE(image);
    EXPECT_NE(image.error().message.find("the points that a picture shows would need"),
              std::string::npos)
        << image.error().message;
}

TEST(ViewLayout, ParsesAndRefuses) {
    EXPECT_EQ(parseViewLayout("cube")->count, 6);
    EXPECT_EQ(parseViewLayout("ring:12")->count, 12);
    EXPECT_EQ(layoutDirections(*parseViewLayout("octahedral:4")).size(), 16u);
    for (const char* bad : {"", "ring", "ring:", "ring:x", "ring:0", "ring:-4", "sphere:9999999999",
                            "cone:3", "cube:6"})
        EXPECT_FALSE(parseViewLayout(bad)) << bad;
}

TEST(ViewLayout, HemiOctahedralGridsLookFromTheHorizonUp) {
    const auto directions = layoutDirections(*parseViewLayout("hemi-octahedral:5"));
    ASSERT_EQ(directions.size(), 25u);
    for (std::size_t k = 0; k < directions.size(); ++k) {
        const glm::dvec3 d = directions[k];
        const bool rim = k % 5 == 0 || k % 5 == 4 || k < 5 || k >= 20;
        EXPECT_NEAR(glm::length(d), 1, 1e-12);
        if (rim)
            EXPECT_NEAR(d.y, 0, 1e-12) << k;
        else
            EXPECT_GT(d.y, 0.3) << k;
        // No direction twice.
        for (std::size_t l = 0; l < k; ++l) EXPECT_LT(glm::dot(d, directions[l]), 0.99);
    }
    EXPECT_NEAR(directions[12].y, 1, 1e-12);
}

TEST(ViewLayout, EveryLayoutSeesTheWholeObjectInsideTheFrame) {
    const auto mesh = sphereMesh(12, {5, -3, 2}, 0.7f);
    for (const char* text : {"cube", "ring:5", "sphere:9", "octahedral:3", "hemi-octahedral:3"}) {
        for (const bool orthographic : {false, true}) {
            ViewFraming framing;
            framing.orthographic = orthographic;
            framing.width = 96;
            framing.height = 64;
            const auto cameras = layoutCameras(*parseViewLayout(text), framing, mesh.positions);
            ASSERT_TRUE(cameras);
            for (const auto& c : *cameras) {
                EXPECT_TRUE(c.check());
                double reach = 0;
                for (const auto& p : mesh.positions) {
                    const auto q = c.project(glm::dvec3(c.cameraFromWorld() * glm::dvec4(p, 1)));
                    EXPECT_GT(q.z, 0);
                    EXPECT_GE(q.x, 1.0);
                    EXPECT_LE(q.x, 95.0);
                    EXPECT_GE(q.y, 1.0);
                    EXPECT_LE(q.y, 63.0);
                    reach = std::max(reach, std::abs(q.y - 32));
                }
                EXPECT_GT(reach, 24) << "the object fills the frame";
            }
        }
    }
}

}  // namespace
}  // namespace stx
