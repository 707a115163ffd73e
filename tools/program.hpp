#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>
#include <nlohmann/json_fwd.hpp>

#include "formats/files/files.hpp"
#include "formats/files/numbered.hpp"
#include "lib/base/counted.hpp"
#include "lib/base/job.hpp"
#include "tools/progress_line.hpp"

namespace stx::tools {

/// Options that every command has.
struct CommonOptions {
    int threads = 0;  ///< 0 = all processors
    bool quiet = false;
    int verbose = 0;
    bool noClobber = false;
    bool noMkdir = false;  ///< folders of outputs must be there
    bool allowOutside = false;
    bool keepDamaged = false;       ///< `--damaged keep`
    bool requireIsolation = false;  ///< `--decoder-isolation required`
    std::uint64_t maxMemoryMiB = 4096;
    std::string report;           ///< path of a JSON report; empty = none
    std::string format = "text";  ///< or "json", for commands that answer on stdout
};

/// From now on memory that is freed serves what comes next, where image follows image: the system
/// clears all that it hands out, page by page, which took a seventh of the time of a sequence.
void keepFreedMemory();

/// Quality of JPEG where none is asked for.
inline constexpr int kJpegQuality = 92;

/// What a command gets: its options, a Job to pass on, and where to say things.
class Program {
  public:
    CommonOptions common;
    Job job;
    /// The name of the command that runs.
    std::string command;
    /// What notes are about, when there are many inputs; empty = they need no name.
    std::string subject;
    ProgressLine progress;

    /// Lines of text for stdout, through printableLines(); names in them need printable() before.
    /// Errors of writing (a closed pipe, a full disk) become the exit code.
    void print(std::string_view text);
    /// The same for JSON: valid UTF-8, whatever the bytes of names in it are.
    void printJson(const nlohmann::ordered_json& json);
    /// The same in one line, of which other programs can take one after the other.
    void printJsonLine(const nlohmann::ordered_json& json);
    /// One line for a person on stderr, unless --quiet; through printable().
    void say(std::string_view line);
    /// The same, also under --quiet: for errors.
    void complain(std::string_view line);
    /// The notes of the job as lines on stderr, unless --quiet. Of many that differ in names and
    /// numbers only the first is said, with their count; -v says all.
    void sayNotes();
    /// Writes the --report file, when one was asked for.
    [[nodiscard]] Result<void> writeReport(const nlohmann::ordered_json& report);
    /// The same for a text: a line of JSON for each input.
    [[nodiscard]] Result<void> writeReportText(std::string_view text);
    [[nodiscard]] OutputFile::Options outputOptions() const { return {common.noClobber}; }

    /// Runs a command's body with limits, threads and progress set up; prints its error and returns
    /// the exit code. A body that fails before it has written its report gets one that says so
    /// (error-report.schema.json).
    [[nodiscard]] int run(const std::function<Result<int>()>& body);

    /// Errors when the folder of `target`, or of the file that its link leads to, is not there and
    /// may not be made, or cannot be written. Else makes it, and run() takes it away when nothing
    /// came to be in it. Of a device, a pipe or an open descriptor nothing is looked at.
    [[nodiscard]] Result<void> makeFolderOf(const std::filesystem::path& target);

  private:
    void write(std::string_view text);
    void reportError(const Error& error);
    std::vector<std::filesystem::path> madeFolders_;
    bool reportWritten_ = false;
    bool outputFailed_ = false;
    bool outputUnwanted_ = false;  ///< its reader has closed the pipe, as head does: not an error
};

// ---- Values of options. All parse the C locale's numbers and refuse trailing text. ----

/// "640x480".
[[nodiscard]] Result<glm::ivec2> parseSize(std::string_view text, const Limits& limits);
/// `count` numbers separated by commas; the option's name is for the message.
[[nodiscard]] Result<std::vector<double>> parseNumbers(std::string_view text, std::size_t count,
                                                       std::string_view option);
[[nodiscard]] Result<glm::dvec3> parseVec3(std::string_view text, std::string_view option);

/// A colour, sRGB-coded 0..1: "R,G,B" in 0..1, "#rrggbb", "#rgb", or one of CSS's basic names.
[[nodiscard]] Result<glm::vec3> parseColour(std::string_view text, std::string_view option);

/// A direction: "X,Y,Z", or an axis: "Z", "-Y". Errors (usage) also when it has no length.
[[nodiscard]] Result<glm::dvec3> parseDirection(std::string_view text, std::string_view option);

/// textNamingOnce(), for what people read.
[[nodiscard]] std::string textOf(const Error& error);
/// "1.2 MB", for messages.
[[nodiscard]] std::string humanBytes(std::uint64_t bytes);
/// "0.25 s", "12 s", "3 min 20 s", "2 h 5 min".
[[nodiscard]] std::string humanSeconds(double seconds);
/// The nearest of `words` to `word`, or empty when none is near.
[[nodiscard]] std::string nearestWord(std::string_view word, const std::vector<std::string>& words);
/// Size of a file, or of all files in a folder; of a scene as text its pictures beside it included.
[[nodiscard]] std::uint64_t bytesOf(const std::filesystem::path& path);
/// Whether an output is there: a file or a folder, or one of the files of a numbered name.
[[nodiscard]] bool isThere(const std::string& output);
/// The file that a bundle without frames goes to: of a numbered OpenEXR name the first, as a film
/// of one frame has it; else `output`.
[[nodiscard]] std::string fileOfStill(const std::string& output);
/// A target that may be a folder.
struct FolderTarget {
    std::string path;     ///< without slashes at its end
    bool folder = false;  ///< surely: it had a slash there, or is one already
};
/// Error (usage) when it ends like a file, is not surely a folder, and is none of `files` (".ply");
/// `expected` is for the message.
[[nodiscard]] Result<FolderTarget> folderTarget(const std::string& target,
                                                const std::vector<std::string>& files,
                                                std::string_view expected);
/// Errors early, before an hour of work and not after it: as Program::makeFolderOf(), which makes
/// the target's folder; (io) under --no-clobber, when the target exists; (usage) several numbers in
/// its name.
[[nodiscard]] Result<void> checkTarget(const std::filesystem::path& target, Program& program);
/// checkTarget() of what can only be a file; errors (io), too, where it is a folder, or is named as
/// one. Standard output and numbered names are fine.
[[nodiscard]] Result<void> checkFileTarget(const std::filesystem::path& target, Program& program);
/// The same of a plot, where one was asked for; errors (usage) also when it is no .svg.
[[nodiscard]] Result<void> checkPlotTarget(std::string_view option, const std::string& target,
                                           Program& program);

}  // namespace stx::tools
