#include "lib/render/around/around.hpp"
#include "lib/render/factory.hpp"

#include <algorithm>
#include <cmath>

#include <glm/gtc/constants.hpp>

#include "lib/base/parallel.hpp"
#include "lib/capture/capture.hpp"
#include "lib/geometry/catmull_rom.hpp"
#include "lib/render/api/frame_picture.hpp"

namespace stx {
namespace {

/// Neighbouring depths that differ by no more than this share are one surface.
constexpr float kOneSurface = 0.05f;

/// Catmull-Rom of premultiplied colours, held to what the four pixels around span.
glm::vec4 sharp(const Image<glm::vec4>& image, float x, float y) {
    const int x0 = static_cast<int>(std::floor(x - 0.5f)),
              y0 = static_cast<int>(std::floor(y - 0.5f));
    const auto wx = catmullRomWeights(x - 0.5f - static_cast<float>(x0)),
               wy = catmullRomWeights(y - 0.5f - static_cast<float>(y0));
    glm::vec4 sum(0.0f), low(INFINITY), high(-INFINITY);
    for (int j = 0; j < 4; ++j) {
        const auto row = image.row(std::clamp(y0 - 1 + j, 0, image.height() - 1));
        for (int i = 0; i < 4; ++i) {
            const glm::vec4 c = row[std::clamp(x0 - 1 + i, 0, image.width() - 1)];
            sum += c * (wx[i] * wy[j]);
            if ((i == 1 || i == 2) && (j == 1 || j == 2)) {
                low = glm::min(low, c);
                high = glm::max(high, c);
            }
        }
    }
    return glm::clamp(sum, low, high);
}

/// The planar distance at a position: between the four pixels around where they are one surface
/// (1/distance is linear on a plane), else that of the nearest.
float depthAt(const Image<float>& depth, float x, float y) {
    const int width = depth.width(), height = depth.height();
    const int x0 = std::clamp(static_cast<int>(std::floor(x - 0.5f)), 0, width - 2);
    const int y0 = std::clamp(static_cast<int>(std::floor(y - 0.5f)), 0, height - 2);
    const float d[4] = {depth.at(x0, y0), depth.at(x0 + 1, y0), depth.at(x0, y0 + 1),
                        depth.at(x0 + 1, y0 + 1)};
    const auto [least, most] = std::minmax_element(std::begin(d), std::end(d));
    if (hasPoint(*most) && *least > 0 && *most - *least <= kOneSurface * *least) {
        const float fx = std::clamp(x - 0.5f - static_cast<float>(x0), 0.0f, 1.0f);
        const float fy = std::clamp(y - 0.5f - static_cast<float>(y0), 0.0f, 1.0f);
        return 1.0f /
               ((1 - fy) * ((1 - fx) / d[0] + fx / d[1]) + fy * ((1 - fx) / d[2] + fx / d[3]));
    }
    return depth.at(std::clamp(static_cast<int>(x), 0, width - 1),
                    std::clamp(static_cast<int>(y), 0, height - 1));
}

/// Which of facesAround() a direction in camera space falls on.
int faceOf(glm::vec3 d) {
    const glm::vec3 size = glm::abs(d);
    if (size.z >= size.x && size.z >= size.y) return d.z < 0 ? 0 : 2;
    if (size.x >= size.y) return d.x < 0 ? 1 : 3;
    return d.y > 0 ? 4 : 5;
}

}  // namespace

int facesHalf(int width) {
    return std::max(1, static_cast<int>(std::lround(width / glm::two_pi<double>())));
}

std::vector<Camera> facesAround(const Camera& pose, int half) {
    Camera face = pose;
    face.orthographic = false;
    face.width = face.height = 2 * half + 2;
    face.fx = face.fy = half;
    face.cx = face.cy = half + 1.0;
    std::vector<Camera> faces;
    const double quarter = glm::half_pi<double>();
    for (const glm::dvec4 turn : {glm::dvec4(0, 1, 0, 0), glm::dvec4(0, 1, 0, quarter),
                                  glm::dvec4(0, 1, 0, 2 * quarter), glm::dvec4(0, 1, 0, -quarter),
                                  glm::dvec4(1, 0, 0, quarter), glm::dvec4(1, 0, 0, -quarter)}) {
        face.orientation = glm::normalize(pose.orientation * quatFromAxisAngle(turn));
        faces.push_back(face);
    }
    return faces;
}

namespace {

/// renderAround() without its checks, in the light that the renderer has.
Result<Frame> drawAround(Renderer& renderer, const Camera& camera, int width, int height,
                         Job& job) {
    const auto cameras = facesAround(camera, facesHalf(width));
    std::vector<glm::vec2> column(static_cast<std::size_t>(width));  // sine, cosine of longitude
    for (int x = 0; x < width; ++x) {
        const double longitude = ((x + 0.5) / width - 0.5) * glm::two_pi<double>();
        column[x] = {std::sin(longitude), std::cos(longitude)};
    }
    Frame out;
    out.colour = Image<glm::vec4>(width, height, glm::vec4(0.0f));
    out.depth = Image<float>(width, height, kNoDepth);
    for (std::size_t f = 0; f < cameras.size(); ++f) {
        STX_CHECK(job.checkCancelled());
        if (f + 1 < cameras.size()) renderer.expect(cameras[f + 1]);
        STX_TRY(const Frame face, renderer.render(cameras[f]));
        out.milliseconds += face.milliseconds;
        out.linear = face.linear;
        if (!face.albedo.empty() && out.albedo.empty())
            out.albedo = Image<glm::vec4>(width, height);
        if (!face.normal.empty() && out.normal.empty())
            out.normal = Image<glm::vec3>(width, height, glm::vec3(0.0f));
        const Camera& c = cameras[f];
        const glm::mat3 faceFromCamera(
            glm::mat3_cast(glm::conjugate(c.orientation) * camera.orientation));
        parallelFor(0, height, 8, [&](int y) {
            const double latitude = (0.5 - (y + 0.5) / height) * glm::pi<double>();
            const auto up = static_cast<float>(std::sin(latitude));
            const auto level = static_cast<float>(std::cos(latitude));
            for (int x = 0; x < width; ++x) {
                const glm::vec2 turn = column[x];
                const glm::vec3 d(level * turn.x, up, -level * turn.y);
                if (faceOf(d) != static_cast<int>(f)) continue;
                const glm::vec3 in = faceFromCamera * d;  // z is -1/sqrt(3) at most
                const float px = static_cast<float>(c.cx) + static_cast<float>(c.fx) * in.x / -in.z;
                const float py = static_cast<float>(c.cy) - static_cast<float>(c.fy) * in.y / -in.z;
                out.colour.at(x, y) = sharp(face.colour, px, py);
                if (!face.albedo.empty()) out.albedo.at(x, y) = sharp(face.albedo, px, py);
                const float dist = depthAt(face.depth, px, py);
                if (hasPoint(dist)) out.depth.at(x, y) = dist / -in.z;
                if (!face.normal.empty())
                    out.normal.at(x, y) =
                        face.normal.at(std::clamp(static_cast<int>(px), 0, c.width - 1),
                                       std::clamp(static_cast<int>(py), 0, c.height - 1));
            }
        });
    }
    return out;
}

}  // namespace

Result<Frame> renderAround(Renderer& renderer, const Camera& camera, int width, int height,
                           Job& job) {
    if (width < 4 || width != 2 * height)
        return fail(ErrorCode::usage,
                    "a picture all around has {}x{} pixels; twice as wide as high is expected, 4x2 "
                    "at least",
                    width, height);
    // Lights that move with the camera are where its pose has them, not each face.
    renderer.lightFrom(camera);
    auto frame = drawAround(renderer, camera, width, height, job);
    renderer.lightFrom(std::nullopt);
    return frame;
}

namespace {

/// Cameras further apart than this share of the distance of what they see have no common place.
constexpr double kNoCommonPlace = 0.05;
/// Above this share, what is seen from one place is reported to be a little off.
constexpr double kParallax = 0.005;

/// What the views see is this far away: the median over them of the middle of their range.
double typicalDistance(const Bundle& bundle) {
    std::vector<double> distances;
    for (const ReferenceView& view : bundle.views) {
        std::vector<float> depths;
        for (std::size_t i = 0; i < view.depth.count(); i += 97)
            if (hasPoint(view.depth.data()[i])) depths.push_back(view.depth.data()[i]);
        if (depths.empty()) continue;
        const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
        std::nth_element(depths.begin(), middle, depths.end());
        distances.push_back(*middle);
    }
    if (distances.empty()) return 0;
    std::ranges::sort(distances);
    return distances[distances.size() / 2];
}

/// A drawn face as a view.
ReferenceView viewOf(const Camera& camera, Frame frame, int depthBits) {
    ReferenceView view;
    view.camera = camera;
    view.depthBits = depthBits;
    view.depth = std::move(frame.depth);
    if (frame.linear) {
        RgbaFloatImage colour = std::move(frame.colour);
        for (glm::vec4& p : colour.pixels())
            if (p.a > 0) p = {glm::vec3(p) / p.a, std::min(p.a, 1.0f)};
        view.texture = std::move(colour);
    } else {
        view.texture = rgba8From(frame);
    }
    for (std::size_t i = 0; i < view.depth.count(); ++i) {
        float& dist = view.depth.data()[i];
        const float alpha = view.texture.at(i).a;
        if (!(alpha > 0)) dist = kNoDepth;
        if (hasPoint(dist)) continue;
        // What was filled in has a colour and no place.
        if (auto* coded = view.texture.rgba8()) coded->data()[i].a = 0;
        if (auto* linear = view.texture.rgbaFloat()) linear->data()[i].a = 0;
    }
    return view;
}

}  // namespace

Result<Bundle> cubeFromInside(const Bundle& bundle, Job& job, PixelSpool* spool) {
    STX_CHECK(bundle.check());
    Camera pose;
    int bits = 8;
    double density = 1;
    for (const ReferenceView& view : bundle.views) {
        if (view.camera.orthographic)
            return fail(ErrorCode::invalidInput,
                        "view '{}' is orthographic, so it was taken from no place; a cube is made "
                        "of perspective views",
                        view.name);
        pose.position += view.camera.position / static_cast<double>(bundle.views.size());
        bits = std::max(bits, view.depthBits);
        density = std::max({density, view.camera.fx, view.camera.fy});
    }
    double apart = 0;
    for (const ReferenceView& view : bundle.views)
        apart = std::max(apart, glm::distance(view.camera.position, pose.position));
    const double distance = typicalDistance(bundle);
    if (!(apart <= kNoCommonPlace * distance))
        return fail(ErrorCode::invalidInput,
                    "the cameras share no place: they are up to {:.3g} from their middle and see "
                    "what is {:.3g} away; a cube is made of pictures of a sensor that turned in "
                    "place",
                    apart, distance);
    if (apart > kParallax * distance)
        job.note(fmt::format(
            "the cameras are up to {:.3g} from their middle, {:.2g} % of the distance of what they "
            "see: edges of the cube's faces are as uncertain",
            apart, 100 * apart / distance));
    const int half = static_cast<int>(std::lround(std::min(density, 8192.0)));
    const auto cameras = facesAround(pose, half);
    STX_CHECK(job.limits.checkAllocation(
        6ull * static_cast<std::uint64_t>(cameras[0].width) * cameras[0].height, 24, "six faces"));
    RenderSettings settings;
    settings.fill = Fill::none;
    settings.ownEnvironment = false;
    STX_TRY(const auto renderer, spool
                                     ? makeRenderer(Backend::cpu, bundle, *spool, settings, -1, job)
                                     : makeRenderer(Backend::cpu, bundle, settings, -1, job));
    Bundle cube;
    cube.title = bundle.title;
    cube.origin = bundle.origin;
    cube.environment = bundle.environment;
    for (std::size_t f = 0; f < cameras.size(); ++f) {
        STX_CHECK(job.checkCancelled());
        STX_TRY(Frame frame, renderer->render(cameras[f]));
        ReferenceView view = viewOf(cameras[f], std::move(frame), bits);
        view.name = kFacesAround[f];
        if (view.pointCount() == 0) continue;
        bleedColour(view.texture);
        fitDepthRange(view);
        cube.views.push_back(std::move(view));
        job.progress(static_cast<std::int64_t>(f) + 1, 6, "drawing faces");
    }
    cube.bounds = cube.computeBounds();
    STX_CHECK(cube.check());
    return cube;
}

}  // namespace stx
