#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <variant>
#include <vector>

#include <glm/glm.hpp>

#include "formats/mpeg4/scene/node_table.hpp"
#include "lib/base/job.hpp"

// clang-format off
/// The MPEG-4 scene graph: nodes with typed field values, routes and commands. How to use it:
///
///     NodePtr view = makeNode("DepthImage");                      // null for unknown names only
///     view->set("position", glm::vec3(0, 0, 10));                 // the type is checked
///     view->set("diTexture", makeNode("SimpleTexture"));
///     const glm::vec2 fov = view->get<glm::vec2>("fieldOfView");  // the default when not set
///     group->edit<NodeList>("children").push_back(view);
///     view->defName = "VIEW0";                                    // DEF; sharing a NodePtr is USE
///
/// `Document` (document.hpp) holds commands on such nodes with their times, and the streams.
// clang-format on
namespace stx::mpeg4 {

struct Node;
struct Proto;
/// A node, shared by all its USEs; null is NULL. Graphs have no cycles: readers refuse a node that
/// USEs one it is in, and who builds scenes must not make one.
using NodePtr = std::shared_ptr<Node>;
using NodeList = std::vector<NodePtr>;

/// SFColor: RGB in [0, 1].
struct Color {
    float r = 0, g = 0, b = 0;
    bool operator==(const Color&) const = default;
};

/// SFRotation: an axis, as written (not necessarily of length 1), and an angle in radians.
struct Rotation {
    glm::vec3 axis = {0, 0, 1};
    float angle = 0;
    bool operator==(const Rotation&) const = default;
};

/// SFURL: an object descriptor of the presentation, or a string.
struct Url {
    int objectDescriptorId = 0;  ///< 1..1023; 0: `text` holds
    std::string text;
    bool operator==(const Url&) const = default;
};

/// SFImage. Rows in the order of the file; mpeg4 and VRML both put row 0 at the bottom.
struct PixelImage {
    int width = 0;                     ///< 0..4095
    int height = 0;                    ///< 0..4095
    int components = 1;                ///< 1 grey, 2 grey alpha, 3 RGB, 4 RGBA
    std::vector<std::uint8_t> pixels;  ///< width*height*components
    bool operator==(const PixelImage&) const = default;
};

/// SFScript: a program of a Script node in source text, or where it is ("javascript: ...").
struct ScriptText {
    std::string text;
    bool operator==(const ScriptText&) const = default;
};

/// How wide the ids in coded commands are, and what is coded with them.
struct CommandCoding {
    int nodeIdBits = 0;
    int routeIdBits = 0;
    int protoIdBits = 0;
    bool useNames = false;
    bool usePredictiveMFField = false;
    bool operator==(const CommandCoding&) const = default;
};

/// SFCommandBuffer: BIFS commands as they are coded, with the ids of the stream they came in. They
/// name nodes by ids, not pointers: most change the very nodes that they are in.
struct CommandBuffer {
    std::vector<std::uint8_t> bytes;
    std::optional<CommandCoding> coding = {};  ///< nothing: as the stream that it is written to
    bool operator==(const CommandBuffer& other) const { return bytes == other.bytes; }
};

/// SFAttrRef: a field of a node. Readers refuse values; only the empty list of Storage occurs.
struct AttributeReference {
    bool operator==(const AttributeReference&) const = default;
};

using AnyFieldValue =
    std::variant<bool, std::int32_t, float, double, std::string, Url, glm::vec2, glm::vec3, Color,
                 Rotation, PixelImage, NodePtr, glm::vec4, ScriptText, CommandBuffer,
                 AttributeReference, std::vector<std::int32_t>, std::vector<float>,
                 std::vector<double>, std::vector<std::string>, std::vector<Url>,
                 std::vector<glm::vec2>, std::vector<glm::vec3>, std::vector<Color>,
                 std::vector<Rotation>, NodeList, std::vector<glm::vec4>, std::vector<ScriptText>,
                 std::vector<AttributeReference>, std::vector<bool>, std::vector<PixelImage>>;
/// The value of a field; alternatives in the order of FieldType. double is SFTime. Copied, moved
/// and destroyed in scene.cpp: code for that many types in each file took much of a build.
struct FieldValue : AnyFieldValue {
    using AnyFieldValue::AnyFieldValue;
    FieldValue();
    FieldValue(const FieldValue& other);
    FieldValue(FieldValue&& other) noexcept;
    FieldValue& operator=(const FieldValue& other);
    FieldValue& operator=(FieldValue&& other) noexcept;
    ~FieldValue();
};

/// Whether T is the C++ type of an MF value.
template <class T>
inline constexpr bool kIsList = false;
template <class T>
inline constexpr bool kIsList<std::vector<T>> = true;

[[nodiscard]] inline FieldType typeOf(const FieldValue& value) {
    return static_cast<FieldType>(value.index());
}
/// A value of a type: FALSE, 0, "", [], NULL.
[[nodiscard]] FieldValue emptyValue(FieldType type);
/// The default of a field that has one; emptyValue for events. Lives forever.
[[nodiscard]] const FieldValue& defaultValue(const NodeInfo& node, int fieldIndex);
/// The values of FieldInfo::defaultText for types that are not in the table, in order of fields.
struct FieldDefaults {
    std::vector<FieldValue> values;
};
/// Whether two types are one: the same of the table, or of the same name with the same fields.
[[nodiscard]] bool sameType(const NodeInfo& a, const NodeInfo& b);
/// Items of an MF value; 1 for an SF value.
[[nodiscard]] std::size_t itemCount(const FieldValue& value);

/// A node of the scene. Only fields that were set are stored; the others have their defaults.
struct Node : std::enable_shared_from_this<Node> {
    explicit Node(const NodeInfo& type) : info(&type) {}
    Node(const Node&) = default;
    Node& operator=(const Node&) = default;
    ~Node();  ///< takes no stack for deep graphs

