#include "formats/mpeg4/mapping/point_texture.hpp"

#include <cmath>

namespace stx::mpeg4 {
namespace {

std::uint8_t byteFromUnit(float v) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(v, 0.0f, 1.0f) * 255.0f));
}

std::string layerName(const std::string& first, std::size_t k) {
    return k == 0 ? first : fmt::format("{}_{}", first, k);
}

/// The length of the lists of a PointTexture.
struct Shape {
    std::size_t points = 0;
    std::int32_t layers = 1;
    int depthBits = 8;  ///< 8, 16 or 32: what holds the codes
};

/// Errors: sizes, bits or counts that do not fit each other.
Result<Shape> shapeOf(const Node& node, const Limits& limits) {
    const auto width = node.get<std::int32_t>("width"), height = node.get<std::int32_t>("height");
    const auto& codes = node.get<std::vector<std::int32_t>>("depth");
    const auto& colours = node.get<std::vector<Color>>("color");
    const auto bits = node.get<std::int32_t>("depthNbBits");
    if (width < 1 || height < 1 || width > limits.maxImageSide || height > limits.maxImageSide)
        return fail(ErrorCode::invalidInput, "{} is {}x{}; 1 to {} pixels on a side are possible",
                    node.info->name, width, height, limits.maxImageSide);
    if (bits < 0 || bits > 30)
        return fail(ErrorCode::invalidInput, "{}.depthNbBits is {}; 0 to 30 are possible",
                    node.info->name, bits);
    const std::size_t pixels = static_cast<std::size_t>(width) * height;
    // Every pixel has a count at least: the size cannot be more than what the list holds.
    if (!codes.empty() && codes.size() < pixels)
        return fail(ErrorCode::invalidInput,
                    "{} is {}x{} but its depth has {} values; each pixel needs one at least",
                    node.info->name, width, height, codes.size());

    Shape shape;
    shape.depthBits = bits + 1 <= 8 ? 8 : bits + 1 <= 16 ? 16 : 32;
    std::size_t at = 0;
    for (std::size_t i = 0; i < pixels && !codes.empty(); ++i) {
        if (at >= codes.size())
            return fail(ErrorCode::invalidInput, "{}.depth ends at pixel {} of {}", node.info->name,
                        i, pixels);
        const std::int32_t count = codes[at++];
        if (count < 0 || static_cast<std::size_t>(count) > codes.size() - at)
            return fail(ErrorCode::invalidInput,
                        "{}.depth says {} depths for pixel {}, but {} values follow",
                        node.info->name, count, i, codes.size() - at);
        at += static_cast<std::size_t>(count);
        shape.points += static_cast<std::size_t>(count);
        shape.layers = std::max(shape.layers, count);
    }
    if (at != codes.size())
        return fail(ErrorCode::invalidInput, "{}.depth has {} values behind the last pixel",
                    node.info->name, codes.size() - at);
    if (colours.size() != shape.points)
        return fail(ErrorCode::invalidInput, "{} has {} depths but {} colours; both must match",
                    node.info->name, shape.points, colours.size());
    if (shape.layers > limits.maxViews)
        return fail(ErrorCode::invalidInput, "{} has a pixel with {} depths; at most {} are read",
                    node.info->name, shape.layers, limits.maxViews);
    return shape;
}

}  // namespace

