#pragma once

#include <string>
#include <string_view>

#include "lib/base/result.hpp"

namespace stx::mpeg4 {

/// A piece of a BT file.
struct BtToken {
    enum class Kind { word, string, openBrace, closeBrace, openBracket, closeBracket, end };
    Kind kind = Kind::end;
    std::string_view text;  ///< as in the file; of strings, without the quotes
    std::string value;      ///< strings only: with the escapes resolved
    int line = 1;           ///< from 1
    int column = 1;         ///< from 1, in bytes

    /// For messages: `'}'`, `"abc"`, `the end of the file`.
    [[nodiscard]] std::string describe() const;
};

// clang-format off
/// Cuts a BT text into tokens, one at a time and without a copy:
///  - blanks and commas separate; `#` begins a comment that runs to the end of the line (LF, CR LF or CR);
///  - each of `{ } [ ]` is a token;
///  - text in `"` or `'` is a string, in which a backslash escapes a quote or a backslash;
///  - all else is words: numbers, names, `TR.translation`, `od:10`.
// clang-format on
class BtLexer {
  public:
    /// `text` must outlive the lexer. `name` is the file's name for errors.
    BtLexer(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {}

    /// The next token, not yet taken.
    [[nodiscard]] const BtToken& peek() const { return token_; }
    /// Takes the token and reads on. Errors: a string that does not end.
    [[nodiscard]] Result<BtToken> take();
    /// Reads the first token; call once before peek().
    [[nodiscard]] Result<void> start() { return advance(); }

    /// `'scene.bt':12:7` of a token.
    [[nodiscard]] std::string where(const BtToken& token) const;
    [[nodiscard]] std::string where() const { return where(token_); }
    /// Bytes behind the token that peek() shows: no list can hold more items than these.
    [[nodiscard]] std::size_t remaining() const { return text_.size() - at_; }

  private:
    Result<void> advance();
    /// Counts a line where at_ is at the end of one.
    void countLine();

    std::string_view text_;
    std::string name_;
    std::size_t at_ = 0;
    std::size_t lineStart_ = 0;
    int line_ = 1;
    BtToken token_;
};

}  // namespace stx::mpeg4
