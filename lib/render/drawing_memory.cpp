#include "lib/render/drawing_memory.hpp"

#include <algorithm>

namespace stx {
namespace {

/// What drawing from a spool takes beside that, bytes: for each pixel of all views what is known of
/// blocks, and beside its images for each of the view that a thread prepares.
constexpr std::uint64_t kKnown = 2;
constexpr PeakMemory kPreparing = {"drawing", 32};

/// Of the memory that is left beside a spool, it takes one part of so many: frames take some, too.
constexpr std::uint64_t kPartOfLeft = 2;

/// What a spool holds in memory that is enough, bytes. One picture of 1024x1024 from 64 views as
/// large, by splats: 11.0 s of processors and 0.37 GB with 192 MiB; 10.0 s and 1.11 GB with all
/// views in memory. By surfaces 8.0 s and 0.51 GB; 7.8 s and 1.49 GB. With 128 MiB as long, 60 MB
/// less.
std::uint64_t enoughHeld(const Limits& limits) {
    constexpr std::uint64_t kLeast = 192u << 20;
    return std::max(kLeast, limits.maxMemoryBytes / kSpoolPart);
}

/// What drawing takes in memory without a look at less: 16 views of 1024x1024 take 370 MB.
std::uint64_t enoughInMemory(const Limits& limits) {
    constexpr std::uint64_t kLeast = 512u << 20, kPartOfLimit = 8;
    return std::min(limits.maxMemoryBytes, std::max(kLeast, limits.maxMemoryBytes / kPartOfLimit));
}

}  // namespace

DrawingMemory::DrawingMemory(const ViewTable& table, const PeakMemory& drawing,
                             const std::vector<bool>& wanted) {
    for (std::size_t i = 0; i < table.count(); ++i) {
        if (!wanted[i]) continue;
        images_ += table.bytesOf(i);
        pixels_ += table.pixelsOf(i);
        inMemory_ += table.bytesOf(i) + drawing.perPixel * table.pixelsOf(i);
    }
    beside_ = memoryOfEach(table, kPreparing) + kKnown * pixels_;
}

std::uint64_t DrawingMemory::least() const {
    return std::min(inMemory_, beside_ + beside_ / (kSpoolPart - 1));
}

bool DrawingMemory::inSpool(const Limits& limits) const {
    return inMemory_ > enoughInMemory(limits) && inMemory_ > least();
}

std::uint64_t DrawingMemory::spoolHolds(const Limits& limits) const {
    const std::uint64_t limit = limits.maxMemoryBytes;
    const std::uint64_t left = limit > beside_ ? (limit - beside_) / kPartOfLeft : 0;
    return std::max(limit / kSpoolPart, std::min(left, enoughHeld(limits)));
}

std::uint64_t DrawingMemory::most(const Limits& limits) const {
    return inSpool(limits) ? beside_ + spoolHolds(limits) : inMemory_;
}

}  // namespace stx
