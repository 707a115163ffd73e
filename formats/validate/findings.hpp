#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "formats/validate/validate.hpp"
#include "lib/model/view_table.hpp"

/// What the parts of the validator share.
namespace stx {

/// Collects findings by the number of their rule, which must be in the catalogue.
class Findings {
  public:
    void add(int rule, std::string where, std::string found, std::string expected);
    std::vector<Finding> list;
};

/// What is left of a file whose reading ended with an error: the error itself when it could not be
/// opened (io), else a finding of rule 1001.
[[nodiscard]] Result<std::vector<Finding>> unreadable(const Error& error);

/// "512x256"
[[nodiscard]] std::string sizeText(int width, int height);
/// "view 3 'front'"
[[nodiscard]] std::string viewText(std::size_t index, const std::string& name);

/// Camera, planes and depth bits.
void checkViewHeader(const ReferenceView& view, const std::string& where, Findings& findings);
/// Sizes, distances, normals and splats of a view whose images were read; its count of points.
[[nodiscard]] std::int64_t checkViewImages(const ReferenceView& view, const std::string& where,
                                           Findings& findings);
/// Rule 6007, where more than one in a hundred of `count` normals, `off`, have no length of 1.
void checkNormalLengths(std::int64_t off, std::int64_t count, const std::string& where,
                        Findings& findings);

/// The normals of a view, counted one by one for rules 6007 and 6008.
class NormalCounts {
  public:
    /// Normals and `camera` are in one frame. Directions are looked at where it passes check().
    explicit NormalCounts(const Camera& camera)
        : camera_(camera), directed_(camera.check().has_value()) {}

    /// Pixel (x, y) of the view. Those without a point or without a normal (0 0 0) do not count.
    void add(int x, int y, float depth, glm::vec3 normal);
    /// All pixels of the view, whose depth and normals have its size.
    void add(const Image<float>& depth, const Image<glm::vec3>& normal);
    void reportLengths(const std::string& where, Findings& findings) const;
    void reportDirections(const std::string& where, Findings& findings) const;

  private:
    Camera camera_;
    bool directed_ = false;
    std::int64_t count_ = 0, off_ = 0, notFinite_ = 0, away_ = 0;
};

/// Rule 4005 on the environment of a bundle or atlas, as reading it went.
void checkEnvironment(const Result<std::shared_ptr<const Environment>>& read, Findings& findings);

/// The two other kinds of files, for validateFile().
[[nodiscard]] Result<std::vector<Finding>> validateExrFile(const std::filesystem::path& path,
                                                           const ValidateOptions& options,
                                                           Job& job);
[[nodiscard]] Result<std::vector<Finding>> validateAtlasFile(const std::filesystem::path& path,
                                                             const ValidateOptions& options,
                                                             Job& job);

/// validate() of a bundle whose views are read one by one. Errors: those of reading them.
[[nodiscard]] Result<std::vector<Finding>> validateViews(const ViewTable& table, Job& job);

}  // namespace stx
