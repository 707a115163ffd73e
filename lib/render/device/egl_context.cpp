#include "lib/render/device/egl_context.hpp"

#include <dlfcn.h>

#include <epoxy/egl.h>
#include <epoxy/gl.h>

namespace stx::gpu {
namespace {

constexpr const char* kPackages =
    "install Debian's libegl1, libopengl0 and libgl1-mesa-dri (for NVIDIA: libegl-nvidia0)";

Faults& faults() {
    static Faults f;
    return f;
}

/// libepoxy ends the process when a library it needs is missing, so look before it does.
bool canLoad(const char* name) {
    void* handle = dlopen(name, RTLD_LAZY | RTLD_LOCAL);
    if (handle) dlclose(handle);
    return handle != nullptr;
}

std::string eglErrorText(EGLint code) {
    switch (code) {
        case EGL_NOT_INITIALIZED:
            return "EGL_NOT_INITIALIZED: no driver for it";
        case EGL_BAD_ACCESS:
            return "EGL_BAD_ACCESS: in use by another thread, or no permission";
        case EGL_BAD_ALLOC:
            return "EGL_BAD_ALLOC: out of memory";
        case EGL_BAD_ATTRIBUTE:
            return "EGL_BAD_ATTRIBUTE";
        case EGL_BAD_CONFIG:
            return "EGL_BAD_CONFIG";
        case EGL_BAD_CONTEXT:
            return "EGL_BAD_CONTEXT";
        case EGL_BAD_DISPLAY:
            return "EGL_BAD_DISPLAY";
        case EGL_BAD_MATCH:
            return "EGL_BAD_MATCH: this OpenGL version or profile is not offered";
        case EGL_CONTEXT_LOST:
            return "EGL_CONTEXT_LOST: the device was reset";
        default:
            return fmt::format("EGL error 0x{:04x}", static_cast<unsigned>(code));
    }
}

bool hasWord(const char* list, std::string_view word) {
    const std::string_view text = list ? list : "";
    for (std::size_t at = 0; (at = text.find(word, at)) != std::string_view::npos; ++at) {
        const bool begins = at == 0 || text[at - 1] == ' ';
        const std::size_t end = at + word.size();
        if (begins && (end == text.size() || text[end] == ' ')) return true;
    }
    return false;
}

struct Candidate {
    EGLDisplay display = EGL_NO_DISPLAY;
    std::string platform;
    std::string label;  ///< for messages: "EGL device 0"
};

/// Displays worth trying, each EGL device first and Mesa's surfaceless platform last.
std::vector<Candidate> candidates(std::vector<std::string>& tried) {
    std::vector<Candidate> out;
    if (!canLoad("libEGL.so.1")) {
        tried.emplace_back("libEGL.so.1 cannot be loaded");
        return out;
    }
    if (!canLoad("libOpenGL.so.0") && !canLoad("libGL.so.1")) {
        tried.emplace_back("neither libOpenGL.so.0 nor libGL.so.1 can be loaded");
        return out;
    }
    const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (!client) {
        eglGetError();
        tried.emplace_back("EGL has no client extensions (too old)");
        return out;
    }
    if (hasWord(client, "EGL_EXT_platform_device") &&
        (hasWord(client, "EGL_EXT_device_enumeration") || hasWord(client, "EGL_EXT_device_base"))) {
        std::array<EGLDeviceEXT, 64> devices{};
        EGLint count = 0;
        if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count)) {
            for (EGLint i = 0; i < count; ++i) {
                const EGLDisplay display =
                    eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr);
                if (display != EGL_NO_DISPLAY)
                    out.push_back(
                        {display, "EGL_EXT_platform_device", fmt::format("EGL device {}", i)});
                else
                    tried.push_back(
                        fmt::format("EGL device {}: {}", i, eglErrorText(eglGetError())));
            }
            if (count == 0) tried.emplace_back("EGL_EXT_platform_device lists no device");
        } else {
            tried.push_back("EGL_EXT_platform_device: " + eglErrorText(eglGetError()));
        }
    } else {
        tried.emplace_back("EGL_EXT_platform_device is not offered");
    }
    if (hasWord(client, "EGL_MESA_platform_surfaceless")) {
        const EGLDisplay display =
            eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
        if (display != EGL_NO_DISPLAY)
            out.push_back({display, "EGL_MESA_platform_surfaceless", "Mesa surfaceless"});
        else
            tried.push_back("Mesa surfaceless: " + eglErrorText(eglGetError()));
    } else {
        tried.emplace_back("EGL_MESA_platform_surfaceless is not offered");
    }
    return out;
}

