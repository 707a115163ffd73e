#include "formats/images/pnm.hpp"

#include <charconv>

#include "formats/images/reader.hpp"

namespace stx {
namespace {

bool isSpace(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/// Takes numbers out of text, between which are spaces and comments.
class NumberTaker {
  public:
    explicit NumberTaker(std::string_view text) : text_(text) {}

    /// `digits`: that are one number at most.
    std::optional<int> next(std::size_t digits = std::string_view::npos) {
        while (at_ < text_.size() && (isSpace(text_[at_]) || text_[at_] == '#')) {
            if (text_[at_] == '#') at_ = std::min(text_.find('\n', at_), text_.size());
            if (at_ < text_.size()) ++at_;
        }
        const std::string_view rest = text_.substr(at_, digits);
        int value = 0;
        const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
        if (error != std::errc() || value < 0) return std::nullopt;
        at_ += static_cast<std::size_t>(end - rest.data());
        return value;
    }
    [[nodiscard]] std::size_t place() const { return at_; }

  private:
    std::string_view text_;
    std::size_t at_ = 2;
};

struct PnmHeader {
    int kind = 0;  ///< 1 to 6
    int largest = 1;
    std::size_t begin = 0;  ///< of pixels
    [[nodiscard]] bool text() const { return kind <= 3; }
    [[nodiscard]] bool ink() const { return kind == 1 || kind == 4; }  ///< 1 is black
};

Result<PnmHeader> pnmHeaderIn(std::string_view text, ImageInfo& info) {
    constexpr int kMostValue = 65535;
    PnmHeader header;
    header.kind = text[1] - '0';
    NumberTaker numbers(text);
    const auto width = numbers.next(), height = numbers.next(),
               largest = header.ink() ? 1 : numbers.next();
    header.begin = numbers.place() + 1;  // behind one space
    if (!width || !height || !largest || *largest < 1 || *largest > kMostValue ||
        header.begin > text.size() || !isSpace(text[header.begin - 1]))
        return fail(ErrorCode::invalidInput,
                    "the header is not that of a PNM: 'P{}', width, height{} are expected",
                    header.kind, header.ink() ? "" : " and the largest value, 1 to 65535,");
    header.largest = *largest;
    info = {"pnm", *width, *height, header.kind % 3 == 0 ? 3 : 1, header.largest > 255 ? 16 : 8};
    return header;
}

/// The values as the file has them, row by row: `take(value)` is false where one is not allowed.
template <class Take>
Result<void> readValues(std::string_view text, const PnmHeader& header, const ImageInfo& info,
                        const Take& take) {
    const std::size_t perRow = static_cast<std::size_t>(info.width) * info.channels,
                      count = perRow * info.height;
    const std::string_view pixels = text.substr(header.begin);
    const std::size_t eachRow = header.ink() ? (perRow + 7) / 8 : perRow * info.bits / 8;
    if (!header.text() && pixels.size() / eachRow < static_cast<std::size_t>(info.height))
        return fail(ErrorCode::invalidInput,
                    "{} bytes of pixels; {}x{} need {} (is the file cut short?)", pixels.size(),
                    info.width, info.height, eachRow * info.height);
    NumberTaker numbers(text.substr(header.begin - 2));
    const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(pixels[at]); };
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t x = i % perRow, row = i / perRow * eachRow;
        const std::optional<int> value =
            header.text()     ? numbers.next(header.ink() ? 1 : std::string_view::npos)
            : header.ink()    ? byte(row + x / 8) >> (7 - x % 8) & 1
            : info.bits == 16 ? byte(row + 2 * x) << 8 | byte(row + 2 * x + 1)
                              : byte(row + x);
        if (!value)
            return fail(ErrorCode::invalidInput,
                        "{} of {} values are there (is the file cut short?)", i, count);
        if (*value > header.largest)
            return fail(ErrorCode::invalidInput,
                        "the value at column {}, row {} is {}; the header names {} as the largest",
                        x / info.channels, i / perRow, *value, header.largest);
        take(i, header.ink() ? 1 - *value : *value);
    }
    return {};
}

}  // namespace

bool isPnm(ByteSpan bytes) {
    const auto at = [&](std::size_t i) { return static_cast<char>(bytes[i]); };
    return bytes.size() > 2 && at(0) == 'P' && at(1) >= '1' && at(1) <= '6' &&
           (isSpace(at(2)) || at(2) == '#');
}

Result<DecodedImage> decodePnm(ByteSpan bytes, const Limits& limits) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    ImageInfo info;
    STX_TRY(const PnmHeader header, pnmHeaderIn(text, info));
    STX_CHECK(checkImageHeader(info, bytes.size(), limits));
    DecodedImage image;
    image.width = image.displayWidth = info.width;
    image.height = image.displayHeight = info.height;
    image.channels = info.channels;
    image.channelNames = info.channels == 1 ? std::vector<std::string>{"Y"}
                                            : std::vector<std::string>{"R", "G", "B"};
    const std::uint32_t white = info.bits == 16 ? 65535 : 255,
                        largest = static_cast<std::uint32_t>(header.largest);
    if (largest != white) image.storedLargest = header.largest;
    const auto fill = [&](auto& values) {
        values.resize(static_cast<std::size_t>(info.width) * info.height * info.channels);
        return readValues(text, header, info, [&](std::size_t i, int value) {
            values[i] = static_cast<std::remove_reference_t<decltype(values[0])>>(
                (static_cast<std::uint32_t>(value) * white + largest / 2) / largest);
        });
    };
    STX_CHECK(info.bits == 16 ? fill(image.values.emplace<1>()) : fill(image.values.emplace<0>()));
    return image;
}

}  // namespace stx
