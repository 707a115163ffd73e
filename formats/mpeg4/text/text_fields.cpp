#include "formats/mpeg4/text/text_fields.hpp"

#include <set>
#include <span>

#include "formats/files/base64.hpp"
#include "formats/files/no_case.hpp"
#include "formats/mpeg4/text/text_values.hpp"
#include "lib/base/whole_number.hpp"

namespace stx::mpeg4 {
namespace {

using Kind = BtToken::Kind;

/// One item (of an SF type) at a time.
class ItemReader {
  public:
    explicit ItemReader(BtLexer& lexer) : lexer_(lexer) {}

    Result<BtToken> word(std::string_view expected) {
        if (lexer_.peek().kind != Kind::word) return unexpected(expected);
        return lexer_.take();
    }
    tl::unexpected<Error> unexpected(std::string_view expected) {
        return failAt(lexer_.where(), ErrorCode::invalidInput, "found {}, expected {}",
                      lexer_.peek().describe(), expected);
    }
    template <class T, class Parse>
    Result<T> parsed(Parse parse, std::string_view expected) {
        if (lexer_.peek().kind != Kind::word) return unexpected(expected);
        const auto value = parse(lexer_.peek().text);
        if (!value) return unexpected(expected);
        STX_TRY([[maybe_unused]] const auto taken, lexer_.take());
        return *value;
    }

    Result<void> read(bool& v) {
        STX_TRY(v, parsed<bool>(boolFromText, "TRUE or FALSE"));
        return {};
    }
    Result<void> read(std::int32_t& v) {
        STX_TRY(v, parsed<std::int32_t>(int32FromText, "an integer of 32 bits"));
        return {};
    }
    Result<void> read(float& v) {
        STX_TRY(v, parsed<float>(floatFromText, "a number"));
        return {};
    }
    Result<void> read(double& v) {
        STX_TRY(v, parsed<double>(doubleFromText, "a time in seconds"));
        return {};
    }
    Result<void> read(std::string& v) {
        if (lexer_.peek().kind != Kind::string && lexer_.peek().kind != Kind::word)
            return unexpected("a string in quotes");
        STX_TRY(auto token, lexer_.take());
        v = token.kind == Kind::string ? std::move(token.value) : std::string(token.text);
        return {};
    }
    Result<void> read(Url& v) {
        std::string text;
        if (lexer_.peek().kind != Kind::string && lexer_.peek().kind != Kind::word)
            return unexpected("a URL: od:ID or a string in quotes");
        const std::string where = lexer_.where();
        if (auto ok = read(text); !ok) return ok;
        if (const auto id = odFromUrl(text)) {
            v.objectDescriptorId = *id;
        } else {
            v.text = std::move(text);
        }
        return {};
    }
    Result<void> read(glm::vec2& v) { return readAll(v.x, v.y); }
    Result<void> read(glm::vec3& v) { return readAll(v.x, v.y, v.z); }
    Result<void> read(glm::vec4& v) { return readAll(v.x, v.y, v.z, v.w); }
    Result<void> read(ScriptText& v) { return read(v.text); }
    Result<void> read(CommandBuffer& v) {
        // The readers take buffers with commands in them themselves.
        const bool empty = lexer_.peek().kind == Kind::end ||
                           (lexer_.peek().kind == Kind::string && lexer_.peek().value.empty());
        if (!empty) return unexpected("commands: { ... } in BT, an element in XMT-A");
        STX_TRY([[maybe_unused]] const auto taken, lexer_.take());
        v = {};
        return {};
    }
    Result<void> read(AttributeReference&) {
        return failAt(lexer_.where(), ErrorCode::unsupported,
                      "a reference to a field of a node is not supported; leave it out");
    }
    Result<void> read(Color& v) {
        // The reference encoder's own spelling: $RRGGBB.
        const BtToken& token = lexer_.peek();
        if (token.kind == Kind::word && token.text.size() == 7 && token.text[0] == '$') {
            const auto rgb = integerFromText("0x" + std::string(token.text.substr(1)));
            if (!rgb) return unexpected("a colour");
            v = {(*rgb >> 16 & 255) / 255.0f, (*rgb >> 8 & 255) / 255.0f, (*rgb & 255) / 255.0f};
            STX_TRY([[maybe_unused]] const auto taken, lexer_.take());
            return {};
        }
        return readAll(v.r, v.g, v.b);
    }
    Result<void> read(Rotation& v) { return readAll(v.axis.x, v.axis.y, v.axis.z, v.angle); }
    Result<void> read(PixelImage& image) {
        const std::string where = lexer_.where();
        if (auto ok = readAll(image.width, image.height, image.components); !ok) return ok;
        // An empty image is written 0 0 0.
        if ((image.width == 0 || image.height == 0) && image.components == 0) image.components = 1;
        if (image.width < 0 || image.height < 0 || image.width > 4095 || image.height > 4095 ||
            image.components < 1 || image.components > 4)
            return failAt(where, ErrorCode::invalidInput,
                          "the image is {}x{} with {} components; at most 4095x4095 with 1 to 4 is "
                          "possible",
                          image.width, image.height, image.components);
        const std::size_t count = static_cast<std::size_t>(image.width) * image.height;
        if (count > (lexer_.remaining() + 64) / 2 + 64)
            return failAt(where, ErrorCode::invalidInput,
                          "the image says {}x{}, but only {} bytes of text follow", image.width,
                          image.height, lexer_.remaining());
        image.pixels.reserve(count * image.components);
        for (std::size_t i = 0; i < count; ++i) {
            const auto fits = [&](std::string_view text) -> std::optional<std::uint32_t> {
                const auto value = integerFromText(text);
                if (!value || *value < 0 || *value >> (8 * image.components) != 0) return {};
                return static_cast<std::uint32_t>(*value);
            };
            Result<std::uint32_t> pixel = parsed<std::uint32_t>(
                fits,
                fmt::format("pixel {} of {}, an integer of {} bytes", i, count, image.components));
            if (!pixel) return propagate(pixel);
            for (int c = image.components - 1; c >= 0; --c)
                image.pixels.push_back(static_cast<std::uint8_t>(*pixel >> (8 * c)));
        }
        return {};
    }
    Result<void> read(NodePtr&) { return unexpected("a value without nodes"); }
    /// One more item of a list; that of vector<bool> has no address.
    template <class T>
    Result<void> readItem(std::vector<T>& items) {
        T item{};
        STX_CHECK(read(item));
        items.push_back(std::move(item));
        return {};
    }

