#include "lib/render/device/shader_program.hpp"

namespace stx::gpu {
namespace {

std::string firstLines(std::string log) {
    for (auto& c : log) {
        if (c == '\n' || c == '\r' || c == '\0') c = ' ';
    }
    if (log.size() > 300) log.resize(300);
    while (!log.empty() && log.back() == ' ') log.pop_back();
    return log;
}

}  // namespace

Result<GlProgram> buildProgram(const std::string& header, std::span<const ShaderStage> stages) {
    auto program = GlProgram::create();
    std::vector<GlShader> shaders;
    for (const auto& stage : stages) {
        auto shader = GlShader::create(stage.type);
        std::vector<const char*> texts{header.c_str()};
        std::vector<GLint> lengths{static_cast<GLint>(header.size())};
        for (const auto piece : stage.pieces) {
            texts.push_back(piece.data());
            lengths.push_back(static_cast<GLint>(piece.size()));
        }
        glShaderSource(shader.get(), static_cast<GLsizei>(texts.size()), texts.data(),
                       lengths.data());
        glCompileShader(shader.get());
        GLint ok = 0;
        glGetShaderiv(shader.get(), GL_COMPILE_STATUS, &ok);
        if (!ok) {
            std::string log(4096, '\0');
            glGetShaderInfoLog(shader.get(), static_cast<GLsizei>(log.size()), nullptr, log.data());
            return fail(ErrorCode::failed, "the driver does not compile the shader {}: {}",
                        stage.name, firstLines(log.c_str()));
        }
        glAttachShader(program.get(), shader.get());
        shaders.push_back(std::move(shader));
    }
    glLinkProgram(program.get());
    GLint ok = 0;
    glGetProgramiv(program.get(), GL_LINK_STATUS, &ok);
    if (!ok) {
        std::string log(4096, '\0');
        glGetProgramInfoLog(program.get(), static_cast<GLsizei>(log.size()), nullptr, log.data());
        return fail(ErrorCode::failed, "the driver does not link the shader {}: {}", stages[0].name,
                    firstLines(log.c_str()));
    }
    return program;
}

ShaderText shaderText(std::string name, const std::string& header, const ShaderStage& stage) {
    ShaderText out{std::move(name),
                   stage.type == GL_VERTEX_SHADER     ? "vert"
                   : stage.type == GL_FRAGMENT_SHADER ? "frag"
                                                      : "comp",
                   header};
    for (const auto piece : stage.pieces) out.text += piece;
    return out;
}

}  // namespace stx::gpu
