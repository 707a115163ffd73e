#pragma once

#include <string>

namespace stx::video {

/// Errors that libav* only logs since forgetErrors(), the first of each kind; else empty. Some
/// damage shows nowhere else.
struct LoggedErrors {
    std::string demuxer, other;
};
[[nodiscard]] const LoggedErrors& loggedErrors();
void forgetErrors();

/// From now on, in this process, in place of printing.
void listenToErrors();

}  // namespace stx::video
