#include <algorithm>
#include <bit>

#include "formats/mpeg4/bifs.hpp"
#include "formats/mpeg4/bifs_quantisation.hpp"
#include "formats/mpeg4/bit_stream.hpp"

namespace stx::mpeg4 {

struct BifsDecoder::Impl {
    Impl(BifsConfig c, const Limits& l) : config(c), limits(l) {}

    /// What an id stands for. Height 0: the node is still being read, so a USE of it is a cycle.
    struct Defined {
        NodePtr node;
        int height = 0;
        std::uint64_t command = 0;
    };

    BifsConfig config;
    Limits limits;
    std::unordered_map<std::uint32_t, Defined> defined;
    bool useNames = false;
    QuantisationScope quantisation;
    std::uint64_t command = 0;  ///< counts commands over all access units
    std::uint64_t memory = 0;   ///< an estimate of what the nodes hold
    std::uint64_t bitsLeft = 0;
    BitReader in{ByteSpan{}};

    // ---- errors and budgets

    template <class... Args>
    tl::unexpected<Error> error(ErrorCode code, fmt::format_string<Args...> format,
                                Args&&... args) const {
        return failAt(fmt::format("bit {}", in.position()), code, format,
                      std::forward<Args>(args)...);
    }

    Result<void> check(std::string_view what) const {
        if (in.failed())
            return error(ErrorCode::invalidInput, "the access unit ends inside {}", what);
        return {};
    }

    Result<void> spend(std::uint64_t bytes) {
        memory += bytes;
        if (memory > limits.maxMemoryBytes)
            return error(ErrorCode::invalidInput,
                         "the scene needs more than the {} bytes that are allowed",
                         limits.maxMemoryBytes);
        return {};
    }

    // ---- single values

    float readFloat() {
        return quantisation.usesEfficientFloats() ? readEfficientFloat(in)
                                                  : std::bit_cast<float>(in.read(32));
    }
    glm::vec3 readVec3() {
        const float x = readFloat();
        const float y = readFloat();
        return {x, y, readFloat()};
    }

    Result<std::string> readString() {
        const int bits = static_cast<int>(in.read(5));
        const std::uint64_t length = in.read(bits);
        if (length > in.left() / 8)
            return error(ErrorCode::invalidInput,
                         "a string of {} bytes does not fit into the {} bits left", length,
                         in.left());
        STX_CHECK(spend(length));
        std::string text(static_cast<std::size_t>(length), '\0');
        for (char& c : text) c = static_cast<char>(in.read(8));
        return text;
    }

    Result<std::string> readName() {
        std::string text;
        while (const std::uint32_t c = in.read(8)) {
            text.push_back(static_cast<char>(c));
        }
        STX_CHECK(check("a name"));
        STX_CHECK(spend(text.size()));
        return text;
    }

    Result<PixelImage> readImage() {
        PixelImage image;
        image.width = static_cast<int>(in.read(12));
        image.height = static_cast<int>(in.read(12));
        image.components = static_cast<int>(in.read(2)) + 1;
        const std::uint64_t size = std::uint64_t(image.width) *
                                   static_cast<std::uint64_t>(image.height * image.components);
        if (size > in.left() / 8)
            return error(ErrorCode::invalidInput,
                         "an image of {}x{}x{} does not fit into the {} bits left", image.width,
                         image.height, image.components, in.left());
        STX_CHECK(spend(size));
        image.pixels.resize(static_cast<std::size_t>(size));
        for (std::uint8_t& value : image.pixels) value = static_cast<std::uint8_t>(in.read(8));
        return image;
    }

