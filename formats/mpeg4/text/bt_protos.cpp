#include "formats/mpeg4/bifs/interface_types.hpp"
#include "formats/mpeg4/bifs/script_code.hpp"
#include "formats/mpeg4/text/bt_reader.hpp"

namespace stx::mpeg4 {

using Kind = BtToken::Kind;

NodePtr BtReader::makeNamedNode(std::string_view type) const {
    for (auto scope = protoScopes_.rbegin(); scope != protoScopes_.rend(); ++scope)
        for (auto proto = scope->rbegin(); proto != scope->rend(); ++proto)
            if ((*proto)->name == type) return makeInstance(*proto);
    return makeNode(type);
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
    if (ownFieldCount(script) >= kMaxOwnFields || !addScriptField(script, field, std::nullopt))
        return failAt(where, ErrorCode::invalidInput,
                      "a Script has no room for the {} '{}': the name is taken, it has {} fields, "
                      "or the kind is not one of a Script",
                      name(field.kind), excerpt(field.name), kMaxOwnFields);
    return script.info->find(field.name);
}

Result<void> BtReader::readLink(const NodePtr& node, int field) {
    STX_CHECK(takeWord("IS"));
    const std::string where = lexer_.where();
    if (bufferDepth_ > 0)
        return failAt(where, ErrorCode::unsupported,
                      "IS is in a buffer of commands, which has no such links in BIFS; give the "
                      "field a value");
    STX_TRY(const auto linked, takeName("the name of a field of the PROTO"));
    if (proto_ == nullptr)
        return failAt(where, ErrorCode::invalidInput, "IS stands outside of a PROTO");
    const int index = proto_->type.findIgnoringCase(linked);
    if (index < 0)
        return failAt(where, ErrorCode::invalidInput, "PROTO {} has no field '{}'", proto_->name,
                      excerpt(linked));
    const FieldInfo& own = node->info->fields[field];
    const FieldInfo& other = proto_->type.fields[index];
    if (own.type != other.type)
        return failAt(where, ErrorCode::invalidInput, "{}.{} is {} and IS {}, which is {}",
                      node->info->name, own.name, name(own.type), other.name, name(other.type));
    if (node->isSet(field) || !linked_.emplace(node.get(), field).second)
        return failAt(where, ErrorCode::invalidInput, "{}.{} has a value already", node->info->name,
                      own.name);
    proto_->links.push_back({node, field, index});
    return {};
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
    node->set(index, std::move(*value));
    return {};
}

Result<void> BtReader::readProto(int depth) {
    const std::string where = lexer_.where();
    if (depth > job_.limits.maxNesting || ++protoCount_ > kMaxProtos)
        return failAt(where, ErrorCode::invalidInput,
                      "there are more than {} PROTOs, or they nest deeper than {}", kMaxProtos,
                      job_.limits.maxNesting);
    const auto proto = std::make_shared<Proto>();
    proto->isExtern = isWord("EXTERNPROTO");
    STX_TRY([[maybe_unused]] const auto word, lexer_.take());
    STX_TRY(proto->name, takeName("the name of a PROTO"));
    if (!isScriptName(proto->name) || findNode(proto->name))
        return failAt(where, ErrorCode::invalidInput,
                      "'{}' is no name for a PROTO: letters, digits and _, and no node's name",
                      excerpt(proto->name));
    STX_CHECK(names_.countNode());
    STX_CHECK(readInterface(*proto, depth));
    if (proto->isExtern) {
        STX_TRY(auto urls, readFieldValue(lexer_, FieldType::MFURL, false));
        proto->urls = std::get<std::vector<Url>>(std::move(urls));
    } else {
        NodeNames outer = std::exchange(names_, names_.ofBody());
        Proto* const outerProto = std::exchange(proto_, proto.get());
        const bool outerInCommand = std::exchange(inCommand_, false);
        auto outerPassed = std::exchange(passed_, {});
        STX_CHECK(readProtoBody(*proto, depth));
        inCommand_ = outerInCommand;
        passed_ = std::move(outerPassed);
        proto_ = outerProto;
        outer.countOn(names_);
        names_ = std::move(outer);
    }
    protoScopes_.back().push_back(proto);
    return {};
}

Result<void> BtReader::readInterface(Proto& proto, int depth) {
    STX_CHECK(take(Kind::openBracket, fmt::format("'[' behind PROTO {}", excerpt(proto.name))));
    std::vector<FieldInfo> fields;
    auto defaults = std::make_shared<FieldDefaults>();
    while (lexer_.peek().kind != Kind::closeBracket) {
        const std::string where = lexer_.where();
        if (!isDeclaration()) return unexpected("field, exposedField, eventIn, eventOut or ']'");
        STX_TRY(const FieldInfo field, readDeclaration());
        for (const FieldInfo& other : fields)
            if (other.name == field.name)
                return failAt(where, ErrorCode::invalidInput, "PROTO {} has two fields '{}'",
                              proto.name, excerpt(field.name));
        if (static_cast<int>(fields.size()) >= kMaxOwnFields)
            return failAt(where, ErrorCode::invalidInput, "PROTO {} has more than {} fields",
                          proto.name, kMaxOwnFields);
        STX_CHECK(names_.countNode());
        FieldValue value = emptyValue(field.type);
        const bool hasValue =
            field.kind == FieldKind::field || field.kind == FieldKind::exposedField;
        // An EXTERNPROTO may leave the values to where it is.
        const bool leftOut =
            proto.isExtern && (lexer_.peek().kind == Kind::closeBracket || isDeclaration());
        if (hasValue && !leftOut) {
            const NodePtr holder = holderOf(field);
            int height = 0;
            STX_CHECK(readValueInto(holder, 0, depth, height));
            value = holder->value(0);
        }
        defaults->values.push_back(std::move(value));
        fields.push_back(field);
    }
    STX_TRY([[maybe_unused]] const auto bracket, lexer_.take());
    proto.type = makeNodeInfo(proto.name, {}, fields);
    proto.type.isProto = true;
    proto.type.defaults = std::move(defaults);
    return {};
}

Result<void> BtReader::readProtoBody(Proto& proto, int depth) {
    const std::string where = lexer_.where();
    STX_CHECK(take(Kind::openBrace, fmt::format("'{{' of PROTO {}", excerpt(proto.name))));
    protoScopes_.emplace_back();
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
        if (def) {
            STX_TRY(defName, takeName("a DEF name"));
        }
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
    STX_CHECK(readBuffers());
    STX_CHECK(names_.resolve());
    proto.protos = std::move(protoScopes_.back());
    protoScopes_.pop_back();
    return {};
}

}  // namespace stx::mpeg4
