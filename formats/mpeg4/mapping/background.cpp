#include "formats/mpeg4/mapping/background.hpp"

#include <cmath>

#include <glm/gtc/constants.hpp>

#include "formats/mpeg4/mapping/new_document.hpp"
#include "formats/mpeg4/mapping/scene_timeline.hpp"
#include "formats/mpeg4/mapping/texture_images.hpp"
#include "lib/environment/environment_map.hpp"

namespace stx::mpeg4 {
namespace {

constexpr std::array kUrlFields = {"frontUrl", "backUrl", "leftUrl",
                                   "rightUrl", "topUrl",  "bottomUrl"};

/// Colours and as many angles as belong to them; what is wrong is left out and told.
void readGradient(const Node& node, const char* what, std::vector<glm::vec3>& colours,
                  std::vector<double>& angles, Job& job) {
    const auto& stored = node.get<std::vector<Color>>(fmt::format("{}Color", what));
    const auto& steps = node.get<std::vector<float>>(fmt::format("{}Angle", what));
    const auto finite = [](const Color& c) { return std::isfinite(c.r + c.g + c.b); };
    for (const Color& c : stored) {
        if (!finite(c)) break;
        colours.emplace_back(c.r, c.g, c.b);
    }
    for (const float angle : steps) {
        const bool rises = std::isfinite(angle) && angle >= (angles.empty() ? 0 : angles.back()) &&
                           angle <= 3.1416f;
        if (!rises || angles.size() + 1 >= colours.size()) break;
        angles.push_back(angle);
    }
    if (colours.size() > angles.size() + 1) colours.resize(angles.size() + 1);
    if (colours.size() < stored.size() || angles.size() < steps.size())
        job.note(fmt::format(
            "{}Color and {}Angle of the Background do not belong together (one angle less than "
            "colours, rising); {} of {} colours are read",
            what, what, colours.size(), stored.size()));
}

/// The mean colour, sRGB-coded, of the uppermost (side 1) or lowest (-1) bands that show something:
/// as many as cover half a band. Nothing where all is transparent.
std::optional<glm::vec3> poleColour(const EnvironmentMap& map, int side) {
    constexpr int kBands = 36, kAround = 72;
    glm::vec4 sum(0.0f);
    for (int band = 0; band < kBands && sum.a <= 0.5f * kAround; ++band) {
        for (int i = 0; i < kAround; ++i) {
            const glm::dvec3 d = latlongDirection({(i + 0.5) / kAround, (band + 0.5) / kBands});
            sum += map.sampleTurned(glm::vec3(d.x, side * d.y, d.z), 0.05f, true);
        }
    }
    if (!(sum.a > 0.0f)) return {};
    const glm::vec3 light = glm::vec3(sum) / sum.a;
    return glm::vec3(srgbFromLinear(light.r), srgbFromLinear(light.g), srgbFromLinear(light.b));
}

void setGradient(Node& node, const char* what, const std::vector<glm::vec3>& colours,
                 const std::vector<double>& angles) {
    if (colours.empty()) return;
    std::vector<Color> list;
    list.reserve(colours.size());
    for (const glm::vec3& c : colours) list.push_back({c.r, c.g, c.b});
    node.set(fmt::format("{}Color", what), std::move(list));
    if (!angles.empty())
        node.set(fmt::format("{}Angle", what), std::vector<float>(angles.begin(), angles.end()));
}

Result<Environment> environmentFrom(const ShownBackground& background, const StreamImages& images,
                                    const ImageDecoder& decode, Job& job) {
    Environment environment;
    environment.orientation = glm::normalize(background.worldFromLocal);
    const Node& node = *background.node;
    readGradient(node, "sky", environment.skyColours, environment.skyAngles, job);
    readGradient(node, "ground", environment.groundColours, environment.groundAngles, job);
    environment.pictures.resize(6);
    std::uint64_t pixels = 0;
    for (std::size_t f = 0; f < 6; ++f) {
        STX_CHECK(job.checkCancelled());
        const NodePtr texture = faceTexture(node, static_cast<CubeFace>(f));
        if (!texture) continue;
        const auto read = [&]() -> Result<Rgba8Image> {
            if (const auto info = images.probe(*texture)) {
                pixels += static_cast<std::uint64_t>(info->width) *
                          static_cast<std::uint64_t>(info->height);
                STX_CHECK(job.limits.checkAllocation(pixels, 4, "the Background's pictures"));
            }
            STX_TRY(const auto decoded, images.decode(*texture, decode, job.limits));
            if (!decoded.colourNote.empty()) job.noteOnce(decoded.colourNote);
            return rgba8From(decoded);
        };
        auto image = read();
        if (!image) {
            job.note(fmt::format("the {} of the Background cannot be read and is left out: {}",
                                 kUrlFields[f], image.error().text()));
            continue;
        }
        if (image->width() != image->height())
            job.note(
                fmt::format("the {} of the Background is {}x{}; a face of a cube is square, so "
                            "it is stretched",
                            kUrlFields[f], image->width(), image->height()));
        environment.pictures[f] = Texture(std::move(*image));
    }
    if (environment.pictureCount() == 0) environment.pictures.clear();
    return environment;
}

}  // namespace

NodePtr faceTexture(const Node& background, CubeFace face) {
    const auto& urls = background.get<std::vector<Url>>(kUrlFields[static_cast<std::size_t>(face)]);
    if (urls.empty()) return nullptr;
    NodePtr texture = makeNode("ImageTexture");
    texture->set("url", urls);
    return texture;
}

Result<std::shared_ptr<const Environment>> boundEnvironment(
    const std::vector<ShownBackground>& backgrounds, const StreamImages& images,
    const ImageDecoder& decode, Job& job) {
    std::shared_ptr<const Environment> none;
    if (backgrounds.empty()) return none;
    if (backgrounds.size() > 1)
        job.note(
            fmt::format("the scene has {} Backgrounds; the first is shown", backgrounds.size()));
    STX_TRY(auto environment, environmentFrom(backgrounds.front(), images, decode, job));
    if (const auto sound = environment.check(); !sound) {
        job.note(fmt::format("the Background is left out: {}", sound.error().text()));
        return none;
    }
    return std::make_shared<const Environment>(std::move(environment));
}

Result<NodePtr> backgroundFromEnvironment(const Environment& environment,
                                          const SceneWriteOptions& options,
                                          UpdateObjectDescriptors& update, Job& job) {
    STX_CHECK(environment.check());
    const int size = cubeSizeOf(environment);
    Environment cube = environment;
    if (environment.layout == Environment::Layout::equirectangular &&
        environment.pictureCount() > 0) {
        STX_TRY(cube, asCube(environment, size, job.limits));
        job.note(fmt::format(
            "the environment of {}x{} becomes the six faces of a Background, {}x{} each",
            environment.pictures[0].width(), environment.pictures[0].height(), size, size));
    }
    NodePtr node = makeNode("Background");
    bool clamped = false, opaque = cube.pictureCount() == 6, alphaLost = false;
    if (static_cast<int>(update.descriptors.size()) + cube.pictureCount() >
        kLastImageOd - kFirstImageOd + 1)
        return fail(ErrorCode::unsupported,
                    "the pictures of the environment find no object descriptor: MPEG-4 has {} "
                    "(select fewer views, or write .exr)",
                    kLastImageOd - kFirstImageOd + 1);
    for (std::size_t f = 0; f < cube.pictures.size(); ++f) {
        STX_CHECK(job.checkCancelled());
        if (cube.pictures[f].empty()) continue;
        const Rgba8Image image = rgba8FromTexture(cube.pictures[f], clamped);
        const bool solid = isOpaque(Texture(image));
        opaque = opaque && solid;
        Bytes bytes;
        if (options.texture == SceneWriteOptions::Texture::jpeg) {
            alphaLost = alphaLost || !solid;
            STX_TRY(bytes, colourJpeg(image, options.jpegQuality));
        } else {
            STX_TRY(bytes, colourPng(image, !solid));
        }
        const Url url = addPictureStream(update, fmt::format("environment_{}", kCubeFaceNames[f]),
                                         std::move(bytes));
        node->set(kUrlFields[f], std::vector{url});
    }
    if (alphaLost) job.note("JPEG has no alpha: the environment's pictures are opaque");
    if (environment.linear())
        job.note(clamped ? "the environment's linear light becomes 8-bit sRGB; values above 1 are "
                           "clipped"
                         : "the environment's linear light becomes 8-bit sRGB");
    if (!opaque && cube.skyColours.empty() && cube.pictureCount() > 0) {
        STX_TRY(const auto map, EnvironmentMap::make(environment, job.limits));
        const auto sky = poleColour(*map, 1), ground = poleColour(*map, -1);
        if (sky) cube.skyColours = {*sky};
        if (ground && cube.groundColours.empty()) {
            cube.groundColours = {*ground, *ground};
            cube.groundAngles = {glm::half_pi<double>()};
        }
        job.note(
            "a Background is opaque: where the environment shows nothing, the mean colours around "
            "its upper and lower end do");
    }
    setGradient(*node, "sky", cube.skyColours, cube.skyAngles);
    setGradient(*node, "ground", cube.groundColours, cube.groundAngles);
    const glm::vec4 turn(axisAngleFromQuat(environment.orientation));
    if (turn.w == 0.0f) return node;
    NodePtr transform = makeNode("Transform");
    transform->set("rotation", Rotation{glm::vec3(turn), turn.w});
    transform->set("children", NodeList{node});
    return transform;
}

Result<Document> sceneFromEnvironment(const Environment& environment,
                                      const SceneWriteOptions& options, Job& job) {
    UpdateObjectDescriptors update;
    STX_TRY(NodePtr background, backgroundFromEnvironment(environment, options, update, job));
    NodePtr worldInfo = makeNode("WorldInfo");
    worldInfo->set("info", std::vector<std::string>{kMadeByUs});
    NodePtr navigation = makeNode("NavigationInfo");
    navigation->set("type", std::vector<std::string>{"EXAMINE", "ANY"});
    NodePtr root = makeNode("Group");
    root->set("children", NodeList{worldInfo, background, navigation});
    return newDocument(std::move(root), std::move(update), {512, 512});
}

Result<std::shared_ptr<const Environment>> environmentFromScene(const Document& document,
                                                                const SceneReadOptions& options,
                                                                Job& job) {
    std::shared_ptr<const Environment> none;
    if (document.frames.empty()) return none;
    STX_TRY(const auto images, StreamImages::make(document, options.folder, job.limits));
    STX_TRY(const auto scene, sceneAtStart(document, images, options.timesFromStart));
    STX_TRY(const auto shown, shownScene(scene.root, job.limits));
    return boundEnvironment(shown.backgrounds, images, options.decode, job);
}

}  // namespace stx::mpeg4
