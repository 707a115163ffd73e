#include "formats/files/folder_mode.hpp"

#include <unistd.h>

namespace stx {

std::optional<FolderMode> modeOfFolder(const std::filesystem::path& folder) {
    struct stat info = {};
    if (::stat(folder.c_str(), &info) != 0 || !S_ISDIR(info.st_mode)) return std::nullopt;
    return FolderMode{info.st_mode & 07777U, info.st_gid};
}

void takeMode(const FolderMode& of, const std::filesystem::path& folder) {
    mode_t mode = of.mode;
    // The group first: a change of it may take bits of the mode away.
    if (::chown(folder.c_str(), static_cast<uid_t>(-1), of.group) != 0) {
        constexpr mode_t kGroup = S_IRWXG, kOthers = S_IRWXO;
        mode &= ~(S_ISGID | (kGroup & ~((mode & kOthers) << 3)));
    }
    (void)!::chmod(folder.c_str(), mode | S_IRWXU);
}

void takeWholeMode(const FolderMode& of, const std::filesystem::path& folder) {
    struct stat info = {};
    if ((of.mode & S_IRWXU) == S_IRWXU || ::stat(folder.c_str(), &info) != 0) return;
    (void)!::chmod(folder.c_str(), (info.st_mode & 07777U & ~S_IRWXU) | (of.mode & S_IRWXU));
}

}  // namespace stx
