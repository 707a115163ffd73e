#pragma once

#include <utility>

#include <epoxy/gl.h>

namespace stx::gpu {

/// Owns one OpenGL name. Made and destroyed while its context is current.
template <class Traits>
class GlObject {
  public:
    GlObject() = default;
    explicit GlObject(GLuint name) : name_(name) {}
    GlObject(GlObject&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
    GlObject& operator=(GlObject&& other) noexcept {
        std::swap(name_, other.name_);
        return *this;
    }
    GlObject(const GlObject&) = delete;
    GlObject& operator=(const GlObject&) = delete;
    ~GlObject() {
        if (name_) Traits::destroy(name_);
    }

    /// A new object; `args` is the target for those made with one (textures).
    template <class... Args>
    [[nodiscard]] static GlObject create(Args... args) {
        return GlObject(Traits::create(args...));
    }
    /// A name that becomes an object when first bound: all that OpenGL 3.3 has.
    [[nodiscard]] static GlObject generate() { return GlObject(Traits::generate()); }
    [[nodiscard]] GLuint get() const { return name_; }
    explicit operator bool() const { return name_ != 0; }

  private:
    GLuint name_ = 0;
};

/// Of objects whose names OpenGL makes and deletes by the list: the addresses of its functions.
template <auto* kCreate, auto* kGenerate, auto* kDelete>
struct ListedTraits {
    template <class... Target>
    static GLuint create(Target... target) {
        GLuint n = 0;
        (*kCreate)(target..., 1, &n);
        return n;
    }
    static GLuint generate() {
        GLuint n = 0;
        (*kGenerate)(1, &n);
        return n;
    }
    static void destroy(GLuint n) { (*kDelete)(1, &n); }
};
struct ShaderTraits {
    static GLuint create(GLenum type) { return glCreateShader(type); }
    static void destroy(GLuint n) { glDeleteShader(n); }
};
struct ProgramTraits {
    static GLuint create() { return glCreateProgram(); }
    static void destroy(GLuint n) { glDeleteProgram(n); }
};

using GlBuffer = GlObject<ListedTraits<&glCreateBuffers, &glGenBuffers, &glDeleteBuffers>>;
using GlTexture = GlObject<ListedTraits<&glCreateTextures, &glGenTextures, &glDeleteTextures>>;
using GlFramebuffer =
    GlObject<ListedTraits<&glCreateFramebuffers, &glGenFramebuffers, &glDeleteFramebuffers>>;
using GlVertexArray =
    GlObject<ListedTraits<&glCreateVertexArrays, &glGenVertexArrays, &glDeleteVertexArrays>>;
using GlShader = GlObject<ShaderTraits>;
using GlProgram = GlObject<ProgramTraits>;

}  // namespace stx::gpu
