#include <csetjmp>
#include <cstdio>  // before jpeglib.h, which uses FILE
#include <cstdlib>

#include <jpeglib.h>

#include <jerror.h>  // behind jpeglib.h, which says whether there are arithmetic codes

#include <array>
#include <string>

#include "formats/images/reader.hpp"

namespace stx {

namespace {

/// libjpeg's fatal errors must not return. They jump to `escape`, so between setjmp() and the calls
/// of the library there are no objects with destructors: each such function below holds nothing but
/// pointers and numbers.
struct Errors {
    jpeg_error_mgr base;  ///< the first member, which the library points to
    std::jmp_buf escape;
    bool ranOut = false;                ///< the bytes ended before the end marker
    bool bitsLack = false;              ///< a scan asked for bits that are not there
    bool watching = false;              ///< from the first scan on: what is damaged now is pixels
    char damage[JMSG_LENGTH_MAX] = {};  ///< the first of what the library warned of; "" = nothing

    static Errors& of(j_common_ptr info) { return *reinterpret_cast<Errors*>(info->err); }

    jpeg_error_mgr* prepare() {
        jpeg_std_error(&base);
        base.error_exit = [](j_common_ptr info) { std::longjmp(of(info).escape, 1); };
        base.output_message = [](j_common_ptr) {};
        base.emit_message = [](j_common_ptr info, int level) {
            if (level < 0) of(info).warn(info);
        };
        return &base;
    }
    /// The library paints over what it cannot decode, and warns.
    void warn(j_common_ptr info) {
        // Some cameras pad with a few bytes before a marker.
        constexpr int kPadding = 4;
        const int code = base.msg_code;
        if (code == JWRN_HIT_MARKER) bitsLack = true;
        const bool spoils = code == JWRN_HIT_MARKER || code == JWRN_HUFF_BAD_CODE ||
                            code == JWRN_ARITH_BAD_CODE || code == JWRN_BOGUS_PROGRESSION ||
                            code == JWRN_MUST_RESYNC ||
                            (code == JWRN_EXTRANEOUS_DATA && base.msg_parm.i[0] > kPadding);
        if (watching && spoils && damage[0] == 0) base.format_message(info, damage);
    }
    /// The error that the library jumped out with.
    template <class Info>
    [[nodiscard]] std::string message(Info& info) {
        std::array<char, JMSG_LENGTH_MAX> text{};
        base.format_message(reinterpret_cast<j_common_ptr>(&info), text.data());
        return text.data();
    }
    [[nodiscard]] ErrorCode code() const {
        return base.msg_code == JERR_OUT_OF_MEMORY ? ErrorCode::failed : ErrorCode::invalidInput;
    }
};

/// Files of more scans than any encoder writes keep a decoder busy for hours (libjpeg-turbo's notes
/// on progressive files of hostile origin).
constexpr int kMaxScans = 100;

class JpegReader final : public ImageReader {
  public:
    JpegReader(ByteSpan file, bool keepsDamaged) : file_(file), keepsDamaged_(keepsDamaged) {
        info_.format = "jpeg";
    }
    ~JpegReader() override { jpeg_destroy_decompress(&jpeg_); }
    JpegReader(const JpegReader&) = delete;
    JpegReader& operator=(const JpegReader&) = delete;

    Result<void> open(const Limits& limits) {
        if (!readHeader())
            return fail(errors_.code(), "the JPEG's header is damaged: {}", errors_.message(jpeg_));
        cmyk_ = jpeg_.out_color_space == JCS_CMYK;
        info_.width = static_cast<int>(jpeg_.image_width);
        info_.height = static_cast<int>(jpeg_.image_height);
        info_.channels = cmyk_ ? 3 : jpeg_.num_components;
        info_.bits = 8;
        if (!jpeg_has_multiple_scans(&jpeg_)) return {};
        // The library holds all coefficients of these until the last scan.
        std::uint64_t blocks = 0;
        for (int i = 0; i < jpeg_.num_components; ++i) {
            const auto& component = jpeg_.comp_info[i];
            blocks += std::uint64_t{component.width_in_blocks} * component.height_in_blocks;
        }
        return limits.checkAllocation(blocks, sizeof(JBLOCK), "the JPEG's coefficients");
    }

    Result<void> read(void* values) override {
        return checked(readRows(static_cast<JSAMPLE*>(values), info_.channels) && readToEnd());
    }

