#include "tools/batch.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <map>
#include <optional>
#include <set>

#include <nlohmann/json.hpp>

#include "formats/files/messages.hpp"
#include "formats/files/numbered.hpp"
#include "formats/files/pipes.hpp"
#include "formats/files/temporaries.hpp"
#include "formats/files/text_encoding.hpp"
#include "lib/base/parallel.hpp"
#include "tools/output_names.hpp"
#include "tools/stop_signals.hpp"

namespace stx::tools {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

// A worker starts afresh after so many inputs, so that what libraries keep cannot add up.
constexpr int kInputsPerWorker = 200;

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// The pattern with what its placeholders stand for. Each is put in once: a name may hold braces.
std::string outputOf(const std::string& pattern, const std::string& input) {
    fs::path path(input);
    if (!path.has_filename()) path = path.parent_path();
    const fs::path folder = folderOf(path);
    std::error_code ec;
    fs::path whole = fs::absolute(folder, ec).lexically_normal();
    if (!whole.has_filename()) whole = whole.parent_path();
    const std::pair<std::string_view, std::string> values[] = {
        {"{stem}", path.stem().string()},
        {"{dir}", folder.string()},
        {"{parent}", whole.filename().string()}};
    std::string out;
    for (std::size_t at = 0; at < pattern.size();) {
        const auto* found = std::find_if(std::begin(values), std::end(values), [&](const auto& v) {
            return pattern.compare(at, v.first.size(), v.first) == 0;
        });
        out += found == std::end(values) ? std::string(1, pattern[at]) : found->second;
        at += found == std::end(values) ? 1 : found->first.size();
    }
    return out;
}

bool namesEach(const std::string& pattern) {
    return pattern.find("{stem}") != std::string::npos ||
           pattern.find("{dir}") != std::string::npos ||
           pattern.find("{parent}") != std::string::npos;
}

/// Whether what an item makes is there.
bool isMade(const BatchItem& item) {
    std::error_code ec;
    return item.numbered ? isThere(item.output) : fs::exists(item.output, ec);
}

/// Names an output without links in its folder, the same for all names of one file that is not a
/// link itself. Each folder is looked at once: there may be a million outputs.
class PlainNames {
  public:
    std::string of(const std::string& output) {
        const fs::path path(output);
        const bool named = path.has_filename() && path.filename() != "." && path.filename() != "..";
        if (!named) return wholePath(output).string();
        const std::string folder = folderOf(path).string();
        const auto [known, fresh] = folders_.try_emplace(folder);
        if (fresh) known->second = wholePath(folder);
        return (known->second / path.filename()).string();
    }

  private:
    std::map<std::string, fs::path> folders_;
};

}  // namespace

Json entryOf(const BatchItem& item, const char* status) {
    return {{"input", item.input}, {"output", item.output}, {"status", status}, {"exitCode", 0}};
}

Json failedEntry(const BatchItem& item, const Error& error) {
    auto entry = entryOf(item, "error");
    entry["exitCode"] = static_cast<int>(error.code);
    entry["message"] = textOf(error);
    return entry;
}

namespace {

/// Does one item in this process, whatever it throws.
Json doItem(const BatchItem& item, const BatchWork& work, Program& program) {
    Result<Json> done = Json();
    try {
        done = work(item, program);
    } catch (const std::bad_alloc&) {
        done = fail(ErrorCode::failed, "out of memory");
    } catch (const std::exception& e) {
        done = fail(ErrorCode::failed, "{}", e.what());
    }
    program.sayNotes();
    if (done) return *done;
    return failedEntry(item, done.error());
}

/// A worker's life: numbers of items come in, their reports go out.
[[noreturn]] void workerMain(const std::vector<BatchItem>& items, const BatchWork& work,
                             Program& program, int in, int out, int threads, pid_t parent) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(1);
    // Less patient than the process that waits for this one.
    (void)watchStopSignals(program.job.cancelled, 400);
    program.job.onProgress = nullptr;
    program.progress.leaveToParent(!program.common.quiet && ::isatty(STDERR_FILENO) != 0);
    const ThreadLimit limit(threads);
    std::uint32_t index = 0;
    while (receiveAll(in, &index, sizeof(index), -1) && index < items.size()) {
        const auto start = Clock::now();
        program.subject = items[index].input;
        auto entry = doItem(items[index], work, program);
        if (stopSignal() != 0) break;
        entry["seconds"] = secondsSince(start);
        const std::string text = entry.dump(-1, ' ', false, Json::error_handler_t::replace);
        const auto size = static_cast<std::uint32_t>(text.size());
        if (!sendAll(out, &size, sizeof(size)) || !sendAll(out, text.data(), size)) break;
    }
    std::fflush(nullptr);
    ::_exit(stopSignal() != 0 ? 128 + stopSignal() : 0);
}

