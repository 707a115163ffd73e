#include "formats/viewer/surfaces_glb.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "formats/files/file_spool.hpp"
#include "formats/meshes/meshes.hpp"
#include "formats/viewer/fewer_triangles.hpp"
#include "lib/render/surface/view_surfaces.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/torus_bundle.hpp"

namespace surfaces_glb_test {

using namespace stx;

/// How far a point is from the torus of torusViews() (radii 0.75 and 0.3, around Y).
double fromTorus(glm::dvec3 p) {
    const double around = std::hypot(p.x, p.z) - 0.75;
    return std::abs(std::hypot(around, p.y) - 0.3);
}

TEST(ViewSurfaces, LieOnWhatTheViewsShow) {
    Job job;
    const Bundle bundle = torusViews(96);
    const auto surfaces = viewSurfaces(bundle, job);
    ASSERT_TRUE(surfaces) << surfaces.error().text();
    ASSERT_EQ(surfaces->size(), bundle.views.size());
    for (std::size_t k = 0; k < surfaces->size(); ++k) {
        const ViewSurface& s = (*surfaces)[k];
        ASSERT_EQ(s.pixels.size(), s.positions.size());
        for (std::size_t i = 0; i < s.pixels.size(); ++i)
            EXPECT_LT(glm::length(glm::dvec3(s.positions[i]) -
                                  bundle.views[k].worldPoint(s.pixels[i].x, s.pixels[i].y)),
                      1e-3);
        for (std::size_t t = 0; t < s.triangles.size(); t += 3) {
            const glm::dvec3 a = s.positions[s.triangles[t]], b = s.positions[s.triangles[t + 1]],
                             c = s.positions[s.triangles[t + 2]];
            // The middle is on the surface, too: nothing bridges the hole of the torus.
            EXPECT_LT(fromTorus((a + b + c) / 3.0), 0.01);
            // Seen from the view.
            EXPECT_GT(glm::dot(glm::cross(b - a, c - a), bundle.views[k].camera.position - a), 0);
        }
    }
}

TEST(ViewSurfaces, KeepEveryPlaceOfSomeView) {
    Job job;
    const Bundle bundle = torusViews(96);
    const auto surfaces = viewSurfaces(bundle, job);
    ASSERT_TRUE(surfaces);
    std::vector<glm::vec3> kept;
    std::size_t points = 0;
    for (const ViewSurface& s : *surfaces)
        kept.insert(kept.end(), s.positions.begin(), s.positions.end());
    for (const ReferenceView& view : bundle.views) points += view.pointCount();
    // What several views show is kept of few.
    EXPECT_LT(kept.size(), points / 2);
    for (const ReferenceView& view : bundle.views) {
        for (int y = 2; y + 2 < view.camera.height; y += 5) {
            for (int x = 2; x + 2 < view.camera.width; x += 5) {
                if (!hasPoint(view.depth.at(x, y))) continue;
                const glm::vec3 p(view.worldPoint(x, y));
                float nearest = 1e9f;
                for (const glm::vec3& q : kept) nearest = std::min(nearest, glm::length(q - p));
                EXPECT_LT(nearest, 0.15f);
            }
        }
    }
}

/// A view of where a space ends in which all places are `free`.
template <class Free>
ReferenceView viewOf(const Free& free, glm::dvec3 eye, glm::dquat turned, double fovRad, int side) {
    ReferenceView view;
    view.name = "side";
    view.camera = Camera::fromFieldOfView(eye, turned, {fovRad, fovRad}, false, side, side);
    view.nearPlane = 0.1;
    view.farPlane = 30;
    view.depth = Image<float>(side, side);
    view.texture = Rgba8Image(side, side, glm::u8vec4(90, 90, 90, 255));
    for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
            double low = 0.1, high = 29;
            for (int k = 0; k < 40; ++k) {
                const double middle = (low + high) / 2;
                const glm::dvec3 at =
                    eye + turned * view.camera.unproject(x + 0.5, y + 0.5, middle);
                (free(at) ? low : high) = middle;
            }
            view.depth.at(x, y) = static_cast<float>(low);
        }
    }
    return view;
}

