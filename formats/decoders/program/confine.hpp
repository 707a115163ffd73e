#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace stx::decoders {

/// The filter of system calls for processes that decode. It lets through what reads open files,
/// takes memory and answers over `socket`. All else fails with EPERM: no file, connection, process
/// or other process' memory can be opened. Made once, before the first process.
class Filter {
  public:
    /// Empty when this kernel has none.
    explicit Filter(int socket);
    /// From now on, for good. False when the kernel refuses.
    [[nodiscard]] bool apply() const;

  private:
    std::vector<std::uint64_t> program_;  ///< of struct sock_filter
};

/// Libraries that read by name only find the file that is decoded under this one.
[[nodiscard]] std::string nameOf(int file);
/// Answers fstat() and the opening of nameOf(file), which the filter passes on.
void answerFiltered(int file);

/// No file can be opened from now on, by name, in this process and those that it makes. False where
/// the kernel has no Landlock.
[[nodiscard]] bool forbidFiles();

/// No new privileges, no core file, no writing of files.
void forbidCommon();

/// Bytes of data that this process has now, as limitMemory() counts them; 0 when unknown.
[[nodiscard]] std::uint64_t dataBytes();
/// At most so many, and so many seconds of processor time, whose end is SIGXCPU.
void limitMemory(std::uint64_t bytes);
void limitSeconds(std::uint32_t seconds);

}  // namespace stx::decoders