struct Worker {
    pid_t pid = -1;
    Descriptor in, out;  ///< of the worker: its items, its reports
    std::optional<std::size_t> item;
    Clock::time_point since;
    int done = 0;
};

/// The processes of one batch; ends them when it goes.
class BatchRun {
  public:
    BatchRun(const std::vector<BatchItem>& items, const BatchOptions& options,
             const BatchWork& work, Program& program)
        : items_(items),
          options_(options),
          work_(work),
          program_(program),
          entries_(items.size()) {}
    ~BatchRun() { stopWorkers(); }
    BatchRun(const BatchRun&) = delete;
    BatchRun& operator=(const BatchRun&) = delete;

    Result<int> run();

  private:
    [[nodiscard]] bool mayStart() const {
        return next_ < items_.size() && !program_.job.cancelled && (options_.keepGoing || !failed_);
    }
    [[nodiscard]] Result<Worker> startWorker();
    [[nodiscard]] Result<void> giveItems();
    void takeReport(Worker& worker);
    void finish(std::size_t item, Json entry);
    void endWorker(Worker& worker);
    void stopWorkers();
    [[nodiscard]] Result<void> writeLines() const;

    const std::vector<BatchItem>& items_;
    const BatchOptions& options_;
    const BatchWork& work_;
    Program& program_;
    std::vector<Json> entries_;
    std::vector<Worker> workers_;
    std::size_t next_ = 0, done_ = 0, skipped_ = 0, failed_ = 0;
    std::size_t told_ = 0;  ///< entries that onEntry got
};

Result<Worker> BatchRun::startWorker() {
    int toWorker[2], fromWorker[2];
    if (::pipe2(toWorker, O_CLOEXEC) != 0)
        return fail(ErrorCode::failed, "cannot make a pipe: {}", std::strerror(errno));
    Descriptor workerIn(toWorker[0]);
    Worker worker;
    worker.in = Descriptor(toWorker[1]);
    if (::pipe2(fromWorker, O_CLOEXEC) != 0)
        return fail(ErrorCode::failed, "cannot make a pipe: {}", std::strerror(errno));
    worker.out = Descriptor(fromWorker[0]);
    Descriptor workerOut(fromWorker[1]);
    const int all = program_.common.threads > 0 ? program_.common.threads : threadCount();
    const int threads = std::max(1, all / std::max(1, options_.jobs));
    const pid_t parent = ::getpid();
    std::fflush(nullptr);
    // A copy has this thread only, and locks that another held would stay held in it. There is one
    // other: it sleeps in sigwait(), or ends the program. This process does no work itself, so that
    // no pool of threads is started (tests/cli/streams_test.py counts them).
    worker.pid = ::fork();
    if (worker.pid < 0)
        return fail(ErrorCode::failed, "cannot start a process: {}", std::strerror(errno));
    if (worker.pid == 0) {
        // The ends of other workers' pipes must not stay open here: their ends would go unnoticed.
        workers_.clear();
        worker.in.close();
        worker.out.close();
        workerMain(items_, work_, program_, workerIn.get(), workerOut.get(), threads, parent);
    }
    return worker;
}

