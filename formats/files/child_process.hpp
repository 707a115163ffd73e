#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <memory>

#include "formats/files/temporaries.hpp"
#include "lib/base/result.hpp"

namespace stx {

/// A copy of this process that runs decoders, which damaged files make crash. It is killed with
/// this object.
class ChildProcess {
  public:
    /// How long a child may keep its parent waiting.
    static constexpr int kPatienceMs = 30000;

    /// `work` runs in the child with its end of a socket and must end by _exit(). No child
    /// holds another's end of its socket, so that the death of each is seen. Error (failed): no
    /// socket, no process.
    [[nodiscard]] static Result<std::unique_ptr<ChildProcess>> start(
        const std::function<void(int socket)>& work);
    ~ChildProcess();
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    [[nodiscard]] int socket() const { return socket_.get(); }

  private:
    ChildProcess() = default;

    pid_t pid_ = -1;
    Descriptor socket_;
};

/// To be called in a child: signals as a new process has them, no core file, at most so many bytes
/// of data beyond what it has now, and nothing printed.
void confineChild(std::uint64_t moreBytes);

}  // namespace stx
