#include "formats/mpeg4/bifs/interface_types.hpp"
#include "formats/mpeg4/bifs/script_code.hpp"
#include "formats/mpeg4/text/xmt_reader.hpp"
#include "formats/mpeg4/text/xmt_types.hpp"

namespace stx::mpeg4 {

NodePtr XmtReader::makeNamedInstance(std::string_view type) const {
    for (auto scope = protoScopes_.rbegin(); scope != protoScopes_.rend(); ++scope)
        for (auto proto = scope->rbegin(); proto != scope->rend(); ++proto)
            if ((*proto)->name == type) return makeInstance(*proto);
    return nullptr;
}

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
                      "'{}' is no name of a field: letters, digits and _", excerpt(field.name));
    field.type = *type;
    field.kind = *kind;
    if (itemType(*type) == FieldType::SFNode) field.nodeType = Ndt::SFWorldNode;
    return field;
}

Result<void> XmtReader::readDeclaredValue(xml_node element, const NodePtr& node, int index,
                                          int depth, int& below) {
    const FieldInfo field = node->info->fields[static_cast<std::size_t>(index)];
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
    if (ownFieldCount(*script) >= kMaxOwnFields || !addScriptField(*script, field, std::nullopt))
        return failAt(where(element), ErrorCode::invalidInput,
                      "a Script has no room for the {} '{}': the name is taken, it has {} fields, "
                      "or the kind is not one of a Script",
                      name(field.kind), excerpt(field.name), kMaxOwnFields);
    return readDeclaredValue(element, script, script->info->find(field.name), depth, below);
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
    if (proto_ == nullptr)
        return failAt(where(element), ErrorCode::invalidInput, "<IS> stands outside of a PROTO");
    if (bufferDepth_ > 0)
        return failAt(where(element), ErrorCode::unsupported,
                      "<IS> is in a buffer of commands, which has no such links in BIFS; give "
                      "the field a value");
    for (const xml_node child : elements(element)) {
        if (localName(child) != "connect") return unexpectedElement(child, "connect in IS");
        const std::string_view own = child.attribute("nodeField").value();
        const std::string_view linked = child.attribute("protoField").value();
        const int field = node->info->findIgnoringCase(own);
        const int index = proto_->type.findIgnoringCase(linked);
        if (field < 0 || index < 0)
            return failAt(where(child), ErrorCode::invalidInput, "{} has no field '{}'",
                          field < 0 ? node->info->name : proto_->name,
                          excerpt(field < 0 ? own : linked));
        const FieldType ownType = node->info->fields[static_cast<std::size_t>(field)].type;
        const FieldType other = proto_->type.fields[static_cast<std::size_t>(index)].type;
        if (ownType != other)
            return failAt(where(child), ErrorCode::invalidInput,
                          "{}.{} is {} and IS {}, which is {}", node->info->name, own,
                          name(ownType), linked, name(other));
        STX_CHECK(names_.countNode());
        if (node->isSet(field) || !linked_.emplace(node.get(), field).second)
            return failAt(where(child), ErrorCode::invalidInput, "{}.{} has a value already",
                          node->info->name, own);
        proto_->links.push_back({node, field, index});
    }
    return {};
}

