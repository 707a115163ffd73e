#include "formats/stx/stx.hpp"
#include "formats/validate/validate.hpp"

namespace stx {

Result<std::vector<BrokenRule>> validate(const std::filesystem::path& path, Job& job) {
    STX_TRY(const auto findings, validateFile(path, {}, job));
    std::vector<BrokenRule> broken;
    for (const auto& f : findings)
        broken.push_back({f.rule->number, f.rule->severity == Rule::Severity::error, f.rule->clause,
                          f.rule->summary, f.where, f.found, f.expected});
    return broken;
}

}  // namespace stx
