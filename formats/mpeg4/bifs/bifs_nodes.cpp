#include "formats/mpeg4/bifs/bifs_nodes.hpp"

#include <algorithm>
#include <bit>

namespace stx::mpeg4 {

float BifsNodeReader::readFloat() {
    return quantisation.usesEfficientFloats() ? readEfficientFloat(in)
                                              : std::bit_cast<float>(in.read(32));
}

glm::vec3 BifsNodeReader::readVec3() {
    const float x = readFloat();
    const float y = readFloat();
    return {x, y, readFloat()};
}

Result<std::string> BifsNodeReader::readString() {
    const int bits = static_cast<int>(in.read(5));
    const std::uint64_t length = in.read(bits);
    if (length > in.left() / 8)
        return error(ErrorCode::invalidInput,
                     "a string of {} bytes does not fit into the {} bits left", length, in.left());
    STX_CHECK(useBudget(length));
    std::string text(static_cast<std::size_t>(length), '\0');
    for (char& c : text) c = static_cast<char>(in.read(8));
    return text;
}

Result<std::string> BifsNodeReader::readName() {
    std::string text;
    while (const std::uint32_t c = in.read(8)) {
        text.push_back(static_cast<char>(c));
    }
    STX_CHECK(check("a name"));
    STX_CHECK(useBudget(text.size()));
    return text;
}

Result<PixelImage> BifsNodeReader::readImage() {
    PixelImage image;
    image.width = static_cast<int>(in.read(12));
    image.height = static_cast<int>(in.read(12));
    image.components = static_cast<int>(in.read(2)) + 1;
    const std::uint64_t size =
        std::uint64_t(image.width) * static_cast<std::uint64_t>(image.height * image.components);
    if (size > in.left() / 8)
        return error(ErrorCode::invalidInput,
                     "an image of {}x{}x{} does not fit into the {} bits left", image.width,
                     image.height, image.components, in.left());
    STX_CHECK(useBudget(size));
    image.pixels.resize(static_cast<std::size_t>(size));
    for (std::uint8_t& value : image.pixels) value = static_cast<std::uint8_t>(in.read(8));
    return image;
}

template <class T>
Result<T> BifsNodeReader::readItem(const std::optional<QuantisedCoding>& coding) {
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
        if (in.flag())
            url.objectDescriptorId = static_cast<int>(in.read(10));
        else
            STX_SET(url.text, readString());
        return url;
    } else if constexpr (std::is_same_v<T, glm::vec2>) {
        const float x = coding ? readQuantised(in, *coding, 0) : readFloat();
        const float y = coding ? readQuantised(in, *coding, 1) : readFloat();
        return glm::vec2(x, y);
    } else if constexpr (std::is_same_v<T, glm::vec3>) {
        if (!coding) return readVec3();
        if (coding->kind == QuantisedCoding::Kind::normal) return readQuantisedNormal(in, *coding);
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
    } else if constexpr (std::is_same_v<T, glm::vec4>) {
        const glm::vec3 v = readVec3();
        return glm::vec4(v, readFloat());
    } else if constexpr (std::is_same_v<T, CommandBuffer>) {
        STX_TRY(const std::string bytes, readString());
        return CommandBuffer{{bytes.begin(), bytes.end()}, mpeg4::codingOf(config, useNames)};
    } else if constexpr (std::is_same_v<T, ScriptText>) {
        return error(ErrorCode::unsupported, "the program of a Script, which is not supported");
    } else if constexpr (std::is_same_v<T, AttributeReference>) {
        return error(ErrorCode::unsupported, "a reference to a field, which is not supported");
    } else {
        static_assert(std::is_same_v<T, PixelImage>);
        return readImage();
    }
}

std::uint64_t BifsNodeReader::fewestBits(FieldType item,
                                         const std::optional<QuantisedCoding>& coding) const {
    using enum FieldType;
    const auto each = static_cast<std::uint64_t>(coding                               ? coding->bits
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
        case SFVec4f:
            return 4 * each;
        case SFCommandBuffer:
            return 5;
        case SFImage:
            return 26;
        default:
            return 2;
    }
}

Result<FieldValue> BifsNodeReader::readField(const NodeInfo& node, const FieldInfo& field,
                                             int depth) {
    if (isMultiple(field.type)) return readList(node, field, depth);
    return readSingle(node, field, depth);
}

Result<FieldValue> BifsNodeReader::readSingle(const NodeInfo& node, const FieldInfo& field,
                                              int depth) {
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
        if constexpr (!kIsList<T> && !std::is_same_v<T, NodePtr>) STX_SET(v, readItem<T>(coding));
        return {};
    };
    STX_CHECK(std::visit(read, value));
    STX_CHECK(check(fmt::format("{}.{}", node.name, field.name)));
    return value;
}

template <class T>
Result<void> BifsNodeReader::readItems(const NodeInfo& node, const FieldInfo& field,
                                       std::vector<T>& items) {
    // An impossible coding is not an error where there is no item.
    const auto coding = located(quantisation.codingOf(field));
    return readEach(
        node, field, coding ? fewestBits(itemType(field.type), *coding) : 1,
        [&](std::uint64_t left) -> Result<void> {
            STX_CHECK(useBudget(sizeof(T)));
            if (items.empty() && left > 0)
                items.reserve(static_cast<std::size_t>(std::min<std::uint64_t>(left, 1u << 20)));
            if (!coding) return tl::unexpected(coding.error());
            STX_TRY(T item, readItem<T>(*coding));
            if (in.failed()) return check(fmt::format("{}.{}", node.name, field.name));
            items.push_back(std::move(item));
            return {};
        });
}