    [[nodiscard]] bool givesRgba8() const override {
        return !cmyk_ && (info_.channels == 1 || info_.channels == 3);
    }
    Result<void> readRgba8(glm::u8vec4* pixels) override {
        jpeg_.out_color_space = JCS_EXT_RGBA;
        return checked(readRows(&pixels->r, 4) && readToEnd());
    }

  private:
    bool readHeader() {
        jpeg_.err = errors_.prepare();
        if (setjmp(errors_.escape)) return false;
        jpeg_create_decompress(&jpeg_);
        jpeg_.client_data = this;
        source_.init_source = source_.term_source = [](j_decompress_ptr) {};
        source_.fill_input_buffer = [](j_decompress_ptr info) -> boolean {
            // An end marker for a file without one; whether pixels lack shows when bits do.
            static constexpr JOCTET kEnd[] = {0xff, JPEG_EOI};
            self(info).errors_.ranOut = true;
            info->src->next_input_byte = kEnd;
            info->src->bytes_in_buffer = sizeof(kEnd);
            return TRUE;
        };
        source_.skip_input_data = [](j_decompress_ptr info, long count) {
            if (count <= 0) return;
            auto* source = info->src;
            if (static_cast<std::size_t>(count) > source->bytes_in_buffer) {
                source->fill_input_buffer(info);
                return;
            }
            source->next_input_byte += count;
            source->bytes_in_buffer -= static_cast<std::size_t>(count);
        };
        source_.resync_to_restart = jpeg_resync_to_restart;
        source_.next_input_byte = reinterpret_cast<const JOCTET*>(file_.data());
        source_.bytes_in_buffer = file_.size();
        jpeg_.src = &source_;
        progress_.progress_monitor = [](j_common_ptr info) {
            const auto* jpeg = reinterpret_cast<j_decompress_ptr>(info);
            if (jpeg->input_scan_number > kMaxScans) self(jpeg).tooManyScans();
        };
        jpeg_.progress = &progress_;
        jpeg_read_header(&jpeg_, TRUE);
        return true;
    }

    /// `step` bytes a pixel; CMYK is made RGB.
    bool readRows(JSAMPLE* to, int step) {
        if (setjmp(errors_.escape)) return false;
        errors_.watching = true;
        jpeg_start_decompress(&jpeg_);
        const std::size_t rowBytes = std::size_t{jpeg_.output_width} * step;
        JSAMPROW inks = nullptr;
        if (cmyk_)
            inks = *jpeg_.mem->alloc_sarray(reinterpret_cast<j_common_ptr>(&jpeg_), JPOOL_IMAGE,
                                            jpeg_.output_width * 4, 1);
        while (jpeg_.output_scanline < jpeg_.output_height) {
            JSAMPROW row = to + jpeg_.output_scanline * rowBytes;
            if (!cmyk_) {
                jpeg_read_scanlines(&jpeg_, &row, 1);
                continue;
            }
            jpeg_read_scanlines(&jpeg_, &inks, 1);
            // Files hold the inks inverted, as Adobe's programs write them: 255 is none.
            for (JDIMENSION x = 0; x < jpeg_.output_width; ++x) {
                for (int c = 0; c < 3; ++c)
                    row[x * 3 + c] =
                        static_cast<JSAMPLE>((inks[x * 4 + c] * inks[x * 4 + 3] + 127) / 255);
            }
        }
        return true;
    }

    /// What follows the last row shows whether it was the last: scans that are left over, data that
    /// no pixel needed.
    bool readToEnd() {
        hasRows_ = true;
        for (int i = 0; i < jpeg_.num_components; ++i) {
            // No scan of it came, or, of a progressive file, not all of its bits (coef_bits).
            bool came = jpeg_.comp_info[i].quant_table != nullptr;
            for (int k = 0; jpeg_.coef_bits && k < DCTSIZE2; ++k)
                came = came && jpeg_.coef_bits[i][k] == 0;
            scansLack_ = scansLack_ || !came;
        }
        if (setjmp(errors_.escape)) return false;
        jpeg_finish_decompress(&jpeg_);
        return true;
    }

