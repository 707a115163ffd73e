#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

namespace stx {

/// The sets of texture coordinates that textures are drawn with. Textures say a name, instances of
/// geometry say which set it is there. Assimp ignores what they say: a texture has a number, and
/// a mesh the sets that it has, without gaps. Here the numbers count the names of an effect, but
/// for those that all instances bind alike, and the parts of a geometry get their sets in that
/// order.
class ColladaTextureSets {
  public:
    /// Takes in the tag at `at`; all of them in their order, then resolve().
    void read(std::string_view text, std::size_t at);
    void resolve();
    /// The number of what a texture of an effect names.
    [[nodiscard]] std::size_t numberOf(std::string_view effect, std::string_view name) const {
        const auto known = numbers_.find({effect, name});
        return known == numbers_.end() ? 0 : known->second;
    }
    /// The numbers that the coordinates of the `input` at `at` get as sets; none: as they are.
    [[nodiscard]] std::vector<std::size_t> setsOf(std::size_t at) const {
        const auto known = sets_.find(at);
        return known == sets_.end() ? std::vector<std::size_t>() : known->second;
    }
    /// What is bound to sets that differ, where one must do; empty: nothing.
    [[nodiscard]] std::string_view boundTwice() const { return boundTwice_; }

  private:
    static constexpr std::uint32_t kUnbound = UINT32_MAX;
    static constexpr std::size_t kMostNames = 8;  ///< as many sets as Assimp reads
    /// A material of a part of a geometry, and the sets by the names of textures.
    struct Instance {
        std::string_view geometry, symbol, material;
        std::map<std::string_view, std::uint32_t> sets;
    };
    struct Part {
        std::string_view geometry, symbol;
        std::vector<std::pair<std::uint32_t, std::size_t>> inputs;  ///< sets, and where they are
    };
    void bind(std::string_view text);
    void plan(const Part& part, const std::vector<std::uint32_t>& bound);

    std::string_view effect_, material_, controller_, geometry_, instance_;  ///< that is open
    bool inPart_ = false;
    std::map<std::string_view, std::vector<std::string_view>> names_;  ///< of an effect's textures
    std::map<std::string_view, std::string_view> effectOf_,
        skinned_;  ///< of materials, controllers
    std::vector<Part> parts_;
    std::vector<Instance> instances_;
    std::map<std::pair<std::string_view, std::string_view>, std::size_t> numbers_;
    std::map<std::size_t, std::vector<std::size_t>> sets_;  ///< by where inputs are
    std::string_view boundTwice_;
};

}  // namespace stx
