#include "tools/python/settings.hpp"

#include <cmath>

#include "tools/python/arrays.hpp"

namespace stx::python {
namespace {

/// A pair, or (of intrinsics) four numbers.
template <std::size_t N>
void takeNumbers(const Keywords& given, const char* name, std::array<double*, N> to) {
    std::optional<std::array<double, N>> numbers;
    given.take(name, numbers);
    if (!numbers) return;
    for (std::size_t i = 0; i < N; ++i) {
        if (!std::isfinite((*numbers)[i]))
            refuse("{} holds {}; finite numbers are expected", name, (*numbers)[i]);
        *to[i] = (*numbers)[i];
    }
}

void takeRefining(const Keywords& given, RefineSettings& to) {
    std::optional<std::string> text;
    given.take("refine", text);
    if (text) to = valueOf(RefineSettings::from(*text));
}

/// Names of stages, and of steps of refining.
void leaveOut(const std::vector<std::string>& names, RenderSettings& settings) {
    for (const std::string& name : names) {
        const auto named = [&](const auto& info) { return info.name == name; };
        const auto all = stages();
        const auto stage = std::ranges::find_if(all, named);
        const auto step = std::ranges::find_if(refineSteps(), named);
        if (stage != all.end())
            settings.without.add(stage->stage);
        else if (step != refineSteps().end())
            settings.refine.set(step->step, false);
        else
            refuse("there is no stage '{}'; 'stx render --help' lists them", name);
    }
}

void takeLighting(const Keywords& given, Lighting& lighting) {
    given.take("lights", lighting.lights);
    if (const auto grey = given.find("ambient")) lighting.ambient = colourFrom(*grey, "ambient");
    if (const auto grey = given.find("specular")) lighting.specular = colourFrom(*grey, "specular");
    given.take("shininess", lighting.shininess);
    given.take("beyond_one", lighting.beyondOne);
    if (const auto ok = lighting.check(); !ok) refuse("{}", ok.error().message);
    if (lighting.on()) return;
    const Lighting usual;
    const char* unused = lighting.ambient != usual.ambient       ? "ambient"
                         : lighting.specular != usual.specular   ? "specular"
                         : lighting.shininess != usual.shininess ? "shininess"
                         : lighting.beyondOne                    ? "beyond_one"
                                                                 : nullptr;
    if (unused) refuse("{} is of lighting; give lights, too", unused);
}

}  // namespace

OpenOptions openOptionsFrom(const Keywords& given) {
    OpenOptions options;
    ImageSetOptions& set = options.set;
    given.take("texture", options.texture);
    // Of an image set it is the pattern of names.
    set.texturePattern = options.texture;
    given.take("materials", options.materials);
    given.take("from_", set.from);
    given.take("frame", set.frame);
    given.take("moving", set.moving);
    given.take("every", set.every);
    given.take("strict", set.strict);
    takeNumbers<2>(given, "depth_range", {&set.depthMin, &set.depthMax});
    given.take("depth_unit", set.depthUnit);
    given.take("depth", set.depthPattern);
    given.take("mask", set.maskPattern);
    if (given.find("no_depth")) {
        NoDepth value = NoDepth::empty;
        given.choose("no_depth", value, {{"empty", NoDepth::empty}, {"unknown", NoDepth::unknown}});
        set.noDepth = value;
    }
    given.take("focal", set.focal);
    given.take("baseline", set.baseline);
    takeNumbers<4>(
        given, "intrinsics",
        {&set.intrinsics[0], &set.intrinsics[1], &set.intrinsics[2], &set.intrinsics[3]});
    given.takeDegrees("fov", set.photo.fovRad);
    given.take("depth_bits", set.depthBits);
    given.take("deep_colour", set.deepColour);
    takeRefining(given, set.refine);
    return options;
}

GivenOptions givenFrom(const Keywords& given) {
    std::vector<std::string> names;
    given.take("given", names);
    GivenOptions options;
    for (std::string& name : names) {
        const bool ofMesh = name == "texture" || name == "materials";
        (ofMesh ? options.ofMeshes : options.ofSets).push_back(std::move(name));
    }
    return options;
}

SaveOptions saveOptionsFrom(int jpegQuality, std::optional<int> h264, bool noClobber) {
    if (jpegQuality < 0 || jpegQuality > 100)
        refuse("jpeg_quality is {}; 0 (PNG, exact) to 100 is expected", jpegQuality);
    if (h264 && (*h264 < 0 || *h264 > 51))
        refuse("h264 is {}; 0 (the best) to 51 is expected", *h264);
    SaveOptions options;
    options.jpegQuality = jpegQuality;
    options.h264 = h264.value_or(-1);
    options.noClobber = noClobber;
    return options;
}

ConvertSettings convertSettingsFrom(const Keywords& given) {
    ConvertSettings settings;
    given.take("views", settings.views);
    given.take("cameras", settings.cameras);
    given.take("names", settings.names);
    if (const auto size = given.find("size")) {
        const glm::ivec2 pixels = sizeFrom(*size, "size");
        settings.width = pixels.x;
        settings.height = pixels.y;
    }
    given.take("orthographic", settings.orthographic);
    given.takeDegrees("fov", settings.fovRad);
    given.takeDegrees("elevation", settings.elevationRad);
    given.take("supersampling", settings.supersampling);
    given.take("mesh_normals", settings.meshNormals);
    given.take("materials", settings.materials);
    given.take("title", settings.title);
    given.take("depth_bits", settings.depthBits);
    if (const auto up = given.find("up")) settings.up = vectorFrom(*up, "up");
    return settings;
}

BakeSettings bakeSettingsFrom(const Keywords& given) {
    BakeSettings settings;
    given.choose(
        "method", settings.method,
        {{"robust", BakeSettings::Method::robust}, {"paper", BakeSettings::Method::paper}});
    given.take("discontinuity", settings.discontinuity);
    given.take("keep_normals", settings.keepNormals);
    return settings;
}

PackSettings packSettingsFrom(const Keywords& given) {
    PackSettings settings;
    given.choose("layout", settings.layout,
                 {{"grid", PackSettings::Layout::grid}, {"tight", PackSettings::Layout::tight}});
    given.take("padding", settings.padding);
    given.take("max_size", settings.maxSize);
    return settings;
}

std::optional<PruneSettings> pruneSettingsFrom(const Keywords& given) {
    bool wanted = false;
    PruneSettings settings;
    given.take("prune", wanted);
    given.take("budget", settings.budget);
    if (settings.budget < 0) refuse("budget is {}; pixels from 1 are expected", settings.budget);
    if (!wanted && settings.budget == 0) return std::nullopt;
    return settings;
}

StillSettings stillSettingsFrom(const Keywords& given) {
    StillSettings settings;
    given.choose("method", settings.method,
                 {{"select", StillMethod::select},
                  {"n2pg", StillMethod::n2pg},
                  {"median", StillMethod::median}});
    given.take("frames", settings.frames);
    return settings;
}

RenderSettings renderSettingsFrom(const Keywords& given) {
    RenderSettings settings;
    given.choose("mode", settings.mode,
                 {{"surface", RenderMode::surface}, {"splat", RenderMode::splat}});
    given.choose("quality", settings.quality,
                 {{"normal", Quality::normal}, {"best", Quality::best}});
    given.choose(
        "splat", settings.splat,
        {{"data", SplatRule::data}, {"paper", SplatRule::paper}, {"point", SplatRule::point}});
    given.take("splat_coefficient", settings.splatCoefficient);
    if (!(settings.splatCoefficient >= 0 && std::isfinite(settings.splatCoefficient)))
        refuse("splat_coefficient is {:g}; 0 or more is expected", settings.splatCoefficient);
    given.choose(
        "fill", settings.fill,
        {{"background", Fill::background}, {"spatial", Fill::spatial}, {"none", Fill::none}});
    given.take("normals", settings.normals);
    takeRefining(given, settings.refine);
    if (settings.refine.on(RefineStep::poses))
        refuse("the step 'poses' moves cameras, and pictures are drawn where they are");
    std::vector<std::string> without;
    given.take("without", without);
    leaveOut(without, settings);
    // Who asks for another background does not want the model's own.
    settings.ownEnvironment = settings.fill == Fill::background;
    // A file is opened by who makes the renderer.
    if (const auto own = given.find("environment"); own && py::isinstance<py::bool_>(*own))
        given.take("environment", settings.ownEnvironment);
    takeLighting(given, settings.lighting);
    return settings;
}

Backend backendFrom(const Keywords& given) {
    Backend backend = Backend::automatic;
    given.choose("backend", backend,
                 {{"auto", Backend::automatic},
                  {"gpu", Backend::gpu},
                  {"gl", Backend::gl},
                  {"cpu", Backend::cpu}});
    return backend;
}

}  // namespace stx::python
