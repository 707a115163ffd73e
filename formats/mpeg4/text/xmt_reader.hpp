#pragma once

#include <pugixml.hpp>

#include <algorithm>
#include <cmath>

#include "formats/files/no_case.hpp"
#include "formats/mpeg4/text/text_descriptors.hpp"
#include "formats/mpeg4/text/text_reader.hpp"
#include "formats/mpeg4/text/text_values.hpp"
#include "formats/mpeg4/text/xml_checks.hpp"
#include "formats/mpeg4/text/xmt.hpp"
#include "formats/mpeg4/text/xmt_lines.hpp"

namespace stx::mpeg4 {

using pugi::xml_node;

/// Reads an XMT-A document from its XML tree. PROTOs and the fields of Scripts are in
/// xmt_protos.cpp.
class XmtReader : private TextReader {
  public:
    XmtReader(std::string_view text, std::string fileName, Job& job)
        : TextReader(job), text_(text), fileName_(std::move(fileName)), lines_(text) {}

    Result<Document> read() {
        // The tree takes at most so many bytes for each '<' and '=' of the text.
        const auto marks =
            std::count_if(text_.begin(), text_.end(), [](char c) { return c == '<' || c == '='; });
        if (auto ok =
                job_.limits.checkAllocation(static_cast<std::uint64_t>(marks), 128, "the XML tree");
            !ok)
            return tl::unexpected(ok.error().at(fmt::format("'{}'", fileName_)));
        const auto parsed =
            xml_.load_buffer(text_.data(), text_.size(),
                             pugi::parse_escapes | pugi::parse_wconv_attribute | pugi::parse_eol,
                             pugi::encoding_utf8);
        if (!parsed)
            return failAt(lines_.at(fileName_, parsed.offset), ErrorCode::invalidInput,
                          "not well-formed XML: {}", parsed.description());
        if (const auto bad = findBadReference(text_))
            return failAt(lines_.at(fileName_, static_cast<std::ptrdiff_t>(bad->offset)),
                          ErrorCode::invalidInput,
                          "not well-formed XML: '{}' stands for no character", excerpt(bad->text));
        std::string twice;
        if (const xml_node node = findDoubleAttribute(xml_, twice))
            return failAt(where(node), ErrorCode::invalidInput,
                          "not well-formed XML: <{}> has the attribute '{}' twice",
                          excerpt(node.name()), excerpt(twice));
        const xml_node root = xml_.document_element();
        if (localName(root) != "XMT-A")
            return failAt(where(root), ErrorCode::invalidInput,
                          "the root element is <{}>, expected <XMT-A>", excerpt(root.name()));
        STX_CHECK(collectIds(root));
        for (const xml_node element : elements(root)) {
            if (localName(element) == "Header") {
                for (const xml_node child : elements(element))
                    if (localName(child) == "InitialObjectDescriptor")
                        STX_CHECK(readInitial(child));
            } else if (localName(element) == "Body") {
                STX_CHECK(readCommands(element, 0.0, 1));
            }
        }
        if (document_.frames.empty())
            return failAt(where(root), ErrorCode::invalidInput,
                          "the file has no scene, expected <Body><Replace><Scene>");
        STX_CHECK(readBuffers());
        routes_.number(document_.frames);
        STX_CHECK(finishDocument(document_, names_));
        STX_CHECK(buffers_.encode(document_));
        return std::move(document_);
    }

  private:
    // ---- XML
    [[nodiscard]] std::string where(xml_node node) const {
        return lines_.at(fileName_, node.offset_debug());
    }
    static std::string_view localName(xml_node node) {
        const std::string_view whole = node.name();
        const auto colon = whole.rfind(':');
        return colon == std::string_view::npos ? whole : whole.substr(colon + 1);
    }
    static std::vector<xml_node> elements(xml_node parent) {
        std::vector<xml_node> list;
        for (const xml_node child : parent.children())
            if (child.type() == pugi::node_element) list.push_back(child);
        return list;
    }
    tl::unexpected<Error> unexpectedElement(xml_node node, std::string_view expected) const {
        return failAt(where(node), ErrorCode::invalidInput, "found <{}>, expected {}",
                      excerpt(node.name()), expected);
    }
    Result<void> checkDepth(xml_node node, int depth) const {
        if (depth <= job_.limits.maxNesting) return {};
        return failAt(where(node), ErrorCode::invalidInput, "elements nest deeper than {}",
                      job_.limits.maxNesting);
    }

