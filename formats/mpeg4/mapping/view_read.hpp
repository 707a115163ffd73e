#pragma once

#include <optional>
#include <string>
#include <vector>

#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/mapping/octree.hpp"
#include "formats/mpeg4/mapping/stream_images.hpp"
#include "formats/mpeg4/scene/placement.hpp"

namespace stx::mpeg4 {

/// A view before its pixels are there.
struct ViewPlan {
    NodePtr depthImage;
    NodePtr texture;  ///< SimpleTexture(V2) or PointTexture(V2)
    Similarity worldFromLocal;
    std::string name;
    std::string key;         ///< in ViewNotes::views
    int parent = 0;          ///< ShownNode::parent
    std::size_t number = 0;  ///< among the views of that parent, with those that are left out
    const Octree* octree = nullptr;  ///< gives the depth, instead of the depth image
};

/// Reads the views of plans: as their DepthImages have them, before what the scene around them
/// says. Safe from several threads.
class ViewReader {
  public:
    ViewReader(const SceneReadOptions& options, const StreamImages& images, Job& job)
        : options_(options), images_(images), job_(job) {}

    /// The view; of a PointTexture one for each of its layers. Errors (invalidInput) say what is
    /// wrong, without the view's name.
    [[nodiscard]] Result<std::vector<ReferenceView>> read(const ViewPlan& plan) const;
    /// The same without images: size and depth bits from the image's header, and planes of an
    /// octree from its voxels.
    [[nodiscard]] Result<std::vector<ReferenceView>> header(const ViewPlan& plan) const;
    /// Which images read() will give, where that and header() are sure before it; nothing of what
    /// only pixels tell.
    [[nodiscard]] std::optional<ViewImageKinds> knownKinds(const ViewPlan& plan) const;
    /// Errors (invalidInput) when all pixels together will take more than the limits allow.
    [[nodiscard]] Result<void> checkMemory(const std::vector<ViewPlan>& plans) const;

  private:
    [[nodiscard]] Result<ReferenceView> cameraOf(const ViewPlan& plan, int width, int height) const;
    [[nodiscard]] Result<DecodedImage> decode(const NodePtr& texture, std::string_view what) const;
    [[nodiscard]] Result<ReferenceView> readSimpleTexture(const ViewPlan& plan) const;
    [[nodiscard]] Result<void> readVectors(const ViewPlan& plan, ReferenceView& view) const;
    [[nodiscard]] Result<void> castOctree(const Octree& octree, ReferenceView& view) const;

    const SceneReadOptions& options_;
    const StreamImages& images_;
    Job& job_;
};

}  // namespace stx::mpeg4