std::string join(const std::vector<std::string>& parts) {
    std::string out;
    for (const auto& p : parts) out += (out.empty() ? "" : "; ") + p;
    return out;
}

bool isSoftware(std::string_view renderer) {
    for (const std::string_view word : {"llvmpipe", "softpipe", "swrast", "Software Rasterizer"})
        if (renderer.find(word) != std::string_view::npos) return true;
    return false;
}

}  // namespace

struct EglContext::Impl {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;
    Device device;
    ContextAbilities abilities;

    // The display itself is never terminated: EGL hands the same one to everybody in the process,
    // and terminating it would take other renderers' contexts along.
    ~Impl() {
        if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
    }
};

namespace {

/// The newest context of what we know how to use, which says when its device was reset where that
/// is possible (`egl15`). EGL_NO_CONTEXT: there is none.
EGLContext createContext(EGLDisplay display, EGLConfig config, EglContext::Profile profile,
                         bool egl15) {
    constexpr std::array<std::array<EGLint, 2>, 2> kVersions{{{4, 5}, {3, 3}}};
    for (const auto& version : kVersions) {
        if (faults().onlyOld && version[0] > 3) continue;
        for (const bool robust : {true, false}) {
            if (robust && !egl15) continue;
            std::vector<EGLint> attributes = {EGL_CONTEXT_MAJOR_VERSION,
                                              version[0],
                                              EGL_CONTEXT_MINOR_VERSION,
                                              version[1],
                                              EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                              profile == EglContext::Profile::core
                                                  ? EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT
                                                  : EGL_CONTEXT_OPENGL_COMPATIBILITY_PROFILE_BIT};
            if (robust) {
                attributes.push_back(EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY);
                attributes.push_back(EGL_LOSE_CONTEXT_ON_RESET);
            }
            attributes.push_back(EGL_NONE);
            EGLContext made = eglCreateContext(display, config, EGL_NO_CONTEXT, attributes.data());
            if (made != EGL_NO_CONTEXT) return made;
        }
    }
    return EGL_NO_CONTEXT;
}

/// Asks the current context what its device is and can do.
void askDevice(Device& device, ContextAbilities& abilities) {
    const auto text = [](GLenum name) {
        const auto* s = reinterpret_cast<const char*>(glGetString(name));
        return std::string(s ? s : "");
    };
    device.name = text(GL_RENDERER);
    device.version = text(GL_VERSION);
    device.software = isSoftware(device.name);
    abilities.modern = epoxy_gl_version() >= 45 && !faults().onlyOld;
    GLint value = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &value);
    if (faults().maxTextureSize > 0) value = std::min(value, faults().maxTextureSize);
    device.maxTextureSize = abilities.maxTextureSize = value;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &value);
    abilities.maxTextureLayers = value;
    GLint64 bytes = 0;
    if (abilities.modern) glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &bytes);
    abilities.maxStorageBytes = bytes;
    abilities.atomicInt64 =
        faults().atomicInt64.value_or(epoxy_has_gl_extension("GL_NV_shader_atomic_int64") &&
                                      epoxy_has_gl_extension("GL_ARB_gpu_shader_int64"));
    abilities.atomicFloat =
        faults().atomicFloat.value_or(epoxy_has_gl_extension("GL_NV_shader_atomic_float"));
    // Mesa's softpipe counts gl_VertexID from 0 again after each 4096 vertices.
    if (device.name == "softpipe") abilities.verticesAtOnce = 4096;
    if (abilities.modern) {
        GLint strategy = 0;
        glGetIntegerv(GL_RESET_NOTIFICATION_STRATEGY, &strategy);
        abilities.resetStatus = strategy == GL_LOSE_CONTEXT_ON_RESET;
    }
    while (glGetError() != GL_NO_ERROR) {
    }
}

