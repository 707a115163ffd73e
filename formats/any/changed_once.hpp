#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "lib/model/sequence.hpp"

namespace stx {

/// The same frames, each changed by `change` once, however often it is asked for: for changes that
/// take long, of films that are written in two passes. Images that it changed are kept in a file in
/// `folder`, which is removed with this. A change may also touch the headers of views and the
/// bounds, and nothing else: views lack and have the images that they had. Its notes are given each
/// time. Errors: those of the frames and of the change; (io) no file can be made, a full disk.
[[nodiscard]] std::unique_ptr<Sequence> changedOnce(
    std::unique_ptr<Sequence> frames, std::function<Result<void>(Bundle& frame, Job& job)> change,
    std::filesystem::path folder);

}  // namespace stx
