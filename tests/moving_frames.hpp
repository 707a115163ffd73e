#pragma once

#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <random>
#include <string>

#include "lib/model/bundle.hpp"
#include "tests/plain_files.hpp"

/// Frames of the moving image sets of the shared data, read as plain_files.hpp says.
namespace moving {

using plain::decoded;
using plain::json;
using plain::picture;

/// A camera-to-world matrix of four rows.
inline void setPose(stx::Camera& camera, const nlohmann::json& rows) {
    glm::dmat3 turn;
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row) turn[column][row] = rows[row][column].get<double>();
    for (int row = 0; row < 3; ++row) camera.position[row] = rows[row][3].get<double>();
    camera.orientation = glm::normalize(glm::quat_cast(turn));
}

/// Distances out of 16-bit values.
inline stx::Image<float> depth(const std::filesystem::path& path,
                               const std::function<float(std::uint16_t)>& distance) {
    const auto codes = decoded(path);
    stx::Image<float> out(codes.width, codes.height);
    const auto& values = std::get<std::vector<std::uint16_t>>(codes.values);
    for (std::size_t i = 0; i < values.size(); ++i) out.data()[i] = distance(values[i]);
    return out;
}

/// Where there is no depth there is no object, as image sets are read.
inline void coverPoints(stx::ReferenceView& view) {
    for (std::size_t i = 0; i < view.depth.count(); ++i)
        view.texture.rgba8()->data()[i].a = stx::hasPoint(view.depth.data()[i]) ? 255 : 0;
    view.nearPlane = 0.3;
    view.farPlane = 30;
    view.depthBits = 32;
}

/// moving-room: 16 frames of several cameras.
struct MovingRoom {
    static constexpr int kFrames = 16;
    std::filesystem::path folder;
    std::map<std::string, std::vector<stx::Camera>> cameras;  ///< by name, of each frame

    explicit MovingRoom(std::filesystem::path dir) : folder(std::move(dir)) {
        for (const char* file : {"transforms.json", "truth.json"}) {
            const auto set = json(folder / file);
            for (const auto& frame : set["frames"]) {
                stx::Camera c;
                c.width = set["w"];
                c.height = set["h"];
                c.fx = set["fl_x"];
                c.fy = set["fl_y"];
                c.cx = set["cx"];
                c.cy = set["cy"];
                setPose(c, frame["transform_matrix"]);
                cameras[frame["camera"]].push_back(c);
            }
        }
    }
    [[nodiscard]] static double time(int frame) { return frame / 25.0; }
    [[nodiscard]] std::filesystem::path picturePath(const std::string& camera, int frame) const {
        return folder / camera / fmt::format("color_{:03}.png", frame);
    }
    [[nodiscard]] stx::ReferenceView view(const std::string& camera, int frame) const {
        stx::ReferenceView v;
        v.name = camera;
        v.camera = cameras.at(camera)[static_cast<std::size_t>(frame)];
        v.texture = picture(picturePath(camera, frame));
        v.depth =
            depth(folder / camera / fmt::format("depth_{:03}.png", frame), [](std::uint16_t code) {
                return code ? static_cast<float>(20.0 / (1.0 + code / 65535.0 * 19.0))
                            : stx::kNoDepth;
            });
        coverPoints(v);
        return v;
    }
};

/// synthetic-room: 40 frames of one still camera.
struct SyntheticRoom {
    static constexpr int kFrames = 40;
    std::filesystem::path folder;
    std::map<std::string, stx::Camera> cameras;

