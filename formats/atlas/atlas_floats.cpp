#include "formats/atlas/atlas_floats.hpp"

#include <initializer_list>
#include <type_traits>

#include "formats/exr/exr_colour.hpp"

namespace stx {

namespace {

using Type = ExrChannel::Type;

using Names = std::initializer_list<const char*>;

/// Calls add(image, names of its channels) for the images of one attribute.
template <class Page, class Colour, class Add>
void forImages(Page& page, const std::string& attribute, Colour& colour, const Add& add) {
    if (attribute == "colour") add(colour, Names{"R", "G", "B", "A"});
    if (attribute == "depth") add(page.depth, Names{"Z"});
    if (attribute == "normal") add(page.normal, Names{"N.X", "N.Y", "N.Z"});
    if (attribute == "splat") {
        add(page.splatU, Names{"splatU.X", "splatU.Y", "splatU.Z"});
        add(page.splatV, Names{"splatV.X", "splatV.Y", "splatV.Z"});
    }
    if (attribute == "metallic_roughness")
        add(page.metallicRoughness, Names{"surface.metallic", "surface.roughness"});
    if (attribute == "emissive")
        add(page.emissive, Names{"emissive.R", "emissive.G", "emissive.B"});
}

/// Channels of an image from row `y` on.
template <class Pixels, class Picture>
void addChannels(std::vector<Pixels>& pixels, Picture& image, int y, Names names) {
    auto* values = reinterpret_cast<decltype(Pixels::values)>(image.row(y).data());
    for (const char* name : names) pixels.push_back({name, values++, names.size()});
}

}  // namespace

ExrPart exrPartOf(const AtlasHeader& header, const std::vector<std::string>& attributes) {
    ExrPart part;
    part.width = part.displayWidth = header.pageWidth;
    part.height = part.displayHeight = header.pageHeight;
    const AtlasPage none;
    for (const std::string& attribute : attributes) {
        const bool half = attribute == "colour" && !header.linear;
        forImages(none, attribute, none.texture, [&](const auto&, Names names) {
            for (const char* name : names)
                part.channels.push_back({name, half ? Type::half : Type::float32});
        });
    }
    return part;
}

Result<void> writePage(ExrWriter& writer, int part, const AtlasPage& page,
                       const std::vector<std::string>& attributes) {
    Image<glm::vec4> colour;
    return writer.writePart(part, [&](int y, int rows) {
        std::vector<ExrConstPixels> pixels;
        for (const std::string& attribute : attributes) {
            const bool made = attribute == "colour";
            if (made) colour = premultipliedLinear(page.texture, y, rows);
            forImages(page, attribute, colour, [&](const auto& image, Names names) {
                addChannels(pixels, image, made ? 0 : y, names);
            });
        }
        return pixels;
    });
}

Result<void> writeFloatImage(const AtlasHeader& header, const AtlasPage& page,
                             const AtlasTexture& t, const std::filesystem::path& path) {
    STX_TRY(auto file, OutputFile::create(path));
    STX_TRY(auto writer, ExrWriter::create(file, {exrPartOf(header, {t.attribute})}));
    STX_CHECK(writePage(writer, 0, page, {t.attribute}));
    STX_CHECK(writer.finish());
    return file.commit();
}

Result<void> readFloats(const ExrReader& reader, int part,
                        const std::vector<std::string>& attributes, bool linear, AtlasPage& page) {
    const ExrPart& header = reader.parts()[part];
    std::vector<ExrPixels> pixels;
    std::vector<std::string> wanted;
    Image<glm::vec4> none;
    bool colour = false;
    for (const auto& attribute : attributes)
        forImages(page, attribute, none, [&](auto& image, Names names) {
            wanted.insert(wanted.end(), names.begin(), names.end());
            if (attribute == "colour") {
                colour = true;
                return;
            }
            image = std::remove_reference_t<decltype(image)>(header.width, header.height);
            addChannels(pixels, image, 0, names);
        });
    for (const auto& name : wanted) {
        if (!header.channel(name))
            return failAt(reader.where(), ErrorCode::invalidInput, "part {} lacks the channel '{}'",
                          part, name);
    }
    if (!colour) return reader.readPart(part, pixels);
    STX_TRY(page.texture, readTexture(reader, part, linear, pixels));
    return {};
}

}  // namespace stx
