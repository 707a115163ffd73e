#include "formats/mpeg4/bifs/script_code.hpp"

namespace stx::mpeg4 {
namespace {

using namespace script;

class ScriptReader {
  public:
    ScriptReader(BitReader& in, std::vector<std::string> names, int maxNesting,
                 std::uint64_t maxBytes, std::size_t* renamed)
        : in_(in),
          names_(std::move(names)),
          maxNesting_(maxNesting),
          maxBytes_(maxBytes),
          renamed_(renamed) {}

    Result<std::string> read() {
        out_ = kScriptPrefix;
        while (in_.flag()) {
            out_ += "\nfunction ";
            STX_CHECK(identifier());
            STX_CHECK(arguments());
            out_ += ' ';
            STX_CHECK(block(true));
        }
        out_ += '\n';
        STX_CHECK(check());
        return std::move(out_);
    }

  private:
    template <class... Args>
    tl::unexpected<Error> error(fmt::format_string<Args...> format, Args&&... args) const {
        return failAt(fmt::format("bit {}", in_.position()), ErrorCode::invalidInput, format,
                      std::forward<Args>(args)...);
    }
    Result<void> check() const {
        if (in_.failed()) return error("the access unit ends inside the program of a Script");
        if (out_.size() > maxBytes_)
            return error("the program of a Script is longer than the {} bytes that are allowed",
                         maxBytes_);
        return {};
    }
    /// Counts how deep statements and expressions are in each other.
    class Nesting {
      public:
        explicit Nesting(int& depth) : depth_(depth) { ++depth_; }
        Nesting(const Nesting&) = delete;
        Nesting& operator=(const Nesting&) = delete;
        ~Nesting() { --depth_; }

      private:
        int& depth_;
    };
    Result<void> checkDepth() const {
        if (depth_ > maxNesting_)
            return error("the program of a Script nests deeper than {}", maxNesting_);
        return check();
    }

    Result<std::string> characters() {
        std::string text;
        while (const std::uint32_t c = in_.read(8)) {
            text.push_back(static_cast<char>(c));
            if (text.size() > maxBytes_) break;
        }
        STX_CHECK(check());
        return text;
    }

    Result<void> identifier() {
        if (in_.flag()) {
            const int bits = names_.size() < 2 ? 0 : significantBits(names_.size() - 1);
            const std::uint32_t index = in_.read(bits);
            STX_CHECK(check());
            if (index >= names_.size())
                return error("the program of a Script names identifier {} of {}", index,
                             names_.size());
            out_ += names_[index];
            return check();
        }
        STX_TRY(std::string name, characters());
        if (!isScriptName(name)) {
            name = scriptNameFrom(name);
            if (renamed_ != nullptr) ++*renamed_;
        }
        names_.push_back(name);
        out_ += name;
        return check();
    }

    /// `a, b`
    template <class Item>
    Result<void> list(const Item& item) {
        for (bool first = true; in_.flag(); first = false) {
            if (!first) out_ += ", ";
            STX_CHECK(item());
        }
        return check();
    }
    Result<void> identifiers() {
        return list([&] { return identifier(); });
    }
    Result<void> arguments() {
        out_ += '(';
        STX_CHECK(identifiers());
        out_ += ')';
        return {};
    }
    Result<void> parameters() {
        out_ += '(';
        STX_CHECK(list([&] { return expression(kAssignment); }));
        out_ += ')';
        return check();
    }

    void line() {
        out_ += '\n';
        out_.append(static_cast<std::size_t>(indent_), ' ');
    }

    /// The statements of a block; those of functions and cases always have braces.
    Result<void> block(bool alwaysBraces) {
        if (in_.flag()) {
            out_ += '{';
            ++indent_;
            while (in_.flag()) {
                line();
                STX_CHECK(statement());
            }
            --indent_;
            line();
            out_ += '}';
            return check();
        }
        // With braces around it, an `if` does not take an `else` that is not its own.
        const bool braces = alwaysBraces || nextIs(kIf);
        if (!braces) return statement();
        out_ += '{';
        ++indent_;
        line();
        STX_CHECK(statement());
        --indent_;
        line();
        out_ += '}';
        return {};
    }
    [[nodiscard]] bool nextIs(Statement kind) const {
        BitReader ahead = in_;
        return ahead.read(kStatementBits) == static_cast<std::uint32_t>(kind);
    }

