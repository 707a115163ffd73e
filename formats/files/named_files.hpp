#pragma once

#include <sys/types.h>

#include <filesystem>
#include <utility>
#include <vector>

#include "lib/base/result.hpp"

namespace stx {

/// The files that inputs name: the textures of a model, the pictures of a set or a folder, the
/// files of a pattern (name_%04d.png). A program that writes beside its inputs must not replace one
/// by accident (`render amphora.obj -o amphora.png`).

/// From now on such files are remembered, and OutputFile and OutputFolder refuse their names. For
/// programs that end with their job; a library's caller may replace a file that it has read.
void guardNamedFiles();

/// Called for an input itself, where outputs may get its name one by one: the files of a pattern
/// (`render x_2.exr -o x_%d.exr`), or those in a folder. Not where an output may replace it.
void rememberInput(const std::filesystem::path& file);

/// Called for each file that is found by a name in another (resolveInside()), in a folder or by a
/// pattern, whose files may be folders. From any thread.
void rememberNamedFile(const std::filesystem::path& file);

/// The files, or folders, of an open film, which are read when their frames are asked for. While
/// this lives, OutputFile and OutputFolder refuse their names, whatever the program.
class FilesOfFilm {
  public:
    explicit FilesOfFilm(const std::vector<std::filesystem::path>& files);
    FilesOfFilm(const FilesOfFilm&) = delete;
    FilesOfFilm& operator=(const FilesOfFilm&) = delete;
    ~FilesOfFilm();

  private:
    std::vector<std::pair<dev_t, ino_t>> numbers_;
};

/// Errors (usage) where the file or folder that would be replaced is an input, one that an input
/// names, or one of a film that is open.
[[nodiscard]] Result<void> checkIsNotNamed(const std::filesystem::path& target);

}  // namespace stx