/// Beside a ridge, z = -|x|, seen with a turn around Y.
ReferenceView ridgeFrom(glm::dvec3 eye, double angle) {
    return viewOf([](glm::dvec3 at) { return at.z > -std::abs(at.x); }, eye,
                  glm::angleAxis(angle, glm::dvec3(0, 1, 0)), 0.4, 64);
}

/// How many of 160 x 160 places around the middle, seen from above, no triangle covers.
std::ptrdiff_t gaps(const std::vector<ViewSurface>& surfaces, double width) {
    constexpr int kSide = 160;
    Image<std::uint8_t> covered(kSide, kSide, 0);
    const auto placeOf = [&](double at) { return (at / width + 0.5) * kSide; };
    for (const ViewSurface& s : surfaces) {
        for (std::size_t t = 0; t < s.triangles.size(); t += 3) {
            glm::dvec2 p[3];
            for (std::size_t k = 0; k < 3; ++k) {
                const glm::vec3& corner = s.positions[s.triangles[t + k]];
                p[k] = {placeOf(corner.x), placeOf(corner.y)};
            }
            const glm::ivec2 low(glm::floor(glm::min(p[0], glm::min(p[1], p[2]))));
            const glm::ivec2 high(glm::ceil(glm::max(p[0], glm::max(p[1], p[2]))));
            for (int y = std::max(low.y, 0); y <= std::min(high.y, kSide - 1); ++y) {
                for (int x = std::max(low.x, 0); x <= std::min(high.x, kSide - 1); ++x) {
                    bool inside = true;
                    for (int k = 0; k < 3; ++k) {
                        const glm::dvec2 side = p[(k + 1) % 3] - p[k],
                                         to = glm::dvec2(x + 0.5, y + 0.5) - p[k];
                        inside = inside && side.x * to.y - side.y * to.x >= -1e-3;
                    }
                    if (inside) covered.at(x, y) = 1;
                }
            }
        }
    }
    return std::ranges::count(covered.pixels(), 0);
}

TEST(ViewSurfaces, LeaveNoGapsAtCreases) {
    Job job;
    Bundle bundle;
    for (const double angle : {0.5, -0.4, 0.1})
        bundle.views.push_back(
            ridgeFrom(glm::angleAxis(angle, glm::dvec3(0, 1, 0)) * glm::dvec3(0, 0, 4), angle));
    const auto surfaces = viewSurfaces(bundle, job);
    ASSERT_TRUE(surfaces) << surfaces.error().text();
    EXPECT_EQ(gaps(*surfaces, 0.4), 0);
}

/// Which view is the densest changes within large triangles.
TEST(ViewSurfaces, LeaveNoGapsOnWalls) {
    Job job;
    Bundle bundle;
    const auto room = [](glm::dvec3 at) {
        return std::abs(at.x) < 2 && std::abs(at.y) < 1.5 && at.z > 0 && at.z < 6;
    };
    const std::pair<glm::dvec3, glm::dvec3> places[] = {
        {{0, 0, 5.5}, {0, -0.1, 0}},        {{-1.5, 0.5, 4}, {1.5, -0.5, 0.5}},
        {{1.5, 0.5, 4}, {-1.5, -0.5, 0.5}}, {{0, 1.1, 3}, {0.3, -1.5, 1}},
        {{0, -1, 3}, {-0.3, 1.5, 1}},       {{1.2, 0, 2}, {-2, -0.3, 1.4}},
        {{-1.2, -0.3, 2}, {2, 0.1, 1.4}}};
    for (const auto& [eye, target] : places)
        bundle.views.push_back(viewOf(room, eye, *lookAt(eye, target), 1.0472, 256));
    const auto surfaces = viewSurfaces(bundle, job);
    ASSERT_TRUE(surfaces) << surfaces.error().text();
    EXPECT_EQ(gaps(*surfaces, 2.8), 0);
}

