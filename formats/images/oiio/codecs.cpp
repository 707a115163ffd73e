#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/decoders/decoder_module.hpp"
#include "formats/decoders/given_file.hpp"
#include "formats/images/codec_table.hpp"
#include "formats/images/exif.hpp"
#include "formats/images/oiio/bmp.hpp"
#include "formats/images/oiio/failed.hpp"
#include "formats/images/oiio/tiff.hpp"
#include "formats/images/oiio/tiff_strips.hpp"
#include "formats/images/oiio/webp.hpp"
#include "formats/images/picture_answer.hpp"
#include "lib/base/result.hpp"

/// The only file that knows OpenImageIO. Its exceptions and geterror() end here, in `adapt`.
namespace stx::codecs {

namespace {

/// What went wrong, in one line.
struct Reason {
    ErrorCode code = ErrorCode::failed;
    std::string message;
};

template <class Work>
std::optional<Reason> adapt(const Work& work) {
    const auto reason = [](ErrorCode code, std::string line) -> Reason {
        std::ranges::replace(line, '\n', ' ');
        std::ranges::replace(line, '\r', ' ');
        while (!line.empty() && (line.back() == ' ' || line.back() == '.')) line.pop_back();
        return {code, std::move(line)};
    };
    try {
        work();
        return {};
    } catch (const Failed& failed) {
        return reason(failed.code, failed.message);
    } catch (const std::bad_alloc&) {
        return reason(ErrorCode::failed, "there is not enough memory for the image");
    } catch (const std::exception& e) {
        return reason(ErrorCode::invalidInput, e.what());
    } catch (...) {
        return reason(ErrorCode::failed, "the image library failed without a reason");
    }
}

/// Our callers run many images at once; the library's own threads would only be in their way.
void setUpOnce() {
    static std::once_flag once;
    std::call_once(once, [] {
        OIIO::attribute("threads", 1);
        OIIO::attribute("use_tbb", 0);
    });
}

/// The format by its first bytes, since names lie; "" when these say nothing.
const char* formatByContent(std::string_view head) {
    using namespace std::string_view_literals;
    struct Magic {
        std::string_view start;
        const char* format;
    };
    static constexpr Magic kMagics[] = {
        {"II*\0"sv, "tiff"}, {"MM\0*"sv, "tiff"}, {"BM"sv, "bmp"},
        {"GIF8"sv, "gif"},   {"#?"sv, "hdr"},     {"8BPS"sv, "psd"},
        {"DDS "sv, "dds"},   {"SDPX"sv, "dpx"},   {"XPDS"sv, "dpx"},
    };
    for (const auto& magic : kMagics) {
        if (head.starts_with(magic.start)) return magic.format;
    }
    if (head.starts_with("RIFF") && head.size() >= 12 && head.substr(8, 4) == "WEBP") return "webp";
    return "";
}

/// Formats without telling first bytes. The library has more, which make pictures out of nothing
/// but the name, or read films.
std::string formatByEnding(std::string_view ending) {
    std::string lower(ending);
    for (char& c : lower) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    struct Ending {
        std::string_view ending;
        const char* format;
    };
    static constexpr Ending kEndings[] = {
        {"tga", "targa"},    {"tpic", "targa"},   {"pfm", "pnm"},      {"jp2", "jpeg2000"},
        {"j2k", "jpeg2000"}, {"j2c", "jpeg2000"}, {"jpc", "jpeg2000"}, {"sgi", "sgi"},
        {"rgb", "sgi"},      {"rgba", "sgi"},     {"bw", "sgi"},       {"int", "sgi"},
    };
    for (const auto& known : kEndings) {
        if (lower == known.ending) return known.format;
    }
    return {};
}

[[noreturn]] void failWith(const std::string& reason, const char* otherwise) {
    throw Failed{ErrorCode::invalidInput, reason.empty() ? otherwise : reason};
}

/// The library's name of what the file is, by its first bytes or else by the ending of its name.
std::string formatOf(std::string_view head, std::string_view name) {
    std::string format = formatByContent(head);
    if (format.empty()) {
        const auto dot = name.rfind('.');
        if (dot != std::string_view::npos) format = formatByEnding(name.substr(dot + 1));
    }
    if (format.empty())
        throw Failed{ErrorCode::invalidInput,
                     "it is not an image of a known kind (PNG, JPEG, TIFF, BMP, "
                     "TGA, HDR, WebP, GIF, PSD, PNM, DDS, JPEG 2000, SGI)"};
    return format;
}

/// How the values are given: 8 or 16 bits where all channels have them, else floats.
OIIO::TypeDesc typeOfValues(const OIIO::ImageSpec& spec) {
    const auto same = [&](const OIIO::TypeDesc& channel) { return channel == spec.format; };
    const bool integers =
        spec.format == OIIO::TypeDesc::UINT8 || spec.format == OIIO::TypeDesc::UINT16;
    return integers && std::ranges::all_of(spec.channelformats, same) ? spec.format
                                                                      : OIIO::TypeDesc::FLOAT;
}

/// Whether colours hold the alpha, as a TIFF does that does not say otherwise. TGA and DDS have a
/// place to say so; the alpha of all others is straight.
bool isPremultiplied(const OIIO::ImageSpec& spec, const std::string& format) {
    if (spec.alpha_channel < 0) return false;
    const std::string_view compression = spec.get_string_attribute("compression");
    if (format == "dds") return compression == "DXT2" || compression == "DXT4";
    constexpr int kTgaPremultiplied = 4;
    if (format == "targa") return spec.get_int_attribute("targa:alpha_type") == kTgaPremultiplied;
    return format == "tiff" && spec.get_int_attribute("oiio:UnassociatedAlpha") == 0;
}

/// The largest integer that the file can have, where the library stretches it to another; else 0.
double storedLargestOf(const OIIO::ImageSpec& spec, const std::string& format) {
    const OIIO::TypeDesc& type = spec.format;
    if (type.is_floating_point()) return 0;
    const int whole = static_cast<int>(8 * type.size());
    // Others mean bits of a pixel by this, or those of a palette's index.
    constexpr int kPalette = 3;
    const bool known = (format == "tiff" || format == "jpeg2000" || format == "dpx") &&
                       spec.get_int_attribute("tiff:PhotometricInterpretation") != kPalette;
    const int bits = known ? spec.get_int_attribute("oiio:BitsPerSample", whole) : whole;
    if (!type.is_signed() && bits == whole && whole <= 16) return 0;
    return std::ldexp(1.0, type.is_signed() ? bits - 1 : bits) - 1;
}

decoders::PictureFacts factsOf(const OIIO::ImageSpec& spec, const std::string& format, int bits) {
    decoders::PictureFacts facts;
    facts.bits = bits;
    facts.width = spec.width;
    facts.height = spec.height;
    facts.channels = spec.nchannels;
    facts.originX = spec.x - spec.full_x;
    facts.originY = spec.y - spec.full_y;
    facts.displayWidth = spec.full_width;
    facts.displayHeight = spec.full_height;
    facts.linear = spec.format.is_floating_point();
    facts.premultiplied = isPremultiplied(spec, format);
    facts.storedLargest = storedLargestOf(spec, format);
    return facts;
}

/// White is 0 in a TIFF of PhotometricInterpretation 0 (TIFF 6.0, section 4): its first sample is
/// white less the value, those beside it (ExtraSamples) are themselves. The library turns all of
/// them when they have up to 8 bits, and none when they have more.
void turnWhiteIsZero(const OIIO::ImageSpec& spec, const OIIO::TypeDesc& type, void* values) {
    constexpr int kWhiteIsZero = 0;
    if (spec.get_int_attribute("tiff:PhotometricInterpretation", -1) != kWhiteIsZero) return;
    const std::size_t samples = static_cast<std::size_t>(spec.nchannels);
    const std::size_t count = static_cast<std::size_t>(spec.image_pixels()) * samples;
    const auto turn = [&](auto* at, auto white, bool first) {
        for (std::size_t i = 0; i < count; ++i)
            if ((i % samples == 0) == first)
                at[i] = static_cast<std::remove_pointer_t<decltype(at)>>(white - at[i]);
    };
    if (type == OIIO::TypeDesc::UINT8)
        turn(static_cast<std::uint8_t*>(values), 255, false);
    else if (type == OIIO::TypeDesc::UINT16)
        turn(static_cast<std::uint16_t*>(values), 65535, true);
    else if (spec.format == OIIO::TypeDesc::UINT32)  // as floats of 0 to 1
        turn(static_cast<float*>(values), 1.0f, true);
}

/// Radiance's resolution line says where rows begin, and whether they are columns; the library
/// gives that as an orientation of EXIF and leaves the pixels as they are stored. Its 6 is +X +Y
/// (columns from the left, each from below) and its 8 is -X -Y, which EXIF counts the other way.
int orientationOf(const OIIO::ImageSpec& spec, const std::string& format) {
    if (format != "hdr") return 1;
    const int orientation = spec.get_int_attribute("Orientation", 1);
    return orientation == 6 ? 8 : orientation == 8 ? 6 : orientation;
}

/// Bytes of the file, of which some that were asked for are not there.
class Source : public OIIO::Filesystem::IOMemReader {
  public:
    using IOMemReader::IOMemReader;
    std::size_t pread(void* to, std::size_t size, std::int64_t offset) override {
        const std::size_t got = IOMemReader::pread(to, size, offset);
        ranOut_ = ranOut_ || got < size;
        return got;
    }
    [[nodiscard]] bool ranOut() const { return ranOut_; }

