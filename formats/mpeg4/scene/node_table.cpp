#include "formats/mpeg4/scene/node_table.hpp"

#include <array>
#include <bit>
#include <unordered_map>

#include "formats/files/no_case.hpp"
#include "formats/mpeg4/scene/node_rows.hpp"

namespace stx::mpeg4 {
namespace {

constexpr std::array<std::string_view, 31> kTypeNames = {
    "SFBool",          "SFInt32",   "SFFloat",    "SFTime",     "SFString", "SFURL",    "SFVec2f",
    "SFVec3f",         "SFColor",   "SFRotation", "SFImage",    "SFNode",   "SFVec4f",  "SFScript",
    "SFCommandBuffer", "SFAttrRef", "MFInt32",    "MFFloat",    "MFTime",   "MFString", "MFURL",
    "MFVec2f",         "MFVec3f",   "MFColor",    "MFRotation", "MFNode",   "MFVec4f",  "MFScript",
    "MFAttrRef",       "MFBool",    "MFImage"};
constexpr std::array<std::string_view, 4> kKindNames = {"field", "exposedField", "eventIn",
                                                        "eventOut"};
constexpr std::array<std::string_view, 16> kQuantisationNames = {
    "none",   "position3D", "position2D", "drawOrder", "color",    "textureCoordinate",
    "angle",  "scale",      "key",        "normal",    "rotation", "size3D",
    "size2D", "linear",     "coordIndex", "reserved"};

/// A node data type and the bits of its codes in versions 1 to 10, as the standard's tables have
/// them.
struct NdtRow {
    std::string_view name;
    std::array<std::uint8_t, kNdtVersions> codeBits;
};
constexpr NdtRow kNdtRows[] = {
    {"none", {}},
    {"SFWorldNode", {7, 4, 2, 3, 6, 4, 4, 2, 3, 3}},
    {"SF3DNode", {6, 3, 2, 3, 5, 3, 3, 1, 3, 3}},
    {"SF2DNode", {5, 2, 2, 3, 4, 3, 2, 1, 0, 3}},
    {"SFTopNode", {3, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFTextureNode", {3, 1, 0, 1, 1, 2, 1, 0, 0, 1}},
    {"SFDepthImageNode", {0, 1, 0, 0, 1, 0, 1, 0, 0, 0}},
    {"SFDepthTextureNode", {0, 1, 0, 0, 2, 0, 2, 0, 0, 0}},
    {"SFNormalNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFAppearanceNode", {1, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFGeometryNode", {5, 2, 0, 0, 4, 2, 0, 0, 3, 0}},
    {"SFMaterialNode", {2, 2, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFTextureTransformNode", {1, 1, 0, 0, 0, 1, 0, 0, 0, 0}},
    {"SFViewpointNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFNavigationInfoNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFBackground3DNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFStreamingNode", {3, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFColorNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFCoordinateNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFTextureCoordinateNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFFogNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFBackground2DNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFViewportNode", {0, 1, 0, 0, 0, 1, 0, 0, 0, 0}},
    {"SFAudioNode", {3, 1, 0, 0, 0, 0, 2, 0, 0, 0}},
    {"SFCoordinate2DNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFExpressionNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFFaceDefMeshNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFFaceDefTablesNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFFaceDefTransformNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFFAPNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFFDPNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFFITNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFFontStyleNode", {1, 1, 0, 0, 0, 1, 0, 0, 0, 0}},
    {"SFLinePropertiesNode", {1, 1, 0, 0, 0, 1, 0, 0, 0, 0}},
    {"SFVisemeNode", {1, 1, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFBAPNode", {0, 2, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFBDPNode", {0, 2, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFBodyDefTableNode", {0, 2, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFBodySegmentConnectionHintNode", {0, 2, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFPerceptualParameterNode", {0, 2, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"SFTemporalNode", {0, 1, 2, 0, 0, 0, 0, 0, 0, 0}},
    {"SFBlendListNode", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFFrameListNode", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFLightMapNode", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFSurfaceMapNode", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFViewMapNode", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFParticleInitializerNode", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFInfluenceNode", {0, 1, 0, 0, 2, 0, 0, 0, 0, 0}},
    {"SFSBBoneNode", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFSBMuscleNode", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFSBSegmentNode", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFSBSiteNode", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFBaseMeshNode", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFSubdivSurfaceSectorNode", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0}},
    {"SFMusicScoreNode", {0, 1, 0, 0, 0, 0, 0, 1, 0, 0}},
};

template <class Value, class Names>
std::optional<Value> valueOfName(const Names& names, std::string_view name) {
    for (std::size_t i = 0; i < std::size(names); ++i)
        if (names[i] == name) return static_cast<Value>(i);
    return {};
}

int idBits(std::size_t count) {
    return count < 2 ? 0 : static_cast<int>(std::bit_width(count - 1));
}

}  // namespace

NodeInfo makeNodeInfo(std::string name, std::vector<NodeCode> codes,
                      const std::vector<FieldInfo>& fields, int ownFields) {
    NodeInfo node;
    node.name = std::move(name);
    node.codes = std::move(codes);
    int dynamicFields = 0;
    int valueFields = 0;
    for (FieldInfo info : fields) {
        info.index = static_cast<int>(node.fields.size());
        const bool exposedField = info.kind == FieldKind::exposedField;
        if (exposedField || info.kind == FieldKind::field) {
            info.defId = valueFields++;
            if (info.index < static_cast<int>(fields.size()) - ownFields)
                node.defFields.push_back(info.index);
        }
        if (exposedField || info.kind == FieldKind::eventIn) {
            info.inId = static_cast<int>(node.inFields.size());
            node.inFields.push_back(info.index);
            if (info.isDynamic) info.dynId = dynamicFields++;
        }
        if (exposedField || info.kind == FieldKind::eventOut) {
            info.outId = static_cast<int>(node.outFields.size());
            node.outFields.push_back(info.index);
        }
        node.fields.push_back(std::move(info));
    }
    node.defBits = idBits(node.defFields.size());
    node.inBits = idBits(node.inFields.size());
    node.outBits = idBits(node.outFields.size());
    return node;
}

namespace {

std::uint32_t codeKey(Ndt type, int version, int code) {
    return static_cast<std::uint32_t>(type) << 16 | static_cast<std::uint32_t>(version) << 8 |
           static_cast<std::uint32_t>(code);
}

struct Tables {
    std::vector<NodeInfo> nodes;
    std::unordered_map<std::string_view, const NodeInfo*> byName;
    std::unordered_map<std::uint32_t, const NodeInfo*> byCode;

    Tables() {
        for (const NodeRow& row : makeNodeRows())
            nodes.push_back(makeNodeInfo(row.name, row.codes, row.fields));
        for (const NodeInfo& info : nodes) {
            byName.emplace(info.name, &info);
            for (const NodeCode& code : info.codes)
                byCode.emplace(codeKey(code.type, code.version, code.code), &info);
        }
    }
};

const Tables& tables() {
    static const Tables instance;
    return instance;
}

}  // namespace

std::string_view name(FieldType type) {
    return kTypeNames[static_cast<std::size_t>(type)];
}
std::string_view name(Ndt type) {
    return kNdtRows[static_cast<std::size_t>(type)].name;
}
std::optional<FieldType> fieldTypeOfName(std::string_view name) {
    return valueOfName<FieldType>(kTypeNames, name);
}
std::optional<Ndt> ndtOfName(std::string_view name) {
    for (std::size_t i = 1; i < std::size(kNdtRows); ++i)
        if (kNdtRows[i].name == name) return static_cast<Ndt>(i);
    return {};
}
std::optional<FieldKind> fieldKindOfName(std::string_view name) {
    return valueOfName<FieldKind>(kKindNames, name);
}
std::optional<Quantisation> quantisationOfName(std::string_view name) {
    return valueOfName<Quantisation>(kQuantisationNames, name);
}
std::string_view name(FieldKind kind) {
    return kKindNames[static_cast<std::size_t>(kind)];
}

bool isMultiple(FieldType type) {
    return type >= FieldType::MFInt32;
}

FieldType itemType(FieldType type) {
    using enum FieldType;
    switch (type) {
        case MFInt32:
            return SFInt32;
        case MFFloat:
            return SFFloat;
        case MFTime:
            return SFTime;
        case MFString:
            return SFString;
        case MFURL:
            return SFURL;
        case MFVec2f:
            return SFVec2f;
        case MFVec3f:
            return SFVec3f;
        case MFColor:
            return SFColor;
        case MFRotation:
            return SFRotation;
        case MFNode:
            return SFNode;
        case MFVec4f:
            return SFVec4f;
        case MFScript:
            return SFScript;
        case MFAttrRef:
            return SFAttrRef;
        case MFBool:
            return SFBool;
        case MFImage:
            return SFImage;
        default:
            return type;
    }
}

std::optional<int> codeBits(Ndt type, int version) {
    const auto row = static_cast<std::size_t>(type);
    if (row == 0 || row >= std::size(kNdtRows) || version < 1 || version > kNdtVersions) return {};
    return kNdtRows[row].codeBits[version - 1];
}

int NodeInfo::find(std::string_view fieldName) const {
    for (const FieldInfo& info : fields)
        if (info.name == fieldName) return info.index;
    return -1;
}

int NodeInfo::findIgnoringCase(std::string_view fieldName) const {
    if (const int exact = find(fieldName); exact >= 0) return exact;
    for (const FieldInfo& info : fields)
        if (equalNoCase(info.name, fieldName)) return info.index;
    return -1;
}

const NodeCode* NodeInfo::codeIn(Ndt type) const {
    static const NodeCode protoCode{Ndt::none, 2, 1};
    if (isProto) return &protoCode;
    for (const NodeCode& code : codes)
        if (code.type == type) return &code;
    return nullptr;
}

std::span<const NodeInfo> allNodes() {
    return tables().nodes;
}

const NodeInfo* findNode(std::string_view name) {
    const auto found = tables().byName.find(name);
    return found == tables().byName.end() ? nullptr : found->second;
}

const NodeInfo* findNode(Ndt type, int version, int code) {
    if (code < 1 || code > 255) return nullptr;
    const auto found = tables().byCode.find(codeKey(type, version, code));
    return found == tables().byCode.end() ? nullptr : found->second;
}

}  // namespace stx::mpeg4
