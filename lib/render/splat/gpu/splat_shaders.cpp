#include "lib/render/splat/gpu/splat_shaders.hpp"

#include "embedded_shaders.hpp"
#include "lib/render/splat/prepared.hpp"

namespace stx::gpu {
std::string splatHeader(const SplatVariant& v, int pass, SplatShape rule) {
    // The raster pipeline is for devices without compute shaders: OpenGL 3.3 has all it needs.
    std::string text = v.raster ? "#version 330 core\n" : "#version 450 core\n";
    if (!v.raster && v.sums == Sums::pairs)
        text +=
            "#extension GL_ARB_gpu_shader_int64 : require\n"
            "#extension GL_NV_shader_atomic_int64 : require\n";
    if (!v.raster && v.sums == Sums::floats)
        text += "#extension GL_NV_shader_atomic_float : require\n";
    const auto define = [&](const char* name, int value) {
        text += fmt::format("#define {} {}\n", name, value);
    };
    define("PASS", pass);
    define("RULE", static_cast<int>(rule));
    define("ACCUMULATE", static_cast<int>(v.sums));
    define("TRANSLUCENT", v.translucent);
    define("NORMALS", v.normals);
    define("LIT", v.lit);
    define("SIZES", v.sizes);
    define("RASTER", v.raster);
    define("LINEAR", v.linear);
    define("CULL", v.cull);
    define("TILE", kCullTile);
    return text + fmt::format("const float kSlopeScale = {:.9e};\n", splat::kSlopeScale);
}

std::vector<ShaderStage> splatStages(bool raster, SplatProgram program) {
    using namespace shaders;
    const auto compute = [](std::string_view name, std::string_view text) {
        return std::vector<ShaderStage>{{GL_COMPUTE_SHADER, name, {text}}};
    };
    if (raster && program == SplatProgram::splats)
        return {{GL_VERTEX_SHADER, "splat.vert", {splat_vert}},
                {GL_FRAGMENT_SHADER, "splat.frag", {splat_frag}}};
    if (raster)
        return {{GL_VERTEX_SHADER, "screen.vert", {screen_vert}},
                {GL_FRAGMENT_SHADER, "resolve.frag", {resolve_frag}}};
    switch (program) {
        case SplatProgram::splats:
            return compute("splat.comp", splat_comp);
        case SplatProgram::resolve:
            return compute("resolve.comp", resolve_comp);
        case SplatProgram::tiles:
            return compute("splat_tiles.comp", splat_tiles_comp);
        case SplatProgram::cull:
            break;
    }
    return compute("splat_cull.comp", splat_cull_comp);
}

SplatShape uniformShape(SplatRule rule) {
    return rule == SplatRule::point   ? SplatShape::point
           : rule == SplatRule::paper ? SplatShape::paper
                                      : SplatShape::uniform;
}

SplatPrograms::SplatPrograms(bool raster, const GpuScene& scene, const RenderSettings& settings,
                             std::function<void(GLuint)> onBuilt)
    : rule_(settings.splat), onBuilt_(std::move(onBuilt)) {
    variant.raster = raster;
    variant.translucent = scene.translucent;
    variant.normals = settings.wantNormals();
    variant.lit = settings.lighting.on();
    variant.sizes = scene.hasSizes;
    variant.linear = scene.linear;
}

Result<GLuint> SplatPrograms::get(SplatProgram kind, int pass, SplatShape shape) {
    const std::string key =
        fmt::format("{} {} {}", static_cast<int>(kind), pass, static_cast<int>(shape));
    if (const auto found = built_.find(key); found != built_.end()) return found->second.get();
    STX_TRY(GlProgram built,
            buildProgram(splatHeader(variant, pass, shape), splatStages(variant.raster, kind)));
    const GLuint name = built.get();
    if (onBuilt_) onBuilt_(name);
    built_.emplace(key, std::move(built));
    return name;
}

Result<void> SplatPrograms::build() {
    std::vector<SplatShape> shapes{uniformShape(rule_)};
    if (shapes[0] == SplatShape::uniform)
        shapes.insert(shapes.end(), {SplatShape::small, SplatShape::ellipse});
    for (const SplatShape shape : shapes)
        for (const int pass : {1, 2}) STX_CHECK(get(SplatProgram::splats, pass, shape));
    STX_CHECK(get(SplatProgram::resolve));
    if (!variant.cull) return {};
    STX_CHECK(get(SplatProgram::tiles));
    STX_CHECK(get(SplatProgram::cull));
    return {};
}

std::vector<ShaderText> allSplatShaders() {
    std::vector<ShaderText> out;
    const auto add = [&](const SplatVariant& v, SplatProgram program, int pass, SplatShape rule) {
        for (const auto& stage : splatStages(v.raster, program))
            out.push_back(shaderText(
                fmt::format("{} pass {} rule {} sums {}{}{}{}{}{}{}", stage.name, pass,
                            static_cast<int>(rule), static_cast<int>(v.sums),
                            v.translucent ? " translucent" : "", v.normals ? " normals" : "",
                            v.lit ? " lit" : "", v.sizes ? " sizes" : "", v.linear ? " linear" : "",
                            v.cull ? " cull" : ""),
                splatHeader(v, pass, rule), stage));
    };
    for (const bool raster : {false, true}) {
        for (const Sums sums : {Sums::integers, Sums::floats, Sums::pairs}) {
            if (raster && sums != Sums::integers) continue;
            // Bits: translucent, normals, and sizes of the splats or light of the picture.
            for (int bits = 0; bits < 8; ++bits) {
                SplatVariant v;
                v.raster = raster;
                v.sums = sums;
                v.translucent = bits & 1;
                v.normals = bits & 2;
                v.sizes = v.cull = bits & 4;
                v.cull = v.cull && !raster;
                for (const SplatShape rule :
                     {SplatShape::point, SplatShape::uniform, SplatShape::ellipse,
                      SplatShape::paper, SplatShape::small})
                    for (const int pass : {1, 2}) add(v, SplatProgram::splats, pass, rule);
                v.sizes = v.cull = false;
                v.lit = v.normals && (bits & 4);
                v.linear = bits & 1;
                add(v, SplatProgram::resolve, 0, SplatShape::point);
            }
        }
    }
    add({}, SplatProgram::tiles, 0, SplatShape::point);
    add({}, SplatProgram::cull, 0, SplatShape::point);
    return out;
}

}  // namespace stx::gpu
