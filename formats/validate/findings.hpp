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
/// Rules on normals that need pixels; normals and camera of the view are in one frame.
void checkVectors(const ReferenceView& view, const std::string& where, Findings& findings);

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
