// Recordings of Microsoft's Azure Kinect: Matroska with colour (mostly MJPEG), depth as big-endian
// 16-bit millimetres, and calibration.json attached: Brown-Conrady lenses with six radial
// coefficients, normalised to the sensors, and the pose of the colour camera. Axes as in OpenCV.

#include <algorithm>
#include <cmath>
#include <mutex>

#include "formats/files/messages.hpp"
#include "formats/imagesets/film_frames.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/pictures.hpp"
#include "formats/video/film.hpp"

namespace stx::imagesets {
namespace {

/// Colour is taken of the surface in front, when it is nearer by more than this share of the
/// distance: what noise and slanted surfaces do not reach.
constexpr float kInFront = 0.03f;
/// Colour pixels on a side of a cell in which the surface in front is looked for.
constexpr int kCell = 4;

/// A camera of the device in pixels of the pictures that it gave.
struct DeviceCamera {
    Camera camera;  ///< size and intrinsics
    Lens lens;
    double reach =
        0;  ///< the lens holds to this distance from the axis, at distance 1; 0: anywhere
    glm::dmat3 turn{1};   ///< from the depth camera's axes
    glm::dvec3 shift{0};  ///< metres
};

/// How a picture lies on the sensor that its calibration counts by.
struct OnSensor {
    double width, height;  ///< of the whole sensor, in pixels of the picture
    double left, top;      ///< of the picture
};

/// Depth by its mode (k4a: NFOV is cropped, WFOV is whole; binned or not).
Result<OnSensor> depthOnSensor(int width, int height, const std::string& where) {
    if (width == 640 && height == 576) return OnSensor{1024, 1024, 192, 180};
    if (width == 320 && height == 288) return OnSensor{512, 512, 96, 90};
    if (width == height && (width == 512 || width == 1024))
        return OnSensor{static_cast<double>(width), static_cast<double>(height), 0, 0};
    return failAt(where, ErrorCode::invalidInput,
                  "its depth is {}x{}; Azure Kinect's is 640x576, 320x288, 512x512 or 1024x1024",
                  width, height);
}
/// Colour of 4:3 is whole, of 16:9 cut above and below.
OnSensor colourOnSensor(int width, int height) {
    const double whole = width * 0.75;
    return {static_cast<double>(width), whole, 0, (whole - height) / 2};
}

Result<DeviceCamera> cameraOf(const Json& calibration, const std::string& purpose, int width,
                              int height, const OnSensor& on, const std::string& where) {
    const Json* found = nullptr;
    const auto info = calibration.find("CalibrationInformation");
    if (info != calibration.end() && info->is_object())
        if (const auto cameras = info->find("Cameras");
            cameras != info->end() && cameras->is_array())
            for (const Json& camera : *cameras)
                if (camera.is_object() &&
                    camera.value("Purpose", Json()) == Json("CALIBRATION_CameraPurpose" + purpose))
                    found = &camera;
    if (!found)
        return failAt(where, ErrorCode::invalidInput,
                      "its calibration has no camera for CALIBRATION_CameraPurpose{}", purpose);
    const std::string place = fmt::format("{}: calibration of {}", where, purpose);
    const auto part = [&](const char* key) -> const Json& {
        static const Json nothing = Json::object();
        const auto it = found->find(key);
        return it != found->end() && it->is_object() ? *it : nothing;
    };
    STX_TRY(const auto p, needNumbers(part("Intrinsics"), "ModelParameters", 14, place));
    STX_TRY(const auto turn, needNumbers(part("Rt"), "Rotation", 9, place));
    STX_TRY(const auto shift, needNumbers(part("Rt"), "Translation", 3, place));
    STX_TRY(const auto reach, findNumber(*found, "MetricRadius", place));
    DeviceCamera out;
    Camera& c = out.camera;
    c.width = width;
    c.height = height;
    c.cx = p[0] * on.width - on.left;
    c.cy = p[1] * on.height - on.top;
    c.fx = p[2] * on.width;
    c.fy = p[3] * on.height;
    if (auto ok = c.check(); !ok) return tl::unexpected(ok.error().at(place));
    if (p[10] != 0 || p[11] != 0)
        return failAt(place, ErrorCode::unsupported,
                      "its lens has a centre of distortion of its own, {:g} {:g}; 0 0 is read",
                      p[10], p[11]);
    out.lens.rational = true;
    out.lens.k1 = p[4];
    out.lens.k2 = p[5];
    out.lens.k3 = p[6];
    out.lens.k4 = p[7];
    out.lens.k5 = p[8];
    out.lens.k6 = p[9];
    out.lens.p2 = p[12];
    out.lens.p1 = p[13];
    out.reach = reach.value_or(0);
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            out.turn[column][row] = turn[static_cast<std::size_t>(3 * row + column)];
    out.shift = {shift[0], shift[1], shift[2]};
    if (std::abs(glm::determinant(out.turn) - 1) > 1e-2)
        return failAt(place, ErrorCode::invalidInput, "its rotation is not a rotation matrix");
    return out;
}

/// The device, and where each depth pixel looks: found once for all frames.
class KinectDevice {
  public:
    DeviceCamera depth, colour;

