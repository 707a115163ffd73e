#include "formats/mpeg4/mapping/video_write.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace stx::mpeg4 {
namespace {

void put(Bytes& to, std::initializer_list<unsigned> values) {
    for (const unsigned v : values) to.push_back(static_cast<std::byte>(v));
}
void put16(Bytes& to, std::size_t v) {
    put(to, {static_cast<unsigned>(v >> 8) & 255, static_cast<unsigned>(v) & 255});
}
void put32(Bytes& to, std::size_t v) {
    put16(to, v >> 16 & 0xFFFF);
    put16(to, v & 0xFFFF);
}
void putText(Bytes& to, std::string_view text) {
    for (const char c : text) to.push_back(static_cast<std::byte>(c));
}

/// The units between the start codes (00 00 01) of a byte stream.
std::vector<ByteSpan> unitsOf(ByteSpan stream) {
    std::vector<ByteSpan> units;
    const auto isStart = [&](std::size_t i) {
        return stream[i] == std::byte{0} && stream[i + 1] == std::byte{0} &&
               stream[i + 2] == std::byte{1};
    };
    std::size_t begin = 0;
    bool inside = false;
    for (std::size_t i = 0; i + 3 <= stream.size(); ++i) {
        if (!isStart(i)) continue;
        if (inside) units.push_back(stream.subspan(begin, i - begin));
        begin = i + 3;
        inside = true;
        i += 2;
    }
    if (inside) units.push_back(stream.subspan(begin));
    for (ByteSpan& unit : units)
        while (!unit.empty() && unit.back() == std::byte{0}) unit = unit.first(unit.size() - 1);
    return units;
}

int nalTypeOf(ByteSpan unit) {
    return unit.empty() ? 0 : std::to_integer<int>(unit[0]) & 31;
}

/// VisualSampleEntry (ISO/IEC 14496-12, 12.1.3) with avcC and colr.
Bytes sampleEntryOf(int width, int height, bool grey, const Bytes& configuration) {
    Bytes body;
    put(body, {0, 0, 0, 0, 0, 0, 0, 1});
    body.resize(body.size() + 16);
    put16(body, static_cast<std::size_t>(width));
    put16(body, static_cast<std::size_t>(height));
    put32(body, 0x00480000);
    put32(body, 0x00480000);
    put32(body, 0);
    put16(body, 1);
    body.resize(body.size() + 32);
    put16(body, 0x18);
    put16(body, 0xFFFF);
    put32(body, 8 + configuration.size());
    putText(body, "avcC");
    body.insert(body.end(), configuration.begin(), configuration.end());
    // ISO/IEC 23091-2: BT.709 with sRGB's curve; 2 is "unspecified". The last bit is full range.
    put32(body, 19);
    putText(body, "colrnclx");
    put16(body, grey ? 2 : 1);
    put16(body, grey ? 2 : 13);
    put16(body, grey ? 2 : 1);
    put(body, {0x80});
    Bytes entry;
    put32(entry, 8 + body.size());
    putText(entry, "avc1");
    entry.insert(entry.end(), body.begin(), body.end());
    return entry;
}

}  // namespace

Bytes yuvPlanes(const Rgba8Image& picture) {
    constexpr double kR = 0.2126, kB = 0.0722, kG = 1 - kR - kB;
    const int w = picture.width(), h = picture.height();
    const auto byte = [](double v) {
        return static_cast<std::byte>(
            static_cast<std::uint8_t>(std::clamp(std::floor(v + 0.5), 0.0, 255.0)));
    };
    const bool whole = chromaFormatOf(w, h) == 3;
    const std::size_t pixels = static_cast<std::size_t>(w) * h;
    Bytes out(whole ? pixels * 3 : pixels * 3 / 2);
    Image<glm::vec2> chroma(w, h);
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            const glm::dvec3 c(picture.at(x, y));
            const double luma = kR * c.r + kG * c.g + kB * c.b;
            out[static_cast<std::size_t>(y) * w + x] = byte(luma);
            chroma.at(x, y) = {(c.b - luma) / (2 * (1 - kB)), (c.r - luma) / (2 * (1 - kR))};
        }
    }
    std::byte* cb = out.data() + pixels;
    std::byte* cr = cb + (whole ? pixels : pixels / 4);
    if (whole) {
        for (const glm::vec2 c : chroma.pixels()) {
            *cb++ = byte(c.x + 128);
            *cr++ = byte(c.y + 128);
        }
        return out;
    }
    for (int y = 0; y < h / 2; ++y) {
        for (int x = 0; x < w / 2; ++x) {
            glm::vec2 sum(0);
            for (const int row : {2 * y, 2 * y + 1})
                sum += chroma.at(std::max(2 * x - 1, 0), row) + 2.0f * chroma.at(2 * x, row) +
                       chroma.at(2 * x + 1, row);
            *cb++ = byte(sum.x / 8 + 128);
            *cr++ = byte(sum.y / 8 + 128);
        }
    }
    return out;
}

