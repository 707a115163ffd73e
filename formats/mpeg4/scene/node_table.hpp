#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// The one table of MPEG-4 nodes from which the BIFS reader and writer, the BT and XMT-A forms and
/// the validator work. The rows are in the folder nodes; adding a node is adding its lines there.
/// All identifiers of fields and the widths of their codes are derived from the rows.
/// Source: ISO/IEC 14496-11, annex H (node coding tables), and ISO/IEC 14496-16, 4.5.4.
namespace stx::mpeg4 {

/// The type of a field's value. The order is that of the alternatives of FieldValue (scene.hpp).
enum class FieldType : std::uint8_t {
    SFBool,
    SFInt32,
    SFFloat,
    SFTime,
    SFString,
    SFURL,
    SFVec2f,
    SFVec3f,
    SFColor,
    SFRotation,
    SFImage,
    SFNode,
    SFVec4f,
    SFScript,
    SFCommandBuffer,
    SFAttrRef,
    MFInt32,
    MFFloat,
    MFTime,
    MFString,
    MFURL,
    MFVec2f,
    MFVec3f,
    MFColor,
    MFRotation,
    MFNode,
    MFVec4f,
    MFScript,
    MFAttrRef,
    MFBool,  ///< of Scripts and PROTOs only, as MFImage
    MFImage,
};

/// "SFVec3f", and back.
[[nodiscard]] std::string_view name(FieldType type);
[[nodiscard]] std::optional<FieldType> fieldTypeOfName(std::string_view name);
[[nodiscard]] bool isMultiple(FieldType type);     ///< MFxxx
[[nodiscard]] FieldType itemType(FieldType type);  ///< SFxxx of MFxxx; SFxxx is its own

enum class FieldKind : std::uint8_t { field, exposedField, eventIn, eventOut };

/// "exposedField"
[[nodiscard]] std::string_view name(FieldKind kind);
[[nodiscard]] std::optional<FieldKind> fieldKindOfName(std::string_view name);

/// Node data types: what kind of node a field takes. A node is coded by its number within one.
enum class Ndt : std::uint8_t {
    none,
    SFWorldNode,
    SF3DNode,
    SF2DNode,
    SFTopNode,
    SFTextureNode,
    SFDepthImageNode,
    SFDepthTextureNode,
    SFNormalNode,
    SFAppearanceNode,
    SFGeometryNode,
    SFMaterialNode,
    SFTextureTransformNode,
    SFViewpointNode,
    SFNavigationInfoNode,
    SFBackground3DNode,
    SFStreamingNode,
    SFColorNode,
    SFCoordinateNode,
    SFTextureCoordinateNode,
    SFFogNode,
    SFBackground2DNode,
    SFViewportNode,
    SFAudioNode,
    SFCoordinate2DNode,
    SFExpressionNode,
    SFFaceDefMeshNode,
    SFFaceDefTablesNode,
    SFFaceDefTransformNode,
    SFFAPNode,
    SFFDPNode,
    SFFITNode,
    SFFontStyleNode,
    SFLinePropertiesNode,
    SFVisemeNode,
    SFBAPNode,
    SFBDPNode,
    SFBodyDefTableNode,
    SFBodySegmentConnectionHintNode,
    SFPerceptualParameterNode,
    SFTemporalNode,
    SFBlendListNode,
    SFFrameListNode,
    SFLightMapNode,
    SFSurfaceMapNode,
    SFViewMapNode,
    SFParticleInitializerNode,
    SFInfluenceNode,
    SFSBBoneNode,
    SFSBMuscleNode,
    SFSBSegmentNode,
    SFSBSiteNode,
    SFBaseMeshNode,
    SFSubdivSurfaceSectorNode,
    SFMusicScoreNode,
};
[[nodiscard]] std::string_view name(Ndt type);
/// By exact name; nothing when there is none.
[[nodiscard]] std::optional<Ndt> ndtOfName(std::string_view name);

/// Versions of the node code tables, 1..kNdtVersions; code 0 in one leads to the next.
inline constexpr int kNdtVersions = 10;

/// Bits of a node code in `version` (1..10) of a node data type; empty for Ndt::none. Version 2
/// always has a bit, since its code 1 is an instance of a PROTO.
[[nodiscard]] std::optional<int> codeBits(Ndt type, int version);

/// Quantisation categories with their numbers in the standard.
enum class Quantisation : std::uint8_t {
    none,
    position3D,
    position2D,
    drawOrder,
    color,
    textureCoordinate,
    angle,
    scale,
    key,
    normal,
    rotation,
    size3D,
    size2D,
    linear,
    coordIndex,
    reserved,  ///< of SFVec4f: never quantised
};
/// By its name here.
[[nodiscard]] std::optional<Quantisation> quantisationOfName(std::string_view name);

/// One field of a node type.
struct FieldInfo {
    std::string name;
    FieldKind kind = FieldKind::field;
    FieldType type = FieldType::SFBool;
    Ndt nodeType = Ndt::none;  ///< what node-valued fields take
    std::string defaultText;   ///< as in BT; empty: [], "" or NULL
    Quantisation quantisation = Quantisation::none;
    int quantisationBits = 0;  ///< for Quantisation::linear
    /// Inclusive; ±FLT_MAX where the standard says ±I. Informative: readers do not enforce it.
    float minimum = -std::numeric_limits<float>::max();
    float maximum = std::numeric_limits<float>::max();
    /// Position in the node ("all" id), and in the DEF, IN, OUT and DYN modes; -1: not in it.
    int index = -1;
    int defId = -1;
    int inId = -1;
    int outId = -1;
    int dynId = -1;
    bool isDynamic = false;  ///< can be animated (BIFS-Anim)

