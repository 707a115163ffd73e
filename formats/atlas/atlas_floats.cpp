#include "formats/atlas/atlas_floats.hpp"

#include "formats/exr/exr_colour.hpp"

namespace stx {

namespace {

using Type = ExrChannel::Type;

template <class Pixels, class Pointer>
void addVectors(std::vector<Pixels>& pixels, const std::string& name, Pointer first) {
    pixels.push_back({name + ".X", first, 3});
    pixels.push_back({name + ".Y", first + 1, 3});
    pixels.push_back({name + ".Z", first + 2, 3});
}

}  // namespace

void addAttribute(const AtlasPage& page, const std::string& attribute,
                  const Image<glm::vec4>& colour, std::vector<ExrConstPixels>& pixels) {
    if (attribute == "colour") {
        const float* rgba = &colour.data()->x;
        pixels.insert(pixels.end(),
                      {{"R", rgba, 4}, {"G", rgba + 1, 4}, {"B", rgba + 2, 4}, {"A", rgba + 3, 4}});
    }
    if (attribute == "depth") pixels.push_back({"Z", page.depth.data(), 1});
    if (attribute == "normal") addVectors(pixels, "N", &page.normal.data()->x);
    if (attribute == "splat") {
        addVectors(pixels, "splatU", &page.splatU.data()->x);
        addVectors(pixels, "splatV", &page.splatV.data()->x);
    }
    if (attribute == "metallic_roughness") {
        const float* values = &page.metallicRoughness.data()->x;
        pixels.insert(pixels.end(),
                      {{"surface.metallic", values, 2}, {"surface.roughness", values + 1, 2}});
    }
    if (attribute == "emissive") {
        const float* rgb = &page.emissive.data()->x;
        pixels.insert(
            pixels.end(),
            {{"emissive.R", rgb, 3}, {"emissive.G", rgb + 1, 3}, {"emissive.B", rgb + 2, 3}});
    }
}

ExrPart exrPartOf(const AtlasHeader& header, const std::vector<ExrConstPixels>& pixels) {
    ExrPart part;
    part.width = part.displayWidth = header.pageWidth;
    part.height = part.displayHeight = header.pageHeight;
    for (const auto& p : pixels) {
        const bool colour = p.channel.size() == 1 && p.channel != "Z";
        part.channels.push_back({p.channel, colour && !header.linear ? Type::half : Type::float32});
    }
    return part;
}

Result<void> writeFloatImage(const AtlasHeader& header, const AtlasPage& page,
                             const AtlasTexture& t, const std::filesystem::path& path) {
    Image<glm::vec4> colour;
    if (t.attribute == "colour") colour = premultipliedLinear(page.texture);
    std::vector<ExrConstPixels> pixels;
    addAttribute(page, t.attribute, colour, pixels);
    STX_TRY(auto file, OutputFile::create(path));
    STX_TRY(auto writer, ExrWriter::create(file, {exrPartOf(header, pixels)}));
    STX_CHECK(writer.writePart(0, pixels));
    STX_CHECK(writer.finish());
    return file.commit();
}

Result<void> readFloats(const ExrReader& reader, int part,
                        const std::vector<std::string>& attributes, bool linear, AtlasPage& page) {
    const ExrPart& header = reader.parts()[part];
    const int width = header.width, height = header.height;
    std::vector<ExrPixels> pixels;
    Image<glm::vec4> colour;
    const auto vectors = [&](const char* name, Image<glm::vec3>& image) {
        image = Image<glm::vec3>(width, height);
        addVectors(pixels, name, &image.data()->x);
    };
    for (const auto& attribute : attributes) {
        if (attribute == "colour") {
            colour = Image<glm::vec4>(width, height);
            float* rgba = &colour.data()->x;
            pixels.insert(
                pixels.end(),
                {{"R", rgba, 4}, {"G", rgba + 1, 4}, {"B", rgba + 2, 4}, {"A", rgba + 3, 4}});
        }
        if (attribute == "depth") {
            page.depth = Image<float>(width, height);
            pixels.push_back({"Z", page.depth.data(), 1});
        }
        if (attribute == "normal") vectors("N", page.normal);
        if (attribute == "splat") {
            vectors("splatU", page.splatU);
            vectors("splatV", page.splatV);
        }
        if (attribute == "metallic_roughness") {
            page.metallicRoughness = Image<glm::vec2>(width, height);
            float* values = &page.metallicRoughness.data()->x;
            pixels.insert(pixels.end(),
                          {{"surface.metallic", values, 2}, {"surface.roughness", values + 1, 2}});
        }
        if (attribute == "emissive") {
            page.emissive = Image<glm::vec3>(width, height);
            float* rgb = &page.emissive.data()->x;
            pixels.insert(
                pixels.end(),
                {{"emissive.R", rgb, 3}, {"emissive.G", rgb + 1, 3}, {"emissive.B", rgb + 2, 3}});
        }
    }
    for (const auto& p : pixels) {
        if (!header.channel(p.channel))
            return failAt(reader.where(), ErrorCode::invalidInput, "part {} lacks the channel '{}'",
                          part, p.channel);
    }
    STX_CHECK(reader.readPart(part, pixels));
    if (!colour.empty())
        page.texture =
            linear ? textureFromPremultiplied(colour) : textureFromPremultiplied8(colour);
    return {};
}

}  // namespace stx
