#include "formats/mpeg4/scene/node_rows.hpp"

#include <cassert>
#include <limits>

#include "lib/base/whole_number.hpp"

namespace stx::mpeg4 {
namespace {

// Each file is one raw string.
constexpr std::string_view kNodeTexts[] = {
#include "formats/mpeg4/scene/nodes/version1_a_f.inc"
    ,
#include "formats/mpeg4/scene/nodes/version1_g_p.inc"
    ,
#include "formats/mpeg4/scene/nodes/version1_q_z.inc"
    ,
#include "formats/mpeg4/scene/nodes/version2_body.inc"
    ,
#include "formats/mpeg4/scene/nodes/version2_to_4.inc"
    ,
#include "formats/mpeg4/scene/nodes/version5.inc"
    ,
#include "formats/mpeg4/scene/nodes/version6_to_10.inc"
};

/// Takes what is before the next `mark` off the front of `text`, and the mark.
std::string_view takeUntil(std::string_view& text, char mark) {
    const std::string_view part = text.substr(0, text.find(mark));
    text.remove_prefix(std::min(text.size(), part.size() + 1));
    return part;
}

int integerOf(std::string_view text) {
    const auto value = wholeNumber<int>(text);
    assert(value);
    return value.value_or(0);
}

float boundOf(std::string_view text) {
    if (text == "+I") return std::numeric_limits<float>::max();
    if (text == "-I") return -std::numeric_limits<float>::max();
    const auto value = wholeNumber<float>(text);
    assert(value);
    return value.value_or(0.0f);
}

/// `scale dynamic 0 +I`
void readAttributes(std::string_view text, FieldInfo& field) {
    while (!text.empty()) {
        const std::string_view word = takeUntil(text, ' ');
        if (word.empty()) continue;
        if (word == "dynamic") {
            field.isDynamic = true;
        } else if (word.starts_with("linear")) {
            field.quantisation = Quantisation::linear;
            field.quantisationBits = integerOf(word.substr(6));
        } else if (const auto category = quantisationOfName(word)) {
            field.quantisation = *category;
        } else {
            field.minimum = boundOf(word);
            field.maximum = boundOf(takeUntil(text, ' '));
        }
    }
}

/// `exposedField SFVec3f scale 1 1 1 ; scale dynamic 0 +I`
FieldInfo fieldOf(std::string_view line) {
    FieldInfo field;
    const auto mark = line.find(" ; ");
    if (mark != std::string_view::npos) {
        readAttributes(line.substr(mark + 3), field);
        line = line.substr(0, mark);
    }
    const auto kind = fieldKindOfName(takeUntil(line, ' '));
    std::string_view type = takeUntil(line, ' ');
    const auto fieldType = fieldTypeOfName(takeUntil(type, '<'));
    assert(kind && fieldType);
    field.kind = *kind;
    field.type = *fieldType;
    if (!type.empty()) {
        const auto nodeType = ndtOfName(takeUntil(type, '>'));
        assert(nodeType);
        field.nodeType = *nodeType;
    }
    field.name = takeUntil(line, ' ');
    field.defaultText = line;
    return field;
}

/// `Transform SFWorldNode:1.94 SF3DNode:1.47`
NodeRow nodeOf(std::string_view line) {
    NodeRow node;
    node.name = takeUntil(line, ' ');
    while (!line.empty()) {
        std::string_view code = takeUntil(line, ' ');
        const auto type = ndtOfName(takeUntil(code, ':'));
        assert(type);
        const int version = integerOf(takeUntil(code, '.'));
        node.codes.push_back({*type, version, integerOf(code)});
    }
    return node;
}

}  // namespace

std::vector<NodeRow> nodeRowsOf(std::string_view text) {
    std::vector<NodeRow> rows;
    while (!text.empty()) {
        const std::string_view line = takeUntil(text, '\n');
        if (line.empty() || line[0] == '#') continue;
        if (line[0] != ' ') {
            rows.push_back(nodeOf(line));
        } else {
            assert(!rows.empty() && line.starts_with("  "));
            rows.back().fields.push_back(fieldOf(line.substr(2)));
        }
    }
    return rows;
}

std::vector<NodeRow> makeNodeRows() {
    std::vector<NodeRow> rows;
    for (const std::string_view text : kNodeTexts)
        for (NodeRow& row : nodeRowsOf(text)) rows.push_back(std::move(row));
    return rows;
}

}  // namespace stx::mpeg4
