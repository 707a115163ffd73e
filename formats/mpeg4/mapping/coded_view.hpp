#pragma once

#include <array>
#include <cstddef>

#include "formats/mpeg4/mapping/view_images.hpp"
#include "lib/model/same_pictures.hpp"

/// Views of a film while it is written, see sequence_write.hpp.
namespace stx::mpeg4 {

/// The images of a SimpleTexture, in the order in which they are coded.
inline constexpr std::array kRoles = {"texture", "depth", "normal", "splatU", "splatV"};
inline const Bytes& imageOf(const ViewImages& images, std::size_t role) {
    const std::array all = {&images.texture, &images.depth, &images.normal, &images.splatU,
                            &images.splatV};
    return *all[role];
}

/// A frame of a view, when its pixels are gone.
struct ViewBefore {
    ViewHeader header;
    PicturesKey pictures;

    static ViewBefore of(const ReferenceView& view) {
        ViewBefore before{view, PicturesKey::of(view)};
        before.header.colourFile = {};
        return before;
    }
    /// Whether both are coded alike: the lens counts, too, as pictures are padded by it.
    [[nodiscard]] bool codedAs(const ViewBefore& other) const {
        const Camera &c = header.camera, &d = other.header.camera;
        return c.orthographic == d.orthographic && c.fx == d.fx && c.fy == d.fy && c.cx == d.cx &&
               c.cy == d.cy && pictures == other.pictures;
    }
};

/// An image that was coded, without its bytes.
struct CodedImage {
    std::size_t size = 0, hash = 0;

    static CodedImage of(const Bytes& bytes) { return {bytes.size(), hashOf(bytes)}; }
    /// Of imageOf(): colour that becomes video changes with its coverage, which planes lack.
    static CodedImage of(const ViewImages& images, std::size_t role) {
        CodedImage coded = of(imageOf(images, role));
        if (role == 0) coded.hash ^= images.coverage;
        return coded;
    }
    bool operator==(const CodedImage&) const = default;
};

/// A frame of a view on its way: coded from several threads, then added in the views' order.
struct ComingView {
    ViewBefore view;
    ViewImages images;
    bool again = false;  ///< of its images only the padding is there: they are those before
};

}  // namespace stx::mpeg4
