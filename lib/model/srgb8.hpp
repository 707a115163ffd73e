#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace stx {

/// Tables between the 256 codes of 8-bit sRGB (IEC 61966-2-1) and linear light: exact, and many
/// times faster than the power. For loops over pixels; srgb8Tables() gives the only ones.
class Srgb8Tables {
  public:
    Srgb8Tables();

    /// Linear light of a code.
    [[nodiscard]] float linear(std::uint8_t code) const { return linear_[code]; }
    /// The nearest code of linear light; 0 for NaN.
    [[nodiscard]] std::uint8_t code(float linear) const {
        if (!(linear > 0.0f)) return 0;
        if (linear >= 1.0f) return 255;
        int code = guess_[static_cast<int>(linear * (kSlots - 1))];
        while (linear >= lower_[code + 1]) ++code;
        while (linear < lower_[code]) --code;
        return static_cast<std::uint8_t>(code);
    }

  private:
    static constexpr int kSlots = 4096;
    std::array<float, 256> linear_{};
    std::array<float, 257> lower_{};  ///< where the nearest code becomes this one
    std::array<std::uint8_t, kSlots> guess_{};
};

[[nodiscard]] const Srgb8Tables& srgb8Tables();

/// Nearest 8-bit sRGB code of linear light, the inverse of linearFromSrgb8().
[[nodiscard]] inline std::uint8_t srgb8FromLinear(float linear) {
    return srgb8Tables().code(linear);
}
/// Linear light of an 8-bit sRGB code.
[[nodiscard]] inline float linearFromSrgb8(std::uint8_t code) {
    return srgb8Tables().linear(code);
}

/// The largest value of half floats, which pictures of light are stored as.
inline constexpr float kLargestHalf = 65504.0f;

/// srgbFromLinear() and linearFromSrgb() of values 0..1 (others are clamped), by tables: within a
/// thousandth of an 8-bit step, and many times faster.
[[nodiscard]] float srgbByTable(float linear);
[[nodiscard]] float linearByTable(float coded);
/// srgbByTable() of values above 1, too, where the curve goes on.
[[nodiscard]] float srgbBeyondOne(float linear);

/// The table of linearByTable(), for loops over pixels; linearTable() gives the only one.
class LinearTable {
  public:
    LinearTable();

    /// linearByTable() of a value.
    [[nodiscard]] float linear(float coded) const {
        if (!(coded > 0.0f)) return 0.0f;
        const float s = std::min(coded, 1.0f) * kSteps;
        const int i = std::min(static_cast<int>(s), kSteps - 1);
        return values_[i] + (values_[i + 1] - values_[i]) * (s - static_cast<float>(i));
    }

    static constexpr int kSteps = 1024;
    /// Linear light of 0 to 1 in kSteps steps, both ends with it.
    [[nodiscard]] const float* values() const { return values_.data(); }

  private:
    std::array<float, kSteps + 1> values_{};
};

[[nodiscard]] const LinearTable& linearTable();

}  // namespace stx
