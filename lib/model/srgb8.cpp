#include "lib/model/srgb8.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "lib/model/texture.hpp"

namespace stx {

Srgb8Tables::Srgb8Tables() {
    const auto exact = [](double coded) {
        return coded <= 0.04045 ? coded / 12.92 : std::pow((coded + 0.055) / 1.055, 2.4);
    };
    for (int i = 0; i < 256; ++i) {
        linear_[i] = static_cast<float>(exact(i / 255.0));
        lower_[i] = static_cast<float>(exact((i - 0.5) / 255.0));
    }
    lower_[0] = 0.0f;
    lower_[256] = std::numeric_limits<float>::infinity();
    int code = 0;
    for (int slot = 0; slot < kSlots; ++slot) {
        while (lower_[code + 1] <= static_cast<float>(slot) / (kSlots - 1)) ++code;
        guess_[slot] = static_cast<std::uint8_t>(code);
    }
}

const Srgb8Tables& srgb8Tables() {
    static const Srgb8Tables tables;
    return tables;
}

// Interpolation between 4096 steps is far below an 8-bit step beyond the toe.
float srgbByTable(float linear) {
    static const auto table = [] {
        std::array<float, 4097> t{};
        for (int i = 0; i <= 4096; ++i) t[i] = srgbFromLinear(i / 4096.0f);
        return t;
    }();
    if (!(linear > 0.0f)) return 0.0f;
    if (linear >= 1.0f) return 1.0f;
    if (linear < 0.01f) return srgbFromLinear(linear);
    const float s = linear * 4096.0f;
    const int i = static_cast<int>(s);
    return table[i] + (table[i + 1] - table[i]) * (s - i);
}

float srgbBeyondOne(float linear) {
    return linear > 1.0f ? srgbFromLinear(linear) : srgbByTable(linear);
}

float linearByTable(float coded) {
    return linearTable().linear(coded);
}

LinearTable::LinearTable() {
    for (int i = 0; i <= kSteps; ++i) values_[i] = linearFromSrgb(static_cast<float>(i) / kSteps);
}

const LinearTable& linearTable() {
    static const LinearTable table;
    return table;
}

}  // namespace stx
