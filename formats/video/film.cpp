#include "formats/video/film.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <fstream>

#include "formats/photos/photo.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

/// Tracks that a film can have.
constexpr std::uint32_t kMostTracks = 1000;

/// Reads numbers out of an open file; what is behind its end is 0.
class Looker {
  public:
    explicit Looker(int file) : file_(file) {}
    [[nodiscard]] std::uint64_t number(std::uint64_t at, int bytes, bool bigEndian = true) const {
        std::uint8_t read[8] = {};
        if (::pread(file_, read, static_cast<std::size_t>(bytes), static_cast<off_t>(at)) != bytes)
            return 0;
        std::uint64_t value = 0;
        for (int i = 0; i < bytes; ++i) value = value << 8 | read[bigEndian ? i : bytes - 1 - i];
        return value;
    }

  private:
    int file_;
};

/// Where the last box of an MP4 file ends that begins within `size` bytes (ISO/IEC 14496-12, 4.2).
std::uint64_t endOfBoxes(const Looker& look, std::uint64_t size) {
    constexpr int kMostBoxes = 1 << 20;
    std::uint64_t at = 0;
    for (int i = 0; i < kMostBoxes && at + 8 <= size; ++i) {
        std::uint64_t length = look.number(at, 4);
        if (length == 1) length = look.number(at + 8, 8);
        // 0: to the end of the file. Less than a header, or beyond all files: damage, which the
        // reader tells.
        if (length < 8 || length > INT64_MAX / 2) return size;
        at += length;
    }
    return at;
}

/// What a track of an ISO file (.mp4, .mov) says of where its data are.
struct DataPlace {
    bool video = false, elsewhere = false;
};

/// Looks through the boxes between two places, as deep as those of a data reference lie. Calls
/// `track` for each track.
template <class OnTrack>
void lookThroughBoxes(const Looker& look, std::uint64_t at, std::uint64_t end, DataPlace* place,
                      const OnTrack& track, int depth = 0) {
    constexpr int kDeepest = 5;  // moov/trak/mdia/minf/dinf
    if (depth > kDeepest) return;
    const auto code = [](const char(&type)[5]) {
        return std::uint64_t{static_cast<unsigned char>(type[0])} << 24 |
               std::uint64_t{static_cast<unsigned char>(type[1])} << 16 |
               std::uint64_t{static_cast<unsigned char>(type[2])} << 8 |
               static_cast<unsigned char>(type[3]);
    };
    constexpr int kMostBoxes = 100'000;
    for (int i = 0; i < kMostBoxes && at + 8 <= end; ++i) {
        std::uint64_t length = look.number(at, 4), head = 8;
        const std::uint64_t type = look.number(at + 4, 4);
        if (length == 1) {
            length = look.number(at + 8, 8);
            head = 16;
        }
        if (length == 0) length = end - at;
        if (length < head || length > end - at) return;
        const std::uint64_t inside = at + head, next = at + length;
        if (type == code("trak")) {
            DataPlace own;
            lookThroughBoxes(look, inside, next, &own, track, depth + 1);
            track(own);
        } else if (type == code("moov") || type == code("mdia") || type == code("minf") ||
                   type == code("dinf")) {
            lookThroughBoxes(look, inside, next, place, track, depth + 1);
        } else if (type == code("hdlr") && place && !place->video) {
            place->video = look.number(inside + 8, 4) == code("vide");
        } else if (type == code("dref") && place) {
            // Of the first reference: bit 0 of its flags says that the data are here (8.7.2).
            place->elsewhere =
                look.number(inside + 4, 4) > 0 && (look.number(inside + 16, 4) & 1) == 0;
        }
        at = next;
    }
}

/// Readers of films take what lies here for data that another file holds.
Result<void> checkDataAreHere(const Descriptor& file, std::string_view format,
                              const std::string& where) {
    struct stat facts = {};
    if (format != "mov" || ::fstat(file.get(), &facts) != 0) return {};
    bool elsewhere = false;
    lookThroughBoxes(
        Looker(file.get()), 0, static_cast<std::uint64_t>(facts.st_size), nullptr,
        [&](const DataPlace& place) { elsewhere = elsewhere || (place.video && place.elsewhere); });
    if (!elsewhere) return {};
    return failAt(where, ErrorCode::unsupported,
                  "the data of its video are in another file, which is not opened; make one file "
                  "of both: ffmpeg -enable_drefs 1 -i IN -c copy OUT.mp4");
}