    const NodeInfo* info;
    /// Of a Script with fields of its own: what `info` points to.
    std::shared_ptr<const NodeInfo> ownType;
    /// Of an instance of a PROTO, whose type `info` points to.
    std::shared_ptr<const Proto> proto;
    /// DEF: the id in BIFS, 1-based; 0 where none was coded. Writers give free ids to nodes that
    /// need one (a name, several uses, a route or a command that names them): see assignNodeIds.
    std::uint32_t defId = 0;
    std::string defName;  ///< DEF name of the text forms and of BIFS with USENAMES; may be empty
    /// Of a scene in time. When a command has last ended that the node loops, in seconds.
    double loopedUntil = -std::numeric_limits<double>::infinity();
    /// How a MovieTexture ran last.
    struct EndedRun {
        double start = 0, stop = 0;
        float speed = 1;
        double loopsUntil = 0;
    };
    /// Of a scene in time, when an event has changed a MovieTexture that had ended: what it shows
    /// until it starts anew.
    std::optional<EndedRun> ended;
    /// Of an instance in a scene in time: what the times in its body count from, in seconds.
    double begin = 0;

    struct SetField {
        int index;  ///< into info->fields
        FieldValue value;
    };
    std::vector<SetField> setFields;  ///< ascending by index, each once

    [[nodiscard]] bool is(std::string_view typeName) const { return info->name == typeName; }

    /// Whether a value was given, be it the default's.
    [[nodiscard]] bool isSet(int fieldIndex) const { return findSet(fieldIndex) != nullptr; }
    [[nodiscard]] bool isSet(std::string_view fieldName) const {
        return isSet(info->find(fieldName));
    }

    /// The value, or the default where none was given. The index must be in the table.
    [[nodiscard]] const FieldValue& value(int fieldIndex) const;
    [[nodiscard]] const FieldValue& value(std::string_view fieldName) const {
        return value(info->find(fieldName));
    }
    /// The same as a C++ type. A wrong name or type is a mistake of the program (assertion).
    template <class T>
    [[nodiscard]] const T& get(std::string_view fieldName) const {
        return std::get<T>(value(fieldName));
    }