    // ---- Descriptors
    Result<void> fillDescriptor(TextDescriptor& descriptor, xml_node node, int depth) const {
        STX_CHECK(checkDepth(node, depth));
        for (const auto attribute : node.attributes())
            descriptor.fields.push_back({attribute.name(), attribute.value(), where(node)});
        for (const xml_node child : elements(node)) {
            if (isDescriptorType(localName(child))) {
                TextDescriptor inner;
                inner.type = localName(child);
                inner.where = where(child);
                STX_CHECK(fillDescriptor(inner, child, depth + 1));
                descriptor.children.push_back(std::move(inner));
            } else {
                STX_CHECK(fillDescriptor(descriptor, child, depth + 1));
            }
        }
        return {};
    }
    Result<TextDescriptor> descriptorOf(xml_node node) const {
        TextDescriptor descriptor;
        descriptor.type = localName(node);
        descriptor.where = where(node);
        STX_CHECK(fillDescriptor(descriptor, node, 1));
        return descriptor;
    }
    /// URLs may name an object descriptor by its string id before the descriptor is in the file.
    Result<void> collectIds(xml_node root);
    Result<void> readInitial(xml_node node) {
        STX_TRY(const auto descriptor, descriptorOf(node));
        return initialDescriptorFromText(descriptor, odIds_, esIds_, document_, job_);
    }
    Result<void> readOdUpdate(xml_node node, std::uint64_t time) {
        UpdateObjectDescriptors update;
        STX_TRY(const auto all, descriptorOf(node));
        for (const TextDescriptor& descriptor : all.children) {
            if (descriptor.type != "ObjectDescriptor") continue;
            STX_TRY(auto od, objectDescriptorFromText(descriptor, odIds_, esIds_));
            update.descriptors.push_back(std::move(od));
        }
        addCommand(document_.odFrames, time, std::move(update));
        return {};
    }
    Result<void> readOdRemove(xml_node node, std::uint64_t time) {
        RemoveObjectDescriptors remove;
        // Some write objectDescriptorId.
        const auto named = node.find_attribute([](pugi::xml_attribute attribute) {
            return equalNoCase(attribute.name(), "objectDescriptorID");
        });
        std::string_view list = named.value();
        while (!list.empty()) {
            const auto end = list.find_first_of(" \t\r\n,");
            const std::string_view item = list.substr(0, end);
            list.remove_prefix(end == std::string_view::npos ? list.size() : end + 1);
            if (item.empty()) continue;
            const auto id = numberOfTextId(item, odIds_);
            if (!id || *id < 1 || *id > 1022)
                return failAt(where(node), ErrorCode::invalidInput,
                              "found '{}', expected the id of an ObjectDescriptor", excerpt(item));
            remove.ids.push_back(static_cast<int>(*id));
        }
        if (remove.ids.empty())
            return failAt(where(node), ErrorCode::invalidInput,
                          "there is no objectDescriptorID; the ids of ObjectDescriptors are "
                          "expected in it");
        addCommand(document_.odFrames, time, std::move(remove));
        return {};
    }

    // ---- Commands
    /// Errors (invalidInput): an attribute of a command, par or seq that it does not have.
    Result<void> checkCommandAttributes(xml_node node) const;
    /// When what is in an element acts, in seconds; `seconds` is the time of its parent.
    Result<double> timeOf(xml_node node, double seconds) const;
    /// The commands in an element whose time is `seconds`.
    Result<void> readCommands(xml_node parent, double seconds, int depth);

    Result<Route> readRoute(xml_node node) {
        Route route;
        const std::string defName = node.attribute("DEF").value();
        route.id = idFromTextName(defName, 'R');
        if (route.id == 0) route.name = defName;
        STX_TRY(route.from, names_.target(node.attribute("fromNode").value(), where(node)));
        STX_TRY(route.to, names_.target(node.attribute("toNode").value(), where(node)));
        STX_TRY(route.fromField, fieldOfCommand(*route.from, node.attribute("fromField").value(),
                                                FieldUse::out, where(node)));
        STX_TRY(route.toField, fieldOfCommand(*route.to, node.attribute("toField").value(),
                                              FieldUse::in, where(node)));
        const auto& source = route.from->info->fields[route.fromField];
        const auto& target = route.to->info->fields[route.toField];
        if (source.type != target.type)
            return failAt(where(node), ErrorCode::invalidInput,
                          "the ROUTE leads from {} {} to {} {}; both must have one type",
                          name(source.type), source.name, name(target.type), target.name);
        routes_.define(route);
        return route;
    }

