#include "tools/build_text.hpp"

#include <fmt/format.h>

#include "formats/parts/parts.hpp"

namespace stx::tools {

std::string buildText() {
#if defined(__clang__)
    const std::string compiler =
        fmt::format("Clang {}.{}.{}", __clang_major__, __clang_minor__, __clang_patchlevel__);
#else
    const std::string compiler =
        fmt::format("GCC {}.{}.{}", __GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__);
#endif
    return fmt::format("{}, {}, {}", STX_BUILD_TYPE, compiler, STX_PROCESSOR);
}

std::string versionText() {
    std::string out = fmt::format("stx {}\nbuild: {}\n", STX_VERSION, buildText());
    Job job;
    for (const Part& part : findParts(PartCheck::quick, job))
        out +=
            fmt::format("{}: {}{}\n", part.name,
                        part.state == PartState::here ? "" : std::string(nameOf(part.state)) + ", ",
                        part.detail);
    return out + "'stx doctor' looks closer.\n";
}

}  // namespace stx::tools
