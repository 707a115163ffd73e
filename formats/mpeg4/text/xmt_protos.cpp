#include "formats/mpeg4/bifs/interface_types.hpp"
#include "formats/mpeg4/bifs/script_code.hpp"
#include "formats/mpeg4/text/xmt_reader.hpp"
#include "formats/mpeg4/text/xmt_types.hpp"

namespace stx::mpeg4 {

Result<FieldInfo> XmtReader::readDeclaration(xml_node element) const {
    FieldInfo field;
    field.name = element.attribute("name").value();
    const auto type = typeOfXmtName(element.attribute("type").value());
    const auto kind = fieldKindOfName(element.attribute("vrml97Hint").as_string("field"));
    if (!type || !interfaceCode(*type))
        return failAt(where(element), type ? ErrorCode::unsupported : ErrorCode::invalidInput,
                      "the type of a field is '{}', expected one such as Integer or Vector3",
                      excerpt(element.attribute("type").value()));
    if (!kind)
        return failAt(where(element), ErrorCode::invalidInput,
                      "vrml97Hint is '{}', expected field, exposedField, eventIn or eventOut",
                      excerpt(element.attribute("vrml97Hint").value()));
    if (!isScriptName(field.name))
        return failAt(where(element), ErrorCode::invalidInput,
                      "'{}' is not a name of a field: letters, digits and _", excerpt(field.name));
    field.type = *type;
    field.kind = *kind;
    if (itemType(*type) == FieldType::SFNode) field.nodeType = Ndt::SFWorldNode;
    return field;
}

Result<void> XmtReader::readDeclaredValue(xml_node element, const NodePtr& node, int index,
                                          int depth, int& below) {
    const FieldInfo field = node->info->fields[index];
    if (!field.hasValue()) return {};
    if (itemType(field.type) == FieldType::SFNode) {
        // <node> or <nodes> hold them, or nothing does.
        const auto inner = elements(element);
        const bool wrapped =
            inner.size() == 1 && (localName(inner[0]) == "node" || localName(inner[0]) == "nodes");
        return readNodeField(wrapped ? inner[0] : element, node, index, depth, below);
    }
    for (const auto attribute : element.attributes()) {
        const std::string_view name = attribute.name();
        if (!name.ends_with("alue")) continue;
        STX_TRY(auto value, attributeValue(element, name, attribute.value(), field.type));
        node->set(index, std::move(value));
    }
    return {};
}

Result<void> XmtReader::readOwnField(xml_node element, const NodePtr& script, int depth,
                                     int& below) {
    STX_TRY(const FieldInfo field, readDeclaration(element));
    STX_CHECK(names_.countNode());
    STX_TRY(const int index, addOwnField(*script, field, where(element)));
    return readDeclaredValue(element, script, index, depth, below);
}

Result<void> XmtReader::readFieldValues(xml_node element, const NodePtr& instance, int depth,
                                        int& below) {
    for (const xml_node child : elements(element)) {
        if (localName(child) == "IS") {
            STX_CHECK(readLinks(child, instance));
            continue;
        }
        if (localName(child) != "fieldValue")
            return unexpectedElement(child, "fieldValue or IS in ProtoInstance");
        STX_TRY(const int index, fieldOf(child, *instance->info, child.attribute("name").value()));
        STX_CHECK(readDeclaredValue(child, instance, index, depth, below));
    }
    return {};
}

Result<void> XmtReader::readLinks(xml_node element, const NodePtr& node) {
    for (const xml_node child : elements(element)) {
        if (localName(child) != "connect") return unexpectedElement(child, "connect in IS");
        const std::string_view own = child.attribute("nodeField").value();
        const int field = node->info->findIgnoringCase(own);
        if (field < 0)
            return failAt(where(child), ErrorCode::invalidInput, "{} has no field '{}'",
                          node->info->name, excerpt(own));
        STX_CHECK(addLink(node, field, child.attribute("protoField").value(), where(child)));
    }
    return {};
}

Result<void> XmtReader::readProto(xml_node element, int depth) {
    STX_TRY(const auto proto, makeProto(element.attribute("name").value(), depth, where(element)));
    const auto locations = element.attribute("locations");
    proto->isExtern = !locations.empty();
    if (proto->isExtern) {
        STX_TRY(auto urls,
                attributeValue(element, "locations", locations.value(), FieldType::MFURL));
        proto->urls = std::get<std::vector<Url>>(std::move(urls));
    }
    return readInside(proto, [&] { return readProtoContent(element, *proto, depth); });
}

Result<void> XmtReader::readProtoContent(xml_node element, Proto& proto, int depth) {
    Interface interface;
    for (const xml_node child : elements(element)) {
        if (localName(child) != "field") continue;
        STX_TRY(const FieldInfo field, readDeclaration(child));
        const auto readValue = [&](const NodePtr& holder) {
            int below = 0;
            return readDeclaredValue(child, holder, 0, depth, below);
        };
        STX_CHECK(addField(interface, proto, field, where(child), readValue));
    }
    setInterface(proto, std::move(interface));
    if (proto.isExtern) return {};
    for (const xml_node child : elements(element)) {
        const std::string_view type = localName(child);
        if (type == "field") continue;
        if (type == "ProtoDeclare") {
            STX_CHECK(readProto(child, depth + 1));
        } else if (type == "ROUTE") {
            STX_TRY(auto route, readRoute(child));
            proto.routes.push_back(std::move(route));
        } else {
            int height = 0;
            STX_TRY(auto node, readNode(child, depth + 1, height, nullptr, -1, -1));
            if (node) proto.body.push_back(std::move(node));
        }
    }
    return {};
}

Result<void> XmtReader::passBuffer(xml_node element, std::size_t number) {
    if (localName(element) != "buffer") return unexpectedElement(element, "buffer");
    return addBuffer(number, where(element),
                     [this, element] { return readCommands(element, 0.0, 1); });
}

}  // namespace stx::mpeg4
