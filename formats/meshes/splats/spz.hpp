#pragma once

#include <cstddef>
#include <cstdint>
#include <numbers>

/// What reading and writing SPZ share (github.com/nianticlabs/spz), little-endian: versions 2 and 3
/// are a gzip file of a header and of each attribute of all splats; version 4 has a longer header,
/// a table and each attribute as zstd of its own, coded as in version 3.
namespace stx::spz {

inline constexpr std::uint32_t kMagic = 0x5053474e;  // "NGSP"
inline constexpr std::size_t kHeaderBytes = 16;
/// Of version 4; and of an entry of its table, the sizes of a stream packed and unpacked.
inline constexpr std::size_t kLongHeaderBytes = 32, kEntryBytes = 16;
/// Flags of the header.
inline constexpr std::uint32_t kAntialiased = 1, kExtensions = 2;
inline constexpr int kFixedBits = 24;  ///< of a coordinate, with its sign
/// Bytes that one byte of zstd holds at most: a block of 128 KiB takes four.
inline constexpr std::uint64_t kMostOfZstd = 32768;
/// A colour's coefficient of degree 0 takes this share of the byte's range.
inline constexpr float kColourScale = 0.15f;
inline constexpr double kDegree0 = 0.28209479177387814;
/// Of the three smaller numbers of a unit quaternion.
inline constexpr double kMostOfSmall = std::numbers::sqrt2 / 2;
inline constexpr std::uint32_t kMagnitude = 511;  ///< 9 bits, a sign above them

}  // namespace stx::spz