    /// One value of the C++ type T.
    template <class T>
    Result<T> readItem(const std::optional<QuantisedCoding>& coding) {
        if constexpr (std::is_same_v<T, bool>) {
            return in.flag();
        } else if constexpr (std::is_same_v<T, std::int32_t>) {
            if (coding) {
                return static_cast<std::int32_t>(static_cast<std::int64_t>(in.read(coding->bits)) +
                                                 static_cast<std::int64_t>(coding->minimum[0]));
            }
            return static_cast<std::int32_t>(in.read(32));
        } else if constexpr (std::is_same_v<T, float>) {
            return coding ? readQuantised(in, *coding, 0) : readFloat();
        } else if constexpr (std::is_same_v<T, double>) {
            return std::bit_cast<double>(in.read64());
        } else if constexpr (std::is_same_v<T, std::string>) {
            return readString();
        } else if constexpr (std::is_same_v<T, Url>) {
            Url url;
            if (in.flag()) {
                url.objectDescriptorId = static_cast<int>(in.read(10));
            } else {
                STX_TRY(url.text, readString());
            }
            return url;
        } else if constexpr (std::is_same_v<T, glm::vec2>) {
            const float x = coding ? readQuantised(in, *coding, 0) : readFloat();
            const float y = coding ? readQuantised(in, *coding, 1) : readFloat();
            return glm::vec2(x, y);
        } else if constexpr (std::is_same_v<T, glm::vec3>) {
            if (!coding) return readVec3();
            if (coding->kind == QuantisedCoding::Kind::normal)
                return readQuantisedNormal(in, *coding);
            const float x = readQuantised(in, *coding, 0);
            const float y = readQuantised(in, *coding, 1);
            return glm::vec3(x, y, readQuantised(in, *coding, 2));
        } else if constexpr (std::is_same_v<T, Color>) {
            STX_TRY(const glm::vec3 v, readItem<glm::vec3>(coding));
            return Color{v.x, v.y, v.z};
        } else if constexpr (std::is_same_v<T, Rotation>) {
            if (coding) return readQuantisedRotation(in, *coding);
            Rotation rotation;
            rotation.axis = readVec3();
            rotation.angle = readFloat();
            return rotation;
        } else {
            static_assert(std::is_same_v<T, PixelImage>);
            return readImage();
        }
    }

    /// The fewest bits that one item can take, so that a count is checked before memory is.
    std::uint64_t fewestBits(FieldType item, const std::optional<QuantisedCoding>& coding) const {
        using enum FieldType;
        const auto each = static_cast<std::uint64_t>(coding ? coding->bits
                                                     : quantisation.usesEfficientFloats() ? 4
                                                                                          : 32);
        switch (item) {
            case SFBool:
                return 1;
            case SFInt32:
                return coding ? each : 32;
            case SFFloat:
                return each;
            case SFTime:
                return 64;
            case SFString:
                return 5;
            case SFURL:
                return 6;
            case SFVec2f:
                return 2 * each;
            case SFVec3f:
            case SFColor:
                return 2 * each;  // a quantised normal has two numbers
            case SFRotation:
                return 3 * each;
            case SFImage:
                return 26;
            default:
                return 2;
        }
    }

    // ---- fields

    Result<FieldValue> readField(const NodeInfo& node, const FieldInfo& field, int depth) {
        if (isMultiple(field.type)) return readList(node, field, depth);
        return readSingle(node, field, depth);
    }

    /// One SF value, or one item of an MF field.
    Result<FieldValue> readSingle(const NodeInfo& node, const FieldInfo& field, int depth) {
        const FieldType type = itemType(field.type);
        if (type == FieldType::SFNode) {
            int height = 0;
            STX_TRY(NodePtr child, readNode(field.nodeType, depth + 1, height));
            deepest = std::max(deepest, height);
            return FieldValue(std::move(child));
        }
        STX_TRY(const auto coding, located(quantisation.codingOf(field)));
        FieldValue value = emptyValue(type);
        const auto read = [&](auto& v) -> Result<void> {
            using T = std::decay_t<decltype(v)>;
            if constexpr (!kIsList<T> && !std::is_same_v<T, NodePtr>) {
                STX_TRY(v, readItem<T>(coding));
            }
            return {};
        };
        STX_CHECK(std::visit(read, value));
        STX_CHECK(check(fmt::format("{}.{}", node.name, field.name)));
        return value;
    }

