#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace stx::mpeg4 {

/// Line and column of a byte of the text.
class Lines {
  public:
    explicit Lines(std::string_view text) : size_(text.size()) {
        starts_.push_back(0);
        for (std::size_t i = 0; i < text.size(); ++i)
            if (text[i] == '\n') starts_.push_back(i + 1);
    }
    [[nodiscard]] std::string at(const std::string& fileName, std::ptrdiff_t offset) const {
        const auto byte =
            std::min<std::size_t>(offset < 0 ? 0 : static_cast<std::size_t>(offset), size_);
        const auto line = std::upper_bound(starts_.begin(), starts_.end(), byte) - starts_.begin();
        return fmt::format("'{}':{}:{}", fileName, line, byte - starts_[line - 1] + 1);
    }

  private:
    std::vector<std::size_t> starts_;
    std::size_t size_;
};

}  // namespace stx::mpeg4
