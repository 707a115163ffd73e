#include <algorithm>
#include <map>
#include <optional>

#include "formats/mpeg4/bifs/script_code.hpp"
#include "lib/base/whole_number.hpp"

namespace stx::mpeg4 {
namespace {

using namespace script;

/// A word, number, string (with its quotes) or mark of a program.
struct ScriptToken {
    enum class Kind { end, name, number, string, mark } kind = Kind::end;
    std::string_view text;
    int line = 1;
};

class ScriptWriter {
  public:
    ScriptWriter(BitWriter& out, std::string_view source, const std::vector<std::string>& names,
                 int maxNesting)
        : out_(out), source_(source), maxNesting_(maxNesting) {
        for (const std::string& name : names) names_.emplace(name, count_++);
    }

    Result<void> write() {
        const auto start = source_.find_first_not_of(" \t\r\n");
        const std::string_view text = start == std::string_view::npos ? "" : source_.substr(start);
        if (!text.empty()) {
            const auto colon = text.find(':');
            std::string prefix(text.substr(0, colon == std::string_view::npos ? 0 : colon + 1));
            for (char& c : prefix)
                if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
            if (prefix != kScriptPrefix && prefix != "vrmlscript:" && prefix != "ecmascript:")
                return fail(ErrorCode::unsupported,
                            "the program of a Script does not begin with 'javascript:', and only "
                            "source text has a form in BIFS; write a text (.bt, .xmt)");
            at_ = start + prefix.size();
        } else {
            at_ = source_.size();
        }
        STX_CHECK(next());
        while (isName("function")) {
            out_.flag(true);
            STX_CHECK(next());
            STX_CHECK(identifier());
            STX_CHECK(arguments());
            STX_CHECK(block());
            while (isMark(";")) STX_CHECK(next());
        }
        if (token_.kind != ScriptToken::Kind::end) return noCode("outside of functions");
        out_.flag(false);
        return {};
    }

  private:
    using Kind = ScriptToken::Kind;

    tl::unexpected<Error> noCode(std::string_view where) const {
        return fail(
            ErrorCode::unsupported,
            "the program of a Script has {} {} in line {}, which has no form in BIFS; write "
            "a text (.bt, .xmt)",
            token_.kind == Kind::end ? std::string("an end")
                                     : fmt::format("'{}'", token_.text.substr(0, 40)),
            where, token_.line);
    }
    [[nodiscard]] bool isMark(std::string_view text) const {
        return token_.kind == Kind::mark && token_.text == text;
    }
    [[nodiscard]] bool isName(std::string_view text) const {
        return token_.kind == Kind::name && token_.text == text;
    }
    Result<void> take(std::string_view mark) {
        if (!isMark(mark)) return noCode(fmt::format("instead of '{}'", mark));
        return next();
    }

    // ---- words

