#pragma once

#include <limits>
#include <numbers>
#include <string_view>
#include <vector>

#include "formats/mpeg4/scene/node_table.hpp"

/// The notation of the rows in node_rows.cpp; node_table.cpp makes NodeInfo of them.
namespace stx::mpeg4 {

inline constexpr float kMax = std::numeric_limits<float>::max();  ///< the standard's +I
inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr float kTwoPi = 2 * kPi;
inline constexpr float kHalfPi = kPi / 2;

/// One field in the notation of the rows.
struct FieldRow {
    FieldInfo info;

    FieldRow byDefault(std::string_view text) const {
        FieldRow row = *this;
        row.info.defaultText = text;
        return row;
    }
    FieldRow quantised(Quantisation category) const {
        FieldRow row = *this;
        row.info.quantisation = category;
        return row;
    }
    /// Category 13: always this many bits where a QuantizationParameter is active.
    FieldRow linear(int bits) const {
        FieldRow row = quantised(Quantisation::linear);
        row.info.quantisationBits = bits;
        return row;
    }
    FieldRow within(float minimum, float maximum) const {
        FieldRow row = *this;
        row.info.minimum = minimum;
        row.info.maximum = maximum;
        return row;
    }
    /// Can be animated.
    FieldRow dynamic() const {
        FieldRow row = *this;
        row.info.isDynamic = true;
        return row;
    }
};

inline FieldRow makeFieldRow(FieldKind kind, std::string_view name, FieldType type, Ndt nodeType) {
    FieldRow row;
    row.info.kind = kind;
    row.info.name = name;
    row.info.type = type;
    row.info.nodeType = nodeType;
    return row;
}
inline FieldRow field(std::string_view name, FieldType type, Ndt nodeType = Ndt::none) {
    return makeFieldRow(FieldKind::field, name, type, nodeType);
}
inline FieldRow exposed(std::string_view name, FieldType type, Ndt nodeType = Ndt::none) {
    return makeFieldRow(FieldKind::exposedField, name, type, nodeType);
}
inline FieldRow eventIn(std::string_view name, FieldType type, Ndt nodeType = Ndt::none) {
    return makeFieldRow(FieldKind::eventIn, name, type, nodeType);
}
inline FieldRow eventOut(std::string_view name, FieldType type, Ndt nodeType = Ndt::none) {
    return makeFieldRow(FieldKind::eventOut, name, type, nodeType);
}

/// One node: name, numbers as {node data type, version, code}, fields in the order of their ids.
struct NodeRow {
    std::string_view name;
    std::vector<NodeCode> codes;
    std::vector<FieldRow> fields;
};
inline NodeRow node(std::string_view name, std::vector<NodeCode> codes,
                    std::vector<FieldRow> fields) {
    return {name, std::move(codes), std::move(fields)};
}

/// The rows, made at each call.
[[nodiscard]] std::vector<NodeRow> makeNodeRows();

}  // namespace stx::mpeg4
