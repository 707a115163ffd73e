#include "formats/mpeg4/text/bt_reader.hpp"

#include <span>

#include "formats/files/text_encoding.hpp"

namespace stx::mpeg4 {

using Kind = BtToken::Kind;

Result<Document> BtReader::read() {
    STX_CHECK(lexer_.start());
    if (lexer_.peek().kind == Kind::end)
        return failAt(lexer_.where(), ErrorCode::invalidInput,
                      "the file is empty, expected a scene such as Group {{ ... }}");
    while (lexer_.peek().kind != Kind::end) STX_CHECK(readTopLevel());
    if (document_.frames.empty())
        return failAt(lexer_.where(), ErrorCode::invalidInput,
                      "the file ends without a scene, expected a node such as Group {{ ... }}");
    STX_CHECK(readBuffers());
    STX_CHECK(readDescriptors());
    routes_.number(document_.frames);
    STX_CHECK(finishDocument(document_, names_));
    STX_CHECK(buffers_.encode(document_));
    return std::move(document_);
}

Result<void> BtReader::readTopLevel() {
    if (isWord("InitialObjectDescriptor") || isWord("ObjectDescriptor")) {
        if (iod_) return unexpected("one InitialObjectDescriptor only");
        STX_TRY(auto descriptor, readDescriptor(1));
        iod_ = std::move(descriptor);
        return {};
    }
    if (isWord("RAP") || isWord("AT")) return readBlock();
    if (isWord("PROTO") || isWord("EXTERNPROTO")) return readProto(1);
    if (isWord("ROUTE")) return readSceneRoute("");
    if (isWord("DEF")) {
        STX_CHECK(takeWord("DEF"));
        const std::string where = lexer_.where();
        STX_TRY(auto defName, takeName("a DEF name"));
        if (isWord("ROUTE")) return readSceneRoute(defName);
        return readTopNode(defName, where);
    }
    if (isWord("REPLACE") || isWord("INSERT") || isWord("APPEND") || isWord("DELETE") ||
        isWord("UPDATE") || isWord("REMOVE"))
        return readCommand(0);
    return readTopNode("", lexer_.where());
}

Result<void> BtReader::readTopNode(const std::string& defName, const std::string& where) {
    if (lexer_.peek().kind != Kind::word)
        return unexpected("a node, ROUTE, AT or InitialObjectDescriptor");
    if (haveScene_)
        return unexpected("ROUTE, AT or the end of the file (there is a scene already)");
    haveScene_ = true;
    ReplaceScene scene;
    int height = 0;
    STX_TRY(scene.root, readNodeBody(defName, where, 1, height));
    STX_CHECK(checkNodePlace(scene.root.get(), Ndt::SFTopNode, "the scene", "root", where));
    scene.protos = protoScopes_.front();
    addCommand(document_.frames, 0, std::move(scene));
    return {};
}

Result<void> BtReader::readSceneRoute(const std::string& defName) {
    const std::string where = lexer_.where();
    STX_CHECK(takeWord("ROUTE"));
    STX_TRY(auto route, readRoute(defName));
    for (CommandFrame& frame : document_.frames)
        for (Command& command : frame.commands)
            if (auto* scene = std::get_if<ReplaceScene>(&command)) {
                scene->routes.push_back(std::move(route));
                return {};
            }
    return failAt(where, ErrorCode::invalidInput, "a ROUTE stands before the scene");
}

Result<Route> BtReader::readRoute(const std::string& defName) {
    Route route;
    route.id = idFromTextName(defName, 'R');
    if (route.id == 0) route.name = defName;
    STX_CHECK(readRouteEnd(route.from, route.fromField, FieldUse::out));
    STX_CHECK(takeWord("TO"));
    STX_CHECK(readRouteEnd(route.to, route.toField, FieldUse::in));
    const auto& source = route.from->info->fields[route.fromField];
    const auto& target = route.to->info->fields[route.toField];
    if (source.type != target.type)
        return failAt(lexer_.where(), ErrorCode::invalidInput,
                      "the ROUTE leads from {} {} to {} {}; both must have one type",
                      name(source.type), source.name, name(target.type), target.name);
    routes_.define(route);
    return route;
}

Result<void> BtReader::readRouteEnd(NodePtr& node, int& field, FieldUse use) {
    const std::string where = lexer_.where();
    STX_TRY(const auto text, takeName("NODE.field"));
    const auto dot = text.rfind('.');
    if (dot == std::string::npos || dot == 0 || dot + 1 == text.size())
        return failAt(where, ErrorCode::invalidInput, "found '{}', expected NODE.field",
                      excerpt(text));
    STX_TRY(node, names_.target(text.substr(0, dot), where));
    STX_TRY(field, fieldOfCommand(*node, std::string_view(text).substr(dot + 1), use, where));
    return {};
}

Result<void> BtReader::readBlock() {
    STX_TRY(const bool rap, takeIf("RAP"));
    STX_CHECK(takeWord("AT"));
    const std::string where = lexer_.where();
    STX_TRY(const auto text, takeName("a time"));
    // `D500`: so much after the block before.
    const bool relative = !text.empty() && (text[0] == 'D' || text[0] == 'd');
    const auto number = integerFromText(relative ? std::string_view(text).substr(1) : text);
    if (!number || *number < 0 || *number > (std::int64_t{1} << 53))
        return failAt(where, ErrorCode::invalidInput,
                      "found '{}', expected a time of 0 or more ticks", excerpt(text));
    const std::uint64_t time = static_cast<std::uint64_t>(*number) + (relative ? lastTime_ : 0);
    lastTime_ = time;
    STX_TRY(const bool in, takeIf("IN"));
    if (in) STX_SET([[maybe_unused]] const auto stream, takeName("a stream's ES_ID"));
    const std::size_t before = commandsAt(document_.frames, time);
    rap_ = rap;
    names_.goTo(time);
    STX_CHECK(readBlockCommands(time));
    rap_ = false;
    if (rap && commandsAt(document_.frames, time) > before)
        markRandomAccess(document_.frames, time);
    return {};
}

Result<void> BtReader::readBlockCommands(std::uint64_t time) {
    const std::string blockWhere = lexer_.where();
    STX_CHECK(take(Kind::openBrace, "'{'"));
    while (lexer_.peek().kind != Kind::closeBrace) {
        if (isWord("AT") || isWord("RAP")) {
            // Dumps of another tool leave this brace out between two blocks.
            job_.note(fmt::format("{}: the block has no closing brace; taken as closed at {}",
                                  blockWhere, lexer_.where()));
            return {};
        }
        if (lexer_.peek().kind == Kind::end)
            return unexpected(fmt::format("'}}' for the block that begins at {}", blockWhere));
        STX_CHECK(readCommand(time));
    }
    STX_TRY([[maybe_unused]] const auto brace, lexer_.take());
    return {};
}

Result<void> BtReader::readOdUpdate(std::uint64_t time) {
    const std::string where = lexer_.where();
    STX_TRY(const bool od, takeIf("OD"));
    if (!od) return unexpected("OD (UPDATE OD [ ... ])");
    std::vector<TextDescriptor> list;
    STX_CHECK(take(Kind::openBracket, "'['"));
    while (lexer_.peek().kind != Kind::closeBracket) {
        STX_TRY(auto descriptor, readDescriptor(1));
        list.push_back(std::move(descriptor));
    }
    STX_TRY([[maybe_unused]] const auto bracket, lexer_.take());
    odUpdates_.push_back({time, std::move(list), {}, rap_});
    return {};
}

Result<void> BtReader::readOdRemove(std::uint64_t time) {
    STX_TRY(const bool od, takeIf("OD"));
    if (!od) return unexpected("OD (REMOVE OD [ ... ])");
    RemoveObjectDescriptors remove;
    STX_CHECK(take(Kind::openBracket, "'['"));
    while (lexer_.peek().kind != Kind::closeBracket) {
        const auto id =
            lexer_.peek().kind == Kind::word ? odFromUrl(lexer_.peek().text) : std::nullopt;
        if (!id) return unexpected("an object descriptor's id or ']'");
        remove.ids.push_back(*id);
        STX_TRY([[maybe_unused]] const auto taken, lexer_.take());
    }
    STX_TRY([[maybe_unused]] const auto bracket, lexer_.take());
    odUpdates_.push_back({time, {}, std::move(remove), rap_});
    return {};
}

Result<TextDescriptor> BtReader::readDescriptor(int depth) {
    TextDescriptor descriptor;
    descriptor.where = lexer_.where();
    if (depth > job_.limits.maxNesting)
        return failAt(descriptor.where, ErrorCode::invalidInput, "descriptors nest deeper than {}",
                      job_.limits.maxNesting);
    STX_TRY(descriptor.type, takeName("a descriptor such as ObjectDescriptor"));
    STX_CHECK(names_.countNode());
    STX_CHECK(take(Kind::openBrace, "'{'"));
    while (lexer_.peek().kind != Kind::closeBrace) {
        const std::string where = lexer_.where();
        STX_TRY(const auto fieldName, takeName("the name of a field or '}'"));
        if (lexer_.peek().kind == Kind::openBracket) {
            STX_TRY([[maybe_unused]] const auto open, lexer_.take());
            while (lexer_.peek().kind != Kind::closeBracket)
                STX_CHECK(readDescriptorValue(descriptor, fieldName, where, depth));
            STX_TRY([[maybe_unused]] const auto close, lexer_.take());
        } else {
            STX_CHECK(readDescriptorValue(descriptor, fieldName, where, depth));
        }
    }
    STX_TRY([[maybe_unused]] const auto brace, lexer_.take());
    return descriptor;
}

Result<void> BtReader::readDescriptorValue(TextDescriptor& descriptor, const std::string& fieldName,
                                           const std::string& where, int depth) {
    const Kind kind = lexer_.peek().kind;
    if (kind != Kind::word && kind != Kind::string)
        return unexpected(fmt::format("a value for {}", excerpt(fieldName)));
    if (kind == Kind::word && isDescriptorType(lexer_.peek().text)) {
        STX_TRY(auto child, readDescriptor(depth + 1));
        descriptor.children.push_back(std::move(child));
        return {};
    }
    STX_TRY(auto token, lexer_.take());
    if (kind == Kind::word && lexer_.peek().kind == Kind::openBrace)
        return skipBraces(std::string(token.text), lexer_.where(token));
    descriptor.fields.push_back(
        {fieldName, kind == Kind::string ? std::move(token.value) : std::string(token.text),
         where});
    return {};
}

Result<void> BtReader::skipBraces(const std::string& type, const std::string& where) {
    job_.note(fmt::format("{} is passed over", excerpt(type)));
    int open = 0;
    do {
        if (lexer_.peek().kind == Kind::openBrace) ++open;
        if (lexer_.peek().kind == Kind::closeBrace) --open;
        if (lexer_.peek().kind == Kind::end)
            return unexpected(fmt::format("'}}' for {} at {}", excerpt(type), where));
        STX_TRY([[maybe_unused]] const auto taken, lexer_.take());
    } while (open > 0);
    return {};
}

Result<void> BtReader::readDescriptors() {
    TextIds odIds, esIds;
    if (iod_) collectTextIds(*iod_, odIds, esIds);
    if (iod_) STX_CHECK(initialDescriptorFromText(*iod_, odIds, esIds, document_, job_));
    for (const OdUpdate& update : odUpdates_) {
        if (!update.remove.ids.empty()) {
            addCommand(document_.odFrames, update.time, update.remove);
            if (update.randomAccess) markRandomAccess(document_.odFrames, update.time);
            continue;
        }
        UpdateObjectDescriptors command;
        for (const TextDescriptor& descriptor : update.descriptors) {
            STX_TRY(auto od, objectDescriptorFromText(descriptor, odIds, esIds));
            command.descriptors.push_back(std::move(od));
        }
        addCommand(document_.odFrames, update.time, std::move(command));
        if (update.randomAccess) markRandomAccess(document_.odFrames, update.time);
    }
    return {};
}

Result<NodePtr> BtReader::readNode(int depth, int& height, NodePtr owner, int field, int item) {
    height = 0;
    const std::string where = lexer_.where();
    STX_TRY(const bool null, takeIf("NULL"));
    if (null) return NodePtr();
    STX_TRY(const bool use, takeIf("USE"));
    if (use) {
        STX_TRY(auto useName, takeName("a DEF name"));
        STX_TRY(auto node, names_.use(useName, depth, where, height));
        if (node) return node;
        if (!owner) return names_.target(useName, where);
        names_.useLater(std::move(useName), std::move(owner), field, item, where);
        return NodePtr();
    }
    STX_TRY(const bool def, takeIf("DEF"));
    std::string defName;
    if (def) STX_SET(defName, takeName("a DEF name"));
    return readNodeBody(defName, where, depth, height);
}

Result<NodePtr> BtReader::readNodeBody(const std::string& defName, const std::string& where,
                                       int depth, int& height) {
    if (depth > job_.limits.maxNesting)
        return failAt(where, ErrorCode::invalidInput, "nodes nest deeper than {}",
                      job_.limits.maxNesting);
    const std::string typeWhere = lexer_.where();
    STX_TRY(const auto type, takeName("a node such as DepthImage"));
    NodePtr node = makeNamedNode(type);
    if (!node)
        return failAt(
            typeWhere, ErrorCode::invalidInput,
            "found '{}', expected a node such as DepthImage, or a PROTO declared before it",
            excerpt(type));
    STX_CHECK(names_.countNode());
    if (!defName.empty()) STX_CHECK(names_.define(defName, node, where, inCommand_));
    STX_CHECK(take(Kind::openBrace, fmt::format("'{{' behind {}", type)));
    int below = 0;
    while (lexer_.peek().kind != Kind::closeBrace) {
        const std::string fieldWhere = lexer_.where();
        int index = -1;
        if (node->is("Script") && isDeclaration()) {
            STX_TRY(index, readOwnField(*node));
            const FieldInfo& own = node->info->fields[index];
            if (own.kind != FieldKind::field && !isWord("IS")) continue;
        } else {
            STX_TRY(const auto fieldName, takeName(fmt::format("a field of {} or '}}'", type)));
            index = node->info->findIgnoringCase(fieldName);
            if (index < 0)
                return failAt(fieldWhere, ErrorCode::invalidInput, "{} has no field '{}'", type,
                              excerpt(fieldName));
        }
        if (isWord("IS")) {
            STX_CHECK(readLink(node, index));
            continue;
        }
        const FieldInfo& field = node->info->fields[index];
        if (isLinked(node, index))
            return failAt(fieldWhere, ErrorCode::invalidInput, "{}.{} has an IS already", type,
                          field.name);
        if (!field.hasValue())
            return failAt(fieldWhere, ErrorCode::invalidInput, "{}.{} is an {} and takes no value",
                          type, field.name, name(field.kind));
        int fieldHeight = 0;
        STX_CHECK(readValueInto(node, index, depth, fieldHeight));
        below = std::max(below, fieldHeight);
    }
    STX_TRY([[maybe_unused]] const auto brace, lexer_.take());
    height = below + 1;
    if (!defName.empty()) names_.closed(node, height);
    return node;
}

Result<void> BtReader::readNodeList(const NodePtr& owner, int index, int depth, int& height,
                                    bool waits) {
    const FieldInfo& field = owner->info->fields[index];
    owner->set(index, NodeList());
    height = 0;
    const bool brackets = lexer_.peek().kind == Kind::openBracket;
    if (brackets) STX_CHECK(take(Kind::openBracket, "'['"));
    while (!brackets || lexer_.peek().kind != Kind::closeBracket) {
        const std::string where = lexer_.where();
        const auto item = static_cast<int>(std::get<NodeList>(owner->value(index)).size());
        // Something must be in the list while a later name is waited for.
        std::get<NodeList>(owner->edit(index)).push_back(nullptr);
        const bool isNull = isWord("NULL");
        int itemHeight = 0;
        STX_TRY(auto child, readNode(depth, itemHeight, waits ? owner : nullptr, index, item));
        STX_CHECK(
            checkNodePlace(child.get(), field.nodeType, owner->info->name, field.name, where));
        if (isNull) {
            std::get<NodeList>(owner->edit(index)).pop_back();
        } else {
            std::get<NodeList>(owner->edit(index))[item] = std::move(child);
        }
        height = std::max(height, itemHeight);
        if (!brackets) return {};
    }
    STX_TRY([[maybe_unused]] const auto close, lexer_.take());
    return {};
}

Result<Document> readBt(std::string_view text, const std::string& name, Job& job) {
    const auto utf8 = utf8FromMarked(std::as_bytes(std::span(text)));
    return BtReader(utf8 ? textOf(*utf8) : text, name, job).read();
}

}  // namespace stx::mpeg4