Result<Bytes> depthPlane(const Image<float>& depth, const DepthCode& code, const Padding& padding,
                         double& worst) {
    const int width = depth.width() + padding.left + padding.right;
    const int height = depth.height() + padding.top + padding.bottom;
    const std::size_t each = code.dmax > 255 ? 2 : 1;
    Bytes out(static_cast<std::size_t>(width) * height * each);
    worst = 0;
    for (int y = 0; y < depth.height(); ++y) {
        for (int x = 0; x < depth.width(); ++x) {
            const float dist = depth.at(x, y);
            if (!(dist >= 0)) return depthError(dist);
            if (!hasPoint(dist)) continue;
            const auto d = static_cast<std::uint16_t>(code.encode(dist));
            worst = std::max(worst, std::abs(code.decode(d) - dist));
            std::byte* to =
                &out[(static_cast<std::size_t>(y + padding.top) * width + x + padding.left) * each];
            if (each == 1)
                *to = static_cast<std::byte>(d);
            else
                std::memcpy(to, &d, 2);
        }
    }
    return out;
}

Result<Bytes> avcConfiguration(ByteSpan byteStream, int chromaFormat, int bits) {
    constexpr int kSequence = 7, kPicture = 8;
    ByteSpan sequence, picture;
    for (const ByteSpan unit : unitsOf(byteStream)) {
        if (nalTypeOf(unit) == kSequence) sequence = unit;
        if (nalTypeOf(unit) == kPicture) picture = unit;
    }
    if (sequence.size() < 4 || picture.empty())
        return fail(ErrorCode::failed, "the encoder gives no parameters of its stream");
    Bytes out;
    put(out, {1, std::to_integer<unsigned>(sequence[1]), std::to_integer<unsigned>(sequence[2]),
              std::to_integer<unsigned>(sequence[3]), 0xFF, 0xE1});
    put16(out, sequence.size());
    out.insert(out.end(), sequence.begin(), sequence.end());
    put(out, {1});
    put16(out, picture.size());
    out.insert(out.end(), picture.begin(), picture.end());
    const auto profile = std::to_integer<int>(sequence[1]);
    if (profile == 100 || profile == 110 || profile == 122 || profile == 244) {
        const unsigned more = static_cast<unsigned>(bits - 8);
        put(out, {0xFCu | static_cast<unsigned>(chromaFormat), 0xF8u | more, 0xF8u | more, 0});
    }
    return out;
}

Bytes withLengths(ByteSpan byteStream) {
    Bytes out;
    for (const ByteSpan unit : unitsOf(byteStream)) {
        put32(out, unit.size());
        out.insert(out.end(), unit.begin(), unit.end());
    }
    return out;
}

Result<int> VideoStreams::begin(ElementaryStream& stream, int width, int height, bool grey,
                                int bits) {
    if (!process_) STX_SET(process_, VideoProcess::start(limits_));
    video::EncoderRequest request;
    request.width = width;
    request.height = height;
    request.bits = bits;
    request.chromaFormat = grey ? 0 : chromaFormatOf(width, height);
    request.crf = grey ? -1 : crf_;
    request.timescale = stream.timescale;
    request.rate = rate_;
    video::Packer bytes;
    bytes.put(request);
    STX_TRY(const auto answer,
            process_->ask(video::Tag::openEncoder, bytes.bytes, video::Tag::encoder));
    video::Unpacker in(answer);
    STX_TRY(stream.decoderSpecificInfo,
            avcConfiguration(in.getBytes(), request.chromaFormat, bits));
    stream.sampleEntry = sampleEntryOf(width, height, grey, stream.decoderSpecificInfo);
    stream.objectTypeIndication = oti::kAvc;
    stream.width = width;
    stream.height = height;
    stream.samples.clear();
    if (const auto dot = stream.fileName.rfind('.'); dot != std::string::npos)
        stream.fileName = stream.fileName.substr(0, dot) + ".h264";
    streams_.push_back(&stream);
    return static_cast<int>(streams_.size()) - 1;
}

Result<void> VideoStreams::add(int number, std::uint64_t time, const Bytes& planes) {
    video::Packer request;
    request.put(static_cast<std::int32_t>(number));
    request.put(static_cast<std::int64_t>(time));
    request.add(planes.data(), planes.size());
    STX_TRY(const auto answer, process_->ask(video::Tag::encode, request.bytes, video::Tag::coded));
    return take(number, answer);
}

Result<void> VideoStreams::finish() {
    for (std::size_t i = 0; i < streams_.size(); ++i) {
        video::Packer request;
        request.put(static_cast<std::int32_t>(i));
        STX_TRY(const auto answer,
                process_->ask(video::Tag::finishEncoder, request.bytes, video::Tag::coded));
        STX_CHECK(take(static_cast<int>(i), answer));
    }
    return {};
}

Result<void> VideoStreams::take(int number, const Bytes& answer) {
    video::Unpacker in(answer);
    while (in.ok() && !in.rest().empty()) {
        Sample sample;
        sample.time = static_cast<std::uint64_t>(in.get<std::int64_t>());
        sample.sync = in.get<std::uint8_t>() != 0;
        STX_TRY(sample.data, keep_(withLengths(in.getBytes())));
        streams_[number]->samples.push_back(std::move(sample));
    }
    if (!in.ok()) return fail(ErrorCode::failed, "the encoder's answer makes no sense");
    return {};
}

}  // namespace stx::mpeg4