    /// Sets a field. Returns false, changing nothing, when there is no such field with a value or
    /// its type is another. `set("farPlane", 3.0f)`: the type must match exactly.
    bool set(int fieldIndex, FieldValue newValue);
    bool set(std::string_view fieldName, FieldValue newValue) {
        return set(info->find(fieldName), std::move(newValue));
    }
    /// For changes in place; the default is copied in first where no value was set.
    [[nodiscard]] FieldValue& edit(int fieldIndex);
    template <class T>
    [[nodiscard]] T& edit(std::string_view fieldName) {
        return std::get<T>(edit(info->find(fieldName)));
    }
    /// Back to the default.
    void clear(int fieldIndex);

  private:
    [[nodiscard]] const SetField* findSet(int fieldIndex) const;
};

/// Of either version; the fields of an instance of a PROTO say nothing.
[[nodiscard]] inline bool isDepthImage(const Node& node) {
    return !node.proto && (node.is("DepthImage") || node.is("DepthImageV2"));
}

/// A node of a type; null when the table has none of that name.
[[nodiscard]] NodePtr makeNode(std::string_view typeName);
[[nodiscard]] NodePtr makeNode(const NodeInfo& type);

/// Adds a field to those that a Script has of its own, with its value where it has one. Field,
/// eventIn or eventOut. False, changing nothing, when the node is not a Script or has such a field.
[[nodiscard]] bool addScriptField(Node& script, FieldInfo field, std::optional<FieldValue> value);
/// How many of its fields are a Script's own: the last ones.
[[nodiscard]] int ownFieldCount(const Node& script);

/// An instance of a PROTO with the defaults of its interface.
[[nodiscard]] NodePtr makeInstance(const std::shared_ptr<const Proto>& proto);

/// Whether `node` may be in a field that takes `expected` (null may be in any).
[[nodiscard]] bool mayStandIn(const Node* node, Ndt expected);

/// ROUTE: from an eventOut (or exposedField) to an eventIn (or exposedField). Fields are indices
/// into the nodes' info->fields.
struct Route {
    std::uint32_t id = 0;  ///< DEF id of the route, 1-based; 0: none
    std::string name;      ///< DEF name
    NodePtr from;
    int fromField = 0;
    NodePtr to;
    int toField = 0;
};

/// A PROTO or EXTERNPROTO: an interface, and nodes whose fields it gives values to.
struct Proto {
    std::string name;
    std::uint32_t id = 0;
    NodeInfo type;  ///< the interface: isProto, with defaults
    bool isExtern = false;
    std::vector<Url> urls;  ///< of an EXTERNPROTO, which has nothing of what follows
    std::vector<std::shared_ptr<const Proto>> protos;
    NodeList body;  ///< the first is what an instance shows
    std::vector<Route> routes;
    /// `field IS protoField`: a field of a node of the body has the value of one of the interface.
    struct Link {
        NodePtr node;
        int field = 0;
        int protoField = 0;
    };
    std::vector<Link> links;
};
using ProtoPtr = std::shared_ptr<const Proto>;

/// Where an item goes or is: an index from 0, or the end.
struct Position {
    static constexpr int kLast = -1;
    int index = kLast;
    bool operator==(const Position&) const = default;
};

/// Commands of BIFS-Command (ISO/IEC 14496-11 8.6). Targets are the very nodes they change, as they
/// were when the command was read: nothing is applied until composeScene() does it.
struct ReplaceScene {
    bool useNames = false;  ///< DEF names are coded beside the ids
    NodePtr root;           ///< an SFTopNode; may be null
    std::vector<Route> routes;
    std::vector<ProtoPtr> protos = {};
};
struct ReplaceNode {
    NodePtr target;
    NodePtr replacement;
};
struct ReplaceField {
    NodePtr target;
    int field = 0;
    FieldValue value;
};
struct ReplaceIndexed {
    NodePtr target;
    int field = 0;  ///< an MF field
    Position position;
    FieldValue value;  ///< one item: of the SF type
};
struct ReplaceRoute {
    std::uint32_t routeId = 0;
    Route route;
};
struct InsertNode {
    NodePtr target;  ///< a grouping node: `node` goes into its `children`
    Position position;
    NodePtr node;
};
struct InsertIndexed {
    NodePtr target;
    int field = 0;
    Position position;
    FieldValue value;
};
struct InsertRoute {
    Route route;
};
struct DeleteNode {
    NodePtr target;
};
struct DeleteIndexed {
    NodePtr target;
    int field = 0;
    Position position;
};
struct DeleteRoute {
    std::uint32_t routeId = 0;
};
using AnyCommand =
    std::variant<ReplaceScene, ReplaceNode, ReplaceField, ReplaceIndexed, ReplaceRoute, InsertNode,
                 InsertIndexed, InsertRoute, DeleteNode, DeleteIndexed, DeleteRoute>;
/// One command; a class of its own for the reason that FieldValue is one.
struct Command : AnyCommand {
    using AnyCommand::AnyCommand;
    Command(const Command& other);
    Command(Command&& other) noexcept;
    Command& operator=(const Command& other);
    Command& operator=(Command&& other) noexcept;
    ~Command();
};

/// One access unit of the scene stream: commands that take effect together.
struct CommandFrame {
    std::uint64_t time = 0;  ///< in units of the stream's timescale
    std::vector<Command> commands;
    /// Whether a reader may begin here. The first of a stream always is such a place.
    bool randomAccess = false;
    /// Of an access unit with a command that is not known here: all of it, as it is coded.
    /// `commands` are those before that one.
    std::optional<CommandBuffer> coded = {};
};

/// A scene at one moment.
struct Scene {
    NodePtr root;
    std::vector<Route> routes;
    bool useNames = false;
    /// What changed since who asks for moments has last cleared these: whether nodes came or went,
    /// and the nodes of which fields have other values.
    bool restructured = true;
    std::unordered_set<const Node*> changed = {};
    /// Events of commands that have no effect here, as `TYPE.event`, and routes that these were to
    /// take, as textOf() has them.
    std::set<std::string> lostEvents = {};
};

/// Calls `visit` for each node reachable from `root` once, parents before children, in field order.
void forEachNode(const NodePtr& root, const std::function<void(const NodePtr&)>& visit);
/// The same for every node in a command: targets, values, both ends of routes.
void forEachNode(const Command& command, const std::function<void(const NodePtr&)>& visit);
/// The same for every node of all commands, each once.
void forEachNode(const std::vector<CommandFrame>& frames,
                 const std::function<void(const NodePtr&)>& visit);
/// The same, but only where `visit` says so with what is below a node.
void walkNodes(const Command& command, const std::function<bool(const NodePtr&)>& visit);
void walkNodes(const NodePtr& root, const std::function<bool(const NodePtr&)>& visit);

/// Compares everything but node-valued fields bit for bit.
[[nodiscard]] bool sameValue(const FieldValue& a, const FieldValue& b);

/// The longest way down from `root` in nodes, 0 for null. Errors (invalidInput) when a node
/// contains itself.
[[nodiscard]] Result<int> nestingDepth(const NodePtr& root);

/// A copy of the body of a PROTO, with the values of the instance where it has a link; the first
/// node is what the instance shows. Empty for an EXTERNPROTO. `copied`: how many nodes were.
[[nodiscard]] NodeList bodyOf(const Node& instance, std::size_t& copied);

/// A graph as it is shown: what an instance of a PROTO shows is in its place, and nothing where it
/// shows nothing. `root` itself without any instance; else nodes above one are copies, and
/// all others are the same nodes. Takes the nodes that are looked at from `budget`; null, with
/// that below 0, where it does not suffice. Adds the instances.
[[nodiscard]] NodePtr withoutInstances(NodePtr root, std::int64_t& budget, NodeList& instances);

/// As forEachNode(), but with all nodes of its body in place of each instance of a PROTO, and with
/// those that are in several instances visited again. False where there are more nodes than are
/// looked at: a few PROTOs that use each other in turn can have any number.
[[nodiscard]] bool forEachNodeInside(const std::vector<CommandFrame>& frames,
                                     const std::function<void(const NodePtr&)>& visit);

/// The nodes of the body of a PROTO and of those that it uses, as they are written; each PROTO
/// once.
void forEachNodeOf(const Proto& proto, const std::function<void(const NodePtr&)>& visit);

/// Whether a field is a moment and not a duration: a startTime or stopTime, or a field of an
/// instance that gives one its value.
[[nodiscard]] bool isMoment(const Node& node, int field);
/// The same of `loop`, and of any field of a node that has a `url`.
[[nodiscard]] bool isLoop(const Node& node, int field);
[[nodiscard]] bool isOfMedia(const Node& node, int field);

/// Makes the moments of a node that comes at `seconds` moments of the scene: all have a value then,
/// as 0 is one, too.
void shiftTimes(Node& node, double seconds);

/// The scene after the commands of all frames with time <= `until` on copies of their nodes. Errors
/// (invalidInput) when a command does not fit the scene it meets: an index out of range, a node
/// that is not there, or a cycle.
[[nodiscard]] Result<Scene> composeScene(const std::vector<CommandFrame>& frames,
                                         std::uint64_t until = ~std::uint64_t{0});

/// Whether a time-dependent node is active at a time of the scene, in seconds (ISO/IEC 14772-1,
/// 4.6.9).
using ActiveNode = std::function<bool(const Node& node, double now)>;

/// The scene at one moment after another. Going on in time costs the commands between; going back
/// starts anew.
class SceneInTime {
  public:
    /// `frames` must outlive this. startTime and stopTime that come with an access unit count from
    /// its time: BIFS has no other clock (VRML's counts from 1970), and the one widely used player
    /// does so. `timescale`: ticks a second of the frames; 0: not known, and times count from the
    /// scene's start, as they do with `timesFromStart`. Where `active` tells which nodes are so, a
    /// startTime, cycleInterval or speed that comes to one is ignored (14772-1, 4.6.9 and 6.28).
    explicit SceneInTime(const std::vector<CommandFrame>& frames, std::uint32_t timescale = 0,
                         bool timesFromStart = false, ActiveNode active = {});
    SceneInTime(SceneInTime&&) noexcept;
    SceneInTime& operator=(SceneInTime&&) noexcept;
    ~SceneInTime();