  private:
    template <class... T>
    Result<void> readAll(T&... values) {
        Result<void> result;
        (void)((result = read(values), result.has_value()) && ...);
        return result;
    }

    BtLexer& lexer_;
};

void append(std::string& out, bool v, TextStyle style) {
    if (style == TextStyle::bt) {
        out += v ? "TRUE" : "FALSE";
    } else {
        out += v ? "true" : "false";
    }
}
void append(std::string& out, std::int32_t v, TextStyle) {
    fmt::format_to(std::back_inserter(out), "{}", v);
}
void append(std::string& out, float v, TextStyle) {
    fmt::format_to(std::back_inserter(out), "{}", v);
}
void append(std::string& out, double v, TextStyle) {
    fmt::format_to(std::back_inserter(out), "{}", v);
}
void append(std::string& out, const std::string& v, TextStyle) {
    out += quotedText(v);
}
void append(std::string& out, const Url& v, TextStyle style) {
    if (v.objectDescriptorId == 0) {
        out += quotedText(v.text);
    } else if (style == TextStyle::bt) {
        fmt::format_to(std::back_inserter(out), "od:{}", v.objectDescriptorId);
    } else {
        fmt::format_to(std::back_inserter(out), "\"od:{}\"", v.objectDescriptorId);
    }
}
template <class... T>
void appendAll(std::string& out, TextStyle style, const T&... values) {
    bool first = true;
    (((first ? void() : void(out += ' ')), first = false, append(out, values, style)), ...);
}
void append(std::string& out, glm::vec2 v, TextStyle s) {
    appendAll(out, s, v.x, v.y);
}
void append(std::string& out, glm::vec3 v, TextStyle s) {
    appendAll(out, s, v.x, v.y, v.z);
}
void append(std::string& out, Color v, TextStyle s) {
    appendAll(out, s, v.r, v.g, v.b);
}
void append(std::string& out, const Rotation& v, TextStyle s) {
    appendAll(out, s, v.axis.x, v.axis.y, v.axis.z, v.angle);
}
void append(std::string& out, const PixelImage& image, TextStyle) {
    fmt::format_to(std::back_inserter(out), "{} {} {}", image.width, image.height,
                   image.components);
    static constexpr char kDigits[] = "0123456789ABCDEF";
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        if (i % image.components == 0) out += " 0x";
        out += kDigits[image.pixels[i] >> 4];
        out += kDigits[image.pixels[i] & 15];
    }
}
void append(std::string& out, const glm::vec4& v, TextStyle s) {
    appendAll(out, s, v.x, v.y, v.z, v.w);
}
void append(std::string& out, const ScriptText& v, TextStyle) {
    out += quotedText(v.text);
}
// Writers write those with commands themselves.
void append(std::string& out, const CommandBuffer&, TextStyle style) {
    out += style == TextStyle::bt ? "{ }" : "";
}
void append(std::string&, const AttributeReference&, TextStyle) {}
void append(std::string&, const NodePtr&, TextStyle) {}

}  // namespace

