#include "formats/yuv/y4m_reader.hpp"

#include <algorithm>
#include <optional>

#include "lib/base/printable.hpp"
#include "lib/base/whole_number.hpp"

namespace stx {
namespace {

constexpr std::string_view kMagic = "YUV4MPEG2";
constexpr std::string_view kFrame = "FRAME";
/// Lines are shorter in every file that means well.
constexpr std::size_t kLongestLine = 1024;
/// More frames are refused as damage: a year at 30 a second would be a thousand million.
constexpr std::size_t kMostFrames = 1u << 24;

std::string atByte(std::uint64_t offset) {
    return fmt::format("byte {}", offset);
}

/// The line at `offset` without its newline.
Result<std::string> lineAt(const ByteSource& source, std::uint64_t offset, std::string_view what) {
    std::string line(std::min<std::uint64_t>(kLongestLine, source.size() - offset), '\0');
    STX_CHECK(source.read(offset, std::as_writable_bytes(std::span(line))));
    const auto end = line.find('\n');
    if (end == std::string::npos)
        return failAt(atByte(offset), ErrorCode::invalidInput,
                      "the line of {} has no end within {} bytes", what, line.size());
    line.resize(end);
    return line;
}

/// FFmpeg's name of the pixels that `C...` stands for; empty: none of ours.
std::string formatName(std::string_view chroma) {
    if (chroma.starts_with("mono")) {
        const auto bits = chroma.substr(4);
        return bits.empty() ? "gray" : fmt::format("gray{}le", bits);
    }
    for (const std::string_view planes : {"420", "422", "444"}) {
        if (!chroma.starts_with(planes)) continue;
        const auto rest = chroma.substr(3);
        if (rest.starts_with("p") && rest.size() > 1)
            return fmt::format("yuv{}p{}le", planes, rest.substr(1));
        const bool siting =
            planes == "420" && (rest == "jpeg" || rest == "mpeg2" || rest == "paldv");
        return rest.empty() || siting ? fmt::format("yuv{}p", planes) : std::string();
    }
    return {};
}

/// What the line at the beginning says.
struct Y4mHeaderLine {
    YuvFormat format;
    bool fullRange = false, interlaced = false;
};

Result<Y4mHeaderLine> parseHeader(std::string_view line, const Limits& limits) {
    std::string_view chroma = "420jpeg";
    std::optional<bool> fullSaid;
    Y4mHeaderLine out;
    int width = 0, height = 0;
    line.remove_prefix(kMagic.size());
    while (!line.empty()) {
        const auto space = std::min(line.find(' '), line.size());
        const auto word = line.substr(0, space);
        line.remove_prefix(std::min(space + 1, line.size()));
        if (word.empty()) continue;
        const auto value = word.substr(1);
        if (word[0] == 'W' || word[0] == 'H') {
            int& side = word[0] == 'W' ? width : height;
            side = wholeNumber<int>(value).value_or(0);
            if (side < 1 || side > limits.maxImageSide)
                return failAt(atByte(0), ErrorCode::invalidInput,
                              "the {} of the frames is '{}'; 1 to {} is expected",
                              word[0] == 'W' ? "width" : "height", value, limits.maxImageSide);
        } else if (word[0] == 'C') {
            chroma = value;
        } else if (word[0] == 'I') {
            out.interlaced = value == "t" || value == "b" || value == "m";
        } else if (word == "XCOLORRANGE=FULL") {
            fullSaid = true;
        } else if (word == "XCOLORRANGE=LIMITED") {
            fullSaid = false;
        }
    }
    if (width == 0 || height == 0)
        return failAt(atByte(0), ErrorCode::invalidInput,
                      "the first line does not say the {} of the frames",
                      width == 0 ? "width" : "height");
    const auto format = yuvFormatNamed(formatName(chroma));
    if (!format)
        return failAt(atByte(0), ErrorCode::unsupported,
                      "pixels of the kind C{} are not read; make 4:2:0 of them: ffmpeg -i IN.y4m "
                      "-pix_fmt yuv420p OUT.y4m",
                      chroma);
    out.format = *format;
    // Where it is not said, luma alone is of full range, as ffmpeg writes it, and luma with chroma
    // is not.
    out.fullRange = fullSaid.value_or(!out.format.chroma);
    out.format.width = width;
    out.format.height = height;
    out.format.chromaLeft = chroma == "420mpeg2" || chroma == "420paldv" ||
                            chroma.starts_with("420p") || chroma.starts_with("422");
    return out;
}

}  // namespace

bool Y4mReader::recognises(ByteSpan head) {
    return head.size() >= kMagic.size() &&
           std::equal(kMagic.begin(), kMagic.end(), reinterpret_cast<const char*>(head.data()));
}

Result<Y4mReader> Y4mReader::open(ByteSource source, Job& job) {
    Y4mReader out;
    out.source_ = std::move(source);
    const std::uint64_t size = out.source_.size();
    STX_TRY(const auto line, lineAt(out.source_, 0, "the file"));
    if (!recognises(std::as_bytes(std::span(line))))
        return failAt(atByte(0), ErrorCode::invalidInput, "it does not begin with {}", kMagic);
    STX_TRY(const auto header, parseHeader(line, job.limits));
    out.format_ = header.format;
    out.colour_ = {header.format.height < 720 ? YuvMatrix::bt601 : YuvMatrix::bt709,
                   header.fullRange};
    if (header.interlaced)
        job.note("its frames are interlaced; they are taken as they are, combs and all");
    const std::uint64_t bytes = out.format_.frameBytes();
    for (std::uint64_t at = line.size() + 1; at < size;) {
        const std::size_t k = out.frames_.size();
        if (k == kMostFrames)
            return failAt(atByte(at), ErrorCode::invalidInput, "it has more than {} frames",
                          kMostFrames);
        STX_TRY(const auto frame, lineAt(out.source_, at, fmt::format("frame {}", k)));
        if (!frame.starts_with(kFrame) || (frame.size() > kFrame.size() && frame[5] != ' '))
            return failAt(atByte(at), ErrorCode::invalidInput,
                          "frame {} must begin with {} here, not with '{}'", k, kFrame,
                          printable(frame.substr(0, 16)));
        const std::uint64_t first = at + frame.size() + 1;
        if (size - first < bytes)
            return failAt(atByte(first), ErrorCode::invalidInput,
                          "frame {} is cut off: {} bytes of {} are here; take the {} whole ones: "
                          "ffmpeg -i IN.y4m -frames:v {} OUT.y4m",
                          k, size - first, bytes, k, k);
        out.frames_.push_back(first);
        at = first + bytes;
    }
    if (out.frames_.empty())
        return failAt(atByte(size), ErrorCode::invalidInput, "it holds no frame");
    return out;
}

Result<Rgba8Image> Y4mReader::frame(int k, const Limits& limits) const {
    const std::uint64_t offset = frames_[k];
    const auto name = fmt::format("frame {}", k);
    const auto load = [&]() -> Result<Rgba8Image> {
        const ByteRange range(source_, offset, format_.frameBytes());
        STX_TRY(const auto bytes, range.load(limits));
        return rgbFromYuv(bytes, format_, colour_, name, limits);
    };
    return within(atByte(offset), load());
}

}  // namespace stx
