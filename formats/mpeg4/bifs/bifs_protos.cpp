#include <algorithm>
#include <bit>
#include <cmath>

#include "formats/mpeg4/bifs/bifs_nodes.hpp"
#include "formats/mpeg4/bifs/interface_types.hpp"
#include "formats/mpeg4/bifs/script_code.hpp"

// Routes, PROTOs, and the Scripts whose fields are declared like those of PROTOs.

namespace stx::mpeg4 {
namespace {

int bitsFor(std::size_t count) {
    return count < 2 ? 0 : significantBits(count - 1);
}

/// Names go into texts as words.
bool isFieldName(std::string_view name) {
    return isScriptName(name);
}

}  // namespace

// ---- targets and routes

Result<NodePtr> BifsNodeReader::readTarget() {
    const std::uint32_t id = in.read(config.nodeIdBits) + 1;
    STX_CHECK(check("a command"));
    int height = 0;
    NodePtr node = nodeOfId(id, height);
    if (!node)
        return error(ErrorCode::invalidInput, "a command names node id {}, which is not defined",
                     id);
    return node;
}

Result<int> BifsNodeReader::readFieldId(const NodeInfo& node, int bits,
                                        const std::vector<int>& fields, std::string_view mode) {
    const std::uint32_t id = in.read(bits);
    STX_CHECK(check("a command"));
    if (id >= fields.size())
        return error(ErrorCode::invalidInput, "{} has no field with {} id {}", node.name, mode, id);
    return fields[id];
}

Result<void> BifsNodeReader::readEnds(Route& route) {
    STX_TRY(route.from, readTarget());
    STX_TRY(route.fromField, readFieldId(*route.from->info, route.from->info->outBits,
                                         route.from->info->outFields, "OUT"));
    STX_TRY(route.to, readTarget());
    STX_TRY(route.toField, readInField(*route.to));
    return {};
}

Result<Route> BifsNodeReader::readRoute() {
    STX_CHECK(useBudget(sizeof(Route)));
    Route route;
    if (in.flag()) {
        route.id = in.read(config.routeIdBits) + 1;
        if (useNames) {
            STX_TRY(route.name, readName());
            if (route.name == nameOfId('R', route.id)) route.name.clear();
        }
    }
    STX_CHECK(readEnds(route));
    return route;
}

Result<std::vector<Route>> BifsNodeReader::readRoutes() {
    std::vector<Route> routes;
    const bool hasRoutes = in.flag();
    STX_CHECK(check("the scene"));
    if (!hasRoutes) return routes;
    if (in.flag()) {
        do {
            STX_TRY(Route route, readRoute());
            routes.push_back(std::move(route));
        } while (in.flag());
    } else {
        const int bits = static_cast<int>(in.read(5));
        const std::uint64_t count = in.read(bits);
        for (std::uint64_t i = 0; i < count; ++i) {
            // A route may take a single bit where ids have none.
            if (in.failed() || count - i > in.left())
                return error(ErrorCode::invalidInput, "{} routes do not fit into the {} bits left",
                             count, in.left());
            STX_TRY(Route route, readRoute());
            routes.push_back(std::move(route));
        }
    }
    STX_CHECK(check("the routes"));
    return routes;
}

// ---- Scripts

Result<void> BifsNodeReader::readScripts(Node& script, int index, int depth) {
    if (config.usePredictiveMFField && in.flag())
        return error(ErrorCode::unsupported,
                     "Script.url uses predictive coding, which is not supported");
    std::vector<ScriptText> scripts;
    if (!in.flag()) {
        // The type of the table: the Script gets one of its own while this is read.
        const NodeInfo& table = *findNode("Script");
        STX_CHECK(readEach(table, table.fields[index], 6, [&](std::uint64_t) -> Result<void> {
            STX_TRY(ScriptText text, readScriptItem(script, depth));
            scripts.push_back(std::move(text));
            return check("Script.url");
        }));
    }
    // A url that is coded once more, empty, must not take away the program that brought fields.
    if (scripts.empty() && ownFieldCount(script) > 0) return {};
    script.set(index, std::move(scripts));
    return {};
}

Result<ScriptText> BifsNodeReader::readScriptItem(Node& script, int depth) {
    std::vector<std::string> names;
    const auto readOne = [&]() -> Result<void> {
        STX_TRY(std::string fieldName, readScriptField(script, depth));
        names.push_back(std::move(fieldName));
        return check("a field of a Script");
    };
    if (in.flag()) {
        while (!in.flag()) STX_CHECK(readOne());
    } else {
        const int bits = static_cast<int>(in.read(4));
        const std::uint32_t count = in.read(bits);
        for (std::uint32_t i = 0; i < count; ++i) STX_CHECK(readOne());
    }
    in.read(1);
    STX_TRY(std::string text,
            readScript(in, std::move(names), limits.maxNesting,
                       limits.maxMemoryBytes - std::min(limits.maxMemoryBytes, memory), &renamed));
    STX_CHECK(useBudget(text.size()));
    return ScriptText{std::move(text)};
}

Result<std::string> BifsNodeReader::readScriptField(Node& script, int depth) {
    constexpr FieldKind kKinds[] = {FieldKind::field, FieldKind::eventIn, FieldKind::eventOut};
    const std::uint32_t kind = in.read(2);
    const int code = static_cast<int>(in.read(6));
    STX_TRY(std::string fieldName, readName());
    const auto type = interfaceType(code);
    if (kind > 2)
        return error(ErrorCode::invalidInput, "a field of a Script has the kind {}", kind);
    if (!type)
        return error(ErrorCode::unsupported,
                     "a field of a Script has the type {}, which is not "
                     "supported",
                     code);
    if (!isFieldName(fieldName)) {
        fieldName = scriptNameFrom(fieldName);
        // Programs name fields by their number in BIFS.
        while (script.info->find(fieldName) >= 0) fieldName += '_';
        ++renamed;
    }
    FieldInfo field;
    field.kind = kKinds[kind];
    field.name = fieldName;
    field.type = *type;
    if (itemType(*type) == FieldType::SFNode) field.nodeType = Ndt::SFWorldNode;
    STX_CHECK(useBudget(sizeof(FieldInfo) * 2));
    if (ownFieldCount(script) >= kMaxOwnFields || !addScriptField(script, field, std::nullopt))
        return error(ErrorCode::invalidInput, "a Script has two fields '{}', or more than {}",
                     fieldName, kMaxOwnFields);
    const int index = script.info->find(fieldName);
    if (proto && in.flag()) {
        // The node itself is not at hand, but what it is linked by is the same.
        STX_CHECK(readLink(script.shared_from_this(), index));
        return fieldName;
    }
    if (field.kind == FieldKind::field && in.flag()) {
        const FieldInfo own = script.info->fields[index];
        STX_TRY(FieldValue value, readField(*findNode("Script"), own, depth));
        STX_CHECK(useBudget(sizeof(Node::SetField)));
        script.set(index, std::move(value));
    }
    return fieldName;
}

// ---- PROTOs

Result<void> BifsNodeReader::readProtos(int depth) {
    if (depth > limits.maxNesting)
        return error(ErrorCode::invalidInput, "PROTOs are nested more than {} deep",
                     limits.maxNesting);
    while (in.flag()) {
        if (++protoCount > kMaxProtos)
            return error(ErrorCode::invalidInput, "the scene declares more than {} PROTOs",
                         kMaxProtos);
        STX_TRY(ProtoPtr declared, readProto(depth));
        protoScopes.back().push_back(std::move(declared));
    }
    return check("the PROTOs");
}

Result<ProtoPtr> BifsNodeReader::readProto(int depth) {
    const auto declared = std::make_shared<Proto>();
    STX_CHECK(useBudget(sizeof(Proto)));
    declared->id = in.read(config.protoIdBits);
    if (useNames) STX_SET(declared->name, readName());
    // Texts need names; these are those of another implementation.
    if (!isFieldName(declared->name)) declared->name = fmt::format("Proto{}", declared->id);
    Proto* const outer = std::exchange(proto, declared.get());
    STX_CHECK(readInterface(*declared, depth));
    declared->isExtern = in.flag();
    if (declared->isExtern) {
        FieldInfo urls;
        urls.name = "urls";
        urls.type = FieldType::MFURL;
        STX_TRY(FieldValue value, readField(declared->type, urls, depth));
        declared->urls = std::get<std::vector<Url>>(std::move(value));
    } else {
        STX_CHECK(readBody(*declared, depth));
    }
    proto = outer;
    STX_CHECK(readInterfaceQuantisation(*declared));
    STX_CHECK(check("a PROTO"));
    return ProtoPtr(declared);
}

Result<void> BifsNodeReader::readInterface(Proto& declared, int depth) {
    std::vector<FieldInfo> fields;
    auto defaults = std::make_shared<FieldDefaults>();
    while (in.flag()) {
        FieldInfo field;
        field.kind = static_cast<FieldKind>(in.read(2));
        const int code = static_cast<int>(in.read(6));
        if (useNames) STX_SET(field.name, readName());
        STX_CHECK(check("the interface of a PROTO"));
        STX_CHECK(useBudget(sizeof(FieldInfo) + sizeof(FieldValue)));
        const bool taken = std::any_of(fields.begin(), fields.end(), [&](const FieldInfo& other) {
            return other.name == field.name;
        });
        if (taken || !isFieldName(field.name)) field.name = fmt::format("_field{}", fields.size());
        const auto type = interfaceType(code);
        if (!type)
            return error(ErrorCode::unsupported,
                         "a field of a PROTO has the type {}, which is not supported", code);
        if (static_cast<int>(fields.size()) >= kMaxOwnFields)
            return error(ErrorCode::invalidInput, "a PROTO has more than {} fields", kMaxOwnFields);
        field.type = *type;
        if (itemType(*type) == FieldType::SFNode) field.nodeType = Ndt::SFWorldNode;
        FieldValue value = emptyValue(field.type);
        if (field.kind == FieldKind::field || field.kind == FieldKind::exposedField)
            STX_SET(value, readField(declared.type, field, depth));
        defaults->values.push_back(std::move(value));
        fields.push_back(std::move(field));
    }
    declared.type = makeNodeInfo(declared.name, {}, fields);
    declared.type.isProto = true;
    declared.type.defaults = std::move(defaults);
    return check("the interface of a PROTO");
}

Result<void> BifsNodeReader::readBody(Proto& declared, int depth) {
    // A body has nodes and ids of its own.
    auto outerDefined = std::exchange(defined, {});
    protoScopes.emplace_back();
    STX_CHECK(readProtos(depth + 1));
    do {
        int height = 0;
        STX_TRY(NodePtr node, readNode(Ndt::SFWorldNode, depth + 1, height));
        if (node) declared.body.push_back(std::move(node));
        STX_CHECK(useBudget(sizeof(NodePtr)));
        STX_CHECK(check("the body of a PROTO"));
    } while (in.flag());
    STX_TRY(declared.routes, readRoutes());
    declared.protos = std::move(protoScopes.back());
    protoScopes.pop_back();
    defined = std::move(outerDefined);
    return {};
}

Result<void> BifsNodeReader::readInterfaceQuantisation(Proto& declared) {
    const bool quantised = in.flag();
    const bool animated = in.flag();
    for (FieldInfo& field : declared.type.fields) {
        if (quantised && field.hasValue()) {
            field.quantisation = static_cast<Quantisation>(in.read(4));
            if (field.quantisation == Quantisation::linear)
                field.quantisationBits = static_cast<int>(in.read(5));
            if (in.flag()) {
                for (float* bound : {&field.minimum, &field.maximum}) {
                    if (itemType(field.type) == FieldType::SFInt32)
                        *bound = static_cast<float>(static_cast<std::int32_t>(in.read(32)));
                    else if (itemType(field.type) == FieldType::SFTime)
                        *bound = static_cast<float>(std::bit_cast<double>(in.read64()));
                    else
                        *bound = readFloat();
                    if (!std::isfinite(*bound))
                        return error(ErrorCode::invalidInput, "a bound of {}.{} is not finite",
                                     declared.name, field.name);
                }
            }
        }
        // What can be animated is of no use here: the animation would be another stream.
        if (animated && field.inId >= 0 && in.flag()) in.read(4);
    }
    return check("a PROTO");
}

Result<void> BifsNodeReader::readLink(const NodePtr& node, int field) {
    const std::uint32_t id = in.read(bitsFor(proto->type.fields.size()));
    STX_CHECK(check("the body of a PROTO"));
    if (id >= proto->type.fields.size())
        return error(ErrorCode::invalidInput, "{} has no field {}", proto->name, id);
    const FieldInfo& own = node->info->fields[field];
    const FieldInfo& linked = proto->type.fields[id];
    if (own.type != linked.type)
        return error(ErrorCode::invalidInput, "{}.{} is {} and IS {}, which is {}",
                     node->info->name, own.name, name(own.type), linked.name, name(linked.type));
    STX_CHECK(useBudget(sizeof(Proto::Link)));
    proto->links.push_back({node, field, static_cast<int>(id)});
    return {};
}

Result<void> BifsNodeReader::readBodyFields(const NodePtr& node, int depth) {
    // A Script gets a type of its own while it is read.
    const std::shared_ptr<const NodeInfo> kept = node->ownType;
    const NodeInfo& info = *node->info;
    const std::size_t count = info.fields.size();
    if (in.flag()) {
        for (std::size_t i = 0; i < count; ++i) {
            if (!in.flag()) continue;
            if (in.flag()) {
                STX_CHECK(readLink(node, static_cast<int>(i)));
                continue;
            }
            if (!info.fields[i].hasValue())
                return error(ErrorCode::invalidInput, "{}.{} has no value", info.name,
                             info.fields[i].name);
            STX_CHECK(readInto(*node, static_cast<int>(i), depth));
        }
        return check(info.name);
    }
    std::vector<char> seen(count, 0);
    const auto twice = [&](std::size_t field) { return std::exchange(seen[field], char{1}) != 0; };
    while (!in.flag()) {
        if (in.failed()) break;
        if (in.flag()) {
            const std::uint32_t field = in.read(bitsFor(count));
            STX_CHECK(check(info.name));
            if (field >= count || twice(field))
                return error(ErrorCode::invalidInput, "{} has no field {}, or has it twice",
                             info.name, field);
            STX_CHECK(readLink(node, static_cast<int>(field)));
            continue;
        }
        const std::uint32_t id = in.read(info.defBits);
        STX_CHECK(check(info.name));
        if (id >= info.defFields.size() || twice(static_cast<std::size_t>(info.defFields[id])))
            return error(ErrorCode::invalidInput, "{} has no field with DEF id {}, or has it twice",
                         info.name, id);
        STX_CHECK(readInto(*node, info.defFields[id], depth));
    }
    return check(info.name);
}

}  // namespace stx::mpeg4