Result<FieldValue> readFieldValue(BtLexer& lexer, FieldType type, bool wholeText) {
    FieldValue value = emptyValue(type);
    ItemReader reader(lexer);
    const auto readValue = [&](auto& v) -> Result<void> {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, NodeList>) {
            return reader.unexpected("a value without nodes");
        } else if constexpr (kIsList<T>) {
            const bool brackets = lexer.peek().kind == Kind::openBracket;
            if (brackets) {
                if (auto taken = lexer.take(); !taken) return propagate(taken);
            }
            if (!brackets && !wholeText) {
                STX_CHECK(reader.readItem(v));
                return {};
            }
            for (;;) {
                const Kind kind = lexer.peek().kind;
                if (brackets && kind == Kind::closeBracket) {
                    if (auto taken = lexer.take(); !taken) return propagate(taken);
                    return {};
                }
                if (kind == Kind::end) {
                    if (!brackets) return {};
                    return reader.unexpected("']' behind the items");
                }
                STX_CHECK(reader.readItem(v));
            }
        } else {
            return reader.read(v);
        }
    };
    if (auto ok = std::visit(readValue, value); !ok) return propagate(ok);
    return value;
}

void appendFieldValue(std::string& out, const FieldValue& value, TextStyle style) {
    std::visit(
        [&](const auto& v) {
            using T = std::decay_t<decltype(v)>;
            if constexpr (kIsList<T>) {
                if (style == TextStyle::bt) out += '[';
                bool first = true;
                for (const auto& item : v) {
                    if (!first) out += ' ';
                    first = false;
                    append(out, item, style);
                }
                if (style == TextStyle::bt) out += ']';
            } else {
                append(out, v, style);
            }
        },
        value);
}

static bool holdsBytes(const NodeInfo& node, int field) {
    return node.name == "BitWrapper" && node.fields[field].name == "buffer";
}

FieldValue toText(const NodeInfo& node, int field, const FieldValue& value) {
    const auto* bytes = std::get_if<std::string>(&value);
    if (bytes == nullptr || bytes->empty() || !holdsBytes(node, field)) return value;
    return "data:application/octet-string;base64," +
           encodeBase64(std::as_bytes(std::span(bytes->data(), bytes->size())));
}

std::optional<FieldValue> fromText(const NodeInfo& node, int field, FieldValue value) {
    auto* text = std::get_if<std::string>(&value);
    if (text == nullptr || !holdsBytes(node, field) || !text->starts_with("data:")) return value;
    constexpr std::string_view kCoding = ";base64,";
    const auto at = text->find(kCoding);
    if (at == std::string::npos) return value;
    const auto bytes = decodeBase64(std::string_view(*text).substr(at + kCoding.size()));
    if (!bytes) return {};
    *text = {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
    return value;
}

std::string textNameOf(const Node& node) {
    if (!node.defName.empty()) return node.defName;
    return node.defId > 0 ? nameOfId('N', node.defId) : std::string();
}

std::string textNameOf(const Route& route) {
    // A name that would be taken for the number of another route goes.
    if (!route.name.empty() && (route.id == 0 || idFromTextName(route.name, 'R') == 0))
        return route.name;
    return route.id > 0 ? nameOfId('R', route.id) : std::string();
}

std::uint32_t idFromTextName(std::string_view name, char letter) {
    if (name.size() < 2 || name.size() > 10 || name[0] != letter) return 0;
    if (name[1] == '0' && name.size() > 2) return 0;
    const auto number = wholeNumber<std::uint32_t>(name.substr(1));
    return number ? *number + 1 : 0;
}

bool isPlainName(std::string_view name) {
    if (name.empty() || (name[0] >= '0' && name[0] <= '9') || name[0] == '-' || name[0] == '+')
        return false;
    for (const char c : name) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                           (c >= '0' && c <= '9') || c == '_' || c == '-' ||
                           static_cast<unsigned char>(c) >= 0x80;
        if (!plain) return false;
    }
    return !equalNoCase(name, "NULL") && !equalNoCase(name, "DEF") && !equalNoCase(name, "USE");
}