    /// The scene after all commands with time <= `until`. It may be changed, as interpolators do,
    /// and lives until the next call. Errors as composeScene(), whose result this is.
    [[nodiscard]] Result<Scene*> at(std::uint64_t until);
    /// Makes the next call start anew.
    void restart();

    /// When the first commands come that are not applied yet; nothing after the last.
    [[nodiscard]] std::optional<std::uint64_t> next() const;
    /// Numbers that change when commands change which DepthImages and textures of theirs are in the
    /// scene, and which nodes its routes are between.
    struct Structure {
        std::uint64_t views = 0, routes = 0;
        bool operator==(const Structure&) const = default;
    };
    [[nodiscard]] Structure structure() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// The ids that nodes and routes are coded with.
struct NodeIds {
    std::unordered_map<const Node*, std::uint32_t> nodes;  ///< 1-based
    std::unordered_map<std::string, std::uint32_t> routesByName;
    std::unordered_map<const Proto*, std::uint32_t> protos;
    std::uint32_t highestNode = 0;
    std::uint32_t highestRoute = 0;
    std::uint32_t highestProto = 0;
};
/// What a node ('N') or ROUTE ('R') that has a number only is called where names are coded, as in
/// texts: `N12` for 13.
[[nodiscard]] inline std::string nameOfId(char letter, std::uint32_t id) {
    return fmt::format("{}{}", letter, id - 1);
}

/// An id for every node that needs one (a defId, a DEF name, more than one use, an end of a route,
/// the target of a command): its defId where it has one, else one that no other node has, in order
/// of appearance. The same for routes with a name. A node that replaces one of its own name takes
/// its id.
/// PROTOs keep their id where no other has it. The highest ids count the bodies of PROTOs, too.
[[nodiscard]] NodeIds assignNodeIds(const std::vector<CommandFrame>& frames);
/// The ids of the nodes in the body of a PROTO, which are apart from all others.
[[nodiscard]] NodeIds idsOfBody(const Proto& proto);

}  // namespace stx::mpeg4
