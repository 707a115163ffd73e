#pragma once

#include <vector>

#include "lib/model/mesh.hpp"

namespace stx {

/// A base colour texture whose alpha comes from another texture (map_d): the colours of
/// `textures[base]`, or white where base is -1, with `textures[alpha]` as alpha: its alpha channel
/// when it has one that varies, else its grey, or the channel that MTL's -imfchan names: r, g, b,
/// m (alpha) or l (grey); other letters choose none. As large as the base, or as the map. Returns
/// the index of the new texture, which samples as the base (the map) does.
int textureWithAlpha(std::vector<MeshTexture>& textures, int base, int alpha, char channel = 0);

}  // namespace stx
