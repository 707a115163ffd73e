#pragma once

#include <map>
#include <optional>
#include <string>

#include "lib/render/api/renderer.hpp"
#include "tests/sweep/sweep_case.hpp"

/// Fewer pixels than this say nothing about a share of them.
inline constexpr std::int64_t kFewest = 100;

/// How a case is drawn.
struct Drawn {
    stx::RenderMode mode = stx::RenderMode::surface;
    stx::Quality quality = stx::Quality::normal;
    stx::Backend backend = stx::Backend::cpu;
    bool refined = true;  ///< --refine auto, else off

    auto operator<=>(const Drawn&) const = default;
    /// "splat" or "surface".
    [[nodiscard]] const char* name() const {
        return mode == stx::RenderMode::splat ? "splat" : "surface";
    }
};

/// Cosine of the angle between a ray and a normal. Steeper than this (72 degrees), a texel is more
/// than three times as deep as wide.
constexpr double kGrazing = 0.3;

/// Draws one picture without filling (what is filled in is a guess, which no rule can judge).
/// `filled` draws it as users get it. Errors: those of the renderer.
[[nodiscard]] stx::Result<stx::Frame> drawBundle(const stx::Bundle& bundle,
                                                 const stx::Camera& camera, const Drawn& how,
                                                 bool filled = false);

/// What the rules of one case share: its pictures, and which places its views show.
class Pictures {
  public:
    explicit Pictures(const Captured& captured);

    [[nodiscard]] const Captured& captured() const { return captured_; }
    /// drawBundle() of the case; drawn once.
    [[nodiscard]] stx::Result<const stx::Frame*> of(const Drawn& how);
    /// How many views show the place of a novel pixel for sure: the nine pixels around it are on
    /// its surface, which is not seen at a grazing angle. 0 where the truth is not one solid
    /// surface.
    [[nodiscard]] const stx::Image<std::uint8_t>& seenBy() const { return seenBy_; }
    /// 255 where the truth is empty, at least a reference texel away from the object.
    [[nodiscard]] const stx::Image<std::uint8_t>& empty() const { return empty_; }
    /// Pixels of seenBy() that count at least `least`.
    [[nodiscard]] std::int64_t seenCount(int least) const;
    /// Percent of the pixels that at least `least` views show for sure which a frame leaves open,
    /// or of those of empty() which it covers, without guesses as in psnr(). Nothing where they are
    /// fewer than a hundred.
    [[nodiscard]] std::optional<double> openShare(const stx::Frame& frame, int least) const;
    [[nodiscard]] std::optional<double> drawnShare(const stx::Frame& frame) const;
    /// PSNR of a frame against the truth, before black, without the pixels where the truth shows
    /// something that no view shows, or nothing where no view looks through: what is drawn there
    /// is a guess. `frame` may be a part of the
    /// picture whose pixel (0, 0) is at `first`.
    [[nodiscard]] double psnr(const stx::Frame& frame, glm::ivec2 first = {0, 0}) const;
    /// The same on the pixels of a mask that are not 0; nothing where fewer than a hundred of them
    /// are judged.
    [[nodiscard]] std::optional<double> psnrWhere(const stx::Frame& frame,
                                                  const stx::Image<std::uint8_t>& mask) const;
    /// The same without what lies within a texel of an outline or of a crease of the truth.
    /// Nothing where that leaves fewer than a hundred pixels.
    [[nodiscard]] std::optional<double> psnrAwayFromOutlines(const stx::Frame& frame) const;

  private:
    const Captured& captured_;
    void findGuesses();
    void findOutlines();
    [[nodiscard]] double squaredError(const stx::Frame& frame, int x, int y,
                                      glm::ivec2 first = {0, 0}) const;

    stx::Image<std::uint8_t> seenBy_, empty_;
    stx::Image<std::uint8_t> guessed_;      ///< 1 = not judged
    stx::Image<std::uint8_t> nearOutline_;  ///< 1 = within a texel of an outline or a crease
    std::map<Drawn, stx::Frame> drawn_;
};

/// PSNR over R, G and B of two frames before black; 99 when they are the same.
[[nodiscard]] double psnrBetween(const stx::Frame& a, const stx::Frame& b);

/// By how many dB a picture is worse than another, both against the truth. Nobody sees an error of
/// less than one step of 8 bits (48 dB): what is better than that counts as that good.
[[nodiscard]] double worseBy(double psnr, double than);
