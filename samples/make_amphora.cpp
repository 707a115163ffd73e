// Makes the sample model of the project: a painted amphora on three legs. It has what is hard for
// image-based rendering: a concave inside seen through its mouth, two handles with holes, thin legs
// and a wire ring, a fine painted pattern, and smooth shading.
//
// Usage: make_amphora FOLDER    writes amphora.obj, amphora.mtl and amphora.png into it.

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <glm/glm.hpp>

#include "formats/files/files.hpp"
#include "formats/images/images.hpp"

namespace {

constexpr double kPi = std::numbers::pi;

/// A grid of vertices written as OBJ quads, with smooth normals from its own neighbours.
class ObjWriter {
  public:
    /// `surface` maps (u, v) in [0,1]^2 to a point; the texture shows `area` = (u0, v0, u1, v1).
    void addGrid(int nu, int nv, const std::function<glm::dvec3(double, double)>& surface,
                 glm::dvec4 area) {
        const int first = vertices_ + 1;
        for (int j = 0; j <= nv; ++j) {
            for (int i = 0; i <= nu; ++i) {
                const double u = static_cast<double>(i) / nu, v = static_cast<double>(j) / nv;
                const double h = 1e-4;
                const glm::dvec3 p = surface(u, v);
                const glm::dvec3 du = surface(u + h, v) - surface(u - h, v);
                const glm::dvec3 dv = surface(u, v + h) - surface(u, v - h);
                glm::dvec3 n = glm::cross(du, dv);
                n = glm::length(n) > 1e-14 ? glm::normalize(n) : glm::dvec3(0, 1, 0);
                text += fmt::format(
                    "v {:.5f} {:.5f} {:.5f}\nvt {:.5f} {:.5f}\nvn {:.4f} {:.4f} {:.4f}\n", p.x, p.y,
                    p.z, area.x + (area.z - area.x) * u, area.y + (area.w - area.y) * v, n.x, n.y,
                    n.z);
                ++vertices_;
            }
        }
        for (int j = 0; j < nv; ++j) {
            for (int i = 0; i < nu; ++i) {
                const int a = first + j * (nu + 1) + i, b = a + 1, c = b + nu + 1, d = a + nu + 1;
                text +=
                    fmt::format("f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2} {3}/{3}/{3}\n", a, b, c, d);
            }
        }
    }
    /// A tube of radius r (a function of t) along a curve in [0,1].
    void addTube(int around, int along, const std::function<glm::dvec3(double)>& curve,
                 const std::function<double(double)>& radius, glm::dvec4 area) {
        addGrid(
            around, along,
            [=](double u, double v) {
                const double h = 1e-4;
                const glm::dvec3 tangent = glm::normalize(curve(v + h) - curve(v - h));
                const glm::dvec3 other =
                    std::abs(tangent.z) < 0.95 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
                const glm::dvec3 x = glm::normalize(glm::cross(other, tangent)),
                                 y = glm::cross(tangent, x);
                const double a = 2 * kPi * u;
                return curve(v) + (x * std::cos(a) + y * std::sin(a)) * radius(v);
            },
            area);
    }
    std::string text;

  private:
    int vertices_ = 0;
};

/// Outer radius of the body at height t in 0..1: foot, belly, shoulder, neck, lip.
double profile(double t) {
    const double belly =
        0.42 * std::sin(kPi * std::pow(std::clamp(t / 0.86, 0.0, 1.0), 0.8)) + 0.10;
    const double neck = 0.14 + 0.07 * std::exp(-std::pow((t - 1.0) / 0.05, 2));
    const double blend = 1 / (1 + std::exp(-(t - 0.76) * 45));
    return belly * (1 - blend) + neck * blend;
}

/// A hash in 0..1 for speckles that are the same everywhere.
double noise(int x, int y) {
    auto h =
        static_cast<std::uint32_t>(x) * 374761393u + static_cast<std::uint32_t>(y) * 668265263u;
    h = (h ^ (h >> 13)) * 1274126177u;
    return ((h ^ (h >> 16)) & 0xffff) / 65535.0;
}

/// The painting: bands of meander, waves, tongues and dots over speckled clay.
glm::dvec3 paint(double u, double v, int x, int y) {
    const glm::dvec3 clay = glm::dvec3(0.80, 0.42, 0.22) * (0.88 + 0.18 * noise(x / 2, y / 2));
    const glm::dvec3 black(0.09, 0.075, 0.07), cream(0.93, 0.86, 0.70), red(0.55, 0.13, 0.09);
    const auto fract = [](double a) { return a - std::floor(a); };
    if (v > 0.80) {  // wires, handles, inside: plain colours with stripes
        return fract(u * 24) < 0.5 ? black : glm::dvec3(0.72, 0.56, 0.20);
    }
    const double t = v / 0.80;
    if (t < 0.10) return fract(u * 40) < 0.45 ? black : clay;
    if (t < 0.13 || (t > 0.28 && t < 0.30) || (t > 0.58 && t < 0.60)) return black;
    if (t < 0.28) {  // meander
        const double a = fract(u * 18), b = (t - 0.13) / 0.15;
        const bool line = (a < 0.14) || (b < 0.16 && a < 0.9) || (b > 0.84) ||
                          (a > 0.35 && a < 0.5 && b > 0.35) ||
                          (b > 0.35 && b < 0.5 && a > 0.35 && a < 0.8) ||
                          (a > 0.68 && a < 0.8 && b > 0.35 && b < 0.7);
        return line ? black : cream;
    }
    if (t < 0.58) {  // running waves with dots
        const double b = (t - 0.30) / 0.28, wave = 0.5 + 0.28 * std::sin(2 * kPi * u * 9);
        const double cx = fract(u * 9) - 0.25, cy = (b - 0.22) * 0.9;
        if (cx * cx * 1.6 + cy * cy < 0.012) return red;
        return std::abs(b - wave) < 0.09 ? black
                                         : (b > wave ? clay : cream * (0.96 + 0.05 * noise(x, y)));
    }
    if (t < 0.74) {  // tongues
        const double a = fract(u * 30), b = (t - 0.60) / 0.14;
        return b < 0.75 + 0.22 * std::sin(kPi * a) && a > 0.12 && a < 0.88
                   ? (static_cast<int>(u * 30) % 2 ? red : black)
                   : cream;
    }
    return fract(u * 12 + t * 16) < 0.3 ? cream : black;  // neck
}

int fail(const stx::Error& error) {
    fmt::print(stderr, "make_amphora: {}\n", error.text());
    return static_cast<int>(error.code);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        fmt::print(stderr, "usage: make_amphora FOLDER\n");
        return 1;
    }
    const std::filesystem::path folder = argv[1];
    std::error_code ignored;
    std::filesystem::create_directories(folder, ignored);

