#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/render/api/renderer.hpp"

namespace stx::gpu {

/// What a context can do beyond OpenGL 3.3.
struct ContextAbilities {
    bool modern = false;  ///< OpenGL 4.5: compute shaders, storage buffers, direct state access
    bool atomicInt64 = false;  ///< GL_NV_shader_atomic_int64
    bool atomicFloat = false;  ///< GL_NV_shader_atomic_float
    bool resetStatus = false;  ///< glGetGraphicsResetStatus reports a lost device
    int maxTextureSize = 0;    ///< pixels a side
    int maxTextureLayers = 0;
    std::int64_t maxStorageBytes = 0;  ///< of one shader storage block
    int verticesAtOnce = 1 << 30;      ///< of a draw, which counts them in 31 bits
};

/// An OpenGL context without a window. One thread at a time may hold it, any thread.
class EglContext {
  public:
    enum class Profile { core, compatibility };

    /// A context of OpenGL 4.5, or 3.3 where that is all there is, on one of listDevices(), -1 =
    /// the best: the first hardware device, else the first. Errors: unsupported, with what was
    /// tried device by device and the package that would help.
    [[nodiscard]] static Result<std::shared_ptr<EglContext>> create(int device, Profile profile);
    ~EglContext();
    EglContext(const EglContext&) = delete;
    EglContext& operator=(const EglContext&) = delete;

    [[nodiscard]] const Device& device() const;
    [[nodiscard]] const ContextAbilities& abilities() const;
    /// Errors (unsupported) where the context is older than OpenGL 4.5; `what` needs it, `instead`
    /// does not.
    [[nodiscard]] Result<void> requireModern(std::string_view what, std::string_view instead) const;

    /// Holds the context for the calling thread while it lives.
    class Current {
      public:
        Current(Current&& other) noexcept : context_(std::exchange(other.context_, nullptr)) {}
        Current(const Current&) = delete;
        Current& operator=(const Current&) = delete;
        Current& operator=(Current&&) = delete;
        ~Current();

      private:
        friend class EglContext;
        explicit Current(EglContext* context) : context_(context) {}
        EglContext* context_;
    };
    /// Errors when the context cannot be bound: another thread holds it, or the device is lost.
    [[nodiscard]] Result<Current> makeCurrent();

    /// Turns pending OpenGL errors (memory, a lost or reset device) into an Error that names
    /// `doing`.
    [[nodiscard]] Result<void> check(std::string_view doing) const;

    struct Impl;

  private:
    explicit EglContext(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// Destroys objects of a context while it is current. Where it cannot be bound any more they are
/// gone with it, and only their names are dropped.
template <class Objects>
void destroyIn(EglContext& context, std::unique_ptr<Objects>& objects) {
    if (!objects) return;
    if (auto current = context.makeCurrent())
        objects.reset();
    else
        (void)objects.release();
}

/// False where EGL says of each device that it is software, without opening any: opening one takes
/// a tenth of a second, and Mesa's shader cache starts a thread of the lowest priority, which a
/// busy machine lets end many seconds later. True is only a maybe.
[[nodiscard]] bool mayHaveHardware();

/// Troubles that tests put into every context, to see how they end.
struct Faults {
    int maxTextureSize = 0;  ///< the device says so; 0 = what it has
    bool onlyOld = false;    ///< nothing newer than OpenGL 3.3
    /// The device names these extensions, or does not; unset = as it is.
    std::optional<bool> atomicInt64, atomicFloat;
    /// EglContext::check() finds this error the n-th time it is asked from now on, -1 = never:
    /// GL_OUT_OF_MEMORY, or GL_CONTEXT_LOST for a device that was reset.
    int errorAfter = -1;
    unsigned error = 0;
};
void setFaultsForTests(const Faults& faults);

/// listDevices() of lib/render/api/renderer.hpp; `tried` receives a clause for each failure.
[[nodiscard]] std::vector<Device> enumerateDevices(std::vector<std::string>& tried);

}  // namespace stx::gpu
