#include "formats/imagesets/text_lines.hpp"

#include <cmath>

#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "lib/base/whole_number.hpp"

namespace stx::imagesets {
namespace {

constexpr std::string_view kSpaces = " \t\r,";

}  // namespace

std::vector<std::string_view> TextLine::words() const {
    std::vector<std::string_view> out;
    for (std::size_t at = 0;;) {
        const std::size_t from = text.find_first_not_of(kSpaces, at);
        if (from == std::string_view::npos) return out;
        at = std::min(text.find_first_of(kSpaces, from), text.size());
        out.push_back(text.substr(from, at - from));
    }
}

std::string_view TextLine::lastWord() const {
    const std::string_view upTo = text.substr(0, text.find_last_not_of(kSpaces) + 1);
    return upTo.substr(upTo.find_last_of(kSpaces) + 1);
}

std::vector<TextLine> linesOf(std::string_view text, bool all) {
    std::vector<TextLine> lines;
    for (int number = 1; !text.empty(); ++number) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        if (line.ends_with('\r')) line.remove_suffix(1);
        const std::size_t first = line.find_first_not_of(" \t");
        const bool blank = first == std::string_view::npos || line[first] == '#';
        if (all || !blank) lines.push_back({number, line});
    }
    return lines;
}

std::string_view textOf(ByteSpan bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Result<double> numberOf(std::string_view word, const std::string& where, Numbers which) {
    const auto value = wholeNumber<double>(word.substr(word.starts_with('+') ? 1 : 0));
    if (!value || (which == Numbers::finite && !std::isfinite(*value)))
        return failAt(where, ErrorCode::invalidInput, "'{}' where a {}number is expected",
                      word.substr(0, 40), which == Numbers::finite ? "finite " : "");
    return *value;
}

Result<std::vector<double>> numbersOf(const std::vector<std::string_view>& words, std::size_t first,
                                      std::size_t count, const std::string& where, Numbers which) {
    if (words.size() < first + count)
        return failAt(where, ErrorCode::invalidInput, "{} values; {} are expected", words.size(),
                      first + count);
    std::vector<double> out;
    for (std::size_t i = 0; i < count; ++i) {
        STX_TRY(const double value, numberOf(words[first + i], where, which));
        out.push_back(value);
    }
    return out;
}

Result<std::vector<double>> numbersIn(const std::filesystem::path& file, const Limits& limits,
                                      std::size_t most, Numbers which) {
    STX_TRY(const auto bytes, readSetFile(file, limits));
    const std::string where = inQuotes(file.string());
    std::vector<double> out;
    for (const TextLine& line : linesOf(textOf(bytes))) {
        if (out.size() > most) break;
        for (const auto word : line.words()) {
            STX_TRY(const double value, within(where, numberOf(word, line.where(), which)));
            out.push_back(value);
        }
    }
    return out;
}

}  // namespace stx::imagesets