    Result<void> readCommand(xml_node node, std::string_view type, std::uint64_t time) {
        names_.goTo(time);
        const auto children = elements(node);
        if (!node.attribute("atRoute").empty()) return readRouteCommand(node, type, time);
        if (!children.empty() && localName(children[0]) == "Scene" && type == "Replace")
            return readScene(children[0], time);
        if (!children.empty() && localName(children[0]) == "ROUTE" && type == "Insert") {
            for (const xml_node child : children) {
                STX_TRY(auto route, readRoute(child));
                addCommand(document_.frames, time, InsertRoute{std::move(route)});
            }
            return {};
        }
        if (node.attribute("atNode").empty())
            return failAt(where(node), ErrorCode::invalidInput,
                          "<{}> has neither atNode, atRoute nor <Scene>", type);
        STX_TRY(const auto target, names_.target(node.attribute("atNode").value(), where(node)));
        int field = -1;
        if (!node.attribute("atField").empty())
            STX_SET(field, fieldOfCommand(*target, node.attribute("atField").value(), FieldUse::in,
                                          where(node)));
        std::optional<Position> position;
        if (const auto attribute = node.attribute("position"); !attribute.empty())
            STX_SET(position, positionOf(node, attribute.value()));
        if (field >= 0) return readFieldCommand(node, type, time, target, field, position);
        if (type == "Insert") return insertNode(node, time, target, position);
        if (type == "Replace") return replaceNode(node, time, target);
        addCommand(document_.frames, time, DeleteNode{target});
        return {};
    }

    /// <Delete atRoute> and <Replace atRoute>.
    Result<void> readRouteCommand(xml_node node, std::string_view type, std::uint64_t time) {
        STX_TRY(const auto id, routeId(node.attribute("atRoute").value(), where(node)));
        if (type == "Delete") {
            addCommand(document_.frames, time, DeleteRoute{id});
            return {};
        }
        const auto children = elements(node);
        if (type != "Replace" || children.size() != 1 || localName(children[0]) != "ROUTE")
            return failAt(where(node), ErrorCode::invalidInput,
                          "expected one <ROUTE> in <Replace atRoute>");
        STX_TRY(auto route, readRoute(children[0]));
        // So that later commands find it.
        route.id = id;
        addCommand(document_.frames, time, ReplaceRoute{id, std::move(route)});
        return {};
    }

    /// A command with atField, and with a position where one item of the field is meant.
    Result<void> readFieldCommand(xml_node node, std::string_view type, std::uint64_t time,
                                  const NodePtr& target, int field,
                                  std::optional<Position> position) {
        const auto& info = target->info->fields[field];
        if (position && !isMultiple(info.type))
            return failAt(where(node), ErrorCode::invalidInput,
                          "{}.{} has one value, and so no position", target->info->name, info.name);
        if (type == "Delete") {
            if (!position)
                return failAt(where(node), ErrorCode::invalidInput,
                              "<Delete atField> needs a position; a whole field cannot be deleted");
            addCommand(document_.frames, time, DeleteIndexed{target, field, *position});
            return {};
        }
        if (type == "Insert" && !position) position = Position();
        STX_TRY(auto value, commandValue(node, *target, field, position.has_value()));
        if (type == "Insert") {
            addCommand(document_.frames, time,
                       InsertIndexed{target, field, *position, std::move(value)});
        } else if (position) {
            addCommand(document_.frames, time,
                       ReplaceIndexed{target, field, *position, std::move(value)});
        } else {
            addCommand(document_.frames, time, ReplaceField{target, field, std::move(value)});
        }
        return {};
    }

