#pragma once

#include <cstddef>

#include "shaders/shared/language.hpp"

/// The structs of surface mode's buffers, one definition for C++ and the shaders.
namespace stx::surface {
namespace buffers {
using namespace glsl;
#include "shaders/shared/surface_structs.glsl"
}  // namespace buffers
using buffers::FrameEntry;
using buffers::Piece;
using buffers::SlotEntry;
using buffers::SourceEntry;
using buffers::TileEntry;

// As std430 and std140 lay them out: vectors of four at multiples of 16, sizes too.
static_assert(offsetof(SourceEntry, rayX) == 64 && offsetof(SourceEntry, size) == 112 &&
              offsetof(SourceEntry, place) == 144 && offsetof(SourceEntry, doubt) == 160 &&
              offsetof(SourceEntry, unwarp) == 176 && sizeof(SourceEntry) == 224);
static_assert(offsetof(FrameEntry, eyeX) == 16 && offsetof(FrameEntry, fit) == 64 &&
              offsetof(FrameEntry, size) == 80 && sizeof(FrameEntry) == 96);
static_assert(offsetof(SlotEntry, source) == 64 && sizeof(SlotEntry) == 80);
static_assert(offsetof(TileEntry, first) == 8 && offsetof(TileEntry, step) == 16 &&
              sizeof(TileEntry) == 32);
static_assert(offsetof(Piece, seenBy) == 24 && offsetof(Piece, at) == 28 && sizeof(Piece) == 32);

}  // namespace stx::surface