    template <class T>
    Result<T> located(Result<T> result) const {
        if (!result) return tl::unexpected(result.error().at(fmt::format("bit {}", in.position())));
        return result;
    }

    // readList stands behind what it calls: clang 14 does not define templates that a generic
    // lambda needs before they were seen.
    /// Calls `readOne` for each item of an MF field in either form.
    template <class ReadOne>
    Result<void> readEach(const NodeInfo& node, const FieldInfo& field, std::uint64_t fewest,
                          const ReadOne& readOne) {
        const auto place = [&] { return fmt::format("{}.{}", node.name, field.name); };
        if (in.flag()) {
            while (!in.flag()) {
                if (in.failed()) break;
                STX_CHECK(readOne(0));
            }
            return check(place());
        }
        const int bits = static_cast<int>(in.read(5));
        const std::uint64_t count = in.read(bits);
        if (in.failed() || count * fewest > in.left())
            return error(ErrorCode::invalidInput,
                         "{} has {} items, which do not fit into the {} bits left", place(), count,
                         in.left());
        for (std::uint64_t i = 0; i < count; ++i) STX_CHECK(readOne(count - i));
        return check(place());
    }

    template <class T>
    Result<void> readItems(const NodeInfo& node, const FieldInfo& field, std::vector<T>& items) {
        // A coding that cannot be is no error where there is no item.
        const auto coding = located(quantisation.codingOf(field));
        return readEach(node, field, coding ? fewestBits(itemType(field.type), *coding) : 1,
                        [&](std::uint64_t left) -> Result<void> {
                            STX_CHECK(spend(sizeof(T)));
                            if (items.empty() && left > 0)
                                items.reserve(static_cast<std::size_t>(
                                    std::min<std::uint64_t>(left, 1u << 20)));
                            if (!coding) return tl::unexpected(coding.error());
                            STX_TRY(T item, readItem<T>(*coding));
                            if (in.failed())
                                return check(fmt::format("{}.{}", node.name, field.name));
                            items.push_back(std::move(item));
                            return {};
                        });
    }

    Result<void> readNodes(const NodeInfo& node, const FieldInfo& field, NodeList& items,
                           int depth) {
        QuantisationScope::ListGuard guard(quantisation);
        return readEach(node, field, 2, [&](std::uint64_t) -> Result<void> {
            int height = 0;
            STX_TRY(NodePtr child, readNode(field.nodeType, depth + 1, height));
            if (!child)
                return error(ErrorCode::invalidInput, "{}.{} has a NULL among its nodes", node.name,
                             field.name);
            deepest = std::max(deepest, height);
            guard.coded(child);
            STX_CHECK(spend(sizeof(NodePtr)));
            items.push_back(std::move(child));
            return {};
        });
    }

    Result<FieldValue> readList(const NodeInfo& node, const FieldInfo& field, int depth) {
        if (config.usePredictiveMFField && in.flag())
            return error(ErrorCode::unsupported,
                         "{}.{} uses predictive coding, which is not supported", node.name,
                         field.name);
        FieldValue value = emptyValue(field.type);
        if (in.flag()) {
            STX_CHECK(check(fmt::format("{}.{}", node.name, field.name)));
            return value;  // the reserved bit: nothing follows
        }
        const auto read = [&](auto& items) -> Result<void> {
            using Items = std::decay_t<decltype(items)>;
            if constexpr (std::is_same_v<Items, NodeList>) {
                return readNodes(node, field, items, depth);
            } else if constexpr (kIsList<Items>) {
                return readItems(node, field, items);
            } else {
                return {};
            }
        };
        STX_CHECK(std::visit(read, value));
        return value;
    }

    // ---- nodes

    /// The height of the highest child that the fields read so far brought (see readNode).
    int deepest = 0;