Result<void> BifsNodeReader::readNodes(const NodeInfo& node, const FieldInfo& field,
                                       NodeList& items, int depth) {
    QuantisationScope::ListGuard guard(quantisation);
    return readEach(node, field, 2, [&](std::uint64_t) -> Result<void> {
        int height = 0;
        STX_TRY(NodePtr child, readNode(field.nodeType, depth + 1, height));
        if (!child)
            return error(ErrorCode::invalidInput, "{}.{} has a NULL among its nodes", node.name,
                         field.name);
        deepest = std::max(deepest, height);
        guard.coded(child);
        STX_CHECK(useBudget(sizeof(NodePtr)));
        items.push_back(std::move(child));
        return {};
    });
}

// Comes after what it calls: clang 14 does not define templates that a generic lambda needs
// before they were seen.
Result<FieldValue> BifsNodeReader::readList(const NodeInfo& node, const FieldInfo& field,
                                            int depth) {
    if (config.usePredictiveMFField && in.flag())
        return error(ErrorCode::unsupported, "{}.{} uses predictive coding, which is not supported",
                     node.name, field.name);
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

Result<NodePtr> BifsNodeReader::readNode(Ndt expected, int depth, int& height) {
    if (depth > limits.maxNesting)
        return error(ErrorCode::invalidInput, "nodes are nested more than {} deep",
                     limits.maxNesting);
    if (in.flag()) return readUse(expected, depth, height);

    STX_TRY(NodePtr node, readNodeCode(expected));
    STX_CHECK(useBudget(sizeof(Node) + 64));
    if (in.flag()) {
        node->defId = in.read(config.nodeIdBits) + 1;
        if (useNames) {
            STX_TRY(node->defName, readName());
            if (node->defName == nameOfId('N', node->defId)) node->defName.clear();
        }
        STX_CHECK(check("a DEF"));
        const auto known = defined.find(node->defId);
        if (known != defined.end() && known->second.command == command)
            return error(ErrorCode::invalidInput, "node id {} is defined twice", node->defId);
        defined[node->defId] = {node, 0, command};
    }

    const int outerDeepest = std::exchange(deepest, 0);
    {
        const QuantisationScope::NodeGuard guard(quantisation);
        STX_CHECK(proto ? readBodyFields(node, depth) : readFields(*node, depth));
    }
    height = deepest + 1;
    deepest = outerDeepest;
    if (node->defId != 0) defined[node->defId].height = height;
    return node;
}

Result<NodePtr> BifsNodeReader::readUse(Ndt expected, int depth, int& height) {
    const std::uint32_t coded = in.read(config.nodeIdBits);
    STX_CHECK(check("a USE"));
    const auto allOnes = static_cast<std::uint32_t>((std::uint64_t{1} << config.nodeIdBits) - 1);
    if (coded == allOnes) return NodePtr{};
    NodePtr node = nodeOfId(coded + 1, height);
    if (!node)
        return error(ErrorCode::invalidInput, "USE of node id {}, which is not defined", coded + 1);
    if (height == 0)
        return error(ErrorCode::invalidInput, "node id {} is used inside itself", coded + 1);
    if (!mayStandIn(node.get(), expected))
        return error(ErrorCode::invalidInput, "USE of node id {}, a {}, where {} is expected",
                     coded + 1, node->info->name, name(expected));
    if (depth + height > limits.maxNesting)
        return error(ErrorCode::invalidInput, "nodes are nested more than {} deep",
                     limits.maxNesting);
    return node;
}

NodePtr BifsNodeReader::nodeOfId(std::uint32_t id, int& height) const {
    if (const auto known = defined.find(id); known != defined.end()) {
        height = known->second.height;
        return known->second.node;
    }
    if (around == nullptr) return nullptr;
    const auto known = around->nodes.find(id);
    // What is around is named only, and nests nowhere.
    height = 1;
    return known == around->nodes.end() ? nullptr : known->second;
}

Result<NodePtr> BifsNodeReader::readNodeCode(Ndt expected) {
    for (int version = 1; version <= kNdtVersions; ++version) {
        const auto bits = codeBits(expected, version);
        if (!bits)
            return error(ErrorCode::unsupported,
                         "a node where {} is expected; no code of that type is known",
                         name(expected));
        const int code = static_cast<int>(in.read(*bits));
        STX_CHECK(check("a node code"));
        if (code == 0) continue;
        if (version == 2 && code == 1) {
            const std::uint32_t id = in.read(config.protoIdBits);
            STX_CHECK(check("an instance of a PROTO"));
            for (auto scope = protoScopes.rbegin(); scope != protoScopes.rend(); ++scope)
                // One that was inserted later may have the id of one that was deleted.
                for (auto declared = scope->rbegin(); declared != scope->rend(); ++declared)
                    if ((*declared)->id == id) return makeInstance(*declared);
            return error(ErrorCode::invalidInput,
                         "an instance of PROTO {}, which is not declared before it", id);
        }
        const NodeInfo* info = findNode(expected, version, code);
        if (info == nullptr)
            return error(ErrorCode::unsupported, "node code {} of {} version {} is not known", code,
                         name(expected), version);
        return makeNode(*info);
    }
    return error(ErrorCode::invalidInput, "a node code of {} that is 0 in every version",
                 name(expected));
}

Result<void> BifsNodeReader::readFields(Node& node, int depth) {
    return readEachField(*node.info, [&](int index) { return readInto(node, index, depth); });
}

Result<void> BifsNodeReader::readInto(Node& node, int index, int depth) {
    const FieldInfo& field = node.info->fields[index];
    if (field.type == FieldType::MFScript) return readScripts(node, index, depth);
    STX_TRY(FieldValue value, readField(*node.info, field, depth));
    quantisation.coded(field, value);
    STX_CHECK(useBudget(sizeof(Node::SetField)));
    node.set(index, std::move(value));
    return {};
}

}  // namespace stx::mpeg4
