#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>

/// Bytes between processes of ours, over pipes and sockets. A header alone, for modules too.
namespace stx {

/// False when the other end is gone; over a socket that is not a signal.
inline bool sendAll(int fd, const void* bytes, std::size_t size) {
    const auto* from = static_cast<const char*>(bytes);
    while (size > 0) {
        auto n = ::send(fd, from, size, MSG_NOSIGNAL);
        if (n < 0 && errno == ENOTSOCK) n = ::write(fd, from, size);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        from += n;
        size -= static_cast<std::size_t>(n);
    }
    return true;
}

/// False at the end, an error, or when nothing comes for so many milliseconds (-1: waits on).
inline bool receiveAll(int fd, void* bytes, std::size_t size, int patienceMs) {
    auto* to = static_cast<char*>(bytes);
    while (size > 0) {
        pollfd ready = {fd, POLLIN, 0};
        const int polled = ::poll(&ready, 1, patienceMs);
        if (polled < 0 && errno == EINTR) continue;
        if (polled <= 0) return false;
        const auto n = ::read(fd, to, size);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        to += n;
        size -= static_cast<std::size_t>(n);
    }
    return true;
}

}  // namespace stx
