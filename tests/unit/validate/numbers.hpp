#pragma once

#include <set>
#include <string>
#include <vector>

#include "formats/validate/validate.hpp"

namespace stx {

using Numbers = std::set<int>;

inline Numbers numbersOf(const std::vector<Finding>& findings) {
    Numbers numbers;
    for (const Finding& f : findings) numbers.insert(f.rule->number);
    return numbers;
}
/// Of a file; {-1} when it ends with an error.
inline Numbers numbersOf(const Result<std::vector<Finding>>& findings) {
    return findings ? numbersOf(*findings) : Numbers{-1};
}
inline std::string textOf(const std::vector<Finding>& findings) {
    std::string text;
    for (const Finding& f : findings) text += f.text() + "\n";
    return text;
}
inline std::string textOf(const Result<std::vector<Finding>>& findings) {
    return findings ? textOf(*findings) : findings.error().text();
}

}  // namespace stx
