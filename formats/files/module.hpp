#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <dlfcn.h>
#include <unistd.h>

#include "lib/base/result.hpp"

/// Modules: shared objects of ours that are opened when they are needed, so that the libraries
/// behind them cost nothing before and may be missing.
namespace stx {

/// Where a module may be: the file that the environment's `variable` names; else beside the library
/// or program that this is linked into: in stx/ beside lib/libstx.so, in ../lib/stx beside bin/stx,
/// and the same in the build tree.
[[nodiscard]] std::vector<std::string> placesOfModule(const char* variable, const char* module);

/// Where a program that helps may be, likewise: in libexec/stx/.
[[nodiscard]] std::vector<std::string> placesOfHelper(const char* variable, const char* program);

/// The first place of a module that opens and whose table, which its function `symbol` returns, has
/// the version expected. It stays open for good. Error (unsupported): every place that was tried.
template <class Table>
[[nodiscard]] Result<const Table*> openModule(const std::vector<std::string>& places,
                                              const char* symbol, std::uint32_t version) {
    std::string tried;
    for (const auto& place : places) {
        tried += fmt::format("{}'{}' ", tried.empty() ? "" : "; ", place);
        void* opened = ::dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (!opened) {
            const char* why = ::access(place.c_str(), F_OK) == 0 ? ::dlerror() : nullptr;
            tried += why ? fmt::format("cannot be loaded ({})", why) : "does not exist";
            continue;
        }
        using Entry = const Table* (*)();
        const auto entry = reinterpret_cast<Entry>(::dlsym(opened, symbol));
        const Table* table = entry ? entry() : nullptr;
        if (table && table->version == version) return table;
        tried += "is of another version";
        ::dlclose(opened);
    }
    return fail(ErrorCode::unsupported, "{}", tried);
}

}  // namespace stx
