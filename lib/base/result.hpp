#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

#include <fmt/format.h>

namespace stx {

/// Why an operation failed. The values are the exit codes of the program `stx`.
enum class ErrorCode {
    usage = 1,         ///< the request itself makes no sense
    io = 2,            ///< a file cannot be read or written
    invalidInput = 3,  ///< a file or a value breaks its rules
    failed = 4,        ///< the work itself failed (memory, a lost device, a library)
    unsupported = 5,   ///< not available here: no EGL, no such backend
    difference = 7,    ///< `compare` or `validate` found what it was asked to look for
};

/// One clear sentence for a person, and where it happened.
struct Error {
    ErrorCode code = ErrorCode::failed;
    /// What, found, expected and a way out. No trailing full stop, no newline.
    std::string message;
    /// File, byte offset, line or view: `'a.mp4': moov/trak[2] at byte 1056`. May be empty.
    std::string where;

    /// `where: message`, or only the message.
    [[nodiscard]] std::string text() const {
        return where.empty() ? message : where + ": " + message;
    }

    /// The same error, reported from further out: `outer: where`.
    [[nodiscard]] Error at(const std::string& outer) const {
        return {code, message, where.empty() ? outer : outer + ": " + where};
    }
};

template <class T>
using Result = tl::expected<T, Error>;

/// `return fail(ErrorCode::io, "cannot open '{}'", path);`
template <class... Args>
[[nodiscard]] tl::unexpected<Error> fail(ErrorCode code, fmt::format_string<Args...> format,
                                         Args&&... args) {
    return tl::unexpected<Error>(Error{code, fmt::format(format, std::forward<Args>(args)...), {}});
}

/// As fail(), with the place of the error.
template <class... Args>
[[nodiscard]] tl::unexpected<Error> failAt(std::string where, ErrorCode code,
                                           fmt::format_string<Args...> format, Args&&... args) {
    return tl::unexpected<Error>(
        Error{code, fmt::format(format, std::forward<Args>(args)...), std::move(where)});
}

/// Passes an error on: `if (!r) return propagate(r);`
template <class T>
[[nodiscard]] tl::unexpected<Error> propagate(Result<T>& r) {
    return tl::unexpected<Error>(std::move(r.error()));
}

/// The same result, its error reported from `where`.
template <class T>
[[nodiscard]] Result<T> within(const std::string& where, Result<T> result) {
    if (!result) return tl::unexpected<Error>(result.error().at(where));
    return result;
}

}  // namespace stx

#define STX_CONCAT_INNER(a, b) a##b
#define STX_CONCAT(a, b) STX_CONCAT_INNER(a, b)

/// `STX_TRY(auto x, f());` declares x, or returns f()'s error.
#define STX_TRY(decl, expression) STX_TRY_IMPL(STX_CONCAT(stxTry, __LINE__), decl, expression)
#define STX_TRY_IMPL(tmp, decl, expression)                                \
    auto tmp = (expression);                                               \
    if (!tmp) return tl::unexpected<::stx::Error>(std::move(tmp.error())); \
    decl = std::move(*tmp)

/// Returns the error of a Result<void> expression, if it has one.
#define STX_CHECK(expression)                                                   \
    do {                                                                        \
        if (auto stxChecked = (expression); !stxChecked)                        \
            return tl::unexpected<::stx::Error>(std::move(stxChecked.error())); \
    } while (false)

/// `if (given) STX_SET(x, f());` assigns to x, or returns f()'s error, as one statement.
#define STX_SET(to, expression)                                                      \
    do {                                                                             \
        auto stxSet = (expression);                                                  \
        if (!stxSet) return tl::unexpected<::stx::Error>(std::move(stxSet.error())); \
        to = std::move(*stxSet);                                                     \
    } while (false)