  private:
    bool ranOut_ = false;
};

/// The library takes grey of a DDS for a part of a colour.
void refuseGreyDds(std::span<const std::byte> file) {
    constexpr std::size_t kPixelFlags = 80;
    constexpr unsigned kAlphaAlone = 2, kLuminance = 0x20000;
    unsigned flags = 0;
    for (std::size_t i = 0; i < 4 && kPixelFlags + i < file.size(); ++i)
        flags |= std::to_integer<unsigned>(file[kPixelFlags + i]) << (8 * i);
    if ((flags & (kAlphaAlone | kLuminance)) != 0)
        throw Failed{ErrorCode::unsupported,
                     "DDS of grey alone is not read; save it as PNG, or as DDS with colours"};
}

/// Of a DDS the library paints black what is not there, of a TIFF what it cannot decode, and says
/// nothing. `bytes`, of which `end` are in the file, are what it has read; TiffErrors are kept.
void refuseDamage(const std::string& format, const Source& source, std::span<const std::byte> bytes,
                  std::size_t end) {
    if (format == "dds" && source.ranOut())
        throw Failed{ErrorCode::invalidInput, "the DDS is cut off"};
    std::string damage = TiffErrors::first();
    if (damage.empty() && format == "tiff") damage = damageOfStrips(bytes, end);
    if (!damage.empty()) throw Failed{ErrorCode::invalidInput, "the TIFF is damaged: " + damage};
}

using HdrPixel = std::array<float, 3>;

/// `fileName`: what the file can be opened by, for formats that the library reads by name only.
void decodeOrThrow(std::span<const std::byte> file, std::string_view name,
                   const std::string& fileName, PictureAnswer& answer) {
    const std::string_view head(reinterpret_cast<const char*>(file.data()),
                                std::min<std::size_t>(file.size(), 16));
    if (formatByContent(head) == std::string_view("webp") && decodeWebp(file, answer)) return;
    setUpOnce();
    const std::string format = formatOf(head, name);

    OIIO::ImageSpec config;
    // Alpha and colour as the file stores them: no multiplying, no dividing.
    config.attribute("oiio:UnassociatedAlpha", 1);
    auto input = OIIO::ImageInput::create(format, false, &config);
    if (!input) {
        (void)OIIO::geterror();
        throw Failed{ErrorCode::invalidInput,
                     fmt::format("it is not an image of a known kind ('{}')", format)};
    }
    const auto repaired = format == "tiff" ? repairedTiff(file) : std::vector<std::byte>();
    const std::span bytes = repaired.empty() ? file : std::span<const std::byte>(repaired);
    Source reader(const_cast<std::byte*>(bytes.data()), bytes.size());
    if (format == "dds") refuseGreyDds(file);
    OIIO::ImageSpec spec;
    bool opened = false;
    if (input->supports("ioproxy")) {
        void* proxy = &reader;
        config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
        opened = input->open("image." + format, spec, config);
    } else {
        opened = input->open(fileName, spec, config);
    }
    if (!opened) failWith(input->geterror(), "the image cannot be opened");
    if (spec.deep) throw Failed{ErrorCode::unsupported, "deep images are not supported"};

    std::vector<std::string> names = spec.channelnames;
    names.resize(static_cast<std::size_t>(std::max(spec.nchannels, 0)));

    const OIIO::TypeDesc type = typeOfValues(spec);
    decoders::PictureFacts header = factsOf(spec, format, static_cast<int>(8 * type.size()));
    const BmpPixel pixel =
        format == "bmp" && spec.nchannels == 4 && header.bits == 8 ? bmpPixelOf(file) : BmpPixel{};
    if (pixel.channels != 0) header.channels = pixel.channels;
    if (spec.depth > 1) throw Failed{ErrorCode::unsupported, "volume images are not supported"};

    const int orientation = orientationOf(spec, format);
    Image<HdrPixel> turned;
    if (orientation != 1) {
        if (type != OIIO::TypeDesc::FLOAT || spec.nchannels != 3)
            throw Failed{ErrorCode::unsupported, "its values are no RGBE"};
        turned = Image<HdrPixel>(spec.width, spec.height);
        if (orientation >= 5) {
            std::swap(header.width, header.height);
            std::swap(header.displayWidth, header.displayHeight);
        }
    }

    void* values = answer.begin(header, names);
    std::vector<std::uint8_t> whole;  // all four bytes of a BMP's pixels
    if (pixel.channels != 0)
        whole.resize(static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height) *
                     4);
    const TiffErrors tiffErrors;
    void* const stored = !turned.empty() ? turned.data() : whole.empty() ? values : whole.data();
    if (!input->read_image(0, 0, 0, spec.nchannels, type, stored))
        failWith(input->geterror(), "the pixels cannot be decoded");
    refuseDamage(format, reader, bytes, file.size());
    if (!turned.empty()) {
        turned = turnedUpright(std::move(turned), orientation);
        std::ranges::copy(turned.pixels(), static_cast<HdrPixel*>(values));
    }
    input->close();
    if (format == "tiff") turnWhiteIsZero(spec, type, values);
    if (!whole.empty()) pixel.take(whole, static_cast<std::uint8_t*>(values));
}

void encodeOrThrow(const EncodeRequest& request) {
    if (std::string_view(request.format) == "webp") return encodeWebp(request);
    setUpOnce();
    const auto output = OIIO::ImageOutput::create(request.format);
    if (!output) throw Failed{ErrorCode::unsupported, OIIO::geterror()};
    OIIO::ImageSpec spec(request.width, request.height, request.channels, OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:ColorSpace", "sRGB");
    // The values are straight, and the file says so.
    spec.attribute("oiio:UnassociatedAlpha", 1);
    spec.attribute("compression", "zip");
    spec.attribute("DateTime", request.date);
    if (!output->open(request.path, spec)) cannotWrite(output->geterror());
    if (!output->write_image(OIIO::TypeDesc::UINT8, request.values) || !output->close())
        cannotWrite(output->geterror());
    // close() is true whatever becomes of the last strip and the directory, which are written then.
    if (!endsWhole(request.path)) cannotWrite("it is not whole; is the disk full?");
}

/// Loads what the library looks for when its first file comes.
void prepare() {
    setUpOnce();
    (void)OIIO::ImageInput::create("tiff", false);
}

void serve(int socket, int file) {
    using decoders::Tag;
    constexpr std::uint64_t kLargestRequest = 1 << 20;
    Tag tag{};
    std::vector<std::byte> request;
    const decoders::GivenFile given(socket, file);
    if (!decoders::receiveMessage(socket, tag, request, kLargestRequest, -1)) return;
    PictureAnswer answer(socket);
    const auto failed = adapt([&] {
        if (tag != Tag::decodePicture || !given.there())
            throw Failed{ErrorCode::failed, "the file did not come"};
        const std::string name = decoders::Unpacker(request).getText();
        decodeOrThrow(given.bytes(), name, fmt::format("/proc/self/fd/{}", file), answer);
    });
    if (failed)
        (void)decoders::sendFailure(socket, static_cast<int>(failed->code), failed->message);
    else
        answer.end();
}

bool encode(const EncodeRequest& request, Failure& failure) {
    const auto failed = adapt([&] { encodeOrThrow(request); });
    if (!failed) return true;
    failure.code = static_cast<int>(failed->code);
    failed->message.copy(failure.message, sizeof(failure.message) - 1);
    return false;
}

const char* libraries() {
    static const std::string text = fmt::format("OpenImageIO {}", OIIO_VERSION_STRING);
    return text.c_str();
}

}  // namespace

}  // namespace stx::codecs

extern "C" __attribute__((visibility("default"))) const stx::codecs::Table* stxCodecs() {
    static const stx::codecs::Table table = {stx::codecs::kTableVersion, stx::codecs::encode};
    return &table;
}

extern "C" __attribute__((visibility("default"))) const stx::decoders::Module* stxDecoder() {
    using namespace stx::codecs;
    static const stx::decoders::Module module = {stx::decoders::kModuleVersion, libraries, prepare,
                                                 serve};
    return &module;
}
