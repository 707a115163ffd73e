// The compute pipeline through each kind of atomics that a driver may have.

#include "lib/render/splat/gpu/gpu_splat.hpp"
#include "tests/unit/render_gpu/gpu_fixture.hpp"

namespace stx {
namespace {

using gpu::Sums;
using test::psnr;

struct Kind {
    const char* name;
    Sums sums;
    bool linear;
};
void PrintTo(const Kind& kind, std::ostream* out) {
    *out << kind.name;
}

/// A picture and what it was added up with.
struct Drawn {
    Frame frame;
    Sums sums = Sums::integers;
    std::vector<std::string> notes;
};

Result<Drawn> drawWith(const gpu::Faults& faults, const Bundle& bundle,
                       const RenderSettings& settings, const Camera& camera) {
    const test::WithFaults with(faults);
    Job job;
    STX_TRY(auto renderer, gpu::makeGpuSplatRenderer(bundle, settings, -1, job));
    STX_TRY(auto frame, renderer->render(camera));
    return Drawn{std::move(frame), gpu::lastSplatCounts(*renderer).sums, job.takeNotes()};
}

gpu::ContextAbilities abilities() {
    const auto context = gpu::EglContext::create(-1, gpu::EglContext::Profile::core);
    return context ? (*context)->abilities() : gpu::ContextAbilities{};
}

/// Views with opaque pixels only, or with half-covered ones at the rims.
Bundle objectWith(bool translucent, bool linear) {
    Bundle bundle = analyticBundle(AnalyticScene::object, 4, translucent ? 2 : 1);
    if (!linear) return bundle;
    for (auto& view : bundle.views) {
        RgbaFloatImage light(view.camera.width, view.camera.height);
        for (int y = 0; y < light.height(); ++y)
            for (int x = 0; x < light.width(); ++x) {
                const glm::vec4 c = view.texture.at(x, y);
                light.at(x, y) = {glm::vec3(c) * 5.0f, c.a};
            }
        view.texture = Texture(std::move(light));
    }
    return bundle;
}

RenderSettings settingsFor(bool lit) {
    RenderSettings s = test::splatSettings();
    s.pipeline = GpuPipeline::compute;
    if (!lit) return s;
    s.lighting.lights = {{Light::Kind::directional, {-1, -0.5f, -1}, {0.9f, 0.8f, 0.7f}, false}};
    s.lighting.specular = glm::vec3(0.3f);
    s.lighting.shininess = 20;
    return s;
}

class GpuAtomics : public testing::TestWithParam<Kind> {
  protected:
    void SetUp() override {
        REQUIRE_GPU();
        const auto able = abilities();
        REQUIRE_ABILITY(able.modern, "OpenGL 4.5");
        if (GetParam().sums == Sums::pairs)
            REQUIRE_ABILITY(able.atomicInt64, "GL_NV_shader_atomic_int64");
        if (GetParam().sums == Sums::floats)
            REQUIRE_ABILITY(able.atomicFloat, "GL_NV_shader_atomic_float");
    }
};

TEST_P(GpuAtomics, AgreeWithTheCpu) {
    gpu::Faults only;
    if (GetParam().sums != Sums::pairs) only.atomicInt64 = false;
    if (GetParam().sums != Sums::floats) only.atomicFloat = false;
    Camera camera = analyticCamera(AnalyticScene::object, 0.4, 4);
    camera.cx += 21;
    for (const bool translucent : {false, true}) {
        const Bundle bundle = objectWith(translucent, GetParam().linear);
        for (const bool lit : {false, true}) {
            const auto what =
                fmt::format("{}{}", translucent ? "translucent" : "opaque", lit ? "_lit" : "");
            const auto drawn = drawWith(only, bundle, settingsFor(lit), camera);
            ASSERT_TRUE(drawn) << drawn.error().text();
            EXPECT_EQ(drawn->sums, GetParam().sums);
            EXPECT_EQ(drawn->frame.linear, GetParam().linear);
            const Frame expected = test::drawOnCpu(bundle, settingsFor(lit), camera);
            test::expectAgreement(drawn->frame, expected, what, 4);
            if (!lit) continue;
            EXPECT_GT(psnr(drawn->frame.albedo, expected.albedo), 45.0) << what;
            EXPECT_LT(psnr(drawn->frame.colour, drawn->frame.albedo), 30.0) << what;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Kinds, GpuAtomics,
                         testing::Values(Kind{"int32", Sums::integers, false},
                                         Kind{"int32_linear", Sums::integers, true},
                                         Kind{"int64", Sums::pairs, false},
                                         Kind{"int64_linear", Sums::pairs, true},
                                         Kind{"float_linear", Sums::floats, true}),
                         [](const auto& kind) { return kind.param.name; });

TEST(GpuAtomicsChoice, TakesTheBestThatTheDeviceHas) {
    REQUIRE_GPU();
    const auto able = abilities();
    REQUIRE_ABILITY(able.modern, "OpenGL 4.5");
    for (const bool linear : {false, true}) {
        const Bundle bundle = objectWith(false, linear);
        const auto drawn = drawWith({}, bundle, settingsFor(false), bundle.views[0].camera);
        ASSERT_TRUE(drawn) << drawn.error().text();
        EXPECT_EQ(drawn->sums, linear && able.atomicFloat ? Sums::floats
                               : able.atomicInt64         ? Sums::pairs
                                                          : Sums::integers);
    }
}

TEST(GpuAtomicsChoice, WorksWhereADriverNamesWhatItDoesNotCompile) {
    REQUIRE_GPU();
    const auto able = abilities();
    REQUIRE_ABILITY(able.modern, "OpenGL 4.5");
    if (able.atomicInt64) GTEST_SKIP() << "this driver compiles 64-bit atomics";
    const Bundle bundle = objectWith(false, false);
    gpu::Faults faults;
    faults.atomicInt64 = true;
    const Camera camera = analyticCamera(AnalyticScene::object, 0.4, 4);
    const auto drawn = drawWith(faults, bundle, settingsFor(false), camera);
    ASSERT_TRUE(drawn) << drawn.error().text();
    EXPECT_EQ(drawn->sums, Sums::integers);
    ASSERT_EQ(drawn->notes.size(), 1u);
    EXPECT_NE(drawn->notes[0].find("does not compile its 64-bit atomics"), std::string::npos);
    test::expectAgreement(drawn->frame, test::drawOnCpu(bundle, settingsFor(false), camera),
                          "fallback");
}

}  // namespace
}  // namespace stx