/// Where the segment of a Matroska file ends (RFC 8794, RFC 9559); 0 when it does not tell, as of a
/// recording that was broken off.
std::uint64_t endOfSegment(const Looker& look) {
    constexpr std::uint64_t kHead = 0x1A45DFA3, kSegment = 0x18538067;
    std::uint64_t at = 0;
    for (const std::uint64_t element : {kHead, kSegment}) {
        if (look.number(at, 4) != element) return 0;
        at += 4;
        const auto first = static_cast<std::uint8_t>(look.number(at, 1));
        const int bytes = first == 0 ? 8 : std::countl_zero(first) + 1;
        const std::uint64_t mask = (std::uint64_t{1} << (7 * bytes)) - 1;
        const std::uint64_t length = look.number(at, bytes) & mask;
        if (length == mask) return 0;
        at += static_cast<std::uint64_t>(bytes) + length;
    }
    return at;
}

/// Readers of films take a file that ends early for one that is short; what was copied in part, or
/// has filled a disk, is not what is meant.
Result<void> checkWhole(const Descriptor& file, std::string_view format, const std::string& where) {
    struct stat facts = {};
    if (::fstat(file.get(), &facts) != 0) return failAt(where, ErrorCode::io, "cannot be read");
    const auto size = static_cast<std::uint64_t>(facts.st_size);
    const Looker look(file.get());
    const std::uint64_t end = format == "mov"        ? endOfBoxes(look, size)
                              : format == "matroska" ? endOfSegment(look)
                                                     : 8 + look.number(4, 4, false);
    if (end > size)
        return failAt(where, ErrorCode::invalidInput,
                      "it is cut off: it should have {} bytes, and has {}; copy it once more, or "
                      "take what is there: ffmpeg -i IN -c copy OUT.mkv",
                      end, size);
    return {};
}

/// Pictures that may be missing: a note, or an error when `strict`.
Result<void> tellDamage(const std::string& where, const std::string& damage, bool strict,
                        Job& job) {
    if (strict)
        return failAt(where, ErrorCode::invalidInput,
                      "{}; copy it once more, or leave out --strict", damage);
    job.note(fmt::format("{}: {}; the others are taken, and --strict stops there", where, damage));
    return {};
}

}  // namespace

std::string_view filmFormatOf(ByteSpan head) {
    // Its boxes are those of a film.
    if (photos::isHeif(head)) return {};
    const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
    const auto has = [&](std::size_t at, std::string_view part) {
        return text.size() >= at + part.size() && text.substr(at, part.size()) == part;
    };
    if (has(0, "\x1a\x45\xdf\xa3")) return "matroska";
    if (has(0, "RIFF") && has(8, "AVI ")) return "avi";
    for (const std::string_view box : {"ftyp", "moov", "mdat", "free", "wide", "skip"})
        if (has(4, box)) return "mov";
    return {};
}

std::string_view filmFormatOf(const fs::path& path) {
    std::error_code ec;
    if (!fs::is_regular_file(path, ec)) return {};
    char head[16] = {};
    std::ifstream file(path, std::ios::binary);
    file.read(head, sizeof(head));
    return filmFormatOf(
        std::as_bytes(std::span(head))
            .first(static_cast<std::size_t>(std::max<std::streamsize>(0, file.gcount()))));
}

Result<std::unique_ptr<Film>> Film::open(const fs::path& path, const Limits& limits) {
    std::unique_ptr<Film> film(new Film());
    film->path_ = path;
    film->limits_ = limits;
    const std::string_view format = filmFormatOf(path);
    if (format.empty())
        return failAt(film->where(), ErrorCode::unsupported,
                      "it is not a .mp4, .mov, .mkv, .webm or .avi, which are read; put its tracks "
                      "into one: ffmpeg -i IN -c copy OUT.mkv");
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (file.get() < 0) return failAt(film->where(), ErrorCode::io, "cannot be read");
    STX_TRY(auto process, within(film->where(), VideoProcess::start(limits, file.get())));
    STX_CHECK(checkWhole(file, format, film->where()));
    STX_CHECK(checkDataAreHere(file, format, film->where()));
    film->process_ = std::move(process);
    video::Packer request;
    request.putText(format);
    STX_TRY(const auto answer, film->ask(video::Tag::openFilm, request, video::Tag::film));
    video::Unpacker in(answer);
    const auto count = in.get<std::uint32_t>();
    for (std::uint32_t i = 0; i < std::min(count, kMostTracks) && in.ok(); ++i) {
        Track track;
        track.video = in.get<std::uint8_t>() != 0;
        track.codec = in.getText();
        track.pixels = in.getText();
        track.width = in.get<std::int32_t>();
        track.height = in.get<std::int32_t>();
        track.turn = in.get<video::Turn>();
        if (track.turn.sideways()) std::swap(track.width, track.height);
        track.title = in.getText();
        track.attachment = in.getText();
        const auto bytes = in.getBytes();
        track.attached.assign(bytes.begin(), bytes.end());
        film->tracks_.push_back(std::move(track));
    }
    if (!in.ok()) return failAt(film->where(), ErrorCode::failed, "its tracks make no sense");
    return film;
}

