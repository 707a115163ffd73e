#include "formats/mpeg4/mapping/view_read.hpp"

#include <algorithm>
#include <cmath>

#include "formats/mpeg4/mapping/point_texture.hpp"
#include "formats/mpeg4/mapping/texture_images.hpp"
#include "formats/mpeg4/mapping/view_images.hpp"
#include "formats/mpeg4/scene/scene_walk.hpp"
#include "lib/geometry/directions.hpp"

namespace stx::mpeg4 {

Result<void> ViewReader::checkMemory(const std::vector<ViewPlan>& plans) const {
    std::uint64_t pixels = 0;
    for (const ViewPlan& plan : plans) {
        for (const char* field : {"texture", "depth"}) {
            const int index = plan.texture->info->find(field);
            if (index < 0 || !std::holds_alternative<NodePtr>(plan.texture->value(index))) continue;
            const auto& image = std::get<NodePtr>(plan.texture->value(index));
            if (!image) continue;
            // Images without a readable header fail later, with a message of their own.
            if (const auto info = images_.probe(*image)) {
                pixels += static_cast<std::uint64_t>(info->width) *
                          static_cast<std::uint64_t>(info->height);
                break;
            }
        }
        const bool vectors = plan.texture->is("SimpleTextureV2");
        STX_CHECK(job_.limits.checkAllocation(pixels, vectors ? 44 : 8, "the views' pixels"));
    }
    return {};
}

/// Camera and planes; the size comes from the image.
Result<ReferenceView> ViewReader::cameraOf(const ViewPlan& plan, int width, int height) const {
    const Node& node = *plan.depthImage;
    ReferenceView view;
    view.name = plan.name;
    const auto fov = node.get<glm::vec2>("fieldOfView");
    const bool orthographic = node.get<bool>("orthographic");
    if (!isFieldOfView(fov, orthographic))
        return fail(ErrorCode::invalidInput, "fieldOfView is {} {}; {}", fov.x, fov.y,
                    fieldOfViewRule(orthographic));
    if (!plan.octree) {  // which gives planes, too
        view.nearPlane = node.get<float>("nearPlane");
        view.farPlane = node.get<float>("farPlane");
        if (!(view.nearPlane >= 0 && view.nearPlane < view.farPlane &&
              std::isfinite(view.farPlane)))
            return fail(ErrorCode::invalidInput,
                        "nearPlane is {} and farPlane {}; 0 <= nearPlane < farPlane must hold",
                        view.nearPlane, view.farPlane);
    }
    const glm::dvec4 turn = axisAngle(node.get<Rotation>("orientation"));
    const glm::dvec3 position(node.get<glm::vec3>("position"));
    for (const double v : {turn.x, turn.y, turn.z, turn.w, position.x, position.y, position.z})
        if (!std::isfinite(v))
            return fail(ErrorCode::invalidInput,
                        "position or orientation has a value that is not finite");
    view.camera = Camera::fromFieldOfView(position, quatFromAxisAngle(turn), glm::dvec2(fov),
                                          orthographic, width, height);
    return view;
}

Result<DecodedImage> ViewReader::decode(const NodePtr& texture, std::string_view what) const {
    return within(std::string(what),
                  images_.decode(*texture, options_.decode, job_.limits,
                                 what == "depth" ? StreamImages::Samples::codes
                                                 : StreamImages::Samples::colours));
}

Result<std::vector<ReferenceView>> ViewReader::read(const ViewPlan& plan) const {
    if (plan.texture->info->find("depthNbBits") >= 0) {
        STX_TRY(const auto view, cameraOf(plan, plan.texture->get<std::int32_t>("width"),
                                          plan.texture->get<std::int32_t>("height")));
        return viewsFromPointTexture(*plan.texture, view, job_.limits);
    }
    STX_TRY(auto view, readSimpleTexture(plan));
    std::vector<ReferenceView> views;
    views.push_back(std::move(view));
    return views;
}

Result<std::vector<ReferenceView>> ViewReader::header(const ViewPlan& plan) const {
    if (plan.texture->info->find("depthNbBits") >= 0) {
        STX_TRY(const auto view, cameraOf(plan, plan.texture->get<std::int32_t>("width"),
                                          plan.texture->get<std::int32_t>("height")));
        return headersFromPointTexture(*plan.texture, view, job_.limits);
    }
    const NodePtr& depth = plan.texture->get<NodePtr>("depth");
    const NodePtr& colour = plan.texture->get<NodePtr>("texture");
    if (plan.octree && !colour)
        return fail(ErrorCode::invalidInput, "an image of an OctreeImage has no texture");
    STX_TRY(const auto info, images_.probe(depth && !plan.octree ? *depth : *colour));
    STX_TRY(auto view, cameraOf(plan, info.width, info.height));
    if (!plan.octree) {
        view.depthBits = info.bits;
        return std::vector<ReferenceView>{view};
    }
    // Its planes and where its camera is follow from the voxels that it sees.
    const auto pixels = static_cast<std::uint64_t>(info.width) * info.height;
    STX_CHECK(job_.limits.checkAllocation(pixels, 12, "a view of the octree"));
    STX_CHECK(castOctree(*plan.octree, view));
    view.depth = {};
    return std::vector<ReferenceView>{view};
}

Result<ReferenceView> ViewReader::readSimpleTexture(const ViewPlan& plan) const {
    const NodePtr& colourNode = plan.texture->get<NodePtr>("texture");
    const NodePtr& depthNode = plan.texture->get<NodePtr>("depth");
    DecodedImage colour;
    if (colourNode) {
        STX_TRY(colour, decode(colourNode, "texture"));
        if (colour.bits() == 16) job_.note("16-bit colour is read as 8 bits");
        // Said of films, too, where the notes of later frames are dropped.
        if (!colour.colourNote.empty()) job_.noteOnce(colour.colourNote);
    }
    const bool hasAlpha = colourNode && (colour.channels == 2 || colour.channels == 4);
    int depthBits = 16;
    ReferenceView view;
    if (plan.octree) {
        if (!colourNode)
            return fail(ErrorCode::invalidInput, "an image of an OctreeImage has no texture");
        STX_TRY(view, cameraOf(plan, colour.width, colour.height));
        STX_CHECK(castOctree(*plan.octree, view));
    } else if (depthNode) {
        STX_TRY(const auto depth, decode(depthNode, "depth"));
        STX_TRY(view, cameraOf(plan, depth.width, depth.height));
        if (colourNode && (colour.width != depth.width || colour.height != depth.height))
            return fail(ErrorCode::invalidInput,
                        "depth is {}x{} but texture is {}x{}; both must match", depth.width,
                        depth.height, colour.width, colour.height);
        if (!isGrey(depth))
            return fail(ErrorCode::invalidInput,
                        "the depth image has colours; depth is grey-scale (one channel)");
        if (depth.channels == 2 || depth.channels == 4)
            job_.note("a depth image has an alpha channel, which is left out");
        depthBits = depth.bits();
        const auto stored = images_.probe(*depthNode);
        STX_TRY(view.depth, depthFromImage(depth, 0, stored ? stored->greyBits : 0, view.nearPlane,
                                           view.farPlane));
    } else {
        if (!hasAlpha)
            return fail(ErrorCode::invalidInput,
                        "the depth image is NULL and the texture has no alpha; one of them "
                        "must hold the depth");
        STX_TRY(view, cameraOf(plan, colour.width, colour.height));
        depthBits = colour.bits();
        STX_TRY(view.depth,
                depthFromImage(colour, colour.channels - 1, 0, view.nearPlane, view.farPlane));
    }
    if (!plan.octree) view.depthBits = depthBits;

    Rgba8Image pixels = colourNode
                            ? rgba8From(colour)
                            : Rgba8Image(view.camera.width, view.camera.height, glm::u8vec4(255));
    if (!colourNode) job_.note("a view has depth but no texture; it is read as white");
    if (!(hasAlpha && depthNode && !plan.octree))
        for (std::size_t i = 0; i < pixels.count(); ++i)
            pixels.pixels()[i].a = hasPoint(view.depth.pixels()[i]) ? 255 : 0;
    view.texture = Texture(std::move(pixels));
    if (options_.keepColourFiles && colourNode && !colourNode->is("PixelTexture")) {
        STX_TRY(auto bytes, images_.load(*colourNode, job_.limits));
        if (const auto info = probeImage(bytes); info && info->format == "jpeg")
            view.colourFile.jpeg = std::make_shared<const Bytes>(std::move(bytes));
    }

    if (plan.texture->is("SimpleTextureV2")) STX_CHECK(readVectors(plan, view));
    return view;
}

Result<void> ViewReader::readVectors(const ViewPlan& plan, ReferenceView& view) const {
    const auto load = [&](std::string_view what, const NodePtr& node) -> Result<DecodedImage> {
        STX_TRY(auto image, decode(node, what));
        if (image.width != view.camera.width || image.height != view.camera.height)
            return fail(ErrorCode::invalidInput, "{} is {}x{} but depth is {}x{}; both must match",
                        what, image.width, image.height, view.camera.width, view.camera.height);
        return image;
    };
    if (const NodePtr& node = plan.texture->get<NodePtr>("normal")) {
        STX_TRY(const auto image, load("normal", node));
        STX_TRY(view.normal, normalsFromImage(image, view.depth));
    }
    const NodePtr& u = plan.texture->get<NodePtr>("splatU");
    const NodePtr& v = plan.texture->get<NodePtr>("splatV");
    if (static_cast<bool>(u) != static_cast<bool>(v))
        job_.note("a SimpleTextureV2 has only one of splatU and splatV; it is left out");
    if (!u || !v) return {};
    const int minMax = plan.depthImage->info->find("splatMinMax");
    if (minMax < 0) {
        job_.note(
            "a DepthImage has splats but no splatMinMax (only DepthImageV2 has); they are left "
            "out");
        return {};
    }
    const glm::vec2 range = std::get<glm::vec2>(plan.depthImage->value(minMax));
    if (!std::isfinite(range.x) || !std::isfinite(range.y) || range.x >= range.y)
        return fail(ErrorCode::invalidInput, "splatMinMax is {} {}; the first must be the smaller",
                    range.x, range.y);
    STX_TRY(const auto imageU, load("splatU", u));
    STX_TRY(const auto imageV, load("splatV", v));
    STX_TRY(view.splatU, splatsFromImage(imageU, range, view.depth));
    STX_TRY(view.splatV, splatsFromImage(imageV, range, view.depth));
    return {};
}

/// Depth of the first voxel behind each pixel. Planes are put around what is there.
Result<void> ViewReader::castOctree(const Octree& octree, ReferenceView& view) const {
    if (!view.camera.orthographic)
        return fail(ErrorCode::invalidInput, "an image of an OctreeImage must be orthographic");
    const Camera& c = view.camera;
    const glm::dvec3 forward = c.forward();
    Image<double> hits(c.width, c.height, static_cast<double>(kNoDepth));
    double nearest = kNoDepth, furthest = -static_cast<double>(kNoDepth);
    for (int y = 0; y < c.height; ++y) {
        if (job_.cancelled) return {};
        for (int x = 0; x < c.width; ++x) {
            const glm::dvec3 origin =
                c.position + c.orientation * c.unproject(x + 0.5, y + 0.5, 0.0);
            const double dist = octree.firstHit(origin, forward);
            hits.at(x, y) = dist;
            if (!(dist < kNoDepth)) continue;
            nearest = std::min(nearest, dist);
            furthest = std::max(furthest, dist);
        }
    }
    view.depth = Image<float>(c.width, c.height, kNoDepth);
    if (!(nearest < kNoDepth)) return {};
    // The viewpoint may be inside the cube or behind it: rays are parallel, so step back.
    const double back = nearest < 0.5 ? 1.0 - nearest : 0.0;
    view.camera.position -= forward * back;
    view.nearPlane = std::floor((nearest + back) * 1024) / 1024;
    view.farPlane = std::ceil((furthest + back) * 1024 + 1) / 1024;
    for (std::size_t i = 0; i < hits.count(); ++i)
        if (hits.pixels()[i] < kNoDepth)
            view.depth.pixels()[i] = static_cast<float>(hits.pixels()[i] + back);
    return {};
}

std::optional<ViewImageKinds> ViewReader::knownKinds(const ViewPlan& plan) const {
    if (plan.octree || plan.texture->info->find("depthNbBits") >= 0) return {};
    for (const char* role : {"texture", "depth"}) {
        const NodePtr& node = plan.texture->get<NodePtr>(role);
        if (node && !images_.probesAsDecoded(*node)) return {};
    }
    ViewImageKinds kinds;
    if (!plan.texture->is("SimpleTextureV2")) return kinds;
    kinds.normal = plan.texture->get<NodePtr>("normal") != nullptr;
    const bool splats = plan.texture->get<NodePtr>("splatU") &&
                        plan.texture->get<NodePtr>("splatV") &&
                        plan.depthImage->info->find("splatMinMax") >= 0;
    kinds.splatU = kinds.splatV = splats;
    return kinds;
}

}  // namespace stx::mpeg4
