#include "formats/mpeg4/bifs/interface_types.hpp"
#include "formats/mpeg4/bifs/script_code.hpp"
#include "formats/mpeg4/text/bt_reader.hpp"

namespace stx::mpeg4 {

using Kind = BtToken::Kind;

NodePtr BtReader::makeNamedNode(std::string_view type) const {
    NodePtr instance = makeNamedInstance(type);
    return instance ? instance : makeNode(type);
}

bool BtReader::isDeclaration() const {
    for (const std::string_view kind : {"field", "exposedField", "eventIn", "eventOut"})
        if (isWord(kind)) return true;
    return false;
}

Result<FieldInfo> BtReader::readDeclaration() {
    FieldInfo field;
    STX_TRY(const auto kind, takeName("field, exposedField, eventIn or eventOut"));
    for (const FieldKind known :
         {FieldKind::field, FieldKind::exposedField, FieldKind::eventIn, FieldKind::eventOut})
        if (equalNoCase(name(known), kind)) field.kind = known;
    const std::string where = lexer_.where();
    STX_TRY(const auto type, takeName("the type of a field, such as SFInt32"));
    const auto known = fieldTypeOfName(type);
    if (!known || !interfaceCode(*known))
        return failAt(where, known ? ErrorCode::unsupported : ErrorCode::invalidInput,
                      "found '{}', expected the type of a field, such as SFInt32 or MFNode",
                      excerpt(type));
    field.type = *known;
    if (itemType(*known) == FieldType::SFNode) field.nodeType = Ndt::SFWorldNode;
    const std::string nameWhere = lexer_.where();
    STX_TRY(field.name, takeName("the name of a field"));
    if (!isScriptName(field.name))
        return failAt(nameWhere, ErrorCode::invalidInput,
                      "found '{}', expected the name of a field: letters, digits and _",
                      excerpt(field.name));
    return field;
}

Result<int> BtReader::readOwnField(Node& script) {
    const std::string where = lexer_.where();
    STX_TRY(const FieldInfo field, readDeclaration());
    return addOwnField(script, field, where);
}

Result<void> BtReader::readLink(const NodePtr& node, int field) {
    STX_CHECK(takeWord("IS"));
    const std::string where = lexer_.where();
    STX_TRY(const auto linked, takeName("the name of a field of the PROTO"));
    return addLink(node, field, linked, where);
}

Result<void> BtReader::readValueInto(const NodePtr& node, int index, int depth, int& height) {
    const FieldInfo& field = node->info->fields[index];
    const std::string& type = node->info->name;
    if (field.type == FieldType::SFNode) {
        const std::string childWhere = lexer_.where();
        STX_TRY(auto child, readNode(depth + 1, height, node, index, -1));
        STX_CHECK(checkNodePlace(child.get(), field.nodeType, type, field.name, childWhere));
        node->set(index, std::move(child));
        return {};
    }
    if (field.type == FieldType::MFNode) return readNodeList(node, index, depth + 1, height, true);
    if (field.type == FieldType::SFCommandBuffer && lexer_.peek().kind == Kind::openBrace)
        return passBuffer(buffers_.add(node, index, proto_));
    auto value = readFieldValue(lexer_, field.type, false);
    if (!value) {
        value.error().message += fmt::format(" for {}.{}", type, field.name);
        return propagate(value);
    }
    auto plain = fromText(*node->info, index, std::move(*value));
    if (!plain)
        return unexpected(fmt::format("base64 for {}.{}, which came before", type, field.name));
    node->set(index, std::move(*plain));
    return {};
}

Result<void> BtReader::readProto(int depth) {
    const std::string where = lexer_.where();
    const bool isExtern = isWord("EXTERNPROTO");
    STX_TRY([[maybe_unused]] const auto word, lexer_.take());
    STX_TRY(auto protoName, takeName("the name of a PROTO"));
    STX_TRY(const auto proto, makeProto(std::move(protoName), depth, where));
    proto->isExtern = isExtern;
    STX_CHECK(readInterface(*proto, depth));
    if (!isExtern) return readInside(proto, [&] { return readProtoBody(*proto, depth); });
    STX_TRY(auto urls, readFieldValue(lexer_, FieldType::MFURL, false));
    proto->urls = std::get<std::vector<Url>>(std::move(urls));
    protoScopes_.back().push_back(proto);
    return {};
}

Result<void> BtReader::readInterface(Proto& proto, int depth) {
    STX_CHECK(take(Kind::openBracket, fmt::format("'[' behind PROTO {}", excerpt(proto.name))));
    Interface interface;
    while (lexer_.peek().kind != Kind::closeBracket) {
        const std::string where = lexer_.where();
        if (!isDeclaration()) return unexpected("field, exposedField, eventIn, eventOut or ']'");
        STX_TRY(const FieldInfo field, readDeclaration());
        // An EXTERNPROTO may leave the values to where it is.
        const bool leftOut =
            proto.isExtern && (lexer_.peek().kind == Kind::closeBracket || isDeclaration());
        const auto readValue = [&](const NodePtr& holder) -> Result<void> {
            int height = 0;
            return leftOut ? Result<void>() : readValueInto(holder, 0, depth, height);
        };
        STX_CHECK(addField(interface, proto, field, where, readValue));
    }
    STX_TRY([[maybe_unused]] const auto bracket, lexer_.take());
    setInterface(proto, std::move(interface));
    return {};
}

Result<void> BtReader::readProtoBody(Proto& proto, int depth) {
    const std::string where = lexer_.where();
    STX_CHECK(take(Kind::openBrace, fmt::format("'{{' of PROTO {}", excerpt(proto.name))));
    while (lexer_.peek().kind != Kind::closeBrace) {
        if (lexer_.peek().kind == Kind::end)
            return unexpected(fmt::format("'}}' for PROTO {} at {}", excerpt(proto.name), where));
        if (isWord("PROTO") || isWord("EXTERNPROTO")) {
            STX_CHECK(readProto(depth + 1));
            continue;
        }
        std::string defName;
        const std::string nodeWhere = lexer_.where();
        STX_TRY(const bool def, takeIf("DEF"));
        if (def) STX_SET(defName, takeName("a DEF name"));
        STX_TRY(const bool isRoute, takeIf("ROUTE"));
        if (isRoute) {
            STX_TRY(auto route, readRoute(defName));
            proto.routes.push_back(std::move(route));
            continue;
        }
        int height = 0;
        STX_TRY(auto node, readNodeBody(defName, nodeWhere, depth + 1, height));
        proto.body.push_back(std::move(node));
    }
    STX_TRY([[maybe_unused]] const auto brace, lexer_.take());
    return {};
}

}  // namespace stx::mpeg4
