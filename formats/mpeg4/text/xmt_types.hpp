#pragma once

#include <optional>
#include <string_view>

#include "formats/mpeg4/scene/node_table.hpp"

namespace stx::mpeg4 {

/// The names that XMT-A has for types of fields, as another implementation writes them.
struct XmtType {
    std::string_view name;
    FieldType type;
};
inline constexpr XmtType kXmtTypes[] = {
    {"Boolean", FieldType::SFBool},       {"Integer", FieldType::SFInt32},
    {"Float", FieldType::SFFloat},        {"Time", FieldType::SFTime},
    {"String", FieldType::SFString},      {"URL", FieldType::SFURL},
    {"Vector2", FieldType::SFVec2f},      {"Vector3", FieldType::SFVec3f},
    {"Vector4", FieldType::SFVec4f},      {"Color", FieldType::SFColor},
    {"Rotation", FieldType::SFRotation},  {"Image", FieldType::SFImage},
    {"Node", FieldType::SFNode},          {"Integers", FieldType::MFInt32},
    {"Floats", FieldType::MFFloat},       {"Times", FieldType::MFTime},
    {"Strings", FieldType::MFString},     {"URLs", FieldType::MFURL},
    {"Vector2Array", FieldType::MFVec2f}, {"Vector3Array", FieldType::MFVec3f},
    {"Vector4Array", FieldType::MFVec4f}, {"Colors", FieldType::MFColor},
    {"Rotations", FieldType::MFRotation}, {"Nodes", FieldType::MFNode},
    {"Booleans", FieldType::MFBool},      {"Images", FieldType::MFImage},
};

/// By that name, or by the one that BT has.
[[nodiscard]] inline std::optional<FieldType> typeOfXmtName(std::string_view name) {
    for (const XmtType& entry : kXmtTypes)
        if (entry.name == name) return entry.type;
    return fieldTypeOfName(name);
}
[[nodiscard]] inline std::string_view xmtNameOf(FieldType type) {
    for (const XmtType& entry : kXmtTypes)
        if (entry.type == type) return entry.name;
    return name(type);
}

}  // namespace stx::mpeg4
