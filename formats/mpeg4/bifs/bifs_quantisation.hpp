#pragma once

#include <optional>

#include "formats/mpeg4/bifs/bit_stream.hpp"
#include "formats/mpeg4/scene/scene.hpp"

/// Quantised values of BIFS (ISO/IEC 14496-11 8.4), which a QuantizationParameter node switches on
/// for its later siblings and all below them.
namespace stx::mpeg4 {

/// How the numbers of one field are coded.
struct QuantisedCoding {
    enum class Kind { linearFloat, linearInt, normal, rotation } kind = Kind::linearFloat;
    int bits = 0;                   ///< 1..31 for each number
    double minimum[3] = {0, 0, 0};  ///< per component
    double maximum[3] = {0, 0, 0};
};

/// The QuantizationParameter in force while a scene is coded.
class QuantisationScope {
  public:
    /// The node in force; null for none.
    [[nodiscard]] const Node* active() const { return active_.get(); }
    /// What is in force outside of all lists (the command GLOBALQP); null, or another node: none.
    void setGlobal(NodePtr node) {
        active_ = node && node->is("QuantizationParameter") ? std::move(node) : nullptr;
    }
    /// Whether floats without a quantisation of their own use the short form.
    [[nodiscard]] bool usesEfficientFloats() const {
        return active_ && active_->get<bool>("useEfficientCoding");
    }
    /// How a field is quantised now; nothing when it is coded in full. Errors (invalidInput) on a
    /// number of bits that cannot be, and on indices whose coordinates were not coded before.
    [[nodiscard]] Result<std::optional<QuantisedCoding>> codingOf(const FieldInfo& field) const;

    /// Tells of each field that was coded: indices have as many bits as the coordinates of their
    /// geometry need.
    void coded(const FieldInfo& field, const FieldValue& value);
    /// The coordinates of one node's fields, while it is coded.
    class NodeGuard {
      public:
        explicit NodeGuard(QuantisationScope& scope)
            : scope_(scope), outer_(std::exchange(scope.coordinates_, 0)) {}
        NodeGuard(const NodeGuard&) = delete;
        NodeGuard& operator=(const NodeGuard&) = delete;
        ~NodeGuard() { scope_.coordinates_ = outer_; }

      private:
        QuantisationScope& scope_;
        std::size_t outer_;
    };

    /// Follows one list of nodes: put every item in after it was coded.
    class ListGuard {
      public:
        explicit ListGuard(QuantisationScope& scope) : scope_(scope), outer_(scope.active_) {}
        ListGuard(const ListGuard&) = delete;
        ListGuard& operator=(const ListGuard&) = delete;
        ~ListGuard() { scope_.active_ = std::move(outer_); }
        void coded(const NodePtr& item);

      private:
        QuantisationScope& scope_;
        NodePtr outer_;
        bool local_ = false;
    };

  private:
    NodePtr active_;
    std::size_t coordinates_ = 0;
};

[[nodiscard]] float readQuantised(BitReader& in, const QuantisedCoding& coding, int component);
/// `value` must be within the bounds. Gives what is read back, as the other writers here do.
float writeQuantised(BitWriter& out, const QuantisedCoding& coding, int component, float value);

/// Two or three numbers on the unit sphere (normals and rotations).
[[nodiscard]] glm::vec3 readQuantisedNormal(BitReader& in, const QuantisedCoding& coding);
glm::vec3 writeQuantisedNormal(BitWriter& out, const QuantisedCoding& coding,
                               const glm::vec3& normal);
[[nodiscard]] Rotation readQuantisedRotation(BitReader& in, const QuantisedCoding& coding);
Rotation writeQuantisedRotation(BitWriter& out, const QuantisedCoding& coding,
                                const Rotation& rotation);

/// The short form of floats: 15 bits of mantissa at most.
[[nodiscard]] float readEfficientFloat(BitReader& in);
float writeEfficientFloat(BitWriter& out, float value);

}  // namespace stx::mpeg4