    /// A node where `expected` is expected; null for NULL. `height` is how far it reaches down.
    Result<NodePtr> readNode(Ndt expected, int depth, int& height) {
        if (depth > limits.maxNesting)
            return error(ErrorCode::invalidInput, "nodes are nested more than {} deep",
                         limits.maxNesting);
        if (in.flag()) return readUse(expected, depth, height);

        STX_TRY(const NodeInfo* info, readNodeCode(expected));
        NodePtr node = makeNode(*info);
        STX_CHECK(spend(sizeof(Node) + 64));
        if (in.flag()) {
            node->defId = in.read(config.nodeIdBits) + 1;
            if (useNames) {
                STX_TRY(node->defName, readName());
            }
            STX_CHECK(check("a DEF"));
            const auto known = defined.find(node->defId);
            if (known != defined.end() && known->second.command == command)
                return error(ErrorCode::invalidInput, "node id {} is defined twice", node->defId);
            defined[node->defId] = {node, 0, command};
        }

        const int outerDeepest = std::exchange(deepest, 0);
        STX_CHECK(readFields(*node, depth));
        height = deepest + 1;
        deepest = outerDeepest;
        if (node->defId != 0) defined[node->defId].height = height;
        return node;
    }

    Result<NodePtr> readUse(Ndt expected, int depth, int& height) {
        const std::uint32_t coded = in.read(config.nodeIdBits);
        STX_CHECK(check("a USE"));
        const auto allOnes =
            static_cast<std::uint32_t>((std::uint64_t{1} << config.nodeIdBits) - 1);
        if (coded == allOnes) return NodePtr{};
        const auto known = defined.find(coded + 1);
        if (known == defined.end())
            return error(ErrorCode::invalidInput, "USE of node id {}, which is not defined",
                         coded + 1);
        if (known->second.height == 0)
            return error(ErrorCode::invalidInput, "node id {} is used inside itself", coded + 1);
        const Node& node = *known->second.node;
        if (!mayStandIn(&node, expected))
            return error(ErrorCode::invalidInput, "USE of node id {}, a {}, where {} is expected",
                         coded + 1, node.info->name, name(expected));
        height = known->second.height;
        if (depth + height > limits.maxNesting)
            return error(ErrorCode::invalidInput, "nodes are nested more than {} deep",
                         limits.maxNesting);
        return known->second.node;
    }

    Result<const NodeInfo*> readNodeCode(Ndt expected) {
        for (int version = 1; version <= kNdtVersions; ++version) {
            const auto bits = codeBits(expected, version);
            if (!bits)
                return error(ErrorCode::unsupported,
                             "a node where {} is expected; no code of that type is known",
                             name(expected));
            const int code = static_cast<int>(in.read(*bits));
            STX_CHECK(check("a node code"));
            if (code == 0) continue;
            if (version == 2 && code == 1)
                return error(ErrorCode::unsupported,
                             "an instance of a PROTO; PROTOs are not supported");
            const NodeInfo* info = findNode(expected, version, code);
            if (info == nullptr)
                return error(ErrorCode::unsupported, "node code {} of {} version {} is not known",
                             code, name(expected), version);
            return info;
        }
        return error(ErrorCode::invalidInput, "a node code of {} that is 0 in every version",
                     name(expected));
    }

    Result<void> readFields(Node& node, int depth) {
        const NodeInfo& info = *node.info;
        if (in.flag()) {
            for (const int index : info.defFields)
                if (in.flag()) STX_CHECK(readInto(node, index, depth));
            return check(info.name);
        }
        while (!in.flag()) {
            if (in.failed() || info.defFields.empty()) break;
            const std::uint32_t id = in.read(info.defBits);
            STX_CHECK(check(info.name));
            if (id >= info.defFields.size())
                return error(ErrorCode::invalidInput, "{} has no field with DEF id {}", info.name,
                             id);
            STX_CHECK(readInto(node, info.defFields[id], depth));
        }
        return check(info.name);
    }

    Result<void> readInto(Node& node, int index, int depth) {
        const FieldInfo& field = node.info->fields[static_cast<std::size_t>(index)];
        STX_TRY(FieldValue value, readField(*node.info, field, depth));
        STX_CHECK(spend(sizeof(Node::SetField)));
        node.set(index, std::move(value));
        return {};
    }

    // ---- commands

