// NumPy's format is described in numpy/lib/format.py: "\x93NUMPY", a version, the length of a
// dictionary of Python, that dictionary, and the values.

#include "formats/images/npy.hpp"

#include <zip.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
#include <optional>

#include <glm/gtc/packing.hpp>

#include "lib/base/whole_number.hpp"

namespace stx {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kArray = "\x93NUMPY"sv, kArchive = "PK\x03\x04"sv;

std::string_view textIn(ByteSpan bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

struct Header {
    char kind = 0;      ///< b u i f
    int size = 0;       ///< bytes of a value
    bool swap = false;  ///< the bytes of values are from the most significant on
    bool columns = false;
    std::vector<std::uint64_t> shape;
    std::size_t begin = 0;  ///< of the values
};

/// What follows `'key':` in the dictionary.
std::string_view valueOf(std::string_view dictionary, std::string_view key) {
    const auto at = dictionary.find(fmt::format("'{}'", key));
    if (at == dictionary.npos) return {};
    const auto colon = dictionary.find(':', at + key.size() + 2);
    if (colon == dictionary.npos) return {};
    const auto value = dictionary.substr(colon + 1);
    return value.substr(std::min(value.find_first_not_of(' '), value.size()));
}

Result<Header> headerOf(ByteSpan bytes) {
    const std::string_view text = textIn(bytes);
    const auto damaged = [] {
        return fail(ErrorCode::invalidInput, "the header of the NumPy array is damaged");
    };
    constexpr std::size_t kFixed = 8;  // magic and version
    const auto byte = [&](std::size_t at) { return std::to_integer<std::size_t>(bytes[at]); };
    if (bytes.size() < kFixed + 4) return damaged();
    const bool first = byte(6) == 1;
    Header header;
    header.begin = first ? 10 : 12;
    const std::size_t length =
        byte(8) | byte(9) << 8 | (first ? 0 : byte(10) << 16 | byte(11) << 24);
    if (length > bytes.size() - header.begin) return damaged();
    const auto dictionary = text.substr(header.begin, length);
    header.begin += length;

    const auto type = valueOf(dictionary, "descr");
    const auto order = valueOf(dictionary, "fortran_order");
    const auto shape = valueOf(dictionary, "shape");
    const auto quote = type.find('\'', 1);
    if (type.size() < 4 || type[0] != '\'' || quote == type.npos || order.empty() ||
        !shape.starts_with('(') || shape.find(')') == shape.npos)
        return damaged();
    const auto name = type.substr(1, quote - 1);
    const auto size = name.size() == 3 ? wholeNumber<int>(name.substr(2)) : std::nullopt;
    header.kind = name.size() == 3 ? name[1] : ' ';
    header.size = size.value_or(0);
    const bool known =
        header.kind == 'f' ? header.size == 2 || header.size == 4 || header.size == 8
        : header.kind == 'u' || header.kind == 'i'
            ? header.size == 1 || header.size == 2 || header.size == 4 || header.size == 8
            : header.kind == 'b' && header.size == 1;
    if (!known || "<>|="sv.find(name[0]) == std::string_view::npos)
        return fail(ErrorCode::invalidInput,
                    "the NumPy array has values of type '{}'; integers and floats are expected, as "
                    "of .astype('float32')",
                    name);
    header.swap = name[0] == '>';
    header.columns = order.starts_with("True");
    for (auto list = shape.substr(1, shape.find(')') - 1); !list.empty();) {
        auto word = list.substr(0, list.find(','));
        list.remove_prefix(std::min(word.size() + 1, list.size()));
        while (word.starts_with(' ')) word.remove_prefix(1);
        if (word.empty()) continue;
        const auto number = wholeNumber<std::uint64_t>(word);
        if (!number) return damaged();
        header.shape.push_back(*number);
    }
    return header;
}

/// The value at `at`; whole numbers up to 2^53 are exact.
double valueAt(const Header& header, const std::byte* at) {
    std::uint64_t bits = 0;
    for (int i = 0; i < header.size; ++i)
        bits |= std::to_integer<std::uint64_t>(at[header.swap ? header.size - 1 - i : i])
                << (8 * i);
    if (header.kind == 'i') {
        const int unused = 64 - 8 * header.size;
        return static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused);
    }
    if (header.kind != 'f') return static_cast<double>(bits);
    if (header.size == 8) return std::bit_cast<double>(bits);
    if (header.size == 4) return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
    return glm::unpackHalf1x16(static_cast<std::uint16_t>(bits));
}

Result<DecodedImage> decodeArray(ByteSpan bytes, const Limits& limits) {
    STX_TRY(Header header, headerOf(bytes));
    const std::string shapeText = fmt::format("({})", fmt::join(header.shape, ", "));
    auto& shape = header.shape;
    while (shape.size() > 2 && shape[0] == 1) shape.erase(shape.begin());
    if (shape.size() == 2) shape.push_back(1);
    const auto most = static_cast<std::uint64_t>(limits.maxImageSide);
    if (shape.size() != 3 || shape[2] < 1 || shape[2] > 4 || shape[0] < 1 || shape[1] < 1 ||
        shape[0] > most || shape[1] > most)
        return fail(ErrorCode::invalidInput,
                    "the NumPy array has the shape {}; (height, width) or (height, width, "
                    "channels) of up to {} a side and 4 channels is expected",
                    shapeText, most);
    const std::uint64_t pixels = shape[0] * shape[1], channels = shape[2],
                        size = static_cast<std::uint64_t>(header.size);
    if (bytes.size() - header.begin < pixels * channels * size)
        return fail(ErrorCode::invalidInput,
                    "{} bytes of values; the shape {} needs {} (is the file cut short?)",
                    bytes.size() - header.begin, shapeText, pixels * channels * size);
    STX_CHECK(limits.checkAllocation(pixels * channels, sizeof(float), "the NumPy array"));

    DecodedImage image;
    image.width = image.displayWidth = static_cast<int>(shape[1]);
    image.height = image.displayHeight = static_cast<int>(shape[0]);
    image.channels = static_cast<int>(channels);
    image.channelNames = channels > 2 ? std::vector<std::string>{"R", "G", "B", "A"}
                                      : std::vector<std::string>{"Y", "A"};
    image.channelNames.resize(channels);
    const std::byte* const first = bytes.data() + header.begin;
    const auto at = [&](std::uint64_t i) {
        if (!header.columns) return first + i * size;
        const std::uint64_t c = i % channels, x = i / channels % shape[1],
                            y = i / channels / shape[1];
        return first + ((c * shape[1] + x) * shape[0] + y) * size;
    };
    const auto fill = [&]<class Value>(std::vector<Value>& values) {
        values.resize(pixels * channels);
        for (std::uint64_t i = 0; i < values.size(); ++i) {
            const double value = valueAt(header, at(i));
            if constexpr (std::is_integral_v<Value>)
                if (!(value >= 0 && value <= std::numeric_limits<Value>::max())) return value;
            values[i] = static_cast<Value>(value);
        }
        return 0.0;
    };
    if (header.kind == 'f') {
        image.linear = true;
        (void)fill(image.values.emplace<2>());
    } else if (header.size == 1 && header.kind != 'i') {
        (void)fill(image.values.emplace<0>());
        if (header.kind == 'b')
            for (auto& value : std::get<0>(image.values)) value = value ? 255 : 0;
    } else if (const double beyond = fill(image.values.emplace<1>()); beyond != 0) {
        return fail(ErrorCode::invalidInput,
                    "the NumPy array has the integer {:g}; 0 to 65535 is possible, or floats",
                    beyond);
    }
    return image;
}

/// The array in an archive that is meant.
Result<Bytes> arrayIn(ByteSpan archive, const Limits& limits) {
    struct Discard {
        void operator()(zip_t* z) const { zip_discard(z); }
    };
    struct Close {
        void operator()(zip_file_t* f) const { zip_fclose(f); }
    };
    const auto damaged = [] {
        return fail(ErrorCode::invalidInput, "the .npz archive is damaged");
    };
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* source = zip_source_buffer_create(archive.data(), archive.size(), 0, &error);
    if (!source) throw std::bad_alloc();
    const std::unique_ptr<zip_t, Discard> zip(zip_open_from_source(source, ZIP_RDONLY, &error));
    zip_error_fini(&error);
    if (!zip) {
        zip_source_free(source);
        return damaged();
    }
    constexpr std::string_view kNames[] = {"depth", "image", "rgb", "color", "colour", "arr_0"};
    std::vector<std::string> names;
    std::vector<zip_int64_t> all, known;
    for (zip_int64_t i = 0; i < zip_get_num_entries(zip.get(), 0); ++i) {
        const char* entry = zip_get_name(zip.get(), static_cast<zip_uint64_t>(i), 0);
        std::string_view name = entry ? entry : "";
        if (name.ends_with(".npy")) name.remove_suffix(4);
        names.emplace_back(name);
        all.push_back(i);
        if (std::ranges::find(kNames, name) != std::end(kNames)) known.push_back(i);
    }
    const auto& chosen = all.size() == 1 ? all : known;
    if (chosen.size() != 1) {
        names.resize(std::min<std::size_t>(names.size(), 8));
        return fail(ErrorCode::invalidInput,
                    "the .npz archive holds {} arrays ({}); one, or one named depth, image, rgb, "
                    "color, colour or arr_0 is expected",
                    all.size(), fmt::join(names, ", "));
    }
    const auto index = static_cast<zip_uint64_t>(chosen[0]);
    zip_stat_t facts;
    zip_stat_init(&facts);
    if (zip_stat_index(zip.get(), index, 0, &facts) != 0 || !(facts.valid & ZIP_STAT_SIZE))
        return damaged();
    STX_CHECK(limits.checkAllocation(facts.size, 1, "the array in the .npz archive"));
    const std::unique_ptr<zip_file_t, Close> file(zip_fopen_index(zip.get(), index, 0));
    Bytes bytes(facts.size);
    if (!file ||
        zip_fread(file.get(), bytes.data(), facts.size) != static_cast<zip_int64_t>(facts.size))
        return damaged();
    return bytes;
}

}  // namespace

