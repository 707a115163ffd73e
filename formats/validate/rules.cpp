#include "formats/validate/rules.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace stx {
namespace {

using enum Rule::Severity;

constexpr const char* kFile = "this project";
constexpr const char* kMp4 = "ISO/IEC 14496-14, 3";
constexpr const char* kOd = "ISO/IEC 14496-1, 7.2.6";
constexpr const char* kBifs = "ISO/IEC 14496-11, 8.6";
constexpr const char* kDibr = "ISO/IEC 14496-16, 4.5.4";
constexpr const char* kMovie = "ISO/IEC 14772-1, 6.28";
constexpr const char* kClock = "ISO/IEC 14496-1, 7.3";
constexpr const char* kBackground = "ISO/IEC 14772-1, 6.5";
constexpr const char* kV2 = "ISO/IEC 14496-16, 4.5.4 (V2 nodes)";

constexpr Rule kRules[] = {
    {1001, error, kFile, "the file can be read"},
    {1002, warning, kFile, "the ending of the name is that of the content"},
    {1003, error, kFile, "each file that an image set names is there"},

    {2001, error, kMp4, "moov has an iods box with the initial object descriptor"},
    {2002, error, kMp4, "the scene's track is listed in iods"},
    {2003, error, kMp4, "images are in a visual sample entry (mp4v)"},
    {2004, warning, kMp4, "images are in mp4v with esds, not in an entry of their own codec"},
    {2005, warning, kMp4, "object descriptors of a file refer to tracks (ES_ID_Ref)"},
    {2006, error, kMp4, "each ES_ID_Ref is an index into tref/mpod"},
    {2007, error, kMp4, "each stream that a descriptor names is there"},
    {2008, warning, kMp4, "descriptors of a file have the file's tags (0x10, 0x11)"},
    {2009, warning, kMp4, "a scene that names object descriptors has an OD track"},
    {2010, warning, kMp4, "ES_ID in esds is 0"},
    {2011, warning, kBifs, "nothing but padding follows the last command of an access unit"},
    {2012, warning, kMp4, "the file keeps to the conventions of MP4"},
    {2020, error, kOd, "each object descriptor that the scene names is there"},
    {2021, error, kOd, "ids of object descriptors are 1 to 1022"},
    {2022, error, kOd, "an update names each object descriptor once"},
    {2023, error, kOd, "each stream of an image has a picture"},
    {2024, warning, kOd, "each object descriptor is used by the scene"},
    {2025, error, kOd, "the bytes of an image are what objectTypeIndication says"},
    {2026, warning, kOd, "images are JPEG (0x6C) or PNG (0x6D), a MovieTexture's video, too"},
    {2027, warning, "ISO/IEC 14496-11, 8.5",
     "objectTypeIndication of the scene gives the version of its config"},
    {2028, error, kOd, "no two streams have the same ES_ID"},
    {2030, error, kBifs, "the first command replaces the scene"},
    {2031, error, kBifs, "each command fits the scene that it changes"},
    {2032, error, kBifs, "each later moment can be read"},
    {2033, warning, "ISO/IEC 14772-1, 4.6.8", "the keys of interpolators fit their values"},

    {3001, error, kDibr, "nearPlane is less than farPlane"},
    {3002, error, kDibr, "nearPlane is 0 or more"},
    {3003, error, kDibr,
     "fieldOfView is an angle between 0 and pi, or a window with sides above 0"},
    {3004, warning, "ISO/IEC 14496-11, 7.1 (SFRotation)", "the axis of a rotation has length 1"},
    {3005, error, kDibr, "all numbers of a camera are finite, its orientation is a rotation"},
    {3006, error, kDibr, "Transforms above a DepthImage rotate, move and scale all axes alike"},
    {3007, warning, kDibr, "nearPlane of a perspective camera is above 0"},
    {3008, warning, kDibr,
     "orthographic or fieldOfView is given: by default the angle is taken for a window"},
    {3009, warning, kFile, "the views of a model have names that differ"},

    {4001, error, kDibr, "depth and texture have the same size"},
    {4002, error, kDibr, "the depth image is grey"},
    {4003, error, kDibr, "there is a depth image, or the texture has alpha"},
    {4004, warning, kFile, "depth is stored without loss (PNG)"},
    {4005, error, kFile, "images can be decoded"},
    {4006, warning, kDibr, "each view has a point, of a film at some time"},
    {4007, error, kDibr, "the object has a point"},
    {4008, warning, kDibr, "the depth image has no alpha"},
    {4009, warning, kDibr, "each DepthImage has a texture"},
    {4010, warning, kDibr, "depth codes use the range of their bits (dmax)"},
    {4011, error, kDibr, "depth has 8 or 16 bits a pixel"},
    {4012, error, kDibr, "the lists of a PointTexture fit its size and each other"},
    {4013, error, kDibr,
     "the octree of an OctreeImage is whole, its images are orthographic and have a texture"},
    {4014, error, kDibr, "the scene shows a DepthImage"},
    {4020, warning, kDibr, "all DepthImages of an object are under one Transform"},
    {4021, warning, kDibr, "no DepthImage is shown twice in one place"},
    {4030, error, kDibr, "distances lie between nearPlane and farPlane"},

    {5001, error, "Lee & Park, 3.1", "rectangles lie inside their view and their page"},
    {5002, error, "Lee & Park, 3.1", "rectangles do not overlap"},
    {5003, error, "Lee & Park, 3.1", "an atlas has at most four textures"},
    {5004, error, "Lee & Park, 3.1", "all textures of a page have the same size"},
    {5005, error, "atlas.schema.json", "objects have names and, one after the other, all views"},

    {6001, error, kV2, "normal, splatU and splatV have the size of the depth"},
    {6002, error, kV2, "normal, splatU and splatV are RGB"},
    {6003, error, kV2, "splatU and splatV come together"},
    {6004, warning, kV2, "splatMinMax is given where there are splats"},
    {6005, error, kV2, "splatMinMax is finite and its first value the smaller"},
    {6006, warning, kV2, "SimpleTextureV2 with splats is in a DepthImageV2"},
    {6007, warning, kV2, "normals have length 1"},
    {6008, warning, kV2, "normals point to the viewer"},

    {7001, error, kFile, "images of a view that move have pictures of the same times"},
    {7002, error, kFile, "MovieTextures of a view start, stop, run and loop together"},
    {7003, warning, kClock, "a MovieTexture that loops has a clock of its own (OCR_ES_ID)"},
    {7004, error, "ISO/IEC 14496-12, 8.6.2", "the first picture of a stream stands alone (sync)"},
    {7005, warning, kMovie, "pictures that change in time are in a MovieTexture"},
    {7006, warning, kMovie, "a MovieTexture runs forwards (speed above 0)"},
    {7007, error, kDibr, "all pictures of a stream have the same size"},
    {7008, warning, "ISO/IEC 14496-12, 8.6.6", "the edit list shows every picture"},

    {8001, warning, kBackground, "the pictures of a Background are square and of one size"},
    {8002, warning, kBackground, "a Background has all six pictures or none"},
    {8003, error, kBackground, "sky and ground have one angle less than colours, and angles rise"},
};

}  // namespace

std::span<const Rule> ruleCatalogue() {
    return kRules;
}

const Rule* findRule(int number) {
    const auto at = std::lower_bound(std::begin(kRules), std::end(kRules), number,
                                     [](const Rule& rule, int n) { return rule.number < n; });
    return at != std::end(kRules) && at->number == number ? at : nullptr;
}

std::string Finding::text() const {
    return fmt::format("{} {}: {}{}found {}, expected {} ({})", rule->number,
                       rule->severity == Rule::Severity::error ? "error" : "warning", where,
                       where.empty() ? "" : ": ", found, expected, rule->clause);
}

}  // namespace stx