    Result<NodePtr> readTarget() {
        const std::uint32_t id = in.read(config.nodeIdBits) + 1;
        STX_CHECK(check("a command"));
        const auto known = defined.find(id);
        if (known == defined.end())
            return error(ErrorCode::invalidInput,
                         "a command names node id {}, which is not defined", id);
        return known->second.node;
    }

    Result<int> readFieldId(const NodeInfo& node, int bits, const std::vector<int>& fields,
                            std::string_view mode) {
        const std::uint32_t id = in.read(bits);
        STX_CHECK(check("a command"));
        if (id >= fields.size())
            return error(ErrorCode::invalidInput, "{} has no field with {} id {}", node.name, mode,
                         id);
        return fields[id];
    }
    Result<int> readInField(const Node& node) {
        return readFieldId(*node.info, node.info->inBits, node.info->inFields, "IN");
    }

    Result<Position> readPosition(int explicitBits) {
        Position position;
        switch (in.read(2)) {
            case 0:
                position.index = static_cast<int>(in.read(explicitBits));
                break;
            case 2:
                position.index = 0;
                break;
            case 3:
                position.index = Position::kLast;
                break;
            default:
                return error(ErrorCode::invalidInput, "a position of kind 1, which is reserved");
        }
        STX_CHECK(check("a position"));
        return position;
    }

    Result<void> readEnds(Route& route) {
        STX_TRY(route.from, readTarget());
        STX_TRY(route.fromField, readFieldId(*route.from->info, route.from->info->outBits,
                                             route.from->info->outFields, "OUT"));
        STX_TRY(route.to, readTarget());
        STX_TRY(route.toField, readInField(*route.to));
        return {};
    }

    Result<Route> readRoute() {
        STX_CHECK(spend(sizeof(Route)));
        Route route;
        if (in.flag()) {
            route.id = in.read(config.routeIdBits) + 1;
            if (useNames) {
                STX_TRY(route.name, readName());
            }
        }
        STX_CHECK(readEnds(route));
        return route;
    }

    Result<ReplaceScene> readScene() {
        ReplaceScene scene;
        in.read(6);
        useNames = in.flag();
        scene.useNames = useNames;
        defined.clear();
        if (in.flag())
            return error(ErrorCode::unsupported,
                         "the scene declares PROTOs, which are not supported");
        int height = 0;
        STX_TRY(scene.root, readNode(Ndt::SFTopNode, 1, height));
        const bool hasRoutes = in.flag();
        STX_CHECK(check("the scene"));
        if (!hasRoutes) return scene;
        if (in.flag()) {
            do {
                STX_TRY(Route route, readRoute());
                scene.routes.push_back(std::move(route));
            } while (in.flag());
        } else {
            const int bits = static_cast<int>(in.read(5));
            const std::uint64_t count = in.read(bits);
            for (std::uint64_t i = 0; i < count; ++i) {
                // A route may take a single bit where ids have none.
                if (in.failed() || count - i > in.left())
                    return error(ErrorCode::invalidInput,
                                 "{} routes do not fit into the {} bits left", count, in.left());
                STX_TRY(Route route, readRoute());
                scene.routes.push_back(std::move(route));
            }
        }
        STX_CHECK(check("the routes"));
        return scene;
    }

    Result<Command> readInsert() {
        switch (in.read(2)) {
            case 0: {
                InsertNode c;
                STX_TRY(c.target, readTarget());
                const int children = c.target->info->find("children");
                if (children < 0)
                    return error(ErrorCode::invalidInput,
                                 "a node is inserted into {}, which has no children",
                                 c.target->info->name);
                STX_TRY(c.position, readPosition(8));
                int height = 0;
                STX_TRY(
                    c.node,
                    readNode(c.target->info->fields[static_cast<std::size_t>(children)].nodeType, 1,
                             height));
                if (!c.node) return error(ErrorCode::invalidInput, "NULL is inserted as a child");
                return c;
            }
            case 2: {
                InsertIndexed c;
                STX_CHECK(readIndexed(c, true));
                return c;
            }
            case 3: {
                STX_TRY(Route route, readRoute());
                return InsertRoute{std::move(route)};
            }
            default:
                return error(ErrorCode::unsupported,
                             "an extended BIFS command, which is not supported");
        }
    }

