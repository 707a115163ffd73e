#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "lib/render/device/gl_object.hpp"

namespace stx::gpu {

/// A buffer that grows to what a frame needs.
struct GrowingBuffer {
    GlBuffer buffer;
    std::int64_t bytes = 0;

    void reserve(std::int64_t wanted) {
        wanted = std::max<std::int64_t>(wanted, 16);
        if (buffer && bytes >= wanted) return;
        buffer = GlBuffer::create();
        glNamedBufferStorage(buffer.get(), wanted, nullptr, GL_DYNAMIC_STORAGE_BIT);
        bytes = wanted;
    }
    template <class T>
    void upload(const std::vector<T>& values) {
        const auto size = static_cast<std::int64_t>(values.size() * sizeof(T));
        reserve(size);
        if (size > 0) glNamedBufferSubData(buffer.get(), 0, size, values.data());
    }
};

}  // namespace stx::gpu
