#include "formats/mpeg4/scene/scene.hpp"

#include <algorithm>
#include <cassert>
#include <charconv>
#include <unordered_map>

namespace stx::mpeg4 {
namespace {

/// The numbers and quoted strings of a default in the table.
std::vector<std::string> tokens(std::string_view text) {
    std::vector<std::string> out;
    std::size_t i = 0;
    while (i < text.size()) {
        const char c = text[i];
        if (c == ' ') {
            ++i;
        } else if (c == '"') {
            const std::size_t end = text.find('"', i + 1);
            out.emplace_back(text.substr(i + 1, end - i - 1));
            i = end + 1;
        } else {
            const std::size_t end = std::min(text.find(' ', i), text.size());
            out.emplace_back(text.substr(i, end - i));
            i = end;
        }
    }
    return out;
}

/// Takes one value after the other from the words of a default.
class DefaultReader {
  public:
    explicit DefaultReader(std::string_view text) : words_(tokens(text)) {}

    [[nodiscard]] bool atEnd() const { return next_ == words_.size(); }

    template <class T>
    void read(T& value) {
        const std::string& word = words_.at(next_++);
        if (word == "+I") {
            value = std::numeric_limits<T>::max();
        } else if (word == "-I") {
            value = std::numeric_limits<T>::lowest();
        } else {
            [[maybe_unused]] const auto parsed =
                std::from_chars(word.data(), word.data() + word.size(), value);
            assert(parsed.ec == std::errc{});
        }
    }
    void read(bool& value) { value = words_.at(next_++) == "TRUE"; }
    void read(std::string& value) { value = words_.at(next_++); }
    void read(glm::vec2& v) { readAll(v.x, v.y); }
    void read(glm::vec3& v) { readAll(v.x, v.y, v.z); }
    void read(glm::vec4& v) { readAll(v.x, v.y, v.z, v.w); }
    void read(Color& v) { readAll(v.r, v.g, v.b); }
    void read(Rotation& v) { readAll(v.axis.x, v.axis.y, v.axis.z, v.angle); }
    void read(PixelImage& v) { readAll(v.width, v.height, v.components); }
    // These have no default but the empty one.
    void read(NodePtr&) { ++next_; }
    void read(Url&) { ++next_; }
    void read(ScriptText&) { ++next_; }
    void read(CommandBuffer&) { ++next_; }
    void read(AttributeReference&) { ++next_; }

  private:
    template <class... T>
    void readAll(T&... values) {
        (read(values), ...);
    }