Result<void> NodeNames::define(const std::string& name, const NodePtr& node,
                               const std::string& where, bool again) {
    const auto [entry, isNew] = byName_.try_emplace(name, Entry{node, where, time_});
    if (!isNew && again) {
        entry->second = Entry{node, where, time_};
    } else if (!isNew)
        return failAt(where, ErrorCode::invalidInput,
                      "DEF '{}' names a second node; the first stands at {}", excerpt(name),
                      entry->second.where);
    if (const std::uint32_t id = idFromTextName(name, 'N')) {
        node->defId = id;
    } else {
        node->defName = name;
        ++nameCount_;
    }
    return {};
}

void NodeNames::succeed(const Node& target, const NodePtr& replacement, std::size_t namedBefore) {
    if (named_.size() <= namedBefore || named_.back() != replacement) return;  // a USE, no name
    const std::string before = textNameOf(target) + '_';
    const std::string_view name = replacement->defName;
    if (!name.starts_with(before) || !wholeNumber<std::uint32_t>(name.substr(before.size())))
        return;
    bool holds = false;
    forEachNode(replacement, [&](const NodePtr& node) { holds = holds || node.get() == &target; });
    if (holds) return;
    if (target.defName.empty()) --nameCount_;
    replacement->defName = target.defName;
    replacement->defId = target.defId;
}

void RouteNames::define(const Route& route) {
    if (const std::string name = textNameOf(route); !name.empty()) ids_[name] = route.id;
}

/// Above all numbers that a name can have.
static constexpr std::uint32_t kStandIn = 1u << 31;

Result<std::uint32_t> RouteNames::idOf(const std::string& name, const std::string& where) {
    if (const std::uint32_t id = idFromTextName(name, 'R')) return id;
    const auto found = ids_.find(name);
    if (found == ids_.end())
        return failAt(where, ErrorCode::invalidInput, "no ROUTE has the DEF name '{}'",
                      excerpt(name));
    if (found->second == 0) {
        found->second = kStandIn + static_cast<std::uint32_t>(reached_.size());
        reached_.push_back(name);
    }
    return found->second;
}

void RouteNames::number(std::vector<CommandFrame>& frames) const {
    if (reached_.empty()) return;
    const auto eachRoute = [&](const auto& visit) {
        for (CommandFrame& frame : frames)
            for (Command& command : frame.commands)
                std::visit(
                    [&](auto& c) {
                        if constexpr (requires { c.routes; })
                            for (Route& route : c.routes) visit(route.id, route.name);
                        if constexpr (requires { c.routeId; }) visit(c.routeId, std::string());
                        if constexpr (requires { c.route; }) visit(c.route.id, c.route.name);
                    },
                    command);
    };
    std::set<std::uint32_t> taken;
    eachRoute([&](std::uint32_t id, const std::string&) { taken.insert(id); });
    std::map<std::string, std::uint32_t> numbers;
    std::uint32_t next = 1;
    for (const std::string& name : reached_) {
        while (taken.contains(next)) ++next;
        numbers[name] = next++;
    }
    eachRoute([&](std::uint32_t& id, const std::string& name) {
        if (id >= kStandIn) id = numbers.at(reached_[id - kStandIn]);
        if (const auto found = numbers.find(name); id == 0 && found != numbers.end())
            id = found->second;
    });
}

void NodeNames::closed(const NodePtr& node, int height) {
    heights_[node.get()] = height;
    named_.push_back(node);
}

const NodeNames::Entry* NodeNames::find(const std::string& name) const {
    const auto found = byName_.find(name);
    if (found != byName_.end()) return &found->second;
    return outer_ == nullptr ? nullptr : outer_->find(name);
}