int Film::firstVideo() const {
    const auto found = std::ranges::find_if(tracks_, &Track::video);
    return found == tracks_.end() ? -1 : static_cast<int>(found - tracks_.begin());
}

Result<void> Film::select(int track, bool strict, Job& job) {
    if (track < 0 || track >= static_cast<int>(tracks_.size()) || !tracks_[track].video)
        return failAt(where(), ErrorCode::invalidInput, "it has no track of video");
    const Track& chosenTrack = tracks_[track];
    if (chosenTrack.width < 1 || chosenTrack.height < 1 ||
        chosenTrack.width > limits_.maxImageSide || chosenTrack.height > limits_.maxImageSide)
        return failAt(where(), ErrorCode::invalidInput,
                      "its pictures are {}x{} pixels; each side must be 1 to {}", chosenTrack.width,
                      chosenTrack.height, limits_.maxImageSide);
    track_ = track;
    turn_ = chosenTrack.turn;
    video::Packer request;
    request.put(static_cast<std::int32_t>(track));
    STX_TRY(const auto chosen, ask(video::Tag::selectTrack, request, video::Tag::done));
    units_.clear();
    coded_.clear();
    shown_.clear();
    std::vector<std::int64_t> durations;
    std::int32_t numerator = 0, denominator = 0;
    std::string damage;
    for (bool last = false; !last;) {
        STX_TRY(const auto answer, ask(video::Tag::readOn, {}, video::Tag::index));
        video::Unpacker in(answer);
        numerator = in.get<std::int32_t>();
        denominator = in.get<std::int32_t>();
        last = in.get<std::uint8_t>() != 0;
        std::string found = in.getText();
        if (damage.empty()) damage = std::move(found);
        const auto count = in.get<std::uint64_t>();
        for (std::uint64_t i = 0; i < count && in.ok(); ++i) {
            Unit unit;
            unit.pts = in.get<std::int64_t>();
            unit.dts = in.get<std::int64_t>();
            durations.push_back(in.get<std::int64_t>());
            coded_.push_back({unit.pts, in.get<std::uint8_t>() != 0});
            if (in.get<std::uint8_t>() == 0) shown_.push_back(units_.size());
            units_.push_back(unit);
        }
        if (!in.ok() || numerator < 1 || denominator < 1 || (count == 0 && !last))
            return failAt(where(), ErrorCode::failed, "the times of its pictures make no sense");
        STX_CHECK(limits_.checkAllocation(units_.size(), 64, "the index of the film"));
    }
    if (shown_.empty())
        return failAt(where(), ErrorCode::invalidInput, "its track of video has no picture");
    if (!damage.empty()) STX_CHECK(tellDamage(where(), damage, strict, job));
    const auto timeOf = [&](std::size_t unit) { return units_[unit].pts; };
    std::ranges::stable_sort(shown_, {}, timeOf);
    const auto again = std::unique(shown_.begin(), shown_.end(), [&](std::size_t a, std::size_t b) {
        return timeOf(a) == timeOf(b);
    });
    shown_.erase(again, shown_.end());
    const double tick = static_cast<double>(numerator) / denominator;
    times_.clear();
    for (const std::size_t unit : shown_)
        times_.push_back(static_cast<double>(units_[unit].pts) * tick);
    for (std::size_t i = 1; i < times_.size(); ++i)
        if (!(times_[i] > times_[i - 1]))
            return failAt(where(), ErrorCode::invalidInput,
                          "its pictures are too far apart: {:g} s and {:g} s", times_[i - 1],
                          times_[i]);
    lastDuration_ = static_cast<double>(std::max<std::int64_t>(0, durations[shown_.back()])) * tick;
    PictureFinder::Source source;
    source.begin = [this](std::size_t unit) -> Result<void> {
        video::Packer place;
        place.put(units_[unit].dts);
        place.put(units_[unit].pts);
        STX_TRY(const auto done, process_->ask(video::Tag::seek, place.bytes, video::Tag::done));
        return {};
    };
    source.feed = [this](std::size_t, std::int64_t wanted) {
        video::Packer time;
        time.put(wanted);
        return process_->ask(video::Tag::step, time.bytes, video::Tag::ready);
    };
    finder_.emplace(*process_, coded_, std::move(source));
    return {};
}

Result<VideoPicture> Film::picture(int k) {
    const std::lock_guard lock(mutex_);
    const auto at = static_cast<std::size_t>(k);
    STX_TRY(auto found, within(fmt::format("{}: frame {} ({:.4g} s)", where(), k, times_[at]),
                               finder_->find(shown_[at], limits_)));
    found.turn(turn_);
    return found;
}

Result<Bytes> Film::ask(video::Tag request, const video::Packer& bytes, video::Tag expected) {
    return within(where(), process_->ask(request, bytes.bytes, expected));
}

}  // namespace stx
