#include "formats/mpeg4/bt.hpp"
#include "formats/mpeg4/scene_text.hpp"
#include "formats/mpeg4/text_descriptors.hpp"
#include "formats/mpeg4/text_values.hpp"

namespace stx::mpeg4 {
namespace {

using Kind = BtToken::Kind;

class BtReader {
  public:
    BtReader(std::string_view text, const std::string& fileName, Job& job)
        : lexer_(text, fileName), job_(job), names_(job.limits) {}

    Result<Document> read() {
        STX_CHECK(lexer_.start());
        if (lexer_.peek().kind == Kind::end)
            return failAt(lexer_.where(), ErrorCode::invalidInput,
                          "the file is empty, expected a scene such as Group {{ ... }}");
        while (lexer_.peek().kind != Kind::end) STX_CHECK(readTopLevel());
        if (document_.frames.empty())
            return failAt(lexer_.where(), ErrorCode::invalidInput,
                          "the file ends without a scene, expected a node such as Group {{ ... }}");
        STX_CHECK(readDescriptors());
        if (auto ok = finishDocument(document_, names_); !ok) return propagate(ok);
        return std::move(document_);
    }

  private:
    // ---- Tokens
    tl::unexpected<Error> unexpected(std::string_view expected) {
        return failAt(lexer_.where(), ErrorCode::invalidInput, "found {}, expected {}",
                      lexer_.peek().describe(), expected);
    }
    bool isWord(std::string_view word) const {
        return lexer_.peek().kind == Kind::word && equalNoCase(lexer_.peek().text, word);
    }
    Result<bool> takeIf(std::string_view word) {
        if (!isWord(word)) return false;
        STX_TRY([[maybe_unused]] const auto taken, lexer_.take());
        return true;
    }
    Result<void> take(Kind kind, std::string_view expected) {
        if (lexer_.peek().kind != kind) return unexpected(expected);
        STX_TRY([[maybe_unused]] const auto taken, lexer_.take());
        return {};
    }
    Result<void> takeWord(std::string_view word) {
        STX_TRY(const bool taken, takeIf(word));
        if (!taken) return unexpected(fmt::format("{}", word));
        return {};
    }
    Result<std::string> takeName(std::string_view expected) {
        if (lexer_.peek().kind != Kind::word) return unexpected(expected);
        STX_TRY(const auto token, lexer_.take());
        return std::string(token.text);
    }

