#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "lib/base/result.hpp"

namespace stx::tools {

/// Reports of shards (`--shard K/N --report`), joined: lines of `stx convert` or `stx validate`, or
/// reports of `stx render`. Of an input or picture that several runs report, as when one was
/// stopped and started again, the best is taken: ok, then skipped, then error; of equals the later.
/// Stages (`--explain`) are those of all runs together.
class MergedReport {
  public:
    /// Adds the text of one report. Errors (invalidInput): neither of the two, no shard's, another
    /// kind, length, job or input than those before.
    [[nodiscard]] Result<void> add(std::string_view text);

    /// Inputs or pictures of all shards together; 0 until a report has told it.
    [[nodiscard]] std::size_t total() const { return total_; }
    [[nodiscard]] bool ofPictures() const { return kind_ == Kind::pictures; }
    /// Runs that ended before their work, with what they said.
    [[nodiscard]] const std::vector<std::string>& failedRuns() const { return failedRuns_; }

    struct Counts {
        std::size_t ok = 0, skipped = 0, failed = 0;
        std::size_t breakRules = 0;  ///< of those that are ok: validated, and not without findings
    };
    [[nodiscard]] Counts counts() const;
    /// Neighbouring indices that no report has, first and last of them included.
    struct Gap {
        std::size_t first, last;
    };
    /// All of these, ascending: one more than the entries at most, whatever total the reports tell.
    [[nodiscard]] std::vector<Gap> missing() const;
    [[nodiscard]] std::size_t missingCount() const { return total_ - entries_.size(); }
    /// The indices of inputs that failed, ascending.
    [[nodiscard]] std::vector<std::size_t> failed() const;
    /// Errors (invalidInput) when `names`, those of all inputs by index, are of another number, or
    /// not the inputs of the reports (reports of pictures name none).
    [[nodiscard]] Result<void> checkInputs(const std::vector<std::string>& names) const;

    /// The outputs that are reported as done or skipped, by index. Error (invalidInput): a name
    /// that reports do not hold as it is, since it is not UTF-8.
    [[nodiscard]] Result<std::vector<std::string>> outputs() const;

    /// The joined report: JSON lines, or one report of all pictures; each entry once, by index.
    [[nodiscard]] std::string text() const;

  private:
    enum class Kind { none, inputs, pictures };
    enum class Status : std::uint8_t { error, skipped, ok };
    struct Entry {
        Status status;
        bool breaksRules;  ///< it is ok, and its exit code is another than 0
        std::string line;  ///< JSON; shorter than the parsed form, of which there may be millions
    };
    [[nodiscard]] Result<void> addEntry(nlohmann::ordered_json entry, std::size_t total);
    [[nodiscard]] Result<void> addPictures(nlohmann::ordered_json report);
    void addStages(const nlohmann::ordered_json& stages);
    [[nodiscard]] Result<void> expect(Kind kind, std::size_t total);
    /// Errors when a report's shard tells of another job than those before it.
    [[nodiscard]] Result<void> expectJob(const nlohmann::ordered_json& shard);

    Kind kind_ = Kind::none;
    std::size_t total_ = 0;
    std::string job_;  ///< of the shards; reports of earlier versions do not tell it
    std::map<std::size_t, Entry> entries_;
    nlohmann::ordered_json head_;    ///< of pictures: the report without them and `stages_`
    nlohmann::ordered_json stages_;  ///< of pictures; null where no report has any
    std::vector<std::string> failedRuns_;
};

}  // namespace stx::tools
