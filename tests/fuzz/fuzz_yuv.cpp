// Raw planes of YUV: four bytes say what they are (bits, chroma, width, height), the rest is a
// frame.

#include <array>

#include "formats/yuv/yuv.hpp"
#include "tests/fuzz/violated.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 4) return 0;
    constexpr std::array kNames = {"yuv420p",     "yuv420p10le", "yuv422p", "yuv444p16le",
                                   "yuv422p12le", "yuv400p",     "gray",    "gray16le"};
    auto format = yuvFormatNamed(kNames[data[0] % kNames.size()]);
    if (!format) violated("names that are documented are known", kNames[data[0] % kNames.size()]);
    format->chromaLeft = (data[0] & 0x80) != 0;
    format->width = 1 + data[2] % 64;
    format->height = 1 + data[3] % 64;
    // Whole frames only are asked for: what lacks is zeros.
    std::vector<std::byte> frame(format->frameBytes());
    for (std::size_t i = 0; i < frame.size() && 4 + i < size; ++i)
        frame[i] = static_cast<std::byte>(data[4 + i]);
    Limits limits;
    const YuvColour colour;
    const auto picture = rgbFromYuv(frame, *format, colour, "fuzz", limits);
    if (!picture) {
        if (picture.error().message.empty()) violated("an error has a message");
        return 0;
    }
    if (picture->width() != format->width || picture->height() != format->height)
        violated("a frame has its size");
    return 0;
}
