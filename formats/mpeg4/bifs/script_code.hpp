#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "formats/mpeg4/bifs/bit_stream.hpp"
#include "lib/base/job.hpp"

/// The program of a Script node: source text in BT and XMT-A, a coded tree in BIFS (ISO/IEC
/// 14496-11, SFScript). The source that a tree gives codes to the same tree.
namespace stx::mpeg4 {

/// What all programs begin with in the text forms.
inline constexpr std::string_view kScriptPrefix = "javascript:";

/// Whether a name can stand for a function, a variable or a field of a Script.
[[nodiscard]] bool isScriptName(std::string_view name);
/// The same name, with '_' for what names cannot have.
[[nodiscard]] std::string scriptNameFrom(std::string name);

/// Reads the functions of a program, up to the bit behind the last, as source with the prefix.
/// `names`: the fields of the node, which identifiers may refer to. Names that cannot be one are
/// changed by scriptNameFrom() and counted in `renamed`. Errors (invalidInput) on what the syntax
/// does not have, and when the source gets longer than `maxBytes`.
[[nodiscard]] Result<std::string> readScript(BitReader& in, std::vector<std::string> names,
                                             int maxNesting, std::uint64_t maxBytes,
                                             std::size_t* renamed = nullptr);

/// Codes a program. Errors: (unsupported) with the line and the word, on what has no code in BIFS.
[[nodiscard]] Result<void> writeScript(BitWriter& out, std::string_view source,
                                       const std::vector<std::string>& names, int maxNesting);

/// Bytes at the front of `text` that are a number as programs have it: 1, .5, 2.5E-3.
[[nodiscard]] std::size_t scriptNumberLength(std::string_view text);
/// Whether `text` can stand between such quotes.
[[nodiscard]] bool canBeQuoted(std::string_view text, char quote);

/// Kinds of statements and expressions with their codes.
namespace script {
inline constexpr int kStatementBits = 3;
inline constexpr int kExpressionBits = 6;
enum Statement { kIf, kFor, kWhile, kReturn, kCompound, kBreak, kContinue, kSwitch };
enum Expression {
    kParentheses,
    kNegative,
    kNot,
    kOnesComplement,
    kIncrement,
    kDecrement,
    kPostIncrement,
    kPostDecrement,
    kCondition,
    kString,
    kNumber,
    kIdentifier,
    kFunctionCall,
    kNew,
    kMember,
    kMethodCall,
    kIndex,
    kAssign,      ///< the first of the assignments, which end before kEqual
    kEqual = 29,  ///< the first of the other operators with two sides
    kBoolean = 48,
    kVariables = 49,
    kFunction = 50,
};
/// The operators from kAssign to kBoolean - 1 with how tightly they bind.
struct Operator {
    std::string_view text;
    int binding;
};
inline constexpr Operator kOperators[] = {
    {"=", 2},  {"+=", 2},  {"-=", 2},  {"*=", 2},   {"/=", 2},  {"%=", 2},  {"&=", 2},   {"|=", 2},
    {"^=", 2}, {"<<=", 2}, {">>=", 2}, {">>>=", 2}, {"==", 9},  {"!=", 9},  {"<", 10},   {"<=", 10},
    {">", 10}, {">=", 10}, {"+", 12},  {"-", 12},   {"*", 13},  {"/", 13},  {"%", 13},   {"&&", 5},
    {"||", 4}, {"&", 8},   {"|", 6},   {"^", 7},    {"<<", 11}, {">>", 11}, {">>>", 11},
};
inline constexpr int kAssignment = 2;  ///< bindings of what is not an operator of the table
inline constexpr int kConditional = 3;
inline constexpr int kUnary = 14;
inline constexpr int kPostfix = 15;
inline constexpr int kPrimary = 16;
}  // namespace script

}  // namespace stx::mpeg4
