#include "formats/files/module.hpp"

#include <link.h>
#include <sys/auxv.h>

#include <cstdlib>
#include <filesystem>

namespace stx {
namespace {

namespace fs = std::filesystem;

/// The folder of the library or program that this code is linked into; empty when unknown.
struct OwnFolder {
    fs::path path;
    bool ofLibrary = false;
};
OwnFolder ownFolder() {
    std::error_code ec;
    static const char inThisObject = 0;
    Dl_info info = {};
    link_map* object = nullptr;
    const bool found =
        ::dladdr1(&inThisObject, &info, reinterpret_cast<void**>(&object), RTLD_DL_LINKMAP) != 0;
    // The program itself has no name there.
    const bool isLibrary = found && object && object->l_name && *object->l_name;
    auto self = fs::canonical(isLibrary ? object->l_name : "/proc/self/exe", ec);
    // Without /proc, as in many a chroot: the name that the program was started by.
    const auto name = reinterpret_cast<const char*>(::getauxval(AT_EXECFN));
    if (ec && !isLibrary && name) self = fs::canonical(name, ec);
    return {self.parent_path(), isLibrary};
}

}  // namespace

std::vector<std::string> placesOfModule(const char* variable, const char* module) {
    // Somebody who names a module wants that one and no other.
    if (const char* named = std::getenv(variable); named && *named) return {named};
    const fs::path file = fs::path("stx") / module;
    const fs::path folder = ownFolder().path;
    std::vector<std::string> places;
    if (!folder.empty()) {
        places.push_back(folder / file);  // of lib/libstx.so
        // Of bin/stx, installed or in the build tree.
        places.push_back((folder / STX_LIB_FROM_BIN / file).lexically_normal());
    }
    return places;
}

std::vector<std::string> placesOfHelper(const char* variable, const char* program) {
    if (const char* named = std::getenv(variable); named && *named) return {named};
    const auto folder = ownFolder();
    if (folder.path.empty()) return {};
    const char* way = folder.ofLibrary ? STX_LIBEXEC_FROM_LIB : STX_LIBEXEC_FROM_BIN;
    return {(folder.path / way / "stx" / program).lexically_normal()};
}

}  // namespace stx
