#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace stx::codecs {

/// A copy of a TIFF that OpenImageIO reads right; empty when it does already. Where the first
/// directory has no BitsPerSample it is 1 (TIFF 6.0, section 8), as in the masks of some programs,
/// but taken for 8: the tag is added. Deflate gets its other number (32946 for 8): it inflates the
/// first kind itself and goes on when that fails, while libtiff says so. Colours of a palette
/// become such that it does not make them one too dark.
[[nodiscard]] std::vector<std::byte> repairedTiff(std::span<const std::byte> file);

/// Whether a TIFF of strips that was just written has its end: the directory, which is written
/// last, and the last strip.
[[nodiscard]] bool endsWhole(const char* path);

/// Keeps the first error of libtiff while it lives, of any thread. One at a time.
class TiffErrors {
  public:
    TiffErrors();
    ~TiffErrors();
    TiffErrors(const TiffErrors&) = delete;
    TiffErrors& operator=(const TiffErrors&) = delete;
    /// Empty when there was none.
    [[nodiscard]] static const std::string& first();
};

}  // namespace stx::codecs