    Result<void> skipBlanks() {
        for (;;) {
            while (at_ < source_.size() &&
                   std::string_view(" \t\r\n").find(source_[at_]) != std::string_view::npos)
                if (source_[at_++] == '\n') ++line_;
            const std::string_view rest = source_.substr(at_);
            if (rest.starts_with("//")) {
                at_ = std::min(source_.size(), source_.find('\n', at_));
            } else if (rest.starts_with("/*")) {
                const auto end = rest.find("*/", 2);
                if (end == std::string_view::npos)
                    return fail(ErrorCode::unsupported,
                                "the program of a Script has a remark without an end in line {}",
                                line_);
                line_ += static_cast<int>(std::count(
                    rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
                at_ += end + 2;
            } else {
                return {};
            }
        }
    }

    /// Reads the next token into token_.
    Result<void> next() {
        STX_CHECK(skipBlanks());
        token_ = {Kind::end, {}, line_};
        const std::string_view rest = source_.substr(at_);
        if (rest.empty()) return {};
        std::size_t length = 0;
        if (const std::size_t number = hexLength(rest); number > 0) {
            token_.kind = Kind::number;
            length = number;
        } else if (rest[0] == '"' || rest[0] == '\'') {
            token_.kind = Kind::string;
            length = 1;
            while (length < rest.size() && rest[length] != rest[0] && rest[length] != '\n')
                length += rest[length] == '\\' ? 2 : 1;
            if (length >= rest.size() || rest[length] != rest[0])
                return fail(ErrorCode::unsupported,
                            "the program of a Script has a string without an end in line {}",
                            line_);
            ++length;
        } else if (isScriptName(rest.substr(0, 1))) {
            token_.kind = Kind::name;
            while (length < rest.size() && isNameLetter(rest[length])) ++length;
        } else {
            token_.kind = Kind::mark;
            length = 1;
            for (const std::string_view mark :
                 {">>>=", "<<=", ">>=", ">>>", "===", "!==", "==", "!=", "<=", ">=", "&&", "||",
                  "++",   "--",  "+=",  "-=",  "*=",  "/=",  "%=", "&=", "|=", "^=", "<<", ">>"})
                if (rest.starts_with(mark)) {
                    length = mark.size();
                    break;
                }
        }
        token_.text = rest.substr(0, length);
        at_ += length;
        return {};
    }
    static bool isNameLetter(char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '_' || c == '$';
    }
    static std::size_t hexLength(std::string_view text) {
        if (!text.starts_with("0x") && !text.starts_with("0X")) return scriptNumberLength(text);
        const auto end = text.find_first_not_of("0123456789abcdefABCDEF", 2);
        return end == std::string_view::npos ? text.size() : end;
    }

    // ---- names

    Result<void> identifier() {
        if (token_.kind != Kind::name || !isScriptName(token_.text))
            return noCode("where a name is expected");
        const auto known = names_.find(token_.text);
        out_.flag(known != names_.end());
        if (known != names_.end()) {
            const int bits = count_ < 2 ? 0 : significantBits(count_ - 1);
            out_.write(known->second, bits);
        } else {
            characters(token_.text);
            names_.emplace(token_.text, count_++);
        }
        return next();
    }
    void characters(std::string_view text) {
        for (const char c : text) out_.write(static_cast<unsigned char>(c), 8);
        out_.write(0, 8);
    }
    /// `(a, b)`
    template <class Item>
    Result<void> inParentheses(const Item& item) {
        STX_CHECK(take("("));
        while (!isMark(")")) {
            out_.flag(true);
            STX_CHECK(item());
            if (!isMark(",")) break;
            STX_CHECK(next());
        }
        out_.flag(false);
        return take(")");
    }
    Result<void> arguments() {
        return inParentheses([&] { return identifier(); });
    }
    Result<void> parameters() {
        return inParentheses([&] { return expression(kAssignment); });
    }

    // ---- statements

    Result<void> deeper() {
        if (++depth_ > maxNesting_)
            return fail(ErrorCode::unsupported, "the program of a Script nests deeper than {}",
                        maxNesting_);
        return {};
    }

    /// `{ statements }`, or one statement. An empty one has the form of an empty block.
    Result<void> block() {
        if (isMark(";")) {
            out_.write(2, 2);  // braces, and no statement in them
            return next();
        }
        const bool braces = isMark("{");
        out_.flag(braces);
        if (!braces) return statement();
        STX_CHECK(next());
        STX_CHECK(statementsUntil([&] { return isMark("}"); }));
        return take("}");
    }
    /// Statements up to where `end` is true, which is left to the caller; with no mark at their
    /// end.
    template <class End>
    Result<void> openStatements(const End& end) {
        while (!end()) {
            if (token_.kind == Kind::end) return noCode("instead of '}'");
            if (isMark(";")) {
                STX_CHECK(next());
                continue;
            }
            out_.flag(true);
            STX_CHECK(statement());
        }
        return {};
    }
    template <class End>
    Result<void> statementsUntil(const End& end) {
        STX_CHECK(openStatements(end));
        out_.flag(false);
        return {};
    }

    Result<void> statement() {
        STX_CHECK(deeper());
        auto done = statementHere();
        --depth_;
        return done;
    }
    void kind(Statement which) { out_.write(static_cast<std::uint32_t>(which), kStatementBits); }
    Result<void> endStatement() {
        if (isMark("}")) return {};
        return take(";");
    }

    Result<void> statementHere() {
        if (isName("if")) {
            kind(kIf);
            STX_CHECK(condition());
            STX_CHECK(block());
            while (isMark(";")) STX_CHECK(next());
            out_.flag(isName("else"));
            if (!isName("else")) return {};
            STX_CHECK(next());
            return block();
        }
        if (isName("while")) {
            kind(kWhile);
            STX_CHECK(condition());
            return block();
        }
        if (isName("for")) return forStatement();
        if (isName("switch")) return switchStatement();
        if (isName("return")) {
            kind(kReturn);
            STX_CHECK(next());
            const bool value = !isMark(";") && !isMark("}");
            out_.flag(value);
            if (value) STX_CHECK(compound());
            return endStatement();
        }
        if (isName("break") || isName("continue")) {
            kind(isName("break") ? kBreak : kContinue);
            STX_CHECK(next());
            return endStatement();
        }
        kind(kCompound);
        STX_CHECK(compound());
        return endStatement();
    }

    /// `while (x)`, with the word still to be taken.
    Result<void> condition() {
        STX_CHECK(next());
        STX_CHECK(take("("));
        STX_CHECK(compound());
        return take(")");
    }
    Result<void> forStatement() {
        kind(kFor);
        STX_CHECK(next());
        STX_CHECK(take("("));
        for (const std::string_view end : {";", ";", ")"}) {
            out_.flag(!isMark(end));
            if (!isMark(end)) STX_CHECK(compound());
            STX_CHECK(take(end));
        }
        return block();
    }

    Result<void> switchStatement() {
        kind(kSwitch);
        STX_CHECK(condition());
        STX_CHECK(take("{"));
        // All values have as many bits as the largest, which only the source knows beforehand.
        out_.write(kCaseBits, 5);
        if (!isName("case")) return noCode("instead of 'case'");
        while (isName("case")) {
            STX_CHECK(next());
            const auto value = integerOf(token_);
            if (!value || *value >> kCaseBits != 0) return noCode("as the value of a case");
            out_.write(static_cast<std::uint32_t>(*value), kCaseBits);
            STX_CHECK(next());
            STX_CHECK(caseBody());
            out_.flag(isName("case"));
        }
        out_.flag(isName("default"));
        if (isName("default")) {
            STX_CHECK(next());
            STX_CHECK(caseBody());
        }
        return take("}");
    }
    Result<void> caseBody() {
        STX_CHECK(take(":"));
        const auto atEnd = [&] { return isName("case") || isName("default") || isMark("}"); };
        out_.flag(true);
        // A block alone is the body itself.
        if (!isMark("{")) return statementsUntil(atEnd);
        STX_CHECK(next());
        STX_CHECK(openStatements([&] { return isMark("}"); }));
        STX_CHECK(take("}"));
        return statementsUntil(atEnd);
    }

    // ---- expressions. A kind stands before its parts, and is known only behind the first: parts
    // are coded apart and put together.

    void kind(Expression which) { kind(static_cast<int>(which)); }
    void kind(int which) { out_.write(static_cast<std::uint32_t>(which), kExpressionBits); }

    Result<void> compound() {
        STX_CHECK(expression(kAssignment));
        while (isMark(",")) {
            out_.flag(true);
            STX_CHECK(next());
            STX_CHECK(expression(kAssignment));
        }
        out_.flag(false);
        return {};
    }

    /// An expression whose operators bind at least so tightly.
    Result<void> expression(int leastBinding) {
        STX_CHECK(deeper());
        auto done = expressionHere(leastBinding);
        --depth_;
        return done;
    }

    Result<void> expressionHere(int leastBinding) {
        BitWriter outer = std::exchange(out_, BitWriter());
        auto done = operandAndOperators(leastBinding);
        BitWriter inner = std::exchange(out_, std::move(outer));
        if (done) out_.append(inner);
        return done;
    }

    /// Puts a kind before what was coded so far of this expression.
    void kindBefore(int which) {
        BitWriter first = std::exchange(out_, BitWriter());
        kind(which);
        out_.append(first);
    }

    Result<void> operandAndOperators(int leastBinding) {
        STX_CHECK(operand());
        for (int steps = 0;; ++steps) {
            // Each step puts all before it one level deeper.
            if (steps + depth_ > maxNesting_)
                return fail(ErrorCode::unsupported, "the program of a Script nests deeper than {}",
                            maxNesting_);
            if (token_.kind != Kind::mark) return {};
            if (isMark("?") && leastBinding <= kConditional) {
                kindBefore(kCondition);
                STX_CHECK(next());
                STX_CHECK(expression(kAssignment));
                STX_CHECK(take(":"));
                STX_CHECK(expression(kAssignment));
                continue;
            }
            const auto op = std::find_if(std::begin(kOperators), std::end(kOperators),
                                         [&](const Operator& o) { return o.text == token_.text; });
            if (op == std::end(kOperators) || op->binding < leastBinding) return {};
            kindBefore(kAssign + static_cast<int>(op - std::begin(kOperators)));
            STX_CHECK(next());
            STX_CHECK(expression(op->binding == kAssignment ? kAssignment : op->binding + 1));
        }
    }

    Result<void> operand() {
        if (token_.kind == Kind::mark) {
            const std::pair<std::string_view, Expression> signs[] = {{"-", kNegative},
                                                                     {"!", kNot},
                                                                     {"~", kOnesComplement},
                                                                     {"++", kIncrement},
                                                                     {"--", kDecrement}};
            for (const auto& [text, which] : signs)
                if (isMark(text)) {
                    kind(which);
                    STX_CHECK(next());
                    return expression(kUnary);
                }
        }
        STX_CHECK(primary());
        for (int steps = 0;; ++steps) {
            if (steps + depth_ > maxNesting_)
                return fail(ErrorCode::unsupported, "the program of a Script nests deeper than {}",
                            maxNesting_);
            if (isMark(".")) {
                STX_CHECK(next());
                BitWriter object = std::exchange(out_, BitWriter());
                STX_CHECK(identifier());
                BitWriter member = std::exchange(out_, BitWriter());
                const bool call = isMark("(");
                kind(call ? kMethodCall : kMember);
                out_.append(object);
                out_.append(member);
                if (call) STX_CHECK(parameters());
            } else if (isMark("[")) {
                kindBefore(kIndex);
                STX_CHECK(next());
                STX_CHECK(compound());
                STX_CHECK(take("]"));
            } else if (isMark("++") || isMark("--")) {
                kindBefore(isMark("++") ? kPostIncrement : kPostDecrement);
                STX_CHECK(next());
            } else {
                return {};
            }
        }
    }

    Result<void> primary() {
        if (isMark("(")) {
            kind(kParentheses);
            STX_CHECK(next());
            STX_CHECK(compound());
            return take(")");
        }
        if (token_.kind == Kind::string) {
            kind(kString);
            characters(token_.text.substr(1, token_.text.size() - 2));
            return next();
        }
        if (token_.kind == Kind::number) return number();
        if (isName("true") || isName("false")) {
            kind(kBoolean);
            out_.flag(isName("true"));
            return next();
        }
        if (isName("var")) {
            kind(kVariables);
            STX_CHECK(next());
            for (;;) {
                out_.flag(true);
                STX_CHECK(identifier());
                // `var a, b = 1`: what follows an assignment is an expression of its own.
                if (!isMark(",") || !namesFollow()) break;
                STX_CHECK(next());
            }
            out_.flag(false);
            return {};
        }
        if (isName("new")) {
            kind(kNew);
            STX_CHECK(next());
            STX_CHECK(identifier());
            if (isMark("(")) return parameters();
            out_.flag(false);
            return {};
        }
        if (isName("function")) {
            kind(kFunction);
            STX_CHECK(next());
            STX_CHECK(arguments());
            return block();
        }
        if (token_.kind != Kind::name || !isScriptName(token_.text))
            return noCode("where a value is expected");
        BitWriter before = std::exchange(out_, BitWriter());
        STX_CHECK(identifier());
        BitWriter name = std::exchange(out_, std::move(before));
        const bool call = isMark("(");
        kind(call ? kFunctionCall : kIdentifier);
        out_.append(name);
        return call ? parameters() : Result<void>();
    }
    /// Whether the comma that is next stands before a name without a value: `, b` but not `, b =
    /// 1`.
    bool namesFollow() {
        const ScriptToken token = token_;
        const std::size_t at = at_;
        const int line = line_;
        bool plain = next().has_value() && token_.kind == Kind::name && next().has_value() &&
                     (isMark(",") || isMark(";"));
        token_ = token;
        at_ = at;
        line_ = line;
        return plain;
    }

    static std::optional<std::uint64_t> integerOf(const ScriptToken& token) {
        std::string_view text = token.text;
        if (token.kind != Kind::number) return {};
        const bool hex = text.starts_with("0x") || text.starts_with("0X");
        if (hex) text.remove_prefix(2);
        if (!hex && text.size() > 1 && text[0] == '0') return {};
        return wholeNumber<std::uint64_t>(text, hex ? 16 : 10);
    }
    Result<void> number() {
        kind(kNumber);
        const auto value = integerOf(token_);
        const bool integer = value && *value >> 31 == 0;
        out_.flag(integer);
        if (integer) {
            const int bits = significantBits(*value);
            out_.write(static_cast<std::uint32_t>(bits), 5);
            out_.write(static_cast<std::uint32_t>(*value), bits);
            return next();
        }
        const std::string text = value ? fmt::format("{}", *value) : std::string(token_.text);
        if (scriptNumberLength(text) != text.size()) return noCode("as a number");
        for (const char c : text)
            out_.write(c == '.' ? 10 : c == 'e' || c == 'E' ? 11 : c == '-' ? 12 : c - '0', 4);
        out_.write(15, 4);
        return next();
    }

    static constexpr int kCaseBits = 16;

    BitWriter& out_;
    std::string_view source_;
    std::size_t at_ = 0;
    int line_ = 1;
    ScriptToken token_;
    std::map<std::string, std::uint32_t, std::less<>> names_;
    std::uint32_t count_ = 0;  ///< of names; one that came twice has the first's number
    int maxNesting_;
    int depth_ = 0;
};

}  // namespace

Result<void> writeScript(BitWriter& out, std::string_view source,
                         const std::vector<std::string>& names, int maxNesting) {
    return ScriptWriter(out, source, names, maxNesting).write();
}

}  // namespace stx::mpeg4
