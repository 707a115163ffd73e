#pragma once

#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

namespace stx {

/// Names of which each is given once: a name that is taken gets a number behind it, the lowest that
/// makes it another.
class UniqueNames {
  public:
    /// Of a name "a" the second is `a`, `between` and `first`, as in "a_2".
    explicit UniqueNames(std::string between, int first)
        : between_(std::move(between)), first_(first) {}

    [[nodiscard]] std::string take(const std::string& name) {
        if (taken_.insert(name).second) return name;
        // Numbers below the last one are taken: names only come.
        int& next = next_.try_emplace(name, first_).first->second;
        for (;;) {
            std::string numbered = fmt::format("{}{}{}", name, between_, next++);
            if (taken_.insert(numbered).second) return numbered;
        }
    }

  private:
    std::string between_;
    int first_;
    std::unordered_set<std::string> taken_;
    std::unordered_map<std::string, int> next_;  ///< the number to try, by name
};

}  // namespace stx
