#include "formats/files/files.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <system_error>

#include "formats/files/folder_mode.hpp"
#include "formats/files/named_files.hpp"
#include "formats/files/shown_name.hpp"
#include "formats/files/stream_names.hpp"
#include "formats/files/temporaries.hpp"

namespace stx {

namespace fs = std::filesystem;

namespace {

std::string systemText(int error) {
    return std::generic_category().message(error);
}

/// The targets of temporary files and folders, by their paths.
struct Targets {
    std::mutex mutex;
    std::map<fs::path, fs::path> of;
};
Targets& targets() {
    static Targets all;
    return all;
}

void rememberTarget(const fs::path& temporary, const fs::path& target) {
    const std::lock_guard lock(targets().mutex);
    targets().of[temporary] = target;
}
void forgetTarget(const fs::path& temporary) {
    const std::lock_guard lock(targets().mutex);
    targets().of.erase(temporary);
}
bool isInTemporaryFolder(const fs::path& file) {
    const std::lock_guard lock(targets().mutex);
    for (fs::path folder = folderOf(file); folder.has_relative_path();
         folder = folder.parent_path())
        if (targets().of.contains(folder)) return true;
    return false;
}

tl::unexpected<Error> failIo(std::string_view doing, const fs::path& path, int error) {
    return fail(ErrorCode::io, "cannot {} '{}': {}", doing, shownName(path).string(),
                systemText(error));
}

Result<void> writeAll(int fd, ByteSpan bytes, const fs::path& path) {
    while (!bytes.empty()) {
        const auto n = ::write(fd, bytes.data(), bytes.size());
        if (n < 0) {
            if (errno == EINTR) continue;
            return failIo("write", path, errno);
        }
        bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
    return {};
}

/// Reads to the end, whatever size was announced; files of /proc announce none.
Result<Bytes> readToEnd(int fd, const fs::path& path, std::uint64_t announced,
                        const Limits& limits) {
    const auto tooLarge = [&](std::uint64_t size) {
        return fail(ErrorCode::invalidInput,
                    "'{}' has {} bytes or more, more than the memory limit of {} MiB; raise it "
                    "with --max-memory if the file is to be trusted",
                    path.string(), size, limits.maxMemoryBytes >> 20);
    };
    if (announced > limits.maxMemoryBytes) return tooLarge(announced);
    Bytes bytes(std::max<std::uint64_t>(announced + 1, 4096));
    std::size_t filled = 0;
    for (;;) {
        if (filled == bytes.size()) bytes.resize(bytes.size() * 2);
        const auto n = ::read(fd, bytes.data() + filled, bytes.size() - filled);
        if (n < 0) {
            if (errno == EINTR) continue;
            return failIo("read", path, errno);
        }
        if (n == 0) break;
        filled += static_cast<std::size_t>(n);
        if (filled > limits.maxMemoryBytes) return tooLarge(filled);
    }
    bytes.resize(filled);
    return bytes;
}

/// Gives `from` the name `to`, and fails when there is one already.
int renameNoReplace(const fs::path& from, const fs::path& to) {
    if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
    if (errno != EINVAL && errno != ENOSYS) return errno;
    // File systems that know no such flag (NFS): a hard link fails when the name is taken.
    if (::link(from.c_str(), to.c_str()) != 0) return errno;
    ::unlink(from.c_str());
    return 0;
}

tl::unexpected<Error> failExists(const fs::path& target) {
    return fail(ErrorCode::io, "'{}' exists already and --no-clobber forbids to replace it",
                target.string());
}

}  // namespace

Result<fs::path> throughLinks(const fs::path& target) {
    // Step by step: weakly_canonical() leaves a link to what does not exist yet as it is.
    constexpr int kMostLinks = 40;  // as the system
    std::error_code ec;
    fs::path real = target;
    for (int links = 0; fs::is_symlink(fs::symlink_status(real, ec)); ++links) {
        if (links == kMostLinks) return failIo("follow", target, ELOOP);
        const fs::path next = fs::read_symlink(real, ec);
        if (ec) return failIo("follow", target, ec.value());
        real = folderOf(real) / next;
    }
    return real;
}

fs::path shownName(const fs::path& path) {
    const std::lock_guard lock(targets().mutex);
    const auto& of = targets().of;
    const auto own = of.find(path);
    fs::path shown = own == of.end() ? path : own->second;
    // A file in a folder that is temporary itself.
    fs::path above = shown.parent_path(), inside = shown.filename();
    while (!above.empty()) {
        if (const auto known = of.find(above); known != of.end()) return known->second / inside;
        if (above == above.parent_path()) break;
        inside = above.filename() / inside;
        above = above.parent_path();
    }
    return shown;
}

fs::path folderOf(const fs::path& path) {
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

fs::path folderBeside(const fs::path& output) {
    if (output == "-" || isStream(output)) return folderOfTemporaries();
    return folderOf(throughLinks(output).value_or(output));
}

tl::unexpected<Error> notAFile(const fs::path& path) {
    return fail(ErrorCode::io,
                "cannot read '{}': it is a device or a pipe, not a file; use - for standard "
                "input",
                path.string());
}

Result<Bytes> readFile(const fs::path& path, const Limits& limits) {
    if (path == "-") return readToEnd(STDIN_FILENO, "standard input", 0, limits);
    // Without O_NONBLOCK the opening of a FIFO that nobody writes to would never return.
    const int fd = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) return failIo("open", path, errno);
    const Descriptor closer(fd);
    struct stat info = {};
    if (::fstat(fd, &info) != 0) return failIo("read", path, errno);
    if (S_ISDIR(info.st_mode))
        return fail(ErrorCode::io, "cannot read '{}': it is a folder, not a file", path.string());
    if (!S_ISREG(info.st_mode)) return notAFile(path);
    return readToEnd(fd, path, static_cast<std::uint64_t>(info.st_size), limits);
}

struct OutputFile::Impl {
    fs::path target;  ///< as the user named it, for messages
    fs::path real;    ///< behind links
    Options options;
    Descriptor fd;
    fs::path temporary;   ///< empty when bytes go straight to `fd`
    Descriptor lock;      ///< of a direct one's temporary, as `fd` is of others: it is in use
    bool direct = false;  ///< an open descriptor, as stdout, or a device
    bool committed = false;
    /// Whole: only its name is missing, until the others of OutputFiles are whole, too.
    bool waits = false;
    std::uint64_t written = 0;

