#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace stx {

/// The joints of skins in a COLLADA file. Skins name them by `sid`, which is one below the root of
/// a skeleton alone; Assimp looks for them in the whole scene. Here those that several nodes have
/// get names of their own, and skins without a `bind_shape_matrix`, for which it takes zeros, one.
class ColladaJoints {
  public:
    /// Takes in the tag at `at`; all of them in their order, then resolve().
    void read(std::string_view text, std::size_t at);
    void resolve();

    struct Replaced {
        std::size_t from = 0, to = 0;  ///< places in the text
        std::string with;
    };
    /// What is to be put in place of a part of the element at `at`, if anything.
    [[nodiscard]] std::optional<Replaced> replacedAt(std::string_view text, std::size_t at) const;

    /// The first skin that is shown with several skeletons, of which it has the first; empty: none.
    [[nodiscard]] std::string_view twoSkeletons() const { return twoSkeletons_; }

  private:
    static constexpr std::size_t kNowhere = SIZE_MAX;
    struct Node {
        std::string_view id, sid;
        std::size_t parent = kNowhere;
        std::size_t end = kNowhere;  ///< the first node behind it that is not below it
    };
    struct Skin {
        std::string_view names;  ///< of its joints
        std::optional<std::string_view> skeleton;
    };

    std::vector<Node> nodes_;
    std::size_t open_ = kNowhere;                ///< node
    std::size_t skin_ = kNowhere;                ///< where the open one is, while it has no shape
    std::set<std::size_t> withoutShape_;         ///< where skins are
    std::string_view controller_, instance_;     ///< that are open
    std::map<std::string_view, Skin> skins_;     ///< by the controller's id
    std::map<std::size_t, std::string> sids_;    ///< new ones, by where the old ones are
    std::map<std::size_t, std::string> arrays_;  ///< likewise, of joints
    std::string_view twoSkeletons_;
    const char* text_ = nullptr;
};

}  // namespace stx
