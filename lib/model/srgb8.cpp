#include "lib/model/srgb8.hpp"

#include <cmath>
#include <limits>

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

}  // namespace stx