bool isNumpy(ByteSpan bytes) {
    return textIn(bytes).starts_with(kArray) || textIn(bytes).starts_with(kArchive);
}

Result<DecodedImage> decodeNumpy(ByteSpan bytes, const Limits& limits) {
    if (!textIn(bytes).starts_with(kArchive)) return decodeArray(bytes, limits);
    STX_TRY(const auto array, arrayIn(bytes, limits));
    if (!textIn(array).starts_with(kArray))
        return fail(ErrorCode::invalidInput,
                    "the .npz archive holds something that is not a NumPy array");
    return decodeArray(array, limits);
}

Bytes encodeNumpy(const Image<float>& values) {
    std::string head =
        fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}), }}",
                    values.height(), values.width());
    constexpr std::size_t kBefore = 10, kAligned = 64;  // as numpy.save() does
    head.append(kAligned - (kBefore + head.size() + 1) % kAligned, ' ');
    head += '\n';
    const auto length = head.size();
    head = std::string(kArray) + '\x01' + '\0' + static_cast<char>(length & 255) +
           static_cast<char>(length >> 8) + head;
    static_assert(std::endian::native == std::endian::little);
    Bytes out(head.size() + values.count() * sizeof(float));
    std::memcpy(out.data(), head.data(), head.size());
    std::memcpy(out.data() + head.size(), values.data(), values.count() * sizeof(float));
    return out;
}

}  // namespace stx