    std::vector<std::string> words_;
    std::size_t next_ = 0;
};

FieldValue parseDefault(const FieldInfo& info) {
    FieldValue value = emptyValue(info.type);
    DefaultReader reader(info.defaultText);
    if (reader.atEnd()) return value;
    std::visit(
        [&](auto& v) {
            if constexpr (kIsList<std::decay_t<decltype(v)>>) {
                while (!reader.atEnd()) {
                    typename std::decay_t<decltype(v)>::value_type item{};
                    reader.read(item);
                    v.push_back(std::move(item));
                }
            } else {
                reader.read(v);
            }
        },
        value);
    return value;
}

template <std::size_t... I>
FieldValue makeEmpty(std::size_t index, std::index_sequence<I...>) {
    FieldValue value;
    ((index == I ? static_cast<void>(value.emplace<I>()) : static_cast<void>(0)), ...);
    return value;
}

}  // namespace

FieldValue::FieldValue() = default;
FieldValue::FieldValue(const FieldValue& other) = default;
FieldValue::FieldValue(FieldValue&& other) noexcept = default;
FieldValue& FieldValue::operator=(const FieldValue& other) = default;
FieldValue& FieldValue::operator=(FieldValue&& other) noexcept = default;
FieldValue::~FieldValue() = default;

Command::Command(const Command& other) = default;
Command::Command(Command&& other) noexcept = default;
Command& Command::operator=(const Command& other) = default;
Command& Command::operator=(Command&& other) noexcept = default;
Command::~Command() = default;

FieldValue emptyValue(FieldType type) {
    return makeEmpty(static_cast<std::size_t>(type),
                     std::make_index_sequence<std::variant_size_v<AnyFieldValue>>{});
}

const FieldValue& defaultValue(const NodeInfo& node, int fieldIndex) {
    if (node.defaults) return node.defaults->values.at(static_cast<std::size_t>(fieldIndex));
    static const auto* const defaults = [] {
        auto* all = new std::unordered_map<const NodeInfo*, std::vector<FieldValue>>;
        for (const NodeInfo& info : allNodes()) {
            std::vector<FieldValue>& values = (*all)[&info];
            for (const FieldInfo& field : info.fields) values.push_back(parseDefault(field));
        }
        return all;
    }();
    return defaults->at(&node).at(static_cast<std::size_t>(fieldIndex));
}

bool sameType(const NodeInfo& a, const NodeInfo& b) {
    if (&a == &b) return true;
    if (!a.defaults || !b.defaults || a.name != b.name || a.isProto != b.isProto) return false;
    return std::equal(a.fields.begin(), a.fields.end(), b.fields.begin(), b.fields.end(),
                      [](const FieldInfo& x, const FieldInfo& y) {
                          return x.name == y.name && x.kind == y.kind && x.type == y.type;
                      });
}

std::size_t itemCount(const FieldValue& value) {
    return std::visit(
        [](const auto& v) -> std::size_t {
            if constexpr (kIsList<std::decay_t<decltype(v)>>)
                return v.size();
            else
                return 1;
        },
        value);
}

Node::~Node() {
    // Children are handed to a list of the outermost destructor, which lets them go one by one.
    thread_local std::vector<NodePtr>* pending = nullptr;
    std::vector<NodePtr> mine;
    const bool outermost = pending == nullptr;
    if (outermost) pending = &mine;
    for (SetField& field : setFields) {
        if (NodePtr* child = std::get_if<NodePtr>(&field.value); child && *child)
            pending->push_back(std::move(*child));
        if (NodeList* list = std::get_if<NodeList>(&field.value))
            for (NodePtr& child : *list)
                if (child) pending->push_back(std::move(child));
    }
    if (!outermost) return;
    while (!mine.empty()) {
        const NodePtr next = std::move(mine.back());
        mine.pop_back();
    }
    pending = nullptr;
}

const Node::SetField* Node::findSet(int fieldIndex) const {
    const auto at = std::lower_bound(setFields.begin(), setFields.end(), fieldIndex,
                                     [](const SetField& s, int i) { return s.index < i; });
    return at != setFields.end() && at->index == fieldIndex ? &*at : nullptr;
}

const FieldValue& Node::value(int fieldIndex) const {
    if (const SetField* found = findSet(fieldIndex)) return found->value;
    return defaultValue(*info, fieldIndex);
}

bool Node::set(int fieldIndex, FieldValue newValue) {
    if (fieldIndex < 0 || fieldIndex >= static_cast<int>(info->fields.size())) return false;
    const FieldInfo& field = info->fields[fieldIndex];
    if (!field.hasValue() || field.type != typeOf(newValue)) return false;
    const auto at = std::lower_bound(setFields.begin(), setFields.end(), fieldIndex,
                                     [](const SetField& s, int i) { return s.index < i; });
    if (at != setFields.end() && at->index == fieldIndex)
        at->value = std::move(newValue);
    else
        setFields.insert(at, SetField{fieldIndex, std::move(newValue)});
    return true;
}

FieldValue& Node::edit(int fieldIndex) {
    if (findSet(fieldIndex) == nullptr) {
        [[maybe_unused]] const bool done = set(fieldIndex, defaultValue(*info, fieldIndex));
        assert(done);
    }
    return const_cast<SetField*>(findSet(fieldIndex))->value;
}

void Node::clear(int fieldIndex) {
    std::erase_if(setFields, [&](const SetField& s) { return s.index == fieldIndex; });
}

NodePtr makeNode(const NodeInfo& type) {
    return std::make_shared<Node>(type);
}

bool addScriptField(Node& script, FieldInfo field, std::optional<FieldValue> value) {
    if (!script.is("Script") || script.info->find(field.name) >= 0) return false;
    if (field.kind == FieldKind::exposedField || (value && typeOf(*value) != field.type))
        return false;
    const NodeInfo& old = *script.info;
    std::vector<FieldInfo> fields = old.fields;
    const auto index = static_cast<int>(fields.size());
    const bool hasValue = field.kind == FieldKind::field;
    auto defaults = std::make_shared<FieldDefaults>();
    for (const FieldInfo& known : fields)
        defaults->values.push_back(defaultValue(old, known.index));
    defaults->values.push_back(emptyValue(field.type));
    fields.push_back(std::move(field));
    auto type = std::make_shared<NodeInfo>(
        makeNodeInfo(old.name, old.codes, fields, ownFieldCount(script) + 1));
    type->defaults = std::move(defaults);
    script.info = type.get();
    script.ownType = std::move(type);
    if (value && hasValue) return script.set(index, std::move(*value));
    return true;
}

int ownFieldCount(const Node& script) {
    if (!script.ownType || !script.is("Script")) return 0;
    return static_cast<int>(script.info->fields.size() - findNode("Script")->fields.size());
}

NodePtr makeInstance(const ProtoPtr& proto) {
    NodePtr node = makeNode(proto->type);
    node->proto = proto;
    return node;
}

NodePtr makeNode(std::string_view typeName) {
    const NodeInfo* info = findNode(typeName);
    return info == nullptr ? nullptr : makeNode(*info);
}

bool mayStandIn(const Node* node, Ndt expected) {
    return node == nullptr || node->info->codeIn(expected) != nullptr;
}

}  // namespace stx::mpeg4