Result<std::vector<ReferenceView>> viewsFromPointTexture(const Node& node,
                                                         const ReferenceView& view,
                                                         const Limits& limits) {
    const auto width = node.get<std::int32_t>("width"), height = node.get<std::int32_t>("height");
    const auto& codes = node.get<std::vector<std::int32_t>>("depth");
    const auto& colours = node.get<std::vector<Color>>("color");
    const auto bits = node.get<std::int32_t>("depthNbBits");
    STX_TRY(const Shape shape, shapeOf(node, limits));
    const std::size_t pixels = static_cast<std::size_t>(width) * height;
    const std::size_t points = shape.points;
    const std::int32_t layers = shape.layers;
    const bool v2 = node.info->find("splatU") >= 0;
    const std::vector<glm::vec3> none;
    const NodePtr normalNode = v2 ? node.get<NodePtr>("normal") : nullptr;
    const auto& normals = normalNode ? normalNode->get<std::vector<glm::vec3>>("vector") : none;
    const auto& splatU = v2 ? node.get<std::vector<glm::vec3>>("splatU") : none;
    const auto& splatV = v2 ? node.get<std::vector<glm::vec3>>("splatV") : none;
    for (const auto* list : {&normals, &splatU, &splatV})
        if (!list->empty() && list->size() != points)
            return fail(ErrorCode::invalidInput,
                        "{} has {} depths but {} normals, {} splatU and {} splatV", node.info->name,
                        points, normals.size(), splatU.size(), splatV.size());
    const bool splats = !splatU.empty() && !splatV.empty();
    const std::uint64_t perPixel = 8 + (normals.empty() ? 0 : 12) + (splats ? 24 : 0);
    if (auto ok = limits.checkAllocation(pixels * static_cast<std::uint64_t>(layers), perPixel,
                                         "the points of a PointTexture");
        !ok)
        return propagate(ok);

    std::vector<ReferenceView> views;
    std::vector<Rgba8Image> textures;
    for (std::int32_t k = 0; k < layers; ++k) {
        ReferenceView layer = view;
        layer.name = layerName(view.name, static_cast<std::size_t>(k));
        layer.depth = Image<float>(width, height, kNoDepth);
        textures.emplace_back(width, height);
        if (!normals.empty()) layer.normal = Image<glm::vec3>(width, height);
        if (splats) {
            layer.splatU = Image<glm::vec3>(width, height);
            layer.splatV = Image<glm::vec3>(width, height);
        }
        layer.depthBits = shape.depthBits;
        views.push_back(std::move(layer));
    }
    const DepthCode code{view.nearPlane, view.farPlane,
                         static_cast<std::uint32_t>((1ull << (bits + 1)) - 1)};
    std::size_t at = 0, point = 0;
    for (int y = height - 1; y >= 0 && !codes.empty(); --y) {
        for (int x = 0; x < width; ++x) {
            const std::int32_t count = codes[at++];
            for (std::int32_t k = 0; k < count; ++k, ++point) {
                const std::int32_t d = codes[at++];
                if (d < 0 || static_cast<std::uint32_t>(d) > code.dmax)
                    return fail(ErrorCode::invalidInput, "{}.depth holds {}; {} bits allow 0 to {}",
                                node.info->name, d, bits + 1, code.dmax);
                if (d == 0) continue;
                ReferenceView& layer = views[k];
                // One bit only: near and far plane, d = 1 is both; take the far plane.
                layer.depth.at(x, y) = static_cast<float>(
                    code.dmax == 1 ? view.farPlane : code.decode(static_cast<std::uint32_t>(d)));
                const Color c = colours[point];
                textures[k].at(x, y) = {byteFromUnit(c.r), byteFromUnit(c.g), byteFromUnit(c.b),
                                        255};
                if (!normals.empty()) {
                    const float length = glm::length(normals[point]);
                    layer.normal.at(x, y) = length > 0 ? normals[point] / length : glm::vec3(0);
                }
                if (splats) {
                    layer.splatU.at(x, y) = splatU[point];
                    layer.splatV.at(x, y) = splatV[point];
                }
            }
        }
    }
    for (std::size_t k = 0; k < views.size(); ++k)
        views[k].texture = Texture(std::move(textures[k]));
    return views;
}

Result<std::vector<ReferenceView>> headersFromPointTexture(const Node& node,
                                                           const ReferenceView& view,
                                                           const Limits& limits) {
    STX_TRY(const Shape shape, shapeOf(node, limits));
    std::vector<ReferenceView> views(static_cast<std::size_t>(shape.layers), view);
    for (std::size_t k = 0; k < views.size(); ++k) {
        views[k].name = layerName(view.name, k);
        views[k].depthBits = shape.depthBits;
    }
    return views;
}

bool isLayerOf(const ReferenceView& view, const ReferenceView& first, std::size_t k) {
    return view.name == layerName(first.name, k) && view.camera == first.camera &&
           view.nearPlane == first.nearPlane && view.farPlane == first.farPlane &&
           view.depthBits == first.depthBits && view.noDepth == first.noDepth &&
           view.pruned == first.pruned && view.background == first.background &&
           view.refined == first.refined && view.hasNormals() == first.hasNormals() &&
           view.hasSplats() == first.hasSplats();
}

NodePtr pointTextureFromViews(std::span<const ReferenceView* const> layers, const DepthCode& code,
                              int bits, bool v2) {
    NodePtr node = makeNode(v2 ? "PointTextureV2" : "PointTexture");
    const int width = layers[0]->depth.width(), height = layers[0]->depth.height();
    std::vector<std::int32_t> codes;
    std::vector<Color> colours;
    std::vector<glm::vec3> normals, splatU, splatV;
    const bool hasNormals = v2 && layers[0]->hasNormals(), hasSplats = v2 && layers[0]->hasSplats();
    for (int y = height - 1; y >= 0; --y) {
        for (int x = 0; x < width; ++x) {
            const std::size_t countAt = codes.size();
            codes.push_back(0);
            for (const ReferenceView* layer : layers) {
                const float dist = layer->depth.at(x, y);
                if (!hasPoint(dist)) continue;
                ++codes[countAt];
                codes.push_back(static_cast<std::int32_t>(code.encode(dist)));
                const glm::vec4 c = layer->texture.at(x, y);
                const bool linear = layer->texture.isLinear();
                colours.push_back({linear ? srgbFromLinear(c.r) : c.r,
                                   linear ? srgbFromLinear(c.g) : c.g,
                                   linear ? srgbFromLinear(c.b) : c.b});
                if (hasNormals) normals.push_back(layer->normal.at(x, y));
                if (hasSplats) {
                    splatU.push_back(layer->splatU.at(x, y));
                    splatV.push_back(layer->splatV.at(x, y));
                }
            }
        }
    }
    node->set("width", width);
    node->set("height", height);
    node->set("depthNbBits", bits - 1);
    node->set("depth", std::move(codes));
    node->set("color", std::move(colours));
    if (hasNormals) {
        NodePtr list = makeNode("Normal");
        list->set("vector", std::move(normals));
        node->set("normal", list);
    }
    if (hasSplats) {
        node->set("splatU", std::move(splatU));
        node->set("splatV", std::move(splatV));
    }
    return node;
}

}  // namespace stx::mpeg4
