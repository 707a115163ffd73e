#pragma once

#include <string>
#include <vector>

#include "formats/validate/validate.hpp"

/// What the parts of the validator share.
namespace stx {

/// Collects findings by the number of their rule, which must be in the catalogue.
class Findings {
  public:
    void add(int rule, std::string where, std::string found, std::string expected);
    std::vector<Finding> list;
};

/// "512x256"
[[nodiscard]] std::string sizeText(int width, int height);

/// Rules on normals that need pixels; normals and camera of the view are in one frame.
void checkVectors(const ReferenceView& view, const std::string& where, Findings& findings);

}  // namespace stx