    Result<void> insertNode(xml_node node, std::uint64_t time, const NodePtr& target,
                            std::optional<Position> position) {
        const auto children = elements(node);
        const int childrenField = target->info->find("children");
        if (childrenField < 0 || children.size() != 1)
            return failAt(where(node), ErrorCode::invalidInput,
                          "<Insert> puts one node into the children of a grouping node; {} is not "
                          "one, or there is not one node",
                          target->info->name);
        int height = 0;
        STX_TRY(auto child, readNode(children[0], 1, height, nullptr, -1, -1));
        STX_CHECK(checkNodePlace(child.get(), target->info->fields[childrenField].nodeType,
                                 target->info->name, "children", where(children[0])));
        addCommand(document_.frames, time,
                   InsertNode{target, position.value_or(Position()), std::move(child)});
        return {};
    }

    Result<void> replaceNode(xml_node node, std::uint64_t time, const NodePtr& target) {
        const auto children = elements(node);
        if (children.size() > 1)
            return failAt(where(node), ErrorCode::invalidInput, "<Replace atNode> takes one node");
        NodePtr replacement;
        int height = 0;
        if (!children.empty()) {
            const std::size_t named = names_.named().size();
            STX_TRY(replacement, readNode(children[0], 1, height, nullptr, -1, -1));
            names_.succeed(*target, replacement, named);
        }
        addCommand(document_.frames, time, ReplaceNode{target, std::move(replacement)});
        return {};
    }

    Result<std::optional<Position>> positionOf(xml_node node, std::string_view text) const;

    /// The value of a command for a field; one item of it when `item`.
    Result<FieldValue> commandValue(xml_node node, const Node& target, int field, bool item);

    Result<void> readScene(xml_node node, std::uint64_t time) {
        ReplaceScene scene;
        if (bufferDepth_ == 0) {
            STX_CHECK(readBuffers());
            protoScopes_.front().clear();
        }
        for (const xml_node child : elements(node)) {
            if (localName(child) == "ROUTE") {
                STX_TRY(auto route, readRoute(child));
                scene.routes.push_back(std::move(route));
                continue;
            }
            if (localName(child) == "ProtoDeclare") {
                if (bufferDepth_ > 0)
                    return unexpectedElement(child,
                                             "a node (PROTOs are declared outside of buffers)");
                STX_CHECK(readProto(child, 1));
                scene.protos = protoScopes_.front();
                continue;
            }
            if (scene.root)
                return unexpectedElement(child, "ROUTE (the scene has its top node already)");
            int height = 0;
            STX_TRY(scene.root, readNode(child, 1, height, nullptr, -1, -1));
            STX_CHECK(checkNodePlace(scene.root.get(), Ndt::SFTopNode, "the scene", "root",
                                     where(child)));
        }
        addCommand(document_.frames, time, std::move(scene));
        return {};
    }

    // ---- Nodes
    [[nodiscard]] Url urlOf(std::string_view text) const {
        Url url;
        // The string id of a descriptor comes before the number that it looks like.
        if (text.size() > 5 && equalNoCase(text.substr(0, 5), "od://")) {
            if (const auto found = odIds_.find(text.substr(5));
                found != odIds_.end() && found->second >= 1 && found->second <= 1022) {
                url.objectDescriptorId = static_cast<int>(found->second);
                return url;
            }
        }
        if (const auto id = odFromUrl(text)) {
            url.objectDescriptorId = *id;
        } else {
            url.text = text;
        }
        return url;
    }

