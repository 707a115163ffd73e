#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "formats/mpeg4/mapping/mapping.hpp"
#include "lib/model/atlas.hpp"

/// Numbered rules for presentations, bundles and atlases: 1xxx file, 2xxx container, descriptors
/// and commands, 3xxx camera, 4xxx depth and images, 5xxx atlas, 6xxx normal and splat. Numbers are
/// never used again for something else.
namespace stx {

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

struct ValidateOptions {
    /// Decode the images and look at every pixel; without, only headers are read.
    bool pixels = true;
    /// Images that the scene names by a string are looked for in here.
    std::filesystem::path folder;
    mpeg4::ImageDecoder decode = decodeImage;
};

/// Every rule that a presentation breaks, in order of the scene; empty when it breaks none.
[[nodiscard]] std::vector<Finding> validate(const Mpeg4Document& document,
                                            const ValidateOptions& options, Job& job);
/// Reads the file first: one that cannot be read breaks rule 1001. Errors (io) only when there is
/// no such file or it cannot be opened.
[[nodiscard]] Result<std::vector<Finding>> validateMpeg4File(const std::filesystem::path& path,
                                                             const ValidateOptions& options,
                                                             Job& job);
/// The rules on cameras, depths, normals and splats, for bundles of any container.
[[nodiscard]] std::vector<Finding> validate(const Bundle& bundle);
/// The rules on atlases.
[[nodiscard]] std::vector<Finding> validate(const Atlas& atlas);

}  // namespace stx
