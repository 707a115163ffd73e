#pragma once

#include <cmath>
#include <random>
#include <string>

#include "lib/model/bundle.hpp"

/// A bundle of `views` random views: every kind of number that a file could lose. Colours under
/// alpha 0 are bled, as everywhere in the model.
inline stx::Bundle smallBundle(int views, int depthBits, bool v2, bool linear, unsigned seed = 1) {
    std::mt19937 random(seed);
    const auto unit = [&] { return std::uniform_real_distribution<double>(0.0, 1.0)(random); };
    stx::Bundle bundle;
    bundle.title = "a small bündle";
    for (int i = 0; i < views; ++i) {
        stx::ReferenceView v;
        v.name = "view " + std::to_string(i);
        const int width = 17 + 5 * i, height = 23 + 3 * i;
        v.camera = stx::Camera::fromFieldOfView(
            {unit() * 10 - 5, unit() / 3, -unit()},
            stx::quatFromAxisAngle({unit() - 0.5, unit() - 0.5, unit(), unit() * 3}),
            {0.3 + unit(), 0.3 + unit()}, i % 2 == 1, width, height);
        v.camera.cx += unit();
        v.camera.cy -= unit();
        v.nearPlane = 0.1 + unit();
        v.farPlane = v.nearPlane + 1 + unit();
        v.depthBits = depthBits;
        stx::Rgba8Image image(width, height);
        stx::RgbaFloatImage floats(width, height);
        v.depth = stx::Image<float>(width, height, stx::kNoDepth);
        if (v2) v.normal = v.splatU = v.splatV = stx::Image<glm::vec3>(width, height);
        const stx::DepthCode code = v.depthCode();
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                const bool point = random() % 4 != 0;
                const auto byte = [&] { return static_cast<std::uint8_t>(random()); };
                if (point) {
                    const int alpha = random() % 3 == 0 ? 1 + random() % 255 : 255;
                    image.at(x, y) = {byte(), byte(), byte(), alpha};
                    floats.at(x, y) = {unit() * 4, unit(), unit() / 100, 1.0};
                    v.depth.at(x, y) = static_cast<float>(
                        depthBits == 32 ? v.nearPlane + unit() * (v.farPlane - v.nearPlane)
                                        : code.decode(1 + random() % code.dmax));
                    if (v2) {
                        v.normal.at(x, y) = glm::vec3(
                            glm::normalize(glm::dvec3(unit() - 0.5, unit() - 0.5, unit() + 0.1)));
                        v.splatU.at(x, y) = {unit() / 50, unit() / 50, -unit() / 50};
                        v.splatV.at(x, y) = {-unit() / 50, unit() / 50, unit() / 50};
                    }
                }
            }
        }
        v.texture = linear ? stx::Texture(std::move(floats)) : stx::Texture(std::move(image));
        stx::bleedColour(v.texture);
        bundle.views.push_back(std::move(v));
    }
    bundle.bounds = bundle.computeBounds();
    return bundle;
}

/// Empty when both bundles are the same to the bit, else the first difference.
inline std::string differenceOf(const stx::Bundle& a, const stx::Bundle& b) {
    if (a.title != b.title) return "title";
    if (a.bounds != b.bounds) return "bounds";
    if (a.views.size() != b.views.size()) return "number of views";
    for (std::size_t i = 0; i < a.views.size(); ++i) {
        const auto& v = a.views[i];
        const auto& w = b.views[i];
        const auto in = [&](const char* what) { return "view " + std::to_string(i) + ": " + what; };
        if (v.name != w.name) return in("name");
        if (!(v.camera == w.camera)) return in("camera");
        if (v.nearPlane != w.nearPlane || v.farPlane != w.farPlane) return in("planes");
        if (v.depthBits != w.depthBits) return in("depthBits");
        if (!(v.texture == w.texture)) return in("texture");
        if (!(v.depth == w.depth)) return in("depth");
        if (!(v.normal == w.normal)) return in("normal");
        if (!(v.splatU == w.splatU) || !(v.splatV == w.splatV)) return in("splat");
    }
    return {};
}