    Result<void> statement() {
        const Nesting nesting(depth_);
        STX_CHECK(checkDepth());
        switch (in_.read(kStatementBits)) {
            case kIf:
                out_ += "if (";
                STX_CHECK(compound());
                out_ += ") ";
                STX_CHECK(block(false));
                if (!in_.flag()) return check();
                out_ += " else ";
                return block(false);
            case kFor:
                out_ += "for (";
                STX_CHECK(optional());
                out_ += "; ";
                STX_CHECK(optional());
                out_ += "; ";
                STX_CHECK(optional());
                out_ += ") ";
                return block(false);
            case kWhile:
                out_ += "while (";
                STX_CHECK(compound());
                out_ += ") ";
                return block(false);
            case kReturn:
                out_ += "return";
                if (in_.flag()) {
                    out_ += ' ';
                    STX_CHECK(compound());
                }
                out_ += ';';
                return check();
            case kCompound:
                STX_CHECK(compound());
                out_ += ';';
                return {};
            case kBreak:
                out_ += "break;";
                return check();
            case kContinue:
                out_ += "continue;";
                return check();
            default:
                return switchStatement();
        }
    }

    Result<void> switchStatement() {
        out_ += "switch (";
        STX_CHECK(compound());
        out_ += ") {";
        const int bits = static_cast<int>(in_.read(5));
        do {
            line();
            fmt::format_to(std::back_inserter(out_), "case {}: ", in_.read(bits));
            STX_CHECK(block(true));
        } while (in_.flag());
        if (in_.flag()) {
            line();
            out_ += "default: ";
            STX_CHECK(block(true));
        }
        line();
        out_ += '}';
        return check();
    }

    Result<void> optional() { return in_.flag() ? compound() : check(); }

    Result<void> compound() {
        STX_CHECK(expression(kAssignment));
        while (in_.flag()) {
            out_ += ", ";
            STX_CHECK(expression(kAssignment));
        }
        return check();
    }

    static int bindingOf(int kind) {
        if (kind >= kAssign && kind < kBoolean) return kOperators[kind - kAssign].binding;
        if (kind >= kNegative && kind <= kDecrement) return kUnary;
        if (kind == kPostIncrement || kind == kPostDecrement) return kPostfix;
        if (kind == kCondition || kind == kFunction) return kConditional;
        return kPrimary;
    }

    /// An expression, in parentheses where it binds less tightly than its place asks for.
    Result<void> expression(int leastBinding) {
        const Nesting nesting(depth_);
        STX_CHECK(checkDepth());
        const int kind = static_cast<int>(in_.read(kExpressionBits));
        STX_CHECK(check());
        const bool wrapped = bindingOf(kind) < leastBinding;
        if (wrapped) out_ += '(';
        STX_CHECK(expressionOf(kind));
        if (wrapped) out_ += ')';
        return check();
    }

    /// `-x`, with a blank where x begins with the same sign.
    Result<void> unary(std::string_view sign) {
        out_ += sign;
        const std::size_t at = out_.size();
        STX_CHECK(expression(kUnary));
        if (at < out_.size() && out_[at] == sign.back()) out_.insert(at, " ");
        return {};
    }

    Result<void> expressionOf(int kind) {
        switch (kind) {
            case kParentheses:
                out_ += '(';
                STX_CHECK(compound());
                out_ += ')';
                return {};
            case kNegative:
                return unary("-");
            case kNot:
                return unary("!");
            case kOnesComplement:
                return unary("~");
            case kIncrement:
                return unary("++");
            case kDecrement:
                return unary("--");
            case kPostIncrement:
            case kPostDecrement:
                STX_CHECK(expression(kPostfix));
                out_ += kind == kPostIncrement ? "++" : "--";
                return {};
            case kCondition:
                STX_CHECK(expression(kConditional + 1));
                out_ += " ? ";
                STX_CHECK(expression(kAssignment));
                out_ += " : ";
                return expression(kAssignment);
            case kString:
                return string();
            case kNumber:
                return number();
            case kIdentifier:
                return identifier();
            case kFunctionCall:
                STX_CHECK(identifier());
                return parameters();
            case kNew:
                out_ += "new ";
                STX_CHECK(identifier());
                return parameters();
            case kMember:
            case kMethodCall:
                STX_CHECK(expression(kPrimary));
                out_ += '.';
                STX_CHECK(identifier());
                return kind == kMember ? Result<void>() : parameters();
            case kIndex:
                STX_CHECK(expression(kPrimary));
                out_ += '[';
                STX_CHECK(compound());
                out_ += ']';
                return {};
            case kBoolean:
                out_ += in_.flag() ? "true" : "false";
                return check();
            case kVariables:
                out_ += "var ";
                return identifiers();
            case kFunction:
                out_ += "function ";
                STX_CHECK(arguments());
                out_ += ' ';
                return block(true);
            default:
                break;
        }
        if (kind > kFunction) return error("the program of a Script has an expression {}", kind);
        const Operator& op = kOperators[kind - kAssign];
        // Assignments group from the right, all others from the left.
        const bool assigns = op.binding == kAssignment;
        STX_CHECK(expression(assigns ? kUnary : op.binding));
        fmt::format_to(std::back_inserter(out_), " {} ", op.text);
        return expression(assigns ? kAssignment : op.binding + 1);
    }

