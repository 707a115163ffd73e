#include "tests/sweep/sweep_case.hpp"

#include <charconv>

#include <fmt/format.h>
#include <glm/gtc/constants.hpp>

#include "lib/geometry/view_layout.hpp"
#include "tests/sweep/random.hpp"

using namespace stx;

namespace {

constexpr std::array<const char*, SweepCase::kShapes> kShapeNames{"ball",  "box",  "torus", "cone",
                                                                  "plate", "bars", "room",  "pair"};
constexpr std::array<const char*, SweepCase::kLayouts> kLayoutNames{
    "cube", "ring", "sphere", "octahedral", "hemi-octahedral", "rig"};

/// Reference pixels of a case at most: what keeps a case below a second.
constexpr std::int64_t kMostPixels = 600'000;

int viewCount(const SweepCase& c) {
    switch (c.layout) {
        case SweepCase::cube:
            return 6;
        case SweepCase::octahedral:
        case SweepCase::hemiOctahedral:
            return c.views * c.views;
        default:
            return c.views;
    }
}

glm::dquat randomTurn(Random& random) {
    const double u = random.unit(), a = random.between(0, glm::two_pi<double>()),
                 b = random.between(0, glm::two_pi<double>());
    return {std::sqrt(1 - u) * std::sin(a), std::sqrt(1 - u) * std::cos(a),
            std::sqrt(u) * std::sin(b), std::sqrt(u) * std::cos(b)};
}

Scene sceneOf(const SweepCase& c) {
    Random random(c.seed * 7919 + static_cast<std::uint64_t>(c.number) + 17);
    const glm::dquat turn = c.turned ? randomTurn(random) : glm::dquat(1, 0, 0, 0);
    Scene scene;
    scene.waves = c.waves;
    const auto add = [&](Solid::Kind kind, glm::dvec3 size, glm::dvec3 centre = glm::dvec3(0)) {
        scene.solids.push_back({kind, centre, turn, size});
    };
    const double half = c.thickness / 2;
    switch (c.shape) {
        case SweepCase::ball:
            add(Solid::Kind::ball, glm::dvec3(1));
            break;
        case SweepCase::box:
            add(Solid::Kind::box, {0.8, 0.6, 0.5});
            break;
        case SweepCase::torus:
            add(Solid::Kind::torus, {0.72, 0.28, 0});
            break;
        case SweepCase::cone:
            add(Solid::Kind::cone, {0.8, 0.8, 0});
            break;
        case SweepCase::plate:
            add(Solid::Kind::box, {0.8, half, 0.6});
            break;
        case SweepCase::bars:
            add(Solid::Kind::box, {0.9, half, half});
            add(Solid::Kind::box, {half, 0.9, half});
            add(Solid::Kind::box, {half, half, 0.9});
            break;
        case SweepCase::room:
            scene.solids.push_back(
                {Solid::Kind::room, glm::dvec3(0), glm::dquat(1, 0, 0, 0), {3, 2, 4}});
            add(Solid::Kind::ball, glm::dvec3(0.6), {-0.8, -0.7, -1.6});
            add(Solid::Kind::box, {0.4, 0.7, 0.4}, {1.0, -0.9, -2.2});
            break;
        case SweepCase::pair:
            add(Solid::Kind::ball, glm::dvec3(0.5), {-0.5, 0.1, 0.3});
            add(Solid::Kind::box, {0.35, 0.5, 0.3}, {0.55, 0.0, -0.2});
            break;
        default:
            break;
    }
    return scene;
}

Result<Camera> perspectiveAt(glm::dvec3 eye, glm::dvec3 target, double focal, int width,
                             int height) {
    Camera camera;
    camera.position = eye;
    STX_TRY(camera.orientation, lookAt(eye, target));
    camera.width = width;
    camera.height = height;
    camera.fx = camera.fy = focal;
    camera.cx = width * 0.5;
    camera.cy = height * 0.5;
    return camera;
}

/// Parallel cameras side by side, two rows where there are more than four; they look along -Z.
Result<std::vector<Camera>> rigCameras(const SweepCase& c) {
    std::vector<Camera> out;
    const int rows = c.views > 4 ? 2 : 1, columns = (c.views + rows - 1) / rows;
    for (int i = 0; i < c.views; ++i) {
        const glm::dvec3 eye((i % columns - 0.5 * (columns - 1)) * 0.25,
                             (i / columns - 0.5 * (rows - 1)) * 0.25,
                             c.shape == SweepCase::room ? 2.6 : 3.2);
        STX_TRY(const Camera camera,
                perspectiveAt(eye, eye - glm::dvec3(0, 0, 1), 1.2 * std::max(c.width, c.height),
                              c.width, c.height));
        out.push_back(camera);
    }
    return out;
}

Result<std::vector<Camera>> referenceCameras(const SweepCase& c, const Scene& scene) {
    if (c.layout == SweepCase::rig) return rigCameras(c);
    ViewLayout layout;
    layout.kind = std::array{ViewLayout::Kind::cube, ViewLayout::Kind::ring,
                             ViewLayout::Kind::sphere, ViewLayout::Kind::octahedral,
                             ViewLayout::Kind::hemiOctahedral}[static_cast<std::size_t>(c.layout)];
    layout.count = c.views;
    layout.elevationRad = glm::radians(c.elevation);
    ViewFraming framing;
    framing.width = c.width;
    framing.height = c.height;
    framing.orthographic = c.orthographic != 0;
    return layoutCameras(layout, framing, scene.points());
}

/// Scene units between the texels of the reference view that sees the place best.
double texelAt(const std::vector<Camera>& cameras, glm::dvec3 place) {
    double finest = 1e300;
    for (const Camera& camera : cameras) {
        const double dist = glm::dot(place - camera.position, camera.forward());
        if (dist > 0) finest = std::min(finest, camera.sampleSpacing(dist).x);
    }
    return finest;
}

/// -1 to 1, and 0 of 0: the fraction of `x` to both sides.
double aside(double x) {
    return 2 * (x - std::round(x));
}

Result<Camera> novelCamera(const SweepCase& c, const Scene& scene,
                           const std::vector<Camera>& cameras) {
    Random random(c.seed * 104729 + static_cast<std::uint64_t>(c.number) + 5);
    const bool rig = c.layout == SweepCase::rig;
    // The golden section and the root of 2 spread any number of places evenly.
    constexpr double kWithin = 15;  // degrees
    const double a = glm::radians(c.azimuth + kWithin * aside(c.beside * 0.618034)),
                 e = glm::radians(c.altitude + kWithin * aside(c.beside * 0.414214));
    const glm::dvec3 away(std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a));
    glm::dvec3 eye;
    if (rig) {
        glm::dvec3 middle(0);
        for (const Camera& camera : cameras) middle += camera.position;
        middle /= double(cameras.size());
        // Within the cameras of the rig and a little around them.
        eye = middle + glm::dvec3(away.x * 0.2, away.y * 0.1, -0.6 * (c.distance - 1));
    } else {
        eye = away * (glm::length(cameras[0].position) * c.distance);
    }
    // Something that is seen, a little beside the middle.
    glm::dvec3 target = rig ? eye + glm::dvec3(0, 0, -4) : glm::dvec3(0);
    target +=
        glm::dvec3(random.between(-0.3, 0.3), random.between(-0.3, 0.3), random.between(-0.3, 0.3));
    const Hit hit = scene.trace(eye, glm::normalize(target - eye));
    const glm::dvec3 place = hit.any() ? hit.point : glm::dvec3(0);
    const double dist = glm::length(place - eye);
    const double pixel = texelAt(cameras, place) / c.magnification;
    STX_TRY(Camera camera, perspectiveAt(eye, target, dist / pixel, c.outWidth, c.outHeight));
    if (c.outOrthographic) {
        camera.orthographic = true;
        camera.fx = camera.fy = 1 / pixel;
    }
    return camera;
}

}  // namespace

