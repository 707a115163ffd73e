#include "formats/mpeg4/text/text_reader.hpp"

#include "formats/mpeg4/bifs/interface_types.hpp"
#include "formats/mpeg4/bifs/script_code.hpp"
#include "formats/mpeg4/text/text_values.hpp"

namespace stx::mpeg4 {

NodePtr TextReader::makeNamedInstance(std::string_view name) const {
    for (auto scope = protoScopes_.rbegin(); scope != protoScopes_.rend(); ++scope)
        for (auto proto = scope->rbegin(); proto != scope->rend(); ++proto)
            if ((*proto)->name == name) return makeInstance(*proto);
    return nullptr;
}

Result<std::shared_ptr<Proto>> TextReader::makeProto(std::string name, int depth,
                                                     const std::string& where) {
    if (depth > job_.limits.maxNesting || ++protoCount_ > kMaxProtos)
        return failAt(where, ErrorCode::invalidInput,
                      "the text has more than {} PROTOs, or they are nested deeper than {}",
                      kMaxProtos, job_.limits.maxNesting);
    if (!isScriptName(name) || findNode(name))
        return failAt(where, ErrorCode::invalidInput,
                      "'{}' is not a name for a PROTO: letters, digits and _, and no node's name",
                      excerpt(name));
    STX_CHECK(names_.countNode());
    auto proto = std::make_shared<Proto>();
    proto->name = std::move(name);
    return proto;
}

Result<void> TextReader::addField(Interface& interface, const Proto& proto, const FieldInfo& field,
                                  const std::string& where,
                                  const std::function<Result<void>(const NodePtr&)>& readValue) {
    for (const FieldInfo& other : interface.fields)
        if (other.name == field.name)
            return failAt(where, ErrorCode::invalidInput, "PROTO {} has two fields '{}'",
                          proto.name, excerpt(field.name));
    if (static_cast<int>(interface.fields.size()) >= kMaxOwnFields)
        return failAt(where, ErrorCode::invalidInput, "PROTO {} has more than {} fields",
                      proto.name, kMaxOwnFields);
    STX_CHECK(names_.countNode());
    FieldValue value = emptyValue(field.type);
    const bool hasValue = field.kind == FieldKind::field || field.kind == FieldKind::exposedField;
    if (readValue && hasValue) {
        const NodePtr holder = holderOf(field);
        STX_CHECK(readValue(holder));
        value = holder->value(0);
    }
    interface.defaults->values.push_back(std::move(value));
    interface.fields.push_back(field);
    return {};
}

void TextReader::setInterface(Proto& proto, Interface interface) {
    proto.type = makeNodeInfo(proto.name, {}, interface.fields);
    proto.type.isProto = true;
    proto.type.defaults = std::move(interface.defaults);
}

Result<void> TextReader::readInside(const std::shared_ptr<Proto>& proto,
                                    const std::function<Result<void>()>& read) {
    NodeNames outerNames = std::exchange(names_, names_.ofBody());
    Proto* const outerProto = std::exchange(proto_, proto.get());
    const bool outerInCommand = std::exchange(inCommand_, false);
    auto outerWaiting = std::exchange(waiting_, {});
    protoScopes_.emplace_back();
    STX_CHECK(read());
    STX_CHECK(readBuffers());
    STX_CHECK(names_.resolve());
    proto->protos = std::move(protoScopes_.back());
    protoScopes_.pop_back();
    waiting_ = std::move(outerWaiting);
    inCommand_ = outerInCommand;
    proto_ = outerProto;
    outerNames.countOn(names_);
    names_ = std::move(outerNames);
    protoScopes_.back().push_back(proto);
    return {};
}

Result<void> TextReader::addLink(const NodePtr& node, int field, std::string_view linked,
                                 const std::string& where) {
    if (bufferDepth_ > 0)
        return failAt(where, ErrorCode::unsupported,
                      "IS is in a buffer of commands, which has no such links in BIFS; give the "
                      "field a value");
    if (proto_ == nullptr)
        return failAt(where, ErrorCode::invalidInput, "IS is outside of a PROTO");
    const int index = proto_->type.findIgnoringCase(linked);
    if (index < 0)
        return failAt(where, ErrorCode::invalidInput, "PROTO {} has no field '{}'", proto_->name,
                      excerpt(linked));
    const FieldInfo& own = node->info->fields[field];
    const FieldInfo& other = proto_->type.fields[index];
    if (own.type != other.type)
        return failAt(where, ErrorCode::invalidInput, "{}.{} is {} and IS {}, which is {}",
                      node->info->name, own.name, name(own.type), other.name, name(other.type));
    STX_CHECK(names_.countNode());
    if (node->isSet(field) || !linked_.emplace(node.get(), field).second)
        return failAt(where, ErrorCode::invalidInput, "{}.{} has a value already", node->info->name,
                      own.name);
    proto_->links.push_back({node, field, index});
    return {};
}

Result<int> TextReader::addOwnField(Node& script, const FieldInfo& field,
                                    const std::string& where) const {
    if (ownFieldCount(script) >= kMaxOwnFields || !addScriptField(script, field, std::nullopt))
        return failAt(where, ErrorCode::invalidInput,
                      "a Script has no room for the {} '{}': the name is taken, it has {} fields, "
                      "or the kind is not one of a Script",
                      name(field.kind), excerpt(field.name), kMaxOwnFields);
    return script.info->find(field.name);
}

Result<std::uint32_t> TextReader::routeId(const std::string& name, const std::string& where) {
    if (bufferDepth_ > 0 && idFromTextName(name, 'R') == 0)
        return failAt(where, ErrorCode::unsupported,
                      "commands in a buffer reach ROUTEs by number only: name it R0, R1, ... "
                      "instead of '{}'",
                      excerpt(name));
    return routes_.idOf(name, where);
}

Result<void> TextReader::addBuffer(std::size_t number, const std::string& where,
                                   std::function<Result<void>()> read) {
    if (bufferDepth_ >= kMaxBufferNesting)
        return failAt(where, ErrorCode::unsupported,
                      "buffers of commands are nested more than {} deep", kMaxBufferNesting);
    STX_CHECK(names_.countNode());
    waiting_.push_back({number, std::move(read)});
    return {};
}

Result<void> TextReader::readBuffers() {
    for (const WaitingBuffer& buffer : std::exchange(waiting_, {})) {
        NodeNames outerNames = std::move(names_);
        names_ = NodeNames::inside(outerNames);
        auto outerFrames = std::exchange(document_.frames, {});
        const bool outerInCommand = inCommand_;
        ++bufferDepth_;
        STX_CHECK(buffer.read());
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