    Result<void> string() {
        STX_TRY(const std::string text, characters());
        // What is coded is what stood between the quotes.
        const char quote = canBeQuoted(text, '\'') ? '\'' : '"';
        if (!canBeQuoted(text, quote))
            return error("the program of a Script has a string that cannot be quoted");
        out_ += quote;
        out_ += text;
        out_ += quote;
        return check();
    }

    Result<void> number() {
        if (in_.flag()) {
            const int bits = static_cast<int>(in_.read(5));
            fmt::format_to(std::back_inserter(out_), "{}", in_.read(bits));
            return check();
        }
        std::string digits;
        for (;;) {
            const std::uint32_t digit = in_.read(4);
            if (digit == 15 || in_.failed()) break;
            if (digit > 12) return error("a number of a Script has a digit {}", digit);
            digits += "0123456789.E-"[digit];
        }
        STX_CHECK(check());
        if (digits.empty() || scriptNumberLength(digits) != digits.size())
            return error("the program of a Script has an invalid number");
        out_ += digits;
        return check();
    }

    BitReader& in_;
    std::vector<std::string> names_;
    int maxNesting_;
    std::uint64_t maxBytes_;
    std::size_t* renamed_;
    std::string out_;
    int depth_ = 0;
    int indent_ = 0;
};

}  // namespace

bool isScriptName(std::string_view name) {
    const auto isLetter = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '$';
    };
    if (name.empty() || !isLetter(name[0])) return false;
    for (const char c : name)
        if (!isLetter(c) && !(c >= '0' && c <= '9')) return false;
    for (const std::string_view word :
         {"if",       "else",   "for",    "while",   "do",       "return",     "break",
          "continue", "switch", "case",   "default", "function", "var",        "new",
          "true",     "false",  "typeof", "delete",  "in",       "instanceof", "void",
          "throw",    "try",    "catch",  "finally", "with"})
        if (name == word) return false;
    return true;
}

std::string scriptNameFrom(std::string name) {
    for (char& c : name)
        if (!isScriptName(std::string("a") + c)) c = '_';
    return isScriptName(name) ? name : "_" + name;
}

std::size_t scriptNumberLength(std::string_view text) {
    std::size_t at = 0;
    const auto digits = [&] {
        const std::size_t begin = at;
        while (at < text.size() && text[at] >= '0' && text[at] <= '9') ++at;
        return at - begin;
    };
    std::size_t mantissa = digits();
    if (at < text.size() && text[at] == '.') {
        ++at;
        mantissa += digits();
    }
    if (mantissa == 0) return 0;
    const std::size_t end = at;
    if (at < text.size() && (text[at] == 'E' || text[at] == 'e')) {
        ++at;
        if (at < text.size() && text[at] == '-') ++at;
        if (digits() == 0) at = end;
    }
    return at;
}

bool canBeQuoted(std::string_view text, char quote) {
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] == quote || text[i] == '\n' || text[i] == '\r' || text[i] == '\0') return false;
        if (text[i] == '\\' && (++i == text.size() || text[i] == '\n' || text[i] == '\r'))
            return false;
    }
    return true;
}

Result<std::string> readScript(BitReader& in, std::vector<std::string> names, int maxNesting,
                               std::uint64_t maxBytes, std::size_t* renamed) {
    return ScriptReader(in, std::move(names), maxNesting, maxBytes, renamed).read();
}

}  // namespace stx::mpeg4
