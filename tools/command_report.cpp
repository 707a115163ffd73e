#include <algorithm>
#include <span>

#include "lib/base/printable.hpp"
#include "tools/batch.hpp"
#include "tools/commands.hpp"
#include "tools/report_merge.hpp"

namespace stx::tools {
namespace {

constexpr std::size_t kMostNamed = 20;  ///< of what is missing, for people; --missing has all

struct ReportOptions {
    std::string action, output, missing, outputs;
    std::vector<std::string> files, inputs;
};

/// A name as a line of a list that is read as that name, see expandInputs(). `option` is for the
/// message. Errors (invalidInput): it has a line end.
Result<std::string> lineOf(const std::string& name, const char* option) {
    if (name.find('\n') != std::string::npos || name.ends_with('\r'))
        return fail(ErrorCode::invalidInput,
                    "{}: the name '{}' holds the end of a line, and a list has one name in each "
                    "line; rename it",
                    option, name);
    return name + "\n";
}

/// The list of what is to be done again: missing and failed inputs, a line each.
Result<std::string> listOfRest(const MergedReport& merged, const std::vector<std::string>& names) {
    std::vector<std::size_t> rest = merged.failed();
    // There are as many names as the reports tell of inputs.
    for (const auto& gap : merged.missing())
        for (std::size_t i = gap.first; i <= gap.last; ++i) rest.push_back(i);
    std::ranges::sort(rest);
    std::string text;
    for (const std::size_t index : rest) {
        STX_TRY(const auto line, lineOf(names[index], "--missing"));
        // A line that begins with # is a comment where the file is not there.
        text += (line.starts_with('#') ? "./" : "") + line;
    }
    return text;
}

Result<int> report(const ReportOptions& o, const Command& command, Program& program) {
    for (const auto& target : {o.output, o.missing, o.outputs})
        if (!target.empty()) STX_CHECK(checkFileTarget(target, program));
    std::vector<std::string> names;
    if (!o.inputs.empty()) STX_SET(names, expandInputs(o.inputs, command, program));
    if (!o.missing.empty() && names.empty())
        return fail(ErrorCode::usage,
                    "--missing needs the names of all inputs; give --inputs "
                    "@LIST as it was given to stx convert");
    MergedReport merged;
    for (const auto& file : o.files) {
        STX_CHECK(program.job.checkCancelled());
        STX_TRY(const auto bytes, readFile(file, program.job.limits));
        STX_CHECK(within(fmt::format("'{}'", file),
                         merged.add({reinterpret_cast<const char*>(bytes.data()), bytes.size()})));
    }
    if (merged.total() == 0)
        return fail(ErrorCode::invalidInput, "no report tells of an input or a picture");
    if (!names.empty()) STX_CHECK(merged.checkInputs(names));
    // What cannot be listed is an error before anything is written.
    std::string rest, outputs;
    if (!o.missing.empty()) STX_SET(rest, listOfRest(merged, names));
    if (!o.outputs.empty()) {
        STX_TRY(const auto made, merged.outputs());
        for (const auto& name : made) {
            STX_TRY(const auto line, lineOf(name, "--outputs"));
            outputs += line;
        }
    }
    if (!o.output.empty()) {
        const std::string text = merged.text();
        STX_CHECK(writeFile(o.output, std::as_bytes(std::span(text)), program.outputOptions()));
    }
    if (!o.missing.empty())
        STX_CHECK(writeFile(o.missing, std::as_bytes(std::span(rest)), program.outputOptions()));
    if (!o.outputs.empty())
        STX_CHECK(writeFile(o.outputs, std::as_bytes(std::span(outputs)), program.outputOptions()));
    for (const auto& run : merged.failedRuns())
        program.job.note("a run ended before its work: " + run);
    const auto counts = merged.counts();
    const char* what = merged.ofPictures() ? "pictures" : "inputs";
    const bool whole = merged.missingCount() == 0 && counts.failed == 0 && counts.breakRules == 0;
    const auto gaps = merged.missing();
    if (program.common.format == "json") {
        auto list = nlohmann::ordered_json::array();
        for (const auto& gap : gaps) list.push_back({gap.first, gap.last});
        program.printJson({{"$schema", "report-merge.schema.json"},
                           {"of", what},
                           {"total", merged.total()},
                           {"ok", counts.ok},
                           {"skipped", counts.skipped},
                           {"failed", counts.failed},
                           {"missing", merged.missingCount()},
                           {"breakRules", counts.breakRules},
                           {"gaps", std::move(list)}});
    } else {
        std::string text = fmt::format(
            "{} {}: {} done, {} skipped, {} failed, {} missing{}\n", merged.total(), what,
            counts.ok, counts.skipped, counts.failed, merged.missingCount(),
            counts.breakRules == 0   ? ""
            : counts.breakRules == 1 ? ", 1 breaks rules"
                                     : fmt::format(", {} break rules", counts.breakRules));
        std::size_t named = 0;
        for (const auto& gap : gaps)
            for (std::size_t i = gap.first; i <= gap.last && named < kMostNamed; ++i, ++named)
                text += fmt::format("missing {}{}\n", i,
                                    names.empty() ? "" : " '" + printable(names[i]) + "'");
        if (merged.missingCount() > kMostNamed)
            text += fmt::format("and {} more\n", merged.missingCount() - named);
        program.print(text);
    }
    return whole ? 0 : static_cast<int>(ErrorCode::difference);
}

}  // namespace

void addReport(CommandLine& line, Program& program) {
    Command c = line.add(
        "report",
        "Joins the reports of shards and tells what is missing; exit code 7 when something is "
        "missing or failed, or a file breaks rules\n\n"
        "  stx report merge shard_*.jsonl -o all.jsonl\n"
        "  stx report merge shard_*.jsonl --inputs @list.txt --missing rest.txt");
    auto o = std::make_shared<ReportOptions>();
    c.option("ACTION", o->action, "What to do").required().oneOf({"merge"});
    c.option("REPORTS", o->files,
             "Reports of 'stx convert', 'stx validate' or 'stx render', made with --shard")
        .required();
    c.option("-o,--output", o->output, "Write the joined report").writes("FILE");
    c.option("--inputs", o->inputs, "The inputs as they were given to 'stx convert', for names")
        .reads("@LIST");
    c.option("--missing", o->missing,
             "Write the names of the inputs that are missing or failed, as a list to convert")
        .writes("FILE");
    c.option("--outputs", o->outputs,
             "Write the names of the outputs that are done or skipped, a line each")
        .writes("FILE");
    c.flag("--no-clobber", program.common.noClobber, "Refuse to replace existing files");
    c.sharedOptions(program.common, kFormat);
    c.runs([o, c](Program& p) { return report(*o, c, p); });
}

}  // namespace stx::tools