const std::vector<SweepCase::Field>& SweepCase::fields() {
    static const std::vector<Field> kFields{
        {"shape", &SweepCase::shape},
        {"turned", &SweepCase::turned},
        {"thickness", nullptr, &SweepCase::thickness},
        {"waves", nullptr, &SweepCase::waves},
        {"layout", &SweepCase::layout},
        {"views", &SweepCase::views},
        {"width", &SweepCase::width},
        {"height", &SweepCase::height},
        {"orthographic", &SweepCase::orthographic},
        {"off-centre", &SweepCase::offCentre},
        {"elevation", nullptr, &SweepCase::elevation},
        {"depth-bits", &SweepCase::depthBits},
        {"out-width", &SweepCase::outWidth},
        {"out-height", &SweepCase::outHeight},
        {"out-orthographic", &SweepCase::outOrthographic},
        {"magnification", nullptr, &SweepCase::magnification},
        {"azimuth", nullptr, &SweepCase::azimuth},
        {"altitude", nullptr, &SweepCase::altitude},
        {"distance", nullptr, &SweepCase::distance},
        {"beside", &SweepCase::beside},
    };
    return kFields;
}

SweepCase SweepCase::draw(std::uint64_t seed, int number) {
    Random random(seed * 1'000'003 + static_cast<std::uint64_t>(number));
    SweepCase c;
    c.seed = seed;
    c.number = number;
    c.shape = random.whole(0, kShapes - 1);
    c.turned = random.chance(0.7);
    c.waves = random.logBetween(1, 16);
    c.layout = c.shape == room ? static_cast<int>(rig) : random.whole(0, kLayouts - 1);
    switch (c.layout) {
        case octahedral:
        case hemiOctahedral:
            c.views = random.whole(2, 6);
            break;
        default:
            c.views = static_cast<int>(std::round(random.logBetween(2, 40)));
    }
    const double side = random.logBetween(16, 512), aspect = random.logBetween(0.7, 1.4);
    c.width = static_cast<int>(std::round(side * std::sqrt(aspect)));
    c.height = static_cast<int>(std::round(side / std::sqrt(aspect)));
    const double pixels = double(c.width) * c.height * viewCount(c);
    if (pixels > kMostPixels) {
        const double smaller = std::sqrt(kMostPixels / pixels);
        c.width = std::max(16, static_cast<int>(c.width * smaller));
        c.height = std::max(16, static_cast<int>(c.height * smaller));
    }
    c.orthographic = c.layout != rig && random.chance(0.4);
    c.offCentre = random.chance(0.3);
    c.elevation = random.between(-10, 60);
    c.depthBits = random.chance(0.3) ? 16 : 32;
    // From slivers of two texels to slabs.
    c.thickness = std::min(0.4, 2.0 / std::min(c.width, c.height) * random.between(2, 8));
    const double outSide = random.logBetween(40, 160);
    c.outWidth = static_cast<int>(outSide * random.logBetween(0.8, 1.3));
    c.outHeight = static_cast<int>(outSide);
    c.outOrthographic = c.shape != room && random.chance(0.15);
    c.magnification = random.logBetween(0.2, 10);
    c.azimuth = random.between(-180, 180);
    c.altitude = c.layout == hemiOctahedral ? random.between(0, 80) : random.between(-60, 80);
    if (c.layout == ring) c.altitude = c.elevation + random.between(-25, 25);
    c.distance = random.between(0.7, 1.6);
    return c;
}