    ~Impl() {
        if (!committed && !temporary.empty()) ::unlink(temporary.c_str());
        if (!temporary.empty()) forgetTarget(temporary);
    }
};

/// All wait in a folder, whose lock is theirs: thousands of open files would be too many.
struct OutputFiles::Impl {
    std::map<fs::path, Temporary> waiting;  ///< by the folder of the targets
    std::vector<OutputFile> files;
    std::vector<OutputFolder> folders;

    ~Impl() {
        files.clear();
        folders.clear();
        std::error_code ec;
        for (const auto& folder : waiting) fs::remove_all(folder.second.path, ec);
    }
    Result<fs::path> folderIn(const fs::path& folder, const fs::path& target) {
        if (const auto known = waiting.find(folder); known != waiting.end())
            return known->second.path;
        auto made = createTemporaryFolder(folder);
        if (!made) return failIo("write", target, made.error());
        return waiting.emplace(folder, std::move(*made)).first->second.path;
    }
};

OutputFiles::OutputFiles() : impl_(std::make_unique<Impl>()) {}
OutputFiles::OutputFiles(OutputFiles&&) noexcept = default;
OutputFiles& OutputFiles::operator=(OutputFiles&&) noexcept = default;
OutputFiles::~OutputFiles() = default;

Result<void> OutputFiles::commit() {
    for (OutputFile& file : impl_->files) STX_CHECK(file.commit());
    for (OutputFolder& folder : impl_->folders) STX_CHECK(folder.commit());
    return {};
}

OutputFile::OutputFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
OutputFile::OutputFile(OutputFile&&) noexcept = default;
OutputFile& OutputFile::operator=(OutputFile&&) noexcept = default;
OutputFile::~OutputFile() = default;

Result<OutputFile> OutputFile::create(const fs::path& target, Options options) {
    auto impl = std::make_unique<Impl>();
    impl->target = target;
    impl->options = options;
    const bool standard = target == "-";
    // What the caller opened is written on, where it is: opened by its name, a log would begin
    // again, and renamed to it, a file would take the log's place.
    if (const auto open = standard ? std::optional(STDOUT_FILENO) : descriptorNamed(target)) {
        impl->direct = true;
        if (standard) impl->target = "standard output";
        impl->fd = Descriptor(::fcntl(*open, F_DUPFD_CLOEXEC, 3));
        if (impl->fd.get() < 0) return failIo("write", impl->target, errno);
        return OutputFile(std::move(impl));
    }
    if (target.empty() || !target.has_filename())
        return fail(ErrorCode::io, "cannot write '{}': it names no file", target.string());

    struct stat info = {};
    const bool exists = ::stat(target.c_str(), &info) == 0;
    if (exists && S_ISDIR(info.st_mode))
        return fail(ErrorCode::io, "cannot write '{}': it is a folder", target.string());
    if (exists && !S_ISREG(info.st_mode)) {
        // A device such as /dev/null, or a pipe that somebody reads: there is nothing to rename.
        impl->direct = true;
        impl->fd = Descriptor(::open(target.c_str(), O_WRONLY | O_CLOEXEC));
        if (impl->fd.get() < 0) return failIo("write", target, errno);
        return OutputFile(std::move(impl));
    }
    if (exists && options.noClobber) return failExists(target);
    STX_CHECK(checkIsNotNamed(target));
    STX_TRY(impl->real, throughLinks(target));
    if (exists && ::access(impl->real.c_str(), W_OK) != 0) return failIo("write", target, errno);

    fs::path folder = folderOf(impl->real);
    removeStaleTemporaries(folder);
    if (options.together) STX_SET(folder, options.together->impl_->folderIn(folder, target));
    auto temporary = createTemporaryFile(folder);
    if (!temporary) return failIo("write", target, temporary.error());
    impl->fd = std::move(temporary->fd);
    impl->temporary = std::move(temporary->path);
    rememberTarget(impl->temporary, target);
    if (exists) (void)!::fchmod(impl->fd.get(), info.st_mode & 07777);
    return OutputFile(std::move(impl));
}

Result<void> OutputFile::write(ByteSpan bytes) {
    STX_CHECK(writeAll(impl_->fd.get(), bytes, impl_->target));
    impl_->written += bytes.size();
    return {};
}

Result<void> OutputFile::write(std::string_view text) {
    return write(std::as_bytes(std::span(text.data(), text.size())));
}

Result<fs::path> OutputFile::temporaryPath() const {
    if (impl_->temporary.empty()) {
        // Bytes for stdout or a device that a library writes by name: gathered in a file, and
        // copied by commit().
        const fs::path folder = folderOfTemporaries();
        removeStaleTemporaries(folder);
        auto file = createTemporaryFile(folder);
        if (!file)
            return fail(ErrorCode::io,
                        "cannot write '{}': no temporary file can be made in '{}': {}; set TMPDIR "
                        "to a folder that can be written",
                        impl_->target.string(), folder.string(), systemText(file.error()));
        impl_->temporary = std::move(file->path);
        impl_->lock = std::move(file->fd);
    }
    return impl_->temporary;
}

Result<void> OutputFile::commit() {
    Impl& f = *impl_;
    if (f.direct) {
        if (!f.temporary.empty()) {
            const Descriptor in(::open(f.temporary.c_str(), O_RDONLY | O_CLOEXEC));
            if (in.get() < 0) return failIo("read", f.temporary, errno);
            std::vector<std::byte> block(1 << 20);
            for (;;) {
                const auto n = ::read(in.get(), block.data(), block.size());
                if (n < 0 && errno == EINTR) continue;
                if (n < 0) return failIo("read", f.temporary, errno);
                if (n == 0) break;
                STX_CHECK(writeAll(f.fd.get(), ByteSpan(block).first(static_cast<std::size_t>(n)),
                                   f.target));
            }
            ::unlink(f.temporary.c_str());
            f.temporary.clear();
            f.lock.close();
        }
        f.committed = true;
        if (const int error = f.fd.close()) return failIo("write", f.target, error);
        return {};
    }
    // A full disk may only show here, not by write(). A folder that appears as a whole has its
    // files flushed then.
    if (!f.waits && !isInTemporaryFolder(f.real) && ::fsync(f.fd.get()) != 0 && errno != EINVAL &&
        errno != ENOTSUP)
        return failIo("write", f.target, errno);
    if (f.options.together && !f.waits) {
        if (const int error = f.fd.close()) return failIo("write", f.target, error);
        f.waits = true;
        f.options.together->impl_->files.push_back(OutputFile(std::move(impl_)));
        return {};
    }
    if (f.options.noClobber) {
        if (const int error = renameNoReplace(f.temporary, f.real)) {
            if (error == EEXIST) return failExists(f.target);
            return failIo("write", f.target, error);
        }
    } else if (::rename(f.temporary.c_str(), f.real.c_str()) != 0) {
        return failIo("write", f.target, errno);
    }
    f.committed = true;
    if (const int error = f.fd.close()) return failIo("write", f.target, error);
    return {};
}

Result<void> writeFile(const fs::path& target, ByteSpan bytes, OutputFile::Options options) {
    STX_TRY(auto file, OutputFile::create(target, options));
    STX_CHECK(file.write(bytes));
    return file.commit();
}

struct OutputFolder::Impl {
    fs::path target;
    fs::path real;
    OutputFile::Options options;
    std::vector<std::string> ownNames;
    fs::path temporary;
    fs::path named;   ///< as it was given to rememberTarget(); commit() may move `temporary`
    Descriptor lock;  ///< tells other runs that the temporary folder is in use
    std::optional<FolderMode> mode;  ///< of the folder that is replaced
    bool committed = false;
    bool waits = false;  ///< as that of OutputFile

