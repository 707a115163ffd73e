#include "formats/photos/colour_profile.hpp"

#include <lcms2.h>

#include <cstdlib>
#include <memory>

#include "lib/base/parallel.hpp"

namespace stx::photos {
namespace {

struct CloseProfile {
    void operator()(void* profile) const { cmsCloseProfile(profile); }
};
struct DeleteTransform {
    void operator()(void* transform) const { cmsDeleteTransform(transform); }
};
using Profile = std::unique_ptr<void, CloseProfile>;
using Transform = std::unique_ptr<void, DeleteTransform>;

constexpr std::size_t kLargestProfile = 1 << 20;  ///< those of displays have some hundred bytes

// Without a cache of the last colour several threads can use it.
Transform transformOf(const Profile& from, const Profile& to, cmsUInt32Number pixel) {
    return Transform(cmsCreateTransform(from.get(), pixel, to.get(), pixel,
                                        INTENT_RELATIVE_COLORIMETRIC,
                                        cmsFLAGS_NOCACHE | cmsFLAGS_COPY_ALPHA));
}

/// Whether it changes colours by no more than rounding does.
bool keeps(const Profile& from, const Profile& to) {
    const Transform transform = transformOf(from, to, TYPE_RGBA_8);
    for (int i = 0; transform && i < 4096; ++i) {
        const glm::u8vec4 in((i & 15) * 17, (i >> 4 & 15) * 17, (i >> 8) * 17, 255);
        glm::u8vec4 out(0);
        cmsDoTransform(transform.get(), &in, &out, 1);
        for (int k = 0; k < 3; ++k)
            if (std::abs(in[k] - out[k]) > 1) return false;
    }
    return true;
}

/// `pixel`: how Little CMS calls P.
template <class P>
std::string madeSrgb(Image<P>& picture, ByteSpan profile, cmsUInt32Number pixel) {
    if (profile.empty()) return {};
    constexpr const char* kTaken =
        "its colour profile is not one of three primaries: its colours "
        "are taken for sRGB";
    if (profile.size() > kLargestProfile) return kTaken;
    const Profile from(
        cmsOpenProfileFromMem(profile.data(), static_cast<cmsUInt32Number>(profile.size())));
    const Profile to(cmsCreate_sRGBProfile());
    if (!from || !to || cmsGetColorSpace(from.get()) != cmsSigRgbData ||
        !cmsIsMatrixShaper(from.get()))
        return kTaken;
    const Transform transform = transformOf(from, to, pixel);
    if (!transform) return kTaken;
    if (keeps(from, to)) return {};
    parallelFor(0, picture.height(), [&](int y) {
        const auto row = picture.row(y);
        cmsDoTransform(transform.get(), row.data(), row.data(),
                       static_cast<cmsUInt32Number>(row.size()));
        if constexpr (std::is_same_v<P, glm::vec4>)
            for (P& p : row) p = glm::clamp(p, 0.0f, 1.0f);
    });
    return "its colours are made sRGB from its colour profile; what sRGB does not have is clipped";
}

}  // namespace

std::string toSrgb(Rgba8Image& picture, ByteSpan profile) {
    return madeSrgb(picture, profile, TYPE_RGBA_8);
}
std::string toSrgb(RgbaFloatImage& picture, ByteSpan profile) {
    return madeSrgb(picture, profile, TYPE_RGBA_FLT);
}

}  // namespace stx::photos