void BatchRun::finish(std::size_t item, Json entry) {
    const std::string status = entry.value("status", "error");
    ++done_;
    if (status == "skipped") ++skipped_;
    if (status == "error") {
        ++failed_;
        // Not hushed by --quiet: nothing else tells which input it was.
        const std::string message = entry.value("message", "");
        const std::string input = inQuotes(items_[item].input);
        program_.complain(message.starts_with(input)
                              ? fmt::format("error: {}", message)
                              : fmt::format("error: {}: {}", input, message));
    }
    if (options_.shard.given) {
        entry["index"] = items_[item].index;
        entry["shard"] = shardJson(options_.shard, options_.total);
    }
    entries_[item] = std::move(entry);
    while (options_.onEntry && told_ < entries_.size() && entries_[told_].is_object())
        options_.onEntry(entries_[told_++]);
    program_.job.progress(static_cast<std::int64_t>(done_),
                          static_cast<std::int64_t>(items_.size()), "inputs");
}

void BatchRun::takeReport(Worker& worker) {
    std::uint32_t size = 0;
    std::string text;
    bool good = worker.item && receiveAll(worker.out.get(), &size, sizeof(size), -1);
    if (good) {
        text.resize(size);
        good = receiveAll(worker.out.get(), text.data(), size, -1);
    }
    if (good) {
        auto entry = Json::parse(text, nullptr, false);
        ++worker.done;
        finish(*std::exchange(worker.item, std::nullopt), std::move(entry));
        return;
    }
    // It ended without an answer.
    int status = 0;
    while (::waitpid(worker.pid, &status, 0) < 0 && errno == EINTR) {
    }
    worker.pid = -1;
    if (!worker.item || program_.job.cancelled) return;
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    const std::string message =
        signal == SIGKILL ? std::string("its process was killed, perhaps for lack of memory")
        : signal != 0     ? fmt::format("its process ended by signal {}", signal)
                          : fmt::format("its process ended with {}", WEXITSTATUS(status));
    auto entry = failedEntry(items_[*worker.item], {ErrorCode::failed, message, {}});
    entry["seconds"] = secondsSince(worker.since);
    finish(*std::exchange(worker.item, std::nullopt), std::move(entry));
}

void BatchRun::endWorker(Worker& worker) {
    worker.in.close();
    while (worker.pid > 0 && ::waitpid(worker.pid, nullptr, 0) < 0 && errno == EINTR) {
    }
    worker.pid = -1;
}

void BatchRun::stopWorkers() {
    for (auto& w : workers_) {
        w.in.close();
        if (w.pid > 0) ::kill(w.pid, SIGTERM);
    }
    // Each ends by itself within a second (watchStopSignals); SIGKILL is for one that is stuck.
    const auto start = Clock::now();
    for (auto& w : workers_) {
        while (w.pid > 0) {
            const pid_t ended = ::waitpid(w.pid, nullptr, WNOHANG);
            if (ended == w.pid || (ended < 0 && errno != EINTR)) w.pid = -1;
            if (w.pid > 0 && secondsSince(start) > 2) ::kill(w.pid, SIGKILL);
            if (w.pid > 0) ::usleep(5000);
        }
    }
}

Result<void> BatchRun::giveItems() {
    for (auto& w : workers_) {
        if (!w.item && w.pid > 0 && w.done >= kInputsPerWorker) endWorker(w);
    }
    std::erase_if(workers_, [](const Worker& w) { return w.pid < 0; });
    const auto wanted = static_cast<std::size_t>(std::max(1, options_.jobs));
    while (mayStart()) {
        const auto& item = items_[next_];
        if (options_.skipExisting && isMade(item)) {
            auto entry = entryOf(item, "skipped");
            entry["seconds"] = 0.0;
            finish(next_++, std::move(entry));
            continue;
        }
        auto idle =
            std::find_if(workers_.begin(), workers_.end(), [](const Worker& w) { return !w.item; });
        if (idle == workers_.end()) {
            if (workers_.size() >= wanted) return {};
            STX_TRY(auto worker, startWorker());
            workers_.push_back(std::move(worker));
            idle = workers_.end() - 1;
        }
        idle->item = next_;
        idle->since = Clock::now();
        const auto index = static_cast<std::uint32_t>(next_++);
        // A worker that is gone shows when its report is read.
        (void)sendAll(idle->in.get(), &index, sizeof(index));
    }
    return {};
}