/// What is seen from afar would lie on the other face there, as a stripe of its colour.
TEST(ViewSurfaces, TakeCreasesFromNearViews) {
    Job job;
    Bundle bundle;
    bundle.views.push_back(ridgeFrom({0.3, 0, 2}, 0.1));
    bundle.views.push_back(ridgeFrom({-0.3, 0, 10}, 0));
    const auto surfaces = viewSurfaces(bundle, job);
    ASSERT_TRUE(surfaces) << surfaces.error().text();
    EXPECT_EQ(gaps(*surfaces, 0.4), 0);
    const ViewSurface& far = surfaces->back();
    ASSERT_FALSE(far.triangles.empty());
    for (const std::uint32_t corner : far.triangles) {
        const glm::vec3 p = far.positions[corner];
        EXPECT_GT(std::max(std::abs(p.x), std::abs(p.y)), 0.1f);
    }
}

/// A grey disc before a red wall, with the mean colour of each pixel's place as renderers have it.
TEST(ViewSurfaces, KnowTheirOwnColoursAtEdges) {
    Job job;
    Bundle bundle;
    ReferenceView& view = bundle.views.emplace_back();
    view.name = "front";
    view.camera = Camera::fromFieldOfView({0, 0, 4}, {1, 0, 0, 0}, {0.8, 0.8}, false, 64, 64);
    view.nearPlane = 1;
    view.farPlane = 10;
    view.depth = Image<float>(64, 64, 6.0f);
    view.texture = Rgba8Image(64, 64);
    const glm::vec3 grey(90), red(255, 0, 0);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            const double away = std::hypot(x - 31.7, y - 32.4) - 20;
            if (away < 0) view.depth.at(x, y) = 3.0f;
            const auto share = static_cast<float>(std::clamp(0.5 - away / 2, 0.0, 1.0));
            view.texture.rgba8()->at(x, y) = {glm::u8vec3(glm::mix(red, grey, share)), 255};
        }
    }
    const auto surfaces = viewSurfaces(bundle, job);
    ASSERT_TRUE(surfaces) << surfaces.error().text();
    const ViewSurface& s = surfaces->front();
    for (std::size_t i = 0; i < s.mixedPixels.size(); ++i)
        view.texture.rgba8()->at(s.mixedPixels[i].x, s.mixedPixels[i].y) = {
            glm::u8vec3(s.ownColours[i] * 255.0f + 0.5f), 255};
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            EXPECT_LT(glm::length(glm::vec3(view.texture.rgba8()->at(x, y)) -
                                  (view.depth.at(x, y) < 5 ? grey : red)),
                      4)
                << x << " " << y;
}

TEST(SurfacesGlb, IsReadBackAsTheSameSurfaces) {
    const TemporaryFolder folder;
    Job job;
    const Bundle bundle = torusViews(96);
    const auto report = writeSurfaces(folder.path() / "a.glb", bundle, {}, job);
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_TRUE(job.takeNotes().empty());
    const auto mesh = readMesh(folder.path() / "a.glb", job);
    ASSERT_TRUE(mesh) << mesh.error().text();
    EXPECT_EQ(static_cast<std::int64_t>(mesh->triangles.size()), report->triangles);
    EXPECT_EQ(mesh->textures.size(), bundle.views.size());
    for (const glm::vec3& p : mesh->positions) EXPECT_LT(fromTorus(p), 0.01);
}

TEST(SurfacesGlb, StandsOnItsFeet) {
    const TemporaryFolder folder;
    Job job;
    Bundle bundle = torusViews(48);
    // The scene of the other tests, standing on +Z.
    const glm::dmat3 zUp(1, 0, 0, 0, 0, 1, 0, -1, 0);
    for (ReferenceView& view : bundle.views) {
        view.camera.position = zUp * view.camera.position;
        view.camera.orientation = glm::quat_cast(zUp) * view.camera.orientation;
    }
    ASSERT_TRUE(writeSurfaces(folder.path() / "z.glb", bundle, {}, job));
    EXPECT_EQ(job.takeNotes(), std::vector<std::string>{
                                   "the model is turned by a node, x y z to x z -y, so that +Y is "
                                   "up, as it is in glTF"});
    const auto mesh = readMesh(folder.path() / "z.glb", job);
    ASSERT_TRUE(mesh) << mesh.error().text();
    for (const glm::vec3& p : mesh->positions) EXPECT_LT(fromTorus(p), 0.02);
}

