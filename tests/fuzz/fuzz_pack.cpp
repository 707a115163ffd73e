// Atlases, round trip: what is packed, written as atlas.json and unpacked has every point of the
// views. Input: layout, padding, attributes, largest size; then for each view width, height and the
// runs of pixels with and without a point.

#include <cstdlib>

#include "formats/atlas/atlas_json.hpp"
#include "lib/packing/packing.hpp"

using namespace stx;

namespace {

class Bytewise {
  public:
    Bytewise(const std::uint8_t* data, std::size_t size) : at_(data), end_(data + size) {}
    bool empty() const { return at_ == end_; }
    int next() { return empty() ? 0 : *at_++; }

  private:
    const std::uint8_t *at_, *end_;
};

ReferenceView viewOf(Bytewise& bytes, int index, bool normals, bool splats) {
    ReferenceView v;
    v.name = fmt::format("view{}", index);
    const int w = 1 + bytes.next() % 48, h = 1 + bytes.next() % 48;
    v.camera = Camera::fromFieldOfView({index, 0, 10}, {1, 0, 0, 0}, {0.8, 0.8}, false, w, h);
    v.nearPlane = 1;
    v.farPlane = 100;
    v.depth = Image<float>(w, h, kNoDepth);
    Rgba8Image colour(w, h, glm::u8vec4(0));
    const std::size_t count = v.depth.count();
    if (normals) v.normal = Image<glm::vec3>(w, h, glm::vec3(0));
    if (splats) v.splatU = v.splatV = Image<glm::vec3>(w, h, glm::vec3(0));
    for (std::size_t k = 0; k < count && !bytes.empty();) {
        const int code = bytes.next();
        // The lowest bits: nothing, a point, full alpha without a point, partial coverage.
        const int kind = code & 3;
        for (int run = 0; run <= code >> 2 && k < count; ++run, ++k) {
            if (kind == 0) continue;
            const auto shade = static_cast<glm::u8>(17 * k + code);
            colour.pixels()[k] = {shade, k, code, kind == 3 ? 1 + code % 254 : 255};
            if (kind == 2) continue;
            v.depth.pixels()[k] = static_cast<float>(2 + (k * 7 + code) % 90);
            const glm::vec3 vector(0.6f, 0, 0.8f);
            if (normals) v.normal.pixels()[k] = vector;
            if (splats) v.splatU.pixels()[k] = v.splatV.pixels()[k] = vector * 0.01f;
        }
    }
    v.texture = std::move(colour);
    return v;
}

void expect(bool good) {
    if (!good) std::abort();
}

/// Each point and each partly covered pixel of `before` is the same in `after`.
void expectRecovered(const ReferenceView& before, const ReferenceView& after) {
    expect(before.camera == after.camera);
    expect(before.depth == after.depth);
    for (int y = 0; y < before.camera.height; ++y) {
        for (int x = 0; x < before.camera.width; ++x) {
            const glm::vec4 a = before.texture.at(x, y);
            const bool point = hasPoint(before.depth.at(x, y));
            if (!point && (a.a <= 0 || a.a >= 1)) continue;
            expect(a == after.texture.at(x, y));
            if (!point) continue;
            if (before.hasNormals()) expect(before.normal.at(x, y) == after.normal.at(x, y));
            if (before.hasSplats()) expect(before.splatV.at(x, y) == after.splatV.at(x, y));
        }
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytewise bytes(data, size);
    PackSettings settings;
    const int flags = bytes.next();
    settings.layout = flags & 1 ? PackSettings::Layout::tight : PackSettings::Layout::grid;
    const bool normals = (flags & 2) != 0, splats = (flags & 4) != 0;
    settings.padding = bytes.next() % 9;
    settings.maxSize = 16 << bytes.next() % 6;
    Bundle bundle;
    while (!bytes.empty() && bundle.views.size() < 24)
        bundle.views.push_back(
            viewOf(bytes, static_cast<int>(bundle.views.size()), normals, splats));
    Job job;
    job.limits.maxMemoryBytes = 64u << 20;
    const auto atlas = pack(bundle, settings, job);
    if (!atlas) {
        expect(!atlas.error().message.empty());
        return 0;
    }
    expect(atlas->check().has_value());
    expect(atlas->textureCount() <= 4 && atlas->width() <= settings.maxSize &&
           atlas->height() <= settings.maxSize);

    AtlasHeader header;
    header.atlas = *atlas;
    header.pageWidth = atlas->width();
    header.pageHeight = atlas->height();
    header.pages = static_cast<int>(atlas->pages.size());
    for (int page = 0; page < header.pages; ++page) {
        header.textures.push_back({"colour", page, fmt::format("colour_{}.png", page), "sRGB8",
                                   atlas->width(), atlas->height()});
        header.textures.push_back({"depth", page, fmt::format("depth_{}.png", page), "code16",
                                   atlas->width(), atlas->height()});
    }
    const std::string text = atlasJson(header);
    const auto read = atlasFromJson(text, "fuzz", job.limits);
    expect(read && atlasJson(*read) == text && read->atlas.rectangles == atlas->rectangles);

    const auto back = unpack(*atlas, job);
    expect(back.has_value());
    std::size_t k = 0;
    for (const ReferenceView& view : bundle.views) {
        if (k < back->views.size() && back->views[k].name == view.name)
            expectRecovered(view, back->views[k++]);
        else
            expect(view.pointCount() == 0);
    }
    expect(k == back->views.size());
    return 0;
}
