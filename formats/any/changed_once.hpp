#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "lib/model/sequence.hpp"

namespace stx {

/// The same frames, each changed by `change` once, however often it is asked for: for changes that
/// take long, of films that are written in two passes. What became of the depth and the texture of
/// its views is kept, where it is not what it was, in a file in `folder` that is gone when this is;
/// besides them a change may touch headers of views and the bounds. Its notes are given each time.
/// Errors: those of the frames and of the change; (io) no file can be made, a full
/// disk.
[[nodiscard]] std::unique_ptr<Sequence> changedOnce(
    std::unique_ptr<Sequence> frames, std::function<Result<void>(Bundle& frame, Job& job)> change,
    std::filesystem::path folder);

}  // namespace stx