Result<int> BatchRun::run() {
    for (;;) {
        STX_CHECK(giveItems());
        std::vector<pollfd> waiting;
        for (const auto& w : workers_) {
            if (w.item) waiting.push_back({w.out.get(), POLLIN, 0});
        }
        if (program_.job.cancelled || waiting.empty()) break;
        // The stop signals go to another thread, so poll() does not end by them.
        if (::poll(waiting.data(), waiting.size(), 50) <= 0) continue;
        for (const auto& ready : waiting) {
            if (ready.revents == 0) continue;
            for (auto& w : workers_) {
                if (w.item && w.out.get() == ready.fd) takeReport(w);
            }
        }
    }
    // What is done is reported even when the workers take long to stop.
    auto written = writeLines();
    stopWorkers();
    if (!written) return propagate(written);
    STX_CHECK(program_.job.checkCancelled());
    const auto converted = done_ - skipped_ - failed_;
    const std::string counts =
        fmt::format("{}: {} done, {} skipped, {} failed", counted(items_.size(), "input"),
                    converted, skipped_, failed_);
    if (failed_ == 0) {
        program_.say(counts);
        return 0;
    }
    const auto first = std::find_if(entries_.begin(), entries_.end(), [](const Json& e) {
        return e.is_object() && e.value("status", "") == "error";
    });
    const auto code = static_cast<ErrorCode>(first->value("exitCode", 4));
    if (!options_.keepGoing && done_ < items_.size())
        return fail(code, "{}, {} not begun; --keep-going goes on after an error", counts,
                    items_.size() - done_);
    return fail(code, "{}", counts);
}

Result<void> BatchRun::writeLines() const {
    if (program_.common.report.empty()) return {};
    std::string lines;
    for (const auto& entry : entries_) {
        if (entry.is_object())
            lines += entry.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
    }
    return program_.writeReportText(lines);
}

}  // namespace

void addJobsOption(Command c, BatchOptions& options) {
    c.option("--jobs,-j", options.jobs,
             "Inputs at a time, each in a process of its own (default 1)")
        .range(1, 1024)
        .takes("N");
}

namespace {

/// A line of a list without a comment, but for a file whose name looks as if it had one.
std::string_view withoutComment(std::string_view line) {
    constexpr std::string_view kBlanks = " \t";
    std::error_code ec;
    for (auto hash = line.find('#'); hash != line.npos; hash = line.find('#', hash + 1)) {
        if (hash > 0 && kBlanks.find(line[hash - 1]) == kBlanks.npos) continue;
        if (fs::exists(line, ec)) return line;
        const auto last = line.substr(0, hash).find_last_not_of(kBlanks);
        return last == line.npos ? std::string_view() : line.substr(0, last + 1);
    }
    return line;
}

}  // namespace

Result<std::vector<std::string>> expandInputs(const std::vector<std::string>& inputs,
                                              const Command& command, Program& program) {
    std::vector<std::string> names;
    for (const auto& input : inputs) {
        if (input.size() < 2 || input[0] != '@') {
            names.push_back(input);
            continue;
        }
        const std::string list = input.substr(1);
        STX_TRY(auto bytes, readFile(list, program.job.limits));
        if (auto plain = utf8FromMarked(bytes)) bytes = std::move(*plain);
        const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        const auto before = names.size();
        for (std::size_t at = 0; at < text.size();) {
            const auto end = std::min(text.find('\n', at), text.size());
            auto line = text.substr(at, end - at);
            if (line.ends_with('\r')) line.remove_suffix(1);
            if (line.find('\0') != std::string_view::npos)
                return fail(ErrorCode::invalidInput,
                            "'{}' holds zero bytes; a list is text, one name in each line", list);
            // Of a list every line is a file's name: standard input is named by a word alone.
            if (line = withoutComment(line); !line.empty())
                names.emplace_back(line == "-" ? "./-" : line);
            at = end + 1;
        }
        if (names.size() == before)
            return fail(ErrorCode::invalidInput, "the list '{}' names no input", list);
    }
    if (names.empty())
        return fail(ErrorCode::usage,
                    "no input was given, or the list of inputs is empty; name at least one file");
    if (auto good = command.checkNames(names); !good) {
        // Nor is the mistake reported in the place of an input.
        std::string& report = program.common.report;
        if (!mayHoldReport(report, alikeAmong(names, {NamedPath{"--report", report}})))
            report.clear();
        return propagate(good);
    }
    return names;
}

