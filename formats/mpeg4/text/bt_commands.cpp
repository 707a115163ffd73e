#include "formats/mpeg4/text/bt_reader.hpp"

namespace stx::mpeg4 {

using Kind = BtToken::Kind;

Result<void> BtReader::readCommand(std::uint64_t time) {
    inCommand_ = true;
    if (bufferDepth_ > 0 && (isWord("UPDATE") || isWord("REMOVE")))
        return unexpected(
            "REPLACE, INSERT, APPEND, DELETE or '}' (a buffer has commands of the "
            "scene only)");
    STX_TRY(const bool update, takeIf("UPDATE"));
    if (update) return readOdUpdate(time);
    STX_TRY(const bool remove, takeIf("REMOVE"));
    if (remove) return readOdRemove(time);
    STX_TRY(const bool replace, takeIf("REPLACE"));
    if (replace) return readReplace(time);
    STX_TRY(const bool insert, takeIf("INSERT"));
    if (insert) return readInsert(time, false);
    STX_TRY(const bool append, takeIf("APPEND"));
    if (append) return readInsert(time, true);
    STX_TRY(const bool erase, takeIf("DELETE"));
    if (erase) return readDelete(time);
    return unexpected("UPDATE, REMOVE, REPLACE, INSERT, APPEND or DELETE");
}

Result<BtReader::Target> BtReader::readTarget() {
    Target target;
    target.where = lexer_.where();
    STX_TRY(const auto text, takeName("the DEF name of a node"));
    const auto dot = text.rfind('.');
    STX_TRY(target.node, names_.target(text.substr(0, dot), target.where));
    if (dot != std::string::npos)
        STX_SET(target.field, fieldOfCommand(*target.node, std::string_view(text).substr(dot + 1),
                                             FieldUse::in, target.where));
    if (lexer_.peek().kind == Kind::openBracket && target.field >= 0) {
        STX_TRY([[maybe_unused]] const auto open, lexer_.take());
        target.position = Position();
        STX_TRY(const bool last, takeIf("LAST"));
        STX_TRY(const bool end, takeIf("END"));
        STX_TRY(const bool first, takeIf("FIRST"));
        STX_TRY(const bool begin, takeIf("BEGIN"));
        if (first || begin) target.position->index = 0;
        if (!last && !end && !first && !begin) {
            const auto number = lexer_.peek().kind == Kind::word
                                    ? integerFromText(lexer_.peek().text)
                                    : std::nullopt;
            if (!number || *number < 0 || *number > 65535)
                return unexpected("an index from 0 to 65535, FIRST or LAST");
            target.position->index = static_cast<int>(*number);
            STX_TRY([[maybe_unused]] const auto taken, lexer_.take());
        }
        STX_CHECK(take(Kind::closeBracket, "']'"));
        if (!isMultiple(target.node->info->fields[target.field].type))
            return failAt(target.where, ErrorCode::invalidInput,
                          "{}.{} has one value, and so no index", target.node->info->name,
                          target.node->info->fields[target.field].name);
    }
    return target;
}

Result<FieldValue> BtReader::readCommandValue(const Target& target, bool item) {
    const FieldInfo& field = target.node->info->fields[target.field];
    const FieldType type = item ? itemType(field.type) : field.type;
    int height = 0;
    if (type == FieldType::SFNode) {
        const std::string where = lexer_.where();
        STX_TRY(auto node, readNode(1, height, nullptr, -1, -1));
        STX_CHECK(
            checkNodePlace(node.get(), field.nodeType, target.node->info->name, field.name, where));
        return FieldValue(std::move(node));
    }
    if (type == FieldType::MFNode) {
        // A holder, so that the list is read as in a node. An eventIn (addChildren) keeps no
        // value: the field that it feeds does.
        NodePtr holder = std::make_shared<Node>(*target.node->info);
        const int index = field.hasValue() ? target.field : holder->info->find("children");
        if (index < 0 || holder->info->fields[index].type != FieldType::MFNode)
            return failAt(target.where, ErrorCode::invalidInput,
                          "{}.{} takes no nodes by a command", target.node->info->name, field.name);
        STX_CHECK(readNodeList(holder, index, 1, height, false));
        return holder->value(index);
    }
    if (type == FieldType::SFCommandBuffer && lexer_.peek().kind == Kind::openBrace) {
        FieldValue placeholder = buffers_.addValue(proto_);
        STX_CHECK(passBuffer(buffers_.last()));
        return placeholder;
    }
    return readFieldValue(lexer_, type, false);
}

Result<void> BtReader::passBuffer(std::size_t number) {
    const std::string where = lexer_.where();
    STX_CHECK(take(Kind::openBrace, "'{'"));
    const auto read = [this, begin = lexer_]() -> Result<void> {
        BtLexer outer = std::exchange(lexer_, begin);
        while (lexer_.peek().kind != Kind::closeBrace) STX_CHECK(readCommand(0));
        lexer_ = std::move(outer);
        return {};
    };
    STX_CHECK(addBuffer(number, where, read));
    for (int open = 1; open > 0;) {
        if (lexer_.peek().kind == Kind::openBrace) ++open;
        if (lexer_.peek().kind == Kind::closeBrace) --open;
        if (lexer_.peek().kind == Kind::end)
            return unexpected(fmt::format("'}}' for the buffer that begins at {}", where));
        STX_TRY([[maybe_unused]] const auto taken, lexer_.take());
    }
    return {};
}

Result<void> BtReader::readReplace(std::uint64_t time) {
    STX_TRY(const bool isScene, takeIf("SCENE"));
    if (isScene) {
        STX_CHECK(takeWord("BY"));
        ReplaceScene scene;
        if (bufferDepth_ == 0) {
            STX_CHECK(readBuffers());
            // A scene that takes the place of another has PROTOs of its own.
            if (!document_.frames.empty()) protoScopes_.front().clear();
            while (isWord("PROTO") || isWord("EXTERNPROTO")) STX_CHECK(readProto(1));
            scene.protos = protoScopes_.front();
        }
        const std::string where = lexer_.where();
        int height = 0;
        STX_TRY(scene.root, readNode(1, height, nullptr, -1, -1));
        STX_CHECK(checkNodePlace(scene.root.get(), Ndt::SFTopNode, "the scene", "root", where));
        for (;;) {
            if (isWord("ROUTE")) {
                STX_CHECK(takeWord("ROUTE"));
                STX_TRY(auto route, readRoute(""));
                scene.routes.push_back(std::move(route));
            } else if (isWord("DEF")) {
                STX_CHECK(takeWord("DEF"));
                STX_TRY(const auto defName, takeName("a DEF name"));
                STX_CHECK(takeWord("ROUTE"));
                STX_TRY(auto route, readRoute(defName));
                scene.routes.push_back(std::move(route));
            } else {
                break;
            }
        }
        addCommand(document_.frames, time, std::move(scene));
        return {};
    }
    STX_TRY(const bool isRoute, takeIf("ROUTE"));
    if (isRoute) {
        ReplaceRoute replace;
        STX_TRY(const auto id, readRouteName());
        replace.routeId = id;
        STX_CHECK(takeWord("BY"));
        STX_TRY(replace.route, readRoute(""));
        // So that later commands find it.
        replace.route.id = id;
        addCommand(document_.frames, time, std::move(replace));
        return {};
    }
    STX_TRY(auto target, readTarget());
    STX_CHECK(takeWord("BY"));
    if (target.field < 0) {
        ReplaceNode replace;
        replace.target = target.node;
        int height = 0;
        const std::size_t named = names_.named().size();
        STX_TRY(replace.replacement, readNode(1, height, nullptr, -1, -1));
        names_.succeed(*target.node, replace.replacement, named);
        addCommand(document_.frames, time, std::move(replace));
        return {};
    }
    STX_TRY(auto value, readCommandValue(target, target.position.has_value()));
    if (target.position) {
        addCommand(document_.frames, time,
                   ReplaceIndexed{target.node, target.field, *target.position, std::move(value)});
    } else {
        addCommand(document_.frames, time,
                   ReplaceField{target.node, target.field, std::move(value)});
    }
    return {};
}

Result<void> BtReader::readInsert(std::uint64_t time, bool atEnd) {
    STX_TRY(const bool isRoute, takeIf("ROUTE"));
    if (isRoute) {
        STX_TRY(const bool isNamed, takeIf("DEF"));
        std::string defName;
        if (isNamed) STX_SET(defName, takeName("a DEF name"));
        STX_TRY(auto route, readRoute(defName));
        addCommand(document_.frames, time, InsertRoute{std::move(route)});
        return {};
    }
    // As this program once wrote it.
    if (isWord("DEF")) {
        STX_CHECK(takeWord("DEF"));
        STX_TRY(const auto defName, takeName("a DEF name"));
        STX_CHECK(takeWord("ROUTE"));
        STX_TRY(auto route, readRoute(defName));
        addCommand(document_.frames, time, InsertRoute{std::move(route)});
        return {};
    }
    STX_TRY([[maybe_unused]] const bool word, takeIf(atEnd ? "TO" : "AT"));
    STX_TRY(auto target, readTarget());
    if (target.field < 0) target.field = target.node->info->find("children");
    if (target.field < 0 || !isMultiple(target.node->info->fields[target.field].type))
        return failAt(target.where, ErrorCode::invalidInput,
                      "nothing can be inserted into {} here; name a field with several values",
                      target.node->info->name);
    if (atEnd) target.position = Position();
    if (!target.position)
        return failAt(target.where, ErrorCode::invalidInput,
                      "INSERT AT needs an index: {}[0]; or use APPEND TO",
                      target.node->info->fields[target.field].name);
    STX_TRY(auto value, readCommandValue(target, true));
    if (target.node->info->fields[target.field].name == "children") {
        addCommand(document_.frames, time,
                   InsertNode{target.node, *target.position, std::get<NodePtr>(value)});
    } else {
        addCommand(document_.frames, time,
                   InsertIndexed{target.node, target.field, *target.position, std::move(value)});
    }
    return {};
}

Result<void> BtReader::readDelete(std::uint64_t time) {
    STX_TRY(const bool isRoute, takeIf("ROUTE"));
    if (isRoute) {
        STX_TRY(const auto id, readRouteName());
        addCommand(document_.frames, time, DeleteRoute{id});
        return {};
    }
    STX_TRY(auto target, readTarget());
    if (target.field < 0) {
        addCommand(document_.frames, time, DeleteNode{target.node});
    } else if (target.position) {
        addCommand(document_.frames, time,
                   DeleteIndexed{target.node, target.field, *target.position});
    } else {
        return failAt(target.where, ErrorCode::invalidInput,
                      "a whole field cannot be deleted; name an item: {}[0]",
                      target.node->info->fields[target.field].name);
    }
    return {};
}

Result<std::uint32_t> BtReader::readRouteName() {
    const std::string where = lexer_.where();
    STX_TRY(const auto routeName, takeName("the DEF name of a ROUTE"));
    return routeId(routeName, where);
}

}  // namespace stx::mpeg4
