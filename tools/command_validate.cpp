#include <nlohmann/json.hpp>

#include "formats/validate/validate.hpp"
#include "lib/base/printable.hpp"
#include "tools/batch.hpp"
#include "tools/commands.hpp"

namespace stx::tools {
namespace {

using Json = nlohmann::ordered_json;

struct ValidateCommandOptions {
    std::vector<std::string> inputs;
    bool noPixels = false;
    bool rules = false;
    BatchOptions batch;
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

/// The entry of a file's report. A file that breaks rules was validated, so its status is ok.
Result<Json> validateOne(const std::string& input, const ValidateCommandOptions& o,
                         Program& program) {
    STX_TRY(const auto findings, validateFile(input, {!o.noPixels}, program.job));
    bool valid = true;
    auto list = Json::array();
    for (const auto& f : findings) {
        valid = valid && f.rule->severity != Rule::Severity::error;
        list.push_back({{"rule", f.rule->number},
                        {"severity", wordOf(f.rule->severity)},
                        {"clause", f.rule->clause},
                        {"where", f.where},
                        {"message", f.rule->summary},
                        {"found", f.found},
                        {"expected", f.expected},
                        {"text", f.text()}});
    }
    const int code = findings.empty() ? 0 : static_cast<int>(ErrorCode::difference);
    return Json{{"input", input},
                {"status", "ok"},
                {"exitCode", code},
                {"valid", valid},
                {"findings", std::move(list)}};
}

/// What is printed of one entry; `named`: with the file's name, since there are several.
void printEntry(const Json& entry, bool named, Program& program) {
    const std::string input = entry.value("input", "");
    const bool failed = entry.value("status", "") == "error";
    Json findings = entry.value("findings", Json::array());
    if (program.common.format != "json") {
        for (const auto& f : findings)
            program.print(printable((named ? input + ": " : "") + f.value("text", "")) + "\n");
        return;
    }
    for (auto& f : findings) f.erase("text");
    Json document = {{"$schema", "validate.schema.json"},
                     {"file", input},
                     {"valid", entry.value("valid", false)},
                     {"findings", std::move(findings)}};
    if (failed) document["error"] = entry.value("message", "");
    if (named)
        program.printJsonLine(document);
    else
        program.printJson(document);
}

Result<int> run(const ValidateCommandOptions& options, const Command& command, Program& program) {
    ValidateCommandOptions o = options;
    if (o.rules) return printRules(program);
    if (o.inputs.empty())
        return fail(ErrorCode::usage, "FILE is required. See 'stx validate --help'");
    STX_TRY(const auto inputs, expandInputs(o.inputs, command, program));
    o.batch.shard.addInputs(inputs);
    if (inputs.size() == 1 && o.inputs[0][0] != '@' && !o.batch.shard.given) {
        STX_TRY(auto entry, validateOne(inputs[0], o, program));
        printEntry(entry, false, program);
        for (auto& f : entry["findings"]) f.erase("text");
        STX_CHECK(program.writeReportText(
            entry.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n"));
        return entry["exitCode"].get<int>();
    }
    std::vector<BatchItem> items;
    for (const auto& input : inputs) items.push_back({input, "", items.size()});
    o.batch.total = items.size();
    // A file that cannot be read says nothing about the others.
    o.batch.keepGoing = true;
    int worst = 0;
    o.batch.onEntry = [&](Json& entry) {
        printEntry(entry, true, program);
        worst = std::max(worst, entry.value("exitCode", 0));
        entry.erase("output");
        if (entry.contains("findings"))
            for (auto& f : entry["findings"]) f.erase("text");
    };
    const BatchWork work = [&](const BatchItem& item, Program& p) {
        return validateOne(item.input, o, p);
    };
    STX_TRY(const int done, runBatch(itemsOf(items, o.batch.shard), o.batch, work, program));
    return std::max(done, worst);
}

}  // namespace

void addValidate(CommandLine& line, Program& program) {
    Command c = line.add("validate",
                         "Every rule that files break, by number; silent, with exit code 0, when "
                         "they break none\n\n"
                         "  stx validate model.mp4\n"
                         "  stx validate out/*.mp4 --format json --jobs 4\n"
                         "  stx validate @list.txt --report found.jsonl --shard 2/8\n"
                         "  stx validate --rules\n\n"
                         "Of several files each is looked at, whatever the others are, and lines "
                         "begin with its name.\nThe exit code is 7 where one breaks a rule, and "
                         "that of the first that cannot be read at all.");
    auto o = std::make_shared<ValidateCommandOptions>();
    c.option("FILE", o->inputs,
             "Bundles, atlases, image sets or meshes; @FILE: those named in its lines, # begins a "
             "comment");
    c.flag("--no-pixels", o->noPixels, "Look at headers only, decode no image");
    c.flag("--rules", o->rules, "Print the catalogue of rules and stop");
    Command many = c.under("Many inputs");
    addJobsOption(many, o->batch);
    addShardOption(many, o->batch.shard, "inputs");
    c.sharedOptions(program.common, kOutput | kFormat | kOutside);
    c.runs([o, c](Program& p) { return run(*o, c, p); });
}

}  // namespace stx::tools
