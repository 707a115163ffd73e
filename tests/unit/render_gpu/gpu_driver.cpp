#include "tests/unit/render_gpu/gpu_driver.hpp"

#include <cstdlib>
#include <filesystem>

#include <dlfcn.h>

#include "lib/render/factory.hpp"

namespace stx::test {
namespace {

bool canLoad(const char* library) {
    void* handle = dlopen(library, RTLD_LAZY | RTLD_LOCAL);
    if (handle) dlclose(handle);
    return handle != nullptr;
}

/// Makes Mesa take the driver, before anything looks for one.
const std::string kAsked = [] {
    const char* asked = std::getenv("STX_TEST_DRIVER");
    const std::string driver = asked ? asked : "";
    if (driver.empty() || driver == "hardware") return driver;
    setenv("LIBGL_ALWAYS_SOFTWARE", "true", 1);
    setenv("GALLIUM_DRIVER", driver.c_str(), 1);
    // Another vendor's EGL would list its hardware first.
    const char* mesa = "/usr/share/glvnd/egl_vendor.d/50_mesa.json";
    if (std::filesystem::exists(mesa)) setenv("__EGL_VENDOR_LIBRARY_FILENAMES", mesa, 1);
    // Compiled shaders stay with the build; Vulkan's loader complains without the second.
    std::error_code ignored;
    std::filesystem::create_directories(STX_TEST_CACHE, ignored);
    setenv("MESA_SHADER_CACHE_DIR", STX_TEST_CACHE, 1);
    setenv("XDG_RUNTIME_DIR", STX_TEST_CACHE, 0);
    return driver;
}();

DriverState look() {
    const bool mesa = !kAsked.empty() && kAsked != "hardware", zink = kAsked == "zink";
    if (mesa && !canLoad("libEGL_mesa.so.0"))
        return {"Mesa's EGL is not here; install libegl-mesa0 and libgl1-mesa-dri", ""};
    if (zink && !canLoad("libvulkan_lvp.so"))
        return {"zink needs Mesa's Vulkan driver lavapipe; install mesa-vulkan-drivers", ""};
    Job job;
    const auto devices = listDevices(job);
    if (kAsked == "hardware" && (devices.empty() || devices[0].software))
        return {"no hardware GPU here", ""};
    if (devices.empty()) {
        if (zink) return {"", "zink gives no device, though lavapipe is installed"};
        return {"no OpenGL through EGL here; install libegl-mesa0 and libgl1-mesa-dri", ""};
    }
    if (mesa && devices[0].name.rfind(kAsked, 0) != 0)
        return {"", kAsked + " was asked for and '" + devices[0].name + "' answers"};
    if (mesa && !devices[0].software)
        return {"", "'" + devices[0].name + "' is not taken for software"};
    return {};
}

}  // namespace

const std::string& askedDriver() {
    return kAsked;
}

const DriverState& driverState() {
    static const DriverState state = look();
    return state;
}

}  // namespace stx::test
