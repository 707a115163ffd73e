#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/program.hpp"
#include "tools/shard.hpp"

namespace stx::tools {

/// One input of a batch and what becomes of it.
struct BatchItem {
    std::string input, output;
    std::size_t index = 0;  ///< in the whole list, of which this may be a shard
    /// Whether the output names numbered files (name_%d.exr): -o has the number, or the input is
    /// such a film. Else a % that came from the input's name is itself.
    bool numbered = false;
};

struct BatchOptions {
    int jobs = 1;               ///< inputs at a time
    bool keepGoing = false;     ///< an input that fails does not stop the others
    bool skipExisting = false;  ///< an input whose output exists is done already
    Shard shard;                ///< entries of reports get the shard and their index
    std::size_t total = 0;      ///< inputs of all shards
    /// Gets each entry before it goes into the report, in the order of the inputs, as soon as it
    /// and all before it are there; may change it. Empty: nothing is done.
    std::function<void(nlohmann::ordered_json&)> onEntry;
};

/// Adds --jobs.
void addJobsOption(Command command, BatchOptions& options);

/// Replaces `@list.txt` by the names in that file (`@-`: in stdin), one in each line, relative to
/// the current folder; empty lines and what follows a # that begins a line or comes after a blank
/// are passed over, but for names that exist with it; `-` is a file of that name. Errors: io;
/// (invalidInput) a list without a name; (usage) no input at all, or an output of the command that
/// would take the place of one.
[[nodiscard]] Result<std::vector<std::string>> expandInputs(const std::vector<std::string>& inputs,
                                                            const Command& command,
                                                            Program& program);

/// Names each input's output: in `pattern`, `{stem}` stands for the input's file name without its
/// ending, `{dir}` for the folder it is in as given ("." for a bare name), `{parent}` for that
/// folder's own name. Errors (usage): several inputs and none of these, two inputs with the same
/// output, an output that would take the place of another one's input.
[[nodiscard]] Result<std::vector<BatchItem>> planBatch(const std::vector<std::string>& inputs,
                                                       const std::string& pattern,
                                                       const Command& command);

/// What a report says of an item that was done, or skipped ("skipped").
[[nodiscard]] nlohmann::ordered_json entryOf(const BatchItem& item, const char* status);
/// The same of one that failed.
[[nodiscard]] nlohmann::ordered_json failedEntry(const BatchItem& item, const Error& error);

/// Those items that the shard has; all when none was asked for.
[[nodiscard]] std::vector<BatchItem> itemsOf(std::vector<BatchItem> items, const Shard& shard);

/// Does one item and returns its report: an object with at least input, output, status, exitCode.
using BatchWork = std::function<Result<nlohmann::ordered_json>(const BatchItem&, Program&)>;

/// Does all items, `jobs` at a time, each in a worker process: a crash or lack of memory costs that
/// one input. The threads asked for are shared among the workers; --max-memory counts for each.
/// Writes the report as JSON lines, in the order of the inputs, whatever happened to them. The
/// error is that of the first input that failed, or the number of those that did (keepGoing).
[[nodiscard]] Result<int> runBatch(const std::vector<BatchItem>& items, const BatchOptions& options,
                                   const BatchWork& work, Program& program);

/// Does items in this process, one after the other, with one report of all that became of them
/// (convert-report.schema.json). The error is that of the first that failed, or of several items
/// under keepGoing the number of those that did.
[[nodiscard]] Result<int> runInTurn(const std::vector<BatchItem>& items,
                                    const BatchOptions& options, const BatchWork& work,
                                    Program& program);

}  // namespace stx::tools
