#pragma once

#include <string>

#include "formats/files/files.hpp"

namespace stx {

/// Red, green and blue of what a file gives no colour.
inline constexpr float kNoColour = -1.0f;

/// A COLLADA file as Assimp reads it right, and what it does not say of it.
struct PlainCollada {
    std::string text;
    std::string wrap;        ///< of the first wrap_s or wrap_t that is not WRAP: Assimp ignores it
    std::string boundTwice;  ///< the first semantic bound to sets that differ in one part, if any
    std::string twoSkeletons;  ///< the first skin that has several, if any
    std::size_t morphs = 0;    ///< controllers that are taken away
    std::size_t holes = 0;     ///< of polygons, likewise
};

/// Rewrites (COLLADA 1.4.1, chapter 5):
///  - `lookat` and `skew` as the `matrix` that they mean. Assimp takes the up of a lookat for an
///    axis as it is, which shears where it is not at right angles to the view, and ends itself at a
///    skew. What has too few numbers, and a lookat without a direction aside of its up, stay.
///  - `texcoord` of textures as a number, and the sets of texture coordinates of each part of a
///    geometry in the order of these numbers, as `bind_vertex_input` of its instance says; its
///    lowest set where nothing does. Assimp ignores what is bound, takes a number from the name,
///    and leaves out sets that do not exist.
///  - `wrap_s` and `wrap_t` of samplers, which Assimp ignores, as what Maya writes into textures.
///  - elements with a prefix of a namespace without it, if the root has one: Assimp finds none.
///  - parameters that colours refer to as these colours, and what has none as kNoColour, but for
///    `constant` that emits, which is black beside: Assimp takes a grey of its own.
///  - instances of morphs as those of their base meshes, and polygons with holes as those without:
///    Assimp refuses the file, and leaves them out.
///  - names of joints that several nodes have, `sid`, as names of their own, those that the skin's
///    `skeleton` has: Assimp takes the first node of all.
///  - the shape of skins without a `bind_shape_matrix` as it is: Assimp takes zeros.
/// Errors (invalidInput): a skew whose angle reaches its axis of translation.
[[nodiscard]] Result<PlainCollada> plainCollada(ByteSpan text);

}  // namespace stx