Result<std::vector<BatchItem>> planBatch(const std::vector<std::string>& inputs,
                                         const std::string& pattern, const Command& command) {
    if (inputs.size() > 1 && !namesEach(pattern))
        return fail(ErrorCode::usage,
                    "{} inputs need an output name for each; write {{stem}} in -o, as in "
                    "'out/{{stem}}.mp4'",
                    inputs.size());
    const std::set<std::string> read = command.namesRead(inputs);
    std::vector<BatchItem> items;
    std::vector<NamedPath> outputs;  // that may be inputs
    std::map<std::string, std::string> inputOf;
    PlainNames plain;
    const bool numbered = frameName(pattern, 0).has_value();
    for (const auto& input : inputs) {
        BatchItem item{input, outputOf(pattern, input), items.size(),
                       numbered || isNumberedFilm(input)};
        const auto key = plain.of(item.numbered ? fileOfStill(item.output) : item.output);
        if (const auto [known, fresh] = inputOf.emplace(key, input); !fresh)
            return fail(
                ErrorCode::usage,
                "'{}' and '{}' would both be written to '{}'; put {{dir}} or {{parent}} into "
                "-o, or rename one",
                known->second, input, item.output);
        if (read.contains(lastName(item.output))) outputs.push_back({"-o", item.output, input});
        items.push_back(std::move(item));
    }
    STX_CHECK(command.checkNames(inputs, outputs));
    return items;
}

std::vector<BatchItem> itemsOf(std::vector<BatchItem> items, const Shard& shard) {
    if (shard.given)
        std::erase_if(items, [&](const BatchItem& item) { return !shard.takes(item.index); });
    return items;
}

Result<int> runBatch(const std::vector<BatchItem>& items, const BatchOptions& options,
                     const BatchWork& work, Program& program) {
    // What can be refused before any work is refused then; with --keep-going each input is on its
    // own.
    std::optional<Error> refused;
    bool any = false;
    for (const auto& item : items) {
        if (!options.keepGoing && !(options.skipExisting && isMade(item)))
            STX_CHECK(checkTarget(item.output, program));
        const auto made = item.output.empty() ? Result<void>() : program.makeFolderOf(item.output);
        any = any || made;
        if (!made && !refused) refused = made.error();
    }
    // What all of them would say is said once.
    if (!any && refused) return tl::unexpected(*refused);
    return BatchRun(items, options, work, program).run();
}

Result<int> runInTurn(const std::vector<BatchItem>& items, const BatchOptions& options,
                      const BatchWork& work, Program& program) {
    const bool goesOn = options.keepGoing && items.size() > 1;
    auto entries = Json::array();
    std::optional<Error> first;
    std::size_t failed = 0, skipped = 0;
    for (const BatchItem& item : items) {
        if (first && (!goesOn || program.job.cancelled)) break;
        auto entry = entryOf(item, "skipped");
        if (options.skipExisting && isMade(item)) {
            ++skipped;
        } else if (auto done = work(item, program); done) {
            entry = std::move(*done);
        } else {
            ++failed;
            entry = failedEntry(item, done.error());
            if (!first) first = done.error();
            if (goesOn) {
                program.sayNotes();
                program.complain(
                    fmt::format("error: {}: {}", inQuotes(item.output), textOf(done.error())));
            }
        }
        if (options.shard.given) {
            entry["index"] = item.index;
            entry["shard"] = shardJson(options.shard, options.total);
        }
        entries.push_back(std::move(entry));
    }
    const std::size_t begun = entries.size();
    const auto written = program.writeReport(
        {{"$schema", "convert-report.schema.json"}, {"conversions", std::move(entries)}});
    // The first error is the one to tell.
    if (first && goesOn)
        return fail(first->code, "{}: {} done, {} skipped, {} failed", counted(begun, "output"),
                    begun - skipped - failed, skipped, failed);
    if (first) return tl::unexpected(std::move(*first));
    STX_CHECK(written);
    return 0;
}

}  // namespace stx::tools