TEST(SurfacesGlb, SaysThatGlassIsOpaque) {
    const TemporaryFolder folder;
    Job job;
    Bundle bundle = torusViews(48);
    for (glm::u8vec4& c : bundle.views[0].texture.rgba8()->pixels())
        if (c.a > 0) c.a = 128;
    ASSERT_TRUE(writeSurfaces(folder.path() / "a.glb", bundle, {}, job));
    EXPECT_EQ(job.takeNotes(),
              std::vector<std::string>{"translucent surfaces are opaque in the model"});
}

TEST(SurfacesGlb, IsTheSameFromASpool) {
    const TemporaryFolder folder;
    Job job;
    for (const bool linear : {false, true}) {
        Bundle bundle = torusViews(96);
        if (linear) {
            for (ReferenceView& view : bundle.views) {
                RgbaFloatImage floats(view.camera.width, view.camera.height);
                std::ranges::transform(view.texture.rgba8()->pixels(), floats.data(),
                                       [](glm::u8vec4 c) { return glm::vec4(c) / 300.0f; });
                view.texture = std::move(floats);
            }
        }
        ASSERT_TRUE(writeSurfaces(folder.path() / "a.glb", bundle, {}, job));
        auto spool = FileSpool::create(folder.path(), 1 << 20);
        ASSERT_TRUE(spool);
        for (ReferenceView& view : bundle.views) view.moveTo(spool->get());
        SurfacesOptions options;
        options.spool = spool->get();
        // Its memory is not asked about.
        job.limits.maxMemoryBytes = 1 << 20;
        ASSERT_TRUE(
            writeSurfaces(folder.path() / "b.glb", std::exchange(bundle, {}), options, job));
        job.limits = {};
        const auto a = readFile(folder.path() / "a.glb", Limits());
        const auto b = readFile(folder.path() / "b.glb", Limits());
        ASSERT_TRUE(a && b);
        EXPECT_EQ(*a, *b);
    }
}

/// A grey disc before a red wall.
Bundle discBeforeWall() {
    Bundle bundle;
    ReferenceView& view = bundle.views.emplace_back();
    view.name = "front";
    view.camera = Camera::fromFieldOfView({0, 0, 4}, {1, 0, 0, 0}, {0.8, 0.8}, false, 64, 64);
    view.nearPlane = 1;
    view.farPlane = 10;
    view.depth = Image<float>(64, 64, 6.0f);
    view.texture = Rgba8Image(64, 64, glm::u8vec4(255, 0, 0, 255));
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            if (std::hypot(x - 31.7, y - 32.4) > 20) continue;
            view.depth.at(x, y) = 3.0f;
            view.texture.rgba8()->at(x, y) = {90, 90, 90, 255};
        }
    }
    return bundle;
}

