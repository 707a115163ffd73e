#pragma once

#include <optional>

#include "formats/mpeg4/scene/node_table.hpp"
#include "lib/base/result.hpp"

namespace stx::mpeg4 {

/// Fields that a Script or an interface may have of its own.
inline constexpr int kMaxOwnFields = 256;
/// PROTOs of a scene; declarations hold each other, and letting go of a chain takes stack.
inline constexpr std::size_t kMaxProtos = 1000;

/// The codes of field types in the interfaces of Scripts and PROTOs (ISO/IEC 14496-11; SFURL and
/// MFURL as another implementation codes them). A list is its item with 32 added.
struct InterfaceType {
    int code;
    FieldType type;
};
inline constexpr InterfaceType kInterfaceTypes[] = {
    {0, FieldType::SFBool},      {1, FieldType::SFFloat},  {2, FieldType::SFTime},
    {3, FieldType::SFInt32},     {4, FieldType::SFString}, {5, FieldType::SFVec3f},
    {6, FieldType::SFVec2f},     {7, FieldType::SFColor},  {8, FieldType::SFRotation},
    {9, FieldType::SFImage},     {10, FieldType::SFNode},  {11, FieldType::SFVec4f},
    {12, FieldType::SFURL},      {32, FieldType::MFBool},  {33, FieldType::MFFloat},
    {34, FieldType::MFTime},     {35, FieldType::MFInt32}, {36, FieldType::MFString},
    {37, FieldType::MFVec3f},    {38, FieldType::MFVec2f}, {39, FieldType::MFColor},
    {40, FieldType::MFRotation}, {41, FieldType::MFImage}, {42, FieldType::MFNode},
    {43, FieldType::MFVec4f},    {47, FieldType::MFURL},
};

[[nodiscard]] inline Result<int> interfaceCode(FieldType type) {
    for (const InterfaceType& entry : kInterfaceTypes)
        if (entry.type == type) return entry.code;
    return fail(ErrorCode::unsupported, "a field of type {} has no code in an interface",
                name(type));
}
[[nodiscard]] inline std::optional<FieldType> interfaceType(int code) {
    for (const InterfaceType& entry : kInterfaceTypes)
        if (entry.code == code) return entry.type;
    return {};
}

}  // namespace stx::mpeg4