std::optional<int> NodeNames::heightOfNamed(const Node& node) const {
    const auto found = heights_.find(&node);
    if (found != heights_.end()) return found->second;
    return outer_ == nullptr ? std::nullopt : outer_->heightOfNamed(node);
}

Result<NodePtr> NodeNames::use(const std::string& name, int depth, const std::string& where,
                               int& height) const {
    height = 0;
    const Entry* found = find(name);
    if (found == nullptr) return NodePtr();
    const auto known = heightOfNamed(*found->node);
    if (!known)
        return failAt(where, ErrorCode::invalidInput,
                      "USE '{}' is inside the node of that name, which would hold itself",
                      excerpt(name));
    height = *known;
    if (depth + height > limits_->maxNesting)
        return failAt(where, ErrorCode::invalidInput, "nodes nest deeper than {} here",
                      limits_->maxNesting);
    return found->node;
}

void NodeNames::useLater(std::string name, NodePtr owner, int field, int item, std::string where) {
    pending_.push_back({std::move(name), std::move(owner), field, item, std::move(where)});
}

Result<NodePtr> NodeNames::target(const std::string& name, const std::string& where) const {
    const Entry* found = find(name);
    if (found == nullptr)
        return failAt(where, ErrorCode::invalidInput, "no node has the DEF name '{}'",
                      excerpt(name));
    if (found->time > time_)
        return failAt(where, ErrorCode::invalidInput,
                      "this happens at tick {}, and DEF '{}' ({}) comes at {} only", time_,
                      excerpt(name), found->where, found->time);
    return found->node;
}

Result<void> NodeNames::countNode() {
    // A node is a few hundred bytes, a few characters of text are enough to ask for one.
    return limits_->checkAllocation(++count_, 256, "the nodes of the scene");
}

Result<int> NodeNames::heightOf(const NodePtr& node, int depth,
                                std::unordered_map<const Node*, int>& known) const {
    if (!node) return 0;
    if (const auto found = known.find(node.get()); found != known.end()) {
        depth += found->second;
        if (depth <= limits_->maxNesting) return found->second;
    }
    if (depth > limits_->maxNesting)
        return fail(ErrorCode::invalidInput,
                    "nodes nest deeper than {}, or a node holds itself through a USE",
                    limits_->maxNesting);
    int below = 0;
    for (const Node::SetField& field : node->setFields) {
        if (const auto* child = std::get_if<NodePtr>(&field.value)) {
            STX_TRY(const int height, heightOf(*child, depth + 1, known));
            below = std::max(below, height);
        } else if (const auto* list = std::get_if<NodeList>(&field.value)) {
            for (const NodePtr& item : *list) {
                STX_TRY(const int height, heightOf(item, depth + 1, known));
                below = std::max(below, height);
            }
        }
    }
    known[node.get()] = below + 1;
    return below + 1;
}

Result<void> NodeNames::resolve() {
    const auto put = [](const Pending& p, const NodePtr& node) {
        FieldValue& value = p.owner->edit(p.field);
        if (p.item < 0) {
            value = node;
        } else {
            std::get<NodeList>(value)[p.item] = node;
        }
    };
    Result<void> result;
    for (const Pending& p : pending_) {
        auto node = target(p.name, p.where);
        if (!node) {
            result = propagate(node);
            break;
        }
        const FieldInfo& field = p.owner->info->fields[p.field];
        if (!mayStandIn(node->get(), field.nodeType)) {
            result = failAt(p.where, ErrorCode::invalidInput,
                            "{} '{}' is not allowed in {}.{}, which takes {}", (*node)->info->name,
                            excerpt(p.name), p.owner->info->name, field.name, name(field.nodeType));
            break;
        }
        put(p, *node);
    }
    if (result) {
        std::unordered_map<const Node*, int> known;
        for (const Pending& p : pending_) {
            if (auto height = heightOf(p.owner, 1, known); !height) {
                result = tl::unexpected(height.error().at(p.where));
                break;
            }
        }
    }
    // A cycle of owners would never be freed; and trees that nest too deeply must not be walked.
    if (!result)
        for (const Pending& p : pending_) put(p, nullptr);
    pending_.clear();
    return result;
}

}  // namespace stx::mpeg4