    explicit SyntheticRoom(std::filesystem::path dir) : folder(std::move(dir)) {
        const auto set = json(folder / "transforms.json");
        for (const auto& [name, pose] : set["novel"].items()) {
            stx::Camera c;
            c.width = set["w"];
            c.height = set["h"];
            c.fx = c.fy = set["fl_x"].get<double>();
            c.cx = set["cx"];
            c.cy = set["cy"];
            setPose(c, pose);
            cameras[name] = c;
        }
    }
    [[nodiscard]] static double time(int frame) { return frame / double{kFrames - 1}; }
    [[nodiscard]] stx::ReferenceView read(const std::string& name,
                                          const std::string& camera) const {
        stx::ReferenceView v;
        v.name = camera;
        v.camera = cameras.at(camera);
        v.texture = picture(folder / (name + ".png"));
        v.depth = depth(folder / (name + "_depth.png"), [](std::uint16_t code) {
            return code ? static_cast<float>(code / 5000.0) : stx::kNoDepth;
        });
        coverPoints(v);
        return v;
    }
    [[nodiscard]] stx::ReferenceView frame(int number) const {
        return read(fmt::format("ref/{:04}", number), "ref");
    }
    /// The room without anything that moves.
    [[nodiscard]] stx::ReferenceView empty(const std::string& camera) const {
        return read("background/" + camera, camera);
    }
    [[nodiscard]] std::filesystem::path truthPath(const std::string& camera, int frame) const {
        return folder / fmt::format("truth/{}_{:04}.png", camera, frame);
    }
};

/// Light that drifts by 4 %, as room.py has it.
inline float driftAt(double time) {
    return 1 + 0.04f * static_cast<float>(std::sin(5 * time));
}

/// The same frame under another light.
inline void relight(stx::ReferenceView& view, float gain) {
    for (auto& p : view.texture.rgba8()->pixels())
        for (int c = 0; c < 3; ++c)
            p[c] = static_cast<std::uint8_t>(
                std::clamp(std::round(static_cast<float>(p[c]) * gain), 0.0f, 255.0f));
}

/// A frame as a cheap sensor would see it, as the noisy variant of room.py: light that drifts,
/// noise of colours, noise of depth that grows with its square, depth that flickers at edges, and
/// pixels without any.
inline void addSensorNoise(stx::ReferenceView& view, int frame, double time) {
    std::mt19937 random(static_cast<unsigned>(1000 + frame));
    // std::normal_distribution is not the same everywhere: twelve uniform numbers are near enough.
    const auto uniform = [&] { return static_cast<float>(random()) * 0x1p-32f; };
    const auto normal = [&] {
        float sum = -6;
        for (int i = 0; i < 12; ++i) sum += uniform();
        return sum;
    };
    const int w = view.camera.width, h = view.camera.height;
    for (auto& p : view.texture.rgba8()->pixels())
        for (int c = 0; c < 3; ++c)
            p[c] = static_cast<std::uint8_t>(
                std::clamp(std::round(static_cast<float>(p[c]) * driftAt(time) + 2.2f * normal()),
                           0.0f, 255.0f));
    const stx::Image<float> clean = view.depth;
    stx::Image<float> noisy = clean;
    for (float& z : noisy.pixels()) z += normal() * 0.0015f * z * z;
    const int dy = static_cast<int>(random() % 5) - 2, dx = static_cast<int>(random() % 5) - 2;
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            float low = 1e9f, high = 0;
            for (int j = std::max(y - 2, 0); j <= std::min(y + 2, h - 1); ++j) {
                for (int i = std::max(x - 2, 0); i <= std::min(x + 2, w - 1); ++i) {
                    low = std::min(low, clean.at(i, j));
                    high = std::max(high, clean.at(i, j));
                }
            }
            const bool edge = high - low > 0.15f;
            float z = noisy.at(x, y);
            if (edge) z = noisy.at((x - dx + w) % w, (y - dy + h) % h);
            const bool missing = (uniform() < 0.004f) | (edge & (uniform() < 0.35f));
            view.depth.at(x, y) = missing ? stx::kNoDepth : std::round(z * 5000.0f) / 5000.0f;
        }
    }
    coverPoints(view);
}

/// uva-person: 50 frames of a Kinect, with even numbers.
inline stx::ReferenceView personFrame(const std::filesystem::path& folder, int number) {
    stx::ReferenceView v;
    v.name = "kinect";
    v.camera.width = 640;
    v.camera.height = 480;
    v.camera.fx = v.camera.fy = 525;
    v.camera.cx = 320;
    v.camera.cy = 240;
    v.texture = picture(folder / fmt::format("{:010}.jpg", number));
    v.depth = depth(folder / fmt::format("{:010}_depth.png", number), [](std::uint16_t code) {
        return code ? static_cast<float>(code) * 0.001f : stx::kNoDepth;
    });
    coverPoints(v);
    return v;
}

}  // namespace moving