    Result<FieldValue> attributeValue(xml_node node, std::string_view attribute,
                                      std::string_view text, FieldType type) const {
        if (type == FieldType::SFString) return FieldValue(std::string(text));
        const auto first = text.find_first_not_of(" \t\r\n");
        const bool inQuotes = first != std::string_view::npos &&
                              (text[first] == '"' || text[first] == '\'' || text[first] == '[');
        if (type == FieldType::SFURL && !inQuotes) return FieldValue(urlOf(text));
        if (!inQuotes && first != std::string_view::npos) {
            if (type == FieldType::MFURL) return FieldValue(std::vector{urlOf(text)});
            if (type == FieldType::MFString) return FieldValue(std::vector{std::string(text)});
            if (type == FieldType::MFScript)
                return FieldValue(std::vector{ScriptText{std::string(text)}});
        }
        const auto expected = [&](const Error& error) {
            return failAt(where(node), ErrorCode::invalidInput, "{} in {}=\"{}\" of <{}>",
                          error.message, attribute, excerpt(text), excerpt(node.name()));
        };
        if (type == FieldType::SFURL || type == FieldType::MFURL) {
            // Through strings: od://od10 is a string id first.
            STX_TRY(const auto strings, attributeValue(node, attribute, text, FieldType::MFString));
            std::vector<Url> urls;
            for (const std::string& item : std::get<std::vector<std::string>>(strings))
                urls.push_back(urlOf(item));
            if (type == FieldType::MFURL) return FieldValue(std::move(urls));
            return FieldValue(urls.empty() ? Url() : urls[0]);
        }
        BtLexer lexer(text, fileName_);
        if (auto ok = lexer.start(); !ok) return expected(ok.error());
        auto value = readFieldValue(lexer, type, true);
        if (!value) return expected(value.error());
        if (lexer.peek().kind != BtToken::Kind::end)
            return failAt(where(node), ErrorCode::invalidInput,
                          "found {} behind the value of {}=\"{}\" in <{}>", lexer.peek().describe(),
                          attribute, excerpt(text), excerpt(node.name()));
        return value;
    }

    Result<NodePtr> readNode(xml_node element, int depth, int& height, NodePtr owner,
                             int ownerField, int item) {
        height = 0;
        STX_CHECK(checkDepth(element, depth));
        const std::string_view type = localName(element);
        if (type == "NULL") return NodePtr();
        const bool isInstance = type == "ProtoInstance";
        NodePtr node =
            isInstance ? makeNamedInstance(element.attribute("name").value()) : makeNode(type);
        if (!node && isInstance)
            return failAt(where(element), ErrorCode::invalidInput,
                          "the instance is of PROTO '{}', which no ProtoDeclare before it declares",
                          excerpt(element.attribute("name").value()));
        if (!node)
            return failAt(where(element), ErrorCode::invalidInput,
                          "found <{}>, expected a node such as DepthImage, or ProtoInstance",
                          excerpt(type));
        if (const auto use = element.attribute("USE"); !use.empty()) {
            STX_TRY(auto used, names_.use(use.value(), depth, where(element), height));
            if (!used && owner) {
                names_.useLater(use.value(), std::move(owner), ownerField, item, where(element));
                return NodePtr();
            }
            if (!used) return names_.target(use.value(), where(element));
            if (used->info->name != node->info->name)
                return failAt(where(element), ErrorCode::invalidInput,
                              "USE '{}' names a {}, not a {}", excerpt(use.value()),
                              used->info->name, node->info->name);
            return used;
        }
        STX_CHECK(names_.countNode());
        const auto def = element.attribute("DEF");
        const bool named = !def.empty() && *def.value() != '\0';
        if (named) STX_CHECK(names_.define(def.value(), node, where(element), inCommand_));
        for (const auto attribute : element.attributes()) {
            const std::string_view fieldName = attribute.name();
            if (fieldName == "DEF" || fieldName == "USE" || isInstance ||
                fieldName.find(':') != std::string_view::npos || fieldName == "xmlns")
                continue;
            STX_TRY(const int index, fieldOf(element, *node->info, fieldName));
            const FieldInfo& field = node->info->fields[index];
            if (itemType(field.type) == FieldType::SFNode) {
                if (std::string_view(attribute.value()) == "NULL") continue;
                return failAt(where(element), ErrorCode::invalidInput,
                              "{}.{} holds nodes: write an element <{}> in <{}>", type, field.name,
                              field.name, type);
            }
            STX_TRY(auto value, attributeValue(element, fieldName, attribute.value(), field.type));
            auto plain = fromText(*node->info, index, std::move(value));
            if (!plain)
                return failAt(where(element), ErrorCode::invalidInput,
                              "{}=\"{}\" of <{}> is not base64", fieldName,
                              excerpt(attribute.value()), type);
            node->set(index, std::move(*plain));
        }
        int below = 0;
        if (isInstance) STX_CHECK(readFieldValues(element, node, depth, below));
        for (const xml_node wrapper : elements(element)) {
            if (isInstance) break;
            const std::string_view fieldName = localName(wrapper);
            if (fieldName == "field" && node->is("Script")) {
                STX_CHECK(readOwnField(wrapper, node, depth, below));
                continue;
            }
            if (fieldName == "IS") {
                STX_CHECK(readLinks(wrapper, node));
                continue;
            }
            const NodeInfo* info = node->info;
            if (info->find(fieldName) < 0 && findNode(fieldName))
                return failAt(
                    where(wrapper), ErrorCode::invalidInput,
                    "<{}> stands directly in <{}>; put it into the element of its field, such as "
                    "<children>",
                    fieldName, type);
            STX_TRY(const int index, fieldOf(wrapper, *info, fieldName));
            STX_CHECK(readNodeField(wrapper, node, index, depth, below));
        }
        height = below + 1;
        if (named) names_.closed(node, height);
        return node;
    }

