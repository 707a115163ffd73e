// EXIF of pictures: any bytes give an orientation that there is, and a focal length or none.

#include <cmath>

#include "formats/images/exif.hpp"
#include "formats/images/more_pictures.hpp"
#include "lib/model/texture.hpp"
#include "tests/fuzz/violated.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const ByteSpan file{reinterpret_cast<const std::byte*>(data), size};
    (void)holdsMorePictures(file);
    const glm::ivec2 stored = storedSizeOfTiff(file);
    if (stored.x < 0 || stored.y < 0) violated("sides are 0 or more");
    const ExifNotes notes = readExif(file);
    if (notes.orientation < 1 || notes.orientation > 8) violated("an orientation is 1 to 8");
    if (!std::isfinite(notes.focal35) || notes.focal35 < 0) violated("a focal length is 0 or more");
    const Rgba8Image turned = turnedUpright(Rgba8Image(3, 2), notes.orientation);
    if (turned.count() != 6) violated("turning keeps all pixels");
    return 0;
}
