#pragma once

#include <map>
#include <optional>
#include <string>

#include "lib/render/renderer.hpp"
#include "tests/sweep/sweep_case.hpp"

/// How a case is drawn.
struct Drawn {
    stx::RenderMode mode = stx::RenderMode::surface;
    stx::Quality quality = stx::Quality::normal;
    stx::Backend backend = stx::Backend::cpu;

    auto operator<=>(const Drawn&) const = default;
};

/// Draws one picture without filling (what is filled in is a guess, which no rule can judge).
/// `filled` draws it as users get it. Errors: those of the renderer.
[[nodiscard]] stx::Result<stx::Frame> drawBundle(const stx::Bundle& bundle,
                                                 const stx::Camera& camera, const Drawn& how,
                                                 bool filled = false);

/// What the rules of one case share: its pictures, and which places its views show.
class Pictures {
  public:
    explicit Pictures(const Stage& stage);

    [[nodiscard]] const Stage& stage() const { return stage_; }
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
    /// PSNR of a frame against the truth, over the whole frame, before black.
    [[nodiscard]] double psnr(const stx::Frame& frame) const;

  private:
    const Stage& stage_;
    stx::Image<std::uint8_t> seenBy_, empty_;
    std::map<Drawn, stx::Frame> drawn_;
};

/// PSNR over R, G and B of two frames before black, 8-bit steps rounded away; 99 when they are the
/// same.
[[nodiscard]] double psnrBetween(const stx::Frame& a, const stx::Frame& b);
