#pragma once

#include <cstdint>
#include <cstring>

#include <glm/glm.hpp>

namespace stx {

/// Four channels at once. GCC and clang make vector instructions of it on every processor.
using Float4 = float __attribute__((vector_size(16)));

using Int4 = std::int32_t __attribute__((vector_size(16)));

inline Float4 floatsOf(glm::u8vec4 p) {
    return __builtin_convertvector((Int4{p.r, p.g, p.b, p.a}), Float4);
}

inline Float4 floatsOf(const glm::vec4& p) {
    Float4 out;
    std::memcpy(&out, &p, sizeof(out));
    return out;
}

inline glm::vec4 vectorOf(Float4 v) {
    return {v[0], v[1], v[2], v[3]};
}

}  // namespace stx
