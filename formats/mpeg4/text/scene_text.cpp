#include "formats/mpeg4/text/scene_text.hpp"

#include <algorithm>
#include <iterator>

#include "formats/mpeg4/text/text_values.hpp"

namespace stx::mpeg4 {
namespace {

/// In the order of the text: each at its time would move all that are later, once for each command.
template <class Frame, class Item>
void addTo(std::vector<Frame>& frames, std::uint64_t time, Item item) {
    if (frames.empty() || frames.back().time != time) {
        Frame frame;
        frame.time = time;
        frames.push_back(std::move(frame));
    }
    frames.back().commands.push_back(std::move(item));
}

/// In the order of time; what the text says of one moment at several places is one frame.
template <class Frame>
void sortFrames(std::vector<Frame>& frames) {
    std::stable_sort(frames.begin(), frames.end(),
                     [](const Frame& a, const Frame& b) { return a.time < b.time; });
    std::size_t kept = 0;
    for (std::size_t i = 1; i < frames.size(); ++i) {
        Frame &last = frames[kept], &next = frames[i];
        if (last.time != next.time) {
            if (++kept != i) frames[kept] = std::move(next);
            continue;
        }
        std::move(next.commands.begin(), next.commands.end(), std::back_inserter(last.commands));
        last.randomAccess = last.randomAccess || next.randomAccess;
    }
    if (!frames.empty()) frames.resize(kept + 1);
}

}  // namespace

NodePtr holderOf(FieldInfo field) {
    field.kind = FieldKind::field;
    auto type = std::make_shared<NodeInfo>(makeNodeInfo("the interface", {}, {field}));
    auto defaults = std::make_shared<FieldDefaults>();
    defaults->values.push_back(emptyValue(field.type));
    type->defaults = std::move(defaults);
    NodePtr holder = makeNode(*type);
    holder->ownType = std::move(type);
    return holder;
}

void addCommand(std::vector<CommandFrame>& frames, std::uint64_t time, Command command) {
    addTo(frames, time, std::move(command));
}
void addCommand(std::vector<OdFrame>& frames, std::uint64_t time, OdCommand command) {
    addTo(frames, time, std::move(command));
}

Result<int> fieldOfCommand(const Node& node, std::string_view fieldName, FieldUse use,
                           const std::string& where) {
    int index = node.info->findIgnoringCase(fieldName);
    // VRML's other spellings of an exposedField: set_translation, translation_changed.
    if (index < 0 && use == FieldUse::in && fieldName.starts_with("set_"))
        index = node.info->findIgnoringCase(fieldName.substr(4));
    if (index < 0 && use == FieldUse::out && fieldName.ends_with("_changed"))
        index = node.info->findIgnoringCase(fieldName.substr(0, fieldName.size() - 8));
    if (index < 0)
        return failAt(where, ErrorCode::invalidInput, "{} has no field '{}'", node.info->name,
                      excerpt(fieldName));
    const FieldInfo& field = node.info->fields[index];
    if (use == FieldUse::in && field.inId < 0)
        return failAt(
            where, ErrorCode::invalidInput,
            "{}.{} is a plain {}: no command or ROUTE can change it; replace the whole node",
            node.info->name, field.name, name(field.kind));
    if (use == FieldUse::out && field.outId < 0)
        return failAt(where, ErrorCode::invalidInput,
                      "{}.{} is a plain {} and no source of a ROUTE", node.info->name, field.name,
                      name(field.kind));
    return index;
}

Result<void> checkNodePlace(const Node* child, Ndt expected, std::string_view owner,
                            std::string_view fieldName, const std::string& where) {
    if (mayStandIn(child, expected)) return {};
    return failAt(where, ErrorCode::invalidInput, "{} is not allowed in {}.{}, which takes {}",
                  child->info->name, owner, fieldName, name(expected));
}

Result<void> finishDocument(Document& document, NodeNames& names) {
    STX_CHECK(names.resolve());
    sortFrames(document.frames);
    sortFrames(document.odFrames);
    // The first is such a place anyway.
    if (!document.frames.empty()) document.frames.front().randomAccess = false;
    if (!document.odFrames.empty()) document.odFrames.front().randomAccess = false;
    for (CommandFrame& frame : document.frames)
        for (Command& command : frame.commands)
            if (auto* replace = std::get_if<ReplaceScene>(&command))
                replace->useNames = names.anyNames() || !replace->protos.empty();
    ElementaryStream& scene = document.sceneStream;
    scene.streamType = StreamType::sceneDescription;
    // The config that is written follows its version, whatever number the text asks for.
    scene.objectTypeIndication =
        document.bifsConfig.version == 2 ? oti::kSystemsV2 : oti::kSystemsV1;
    ElementaryStream& od = document.odStream;
    if (!document.odFrames.empty() || od.esId != 0) {
        od.streamType = StreamType::objectDescriptor;
        if (od.objectTypeIndication == 0) od.objectTypeIndication = oti::kSystemsV1;
    }
    return {};
}

/// What the buffers of commands can name in each scene; nothing when there are none.
static std::vector<BufferScene> scenesOf(const std::vector<CommandFrame>& frames) {
    std::vector<BufferScene> scenes;
    bool anyBuffer = false;
    for (const CommandFrame& frame : frames) {
        for (const Command& command : frame.commands) {
            if (const auto* scene = std::get_if<ReplaceScene>(&command)) {
                scenes.emplace_back();
                scenes.back().protos = scene->protos;
            }
            if (const auto* replace = std::get_if<ReplaceField>(&command))
                anyBuffer = anyBuffer || std::holds_alternative<CommandBuffer>(replace->value);
            forEachNode(command, [&](const NodePtr& node) {
                if (node->defId != 0 && !scenes.empty())
                    // As names: a node that replaces another takes over its id.
                    scenes.back().nodes.insert_or_assign(node->defId, node);
                for (const Node::SetField& field : node->setFields)
                    anyBuffer = anyBuffer || std::holds_alternative<CommandBuffer>(field.value);
            });
        }
    }
    if (!anyBuffer) scenes.clear();
    return scenes;
}

Result<TextNames> TextNames::make(const Document& document, const Limits& limits) {
    TextNames result;
    result.limits_ = limits;
    result.scenes_ = scenesOf(document.frames);
    for (const CommandFrame& frame : document.frames) {
        for (const Command& command : frame.commands) {
            Result<void> fits;
            const auto check = [&](const NodePtr& root) {
                if (!fits) return;
                auto depth = nestingDepth(root);
                if (!depth) {
                    fits = propagate(depth);
                } else if (*depth > limits.maxNesting) {
                    fits =
                        fail(ErrorCode::invalidInput, "nodes nest {} deep; at most {} are written",
                             *depth, limits.maxNesting);
                }
            };
            if (const auto* scene = std::get_if<ReplaceScene>(&command)) check(scene->root);
            if (const auto* replace = std::get_if<ReplaceNode>(&command))
                check(replace->replacement);
            if (const auto* insert = std::get_if<InsertNode>(&command)) check(insert->node);
            std::visit(
                [&](const auto& c) {
                    if constexpr (requires { c.value; }) {
                        if (const auto* node = std::get_if<NodePtr>(&c.value)) check(*node);
                        if (const auto* list = std::get_if<NodeList>(&c.value))
                            for (const NodePtr& node : *list) check(node);
                    }
                },
                command);
            STX_CHECK(fits);
        }
    }
    result.nameAll(document.frames);
    return result;
}

TextNames TextNames::ofBody(const Proto& proto) {
    const NodePtr holder = makeNode("Group");
    holder->set("children", proto.body);
    TextNames result;
    result.nameAll({{0, {ReplaceScene{false, holder, proto.routes}}}});
    result.scenes_ = scenesOf({{0, {ReplaceScene{false, holder, proto.routes, proto.protos}}}});
    result.beginScene();
    return result;
}

void TextNames::nameAll(const std::vector<CommandFrame>& frames) {
    const NodeIds ids = assignNodeIds(frames);
    forEachNode(frames, [&](const NodePtr& node) {
        if (names_.contains(node.get())) return;
        std::string text = textNameOf(*node);
        if (text.empty()) {
            const auto id = ids.nodes.find(node.get());
            if (id == ids.nodes.end()) return;
            text = nameOfId('N', id->second);
        }
        names_[node.get()] = uniqueName(std::move(text));
    });
}

/// A name that would not read back as itself: other characters give way to '_'.
static std::string plainName(std::string text) {
    if (isPlainName(text)) return text;
    for (char& c : text)
        if (!isPlainName(std::string("a") + c)) c = '_';
    return isPlainName(text) ? text : fmt::format("_{}", text);
}

std::string TextNames::uniqueName(std::string text) const {
    const std::string base = text = plainName(std::move(text));
    // Two nodes of one name are different nodes only when commands replaced one: see succeed().
    while (taken_.contains(text)) text = fmt::format("{}_{}", base, ++taken_[base]);
    taken_[text] = 1;
    return text;
}

std::string TextNames::define(const Route& route) {
    std::string text = textNameOf(route);
    if (text.empty()) return text;
    text = reached_.contains(route.id) ? nameOfId('R', route.id) : plainName(std::move(text));
    const std::string base = text;
    // The same name for another number, as commands may bring it.
    for (int i = 2; routeIds_.contains(text) && routeIds_[text] != route.id; ++i)
        text = fmt::format("{}_{}", base, i);
    routeIds_[text] = route.id;
    if (route.id != 0) routes_[route.id] = text;
    return text;
}

std::string TextNames::routeOf(std::uint32_t id) const {
    const auto found = routes_.find(id);
    if (found != routes_.end()) return found->second;
    return outer_ != nullptr ? outer_->routeOf(id) : nameOfId('R', id);
}

TextNames TextNames::inside(const TextNames& outer, const std::vector<Command>& commands) {
    TextNames names;
    names.limits_ = outer.limits_;
    names.outer_ = &outer;
    for (const Command& command : commands) {
        if (const auto* gone = std::get_if<DeleteRoute>(&command))
            names.reached_.insert(gone->routeId);
        if (const auto* replaced = std::get_if<ReplaceRoute>(&command))
            names.reached_.insert(replaced->routeId);
    }
    return names;
}

Result<std::vector<Command>> TextNames::commandsOf(const CommandBuffer& buffer) const {
    if (outer_ != nullptr) return outer_->commandsOf(buffer);
    static const BufferScene kNone;
    const bool inScene = scene_ > 0 && scene_ <= scenes_.size();
    auto commands =
        BifsDecoder::decodeBuffer(buffer, inScene ? scenes_[scene_ - 1] : kNone, limits_);
    if (commands) {
        for (const Command& command : *commands)
            if (const auto* scene = std::get_if<ReplaceScene>(&command);
                scene != nullptr && !scene->protos.empty())
                return fail(ErrorCode::unsupported,
                            "a buffer of commands declares PROTOs, which the texts here do not "
                            "have; keep this presentation as .mp4");
        return commands;
    }
    return fail(ErrorCode::unsupported,
                "the commands in a buffer name or bring what is not known here ({}); keep this "
                "presentation as .mp4",
                commands.error().text());
}

void TextNames::beginScene() {
    ++scene_;
}

const std::string* TextNames::find(const Node& node) const {
    if (outer_ != nullptr)
        if (const std::string* name = outer_->find(node)) return name;
    const auto found = names_.find(&node);
    if (found != names_.end()) return &found->second;
    if (outer_ == nullptr) return nullptr;
    std::string text = textNameOf(node);
    if (text.empty()) return nullptr;
    return &(names_[&node] = uniqueName(std::move(text)));
}

bool TextNames::firstTime(const Node& node) {
    if (outer_ != nullptr && outer_->find(node) != nullptr) return false;
    return written_.insert(&node).second;
}

std::vector<Command> commandsToWrite(const TextNames& names, const CommandBuffer& buffer, int depth,
                                     Result<void>& fits) {
    if (buffer.bytes.empty()) return {};
    Result<std::vector<Command>> commands =
        fail(ErrorCode::unsupported,
             "buffers of commands hold each other more than {} deep; keep this presentation as "
             ".mp4",
             kMaxBufferNesting);
    if (depth < kMaxBufferNesting) commands = names.commandsOf(buffer);
    if (commands) return std::move(*commands);
    if (fits) fits = propagate(commands);
    return {};
}

}  // namespace stx::mpeg4
