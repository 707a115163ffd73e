#pragma once

/// GLSL for the C++ compiler: the files beside this one are written so that both languages take
/// them. In C++ such a file is included into a struct, whose other members are what the shader has
/// as globals; the struct lives in a namespace that says `using namespace stx::glsl`. Rules for
/// those files: numbers end in f; no swizzles; vectors are built from numbers; structs are filled
/// member by member; structs that are parameters are IN, parameters that are written OUT or INOUT;
/// sums are in the order in which the processor has always added them, because its pictures must
/// stay the same to the byte.

#include <bit>
#include <cstdint>

#include <glm/glm.hpp>

#define CONSTANT static constexpr
#define INLINE inline
#define IN(T) const T&
#define OUT(T) T&
#define INOUT(T) T&
#define OUT_ARRAY(T, name, size) T(&name)[size]
#define INOUT_ARRAY(T, name, size) T(&name)[size]

namespace stx::glsl {

using uint = std::uint32_t;
using glm::ivec2;
using glm::ivec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;

using glm::abs;
using glm::ceil;
using glm::clamp;
using glm::dot;
using glm::floor;
using glm::length;
using glm::max;
using glm::min;
using glm::pow;
using glm::sqrt;

inline uint floatBitsToUint(float value) {
    return std::bit_cast<uint>(value);
}
inline float uintBitsToFloat(uint bits) {
    return std::bit_cast<float>(bits);
}
inline int bitCount(uint bits) {
    return std::popcount(bits);
}
inline int findLSB(uint bits) {
    return std::countr_zero(bits);
}

}  // namespace stx::glsl
