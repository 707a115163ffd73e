#include "tools/report_merge.hpp"

#include <algorithm>

namespace stx::tools {
namespace {

using Json = nlohmann::ordered_json;

/// U+FFFD, which the JSON of reports has where a name is not UTF-8.
constexpr std::string_view kNoUtf8 = "\xEF\xBF\xBD";

/// The whole number of a key, at least 0.
Result<std::size_t> wholeOf(const Json& json, const char* key) {
    const auto found = json.find(key);
    if (found == json.end() || !found->is_number_unsigned())
        return fail(ErrorCode::invalidInput,
                    "'{}' is missing; only reports of runs with --shard can be joined", key);
    return found->get<std::size_t>();
}

/// A name as it is read from a report, which is UTF-8 whatever the name's bytes are.
std::string asReported(const std::string& name) {
    const auto line = Json(name).dump(-1, ' ', false, Json::error_handler_t::replace);
    return Json::parse(line).get<std::string>();
}

}  // namespace

Result<void> MergedReport::expect(Kind kind, std::size_t total) {
    if (kind_ == Kind::none) {
        kind_ = kind;
        total_ = total;
    }
    if (kind != kind_)
        return fail(ErrorCode::invalidInput,
                    "a report of {} among reports of {}; both cannot be joined",
                    kind == Kind::inputs ? "stx convert" : "stx render",
                    kind == Kind::inputs ? "stx render" : "stx convert");
    if (total != total_)
        return fail(ErrorCode::invalidInput,
                    "it is of {} {}, the reports before it of {}; all must be of one list or path",
                    total, kind == Kind::inputs ? "inputs" : "pictures", total_);
    return {};
}

Result<void> MergedReport::expectJob(const Json& shard) {
    const std::string job = shard.value("job", "");
    if (job_.empty()) job_ = job;
    if (job.empty() || job == job_) return {};
    return fail(ErrorCode::invalidInput,
                "it is of other inputs or options than the reports before it; all must be of one "
                "list or path");
}

Result<void> MergedReport::addEntry(Json entry, std::size_t total) {
    STX_TRY(const auto index, wholeOf(entry, "index"));
    if (index >= total)
        return fail(ErrorCode::invalidInput, "index {} is out of range; there are {}", index,
                    total);
    Status status = Status::ok;
    if (kind_ == Kind::inputs) {
        const std::string told = entry.value("status", "error");
        status = told == "ok" ? Status::ok : told == "skipped" ? Status::skipped : Status::error;
    } else if (entry.value("skipped", false)) {
        status = Status::skipped;
    }
    entry.erase("shard");
    const auto known = entries_.find(index);
    if (known != entries_.end()) {
        const auto before = Json::parse(known->second.line, nullptr, false);
        for (const char* key : {"input", "output"})
            if (before.value(key, "") != entry.value(key, ""))
                return fail(ErrorCode::invalidInput,
                            "number {} is '{}' here and '{}' in a report before; all must be of "
                            "one list or path",
                            index, entry.value(key, ""), before.value(key, ""));
        if (known->second.status > status) return {};
    }
    // A file that breaks rules was validated, which is all that its status says.
    const bool breaksRules = status == Status::ok && entry.value("exitCode", 0) != 0;
    entries_[index] = {status, breaksRules,
                       entry.dump(-1, ' ', false, Json::error_handler_t::replace)};
    return {};
}

/// Throws Json::exception where they are none.
void MergedReport::addStages(const Json& stages) {
    if (stages_.is_null()) stages_ = Json::array();
    for (const Json& stage : stages) {
        const auto known = std::ranges::find_if(stages_, [&](const Json& s) {
            return s.at("name") == stage.at("name") && s.at("once") == stage.at("once");
        });
        if (known == stages_.end()) {
            stages_.push_back(stage);
            continue;
        }
        Json& all = *known;
        all["milliseconds"] =
            all.at("milliseconds").get<double>() + stage.at("milliseconds").get<double>();
        // What is done once for all pictures is done by each run to the same pixels.
        const auto before = all.at("pixels").get<std::uint64_t>();
        const auto more = stage.at("pixels").get<std::uint64_t>();
        all["pixels"] = stage.at("once").get<bool>() ? std::max(before, more) : before + more;
    }
}

Result<void> MergedReport::addPictures(Json report) {
    const auto shard = report.find("shard");
    if (shard == report.end() || !shard->is_object())
        return fail(ErrorCode::invalidInput,
                    "it is not of a shard; only reports of runs with --shard can be joined");
    STX_TRY(const auto total, wholeOf(*shard, "total"));
    STX_CHECK(expect(Kind::pictures, total));
    STX_CHECK(expectJob(*shard));
    auto views = std::move(report["views"]);
    if (!views.is_array()) return fail(ErrorCode::invalidInput, "'views' is not a list");
    for (auto& view : views) {
        if (!view.is_object()) return fail(ErrorCode::invalidInput, "a view is not an object");
        STX_CHECK(addEntry(std::move(view), total));
    }
    if (const auto stages = report.find("stages"); stages != report.end()) addStages(*stages);
    for (const char* key : {"views", "shard", "stages"}) report.erase(key);
    // An empty shard has drawn nothing and does not know by what.
    if (head_.is_null() || head_.value("backend", "").empty()) head_ = std::move(report);
    return {};
}

Result<void> MergedReport::add(std::string_view text) {
    try {
        auto whole = Json::parse(text, nullptr, false);
        if (whole.is_object() && whole.contains("views") && whole.contains("backend"))
            return addPictures(std::move(whole));
        if (whole.is_object() && whole.contains("conversions")) {
            // Frames of one set, by `--frames`.
            auto entries = std::move(whole["conversions"]);
            if (!entries.is_array())
                return fail(ErrorCode::invalidInput, "'conversions' is not a list");
            std::string lines;
            for (const auto& entry : entries)
                lines += entry.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
            return lines.empty() ? Result<void>() : add(lines);
        }
        std::size_t number = 0;
        for (std::size_t at = 0; at < text.size();) {
            const auto end = std::min(text.find('\n', at), text.size());
            const auto line = text.substr(at, end - at);
            at = end + 1;
            ++number;
            if (line.empty()) continue;
            auto entry = Json::parse(line, nullptr, false);
            if (!entry.is_object())
                return failAt(fmt::format("line {}", number), ErrorCode::invalidInput,
                              "it is not a report of stx convert or stx render");
            // A run that was refused or stopped has one line that says so.
            if (entry.contains("command") && !entry.contains("input")) {
                failedRuns_.push_back(entry.value("message", "it failed"));
                continue;
            }
            const auto shard = entry.find("shard");
            if (shard == entry.end() || !shard->is_object())
                return failAt(
                    fmt::format("line {}", number), ErrorCode::invalidInput,
                    "it is not of a shard; only reports of runs with --shard can be joined");
            auto total = wholeOf(*shard, "total");
            if (!total) return propagate(total);
            auto added = expect(Kind::inputs, *total);
            if (added) added = expectJob(*shard);
            if (added) added = addEntry(std::move(entry), *total);
            if (!added) return tl::unexpected(added.error().at(fmt::format("line {}", number)));
        }
    } catch (const Json::exception& e) {
        // A value of another type than its key says.
        return fail(ErrorCode::invalidInput, "it is not a report of stx: {}", e.what());
    }
    return {};
}

MergedReport::Counts MergedReport::counts() const {
    Counts counts;
    for (const auto& [index, entry] : entries_) {
        ++(entry.status == Status::ok        ? counts.ok
           : entry.status == Status::skipped ? counts.skipped
                                             : counts.failed);
        if (entry.breaksRules) ++counts.breakRules;
    }
    return counts;
}

std::vector<MergedReport::Gap> MergedReport::missing() const {
    std::vector<Gap> gaps;
    std::size_t next = 0;
    for (const auto& [index, entry] : entries_) {
        if (index > next) gaps.push_back({next, index - 1});
        next = index + 1;
    }
    if (next < total_) gaps.push_back({next, total_ - 1});
    return gaps;
}

std::vector<std::size_t> MergedReport::failed() const {
    std::vector<std::size_t> out;
    for (const auto& [index, entry] : entries_)
        if (entry.status == Status::error) out.push_back(index);
    return out;
}

Result<void> MergedReport::checkInputs(const std::vector<std::string>& names) const {
    if (names.size() != total_)
        return fail(ErrorCode::invalidInput,
                    "--inputs names {} inputs, but the reports are of {}; the list must be the one "
                    "that was converted",
                    names.size(), total_);
    if (kind_ != Kind::inputs) return {};
    for (const auto& [index, entry] : entries_) {
        const auto reported = Json::parse(entry.line, nullptr, false).value("input", "");
        if (reported != asReported(names[index]))
            return fail(ErrorCode::invalidInput,
                        "--inputs has '{}' as number {}, but the reports have '{}'; the list must "
                        "be the one that was converted",
                        names[index], index, reported);
    }
    return {};
}

Result<std::vector<std::string>> MergedReport::outputs() const {
    std::vector<std::string> out;
    for (const auto& [index, entry] : entries_) {
        if (entry.status == Status::error) continue;
        // What was validated has none.
        auto output = Json::parse(entry.line, nullptr, false).value("output", "");
        // Several names may have become this one.
        if (output.find(kNoUtf8) != std::string::npos)
            return fail(ErrorCode::invalidInput,
                        "--outputs: the name of output {}, '{}', is not UTF-8, and reports have "
                        "U+FFFD in place of some of its bytes; leave --outputs out, or give the "
                        "output another name",
                        index, output);
        if (!output.empty()) out.push_back(std::move(output));
    }
    return out;
}

std::string MergedReport::text() const {
    std::string lines;
    if (kind_ != Kind::pictures) {
        for (const auto& [index, entry] : entries_) lines += entry.line + "\n";
        return lines;
    }
    // The last key is the list, so that its entries need not be parsed again.
    Json whole = head_;
    if (!stages_.is_null()) whole["stages"] = stages_;
    std::string head = whole.dump(2, ' ', false, Json::error_handler_t::replace);
    head.resize(head.rfind('\n'));
    lines = head + ",\n  \"views\": [";
    for (const auto& [index, entry] : entries_)
        lines += (lines.back() == '[' ? "\n    " : ",\n    ") + entry.line;
    return lines + "\n  ]\n}\n";
}

}  // namespace stx::tools
