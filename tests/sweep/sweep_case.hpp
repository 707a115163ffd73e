#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lib/base/result.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/model/bundle.hpp"
#include "tests/sweep/scene.hpp"

/// One random case: a scene, how it is captured, and from where it is drawn. All of it follows
/// from two numbers; fields() may change parts of it by name.
struct SweepCase {
    std::uint64_t seed = 0;
    int number = 0;

    enum Shape { ball, box, torus, cone, plate, bars, room, pair, kShapes };
    enum Layout { cube, ring, sphere, octahedral, hemiOctahedral, rig, kLayouts };

    // What is there.
    int shape = ball;
    int turned = 0;          ///< the object is turned at random
    double thickness = 0.1;  ///< of plates and bars, scene units; the object's radius is about 1
    double waves = 4;        ///< Scene::waves

    // How it is captured.
    int layout = sphere;
    int views = 8;  ///< N of ring:N, sphere:N; cameras of a rig; a side of octahedral:N
    int width = 64, height = 64;
    int orthographic = 0;
    int offCentre = 0;      ///< principal points away from the middle
    double elevation = 15;  ///< of a ring, degrees
    int depthBits = 32;

    // From where it is drawn.
    int outWidth = 96, outHeight = 80;
    int outOrthographic = 0;
    double magnification = 1;          ///< novel pixels for each reference texel, about
    double azimuth = 0, altitude = 0;  ///< degrees; of a rig: where between and around its cameras
    double distance = 1;               ///< of that of the reference cameras
    /// 0, or the number of another eye near this one; see besides().
    int beside = 0;

    /// A field by name, for `--set` and for reducing.
    struct Field {
        const char* name;
        int SweepCase::*whole = nullptr;
        double SweepCase::*number = nullptr;
    };
    [[nodiscard]] static const std::vector<Field>& fields();

    [[nodiscard]] static SweepCase draw(std::uint64_t seed, int number);
    /// Changes a field, as in "views=3". Errors: no such field, not a number.
    [[nodiscard]] stx::Result<void> set(std::string_view change);
    /// The changes that draw() needs to become this case, as in "views=3,width=24"; may be empty.
    [[nodiscard]] std::string changes() const;
    /// For people: "torus, ring:5 of 48x48, orthographic, drawn at 96x80, 2.0 times magnified".
    [[nodiscard]] std::string describe() const;
    /// The same case seen from `kBesides` other places within 15 degrees, captured with pixels that
    /// lie up to half a pixel elsewhere, by a sensor that errs otherwise.
    static constexpr int kBesides = 32;
    [[nodiscard]] std::vector<SweepCase> besides() const;
    /// Simpler cases of the same kind, the simplest first.
    [[nodiscard]] std::vector<SweepCase> simpler() const;
};

/// A case with its pictures computed.
struct Captured {
    SweepCase from;
    Scene scene;
    stx::Bundle bundle;
    stx::Camera novel;
    stx::ReferenceView truth;  ///< what the novel camera sees
};

/// Captures a case. Errors: a layout that cannot be, as when no view sees the object.
[[nodiscard]] stx::Result<Captured> capturedOf(const SweepCase& from);