    /// Errors where there is a folder of that name that must stay.
    [[nodiscard]] Result<void> checkFree() const;

    ~Impl() {
        std::error_code ec;
        if (!committed && !temporary.empty()) fs::remove_all(temporary, ec);
        if (!named.empty()) forgetTarget(named);
    }
};

OutputFolder::OutputFolder(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
OutputFolder::OutputFolder(OutputFolder&&) noexcept = default;
OutputFolder& OutputFolder::operator=(OutputFolder&&) noexcept = default;
OutputFolder::~OutputFolder() = default;

Result<OutputFolder> OutputFolder::create(const fs::path& target, OutputFile::Options options,
                                          std::vector<std::string> ownNames) {
    auto impl = std::make_unique<Impl>();
    impl->target = target;
    impl->options = options;
    impl->ownNames = std::move(ownNames);
    // "set/" and "set" are the same folder.
    fs::path named = target.has_filename() ? target : target.parent_path();
    if (named.empty())
        return fail(ErrorCode::io, "cannot write '{}': it names no folder", target.string());
    if (named.filename() == "." || named.filename() == "..")
        return fail(ErrorCode::io, "cannot write '{}': name a folder that can be made or replaced",
                    target.string());
    std::error_code ec;
    const auto status = fs::status(named, ec);
    if (fs::exists(status) && !fs::is_directory(status))
        return fail(ErrorCode::io, "cannot write '{}': it is a file, not a folder",
                    target.string());
    if (fs::exists(status) && options.noClobber) return failExists(target);
    STX_CHECK(checkIsNotNamed(named));
    STX_TRY(impl->real, throughLinks(named));

    fs::path folder = folderOf(impl->real);
    removeStaleTemporaries(folder);
    if (options.together) STX_SET(folder, options.together->impl_->folderIn(folder, target));
    auto temporary = createTemporaryFolder(folder);
    if (!temporary) return failIo("write", target, temporary.error());
    impl->lock = std::move(temporary->fd);
    impl->temporary = std::move(temporary->path);
    impl->named = impl->temporary;
    // From now on: what is written into it is for the same readers.
    impl->mode = modeOfFolder(impl->real);
    if (impl->mode) takeMode(*impl->mode, impl->temporary);
    rememberTarget(impl->named, named);
    return OutputFolder(std::move(impl));
}

const fs::path& OutputFolder::temporaryPath() const {
    return impl_->temporary;
}

namespace {

/// A name with each run of digits as one '#'.
std::string withoutNumbers(const std::string& name) {
    std::string pattern;
    for (const char c : name) {
        const bool digit = c >= '0' && c <= '9';
        if (!digit) pattern += c;
        if (digit && !pattern.ends_with('#')) pattern += '#';
    }
    return pattern;
}

Result<std::set<std::string>> namesIn(const fs::path& folder, const fs::path& target) {
    std::set<std::string> names;
    std::error_code ec;
    for (auto it = fs::recursive_directory_iterator(folder, ec);
         !ec && it != fs::recursive_directory_iterator(); it.increment(ec)) {
        names.insert(it->path().lexically_relative(folder).string());
    }
    if (ec) return failIo("read", target, ec.value());
    return names;
}

/// Errors when the existing folder `old` holds something that is not this output's.
Result<void> checkReplaceable(const fs::path& old, const fs::path& fresh,
                              const std::vector<std::string>& ownNames, const fs::path& target) {
    STX_TRY(const auto written, namesIn(fresh, target));
    std::set<std::string> patterns;
    for (const auto& name : written) patterns.insert(withoutNumbers(name));
    for (const auto& name : ownNames) patterns.insert(withoutNumbers(name));
    STX_TRY(const auto present, namesIn(old, target));
    for (const auto& name : present) {
        if (patterns.contains(withoutNumbers(name))) continue;
        return fail(ErrorCode::io,
                    "cannot replace the folder '{}': it holds '{}', which this output does not "
                    "write; name another folder or remove that file",
                    target.string(), name);
    }
    return {};
}

Result<void> syncFiles(const fs::path& folder, const fs::path& target) {
    std::error_code ec;
    for (auto it = fs::recursive_directory_iterator(folder, ec);
         !ec && it != fs::recursive_directory_iterator(); it.increment(ec)) {
        if (!it->is_regular_file()) continue;
        Descriptor fd(::open(it->path().c_str(), O_RDONLY | O_CLOEXEC));
        if (fd.get() < 0 || (::fsync(fd.get()) != 0 && errno != EINVAL && errno != ENOTSUP))
            return failIo("write", target / it->path().lexically_relative(folder), errno);
    }
    if (ec) return failIo("write", target, ec.value());
    return {};
}

}  // namespace

Result<void> OutputFolder::Impl::checkFree() const {
    std::error_code ec;
    if (!fs::exists(real, ec)) return {};
    if (options.noClobber) return failExists(target);
    return checkReplaceable(real, temporary, ownNames, target);
}

Result<void> OutputFolder::commit() {
    Impl& f = *impl_;
    if (!f.waits) STX_CHECK(syncFiles(f.temporary, f.target));
    if (f.options.together && !f.waits) {
        // Now, and not when others have their names already.
        STX_CHECK(f.checkFree());
        f.lock.close();
        f.waits = true;
        f.options.together->impl_->folders.push_back(OutputFolder(std::move(impl_)));
        return {};
    }
    int error = renameNoReplace(f.temporary, f.real);
    if (error == EPERM) {
        // Folders cannot be hard-linked where RENAME_NOREPLACE is unknown.
        std::error_code ec;
        error = fs::exists(f.real, ec)                               ? EEXIST
                : ::rename(f.temporary.c_str(), f.real.c_str()) == 0 ? 0
                                                                     : errno;
    }
    if (error == EEXIST) {
        STX_CHECK(f.checkFree());
        if (::renameat2(AT_FDCWD, f.temporary.c_str(), AT_FDCWD, f.real.c_str(), RENAME_EXCHANGE) !=
            0) {
            if (errno != EINVAL && errno != ENOSYS) return failIo("replace", f.target, errno);
            // No exchange here: a moment without the folder cannot be helped.
            const fs::path aside = f.temporary.string() + "-old";
            if (::rename(f.real.c_str(), aside.c_str()) != 0)
                return failIo("replace", f.target, errno);
            if (::rename(f.temporary.c_str(), f.real.c_str()) != 0) {
                const int why = errno;
                ::rename(aside.c_str(), f.real.c_str());
                return failIo("replace", f.target, why);
            }
            f.temporary = aside;
        }
        if (f.mode) takeWholeMode(*f.mode, f.real);
        // Nor does the old one keep its files where nobody might write into it.
        ::chmod(f.temporary.c_str(), S_IRWXU);
        std::error_code ec;
        fs::remove_all(f.temporary, ec);
        error = 0;
    }
    if (error) return failIo("write", f.target, error);
    f.committed = true;
    return {};
}

Result<void> OutputFolder::commitWith(OutputFile& file) {
    const auto& text = *file.impl_;
    // Of two runs that write the same names one comes whole after the other: else the text of one
    // could be beside the folder of the other. Where a file system has no locks, nothing is
    // locked.
    const Descriptor alone(
        ::open(folderOf(impl_->real).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (alone.get() >= 0) (void)::flock(alone.get(), LOCK_EX);
    const fs::path aside = impl_->temporary.string() + "-file";
    const bool replaces =
        !text.direct && !text.options.noClobber && ::rename(text.real.c_str(), aside.c_str()) == 0;
    if (auto done = commit(); !done) {
        if (replaces) ::rename(aside.c_str(), text.real.c_str());
        return done;
    }
    auto done = file.commit();
    if (replaces) ::unlink(aside.c_str());
    return done;
}

}  // namespace stx
