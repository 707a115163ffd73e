#pragma once

#include "formats/imagesets/kinds.hpp"

namespace stx::imagesets {

struct KindEntry {
    ImageSetKind kind;
    Result<SetDescription> (*describe)(const path&, const ImageSetOptions&, Job&);
};

/// Null when there is no such kind.
[[nodiscard]] const KindEntry* kindNamed(std::string_view name);

}  // namespace stx::imagesets
