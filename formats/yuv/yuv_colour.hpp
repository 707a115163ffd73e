#pragma once

namespace stx {

/// How pictures stored as Y, Cb, Cr become RGB.
struct YuvColour {
    bool bt601 = false;      ///< the matrix of BT.601 instead of BT.709
    bool fullRange = false;  ///< 0..255 instead of 16..235 (of 8 bits)
};

}  // namespace stx
