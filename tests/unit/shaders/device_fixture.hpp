#pragma once

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "lib/render/device/egl_context.hpp"
#include "lib/render/device/growing_buffer.hpp"
#include "lib/render/device/shader_program.hpp"

namespace stx::test {

/// A device that runs single compute shaders on buffers that a test fills.
struct Device {
    std::shared_ptr<gpu::EglContext> context;
    gpu::EglContext::Current current;
    std::map<GLuint, gpu::GrowingBuffer> buffers;  ///< by binding of storage
    gpu::GrowingBuffer block;

    /// Nothing where no device has compute shaders.
    [[nodiscard]] static std::unique_ptr<Device> open() {
        auto made = gpu::EglContext::create(-1, gpu::EglContext::Profile::core);
        if (!made || !(*made)->abilities().modern) return {};
        auto held = (*made)->makeCurrent();
        if (!held) return {};
        return std::unique_ptr<Device>(new Device{std::move(*made), std::move(*held), {}, {}});
    }

    template <class T>
    void storage(GLuint binding, const std::vector<T>& values) {
        buffers[binding].upload(values);
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffers[binding].buffer.get());
    }
    template <class T>
    void uniforms(GLuint binding, const T& values) {
        block.upload(std::vector<T>{values});
        glBindBufferBase(GL_UNIFORM_BUFFER, binding, block.buffer.get());
    }
    template <class T>
    [[nodiscard]] std::vector<T> read(GLuint binding, std::size_t count) const {
        std::vector<T> out(count);
        glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
        glGetNamedBufferSubData(buffers.at(binding).buffer.get(), 0,
                                static_cast<GLsizeiptr>(count * sizeof(T)), out.data());
        return out;
    }
    void run(
        const std::string& header, const std::vector<gpu::ShaderStage>& stages, GLuint groups,
        const std::function<void()>& setUniforms = [] {}) const {
        auto program = gpu::buildProgram(header, stages);
        ASSERT_TRUE(program) << program.error().text();
        glMemoryBarrier(GL_ALL_BARRIER_BITS);
        glUseProgram(program->get());
        setUniforms();
        glDispatchCompute(groups, 1, 1);
        auto done = context->check("running a shader");
        EXPECT_TRUE(done) << done.error().text();
    }
};

}  // namespace stx::test
