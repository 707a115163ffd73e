#pragma once

#include <functional>
#include <memory>

#include "lib/base/job.hpp"
#include "lib/render/api/renderer.hpp"

namespace stx {

/// A renderer that goes on with another one when the first fails midway (ErrorCode::failed: its
/// device was lost, or its memory ran out), with a note that says why. The frame that failed is
/// drawn by the second. Other errors, such as a camera that makes no sense, are passed on.
[[nodiscard]] std::unique_ptr<Renderer> withFallback(
    std::unique_ptr<Renderer> first, std::function<Result<std::unique_ptr<Renderer>>()> makeSecond,
    Job& job);

}  // namespace stx
