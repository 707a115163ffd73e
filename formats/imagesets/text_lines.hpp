#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "formats/files/files.hpp"

namespace stx::imagesets {

/// A line of a text file that is neither empty nor a comment.
struct TextLine {
    int number = 0;  ///< from 1
    std::string_view text;

    [[nodiscard]] std::string where() const { return "line " + std::to_string(number); }
    /// The words between spaces, tabs and commas.
    [[nodiscard]] std::vector<std::string_view> words() const;
    /// The last of them, empty where there is none: for lines of many thousands.
    [[nodiscard]] std::string_view lastWord() const;
};

/// Lines without their ends; those that begin with # or are blank are left out, unless `all`.
[[nodiscard]] std::vector<TextLine> linesOf(std::string_view text, bool all = false);

[[nodiscard]] std::string_view textOf(ByteSpan bytes);

/// Which words are numbers: `any` takes nan and inf, too.
enum class Numbers { finite, any };

/// A number that is the whole word.
[[nodiscard]] Result<double> numberOf(std::string_view word, const std::string& where,
                                      Numbers which = Numbers::finite);
/// `count` numbers that are the words [first, first + count).
[[nodiscard]] Result<std::vector<double>> numbersOf(const std::vector<std::string_view>& words,
                                                    std::size_t first, std::size_t count,
                                                    const std::string& where,
                                                    Numbers which = Numbers::finite);
/// All numbers of a text file; lines are read until there are more than `most`.
[[nodiscard]] Result<std::vector<double>> numbersIn(const std::filesystem::path& file,
                                                    const Limits& limits,
                                                    std::size_t most = SIZE_MAX,
                                                    Numbers which = Numbers::finite);

}  // namespace stx::imagesets
