#include "tools/program.hpp"

#include <malloc.h>
#include <unistd.h>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <optional>
#include <system_error>

#include <nlohmann/json.hpp>

#include "formats/decoders/decoder_process.hpp"
#include "formats/files/named_files.hpp"
#include "formats/files/no_case.hpp"
#include "formats/files/source_date.hpp"
#include "formats/files/stream_names.hpp"
#include "formats/files/temporaries.hpp"
#include "formats/mpeg4/media_files.hpp"
#include "formats/mpeg4/mpeg4.hpp"
#include "lib/base/error_text.hpp"
#include "lib/base/parallel.hpp"
#include "lib/base/printable.hpp"
#include "lib/base/whole_number.hpp"
#include "tools/output_names.hpp"
#include "tools/standard_streams.hpp"
#include "tools/stop_signals.hpp"

namespace stx::tools {

namespace {

constexpr int kIndented = 2, kOneLine = -1;  // as nlohmann::json's dump() takes it

/// Bytes of a name that are no UTF-8 become U+FFFD.
std::string jsonText(const nlohmann::ordered_json& json, int indent) {
    return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

void keepFreedMemory() {
    constexpr int kLargest = 32 << 20;  // glibc takes no more
    mallopt(M_MMAP_THRESHOLD, kLargest);
    mallopt(M_TRIM_THRESHOLD, 8 * kLargest);
    // Asked for in larger pieces, memory comes in larger pages, too, where the system has them.
    mallopt(M_TOP_PAD, kLargest / 2);
    // Threads come and go, more of them than run at a time; each arena keeps memory of its own.
    mallopt(M_ARENA_MAX, threadCount());
}

void Program::print(std::string_view text) {
    write(printableLines(text));
}

void Program::printJson(const nlohmann::ordered_json& json) {
    write(jsonText(json, kIndented));
}

void Program::printJsonLine(const nlohmann::ordered_json& json) {
    write(jsonText(json, kOneLine));
}

void Program::write(std::string_view text) {
    progress.erase();
    if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0)
        return;
    outputFailed_ = true;
    outputUnwanted_ = errno == EPIPE;
}

void Program::say(std::string_view line) {
    if (!common.quiet) complain(line);
}

void Program::complain(std::string_view line) {
    progress.erase();
    writeToStderr(printable(line) + "\n");
}

namespace {

/// More notes alike than this are given as a number.
constexpr std::size_t kNotesAlike = 3;

/// What a note says without its names in quotes and its numbers.
std::string withoutParticulars(std::string_view note) {
    std::string text;
    for (std::size_t i = 0; i < note.size(); ++i) {
        const char c = note[i];
        if (const auto end = note.find('\'', i + 1);
            c == '\'' && end != std::string_view::npos && (i == 0 || note[i - 1] == ' ')) {
            i = end;
            text += '\'';
        } else if (c >= '0' && c <= '9') {
            while (i + 1 < note.size() && (std::isalnum(static_cast<unsigned char>(note[i + 1])) ||
                                           note[i + 1] == '.' || note[i + 1] == '-'))
                ++i;
            text += '#';
        } else {
            text += c;
        }
    }
    return text;
}

}  // namespace

void Program::sayNotes() {
    const std::string about = subject.empty() ? "" : fmt::format("'{}': ", subject);
    const auto notes = job.takeNotes();
    std::vector<std::string> kinds;
    for (const auto& note : notes) kinds.push_back(withoutParticulars(note));
    for (std::size_t i = 0; i < notes.size(); ++i) {
        const auto alike =
            static_cast<std::size_t>(std::count(kinds.begin(), kinds.end(), kinds[i]));
        const bool first = std::find(kinds.begin(), kinds.end(), kinds[i]) == kinds.begin() + i;
        if (alike <= kNotesAlike || common.verbose > 0)
            say("note: " + about + notes[i]);
        else if (first)
            say(fmt::format("note: {}{} (and {} more like it; -v lists them)", about, notes[i],
                            alike - 1));
    }
}

Result<void> Program::writeReport(const nlohmann::ordered_json& report) {
    return writeReportText(jsonText(report, kIndented));
}

Result<void> Program::writeReportText(std::string_view text) {
    reportWritten_ = true;
    if (common.report.empty()) return {};
    return writeFile(common.report, std::as_bytes(std::span(text)), outputOptions());
}

void Program::reportError(const Error& error) {
    const int signal = stopSignal();
    const nlohmann::ordered_json report = {
        {"$schema", "error-report.schema.json"},
        {"command", command},
        {"status", "error"},
        {"exitCode", signal != 0 ? 128 + signal : static_cast<int>(error.code)},
        {"message", textOf(error)}};
    // In one line: of many inputs the report is lines of JSON.
    const auto written = writeReportText(jsonText(report, kOneLine));
    if (!written) complain("stx: " + textOf(written.error()));
}

Result<void> Program::makeFolderOf(const std::filesystem::path& target) {
    namespace fs = std::filesystem;
    // Nothing is made beside a device.
    if (isStream(target)) return {};
    std::error_code ec;
    // A link stays, and the file that it leads to is written beside itself.
    STX_TRY(const fs::path real, throughLinks(target));
    const fs::path folder = folderOf(real);
    std::vector<fs::path> missing;
    fs::path there = folder;
    while (!fs::exists(fs::symlink_status(there, ec)) && there.has_relative_path()) {
        missing.push_back(there);
        there = there.parent_path().empty() ? fs::path(".") : there.parent_path();
    }
    if (common.noMkdir && !missing.empty())
        return fail(ErrorCode::io,
                    "cannot write '{}': the folder '{}' does not exist; create it, or leave "
                    "--no-mkdir out",
                    target.string(), folder.string());
    if (!fs::is_directory(there, ec))
        return fail(ErrorCode::io, "cannot write '{}': '{}' is not a folder", target.string(),
                    there.string());
    if (access(there.c_str(), W_OK) != 0)
        return fail(ErrorCode::io, "cannot write '{}': the folder '{}' is not writable",
                    target.string(), there.string());
    // The outermost first; another process may make the same ones, or take those away that it made
    // and left empty.
    for (auto it = missing.rbegin(); it != missing.rend(); ++it) {
        if (fs::create_directory(*it, ec)) {
            madeFolders_.push_back(*it);
            continue;
        }
        if (ec == std::errc::no_such_file_or_directory) fs::create_directories(*it, ec);
        if (ec)
            return fail(ErrorCode::io, "cannot write '{}': cannot make the folder '{}': {}",
                        target.string(), it->string(), ec.message());
    }
    if (!common.noMkdir) mayBeMadeAgain(folder);
    return {};
}

int Program::run(const std::function<Result<int>()>& body) {
    job.limits.maxMemoryBytes = common.maxMemoryMiB << 20;
    job.limits.allowOutside = common.allowOutside;
    if (common.requireIsolation) requireFiltered();
    if (!common.quiet && isatty(STDERR_FILENO) != 0)
        job.onProgress = [this](std::int64_t done, std::int64_t total, std::string_view what) {
            progress.show(done, total, what);
        };
    const ThreadLimit threads(common.threads);
    if (common.keepDamaged)
        job.limits.keepDamaged = [this](std::string note) { job.note(std::move(note)); };
    Result<int> code = 0;
    try {
        // A report that cannot be written is an error before the work, not after it.
        const auto report =
            common.report.empty() ? Result<void>() : checkFileTarget(common.report, *this);
        reportWritten_ = !report;  // there is no place for it
        const auto date = command.empty() ? Result<void>() : checkSourceDate();
        const auto input = takeStandardInput(job.limits);
        code = !report  ? tl::unexpected(report.error())
               : !date  ? tl::unexpected(date.error())
               : !input ? tl::unexpected(input.error())
                        : body();
    } catch (const std::bad_alloc&) {
        code = fail(ErrorCode::failed, "out of memory; use smaller images or fewer --threads");
    } catch (const std::system_error& e) {
        code = e.code() == std::errc::no_space_on_device
                   ? fail(ErrorCode::io, "{}", e.what())
                   : fail(ErrorCode::failed,
                          "the system refused what the work needs, perhaps another thread: {}",
                          e.what());
    } catch (const std::exception& e) {
        // TBB has its own way to say that there are no threads.
        const bool noThreads =
            std::string_view(e.what()).find("pthread_create") != std::string_view::npos;
        code = fail(ErrorCode::failed, "{}{}", e.what(),
                    noThreads ? "; with --threads 1 none but the first is needed" : "");
    }
    job.onProgress = nullptr;
    if (common.verbose > 0 && ranUnfiltered())
        job.note(
            "decoders of foreign files ran without a filter of system calls (seccomp), which "
            "this kernel or container does not allow");
    sayNotes();
    if (!code) {
        complain("stx: " + textOf(code.error()));
        if (!reportWritten_) reportError(code.error());
    }
    // The innermost first; remove() leaves those that hold something.
    for (std::error_code ec; !madeFolders_.empty(); madeFolders_.pop_back())
        std::filesystem::remove(madeFolders_.back(), ec);
    if (!code) {
        return static_cast<int>(code.error().code);
    }
    progress.erase();
    if (outputFailed_) {
        if (!outputUnwanted_) complain("stx: cannot write to stdout");
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

namespace {

struct NamedColour {
    std::string_view name;
    unsigned rgb;
};
/// The basic colours of CSS, and its orange; grey in both spellings.
constexpr NamedColour kColours[] = {
    {"black", 0x000000},   {"silver", 0xc0c0c0},  {"gray", 0x808080},  {"grey", 0x808080},
    {"white", 0xffffff},   {"maroon", 0x800000},  {"red", 0xff0000},   {"purple", 0x800080},
    {"fuchsia", 0xff00ff}, {"magenta", 0xff00ff}, {"green", 0x008000}, {"lime", 0x00ff00},
    {"olive", 0x808000},   {"yellow", 0xffff00},  {"navy", 0x000080},  {"blue", 0x0000ff},
    {"teal", 0x008080},    {"aqua", 0x00ffff},    {"cyan", 0x00ffff},  {"orange", 0xffa500}};

glm::vec3 colourOf(unsigned rgb) {
    return glm::vec3(rgb >> 16 & 255, rgb >> 8 & 255, rgb & 255) / 255.0f;
}

}  // namespace

Result<glm::dvec3> parseDirection(std::string_view text, std::string_view option) {
    std::string_view name = text;
    const bool minus = name.starts_with('-');
    if (minus || name.starts_with('+')) name.remove_prefix(1);
    if (name.size() == 1) {
        const auto axis = std::string_view("xyzXYZ").find(name[0]);
        if (axis != std::string_view::npos) {
            glm::dvec3 v(0);
            v[static_cast<int>(axis % 3)] = minus ? -1 : 1;
            return v;
        }
    }
    const auto v = parseVec3(text, option);
    if (!v)
        return fail(ErrorCode::usage, "{} is '{}'; an axis (Z, -Y) or X,Y,Z is expected", option,
                    text);
    if (!(glm::length(*v) > 0))
        return fail(ErrorCode::usage, "{} is {}; it must point somewhere", option, text);
    return *v;
}

Result<glm::vec3> parseColour(std::string_view text, std::string_view option) {
    for (const auto& known : kColours)
        if (known.name == text) return colourOf(known.rgb);
    if (text.starts_with('#') && (text.size() == 4 || text.size() == 7)) {
        if (auto rgb = wholeNumber<unsigned>(text.substr(1), 16)) {
            if (text.size() == 4)
                rgb = (*rgb >> 8 & 15) * 0x110000 + (*rgb >> 4 & 15) * 0x1100 + (*rgb & 15) * 0x11;
            return colourOf(*rgb);
        }
    }
    const auto v = parseNumbers(text, 3, option);
    if (!v)
        return fail(ErrorCode::usage,
                    "{} is '{}'; R,G,B with values of 0 to 1, #rrggbb or a name such as white is "
                    "expected",
                    option, text);
    const glm::dvec3 colour((*v)[0], (*v)[1], (*v)[2]);
    if (glm::any(glm::lessThan(colour, glm::dvec3(0))) ||
        glm::any(glm::greaterThan(colour, glm::dvec3(1))))
        return fail(ErrorCode::usage,
                    "{} is '{}'; each value is 0 to 1 (for values of 0 to 255 write #rrggbb in "
                    "hexadecimal, as in #ff8000)",
                    option, text);
    return glm::vec3(colour);
}

Result<glm::ivec2> parseSize(std::string_view text, const Limits& limits) {
    const auto x = text.find_first_of("xX");
    const auto width = wholeNumber<long>(text.substr(0, x));
    const auto height =
        x == std::string_view::npos ? std::nullopt : wholeNumber<long>(text.substr(x + 1));
    if (!width || !height)
        return fail(ErrorCode::usage, "--size is '{}'; WIDTHxHEIGHT is expected, as in 512x512",
                    text);
    if (*width < 1 || *height < 1 || *width > limits.maxImageSide || *height > limits.maxImageSide)
        return fail(ErrorCode::usage, "--size is {}; each side must be 1 to {}", text,
                    limits.maxImageSide);
    return glm::ivec2(static_cast<int>(*width), static_cast<int>(*height));
}

std::string textOf(const Error& error) {
    return textNamingOnce(error);
}

std::string humanBytes(std::uint64_t bytes) {
    if (bytes < 1000) return fmt::format("{} B", bytes);
    if (bytes < 1000000) return fmt::format("{:.3g} kB", bytes / 1e3);
    if (bytes < 1000000000) return fmt::format("{:.3g} MB", bytes / 1e6);
    return fmt::format("{:.3g} GB", bytes / 1e9);
}

std::string humanSeconds(double seconds) {
    if (seconds < 0.9995) return fmt::format("{:.2f} s", seconds);
    if (seconds < 9.95) return fmt::format("{:.1f} s", seconds);
    const auto whole = std::llround(seconds);
    if (whole < 120) return fmt::format("{} s", whole);
    if (whole < 7200) return fmt::format("{} min {} s", whole / 60, whole % 60);
    return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
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

namespace {

/// Those of the pictures of a scene as text, which lie in a folder of their own.
std::uint64_t bytesBeside(const std::filesystem::path& path) {
    const auto container = mpeg4ContainerOf(path);
    if (!container || *container == Mpeg4Container::mp4) return 0;
    const auto real = throughLinks(path);
    return real ? bytesOf(folderOf(*real) / mpeg4::mediaFolderName(*real)) : 0;
}

}  // namespace

std::uint64_t bytesOf(const std::filesystem::path& path) {
    std::error_code ec;
    if (std::filesystem::is_regular_file(path, ec))
        return std::filesystem::file_size(path, ec) + bytesBeside(path);
    std::uint64_t sum = 0;
    if (frameName(path.string(), 0))
        if (const auto files = numberedFiles(path.string()))
            for (const NumberedFile& file : *files) sum += bytesOf(file.path);
    for (auto it = std::filesystem::recursive_directory_iterator(path, ec);
         !ec && it != std::filesystem::recursive_directory_iterator(); it.increment(ec)) {
        if (it->is_regular_file(ec)) sum += it->file_size(ec);
    }
    return sum;
}

bool isThere(const std::string& output) {
    std::error_code ec;
    if (std::filesystem::exists(output, ec)) return true;
    return frameName(output, 0) && numberedFiles(output).has_value();
}

std::string fileOfStill(const std::string& output) {
    const auto first = frameName(output, 0);
    return first && lowerExtension(*first) == ".exr" ? *first : output;
}

Result<FolderTarget> folderTarget(const std::string& target, const std::vector<std::string>& files,
                                  std::string_view expected) {
    if (target == "-")
        return fail(ErrorCode::usage,
                    "-o is '-', standard output, which takes one stream; {} is expected (-o ./- "
                    "is a folder of that name)",
                    expected);
    std::string path = target;
    while (path.size() > 1 && path.back() == '/') path.pop_back();
    std::error_code ec;
    if (path != target || std::filesystem::is_directory(path, ec)) return FolderTarget{path, true};
    const auto ending = std::filesystem::path(path).extension().string();
    // What people give to other programs; a folder's name may have any other dot in it.
    const bool file =
        !endingOfMedia(path).empty() || equalNoCase(ending, ".json") || equalNoCase(ending, ".txt");
    if (file && std::ranges::none_of(files, [&](auto& f) { return equalNoCase(f, ending); }))
        return fail(ErrorCode::usage,
                    "-o '{}' ends in '{}', like a file; {} is expected (a slash at its end makes "
                    "any name a folder's)",
                    target, ending, expected);
    return FolderTarget{path};
}

Result<void> checkPlotTarget(std::string_view option, const std::string& target, Program& program) {
    if (target.empty()) return {};
    if (lowerExtension(target) != ".svg")
        return fail(ErrorCode::usage, "{} is '{}'; its name must end in .svg", option, target);
    return checkFileTarget(target, program);
}

Result<void> checkTarget(const std::filesystem::path& target, Program& program) {
    if (target == "-") return {};
    STX_CHECK(checkPattern(target.string()));
    STX_CHECK(program.makeFolderOf(target));
    std::error_code ec;
    if (program.common.noClobber &&
        std::filesystem::exists(std::filesystem::symlink_status(target, ec)) && !isStream(target))
        return fail(ErrorCode::io, "'{}' exists and --no-clobber forbids to replace it",
                    target.string());
    return checkIsNotNamed(target);
}

Result<void> checkFileTarget(const std::filesystem::path& target, Program& program) {
    std::error_code ec;
    const bool numbered = frameName(target.string(), 0).has_value();
    if (target != "-" && !numbered && std::filesystem::is_directory(target, ec))
        return fail(ErrorCode::io, "cannot write '{}': it is a folder", target.string());
    if (!target.has_filename())
        return fail(ErrorCode::io, "cannot write '{}': it names no file", target.string());
    return checkTarget(target, program);
}

}  // namespace stx::tools