Result<void> SweepCase::set(std::string_view change) {
    const auto sign = change.find('=');
    const std::string_view name = change.substr(0, sign);
    for (const Field& field : fields()) {
        if (name != field.name || sign == std::string_view::npos) continue;
        const std::string_view text = change.substr(sign + 1);
        double value = 0;
        if (std::from_chars(text.data(), text.data() + text.size(), value).ec != std::errc())
            return fail(ErrorCode::usage, "'{}' is not a number", text);
        if (field.whole)
            this->*field.whole = static_cast<int>(value);
        else
            this->*field.number = value;
        return {};
    }
    return fail(ErrorCode::usage, "no field of a case is called '{}'", name);
}

std::string SweepCase::changes() const {
    const SweepCase drawn = draw(seed, number);
    std::string out;
    for (const Field& field : fields()) {
        const bool same = field.whole ? this->*field.whole == drawn.*field.whole
                                      : this->*field.number == drawn.*field.number;
        if (same) continue;
        if (!out.empty()) out += ",";
        out += field.whole ? fmt::format("{}={}", field.name, this->*field.whole)
                           : fmt::format("{}={}", field.name, this->*field.number);
    }
    return out;
}

std::string SweepCase::describe() const {
    std::string out = kShapeNames[static_cast<std::size_t>(shape)];
    if (shape == plate || shape == bars) out += fmt::format(" {:.3f} thick", thickness);
    out += fmt::format(", {}", kLayoutNames[static_cast<std::size_t>(layout)]);
    if (layout != cube) out += fmt::format(":{}", views);
    out += fmt::format(" of {}x{}", width, height);
    if (orthographic) out += " orthographic";
    if (offCentre) out += ", off centre";
    out += fmt::format(", {} bits, drawn at {}x{}{}, a texel {:.2f} pixels wide", depthBits,
                       outWidth, outHeight, outOrthographic ? " orthographic" : "", magnification);
    return out;
}