Result<void> XmtReader::readProto(xml_node element, int depth) {
    if (depth > job_.limits.maxNesting || ++protoCount_ > kMaxProtos)
        return failAt(where(element), ErrorCode::invalidInput,
                      "there are more than {} PROTOs, or they nest deeper than {}", kMaxProtos,
                      job_.limits.maxNesting);
    const auto proto = std::make_shared<Proto>();
    proto->name = element.attribute("name").value();
    if (!isScriptName(proto->name) || findNode(proto->name))
        return failAt(where(element), ErrorCode::invalidInput,
                      "'{}' is no name for a PROTO: letters, digits and _, and no node's name",
                      excerpt(proto->name));
    const auto locations = element.attribute("locations");
    proto->isExtern = !locations.empty();
    if (proto->isExtern) {
        STX_TRY(auto urls,
                attributeValue(element, "locations", locations.value(), FieldType::MFURL));
        proto->urls = std::get<std::vector<Url>>(std::move(urls));
    }
    NodeNames outer = std::exchange(names_, names_.ofBody());
    Proto* const outerProto = std::exchange(proto_, proto.get());
    const bool outerInCommand = std::exchange(inCommand_, false);
    auto outerPassed = std::exchange(passed_, {});
    protoScopes_.emplace_back();
    STX_CHECK(names_.countNode());
    STX_CHECK(readProtoContent(element, *proto, depth));
    proto->protos = std::move(protoScopes_.back());
    protoScopes_.pop_back();
    inCommand_ = outerInCommand;
    passed_ = std::move(outerPassed);
    proto_ = outerProto;
    outer.countOn(names_);
    names_ = std::move(outer);
    protoScopes_.back().push_back(proto);
    return {};
}

Result<void> XmtReader::readProtoContent(xml_node element, Proto& proto, int depth) {
    std::vector<FieldInfo> fields;
    auto defaults = std::make_shared<FieldDefaults>();
    for (const xml_node child : elements(element)) {
        if (localName(child) != "field") continue;
        STX_TRY(const FieldInfo field, readDeclaration(child));
        STX_CHECK(names_.countNode());
        for (const FieldInfo& other : fields)
            if (other.name == field.name)
                return failAt(where(child), ErrorCode::invalidInput, "PROTO {} has two fields '{}'",
                              proto.name, excerpt(field.name));
        if (static_cast<int>(fields.size()) >= kMaxOwnFields)
            return failAt(where(child), ErrorCode::invalidInput, "PROTO {} has more than {} fields",
                          proto.name, kMaxOwnFields);
        FieldValue value = emptyValue(field.type);
        if (field.kind == FieldKind::field || field.kind == FieldKind::exposedField) {
            const NodePtr holder = holderOf(field);
            int below = 0;
            STX_CHECK(readDeclaredValue(child, holder, 0, depth, below));
            value = holder->value(0);
        }
        defaults->values.push_back(std::move(value));
        fields.push_back(field);
    }
    proto.type = makeNodeInfo(proto.name, {}, fields);
    proto.type.isProto = true;
    proto.type.defaults = std::move(defaults);
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
    STX_CHECK(readBuffers());
    return names_.resolve();
}

Result<void> XmtReader::passBuffer(xml_node element, std::size_t number) {
    if (localName(element) != "buffer") return unexpectedElement(element, "buffer");
    if (bufferDepth_ >= kMaxBufferNesting)
        return failAt(where(element), ErrorCode::unsupported,
                      "buffers of commands are nested more than {} deep", kMaxBufferNesting);
    STX_CHECK(names_.countNode());
    passed_.push_back({element, number});
    return {};
}

Result<void> XmtReader::readBuffers() {
    for (const PassedBuffer& buffer : std::exchange(passed_, {})) {
        NodeNames outerNames = std::move(names_);
        names_ = NodeNames::inside(outerNames);
        auto outerFrames = std::exchange(document_.frames, {});
        const bool outerInCommand = inCommand_;
        ++bufferDepth_;
        STX_CHECK(readCommands(buffer.element, 0.0, 1));
        STX_CHECK(readBuffers());
        STX_CHECK(names_.resolve());
        --bufferDepth_;
        inCommand_ = outerInCommand;
        std::vector<Command> commands;
        for (CommandFrame& frame : document_.frames) commands = std::move(frame.commands);
        buffers_.put(buffer.number, std::move(commands), names_);
        document_.frames = std::move(outerFrames);
        outerNames.goOn(names_);
        names_ = std::move(outerNames);
    }
    return {};
}

}  // namespace stx::mpeg4
