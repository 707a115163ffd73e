#include "lib/base/error_text.hpp"

namespace stx {

std::string textNamingOnce(const Error& error) {
    std::string where = error.where;
    // `'a': 'a': line 3`, at its beginning, where callers add.
    for (std::size_t end; (end = where.find("': ")) != std::string::npos;) {
        const auto first = where.substr(0, end + 3);
        if (!first.starts_with('\'') || where.compare(first.size(), first.size(), first) != 0)
            break;
        where.erase(0, first.size());
    }
    // `'a'` or `'a': 'a'` before a message that names it.
    const auto quoted = where.substr(
        0, where.find("': ") == std::string::npos ? where.size() : where.find("': ") + 1);
    if (quoted.size() > 2 && quoted.starts_with('\'') && quoted.ends_with('\'') &&
        (error.message.find(quoted) != std::string::npos ||
         where.find(quoted, quoted.size()) != std::string::npos)) {
        where.erase(0, quoted.size());
        if (where.starts_with(": ")) where.erase(0, 2);
    }
    return where.empty() ? error.message : where + ": " + error.message;
}

}  // namespace stx