TEST(SurfacesGlb, MixesNoColoursAcrossEdges) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(writeSurfaces(folder.path() / "a.glb", discBeforeWall(), {}, job));
    const auto mesh = readMesh(folder.path() / "a.glb", job);
    ASSERT_TRUE(mesh) << mesh.error().text();
    ASSERT_EQ(mesh->textures.size(), 1u);
    const Rgba8Image& picture = mesh->textures[0].pixels;
    int textured = 0, coloured = 0;
    for (std::size_t t = 0; t < mesh->triangles.size(); ++t) {
        const auto& corners = mesh->triangles[t];
        // Of the disc.
        if (mesh->positions[corners[0]].z < 0) continue;
        if (mesh->materials[mesh->triangleMaterial[t]].baseColourTexture < 0) {
            ++coloured;
            continue;
        }
        ++textured;
        // Along each side the four texels around are grey: filters find no red.
        for (int k = 0; k < 3; ++k) {
            const glm::vec2 at = 0.5f * (mesh->uvs[corners[k]] + mesh->uvs[corners[(k + 1) % 3]]);
            const glm::vec2 texel = at * 64.0f - 0.5f;
            for (int i = 0; i < 4; ++i) {
                const glm::vec2 next(
                    i % 2 ? std::ceil(texel.x - 0.02f) : std::floor(texel.x + 0.02f),
                    i / 2 ? std::ceil(texel.y - 0.02f) : std::floor(texel.y + 0.02f));
                EXPECT_EQ(picture.at(static_cast<int>(next.x), static_cast<int>(next.y)).g, 90);
            }
        }
    }
    EXPECT_GT(textured, 20);
    EXPECT_GT(coloured, 20);
}

TEST(SurfacesGlb, WithFewerTrianglesIsTheSameSurfaces) {
    const TemporaryFolder folder;
    Job job;
    const Bundle bundle = torusViews(96);
    const auto all = writeSurfaces(folder.path() / "a.glb", bundle, {}, job);
    ASSERT_TRUE(all) << all.error().text();
    const auto most = static_cast<std::size_t>(all->triangles / 4);
    const auto fewer = writeSurfaces(folder.path() / "b.glb", bundle,
                                     {.mostTriangles = most, .jpegQuality = 92}, job);
    ASSERT_TRUE(fewer) << fewer.error().text();
    EXPECT_TRUE(job.takeNotes().empty());
    EXPECT_LE(fewer->triangles, all->triangles / 4);
    EXPECT_GT(fewer->triangles, all->triangles / 5);
    const auto mesh = readMesh(folder.path() / "b.glb", job);
    ASSERT_TRUE(mesh) << mesh.error().text();
    EXPECT_EQ(static_cast<std::int64_t>(mesh->triangles.size()), fewer->triangles);
    for (const auto& t : mesh->triangles) {
        const glm::vec3 middle =
            (mesh->positions[t[0]] + mesh->positions[t[1]] + mesh->positions[t[2]]) / 3.0f;
        EXPECT_LT(fromTorus(middle), 0.03);
    }
    EXPECT_LT(2 * std::filesystem::file_size(folder.path() / "b.glb"),
              std::filesystem::file_size(folder.path() / "a.glb"));
}

/// Where corners are moved across a triangle's side, it would be folded over.
TEST(SurfacesGlb, WithFewerTrianglesTurnsNoneAway) {
    Job job;
    const Bundle bundle = torusViews(64);
    for (const std::size_t most : {200u, 800u, 3000u}) {
        auto surfaces = viewSurfaces(bundle, job);
        ASSERT_TRUE(surfaces) << surfaces.error().text();
        ASSERT_TRUE(takeFewerTriangles(bundle, most, *surfaces, job));
        int away = 0;
        for (const ViewSurface& s : *surfaces) {
            for (std::size_t t = 0; t < s.triangles.size(); t += 3) {
                const glm::ivec2 a = s.pixels[s.triangles[t]], b = s.pixels[s.triangles[t + 1]],
                                 c = s.pixels[s.triangles[t + 2]];
                // Rows go downward: counter-clockwise is below 0.
                away += (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > 0;
            }
        }
        EXPECT_EQ(away, 0) << most;
    }
}

/// Views from all sides show each other's dents.
TEST(SurfacesGlb, WithFewTrianglesKeepsItsShape) {
    const TemporaryFolder folder;
    Job job;
    const Bundle bundle = torusViews(96);
    const auto few = writeSurfaces(folder.path() / "a.glb", bundle, {.mostTriangles = 1500}, job);
    ASSERT_TRUE(few) << few.error().text();
    const auto mesh = readMesh(folder.path() / "a.glb", job);
    ASSERT_TRUE(mesh) << mesh.error().text();
    double sum = 0, area = 0;
    for (const auto& t : mesh->triangles) {
        const glm::dvec3 a = mesh->positions[t[0]], b = mesh->positions[t[1]],
                         c = mesh->positions[t[2]];
        const double here = glm::length(glm::cross(b - a, c - a));
        sum += here * fromTorus((a + b + c) / 3.0);
        area += here;
    }
    EXPECT_LT(sum / area, 0.015);
}

TEST(SurfacesGlb, WithFewerTrianglesJoinsNoParts) {
    const TemporaryFolder folder;
    Job job;
    const Bundle bundle = discBeforeWall();
    ASSERT_TRUE(writeSurfaces(folder.path() / "a.glb", bundle, {.mostTriangles = 1}, job));
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("more than the 1 that are asked for"), std::string::npos) << notes[0];
    const auto mesh = readMesh(folder.path() / "a.glb", job);
    ASSERT_TRUE(mesh) << mesh.error().text();
    ASSERT_FALSE(mesh->triangles.empty());
    for (const auto& t : mesh->triangles)
        for (const int k : {1, 2})
            EXPECT_NEAR(mesh->positions[t[0]].z, mesh->positions[t[k]].z, 0.5f);
}