    ObjWriter obj;
    obj.text =
        "# A painted amphora, made by samples/make_amphora.cpp of stx\nmtllib amphora.mtl\nusemtl "
        "painted\n";
    const double height = 1.3;
    const auto turned = [=](double u, double t, double inset) {
        const double a = 2 * kPi * u, r = std::max(0.0, profile(t) - inset);
        return glm::dvec3(r * std::sin(a), height * t, r * std::cos(a));
    };
    // Body outside, lip, inside and both bottoms.
    obj.addGrid(96, 96, [&](double u, double v) { return turned(u, v, 0.0); }, {0, 0.0, 1, 0.80});
    obj.addGrid(96, 4,
                [&](double u, double v) {
                    return turned(u, 1.0, 0.035 * v) + glm::dvec3(0, 0.02 * std::sin(kPi * v), 0);
                },
                {0, 0.90, 1, 0.92});
    obj.addGrid(96, 60,
                [&](double u, double v) { return turned(1 - u, 1 - 0.97 * v, 0.035 + 0.0 * v); },
                {0, 0.93, 1, 1.0});
    obj.addGrid(48, 4,
                [&](double u, double v) {
                    const auto p = turned(u, 0.03, 0.035);
                    return glm::dvec3(p.x * (1 - v), p.y, p.z * (1 - v));
                },
                {0, 0.93, 1, 0.94});
    obj.addGrid(48, 4,
                [&](double u, double v) {
                    const auto p = turned(1 - u, 0.0, 0.0);
                    return glm::dvec3(p.x * (1 - v), p.y, p.z * (1 - v));
                },
                {0, 0.93, 1, 0.94});
    // Two handles: each leaves a hole between itself and the neck.
    for (const double side : {1.0, -1.0}) {
        obj.addTube(
            14, 40,
            [=](double t) {
                const double bulge = std::sin(kPi * t);
                return glm::dvec3(side * (0.345 - 0.195 * t + 0.20 * bulge),
                                  0.86 + 0.33 * t + 0.06 * bulge, 0.0);
            },
            [](double t) { return 0.030 + 0.012 * std::pow(2 * t - 1, 2); }, {0, 0.82, 0.5, 0.88});
    }
    // Three thin legs and a wire ring that ties them.
    for (int k = 0; k < 3; ++k) {
        const double a = 2 * kPi * (k + 0.25) / 3;
        const glm::dvec3 out(std::sin(a), 0, std::cos(a));
        obj.addTube(
            10, 16,
            [=](double t) {
                return out * (0.16 + 0.22 * t * t) + glm::dvec3(0, 0.10 - 0.55 * t, 0);
            },
            [](double t) { return 0.022 - 0.010 * t; }, {0.5, 0.82, 1, 0.88});
    }
    obj.addTube(
        8, 96,
        [](double t) {
            return glm::dvec3(0.27 * std::sin(2 * kPi * t), -0.24, 0.27 * std::cos(2 * kPi * t));
        },
        [](double) { return 0.010; }, {0.5, 0.82, 1, 0.88});

    const int w = 1024, h = 1024;
    std::vector<std::uint8_t> rgb;
    rgb.reserve(static_cast<std::size_t>(w) * h * 3);
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            glm::dvec3 sum(0.0);
            for (int k = 0; k < 4; ++k)
                sum += paint((x + 0.25 + 0.5 * (k & 1)) / w, 1.0 - (y + 0.25 + 0.5 * (k >> 1)) / h,
                             x, y);
            for (int c = 0; c < 3; ++c)
                rgb.push_back(
                    static_cast<std::uint8_t>(std::clamp(sum[c] / 4, 0.0, 1.0) * 255 + 0.5));
        }
    }
    auto png = stx::encodePng(w, h, 3, 8, rgb.data(), true, 9);
    if (!png) return fail(png.error());
    const std::string mtl = "newmtl painted\nKd 1 1 1\nmap_Kd amphora.png\n";
    if (auto ok = stx::writeFile(folder / "amphora.png", *png); !ok) return fail(ok.error());
    if (auto ok = stx::writeFile(folder / "amphora.mtl", std::as_bytes(std::span(mtl))); !ok)
        return fail(ok.error());
    if (auto ok = stx::writeFile(folder / "amphora.obj", std::as_bytes(std::span(obj.text))); !ok)
        return fail(ok.error());
    return 0;
}
