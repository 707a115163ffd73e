#pragma once

#include "formats/imagesets/kinds.hpp"

namespace stx::imagesets {

struct KindEntry {
    ImageSetKind kind;
    Result<SetDescription> (*describe)(const path&, const ImageSetOptions&, Job&);
};

/// Null when there is no such kind.
[[nodiscard]] const KindEntry* kindNamed(std::string_view name);

/// The depth picture that lies beside NAME_image.jpg or NAME.jpg, any picture: NAME_depth with the
/// ending of a picture. Empty: none does.
[[nodiscard]] path depthBeside(const path& picture);

}  // namespace stx::imagesets