TEST(SurfacesGlb, HasNormalsWhereTheBundleDoes) {
    constexpr const char* kSaid =
        "normals are left out, since 1 of 2 views has none; stx bake --keep-normals makes them "
        "where they are missing";
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(writeSurfaces(folder.path() / "a.glb", smallBundle(2, 16, true, false), {}, job));
    EXPECT_EQ(std::ranges::count(job.takeNotes(), kSaid), 0);
    const auto with = readMesh(folder.path() / "a.glb", job);
    ASSERT_TRUE(with) << with.error().text();
    EXPECT_FALSE(with->normals.empty());
    Bundle some = smallBundle(2, 16, true, false);
    some.views[1].normal = {};
    ASSERT_TRUE(writeSurfaces(folder.path() / "b.glb", some, {}, job));
    EXPECT_EQ(std::ranges::count(job.takeNotes(), kSaid), 1);
    const auto without = readMesh(folder.path() / "b.glb", job);
    ASSERT_TRUE(without) << without.error().text();
    EXPECT_TRUE(without->normals.empty());
}

TEST(SurfacesGlb, SaysWhatItRounds) {
    const TemporaryFolder folder;
    Job job;
    Bundle bundle = smallBundle(2, 16, false, true);
    bundle.origin = {500000, 5600000, 0};
    ASSERT_TRUE(writeSurfaces(folder.path() / "a.glb", bundle, {}, job));
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_EQ(notes[0],
              "colours of linear light become 8-bit sRGB in the model; values above 1 are clipped");
    EXPECT_NE(notes[1].find("stays at the origin"), std::string::npos);
    // The colours reach up to 4.
    bundle.origin = {};
    for (ReferenceView& view : bundle.views)
        for (glm::vec4& c : view.texture.rgbaFloat()->pixels())
            c = glm::vec4(glm::vec3(c) / 4.0f, c.a);
    ASSERT_TRUE(writeSurfaces(folder.path() / "b.glb", bundle, {}, job));
    EXPECT_EQ(job.takeNotes(),
              std::vector<std::string>{"colours of linear light become 8-bit sRGB in the model"});
}

TEST(SurfacesGlb, LeavesNothingWhenItFails) {
    const TemporaryFolder folder;
    Job job;
    Bundle empty = smallBundle(1, 16, false, false);
    for (float& d : empty.views[0].depth.pixels()) d = kNoDepth;
    EXPECT_FALSE(writeSurfaces(folder.path() / "a.glb", empty, {}, job));
    job.cancelled = true;
    EXPECT_FALSE(writeSurfaces(folder.path() / "a.glb", smallBundle(1, 16, false, false), {}, job));
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace surfaces_glb_test