    template <class C>
    Result<void> readIndexed(C& c, bool withValue) {
        STX_TRY(c.target, readTarget());
        STX_TRY(c.field, readInField(*c.target));
        const FieldInfo& field = c.target->info->fields[static_cast<std::size_t>(c.field)];
        if (!isMultiple(field.type))
            return error(ErrorCode::invalidInput, "an index into {}.{}, which is {}",
                         c.target->info->name, field.name, name(field.type));
        STX_TRY(c.position, readPosition(16));
        if constexpr (requires { c.value; }) {
            if (withValue) {
                STX_TRY(c.value, readSingle(*c.target->info, field, 1));
                if (const NodePtr* node = std::get_if<NodePtr>(&c.value); node && !*node)
                    return error(ErrorCode::invalidInput, "NULL is put into {}.{}",
                                 c.target->info->name, field.name);
            }
        }
        return {};
    }

    Result<Command> readDelete() {
        switch (in.read(2)) {
            case 0: {
                STX_TRY(NodePtr target, readTarget());
                return DeleteNode{std::move(target)};
            }
            case 2: {
                DeleteIndexed c;
                STX_CHECK(readIndexed(c, false));
                return c;
            }
            case 3: {
                DeleteRoute c{in.read(config.routeIdBits) + 1};
                STX_CHECK(check("a command"));
                return c;
            }
            default:
                return error(ErrorCode::invalidInput,
                             "a delete command of kind 1, which is reserved");
        }
    }

    Result<Command> readReplace() {
        switch (in.read(2)) {
            case 0: {
                ReplaceNode c;
                STX_TRY(c.target, readTarget());
                int height = 0;
                STX_TRY(c.replacement, readNode(Ndt::SFWorldNode, 1, height));
                return c;
            }
            case 1: {
                ReplaceField c;
                STX_TRY(c.target, readTarget());
                STX_TRY(c.field, readInField(*c.target));
                STX_TRY(c.value,
                        readField(*c.target->info,
                                  c.target->info->fields[static_cast<std::size_t>(c.field)], 1));
                return c;
            }
            case 2: {
                ReplaceIndexed c;
                STX_CHECK(readIndexed(c, true));
                return c;
            }
            default: {
                ReplaceRoute c;
                c.routeId = in.read(config.routeIdBits) + 1;
                STX_CHECK(readEnds(c.route));
                c.route.id = c.routeId;
                return c;
            }
        }
    }

    Result<Command> readCommand() {
        ++command;
        deepest = 0;
        STX_CHECK(spend(sizeof(Command)));
        switch (in.read(2)) {
            case 0:
                return readInsert();
            case 1:
                return readDelete();
            case 2:
                return readReplace();
            default: {
                STX_TRY(ReplaceScene scene, readScene());
                return scene;
            }
        }
    }

    Result<std::vector<Command>> decode(ByteSpan accessUnit) {
        in = BitReader(accessUnit);
        std::vector<Command> commands;
        do {
            STX_TRY(Command next, readCommand());
            commands.push_back(std::move(next));
            const bool more = in.flag();
            STX_CHECK(check("a command"));
            if (!more) break;
        } while (true);
        bitsLeft = in.left();
        return commands;
    }
};

BifsDecoder::BifsDecoder(BifsConfig config, const Limits& limits)
    : impl_(std::make_unique<Impl>(config, limits)) {}
BifsDecoder::~BifsDecoder() = default;
BifsDecoder::BifsDecoder(BifsDecoder&&) noexcept = default;

Result<std::vector<Command>> BifsDecoder::decode(ByteSpan accessUnit) {
    return impl_->decode(accessUnit);
}
std::uint64_t BifsDecoder::bitsLeft() const {
    return impl_->bitsLeft;
}

}  // namespace stx::mpeg4
