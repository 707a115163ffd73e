#include <cmath>

#include "formats/exr/bundle_exr.hpp"
#include "formats/files/text_numbers.hpp"

namespace stx {

namespace {

/// Our camera space looks along -Z, OpenEXR's (RenderMan's) along +Z; both have x right, y up.
const glm::dmat4 kFlipZ(glm::dvec4(1, 0, 0, 0), glm::dvec4(0, 1, 0, 0), glm::dvec4(0, 0, -1, 0),
                        glm::dvec4(0, 0, 0, 1));

/// NDC of OpenEXR: (0, 0) and (1, 1) are the display window's upper left and lower right corners.
glm::dmat4 ndcFromExrCamera(const Camera& c, glm::dvec2 display, double nearPlane,
                            double farPlane) {
    glm::dmat4 m(0.0);  // m[column][row]
    const double range = farPlane - nearPlane;
    m[0][0] = c.fx / display.x;
    m[1][1] = -c.fy / display.y;
    if (c.orthographic) {
        m[3][0] = c.cx / display.x;
        m[3][1] = c.cy / display.y;
        m[2][2] = 1.0 / range;
        m[3][2] = -nearPlane / range;
        m[3][3] = 1.0;
    } else {
        m[2][0] = c.cx / display.x;
        m[2][1] = c.cy / display.y;
        m[2][2] = farPlane / range;
        m[3][2] = -farPlane * nearPlane / range;
        m[2][3] = 1.0;
    }
    return m;
}

Result<Camera> cameraFromStandard(const ExrPart& part) {
    const auto* matrix = part.attribute<glm::dmat4>("worldToCamera");
    if (!matrix)
        return fail(ErrorCode::invalidInput,
                    "part '{}' has no camera: neither stx:position nor worldToCamera is there",
                    part.name);
    const glm::dmat4 cameraFromWorld = kFlipZ * *matrix;
    const glm::dmat3 rotation(cameraFromWorld);
    const glm::dmat3 unit = rotation * glm::transpose(rotation);
    for (int c = 0; c < 3; ++c) {
        for (int r = 0; r < 3; ++r) {
            if (!(std::abs(unit[c][r] - (c == r ? 1.0 : 0.0)) < 1e-3))
                return fail(ErrorCode::invalidInput,
                            "part '{}': worldToCamera scales or shears; only rotation and shift "
                            "are possible",
                            part.name);
        }
    }
    if (glm::determinant(rotation) < 0)
        return fail(ErrorCode::invalidInput, "part '{}': worldToCamera mirrors the world",
                    part.name);
    Camera c;
    c.orientation = glm::normalize(glm::quat_cast(glm::transpose(rotation)));
    c.position = -(glm::transpose(rotation) * glm::dvec3(cameraFromWorld[3]));
    c.width = part.width;
    c.height = part.height;
    if (!(part.screenWindowWidth > 0) || !(part.pixelAspectRatio > 0))
        return fail(ErrorCode::invalidInput,
                    "part '{}': screenWindowWidth is {:g} and pixelAspectRatio {:g}; both must be "
                    "positive",
                    part.name, part.screenWindowWidth, part.pixelAspectRatio);
    c.fx = part.displayWidth / part.screenWindowWidth;
    c.fy = c.fx * part.pixelAspectRatio;
    c.cx = part.displayWidth / 2.0 - part.screenWindowCenter.x * c.fx - part.originX;
    c.cy = part.displayHeight / 2.0 + part.screenWindowCenter.y * c.fy - part.originY;
    if (const auto* ndc = part.attribute<glm::dmat4>("worldToNDC")) {
        // The divisor of a perspective depends on the point.
        const glm::dmat4& m = *ndc;
        c.orthographic = m[0][3] == 0 && m[1][3] == 0 && m[2][3] == 0 && m[3][3] != 0;
    }
    return c;
}

}  // namespace

void setExrCamera(ExrPart& part, const Camera& c, double nearPlane, double farPlane) {
    const glm::dvec2 display(part.displayWidth, part.displayHeight);
    const glm::dmat4 exrCameraFromWorld = kFlipZ * c.cameraFromWorld();
    part.screenWindowWidth = display.x / c.fx;
    // Where the parts' aspects differ, the one that the file can hold counts for other programs,
    // too.
    part.screenWindowCenter = {(display.x / 2 - c.cx) / c.fx,
                               (c.cy - display.y / 2) / (c.fx * part.pixelAspectRatio)};
    part.attributes["worldToCamera"] = exrCameraFromWorld;
    part.attributes["worldToNDC"] =
        ndcFromExrCamera(c, display, nearPlane, farPlane) * exrCameraFromWorld;
}

void setExrCamera(ExrPart& part, const ReferenceView& view) {
    const Camera& c = view.camera;
    setExrCamera(part, c, view.nearPlane, view.farPlane);
    auto& a = part.attributes;
    const glm::dvec4 axisAngle = axisAngleFromQuat(c.orientation);
    a["stx:position"] = c.position;
    // For people and other programs, as SFRotation; the quaternion is what comes back exactly.
    a["stx:orientation"] =
        fmt::format("{} {} {} {}", axisAngle.x, axisAngle.y, axisAngle.z, axisAngle.w);
    a["stx:quaternion"] = fmt::format("{} {} {} {}", c.orientation.w, c.orientation.x,
                                      c.orientation.y, c.orientation.z);
    a["stx:fieldOfView"] = c.fieldOfView();
    a["stx:orthographic"] = std::int64_t{c.orthographic};
    a["stx:fx"] = c.fx;
    a["stx:fy"] = c.fy;
    a["stx:cx"] = c.cx;
    a["stx:cy"] = c.cy;
    a["stx:nearPlane"] = view.nearPlane;
    a["stx:farPlane"] = view.farPlane;
    a["stx:depthBits"] = std::int64_t{view.depthBits};
    if (view.noDepth == NoDepth::unknown) a["stx:noDepth"] = std::string(nameOf(view.noDepth));
    if (!view.refined.steps.empty()) a["stx:refined"] = view.refined.text();
    if (view.pruned) a["stx:pruned"] = std::int64_t{1};
    if (view.background) a["stx:background"] = std::int64_t{1};
}

void setExrOrigin(ExrPart& first, const glm::dvec3& origin) {
    if (origin != glm::dvec3(0.0)) first.attributes["stx:origin"] = origin;
}

glm::dvec3 exrOrigin(const ExrReader& reader) {
    const auto* origin = reader.parts()[0].attribute<glm::dvec3>("stx:origin");
    return origin && std::isfinite(origin->x + origin->y + origin->z) ? *origin : glm::dvec3(0.0);
}

bool isTrimmed(const ExrPart& part, const Camera& camera) {
    if (part.originX != 0 || part.originY != 0) return true;
    if (!(camera.fx > 0 && camera.fy > 0)) return false;  // which is said of the camera itself
    constexpr double kRounding = 1e-9;
    const auto* stored = part.attribute<glm::dvec2>("stx:fieldOfView");
    return stored &&
           glm::distance(*stored, camera.fieldOfView()) > kRounding * glm::length(*stored);
}

Result<ReferenceView> exrCamera(const ExrPart& part) {
    ReferenceView view;
    view.name = part.name;
    const auto* position = part.attribute<glm::dvec3>("stx:position");
    if (!position) {
        STX_TRY(view.camera, cameraFromStandard(part));
        view.depthBits = 32;
        return view;
    }
    Camera& c = view.camera;
    c.position = *position;
    c.width = part.width;
    c.height = part.height;
    const auto missing = [&](std::string_view name) {
        return fail(ErrorCode::invalidInput, "part '{}' lacks the attribute {}", part.name, name);
    };
    const auto fourNumbers = [&](const char* name) -> Result<glm::dvec4> {
        const auto* text = part.attribute<std::string>(name);
        if (!text) return missing(name);
        const auto numbers = numbersFrom(*text);
        if (!numbers || numbers->size() != 4)
            return fail(ErrorCode::invalidInput, "part '{}': {} is '{}'; four numbers are needed",
                        part.name, name, text->substr(0, 100));
        return glm::dvec4((*numbers)[0], (*numbers)[1], (*numbers)[2], (*numbers)[3]);
    };
    if (part.attribute<std::string>("stx:quaternion")) {
        STX_TRY(const glm::dvec4 q, fourNumbers("stx:quaternion"));
        c.orientation = glm::dquat(q.x, q.y, q.z, q.w);
    } else {
        STX_TRY(const glm::dvec4 axisAngle, fourNumbers("stx:orientation"));
        c.orientation = quatFromAxisAngle(axisAngle);
    }
    for (const auto& [name, to] :
         std::initializer_list<std::pair<const char*, double*>>{{"stx:fx", &c.fx},
                                                                {"stx:fy", &c.fy},
                                                                {"stx:cx", &c.cx},
                                                                {"stx:cy", &c.cy},
                                                                {"stx:nearPlane", &view.nearPlane},
                                                                {"stx:farPlane", &view.farPlane}}) {
        const auto* value = part.attribute<double>(name);
        if (!value) return missing(name);
        *to = *value;
    }
    c.cx -= part.originX;
    c.cy -= part.originY;
    const auto* orthographic = part.attribute<std::int64_t>("stx:orthographic");
    const auto* bits = part.attribute<std::int64_t>("stx:depthBits");
    if (!orthographic) return missing("stx:orthographic");
    if (!bits) return missing("stx:depthBits");
    c.orthographic = *orthographic != 0;
    if (part.width == part.displayWidth && part.height == part.displayHeight && isTrimmed(part, c))
        return fail(ErrorCode::invalidInput,
                    "part '{}': its camera is not one of {}x{} pixels, for stx:fieldOfView is "
                    "another; a program has resized the picture and left the camera as it was",
                    part.name, c.width, c.height);
    view.depthBits = static_cast<int>(*bits);
    if (const auto* noDepth = part.attribute<std::string>("stx:noDepth")) {
        const auto named = noDepthNamed(*noDepth);
        if (!named)
            return fail(ErrorCode::invalidInput,
                        "part '{}': stx:noDepth is '{}'; 'empty' or 'unknown' is expected",
                        part.name, noDepth->substr(0, 100));
        view.noDepth = *named;
    }
    if (const auto* refined = part.attribute<std::string>("stx:refined")) {
        const auto found = Refined::from(*refined);
        if (!found)
            return fail(ErrorCode::invalidInput,
                        "part '{}': stx:refined is '{}'; steps and a number, as in 'noise,agree "
                        "0.003', are expected",
                        part.name, refined->substr(0, 100));
        view.refined = *found;
    }
    const auto* pruned = part.attribute<std::int64_t>("stx:pruned");
    view.pruned = pruned && *pruned != 0;
    const auto* background = part.attribute<std::int64_t>("stx:background");
    view.background = background && *background != 0;
    return view;
}

}  // namespace stx