    /// Field or exposedField: has a value and a default, is written with the node.
    [[nodiscard]] bool hasValue() const { return defId >= 0; }
};

/// The number of a node type within one node data type.
struct NodeCode {
    Ndt type = Ndt::none;
    int version = 1;
    int code = 0;
};

struct FieldDefaults;

/// One node type. Those of the table exist once each; a Script with fields of its own and a PROTO
/// bring types of their own. Compare with sameType (scene.hpp).
struct NodeInfo {
    std::string name;
    std::vector<NodeCode> codes;
    /// Of a type that is not in the table: the defaults of its fields.
    std::shared_ptr<const FieldDefaults> defaults;
    bool isProto =
        false;  ///< an instance may stand anywhere; its code is followed by the PROTO's id
    std::vector<FieldInfo> fields;  ///< in table order, which is the order of all ids
    /// Index into fields for each DEF id. Fields that a Script has of its own are not among them:
    /// they are coded with its program.
    std::vector<int> defFields;
    std::vector<int> inFields;
    std::vector<int> outFields;
    int defBits = 0;  ///< width of a DEF id
    int inBits = 0;
    int outBits = 0;

    /// Index of a field by its exact name, -1 when there is none.
    [[nodiscard]] int find(std::string_view fieldName) const;
    /// The same without regard to case (BT).
    [[nodiscard]] int findIgnoringCase(std::string_view fieldName) const;
    /// How this node is coded where a `type` is expected; null when it may not be there.
    [[nodiscard]] const NodeCode* codeIn(Ndt type) const;
};

/// A type with all ids of its fields. The last `ownFields` of them are a Script's own.
[[nodiscard]] NodeInfo makeNodeInfo(std::string name, std::vector<NodeCode> codes,
                                    const std::vector<FieldInfo>& fields, int ownFields = 0);

/// All node types, in table order.
[[nodiscard]] std::span<const NodeInfo> allNodes();
/// By exact name; null when unknown.
[[nodiscard]] const NodeInfo* findNode(std::string_view name);
/// By number; null when that number is not in our table.
[[nodiscard]] const NodeInfo* findNode(Ndt type, int version, int code);

}  // namespace stx::mpeg4