    /// Directions x, y at distance 1 of the real picture's pixels; NaN where the lens does not
    /// reach.
    const Image<glm::vec2>& rays() {
        std::call_once(once_, [this] { findRays(); });
        return rays_;
    }

  private:
    void findRays() {
        const Camera& c = depth.camera;
        rays_ = Image<glm::vec2>(c.width, c.height);
        constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
        for (int y = 0; y < c.height; ++y) {
            for (int x = 0; x < c.width; ++x) {
                const glm::dvec2 real(x + 0.5, y + 0.5);
                glm::dvec2 ideal = real;
                bool found = false;
                // Newton's steps: the lens is smooth, and mild where it was calibrated.
                for (int i = 0; i < 30 && !found; ++i) {
                    const glm::dvec2 off = real - depth.lens.realFromIdeal(c, ideal);
                    found = glm::length(off) < 1e-4;
                    const glm::dvec2 dx = depth.lens.realFromIdeal(c, ideal + glm::dvec2(0.5, 0)) -
                                          depth.lens.realFromIdeal(c, ideal - glm::dvec2(0.5, 0));
                    const glm::dvec2 dy = depth.lens.realFromIdeal(c, ideal + glm::dvec2(0, 0.5)) -
                                          depth.lens.realFromIdeal(c, ideal - glm::dvec2(0, 0.5));
                    const double area = dx.x * dy.y - dx.y * dy.x;
                    if (!(area > 1e-3)) break;
                    ideal +=
                        glm::dvec2(off.x * dy.y - off.y * dy.x, off.y * dx.x - off.x * dx.y) / area;
                }
                const glm::dvec2 ray((ideal.x - c.cx) / c.fx, (ideal.y - c.cy) / c.fy);
                const bool reached = depth.reach <= 0 || glm::length(ray) <= depth.reach;
                rays_.at(x, y) = found && reached ? glm::vec2(ray) : glm::vec2(kNone);
            }
        }
    }

    std::once_flag once_;
    Image<glm::vec2> rays_;
};

glm::u8vec4 colourAt(const Rgba8Image& image, glm::dvec2 at) {
    const double x = at.x - 0.5, y = at.y - 0.5;
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    const float fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
    const auto pixel = [&](int i, int j) {
        return glm::vec4(
            image.at(std::clamp(i, 0, image.width() - 1), std::clamp(j, 0, image.height() - 1)));
    };
    const glm::vec4 mixed = glm::mix(glm::mix(pixel(x0, y0), pixel(x0 + 1, y0), fx),
                                     glm::mix(pixel(x0, y0 + 1), pixel(x0 + 1, y0 + 1), fx), fy);
    return glm::u8vec4(mixed + 0.5f);
}

/// The colour that the other camera has of each depth pixel; alpha 0 where it does not see it.
Rgba8Image colourOfDepth(KinectDevice& device, const Image<float>& millimetres,
                         const Rgba8Image& colour) {
    const Image<glm::vec2>& rays = device.rays();
    const DeviceCamera& to = device.colour;
    const int w = millimetres.width(), h = millimetres.height();
    Image<glm::vec3> places(w, h, glm::vec3(-1));  // column and row in the colour picture, distance
    Image<float> front((colour.width() + kCell - 1) / kCell, (colour.height() + kCell - 1) / kCell,
                       kNoDepth);
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            const float code = millimetres.at(x, y);
            const glm::vec2 ray = rays.at(x, y);
            if (!(code > 0) || std::isnan(ray.x)) continue;
            const double z = code * kMillimetre;
            const glm::dvec3 p = to.turn * glm::dvec3(ray.x * z, ray.y * z, z) + to.shift;
            if (!(p.z > 0)) continue;
            if (to.reach > 0 && std::hypot(p.x / p.z, p.y / p.z) > to.reach) continue;
            const glm::dvec2 at = to.lens.realFromIdeal(
                to.camera,
                {to.camera.fx * p.x / p.z + to.camera.cx, to.camera.fy * p.y / p.z + to.camera.cy});
            if (!(at.x >= 0 && at.y >= 0 && at.x < colour.width() && at.y < colour.height()))
                continue;
            places.at(x, y) = glm::vec3(at, p.z);
            float& nearest =
                front.at(static_cast<int>(at.x) / kCell, static_cast<int>(at.y) / kCell);
            nearest = std::min(nearest, static_cast<float>(p.z));
        }
    }
    Rgba8Image out(w, h, glm::u8vec4(0));
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            const glm::vec3 at = places.at(x, y);
            if (!(at.z > 0)) continue;
            const float nearest =
                front.at(static_cast<int>(at.x) / kCell, static_cast<int>(at.y) / kCell);
            if (at.z > nearest * (1 + kInFront)) continue;
            out.at(x, y) = colourAt(colour, {at.x, at.y});
            out.at(x, y).a = 255;
        }
    }
    return out;
}

