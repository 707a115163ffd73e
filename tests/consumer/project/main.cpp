// A program of somebody else: `use_stx MODEL.obj PICTURE.png PICTURE.tif FORBIDDEN...` does with
// the library what use.sh did with the program, and compares. Nothing may be loaded from FORBIDDEN.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include <stx/stx.hpp>

namespace {

void require(bool holds, const std::string& what) {
    if (holds) return;
    std::fprintf(stderr, "use_stx: %s\n", what.c_str());
    std::exit(1);
}

template <class T>
T valueOf(stx::Result<T> result) {
    require(result.has_value(), result ? "" : result.error().text());
    if constexpr (!std::is_void_v<T>) return std::move(*result);
}

/// A bundle whose first camera moves.
class Moving : public stx::Sequence {
  public:
    explicit Moving(stx::Bundle bundle) : bundle_(std::move(bundle)) {
        timeline_ = stx::steadyTimeline(3, 25);
    }
    stx::Result<stx::Bundle> frame(std::size_t index, stx::Job&) override {
        auto out = bundle_;
        out.views[0].camera.position.x += 0.1 * static_cast<double>(index);
        out.time = timeline_.times[index];
        return out;
    }

  private:
    stx::Bundle bundle_;
};

}  // namespace

int main(int argc, char** argv) {
    require(argc >= 4, "usage: use_stx MODEL PNG TIFF FORBIDDEN...");
    require(std::string(stx::version()).size() >= 5, "no version");
    stx::Job job;

    stx::ConvertSettings settings;
    settings.views = "sphere:6";
    settings.width = settings.height = 128;
    settings.title = "amphora";
    auto bundle = valueOf(stx::convert(valueOf(stx::open(argv[1], {}, job)), settings, job));
    valueOf(stx::bake(bundle, {}, job));
    valueOf(stx::save(bundle, "library.exr", {}, job));
    require(valueOf(stx::validateFile("library.exr", {}, job)).empty(),
            "library.exr breaks a rule");

    const auto atlas = valueOf(stx::pack(bundle, {}, job));
    require(atlas.textureCount() <= 4, "more than four textures");
    valueOf(stx::save(atlas, "library_atlas", {}, job));
    const auto opened = valueOf(stx::open("library_atlas", {}, job));
    require(std::holds_alternative<stx::Atlas>(opened), "library_atlas is not an atlas");

    stx::CameraSettings lens;
    lens.width = 160;
    lens.height = 120;
    const auto camera = valueOf(stx::cameraAt({1.5, 1.2, 2.5}, {0, 0.5, 0}, lens));
    const auto frame = valueOf(stx::render(opened, camera, {}, job));
    valueOf(stx::save(frame, "library.png", {.background = glm::vec3(0)}, job));
    const auto picture = stx::pictureOf(frame, glm::vec3(0));

    // TIFF needs the module of codecs.
    for (const char* path : {argv[2], argv[3]}) {
        const auto comparison =
            valueOf(stx::compare(picture, valueOf(stx::openPicture(path, job)), {}, job));
        require(comparison.identical(), std::string("the picture differs from ") + path);
        require(comparison.pixels == 160 * 120, "not all pixels were compared");
    }

    // Several pictures, drawn by one renderer that keeps the model.
    const auto sphere = stx::boundsOf(opened);
    stx::OrbitSettings half;
    half.count = 3;
    half.arcRad = 3.1;
    half.distance = 4;
    if (valueOf(stx::orbitCameras(sphere.centre(), sphere.radius(), half, lens)).size() != 3)
        return 1;
    const auto orbit = valueOf(stx::orbitCameras(sphere.centre(), sphere.radius(), 2, 0.3, lens));
    const auto renderer = valueOf(stx::rendererOf(opened, {}, job, stx::Backend::cpu));
    const auto sharing = valueOf(
        stx::rendererOf(std::make_shared<const stx::Model>(opened), {}, job, stx::Backend::cpu));
    for (const auto& c : orbit)
        require(valueOf(renderer->render(c)).colour == valueOf(sharing->render(c)).colour,
                "a shared model gives another picture");
    require(stx::alignedCamera(opened, orbit[0]) == orbit[0], "a camera moved beside exact views");
    require(stx::upOf(opened) == glm::dvec3(0, 1, 0), "the atlas does not stand on +Y");

    // Three frames, of which each has the camera a little farther on.
    auto film = stx::someFrames(stx::changed(std::make_unique<Moving>(bundle),
                                             [](stx::Bundle& frame, stx::Job&) {
                                                 frame.title = "a film";
                                                 return stx::Result<void>();
                                             }),
                                {0, 1, 2});
    valueOf(stx::save(*valueOf(std::move(film)), "library.mp4", {}, job));
    const auto again = valueOf(stx::openSequence("library.mp4", {}, job));
    require(again->timeline().count() == 3, "a film of another length");
    const auto late = valueOf(again->frame(again->timeline().frameAt(0.9), job));
    require(late.views[0].camera.position.x > bundle.views[0].camera.position.x + 0.19,
            "the film's camera stands still");

    // What is behind everything that passes.
    auto behind = stx::background(valueOf(stx::openSequence("library.mp4", {}, job)), {}, job);
    require(valueOf(valueOf(std::move(behind))->frame(0, job)).views.size() > late.views.size(),
            "no background");
    const std::vector<std::filesystem::path> pictures{argv[2], argv[2]};
    require(valueOf(stx::background(pictures, {}, job)).colour.width() == 160, "no background");

    require(stx::open("missing.obj", {}, job).error().code == stx::ErrorCode::io,
            "a missing file is not an io error");

    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
        for (int i = 4; i < argc; ++i)
            require(line.find(argv[i]) == std::string::npos, "loaded from elsewhere: " + line);
    }
}
