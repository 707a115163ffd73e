#include <libheif/heif.h>

#include <string>
#include <vector>

#include "formats/decoders/decoder_module.hpp"
#include "formats/decoders/given_file.hpp"
#include "formats/images/picture_answer.hpp"
#include "lib/base/result.hpp"

/// The only file that knows libheif, which decodes with libde265.
namespace stx::heif {
namespace {

struct FreeContext {
    void operator()(heif_context* c) const { heif_context_free(c); }
};
struct FreeHandle {
    void operator()(heif_image_handle* h) const { heif_image_handle_release(h); }
};
struct FreeImage {
    void operator()(heif_image* i) const { heif_image_release(i); }
};

struct Failed {
    ErrorCode code;
    std::string message;
};

void check(const heif_error& error) {
    if (error.code == heif_error_Ok) return;
    if (error.code == heif_error_Memory_allocation_error) throw std::bad_alloc();
    const bool lacks = error.code == heif_error_Unsupported_filetype ||
                       error.code == heif_error_Unsupported_feature;
    throw Failed{lacks ? ErrorCode::unsupported : ErrorCode::invalidInput,
                 "libheif: " + std::string(error.message)};
}

/// The item of a file, as rows of one or three bytes a pixel.
void decode(std::span<const std::byte> file, std::uint32_t item, bool grey,
            codecs::PictureAnswer& answer) {
    const std::unique_ptr<heif_context, FreeContext> context(heif_context_alloc());
    if (!context) throw std::bad_alloc();
    heif_context_set_max_decoding_threads(context.get(), 0);  // none can be made here
    check(heif_context_read_from_memory_without_copy(context.get(), file.data(), file.size(),
                                                     nullptr));
    heif_image_handle* found = nullptr;
    check(heif_context_get_image_handle(context.get(), item, &found));
    const std::unique_ptr<heif_image_handle, FreeHandle> handle(found);
    decoders::PictureFacts facts;
    facts.width = facts.displayWidth = heif_image_handle_get_width(handle.get());
    facts.height = facts.displayHeight = heif_image_handle_get_height(handle.get());
    facts.channels = grey ? 1 : 3;
    facts.bits = 8;
    auto* to = static_cast<std::uint8_t*>(answer.begin(
        facts, grey ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"}));
    heif_image* decoded = nullptr;
    check(heif_decode_image(handle.get(), &decoded,
                            grey ? heif_colorspace_monochrome : heif_colorspace_RGB,
                            grey ? heif_chroma_monochrome : heif_chroma_interleaved_RGB, nullptr));
    const std::unique_ptr<heif_image, FreeImage> image(decoded);
    const auto channel = grey ? heif_channel_Y : heif_channel_interleaved;
    int stride = 0;
    const std::uint8_t* rows = heif_image_get_plane_readonly(image.get(), channel, &stride);
    if (!rows || heif_image_get_width(image.get(), channel) != facts.width ||
        heif_image_get_height(image.get(), channel) != facts.height ||
        heif_image_get_bits_per_pixel_range(image.get(), channel) != 8)
        throw Failed{ErrorCode::invalidInput, "the picture is not as its file says"};
    const std::size_t bytes = static_cast<std::size_t>(facts.width) * facts.channels;
    for (int y = 0; y < facts.height; ++y)
        std::memcpy(to + bytes * y, rows + static_cast<std::size_t>(stride) * y, bytes);
}

void prepare() {
    (void)heif_init(nullptr);
    (void)heif_have_decoder_for_format(heif_compression_HEVC);
}

void serve(int socket, int file) {
    using decoders::Tag;
    constexpr std::uint64_t kLargestRequest = 64;
    Tag tag{};
    std::vector<std::byte> request;
    const decoders::GivenFile given(socket, file);
    if (!decoders::receiveMessage(socket, tag, request, kLargestRequest, -1)) return;
    codecs::PictureAnswer answer(socket);
    try {
        decoders::Unpacker in(request);
        const auto item = in.get<std::uint32_t>();
        const bool grey = in.get<std::uint8_t>() != 0;
        if (tag != Tag::decodeItem || !given.there() || !in.ok())
            throw Failed{ErrorCode::failed, "the file did not come"};
        decode(given.bytes(), item, grey, answer);
        answer.end();
    } catch (const Failed& failed) {
        (void)decoders::sendFailure(socket, static_cast<int>(failed.code), failed.message);
    } catch (const std::bad_alloc&) {
        (void)decoders::sendFailure(socket, static_cast<int>(ErrorCode::failed),
                                    "there is not enough memory for the picture");
    } catch (const std::exception& e) {
        (void)decoders::sendFailure(socket, static_cast<int>(ErrorCode::invalidInput), e.what());
    }
}

const char* libraries() {
    static const std::string text = std::string("libheif ") + heif_get_version();
    return text.c_str();
}

}  // namespace
}  // namespace stx::heif

/// libheif asks libde265 for a thread, which cannot be made here, and would wait for it for ever:
/// without one it decodes by itself.
extern "C" __attribute__((visibility("default"))) int de265_start_worker_threads(void*, int) {
    return 0;
}

extern "C" __attribute__((visibility("default"))) const stx::decoders::Module* stxDecoder() {
    using namespace stx::heif;
    static const stx::decoders::Module module = {stx::decoders::kModuleVersion, libraries, prepare,
                                                 serve};
    return &module;
}