int trackNamed(const Film& film, const std::string& title) {
    const auto& tracks = film.tracks();
    const auto found = std::ranges::find_if(
        tracks, [&](const Film::Track& t) { return t.video && t.title == title; });
    return found == tracks.end() ? -1 : static_cast<int>(found - tracks.begin());
}

}  // namespace

Result<SetDescription> describeAzureKinect(const path& given, const ImageSetOptions& options,
                                           Job& job) {
    const std::string where = inQuotes(given.string());
    std::error_code ec;
    if (std::filesystem::is_directory(given, ec))
        return failAt(where, ErrorCode::invalidInput, "a folder; the recording's .mkv is expected");
    // Two decoders: each follows its own track.
    STX_TRY(auto openedColour, Film::open(given, job.limits));
    const std::shared_ptr<Film> colour = std::move(openedColour);
    const auto& tracks = colour->tracks();
    const auto attachment = std::ranges::find_if(tracks, [](const Film::Track& t) {
        return !t.attached.empty() && t.attachment.ends_with("calibration.json");
    });
    const int colourTrack = trackNamed(*colour, "COLOR"), depthTrack = trackNamed(*colour, "DEPTH");
    if (attachment == tracks.end() || depthTrack < 0)
        return failAt(
            where, ErrorCode::invalidInput,
            "it is not a recording of an Azure Kinect: a track DEPTH and calibration.json "
            "attached are expected; other films come in pairs: stx convert CAMERAS.json "
            "--texture colour.mp4 --depth depth.mkv -o OUT");
    if (colourTrack < 0)
        return failAt(where, ErrorCode::invalidInput,
                      "it was recorded without colour; a track COLOR is expected");
    STX_TRY(const auto calibration,
            within(fmt::format("{}: calibration.json", where),
                   parseJson(ByteSpan(attachment->attached.data(),
                                      // The device ends it with a NUL.
                                      static_cast<std::size_t>(
                                          std::ranges::find(attachment->attached, std::byte{0}) -
                                          attachment->attached.begin())))));
    const Film::Track& dt = tracks[static_cast<std::size_t>(depthTrack)];
    const Film::Track& ct = tracks[static_cast<std::size_t>(colourTrack)];
    if (dt.pixels != "gray16be" && dt.pixels != "gray16le")
        return failAt(where, ErrorCode::invalidInput, "its depth is {}; 16-bit grey is expected",
                      dt.pixels);
    const auto device = std::make_shared<KinectDevice>();
    STX_TRY(const OnSensor depthOn, depthOnSensor(dt.width, dt.height, where));
    STX_TRY(device->depth, cameraOf(calibration, "Depth", dt.width, dt.height, depthOn, where));
    STX_TRY(device->colour, cameraOf(calibration, "PhotoVideo", ct.width, ct.height,
                                     colourOnSensor(ct.width, ct.height), where));
    STX_TRY(auto openedDepth, Film::open(given, job.limits));
    const std::shared_ptr<Film> depth = std::move(openedDepth);
    STX_CHECK(colour->select(colourTrack, options.strict, job));
    STX_CHECK(depth->select(depthTrack, options.strict, job));
    STX_TRY(const auto pairs, pairFrames(*colour, *depth, where, job));
    STX_CHECK(checkViewCount(pairs.size(), job.limits, where));

    SetDescription set;
    set.title = given.stem().string();
    set.film = true;
    extendTo(set.end, pairs, *depth);
    for (const FramePair& pair : pairs) {
        SetView view;
        view.name = view.taker = "kinect";
        view.time = pair.time;
        view.camera = device->depth.camera;
        view.lens = device->depth.lens;
        view.sensor = true;
        view.distances = sensorIntegers(kMillimetre);
        view.texture = frameOf(colour, pair.colour);
        view.depth = frameOf(depth, pair.depth);
        view.load = [device](const SetView& self, Job& ownJob) -> Result<StoredView> {
            StoredView stored;
            STX_TRY(auto values, readDepth(self.depth, ownJob));
            STX_TRY(const auto picture, readColour(self.texture, {}, false, ownJob));
            const auto* seen = picture.texture.rgba8();
            if (values.values.size() != device->rays().size() || !seen ||
                seen->width() != device->colour.camera.width ||
                seen->height() != device->colour.camera.height)
                return failAt(inQuotes(self.depth.name), ErrorCode::invalidInput,
                              "a frame has another size than its track");
            stored.texture = colourOfDepth(*device, values.values, *seen);
            stored.alpha = true;
            stored.largest = values.largest;
            stored.depth = std::move(values.values);
            return stored;
        };
        set.views.push_back(std::move(view));
    }
    return set;
}

}  // namespace stx::imagesets
