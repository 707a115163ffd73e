#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

/// What reading and writing SPZ share (github.com/nianticlabs/spz, versions 2 and 3): a gzip file
/// of a header and of each attribute of all splats, little-endian.
namespace stx::spz {

inline constexpr std::uint32_t kMagic = 0x5053474e;  // "NGSP"
inline constexpr std::size_t kHeaderBytes = 16;
inline constexpr int kFixedBits = 24;  ///< of a coordinate, with its sign
/// A colour's coefficient of degree 0 takes this share of the byte's range.
inline constexpr float kColourScale = 0.15f;
inline constexpr double kDegree0 = 0.28209479177387814;
/// Of the three smaller numbers of a unit quaternion.
inline constexpr double kMostOfSmall = std::numbers::sqrt2 / 2;
inline constexpr std::uint32_t kMagnitude = 511;  ///< 9 bits, a sign above them

}  // namespace stx::spz