/// Opens a context on a display and asks what it is. The error is a clause for the list of
/// attempts.
tl::expected<std::unique_ptr<EglContext::Impl>, std::string> open(const Candidate& candidate,
                                                                  EglContext::Profile profile) {
    auto impl = std::make_unique<EglContext::Impl>();
    impl->display = candidate.display;
    EGLint major = 0, minor = 0;
    if (!eglInitialize(candidate.display, &major, &minor))
        return tl::unexpected(candidate.label + ": " + eglErrorText(eglGetError()));
    const char* extensions = eglQueryString(candidate.display, EGL_EXTENSIONS);
    if (!hasWord(extensions, "EGL_KHR_surfaceless_context"))
        return tl::unexpected(candidate.label + ": no EGL_KHR_surfaceless_context");
    if (!eglBindAPI(EGL_OPENGL_API))
        return tl::unexpected(candidate.label + ": offers no desktop OpenGL");

    EGLConfig config = EGL_NO_CONFIG_KHR;
    if (!hasWord(extensions, "EGL_KHR_no_config_context")) {
        const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                                 EGL_OPENGL_BIT, EGL_NONE};
        EGLint count = 0;
        if (!eglChooseConfig(candidate.display, wanted, &config, 1, &count) || count < 1)
            return tl::unexpected(candidate.label + ": no configuration for OpenGL");
    }
    impl->context = createContext(candidate.display, config, profile, major > 1 || minor >= 5);
    if (impl->context == EGL_NO_CONTEXT)
        return tl::unexpected(candidate.label + ": no OpenGL 3.3 context (" +
                              eglErrorText(eglGetError()) + ")");
    if (!eglMakeCurrent(candidate.display, EGL_NO_SURFACE, EGL_NO_SURFACE, impl->context))
        return tl::unexpected(candidate.label + ": " + eglErrorText(eglGetError()));

    impl->device.platform = candidate.platform;
    askDevice(impl->device, impl->abilities);
    eglMakeCurrent(candidate.display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    return impl;
}

/// Opens every display, hardware first; the surfaceless platform only where no device gave a
/// software context already, since it would be the same driver once more.
std::vector<std::unique_ptr<EglContext::Impl>> openAll(EglContext::Profile profile,
                                                       std::vector<std::string>& tried) {
    std::vector<std::unique_ptr<EglContext::Impl>> out;
    for (const auto& candidate : candidates(tried)) {
        auto opened = open(candidate, profile);
        if (!opened) {
            tried.push_back(std::move(opened.error()));
            continue;
        }
        const bool seen = std::any_of(out.begin(), out.end(), [&](const auto& other) {
            return other->device.name == (*opened)->device.name &&
                   candidate.platform == "EGL_MESA_platform_surfaceless";
        });
        if (!seen) out.push_back(std::move(*opened));
    }
    std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) {
        return !a->device.software && b->device.software;
    });
    for (std::size_t i = 0; i < out.size(); ++i) out[i]->device.index = static_cast<int>(i);
    return out;
}

}  // namespace

