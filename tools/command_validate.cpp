#include <nlohmann/json.hpp>

#include "formats/validate/validate.hpp"
#include "lib/base/printable.hpp"
#include "tools/commands.hpp"

namespace stx::tools {
namespace {

struct ValidateCommandOptions {
    std::string input;
    bool noPixels = false;
    bool rules = false;
};

const char* wordOf(Rule::Severity severity) {
    return severity == Rule::Severity::error ? "error" : "warning";
}

Result<int> printRules(Program& program) {
    for (const auto& rule : ruleCatalogue())
        program.print(fmt::format("{} {}: {} ({})\n", rule.number, wordOf(rule.severity),
                                  rule.summary, rule.clause));
    return 0;
}

Result<int> run(const ValidateCommandOptions& o, Program& program) {
    if (o.rules) return printRules(program);
    if (o.input.empty())
        return fail(ErrorCode::usage, "FILE is required. See 'stx validate --help'");
    STX_TRY(const auto findings, validateFile(o.input, {!o.noPixels}, program.job));
    bool valid = true;
    auto list = nlohmann::ordered_json::array();
    for (const auto& f : findings) {
        valid = valid && f.rule->severity != Rule::Severity::error;
        list.push_back({{"rule", f.rule->number},
                        {"severity", wordOf(f.rule->severity)},
                        {"clause", f.rule->clause},
                        {"where", f.where},
                        {"message", f.rule->summary},
                        {"found", f.found},
                        {"expected", f.expected}});
        if (program.common.format != "json") program.print(printable(f.text()) + "\n");
    }
    if (program.common.format == "json") {
        program.printJson({{"$schema", "validate.schema.json"},
                           {"file", o.input},
                           {"valid", valid},
                           {"findings", list}});
    }
    return findings.empty() ? 0 : static_cast<int>(ErrorCode::difference);
}

}  // namespace

void addValidate(CommandLine& line, Program& program) {
    Command c = line.add("validate",
                         "Every rule that a file breaks, by number; silent, with exit code "
                         "0, when it breaks none\n\n"
                         "  stx validate model.mp4\n"
                         "  stx validate --rules");
    auto o = std::make_shared<ValidateCommandOptions>();
    c.option("FILE", o->input, "Bundle, atlas, image set or mesh");
    c.flag("--no-pixels", o->noPixels, "Look at headers only, decode no image");
    c.flag("--rules", o->rules, "Print the catalogue of rules and stop");
    c.sharedOptions(program.common, kFormat | kOutside);
    c.runs([o](Program& p) { return run(*o, p); });
}

}  // namespace stx::tools
