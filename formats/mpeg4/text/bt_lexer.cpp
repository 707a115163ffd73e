#include "formats/mpeg4/text/bt_lexer.hpp"

#include "formats/mpeg4/text/text_values.hpp"

namespace stx::mpeg4 {
namespace {

bool isBlank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',';
}
bool isMark(char c) {
    return c == '{' || c == '}' || c == '[' || c == ']';
}
bool endsWord(char c) {
    return isBlank(c) || isMark(c) || c == '#' || c == '"';
}

}  // namespace

std::string BtToken::describe() const {
    switch (kind) {
        case Kind::end:
            return "the end of the file";
        case Kind::string:
            return fmt::format("\"{}\"", excerpt(text));
        default:
            return fmt::format("'{}'", excerpt(text));
    }
}

std::string BtLexer::where(const BtToken& token) const {
    return fmt::format("'{}':{}:{}", name_, token.line, token.column);
}

Result<BtToken> BtLexer::take() {
    BtToken taken = std::move(token_);
    token_ = BtToken();
    if (auto ok = advance(); !ok) return propagate(ok);
    return taken;
}

void BtLexer::countLine() {
    const bool returns = text_[at_] == '\r';
    if (text_[at_] != '\n' && !returns) return;
    // Of CR LF the second counts.
    if (returns && text_.substr(at_ + 1).starts_with('\n')) return;
    ++line_;
    lineStart_ = at_ + 1;
}

Result<void> BtLexer::advance() {
    for (;;) {
        while (at_ < text_.size() && isBlank(text_[at_])) {
            countLine();
            ++at_;
        }
        if (at_ < text_.size() && text_[at_] == '#') {
            while (at_ < text_.size() && text_[at_] != '\n' && text_[at_] != '\r') ++at_;
            continue;
        }
        break;
    }
    token_ = BtToken();
    token_.line = line_;
    token_.column = static_cast<int>(at_ - lineStart_) + 1;
    if (at_ == text_.size()) return {};

    const char first = text_[at_];
    const std::size_t begin = at_;
    if (isMark(first)) {
        token_.kind = first == '{'   ? BtToken::Kind::openBrace
                      : first == '}' ? BtToken::Kind::closeBrace
                      : first == '[' ? BtToken::Kind::openBracket
                                     : BtToken::Kind::closeBracket;
        token_.text = text_.substr(at_++, 1);
        return {};
    }
    if (first == '"' || first == '\'') {
        token_.kind = BtToken::Kind::string;
        for (++at_; at_ < text_.size() && text_[at_] != first; ++at_) {
            if (text_[at_] == '\\' && at_ + 1 < text_.size() &&
                (text_[at_ + 1] == first || text_[at_ + 1] == '\\'))
                ++at_;
            countLine();
            token_.value += text_[at_];
        }
        if (at_ == text_.size())
            return failAt(where(token_), ErrorCode::invalidInput,
                          "a string begins here and has no closing {}", first);
        token_.text = text_.substr(begin + 1, at_ - begin - 1);
        ++at_;
        return {};
    }
    token_.kind = BtToken::Kind::word;
    while (at_ < text_.size() && !endsWord(text_[at_])) ++at_;
    token_.text = text_.substr(begin, at_ - begin);
    return {};
}

}  // namespace stx::mpeg4
