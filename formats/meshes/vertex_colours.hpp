#pragma once

#include <vector>

#include <glm/glm.hpp>

namespace stx {

/// Of what no colour is said in a file: linear; 188 of 255 as sRGB.
inline constexpr float kPlainGrey = 0.5f;

/// Finds whether the colours of a file that does not say it are 0..1 or 0..255.
class ColourRange {
  public:
    void add(glm::vec3 colour);
    [[nodiscard]] bool isBytes() const;

  private:
    float largest_ = 0;
    bool whole_ = true;  ///< none has a fraction
};

/// Vertex colours of a file that does not say what they mean (PLY, OBJ, STL, .drc) made linear:
/// they are taken as sRGB. `mayBeBytes`: their ColourRange counts.
void linearFromSrgbColours(std::vector<glm::vec4>& colours, bool mayBeBytes);

}  // namespace stx
