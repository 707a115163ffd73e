#include "formats/validate/validate_pictures.hpp"

#include <algorithm>

#include "formats/files/base64.hpp"
#include "formats/mpeg4/mapping/media_clock.hpp"
#include "formats/mpeg4/mapping/texture_images.hpp"
#include "formats/mpeg4/mapping/view_notes.hpp"
#include "lib/surface/normals.hpp"

namespace stx {

using namespace mpeg4;

namespace {

void checkNormalLengths(const DecodedImage& image, const Image<float>& depth,
                        const std::string& where, Findings& findings) {
    std::int64_t count = 0, off = 0;
    std::visit(
        [&](const auto& values) {
            const double cmax = image.bits() == 8 ? 255.0 : 65535.0;
            for (std::size_t i = 0; i < depth.count(); ++i) {
                if (!hasPoint(depth.pixels()[i])) continue;
                glm::dvec3 n;
                bool zero = true;
                for (int c = 0; c < 3; ++c) {
                    const auto code = values[i * static_cast<std::size_t>(image.channels) + c];
                    zero = zero && code == 0;
                    n[c] = 2.0 * static_cast<double>(code) / cmax - 1.0;
                }
                if (zero) continue;  // no normal
                ++count;
                if (!hasNormalLength(n)) ++off;
            }
        },
        image.values);
    checkNormalLengths(off, count, where, findings);
}

/// `channel` of `codes` has the depth.
void checkNormals(const Node& node, const DecodedImage& normals, const DecodedImage& codes,
                  int channel, int greyBits, const std::string& where, Findings& findings) {
    const float nearPlane = node.get<float>("nearPlane"), farPlane = node.get<float>("farPlane");
    const glm::vec2 fov = node.get<glm::vec2>("fieldOfView");
    if (!(nearPlane < farPlane) || !(fov.x > 0 && fov.y > 0) || normals.width != codes.width ||
        normals.height != codes.height || normals.channels < 3)
        return;
    const auto distances = depthFromImage(codes, channel, greyBits, nearPlane, farPlane);
    if (!distances) return;
    ReferenceView view;
    view.depth = *distances;
    const auto vectors = normalsFromImage(normals, view.depth);
    if (!vectors) return;
    view.normal = *vectors;
    checkNormalLengths(normals, view.depth, where, findings);
    view.camera = Camera::fromFieldOfView(
        glm::dvec3(node.get<glm::vec3>("position")),
        quatFromAxisAngle(axisAngle(node.get<Rotation>("orientation"))), glm::dvec2(fov),
        node.get<bool>("orthographic"), codes.width, codes.height);
    NormalCounts counts(view.camera);
    counts.add(view.depth, view.normal);
    counts.reportDirections(where, findings);
}

std::uint32_t highestCode(const DecodedImage& codes, int channel) {
    std::uint32_t highest = 0;
    std::visit(
        [&](const auto& values) {
            for (std::size_t i = static_cast<std::size_t>(channel); i < values.size();
                 i += static_cast<std::size_t>(codes.channels))
                highest = std::max(highest, static_cast<std::uint32_t>(values[i]));
        },
        codes.values);
    return highest;
}

void checkMask(const std::string& mask, const std::string& where, const PictureReader& pictures) {
    if (mask == kUnknownInAlpha || mask == kUnknownAll) return;
    const auto png = decodeBase64(mask);
    if (!png) {
        pictures.findings.add(4005, where, "text that is not base64", "a PNG in base64");
        return;
    }
    if (const auto image = pictures.decoder(*png, "the mask", pictures.limits); !image)
        pictures.findings.add(4005, where, image.error().text(), "an image that can be decoded");
}

/// Whether a rule on the descriptors that a texture names was found broken: one that is not there
/// (2020), or without a picture (2023).
bool descriptorReported(const Node& texture, const Findings& findings) {
    const int field = texture.info->find("url");
    const auto* urls = field < 0 ? nullptr : std::get_if<std::vector<Url>>(&texture.value(field));
    if (!urls) return false;
    return std::ranges::any_of(findings.list, [&](const Finding& finding) {
        return (finding.rule->number == 2020 || finding.rule->number == 2023) &&
               std::ranges::any_of(*urls, [&](const Url& url) {
                   return finding.where == descriptorText(url.objectDescriptorId);
               });
    });
}

}  // namespace

std::string descriptorText(int id) {
    return fmt::format("object descriptor {}", id);
}

std::optional<ImageInfo> PictureReader::probe(const Node& image, std::string_view what,
                                              const std::string& where) const {
    auto info = images.probe(image);
    if (info) return *info;
    if (!descriptorReported(image, findings))
        findings.add(4005, where, fmt::format("{}: {}", what, info.error().message), "an image");
    return {};
}

std::optional<DecodedImage> PictureReader::decode(const Node& image, std::string_view what,
                                                  const std::string& where) const {
    if (!options.pixels || !images.probe(image)) return {};
    auto decoded = images.decode(
        image, decoder, limits,
        what == "depth" ? StreamImages::Samples::codes : StreamImages::Samples::colours);
    if (decoded) return std::move(*decoded);
    // Video that is not decoded here breaks no rule.
    if (decoded.error().code == ErrorCode::unsupported) return {};
    findings.add(4005, where, fmt::format("{}: {}", what, decoded.error().text()),
                 "an image that can be decoded");
    return {};
}

std::optional<std::uint32_t> checkViewPixels(const Node& depthImage, const Node& texture,
                                             const std::string& where, bool inOctree,
                                             const PictureReader& pictures) {
    if (!pictures.options.pixels) return {};
    const auto decode = [&](const char* field) -> std::optional<DecodedImage> {
        const NodePtr& image = texture.get<NodePtr>(field);
        return image ? pictures.decode(*image, field, where) : std::nullopt;
    };
    const bool vectors = texture.is("SimpleTextureV2");
    // Only whether they decode is asked of them.
    if (vectors)
        for (const char* field : {"splatU", "splatV"}) (void)decode(field);
    const auto colour = decode("texture"), depth = decode("depth");
    const auto normals = vectors ? decode("normal") : std::nullopt;
    if (inOctree) return {};
    const NodePtr& depthNode = texture.get<NodePtr>("depth");
    const auto& codes = depthNode ? depth : colour;
    if (!codes || (!depthNode && codes->channels % 2 != 0)) return {};
    const int channel = depthNode ? 0 : codes->channels - 1;
    const std::uint32_t highest = highestCode(*codes, channel);
    if (codes->bits() == 16 && highest > 0 && highest <= 255)
        pictures.findings.add(4010, where,
                              fmt::format("16-bit depth codes that end at {}", highest),
                              "codes up to 65535: all of it lies at the far plane");
    if (normals) {
        const auto info =
            pictures.images.probe(depthNode ? *depthNode : *texture.get<NodePtr>("texture"));
        checkNormals(depthImage, *normals, *codes, channel, info ? info->greyBits : 0, where,
                     pictures.findings);
    }
    return highest;
}

bool anyPointLater(const Node& texture, const PictureReader& pictures, const Job& job) {
    const NodePtr& depth = texture.get<NodePtr>("depth");
    const NodePtr& image = depth ? depth : texture.get<NodePtr>("texture");
    const ElementaryStream* stream = image ? pictures.images.stream(*image) : nullptr;
    if (!stream || stream->samples.size() < 2) return false;
    StreamImages later = pictures.images;
    // A copy, since a reference lives until the next is asked for.
    const Presentation shown =  // NOLINT(performance-unnecessary-copy-initialization)
        later.presentation(*stream);
    const auto run = runOfMovie(*image, shown.duration);
    std::vector<double> times;
    // One cycle shows all pictures.
    if (!run || !addChanges(*image, shown, 0, std::max(run->start, 0.0) + run->cycle, times))
        return false;
    for (const double time : times) {
        if (!job.checkCancelled()) return false;
        later.setTime(time);
        const auto codes =
            later.decode(*image, pictures.decoder, pictures.limits,
                         depth ? StreamImages::Samples::codes : StreamImages::Samples::colours);
        if (!codes) return false;
        if (highestCode(*codes, depth ? 0 : codes->channels - 1) > 0) return true;
    }
    return false;
}

void checkMasks(const std::vector<ShownInfo>& infos, const PictureReader& pictures) {
    if (!pictures.options.pixels) return;
    for (const ShownInfo& info : infos)
        for (const auto& [key, view] : ViewNotes::parse(info.text).views)
            for (const auto& [number, layer] : view.layers) {
                const auto where = [name = key, at = number](const char* word) {
                    return fmt::format("WorldInfo: '{} {} {}'", word, name, at);
                };
                if (layer.pruned) checkMask(*layer.pruned, where("pruned"), pictures);
                if (layer.unknown) checkMask(*layer.unknown, where("unknown"), pictures);
            }
}

}  // namespace stx
