#pragma once

#include <sys/stat.h>

#include <filesystem>
#include <optional>

namespace stx {

/// Who may use a folder that is to be replaced.
struct FolderMode {
    mode_t mode = 0;  ///< permissions, with the bits above them (07777)
    gid_t group = 0;
};

/// Of the folder of that name, through links; nothing where there is none.
[[nodiscard]] std::optional<FolderMode> modeOfFolder(const std::filesystem::path& folder);

/// Gives that mode and group to a folder of this process, which its owner may still write into:
/// files that are made in it have the group, too, where the folder hands it on. Where this user is
/// not of the group, the group that the folder has instead gets no more than all others have.
/// Never fails: what a file system does not know is left.
void takeMode(const FolderMode& of, const std::filesystem::path& folder);

/// What takeMode() left open for writing, once the folder is whole.
void takeWholeMode(const FolderMode& of, const std::filesystem::path& folder);

}  // namespace stx