EglContext::EglContext(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
EglContext::~EglContext() = default;

Result<std::shared_ptr<EglContext>> EglContext::create(int device, Profile profile) {
    std::vector<std::string> tried;
    auto all = openAll(profile, tried);
    if (all.empty())
        return fail(ErrorCode::unsupported, "no OpenGL 3.3 without a display here; tried: {}; {}",
                    join(tried), kPackages);
    if (device >= static_cast<int>(all.size()) || device < -1) {
        std::vector<std::string> names;
        for (const auto& one : all)
            names.push_back(fmt::format("{} ({})", one->device.index, one->device.name));
        return fail(ErrorCode::usage, "device {} does not exist; the devices are {}", device,
                    fmt::join(names, ", "));
    }
    return std::shared_ptr<EglContext>(new EglContext(std::move(all[std::max(device, 0)])));
}

const Device& EglContext::device() const {
    return impl_->device;
}
const ContextAbilities& EglContext::abilities() const {
    return impl_->abilities;
}

Result<void> EglContext::requireModern(std::string_view what, std::string_view instead) const {
    if (impl_->abilities.modern) return {};
    return fail(ErrorCode::unsupported, "{} needs OpenGL 4.5, and '{}' has {}; use {}", what,
                impl_->device.name, impl_->device.version, instead);
}

void setFaultsForTests(const Faults& f) {
    faults() = f;
}

Result<EglContext::Current> EglContext::makeCurrent() {
    eglBindAPI(EGL_OPENGL_API);
    if (!eglMakeCurrent(impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, impl_->context))
        return fail(ErrorCode::failed, "the OpenGL context of '{}' cannot be used: {}",
                    impl_->device.name, eglErrorText(eglGetError()));
    return Current(this);
}

EglContext::Current::~Current() {
    if (context_)
        eglMakeCurrent(context_->impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

Result<void> EglContext::check(std::string_view doing) const {
    // errorAfter counts down to an error that stays while the test wants it.
    const bool faulty = faults().errorAfter >= 0 && faults().errorAfter-- == 0;
    const GLenum injected = faulty ? faults().error : GL_NO_ERROR;
    if (injected == GL_CONTEXT_LOST ||
        (impl_->abilities.resetStatus && glGetGraphicsResetStatus() != GL_NO_ERROR))
        return fail(ErrorCode::failed,
                    "'{}' was reset or lost while {}; make the renderer anew, or use --backend cpu",
                    impl_->device.name, doing);
    const GLenum first = injected != GL_NO_ERROR ? injected : glGetError();
    if (first == GL_NO_ERROR) return {};
    for (int i = 0; i < 64 && glGetError() != GL_NO_ERROR; ++i) {
    }
    if (first == GL_OUT_OF_MEMORY)
        return fail(
            ErrorCode::failed,
            "'{}' ran out of memory while {}; use fewer or smaller views, a smaller frame, or "
            "--backend cpu",
            impl_->device.name, doing);
    return fail(ErrorCode::failed, "OpenGL error 0x{:04x} while {} on '{}'", first, doing,
                impl_->device.name);
}

bool mayHaveHardware() {
    if (!canLoad("libEGL.so.1")) return false;
    const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    // Where devices cannot be listed they have to be opened.
    if (!hasWord(client, "EGL_EXT_platform_device") ||
        !(hasWord(client, "EGL_EXT_device_enumeration") || hasWord(client, "EGL_EXT_device_base")))
        return true;
    std::array<EGLDeviceEXT, 64> devices{};
    EGLint count = 0;
    if (!eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count))
        return true;
    return std::any_of(devices.begin(), devices.begin() + count, [](EGLDeviceEXT device) {
        return !hasWord(eglQueryDeviceStringEXT(device, EGL_EXTENSIONS),
                        "EGL_MESA_device_software");
    });
}

std::vector<Device> enumerateDevices(std::vector<std::string>& tried) {
    std::vector<Device> out;
    for (const auto& impl : openAll(EglContext::Profile::core, tried)) out.push_back(impl->device);
    return out;
}

}  // namespace stx::gpu
