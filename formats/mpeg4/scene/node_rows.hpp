#pragma once

#include <string>
#include <vector>

#include "formats/mpeg4/scene/node_table.hpp"

// clang-format off
/// The rows of the node table as the files of the folder nodes write them; node_table.cpp makes
/// NodeInfo of them. A node is a line with its name and its codes, then an indented line for each
/// field, in the order of the standard, from which all field ids follow:
///
///     Transform SFWorldNode:1.94 SF3DNode:1.47                 node data type:version.code
///       eventIn MFNode<SF3DNode> addChildren                   kind, type<what nodes it takes>, name
///       exposedField SFVec3f scale 1 1 1 ; scale dynamic 0 +I
///
/// Codes are the numbers in the bits of a stream: in version 2 they begin at 2.
/// After the name comes the default (left out for [], "" and NULL; a list has no brackets). After a
/// semicolon: the quantisation (a name of Quantisation; linear10 is linear in 10 bits), `dynamic`
/// when BIFS-Anim can animate the field, and two bounds (left out for -I +I; I is infinite).
/// Lines that begin with # are remarks.
// clang-format on
namespace stx::mpeg4 {

/// One node: name, numbers as {node data type, version, code}, fields in the order of their ids.
/// The ids themselves are not filled in.
struct NodeRow {
    std::string name;
    std::vector<NodeCode> codes;
    std::vector<FieldInfo> fields;
};

/// The rows of a text in that notation. A line that is not of it is a mistake of ours (assertion).
[[nodiscard]] std::vector<NodeRow> nodeRowsOf(std::string_view text);
/// All rows, made at each call.
[[nodiscard]] std::vector<NodeRow> makeNodeRows();

}  // namespace stx::mpeg4
