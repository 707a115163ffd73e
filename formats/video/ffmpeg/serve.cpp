#include <optional>

#include "formats/decoders/decoder_module.hpp"
#include "formats/video/ffmpeg/encoder.hpp"
#include "formats/video/ffmpeg/film_reader.hpp"
#include "formats/video/ffmpeg/logged.hpp"
#include "formats/video/wire.hpp"

/// The entry of the module: requests come in, answers go out. Every error of libav* ends here.
namespace stx::video {
namespace {

/// A request has at most one access unit or one picture.
constexpr std::uint64_t kLargestRequest = 1ull << 32;

class Server {
  public:
    explicit Server(int file) : file_(file) {}

    struct Answer {
        Tag tag = Tag::done;
        std::vector<std::byte> bytes;
    };

    Answer answer(Tag tag, std::span<const std::byte> request) {
        Unpacker in(request);
        switch (tag) {
            case Tag::openFilm:
                film_.reset();
                film_ = std::make_unique<FilmReader>(file_, in.getText());
                return {Tag::film, film_->describe()};
            case Tag::selectTrack:
                film().select(in.get<std::int32_t>());
                return {};
            case Tag::readOn:
                return {Tag::index, film().readOn()};
            case Tag::seek: {
                const auto dts = in.get<std::int64_t>();
                film().seek(dts, in.get<std::int64_t>());
                return {};
            }
            case Tag::step: {
                const bool more = film().step(in.get<std::int64_t>());
                return ready(film().decoder(), !more);
            }
            case Tag::openStream: {
                const auto type = in.get<std::int32_t>();
                stream_.emplace(type, in.getBytes());
                return {};
            }
            case Tag::push:
                return push(in);
            case Tag::end:
                decoder().push(nullptr, in.get<std::int64_t>());
                return ready(decoder(), true);
            case Tag::flush:
                decoder().flush();
                return {};
            case Tag::take: {
                const AVFrame* frame = decoder().find(in.get<std::int64_t>());
                if (!frame) refuse(ErrorCode::failed, "the picture is not here any more");
                return {Tag::picture, packed(*frame, decoder().codec())};
            }
            case Tag::openEncoder: {
                encoders_.push_back(std::make_unique<Encoder>(in.get<EncoderRequest>()));
                Packer out;
                out.putBytes(encoders_.back()->configuration());
                return {Tag::encoder, std::move(out.bytes)};
            }
            case Tag::encode: {
                auto& encoder = encoderOf(in.get<std::int32_t>());
                const auto time = in.get<std::int64_t>();
                Packer out;
                encoder.encode(time, in.rest(), out);
                return {Tag::coded, std::move(out.bytes)};
            }
            case Tag::finishEncoder: {
                Packer out;
                encoderOf(in.get<std::int32_t>()).finish(out);
                return {Tag::coded, std::move(out.bytes)};
            }
            default:
                refuse(ErrorCode::failed, "an unknown request");
        }
    }

  private:
    FilmReader& film() {
        if (!film_) refuse(ErrorCode::failed, "no film is open");
        return *film_;
    }
    Decoder& decoder() {
        if (stream_) return *stream_;
        return film().decoder();
    }
    Encoder& encoderOf(std::int32_t number) {
        if (number < 0 || static_cast<std::size_t>(number) >= encoders_.size())
            refuse(ErrorCode::failed, "there is no encoder {}", number);
        return *encoders_[number];
    }
    Answer push(Unpacker& in) {
        const auto time = in.get<std::int64_t>();
        const auto wanted = in.get<std::int64_t>();
        const auto bytes = in.rest();
        const PacketPtr packet(av_packet_alloc());
        if (!packet || bytes.size() > INT32_MAX / 2 ||
            av_new_packet(packet.get(), static_cast<int>(bytes.size())) < 0)
            throw std::bad_alloc();
        std::memcpy(packet->data, bytes.data(), bytes.size());
        packet->pts = time;
        decoder().push(packet.get(), wanted);
        return ready(decoder(), false);
    }
    static Answer ready(const Decoder& decoder, bool ended) {
        Packer out;
        out.put(static_cast<std::uint8_t>(ended));
        for (const std::int64_t time : decoder.times()) out.put(time);
        return {Tag::ready, std::move(out.bytes)};
    }

    int file_;
    std::unique_ptr<FilmReader> film_;
    std::optional<Decoder> stream_;
    std::vector<std::unique_ptr<Encoder>> encoders_;
};

void serve(int socket, int file) {
    listenToErrors();
    Server server(file);
    Tag tag{};
    std::vector<std::byte> request;
    const auto failed = [&](ErrorCode code, std::string_view message) {
        return decoders::sendFailure(socket, static_cast<int>(code), message);
    };
    while (decoders::receiveMessage(socket, tag, request, kLargestRequest, -1)) {
        bool sent = false;
        try {
            const auto answer = server.answer(tag, request);
            sent = decoders::sendMessage(socket, answer.tag, answer.bytes);
        } catch (const Failed& error) {
            sent = failed(error.code, error.message);
        } catch (const std::bad_alloc&) {
            sent = failed(ErrorCode::failed, "there is not enough memory for the video");
        } catch (const std::exception& e) {
            sent = failed(ErrorCode::failed, e.what());
        }
        if (!sent) return;
    }
}

const char* libraries() {
    static const std::string text = [] {
        const auto of = [](const char* name, unsigned version) {
            return fmt::format("{} {}.{}.{}", name, AV_VERSION_MAJOR(version),
                               AV_VERSION_MINOR(version), AV_VERSION_MICRO(version));
        };
        return of("libavformat", avformat_version()) + ", " + of("libavcodec", avcodec_version());
    }();
    return text.c_str();
}

}  // namespace
}  // namespace stx::video

extern "C" __attribute__((visibility("default"))) const stx::decoders::Module* stxDecoder() {
    static const stx::decoders::Module module = {stx::decoders::kModuleVersion,
                                                 stx::video::libraries, nullptr, stx::video::serve};
    return &module;
}