    // ---- Structure
    Result<void> readTopLevel() {
        if (isWord("InitialObjectDescriptor") || isWord("ObjectDescriptor")) {
            if (iod_) return unexpected("one InitialObjectDescriptor only");
            STX_TRY(auto descriptor, readDescriptor(1));
            iod_ = std::move(descriptor);
            return {};
        }
        if (isWord("RAP") || isWord("AT")) return readBlock();
        if (isWord("PROTO") || isWord("EXTERNPROTO"))
            return failAt(lexer_.where(), ErrorCode::unsupported, "PROTO is not supported");
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

    Result<void> readTopNode(const std::string& defName, const std::string& where) {
        if (lexer_.peek().kind != Kind::word)
            return unexpected("a node, ROUTE, AT or InitialObjectDescriptor");
        if (haveScene_)
            return unexpected("ROUTE, AT or the end of the file (there is a scene already)");
        haveScene_ = true;
        ReplaceScene scene;
        int height = 0;
        STX_TRY(scene.root, readNodeBody(defName, where, 1, height));
        STX_CHECK(checkNodePlace(scene.root.get(), Ndt::SFTopNode, "the scene", "root", where));
        addCommand(document_.frames, 0, std::move(scene));
        return {};
    }

    Result<void> readSceneRoute(const std::string& defName) {
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

    /// `A.x TO B.y`, with ROUTE already taken.
    Result<Route> readRoute(const std::string& defName) {
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
        if (!route.name.empty() || route.id != 0) routeIds_[textNameOf(route)] = route.id;
        return route;
    }
    Result<void> readRouteEnd(NodePtr& node, int& field, FieldUse use) {
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

    /// [RAP] AT time [IN stream] { commands }
    Result<void> readBlock() {
        STX_TRY([[maybe_unused]] const bool rap, takeIf("RAP"));
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
        if (in) {
            STX_TRY([[maybe_unused]] const auto stream, takeName("a stream's ES_ID"));
        }
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

    // ---- Commands
    Result<void> readCommand(std::uint64_t time) {
        inCommand_ = true;
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

    /// NODE, NODE.field or NODE.field[position], as the target of a command.
    struct Target {
        NodePtr node;
        int field = -1;
        std::optional<Position> position;
        std::string where;
    };
    Result<Target> readTarget() {
        Target target;
        target.where = lexer_.where();
        STX_TRY(const auto text, takeName("the DEF name of a node"));
        const auto dot = text.rfind('.');
        STX_TRY(target.node, names_.target(text.substr(0, dot), target.where));
        if (dot != std::string::npos) {
            STX_TRY(target.field,
                    fieldOfCommand(*target.node, std::string_view(text).substr(dot + 1),
                                   FieldUse::in, target.where));
        }
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

    /// A value for a field that a command sets; one item of it when `item`.
    Result<FieldValue> readCommandValue(const Target& target, bool item) {
        const FieldInfo& field = target.node->info->fields[target.field];
        const FieldType type = item ? itemType(field.type) : field.type;
        int height = 0;
        if (type == FieldType::SFNode) {
            const std::string where = lexer_.where();
            STX_TRY(auto node, readNode(1, height, nullptr, -1, -1));
            STX_CHECK(checkNodePlace(node.get(), field.nodeType, target.node->info->name,
                                     field.name, where));
            return FieldValue(std::move(node));
        }
        if (type == FieldType::MFNode) {
            // A holder, so that the list is read as in a node. An eventIn (addChildren) keeps no
            // value: the field that it feeds does.
            NodePtr holder = std::make_shared<Node>(*target.node->info);
            const int index = field.hasValue() ? target.field : holder->info->find("children");
            if (index < 0 || holder->info->fields[index].type != FieldType::MFNode)
                return failAt(target.where, ErrorCode::invalidInput,
                              "{}.{} takes no nodes by a command", target.node->info->name,
                              field.name);
            STX_CHECK(readNodeList(holder, index, 1, height, false));
            return holder->value(index);
        }
        return readFieldValue(lexer_, type, false);
    }

    Result<void> readReplace(std::uint64_t time) {
        STX_TRY(const bool isScene, takeIf("SCENE"));
        if (isScene) {
            STX_CHECK(takeWord("BY"));
            ReplaceScene scene;
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
            addCommand(document_.frames, time, std::move(replace));
            return {};
        }
        STX_TRY(auto target, readTarget());
        STX_CHECK(takeWord("BY"));
        if (target.field < 0) {
            ReplaceNode replace;
            replace.target = target.node;
            int height = 0;
            STX_TRY(replace.replacement, readNode(1, height, nullptr, -1, -1));
            addCommand(document_.frames, time, std::move(replace));
            return {};
        }
        STX_TRY(auto value, readCommandValue(target, target.position.has_value()));
        if (target.position) {
            addCommand(
                document_.frames, time,
                ReplaceIndexed{target.node, target.field, *target.position, std::move(value)});
        } else {
            addCommand(document_.frames, time,
                       ReplaceField{target.node, target.field, std::move(value)});
        }
        return {};
    }

    Result<void> readInsert(std::uint64_t time, bool atEnd) {
        STX_TRY(const bool isRoute, takeIf("ROUTE"));
        if (isRoute) {
            STX_TRY(auto route, readRoute(""));
            addCommand(document_.frames, time, InsertRoute{std::move(route)});
            return {};
        }
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
            addCommand(
                document_.frames, time,
                InsertIndexed{target.node, target.field, *target.position, std::move(value)});
        }
        return {};
    }

    Result<void> readDelete(std::uint64_t time) {
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

    Result<std::uint32_t> readRouteName() {
        const std::string where = lexer_.where();
        STX_TRY(const auto routeName, takeName("the DEF name of a ROUTE"));
        if (const auto id = idFromTextName(routeName, 'R')) return id;
        const auto found = routeIds_.find(routeName);
        if (found == routeIds_.end())
            return failAt(where, ErrorCode::invalidInput, "no ROUTE has the DEF name '{}'",
                          excerpt(routeName));
        if (found->second == 0)
            return failAt(
                where, ErrorCode::unsupported,
                "commands reach ROUTEs by number only: name it R0, R1, ... instead of '{}'",
                excerpt(routeName));
        return found->second;
    }

    // ---- Object descriptors
    Result<void> readOdUpdate(std::uint64_t time) {
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
        odUpdates_.push_back({time, std::move(list), {}});
        return {};
    }
    Result<void> readOdRemove(std::uint64_t time) {
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
        odUpdates_.push_back({time, {}, std::move(remove)});
        return {};
    }

    /// `Type { field value ... }`; values are words, strings, descriptors or lists of these.
    Result<TextDescriptor> readDescriptor(int depth) {
        TextDescriptor descriptor;
        descriptor.where = lexer_.where();
        if (depth > job_.limits.maxNesting)
            return failAt(descriptor.where, ErrorCode::invalidInput,
                          "descriptors nest deeper than {}", job_.limits.maxNesting);
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
    Result<void> readDescriptorValue(TextDescriptor& descriptor, const std::string& fieldName,
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
    /// A descriptor that has no place in the document: passed over, and said.
    Result<void> skipBraces(const std::string& type, const std::string& where) {
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

    Result<void> readDescriptors() {
        TextIds odIds, esIds;
        if (iod_) collectTextIds(*iod_, odIds, esIds);
        if (iod_) STX_CHECK(initialDescriptorFromText(*iod_, odIds, esIds, document_, job_));
        for (const OdUpdate& update : odUpdates_) {
            if (!update.remove.ids.empty()) {
                addCommand(document_.odFrames, update.time, update.remove);
                continue;
            }
            UpdateObjectDescriptors command;
            for (const TextDescriptor& descriptor : update.descriptors) {
                STX_TRY(auto od, objectDescriptorFromText(descriptor, odIds, esIds));
                command.descriptors.push_back(std::move(od));
            }
            addCommand(document_.odFrames, update.time, std::move(command));
        }
        return {};
    }

    // ---- Nodes
    /// NULL, USE name, or [DEF name] Type { ... }. With an owner, a USE of a name that comes later
    /// is remembered for its field; null is given then.
    Result<NodePtr> readNode(int depth, int& height, NodePtr owner, int field, int item) {
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
        if (def) {
            STX_TRY(defName, takeName("a DEF name"));
        }
        return readNodeBody(defName, where, depth, height);
    }

    Result<NodePtr> readNodeBody(const std::string& defName, const std::string& where, int depth,
                                 int& height) {
        if (depth > job_.limits.maxNesting)
            return failAt(where, ErrorCode::invalidInput, "nodes nest deeper than {}",
                          job_.limits.maxNesting);
        const std::string typeWhere = lexer_.where();
        STX_TRY(const auto type, takeName("a node such as DepthImage"));
        const NodeInfo* info = findNode(type);
        if (!info)
            return failAt(typeWhere, ErrorCode::invalidInput,
                          "there is no node type '{}' in the table", excerpt(type));
        STX_CHECK(names_.countNode());
        NodePtr node = makeNode(*info);
        if (!defName.empty()) STX_CHECK(names_.define(defName, node, where, inCommand_));
        STX_CHECK(take(Kind::openBrace, fmt::format("'{{' behind {}", type)));
        int below = 0;
        while (lexer_.peek().kind != Kind::closeBrace) {
            const std::string fieldWhere = lexer_.where();
            STX_TRY(const auto fieldName, takeName(fmt::format("a field of {} or '}}'", type)));
            const int index = info->findIgnoringCase(fieldName);
            if (index < 0)
                return failAt(fieldWhere, ErrorCode::invalidInput, "{} has no field '{}'", type,
                              excerpt(fieldName));
            const FieldInfo& field = info->fields[index];
            if (!field.hasValue())
                return failAt(fieldWhere, ErrorCode::invalidInput,
                              "{}.{} is an {} and takes no value", type, field.name,
                              name(field.kind));
            if (isWord("IS"))
                return failAt(lexer_.where(), ErrorCode::unsupported,
                              "PROTO (IS) is not supported");
            int fieldHeight = 0;
            if (field.type == FieldType::SFNode) {
                const std::string childWhere = lexer_.where();
                STX_TRY(auto child, readNode(depth + 1, fieldHeight, node, index, -1));
                STX_CHECK(
                    checkNodePlace(child.get(), field.nodeType, type, field.name, childWhere));
                node->set(index, std::move(child));
            } else if (field.type == FieldType::MFNode) {
                STX_CHECK(readNodeList(node, index, depth + 1, fieldHeight, true));
            } else {
                auto value = readFieldValue(lexer_, field.type, false);
                if (!value) {
                    value.error().message += fmt::format(" for {}.{}", type, field.name);
                    return propagate(value);
                }
                node->set(index, std::move(*value));
            }
            below = std::max(below, fieldHeight);
        }
        STX_TRY([[maybe_unused]] const auto brace, lexer_.take());
        height = below + 1;
        if (!defName.empty()) names_.closed(node, height);
        return node;
    }

    Result<void> readNodeList(const NodePtr& owner, int index, int depth, int& height, bool waits) {
        const FieldInfo& field = owner->info->fields[index];
        owner->set(index, NodeList());
        height = 0;
        const bool brackets = lexer_.peek().kind == Kind::openBracket;
        if (brackets) STX_CHECK(take(Kind::openBracket, "'['"));
        while (!brackets || lexer_.peek().kind != Kind::closeBracket) {
            const std::string where = lexer_.where();
            const auto item = static_cast<int>(std::get<NodeList>(owner->value(index)).size());
            // Something stands in the list while a later name is waited for.
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

    struct OdUpdate {
        std::uint64_t time;
        std::vector<TextDescriptor> descriptors;
        RemoveObjectDescriptors remove;
    };

    BtLexer lexer_;
    Job& job_;
    NodeNames names_;
    Document document_;
    std::optional<TextDescriptor> iod_;
    std::vector<OdUpdate> odUpdates_;
    std::map<std::string, std::uint32_t> routeIds_;
    std::uint64_t lastTime_ = 0;
    bool haveScene_ = false;
    bool inCommand_ = false;
};

}  // namespace

Result<Document> readBt(std::string_view text, const std::string& name, Job& job) {
    return BtReader(text, name, job).read();
}

}  // namespace stx::mpeg4
