#pragma once

#include <string>

#include "lib/base/result.hpp"

namespace stx::codecs {

/// Thrown for every way in which the libraries can fail; ends in codecs.cpp.
struct Failed {
    ErrorCode code;
    std::string message;
};

[[noreturn]] inline void cannotWrite(const std::string& reason) {
    throw Failed{ErrorCode::io, reason.empty() ? "the picture cannot be written" : reason};
}

}  // namespace stx::codecs
