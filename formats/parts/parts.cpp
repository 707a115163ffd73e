#include "formats/parts/parts.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string_view>

#include <fmt/format.h>

#include "formats/decoders/decoder_process.hpp"
#include "formats/files/module.hpp"
#include "lib/base/counted.hpp"
#include "lib/base/cpu_device.hpp"
#include "lib/base/parallel.hpp"
#include "lib/render/factory.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

struct Found {
    PartState state = PartState::here;
    std::string detail;
};

Found findProcessor(PartCheck, Job&) {
    return {PartState::here,
            fmt::format("{}, {}", cpuDeviceName(), counted(threadCount(), "thread"))};
}

/// The file of a module of ours, without loading it.
Found findModule(const char* variable, const char* module) {
    const auto places = placesOfModule(variable, module);
    std::error_code ec;
    for (const auto& place : places)
        if (fs::exists(place, ec)) return {PartState::here, place};
    return {PartState::missing,
            fmt::format("'{}' does not exist", places.empty() ? module : places.back())};
}

/// Whether the libraries of a module are here is known when a process opens it.
Found findDecoder(const DecoderKind& kind, PartCheck check) {
    auto found = findModule(kind.variable, kind.module);
    if (check == PartCheck::quick || found.state != PartState::here) return found;
    const auto process = DecoderProcess::start(kind, DecoderBounds{.memoryBytes = 256u << 20});
    if (!process) return {PartState::missing, process.error().message};
    return {PartState::here, fmt::format("{} ({})", found.detail, (*process)->libraries())};
}

Found findImageCodecs(PartCheck check, Job&) {
    return findDecoder(decoders::kImages, check);
}

Found findHeif(PartCheck check, Job&) {
    return findDecoder(decoders::kHeif, check);
}

Found findModels(PartCheck check, Job&) {
    return findDecoder(decoders::kModels, check);
}

Found findVideo(PartCheck check, Job&) {
    return findDecoder(decoders::kVideo, check);
}

/// How well the process of a decoder is shut in.
Found findIsolation(PartCheck, Job&) {
    const DecoderBounds bounds{.memoryBytes = 256u << 20};
    auto process = DecoderProcess::start(decoders::kModels, bounds);
    // All are held alike; any that is here tells.
    for (const auto* kind : {&decoders::kImages, &decoders::kVideo, &decoders::kHeif})
        if (!process) process = DecoderProcess::start(*kind, bounds);
    if (!process) return {PartState::missing, process.error().message};
    const auto& held = (*process)->isolation();
    const char* landlock = held.landlock ? "Landlock" : "no Landlock";
    if (!held.seccomp)
        return {PartState::missing,
                fmt::format("this kernel or container lets no system calls be filtered (seccomp); "
                            "memory, time and descriptors are bounded; {}",
                            landlock)};
    return {PartState::here, fmt::format("seccomp, {}", landlock)};
}

#ifdef STX_WITH_GPU
struct DevicesFound {
    std::vector<Device> all;
    std::string why;  ///< when there are none
};
/// Asked once, since drivers take their time to answer.
const DevicesFound& devicesHere(const Limits& limits) {
    static const DevicesFound found = [&] {
        Job asked;
        asked.limits = limits;
        DevicesFound out;
        out.all = listDevices(asked);
        out.why = fmt::format("{}", fmt::join(asked.takeNotes(), "; "));
        return out;
    }();
    return found;
}
#endif

Found findOpenGl(PartCheck check, Job& job) {
#ifdef STX_WITH_GPU
    if (check == PartCheck::quick) return {PartState::here, "built in"};
    const DevicesFound& devices = devicesHere(job.limits);
    if (devices.all.empty()) return {PartState::missing, devices.why};
    std::string names;
    for (const auto& d : devices.all)
        names += fmt::format("{}{} ({})", names.empty() ? "" : "; ", d.name, d.version);
    return {PartState::here, names};
#else
    (void)check;
    (void)job;
    return {PartState::notBuilt, "-DSTX_WITH_GPU=OFF"};
#endif
}

Found findGpu(PartCheck check, Job& job) {
#ifdef STX_WITH_GPU
    if (check == PartCheck::quick) return {PartState::here, "not looked for"};
    for (const auto& d : devicesHere(job.limits).all)
        if (!d.software) return {PartState::here, d.name};
    return {PartState::missing, "no hardware answers; pictures are drawn on the processor"};
#else
    (void)check;
    (void)job;
    return {PartState::notBuilt, "-DSTX_WITH_GPU=OFF"};
#endif
}

/// A program on the PATH.
Found findProgram(const char* name) {
    const char* path = std::getenv("PATH");
    std::string_view rest = path ? path : "";
    while (!rest.empty()) {
        const auto colon = std::min(rest.find(':'), rest.size());
        const fs::path file = fs::path(rest.substr(0, colon)) / name;
        std::error_code ec;
        if (fs::is_regular_file(file, ec) && ::access(file.c_str(), X_OK) == 0)
            return {PartState::here, file.string()};
        rest.remove_prefix(std::min(colon + 1, rest.size()));
    }
    return {PartState::missing, fmt::format("no program '{}' on the PATH", name)};
}

Found findFfmpeg(PartCheck, Job&) {
    return findProgram("ffmpeg");
}

/// A part and how it is found. A new one is a function above and a row here.
struct PartRow {
    const char *name, *use, *packages;
    bool needed;
    bool inVersion;  ///< `stx --version` tells it, too
    Found (*find)(PartCheck, Job&);
};

constexpr PartRow kParts[] = {
    {"processor", "all work that no GPU does", "", true, false, findProcessor},
    {"image codecs", "TIFF, WebP, HDR and most other pictures", "stx libopenimageio2.4", true, true,
     findImageCodecs},
    {"video", "films as compressed video", "stx libavformat59 libavcodec59 libswscale6", false,
     true, findVideo},
    {"HEIC", "photographs with depth of phones", "stx libheif1 libde265-0", false, true, findHeif},
    {"model readers", "OBJ, STL, COLLADA and FBX", "stx libassimp5", true, false, findModels},
    {"isolation", "foreign files decoded where they can reach nothing", "", false, false,
     findIsolation},
    {"OpenGL", "--backend gpu and gl", "libegl1 libopengl0 libgl1-mesa-dri", false, true,
     findOpenGl},
    {"GPU", "drawing many times faster than on the processor",
     "nvidia-driver, or firmware-amd-graphics, or mesa-vulkan-drivers", false, false, findGpu},
    {"ffmpeg", "films out of y4m streams, 'stx render -o - | ffmpeg'", "ffmpeg", false, false,
     findFfmpeg},
};

}  // namespace

const char* nameOf(PartState state) {
    switch (state) {
        case PartState::here:
            return "ok";
        case PartState::missing:
            return "missing";
        case PartState::notBuilt:
            break;
    }
    return "not built";
}

std::vector<Part> findParts(PartCheck check, Job& job) {
    std::vector<Part> parts;
    for (const PartRow& row : kParts) {
        // What `--version` leaves out costs it nothing.
        if (check == PartCheck::quick && !row.inVersion) continue;
        Found found = row.find(check, job);
        parts.push_back(
            {row.name, row.use, row.packages, row.needed, found.state, std::move(found.detail)});
    }
    return parts;
}

}  // namespace stx
