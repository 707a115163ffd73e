#pragma once

#include <cstddef>
#include <cstdint>

#include "lib/render/device/egl_context.hpp"
#include "lib/render/device/gl_object.hpp"

namespace stx::gpu {

/// Waits for a fence and deletes it; does nothing without one. Errors: the device was lost.
[[nodiscard]] inline Result<void> waitFor(GLsync& fence, const EglContext& context) {
    if (!fence) return {};
    constexpr GLuint64 kSecond = 1'000'000'000;
    GLenum state = GL_TIMEOUT_EXPIRED;
    Result<void> alive;
    // Drawing may take long; a device that is lost meanwhile never signals.
    while (state == GL_TIMEOUT_EXPIRED && alive) {
        state = glClientWaitSync(fence, GL_SYNC_FLUSH_COMMANDS_BIT, kSecond);
        alive = context.check("drawing");
    }
    glDeleteSync(fence);
    fence = nullptr;
    STX_CHECK(alive);
    if (state == GL_WAIT_FAILED)
        return fail(ErrorCode::failed, "'{}' was lost while drawing", context.device().name);
    return {};
}

/// Where pictures arrive on their way back: memory that the device writes and the processor reads,
/// while the next picture is drawn. OpenGL 4.5.
struct ReturnedBuffer {
    GlBuffer buffer;
    std::int64_t bytes = 0;
    const std::byte* memory = nullptr;
    GLsync done = nullptr;

    void reserve(std::int64_t wanted) {
        if (buffer && bytes >= wanted) return;
        constexpr GLbitfield kAccess =
            GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
        buffer = GlBuffer::create();
        glNamedBufferStorage(buffer.get(), wanted, nullptr, kAccess | GL_CLIENT_STORAGE_BIT);
        memory =
            static_cast<const std::byte*>(glMapNamedBufferRange(buffer.get(), 0, wanted, kAccess));
        bytes = memory ? wanted : 0;
    }
    /// After the last command that writes it.
    void fence() {
        glMemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
        done = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
        glFlush();
    }
    /// Until it has arrived; does nothing when it has. Wanted before the next picture is drawn,
    /// too: on an NVIDIA H200 (driver 580.159) what was begun while another was under way came
    /// out empty, until a glFinish() came between. Memory barriers did not help; why is not known.
    [[nodiscard]] Result<void> wait(const EglContext& context) { return waitFor(done, context); }
};

}  // namespace stx::gpu