    Result<void> checked(bool done) {
        if (scansTooMany_)
            return fail(ErrorCode::invalidInput, "the JPEG has more than {} scans", kMaxScans);
        std::string damage = errors_.damage;
        if (!done && damage.empty()) damage = errors_.message(jpeg_);
        if (damage.empty() && scansLack_) damage = "scans are missing";
        // Arithmetic decoding takes what lacks for zeros and says nothing.
        if (errors_.ranOut && (!hasRows_ || errors_.bitsLack || scansLack_ || jpeg_.arith_code))
            damage = fmt::format("it ends at byte {} before its last pixels", file_.size());
        if (damage.empty()) return {};
        if (!hasRows_ && errors_.code() == ErrorCode::failed)
            return fail(ErrorCode::failed, "the JPEG cannot be decoded: {}", damage);
        if (hasRows_ && keepsDamaged_) {
            damage_ = fmt::format("the JPEG is damaged ({}) and drawn as far as it goes", damage);
            return {};
        }
        if (errors_.ranOut && damage.starts_with("it ends"))
            return fail(ErrorCode::invalidInput,
                        "the JPEG ends at byte {} before its last pixels; it is cut off",
                        file_.size());
        return fail(ErrorCode::invalidInput, "the JPEG is damaged: {}", damage);
    }

    template <class Info>
    static JpegReader& self(Info* info) {
        return *static_cast<JpegReader*>(info->client_data);
    }
    [[noreturn]] void tooManyScans() {
        scansTooMany_ = true;
        std::longjmp(errors_.escape, 1);
    }

    ByteSpan file_;
    bool keepsDamaged_;
    bool cmyk_ = false;
    bool hasRows_ = false;  ///< all rows were decoded, though perhaps painted over
    bool scansLack_ = false;
    bool scansTooMany_ = false;
    Errors errors_{};
    jpeg_source_mgr source_{};
    jpeg_progress_mgr progress_{};
    jpeg_decompress_struct jpeg_{};
};

/// Encodes into memory of malloc(), which `bytes` points to, also after a failure.
bool encodeRows(jpeg_compress_struct& jpeg, Errors& errors, int width, int height, int channels,
                const JSAMPLE* values, int quality, unsigned char*& bytes, unsigned long& size) {
    jpeg.err = errors.prepare();
    if (setjmp(errors.escape)) return false;
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, &bytes, &size);
    jpeg.image_width = static_cast<JDIMENSION>(width);
    jpeg.image_height = static_cast<JDIMENSION>(height);
    jpeg.input_components = channels;
    jpeg.in_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, quality, TRUE);
    if (channels == 3) {
        const int each = quality >= 90 ? 1 : 2;
        jpeg.comp_info[0].h_samp_factor = jpeg.comp_info[0].v_samp_factor = each;
    }
    jpeg_start_compress(&jpeg, TRUE);
    const std::size_t rowBytes = static_cast<std::size_t>(width) * channels;
    while (jpeg.next_scanline < jpeg.image_height) {
        auto row = const_cast<JSAMPROW>(values + jpeg.next_scanline * rowBytes);
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    return true;
}

}  // namespace

Result<std::unique_ptr<ImageReader>> openJpeg(ByteSpan bytes, const Limits& limits) {
    auto reader = std::make_unique<JpegReader>(bytes, limits.keepDamaged != nullptr);
    STX_CHECK(reader->open(limits));
    return reader;
}

Result<Bytes> encodeJpeg(int width, int height, int channels, const std::uint8_t* values,
                         int quality) {
    STX_CHECK(checkEncodable(width, height, "JPEG"));
    if ((channels != 1 && channels != 3) || quality < 1 || quality > 100)
        return fail(ErrorCode::failed,
                    "cannot encode a JPEG of {} channels at quality {}; 1 or 3 at 1 to 100 is "
                    "possible",
                    channels, quality);
    struct Encoder {
        Errors errors{};
        jpeg_compress_struct jpeg{};
        unsigned char* bytes = nullptr;
        unsigned long size = 0;
        ~Encoder() {
            jpeg_destroy_compress(&jpeg);
            std::free(bytes);
        }
    } encoder;
    if (!encodeRows(encoder.jpeg, encoder.errors, width, height, channels, values, quality,
                    encoder.bytes, encoder.size))
        return fail(ErrorCode::failed, "cannot encode a JPEG of {}x{} pixels: {}", width, height,
                    encoder.errors.message(encoder.jpeg));
    const auto* first = reinterpret_cast<const std::byte*>(encoder.bytes);
    return Bytes(first, first + encoder.size);
}

}  // namespace stx
