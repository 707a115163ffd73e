#include "tools/program.hpp"

#include <unistd.h>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "lib/base/parallel.hpp"
#include "lib/base/printable.hpp"

namespace stx::tools {

namespace {

/// Bytes of a name that are no UTF-8 become U+FFFD.
std::string textOf(const nlohmann::ordered_json& json) {
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

void Program::print(std::string_view text) {
    write(printableLines(text));
}

void Program::printJson(const nlohmann::ordered_json& json) {
    write(textOf(json));
}

void Program::write(std::string_view text) {
    if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0)
        return;
    outputFailed_ = true;
    outputUnwanted_ = errno == EPIPE;
}

void Program::say(std::string_view line) const {
    if (!common.quiet) fmt::print(stderr, "{}\n", printable(line));
}

void Program::sayNotes() {
    const std::string about = subject.empty() ? "" : fmt::format("'{}': ", subject);
    for (const auto& note : job.takeNotes()) say("note: " + about + note);
}

Result<void> Program::writeReport(const nlohmann::ordered_json& report) const {
    if (common.report.empty()) return {};
    const std::string text = textOf(report);
    return writeFile(common.report, std::as_bytes(std::span(text)), outputOptions());
}

namespace {

/// Errors when the folder of `target` is not there or cannot be written.
Result<void> checkFolderOf(const std::filesystem::path& target) {
    std::error_code ec;
    const auto folder =
        target.parent_path().empty() ? std::filesystem::path(".") : target.parent_path();
    if (!std::filesystem::is_directory(folder, ec))
        return fail(ErrorCode::io, "cannot write '{}': there is no folder '{}'; create it first",
                    target.string(), folder.string());
    if (access(folder.c_str(), W_OK) != 0)
        return fail(ErrorCode::io, "cannot write '{}': the folder '{}' is not writable",
                    target.string(), folder.string());
    return {};
}

}  // namespace

int Program::run(const std::function<Result<int>()>& body) {
    job.limits.maxMemoryBytes = common.maxMemoryMiB << 20;
    job.limits.allowOutside = common.allowOutside;
    const bool terminal = !common.quiet && isatty(STDERR_FILENO) != 0;
    auto lastShown = std::chrono::steady_clock::now();
    std::mutex mutex;
    bool shown = false;
    if (terminal) {
        job.onProgress = [&](std::int64_t done, std::int64_t total, std::string_view what) {
            const std::lock_guard lock(mutex);
            const auto now = std::chrono::steady_clock::now();
            if (now - lastShown < std::chrono::milliseconds(200)) return;
            lastShown = now;
            shown = true;
            fmt::print(stderr, "\r\033[K{} {}/{}", what, done, total);
        };
    }
    const ThreadLimit threads(common.threads);
    Result<int> code = 0;
    try {
        // A report that cannot be written is an error before the work, not after it.
        const auto report =
            common.report.empty() ? Result<void>() : checkTarget(common.report, *this);
        code = report ? body() : tl::unexpected(report.error());
    } catch (const std::bad_alloc&) {
        code = fail(ErrorCode::failed, "out of memory; use smaller images or fewer --threads");
    } catch (const std::exception& e) {
        code = fail(ErrorCode::failed, "{}", e.what());
    }
    if (shown) fmt::print(stderr, "\r\033[K");
    job.onProgress = nullptr;
    sayNotes();
    if (!code) {
        fmt::print(stderr, "stx: {}\n", printable(code.error().text()));
        return static_cast<int>(code.error().code);
    }
    if (outputFailed_) {
        if (!outputUnwanted_) fmt::print(stderr, "stx: cannot write to stdout\n");
        return static_cast<int>(ErrorCode::io);
    }
    return *code;
}

Result<std::vector<double>> parseNumbers(std::string_view text, std::size_t count,
                                         std::string_view option) {
    std::vector<double> values;
    const char* at = text.data();
    const char* const end = at + text.size();
    while (true) {
        double v = 0;
        if (at != end && *at == '+') ++at;
        const auto parsed = std::from_chars(at, end, v);
        if (parsed.ec != std::errc() || !std::isfinite(v)) break;
        values.push_back(v);
        at = parsed.ptr;
        if (at == end || *at != ',') break;
        ++at;
    }
    if (at != end || values.size() != count)
        return fail(ErrorCode::usage, "{} is '{}'; {} finite number{} expected", option, text,
                    count == 1 ? "one" : fmt::format("{} comma-separated", count),
                    count == 1 ? " is" : "s are");
    return values;
}

Result<glm::dvec3> parseVec3(std::string_view text, std::string_view option) {
    STX_TRY(const auto v, parseNumbers(text, 3, option));
    return glm::dvec3(v[0], v[1], v[2]);
}

Result<glm::ivec2> parseSize(std::string_view text, const Limits& limits) {
    const auto x = text.find_first_of("xX");
    long width = 0, height = 0;
    bool ok = x != std::string_view::npos && x > 0;
    if (ok) {
        const auto a = std::from_chars(text.data(), text.data() + x, width);
        const auto b = std::from_chars(text.data() + x + 1, text.data() + text.size(), height);
        ok = a.ec == std::errc() && a.ptr == text.data() + x && b.ec == std::errc() &&
             b.ptr == text.data() + text.size() && x + 1 < text.size();
    }
    if (!ok)
        return fail(ErrorCode::usage, "--size is '{}'; WIDTHxHEIGHT is expected, as in 512x512",
                    text);
    if (width < 1 || height < 1 || width > limits.maxImageSide || height > limits.maxImageSide)
        return fail(ErrorCode::usage, "--size is {}; each side must be 1 to {}", text,
                    limits.maxImageSide);
    return glm::ivec2(static_cast<int>(width), static_cast<int>(height));
}

std::optional<std::string> frameName(const std::string& pattern, int frame) {
    const auto percent = pattern.find('%');
    if (percent == std::string::npos) return std::nullopt;
    std::size_t at = percent + 1;
    int width = 0;
    while (at < pattern.size() && pattern[at] >= '0' && pattern[at] <= '9' && at - percent < 4)
        width = width * 10 + (pattern[at++] - '0');
    if (at >= pattern.size() || pattern[at] != 'd') return std::nullopt;
    return pattern.substr(0, percent) + fmt::format("{:0{}}", frame, width) +
           pattern.substr(at + 1);
}

std::string humanBytes(std::uint64_t bytes) {
    if (bytes < 1000) return fmt::format("{} B", bytes);
    if (bytes < 1000000) return fmt::format("{:.3g} kB", bytes / 1e3);
    if (bytes < 1000000000) return fmt::format("{:.3g} MB", bytes / 1e6);
    return fmt::format("{:.3g} GB", bytes / 1e9);
}

std::string nearestWord(std::string_view word, const std::vector<std::string>& words) {
    std::string best;
    std::size_t bestDistance = std::max<std::size_t>(2, word.size() / 3) + 1;
    for (const auto& candidate : words) {
        // Levenshtein distance, one row at a time.
        std::vector<std::size_t> row(candidate.size() + 1);
        for (std::size_t j = 0; j <= candidate.size(); ++j) row[j] = j;
        for (std::size_t i = 1; i <= word.size(); ++i) {
            std::size_t diagonal = row[0];
            row[0] = i;
            for (std::size_t j = 1; j <= candidate.size(); ++j) {
                const std::size_t substituted = diagonal + (word[i - 1] != candidate[j - 1]);
                diagonal = row[j];
                row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
            }
        }
        if (row.back() < bestDistance) {
            bestDistance = row.back();
            best = candidate;
        }
    }
    return best;
}

std::uint64_t bytesOf(const std::filesystem::path& path) {
    std::error_code ec;
    if (std::filesystem::is_regular_file(path, ec)) return std::filesystem::file_size(path, ec);
    std::uint64_t sum = 0;
    for (auto it = std::filesystem::recursive_directory_iterator(path, ec);
         !ec && it != std::filesystem::recursive_directory_iterator(); it.increment(ec)) {
        if (it->is_regular_file(ec)) sum += it->file_size(ec);
    }
    return sum;
}

Result<void> checkTarget(const std::filesystem::path& target, const Program& program) {
    if (target == "-") return {};
    STX_CHECK(checkFolderOf(target));
    std::error_code ec;
    if (program.common.noClobber &&
        std::filesystem::exists(std::filesystem::symlink_status(target, ec)))
        return fail(ErrorCode::io, "'{}' exists and --no-clobber forbids to replace it",
                    target.string());
    return {};
}

}  // namespace stx::tools