std::vector<SweepCase> SweepCase::besides() const {
    std::vector<SweepCase> out(kBesides, *this);
    for (int i = 0; i < kBesides; ++i) out[static_cast<std::size_t>(i)].beside = beside + i + 1;
    return out;
}

std::vector<SweepCase> SweepCase::simpler() const {
    std::vector<SweepCase> out;
    const auto with = [&](auto change) {
        SweepCase simple = *this;
        change(simple);
        if (simple.changes() != changes()) out.push_back(simple);
    };
    if (layout != cube) {
        with([](SweepCase& c) { c.views = std::max(2, c.views / 2); });
        with([](SweepCase& c) { c.views = std::max(2, c.views - 1); });
    }
    with([](SweepCase& c) {
        c.width = std::max(16, c.width / 2);
        c.height = std::max(16, c.height / 2);
    });
    with([](SweepCase& c) {
        c.outWidth = std::max(32, c.outWidth / 2);
        c.outHeight = std::max(32, c.outHeight / 2);
    });
    with([](SweepCase& c) { c.offCentre = 0; });
    with([](SweepCase& c) { c.turned = 0; });
    with([](SweepCase& c) { c.depthBits = 32; });
    with([](SweepCase& c) { c.outOrthographic = 0; });
    with([](SweepCase& c) { c.waves = 1; });
    with([](SweepCase& c) { c.width = c.height = std::min(c.width, c.height); });
    return out;
}

Result<Captured> capturedOf(const SweepCase& c) {
    Captured captured;
    captured.from = c;
    captured.scene = sceneOf(c);
    STX_TRY(std::vector<Camera> cameras, referenceCameras(c, captured.scene));
    STX_TRY(captured.novel, novelCamera(c, captured.scene, cameras));
    Random random(c.seed * 31337 + static_cast<std::uint64_t>(c.number) + 3);
    // Where outlines fall between the pixels of the views is luck, and the same in all views of a
    // rig along a straight edge: other eyes get views whose pixels lie elsewhere.
    const glm::dvec2 phase =
        0.5 * glm::dvec2(aside(c.beside * 0.754878), aside(c.beside * 0.569840));
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        cameras[i].cx += phase.x;
        cameras[i].cy += phase.y;
        const double dx = random.between(-0.15, 0.15), dy = random.between(-0.15, 0.15);
        if (c.offCentre) {
            cameras[i].cx += dx * cameras[i].width;
            cameras[i].cy += dy * cameras[i].height;
        }
        captured.bundle.views.push_back(look(captured.scene, cameras[i]));
        captured.bundle.views.back().name = fmt::format("view{}", i);
        if (c.depthBits == 32) continue;
        ReferenceView& view = captured.bundle.views.back();
        view.depthBits = c.depthBits;
        for (float& depth : view.depth.pixels())
            if (hasPoint(depth)) depth = view.depthCode().decode(view.depthCode().encode(depth));
    }
    captured.truth = look(captured.scene, captured.novel);
    return captured;
}
