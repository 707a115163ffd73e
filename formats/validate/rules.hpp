#pragma once

#include <span>
#include <string>

namespace stx {

/// A numbered rule for files, bundles and atlases. 1xxx file, 2xxx MPEG-4's container, descriptors
/// and commands, 3xxx camera, 4xxx depth and images, 5xxx atlas, 6xxx normal and splat, 7xxx time,
/// 8xxx environment. A number is never used again for something else.
struct Rule {
    enum class Severity {
        error,    ///< readers cannot show it, or show something else
        warning,  ///< legal, but likely a mistake or not understood everywhere
    };
    int number = 0;
    Severity severity = Severity::error;
    const char* clause = "";   ///< of the standard, or of this project's own conventions
    const char* summary = "";  ///< what must hold
};

/// All rules, ascending by number.
[[nodiscard]] std::span<const Rule> ruleCatalogue();
/// One of them; null when there is no such number.
[[nodiscard]] const Rule* findRule(int number);

/// A broken rule.
struct Finding {
    const Rule* rule = nullptr;
    std::string where;  ///< `view 3 'front'`, `object descriptor 10`, a box path; may be empty
    std::string found;
    std::string expected;

    /// `4001 error: view 3 'front': found ..., expected ... (ISO/IEC ...)`.
    [[nodiscard]] std::string text() const;
};

}  // namespace stx