    Result<int> fieldOf(xml_node at, const NodeInfo& info, std::string_view fieldName) const {
        int index = info.find(fieldName);
        if (index < 0) index = info.findIgnoringCase(fieldName);
        if (index < 0)
            return failAt(where(at), ErrorCode::invalidInput, "{} has no field '{}'", info.name,
                          excerpt(fieldName));
        if (!info.fields[index].hasValue())
            return failAt(where(at), ErrorCode::invalidInput, "{}.{} is an {} and takes no value",
                          info.name, info.fields[index].name, name(info.fields[index].kind));
        return index;
    }

    Result<void> readNodeField(xml_node wrapper, const NodePtr& node, int index, int depth,
                               int& below) {
        const FieldInfo& field = node->info->fields[index];
        if (field.type == FieldType::SFCommandBuffer)
            return passBuffer(wrapper, buffers_.add(node, index, proto_));
        if (itemType(field.type) != FieldType::SFNode || isLinked(node, index))
            return failAt(where(wrapper), ErrorCode::invalidInput,
                          "{}.{} holds no nodes: write it as an attribute of <{}>",
                          node->info->name, field.name, node->info->name);
        const bool isList = field.type == FieldType::MFNode;
        if (isList && !node->isSet(index)) node->set(index, NodeList());
        int count = 0;
        for (const xml_node child : elements(wrapper)) {
            if (!isList && count++ > 0)
                return failAt(where(child), ErrorCode::invalidInput, "{}.{} takes one node",
                              node->info->name, field.name);
            int item = -1;
            if (isList) {
                auto& list = std::get<NodeList>(node->edit(index));
                item = static_cast<int>(list.size());
                list.push_back(nullptr);
            }
            int height = 0;
            STX_TRY(auto made, readNode(child, depth + 1, height, node, index, item));
            STX_CHECK(checkNodePlace(made.get(), field.nodeType, node->info->name, field.name,
                                     where(child)));
            below = std::max(below, height);
            if (!isList) {
                node->set(index, std::move(made));
            } else if (localName(child) == "NULL") {
                std::get<NodeList>(node->edit(index)).pop_back();
            } else {
                std::get<NodeList>(node->edit(index))[item] = std::move(made);
            }
        }
        return {};
    }

    // ---- Buffers of commands (xmt_protos.cpp)
    /// <buffer>, to be read when the nodes that its commands may name are known.
    Result<void> passBuffer(xml_node element, std::size_t number);

    // ---- PROTOs, and the fields of Scripts that are declared like theirs (xmt_protos.cpp)
    Result<FieldInfo> readDeclaration(xml_node element) const;
    /// The value of a declared field: an attribute, or elements.
    Result<void> readDeclaredValue(xml_node element, const NodePtr& node, int index, int depth,
                                   int& below);
    Result<void> readOwnField(xml_node element, const NodePtr& script, int depth, int& below);
    Result<void> readFieldValues(xml_node element, const NodePtr& instance, int depth, int& below);
    /// <IS>: links fields of a node to those of the PROTO's interface.
    Result<void> readLinks(xml_node element, const NodePtr& node);
    /// <ProtoDeclare> with all that is in it, into the innermost scope.
    Result<void> readProto(xml_node element, int depth);
    Result<void> readProtoContent(xml_node element, Proto& proto, int depth);

    std::string_view text_;
    std::string fileName_;
    Lines lines_;
    pugi::xml_document xml_;
    TextIds odIds_, esIds_;
};

}  // namespace stx::mpeg4
