#include "formats/mpeg4/bifs/bifs_writer.hpp"

#include <cmath>

#include "formats/mpeg4/bifs/interface_types.hpp"
#include "formats/mpeg4/bifs/script_code.hpp"
#include "lib/geometry/camera.hpp"

namespace stx::mpeg4 {

// ---- single values

void BifsNodeWriter::writeFloat(float value) {
    if (quantisation.usesEfficientFloats())
        addRounding(value, writeEfficientFloat(out, value));
    else
        out.write(std::bit_cast<std::uint32_t>(value), 32);
}

void BifsNodeWriter::addRounding(float value, float readBack) {
    mostRounded = std::max(mostRounded, std::abs(static_cast<double>(value) - readBack));
}
void BifsNodeWriter::addRounding(const Rotation& value, const Rotation& readBack) {
    if (value == readBack) return;
    const auto quat = [](const Rotation& r) {
        return quatFromAxisAngle(glm::dvec4(r.axis, r.angle));
    };
    const glm::dquat turn = quat(value) * glm::conjugate(quat(readBack));
    const double halfSine = glm::length(glm::dvec3(turn.x, turn.y, turn.z));
    mostRounded = std::max(mostRounded, 2 * std::atan2(halfSine, std::abs(turn.w)));
}

Result<void> BifsNodeWriter::writeString(const std::string& text) {
    const int bits = significantBits(text.size());
    if (bits > 31) return error("a string of {} bytes is too long for BIFS", text.size());
    out.write(static_cast<std::uint32_t>(bits), 5);
    out.write(static_cast<std::uint32_t>(text.size()), bits);
    for (const char c : text) out.write(static_cast<unsigned char>(c), 8);
    return {};
}

Result<void> BifsNodeWriter::writeName(const std::string& text) {
    if (text.find('\0') != std::string::npos)
        return error("the name '{}' contains a zero byte", text);
    for (const char c : text) out.write(static_cast<unsigned char>(c), 8);
    out.write(0, 8);
    return {};
}

Result<void> BifsNodeWriter::write(bool value, const Coding&) {
    return out.flag(value), Result<void>{};
}
Result<void> BifsNodeWriter::write(std::int32_t value, const Coding& coding) {
    if (!coding) return out.write(static_cast<std::uint32_t>(value), 32), Result<void>{};
    const std::int64_t above = std::int64_t{value} - static_cast<std::int64_t>(coding->minimum[0]);
    if (above < 0 || above >> coding->bits != 0)
        return error(
            "the value {} does not fit into the {} bits that it has while a "
            "QuantizationParameter is active",
            value, coding->bits);
    return out.write(static_cast<std::uint32_t>(above), coding->bits), Result<void>{};
}
Result<void> BifsNodeWriter::write(float value, const Coding& coding) {
    return writeComponent(coding, 0, value);
}
Result<void> BifsNodeWriter::write(double value, const Coding&) {
    return out.write64(std::bit_cast<std::uint64_t>(value)), Result<void>{};
}
Result<void> BifsNodeWriter::write(const std::string& value, const Coding&) {
    return writeString(value);
}
Result<void> BifsNodeWriter::write(const Url& value, const Coding&) {
    if (value.objectDescriptorId < 0 || value.objectDescriptorId > 1023)
        return error("od:{} has no code in BIFS; object descriptor ids are 1 to 1022",
                     value.objectDescriptorId);
    out.flag(value.objectDescriptorId > 0);
    if (value.objectDescriptorId == 0) return writeString(value.text);
    out.write(static_cast<std::uint32_t>(value.objectDescriptorId), 10);
    return {};
}
Result<void> BifsNodeWriter::writeComponent(const Coding& coding, int component, float value) {
    if (!coding) return writeFloat(value), Result<void>{};
    const double low = coding->minimum[component], high = coding->maximum[component];
    if (!(value >= low && value <= high))
        return error(
            "the value {} is not within {} to {}, the bounds that it has while a "
            "QuantizationParameter is active; widen the bounds of that node or remove it",
            value, static_cast<float>(low), static_cast<float>(high));
    addRounding(value, writeQuantised(out, *coding, component, value));
    return {};
}
Result<void> BifsNodeWriter::write(const glm::vec2& value, const Coding& coding) {
    for (int i = 0; i < 2; ++i) STX_CHECK(writeComponent(coding, i, value[i]));
    return {};
}
Result<void> BifsNodeWriter::write(const glm::vec3& value, const Coding& coding) {
    if (coding && coding->kind == QuantisedCoding::Kind::normal) {
        const glm::vec3 readBack = writeQuantisedNormal(out, *coding, value);
        for (int i = 0; i < 3; ++i) addRounding(value[i], readBack[i]);
        return {};
    }
    for (int i = 0; i < 3; ++i) STX_CHECK(writeComponent(coding, i, value[i]));
    return {};
}
Result<void> BifsNodeWriter::write(const Color& value, const Coding& coding) {
    return write(glm::vec3(value.r, value.g, value.b), coding);
}
Result<void> BifsNodeWriter::write(const Rotation& value, const Coding& coding) {
    if (coding) {
        addRounding(value, writeQuantisedRotation(out, *coding, value));
        return {};
    }
    for (int i = 0; i < 3; ++i) writeFloat(value.axis[i]);
    writeFloat(value.angle);
    return {};
}
Result<void> BifsNodeWriter::write(const glm::vec4& value, const Coding&) {
    for (int i = 0; i < 4; ++i) writeFloat(value[i]);
    return {};
}
Result<void> BifsNodeWriter::write(const CommandBuffer& value, const Coding&) {
    const CommandCoding own = codingOf(config, useNames);
    if (!value.bytes.empty() && value.coding && *value.coding != own)
        return fail(ErrorCode::unsupported,
                    "a buffer holds commands with ids of {}, {} and {} bits for nodes, ROUTEs and "
                    "PROTOs, but the scene is written with {}, {} and {}; write a text (.bt, .xmt) "
                    "first, and this from it",
                    value.coding->nodeIdBits, value.coding->routeIdBits, value.coding->protoIdBits,
                    own.nodeIdBits, own.routeIdBits, own.protoIdBits);
    return writeString(std::string(value.bytes.begin(), value.bytes.end()));
}
Result<void> BifsNodeWriter::write(const ScriptText&, const Coding&) {
    return fail(ErrorCode::unsupported,
                "the program of a Script cannot be written as BIFS; write a text (.bt, .xmt)");
}
Result<void> BifsNodeWriter::write(const AttributeReference&, const Coding&) {
    return fail(ErrorCode::unsupported, "a reference to a field cannot be written");
}
Result<void> BifsNodeWriter::write(const PixelImage& image, const Coding&) {
    if (image.width < 0 || image.width > 4095 || image.height < 0 || image.height > 4095)
        return error("an image of {}x{} has no code in BIFS; 4095x4095 is the largest", image.width,
                     image.height);
    const auto size = static_cast<std::size_t>(image.width) *
                      static_cast<std::size_t>(image.height) *
                      static_cast<std::size_t>(std::clamp(image.components, 1, 4));
    if (image.components < 1 || image.components > 4 || image.pixels.size() != size)
        return error("an image of {}x{} with {} components has {} bytes", image.width, image.height,
                     image.components, image.pixels.size());
    out.write(static_cast<std::uint32_t>(image.width), 12);
    out.write(static_cast<std::uint32_t>(image.height), 12);
    out.write(static_cast<std::uint32_t>(image.components - 1), 2);
    for (const std::uint8_t value : image.pixels) out.write(value, 8);
    return {};
}

// ---- nodes

Result<void> BifsNodeWriter::writeNodeCode(const Node& node, Ndt expected) {
    const NodeCode* code = node.info->codeIn(expected);
    if (code == nullptr)
        return error("{} may not stand where {} is expected", node.info->name, name(expected));
    for (int version = 1; version < code->version; ++version)
        out.write(0, *codeBits(expected, version));
    out.write(static_cast<std::uint32_t>(code->code), *codeBits(expected, code->version));
    if (!node.info->isProto) return {};
    const auto found = ids.protos.find(node.proto.get());
    if (found == ids.protos.end())
        return error("an instance of PROTO {}, which the scene does not declare", node.info->name);
    out.write(found->second, config.protoIdBits);
    return {};
}

Result<void> BifsNodeWriter::writeNode(const NodePtr& node, Ndt expected, int depth) {
    if (depth > maxNesting) return error("nodes are nested more than {} deep", maxNesting);
    if (!node) {
        out.flag(true);
        out.write(~std::uint32_t{0}, config.nodeIdBits);
        return {};
    }
    if (node->info->codeIn(expected) == nullptr)
        return error("{} may not stand where {} is expected", node->info->name, name(expected));
    const std::uint32_t id = idOf(*node);
    if (isThere(*node, id)) {
        out.flag(true);
        out.write(id - 1, config.nodeIdBits);
        return {};
    }
    out.flag(false);
    STX_CHECK(writeNodeCode(*node, expected));
    out.flag(id != 0);
    if (id != 0) {
        if (!definedNow.insert(id).second)
            return error("node id {} stands for two nodes of one scene", id);
        out.write(id - 1, config.nodeIdBits);
        if (useNames)
            STX_CHECK(writeName(node->defName.empty() ? nameOfId('N', id) : node->defName));
    }
    {
        const QuantisationScope::NodeGuard guard(quantisation);
        STX_CHECK(proto ? writeBodyFields(*node, depth) : writeFields(*node, depth));
    }
    if (id != 0) written[id] = node.get();
    return {};
}

std::vector<Node::SetField> BifsNodeWriter::fieldsToWrite(const Node& node) const {
    std::vector<Node::SetField> fields;
    // The fields of a Script come with its program, so there must be one.
    if (ownFieldCount(node) > 0 && !node.isSet(0))
        fields.push_back({0, std::vector<ScriptText>(1)});
    for (const Node::SetField& set : node.setFields) {
        const NodePtr* child = std::get_if<NodePtr>(&set.value);
        if (child != nullptr && !*child) continue;
        const FieldInfo& info = node.info->fields[set.index];
        if (info.defId >= static_cast<int>(node.info->defFields.size())) continue;
        const FieldValue& byDefault = defaultValue(*node.info, set.index);
        // Equal in bits, too: -0 is not left out for 0.
        if (style.omitDefaults && set.value == byDefault && sameValue(set.value, byDefault))
            continue;
        fields.push_back(set);
    }
    return fields;
}

Result<void> BifsNodeWriter::writeFieldOf(const Node& node, const Node::SetField& set, int depth) {
    const FieldInfo& field = node.info->fields[set.index];
    const auto* scripts = std::get_if<std::vector<ScriptText>>(&set.value);
    auto done = scripts ? writeScripts(node, *scripts, depth) : writeField(field, set.value, depth);
    quantisation.coded(field, set.value);
    if (!done)
        return tl::unexpected(done.error().at(fmt::format("{}.{}", node.info->name, field.name)));
    return {};
}

Result<void> BifsNodeWriter::writeFields(const Node& node, int depth) {
    const NodeInfo& info = *node.info;
    const std::vector<Node::SetField> fields = fieldsToWrite(node);
    const std::size_t listCost = 1 + fields.size() * (1 + static_cast<std::size_t>(info.defBits));
    const bool asMask = !style.shorterOfMaskAndList || info.defFields.size() < listCost;
    out.flag(asMask);
    auto next = fields.begin();
    for (const int index : info.defFields) {
        const bool present = next != fields.end() && next->index == index;
        if (asMask) {
            out.flag(present);
        } else if (present) {
            out.flag(false);
            out.write(static_cast<std::uint32_t>(info.fields[index].defId), info.defBits);
        }
        if (present) STX_CHECK(writeFieldOf(node, *next++, depth));
    }
    if (!asMask) out.flag(true);
    return {};
}

Result<void> BifsNodeWriter::writeBodyFields(const Node& node, int depth) {
    const std::map<int, int>& linked = linksOf(links, node);
    const std::vector<Node::SetField> fields = fieldsToWrite(node);
    const int idBits = significantBits(std::max<std::size_t>(1, proto->type.fields.size()) - 1);
    out.flag(true);
    const std::size_t count =
        node.info->fields.size() - static_cast<std::size_t>(ownFieldCount(node));
    auto next = fields.begin();
    for (std::size_t i = 0; i < count; ++i) {
        const int index = static_cast<int>(i);
        const bool set = next != fields.end() && next->index == index;
        const auto link = linked.find(index);
        out.flag(set || link != linked.end());
        if (!set && link == linked.end()) continue;
        out.flag(link != linked.end());
        if (link != linked.end())
            out.write(static_cast<std::uint32_t>(link->second), idBits);
        else
            STX_CHECK(writeFieldOf(node, *next, depth));
        if (set) ++next;
    }
    return {};
}

Result<void> BifsNodeWriter::writeScripts(const Node& node, const std::vector<ScriptText>& scripts,
                                          int depth) {
    std::vector<ScriptText> items = scripts;
    const int own = ownFieldCount(node);
    if (items.empty() && own > 0) items.emplace_back();
    STX_TRY(const bool asList, beginList("Script.url", items.size()));
    const std::size_t first = node.info->fields.size() - static_cast<std::size_t>(own);
    std::vector<std::string> names;
    for (std::size_t item = 0; item < items.size(); ++item) {
        if (asList) out.flag(false);
        // All fields come with the first program.
        const std::size_t fields = item == 0 ? static_cast<std::size_t>(own) : 0;
        const int bits = significantBits(fields);
        out.flag(false);
        out.write(static_cast<std::uint32_t>(bits), 4);
        out.write(static_cast<std::uint32_t>(fields), bits);
        names.clear();
        for (std::size_t i = first; i < first + fields; ++i) {
            const FieldInfo& field = node.info->fields[i];
            STX_TRY(const int type, interfaceCode(field.type));
            out.write(field.kind == FieldKind::field     ? 0
                      : field.kind == FieldKind::eventIn ? 1
                                                         : 2,
                      2);
            out.write(static_cast<std::uint32_t>(type), 6);
            STX_CHECK(writeName(field.name));
            names.push_back(field.name);
            if (proto) {
                const auto& linked = linksOf(links, node);
                const auto link = linked.find(field.index);
                out.flag(link != linked.end());
                if (link != linked.end()) {
                    out.write(static_cast<std::uint32_t>(link->second),
                              significantBits(proto->type.fields.size() - 1));
                    continue;
                }
            }
            if (field.kind != FieldKind::field) continue;
            out.flag(node.isSet(field.index));
            if (node.isSet(field.index))
                STX_CHECK(writeField(field, node.value(field.index), depth));
        }
        out.flag(false);
        STX_CHECK(writeScript(out, items[item].text, names, maxNesting));
    }
    if (asList) out.flag(true);
    return {};
}

// ---- PROTOs

Result<void> BifsNodeWriter::writeProtos(const std::vector<ProtoPtr>& protos, int depth) {
    if (depth > maxNesting) return error("PROTOs are nested more than {} deep", maxNesting);
    for (const ProtoPtr& declared : protos) {
        out.flag(true);
        STX_CHECK(within(fmt::format("PROTO {}", declared->name), writeProto(*declared, depth)));
    }
    out.flag(false);
    return {};
}

Result<void> BifsNodeWriter::writeProto(const Proto& declared, int depth) {
    if (config.version != 2) return error("PROTOs need a BIFS config of version 2");
    out.write(ids.protos.at(&declared), config.protoIdBits);
    if (useNames) STX_CHECK(writeName(declared.name));
    const Proto* const outerProto = std::exchange(proto, &declared);
    ProtoLinks outerLinks = std::exchange(links, linksOf(declared));
    for (const FieldInfo& field : declared.type.fields) {
        STX_TRY(const int type, interfaceCode(field.type));
        out.flag(true);
        out.write(static_cast<std::uint32_t>(field.kind), 2);
        out.write(static_cast<std::uint32_t>(type), 6);
        if (useNames) STX_CHECK(writeName(field.name));
        if (!field.hasValue()) continue;
        // The quantisation of a field comes after the body only.
        FieldInfo plain = field;
        plain.quantisation = Quantisation::none;
        STX_CHECK(writeField(plain, defaultValue(declared.type, field.index), depth));
    }
    out.flag(false);
    out.flag(declared.isExtern);
    if (declared.isExtern) {
        FieldInfo urls;
        urls.name = "urls";
        urls.type = FieldType::MFURL;
        STX_CHECK(writeField(urls, declared.urls, depth));
    } else {
        STX_CHECK(writeBody(declared, depth));
    }
    proto = outerProto;
    links = std::move(outerLinks);
    return writeInterfaceQuantisation(declared);
}

Result<void> BifsNodeWriter::writeBody(const Proto& declared, int depth) {
    // A body has nodes and ids of its own.
    NodeIds bodyIds = idsOfBody(declared);
    bodyIds.protos = ids.protos;
    const NodeIds outerIds = std::exchange(ids, std::move(bodyIds));
    const auto outerWritten = std::exchange(written, {});
    const auto outerDefined = std::exchange(definedNow, {});
    STX_CHECK(writeProtos(declared.protos, depth + 1));
    for (std::size_t i = 0; i < declared.body.size(); ++i) {
        STX_CHECK(writeNode(declared.body[i], Ndt::SFWorldNode, depth + 1));
        out.flag(i + 1 < declared.body.size());
    }
    if (declared.body.empty()) {
        STX_CHECK(writeNode(nullptr, Ndt::SFWorldNode, depth + 1));
        out.flag(false);
    }
    STX_CHECK(writeRoutes(declared.routes));
    ids = outerIds;
    written = outerWritten;
    definedNow = outerDefined;
    return {};
}

Result<void> BifsNodeWriter::writeInterfaceQuantisation(const Proto& declared) {
    const bool quantised = std::any_of(
        declared.type.fields.begin(), declared.type.fields.end(),
        [](const FieldInfo& field) { return field.quantisation != Quantisation::none; });
    out.flag(quantised);
    out.flag(false);  // nothing to animate
    if (!quantised) return {};
    for (const FieldInfo& field : declared.type.fields) {
        if (!field.hasValue()) continue;
        out.write(static_cast<std::uint32_t>(field.quantisation), 4);
        if (field.quantisation == Quantisation::linear)
            out.write(static_cast<std::uint32_t>(field.quantisationBits), 5);
        constexpr float kMost = std::numeric_limits<float>::max();
        const bool bounds = field.minimum != -kMost || field.maximum != kMost;
        out.flag(bounds);
        if (!bounds) continue;
        for (const float bound : {field.minimum, field.maximum}) {
            if (itemType(field.type) == FieldType::SFInt32)
                out.write(static_cast<std::uint32_t>(static_cast<std::int32_t>(
                              std::clamp(static_cast<double>(bound), -2147483648.0, 2147483647.0))),
                          32);
            else if (itemType(field.type) == FieldType::SFTime)
                out.write64(std::bit_cast<std::uint64_t>(static_cast<double>(bound)));
            else
                writeFloat(bound);
        }
    }
    return {};
}

// ---- routes

Result<void> BifsNodeWriter::writeTarget(const NodePtr& target) {
    if (!target) return error("a command or route names no node");
    const std::uint32_t id = idOf(*target);
    if (!isThere(*target, id))
        return error("a command or route names {} '{}', which is not in the scene by then",
                     target->info->name, target->defName);
    out.write(id - 1, config.nodeIdBits);
    return {};
}

Result<void> BifsNodeWriter::writeFieldId(const Node& node, int index, int FieldInfo::*mode,
                                          int bits, std::string_view what) {
    const bool exists = index >= 0 && index < static_cast<int>(node.info->fields.size());
    const int id = exists ? node.info->fields[index].*mode : -1;
    if (id < 0)
        return error("{}.{} cannot be {}; it has no id for that", node.info->name,
                     exists ? node.info->fields[index].name : "?", what);
    out.write(static_cast<std::uint32_t>(id), bits);
    return {};
}
Result<void> BifsNodeWriter::writeInField(const Node& node, int index) {
    return writeFieldId(node, index, &FieldInfo::inId, node.info->inBits,
                        "changed by a command or a route (replace the node instead)");
}

Result<void> BifsNodeWriter::writeEnds(const Route& route) {
    STX_CHECK(writeTarget(route.from));
    STX_CHECK(writeFieldId(*route.from, route.fromField, &FieldInfo::outId,
                           route.from->info->outBits, "the source of a route"));
    STX_CHECK(writeTarget(route.to));
    return writeInField(*route.to, route.toField);
}

Result<void> BifsNodeWriter::writeRoute(const Route& route) {
    std::uint32_t id = route.id;
    if (const auto named = ids.routesByName.find(route.name);
        id == 0 && named != ids.routesByName.end())
        id = named->second;
    out.flag(id != 0);
    if (id != 0) {
        STX_CHECK(writeRouteId(id));
        if (useNames) STX_CHECK(writeName(route.name.empty() ? nameOfId('R', id) : route.name));
    }
    return writeEnds(route);
}

Result<void> BifsNodeWriter::writeRouteId(std::uint32_t id) {
    if (id == 0 || (std::uint64_t{id} - 1) >> config.routeIdBits != 0)
        return error("route id {} does not fit into {} bits", id, config.routeIdBits);
    out.write(id - 1, config.routeIdBits);
    return {};
}

Result<void> BifsNodeWriter::writeRoutes(const std::vector<Route>& routes) {
    out.flag(!routes.empty());
    if (routes.empty()) return {};
    const int bits = significantBits(routes.size());
    const bool asList =
        style.shorterOfMaskAndList && static_cast<std::size_t>(bits) + 5 > routes.size() + 1;
    out.flag(asList);
    if (!asList) {
        out.write(static_cast<std::uint32_t>(bits), 5);
        out.write(static_cast<std::uint32_t>(routes.size()), bits);
    }
    for (std::size_t i = 0; i < routes.size(); ++i) {
        STX_CHECK(writeRoute(routes[i]));
        if (asList) out.flag(i + 1 < routes.size());
    }
    return {};
}

}  // namespace stx::mpeg4
