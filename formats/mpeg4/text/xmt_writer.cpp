#include <iterator>

#include "formats/mpeg4/scene/proto_links.hpp"
#include "formats/mpeg4/text/scene_text.hpp"
#include "formats/mpeg4/text/text_descriptors.hpp"
#include "formats/mpeg4/text/text_values.hpp"
#include "formats/mpeg4/text/xmt.hpp"
#include "formats/mpeg4/text/xmt_types.hpp"
#include "lib/base/code_point.hpp"

namespace stx::mpeg4 {
namespace {

/// Bytes of the UTF-8 character at the start of `text` that XML can hold; 0: none.
std::size_t xmlCharacter(std::string_view text) {
    const CodePoint c = firstCodePoint(text);
    const bool control = c.value < 32 && c.value != '\t' && c.value != '\n' && c.value != '\r';
    return control || c.value == 0xFFFE || c.value == 0xFFFF ? 0 : c.bytes;
}

class XmtWriter {
  public:
    XmtWriter(const Document& document, TextNames names, Job& job)
        : document_(document), scope_{std::move(names), nullptr, {}}, job_(job) {}

    Result<std::string> write() {
        out_ = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
        open("XMT-A", {{"xmlns", "urn:mpeg:mpeg4:xmta:schema:2002"}});
        open("Header");
        writeInitialDescriptor();
        close("Header");
        open("Body");
        std::size_t od = 0;
        for (const CommandFrame& frame : document_.frames) {
            const double seconds =
                static_cast<double>(frame.time) / document_.sceneStream.timescale;
            const auto isDue = [&](double limit, bool including) {
                if (od >= document_.odFrames.size()) return false;
                const double time =
                    static_cast<double>(document_.odFrames[od].time) / document_.odStream.timescale;
                return time < limit || (including && time == limit);
            };
            while (isDue(seconds, false)) STX_CHECK(writeOdFrame(document_.odFrames[od++]));
            const bool rap = frame.randomAccess && &frame != &document_.frames.front();
            beginTime(seconds, rap);
            for (const Command& command : frame.commands)
                std::visit([&](const auto& c) { write(c); }, command);
            endTime(seconds, rap);
            while (isDue(seconds, true)) STX_CHECK(writeOdFrame(document_.odFrames[od++]));
        }
        while (od < document_.odFrames.size()) STX_CHECK(writeOdFrame(document_.odFrames[od++]));
        close("Body");
        close("XMT-A");
        if (!fits_) return propagate(fits_);
        if (replaced_)
            job_.note("characters that XML cannot hold were replaced in strings of the scene");
        return std::move(out_);
    }

  private:
    // ---- XML
    struct Attribute {
        std::string_view name;
        std::string value;
    };
    using Attributes = std::vector<Attribute>;

    void escape(std::string_view text) {
        while (!text.empty()) {
            const std::size_t length = xmlCharacter(text);
            if (length == 0) {
                out_ += "\xEF\xBF\xBD";
                replaced_ = true;
                text.remove_prefix(1);
                continue;
            }
            const std::string_view character = text.substr(0, length);
            switch (character[0]) {
                case '&':
                    out_ += "&amp;";
                    break;
                case '<':
                    out_ += "&lt;";
                    break;
                case '>':
                    out_ += "&gt;";
                    break;
                case '"':
                    out_ += "&quot;";
                    break;
                case '\n':
                    out_ += "&#10;";
                    break;
                case '\r':
                    out_ += "&#13;";
                    break;
                case '\t':
                    out_ += "&#9;";
                    break;
                default:
                    out_ += character;
            }
            text.remove_prefix(static_cast<std::size_t>(length));
        }
    }
    void begin(std::string_view tag, const Attributes& attributes) {
        out_.append(static_cast<std::size_t>(depth_), ' ');
        out_ += '<';
        out_ += tag;
        for (const Attribute& attribute : attributes) {
            out_ += ' ';
            out_ += attribute.name;
            out_ += "=\"";
            escape(attribute.value);
            out_ += '"';
        }
    }
    void open(std::string_view tag, const Attributes& attributes = {}) {
        begin(tag, attributes);
        out_ += ">\n";
        ++depth_;
    }
    void close(std::string_view tag) {
        --depth_;
        out_.append(static_cast<std::size_t>(depth_), ' ');
        out_ += "</";
        out_ += tag;
        out_ += ">\n";
    }
    void empty(std::string_view tag, const Attributes& attributes = {}) {
        begin(tag, attributes);
        out_ += "/>\n";
    }
    void beginTime(double seconds, bool rap) {
        Attributes attributes = {{"begin", fmt::format("{}", seconds)}};
        if (rap) attributes.push_back({"isRAP", "yes"});
        if (seconds != 0 || rap) open("par", attributes);
    }
    void endTime(double seconds, bool rap) {
        if (seconds != 0 || rap) close("par");
    }

    // ---- Nodes
    static std::string valueText(const FieldValue& value) {
        // Single strings and URLs are written as they are, lists of them in quotes.
        if (const auto* text = std::get_if<std::string>(&value)) return *text;
        if (const auto* url = std::get_if<Url>(&value); url && url->objectDescriptorId != 0)
            return fmt::format("od:{}", url->objectDescriptorId);
        std::string out;
        appendFieldValue(out, value, TextStyle::xmt);
        return out;
    }
    void writeNode(const NodePtr& node) {
        if (!node) {
            empty("NULL");
            return;
        }
        const std::string type = node->proto ? "ProtoInstance" : node->info->name;
        Attributes attributes;
        if (node->proto) attributes.push_back({"name", node->info->name});
        if (const std::string* defName = scope_.names.find(*node)) {
            if (!scope_.names.firstTime(*node)) {
                attributes.push_back({"USE", *defName});
                empty(type, attributes);
                return;
            }
            attributes.push_back({"DEF", *defName});
        }
        const std::map<int, int>& links = linksOf(scope_.links, *node);
        const int own = ownFieldCount(*node);
        const int ownFrom = static_cast<int>(node->info->fields.size()) - own;
        bool hasNodes = own > 0 || !links.empty() || (node->proto && !node->setFields.empty());
        for (const Node::SetField& field : node->setFields) {
            if (node->proto || field.index >= ownFrom || links.contains(field.index)) continue;
            if (std::holds_alternative<NodePtr>(field.value) ||
                std::holds_alternative<NodeList>(field.value) ||
                std::holds_alternative<CommandBuffer>(field.value))
                hasNodes = true;
            else
                attributes.push_back({node->info->fields[field.index].name,
                                      valueText(toText(*node->info, field.index, field.value))});
        }
        if (!hasNodes) {
            empty(type, attributes);
            return;
        }
        open(type, attributes);
        for (int i = ownFrom; i < ownFrom + own; ++i)
            writeDeclaration(node->info->fields[i],
                             links.contains(i) || !node->isSet(i) ? nullptr : &node->value(i));
        for (const Node::SetField& field : node->setFields) {
            const std::string& fieldName = node->info->fields[field.index].name;
            if (field.index >= ownFrom || links.contains(field.index)) continue;
            if (node->proto) {
                writeDeclared("fieldValue", {{"name", fieldName}}, &field.value);
                continue;
            }
            if (const auto* child = std::get_if<NodePtr>(&field.value)) {
                open(fieldName);
                writeNode(*child);
                close(fieldName);
            } else if (const auto* list = std::get_if<NodeList>(&field.value)) {
                if (list->empty()) {
                    empty(fieldName);
                    continue;
                }
                open(fieldName);
                for (const NodePtr& item : *list) writeNode(item);
                close(fieldName);
            } else if (const auto* buffer = std::get_if<CommandBuffer>(&field.value)) {
                writeBuffer(*buffer);
            }
        }
        if (!links.empty()) {
            open("IS");
            for (const auto& [field, protoField] : links)
                empty("connect", {{"nodeField", node->info->fields[field].name},
                                  {"protoField", scope_.proto->type.fields[protoField].name}});
            close("IS");
        }
        close(type);
    }

    // ---- PROTOs
    /// An element with the value of a declared field: an attribute, or nodes in it. Null: none.
    void writeDeclared(std::string_view tag, Attributes attributes, const FieldValue* value) {
        const NodePtr* node = value ? std::get_if<NodePtr>(value) : nullptr;
        const NodeList* list = value ? std::get_if<NodeList>(value) : nullptr;
        // Also without any: others need the element.
        if (node || list) {
            open(tag, attributes);
            open(node ? "node" : "nodes");
            if (node) writeNode(*node);
            if (list)
                for (const NodePtr& item : *list) writeNode(item);
            close(node ? "node" : "nodes");
            close(tag);
            return;
        }
        if (value) attributes.push_back({"value", valueText(*value)});
        empty(tag, attributes);
    }
    void writeDeclaration(const FieldInfo& field, const FieldValue* value) {
        writeDeclared("field",
                      {{"name", field.name},
                       {"type", std::string(xmtNameOf(field.type))},
                       {"vrml97Hint", std::string(name(field.kind))}},
                      field.hasValue() ? value : nullptr);
    }
    void writeProto(const Proto& proto) {
        Attributes attributes = {{"name", proto.name}};
        if (proto.isExtern) attributes.push_back({"locations", valueText(FieldValue(proto.urls))});
        open("ProtoDeclare", attributes);
        for (const FieldInfo& field : proto.type.fields)
            writeDeclaration(field, &defaultValue(proto.type, field.index));
        WritingScope outer = std::exchange(scope_, WritingScope::ofBody(proto));
        for (const ProtoPtr& inner : proto.protos) writeProto(*inner);
        for (const NodePtr& node : proto.body) writeNode(node);
        for (const Route& route : proto.routes) writeRoute(route);
        scope_ = std::move(outer);
        close("ProtoDeclare");
    }

    void writeBuffer(const CommandBuffer& buffer) {
        const auto commands = commandsToWrite(scope_.names, buffer, bufferDepth_, fits_);
        if (commands.empty()) {
            empty("buffer");
            return;
        }
        open("buffer");
        ++bufferDepth_;
        WritingScope outer = std::move(scope_);
        scope_ = WritingScope::inside(outer, commands);
        for (const Command& command : commands)
            std::visit([&](const auto& c) { write(c); }, command);
        scope_ = std::move(outer);
        --bufferDepth_;
        close("buffer");
    }

    // ---- Commands
    [[nodiscard]] std::string nameOf(const NodePtr& node) const {
        const std::string* found = node ? scope_.names.find(*node) : nullptr;
        return found ? *found : "";
    }
    static std::string positionText(Position position) {
        return position.index == Position::kLast ? "END" : fmt::format("{}", position.index);
    }
    static std::string fieldName(const NodePtr& node, int field) {
        return node->info->fields[field].name;
    }
    void writeRoute(const Route& route) { writeRoute(route, scope_.names.define(route)); }
    void writeRoute(const Route& route, std::string name) {
        Attributes attributes;
        if (!name.empty()) attributes.push_back({"DEF", std::move(name)});
        attributes.push_back({"fromNode", nameOf(route.from)});
        attributes.push_back({"fromField", fieldName(route.from, route.fromField)});
        attributes.push_back({"toNode", nameOf(route.to)});
        attributes.push_back({"toField", fieldName(route.to, route.toField)});
        empty("ROUTE", attributes);
    }
    void writeWithValue(std::string_view tag, Attributes attributes, const FieldValue& value) {
        if (const auto* node = std::get_if<NodePtr>(&value)) {
            open(tag, attributes);
            writeNode(*node);
            close(tag);
        } else if (const auto* list = std::get_if<NodeList>(&value)) {
            open(tag, attributes);
            for (const NodePtr& item : *list) writeNode(item);
            close(tag);
        } else if (const auto* buffer = std::get_if<CommandBuffer>(&value)) {
            open(tag, attributes);
            writeBuffer(*buffer);
            close(tag);
        } else {
            attributes.push_back({"value", valueText(value)});
            empty(tag, attributes);
        }
    }
    void write(const ReplaceScene& c) {
        scope_.names.beginScene();
        open("Replace");
        open("Scene");
        for (const ProtoPtr& proto : c.protos) writeProto(*proto);
        if (c.root) writeNode(c.root);
        for (const Route& route : c.routes) writeRoute(route);
        close("Scene");
        close("Replace");
    }
    void write(const ReplaceNode& c) {
        writeWithValue("Replace", {{"atNode", nameOf(c.target)}}, FieldValue(c.replacement));
    }
    void write(const ReplaceField& c) {
        writeWithValue("Replace",
                       {{"atNode", nameOf(c.target)}, {"atField", fieldName(c.target, c.field)}},
                       c.value);
    }
    void write(const ReplaceIndexed& c) {
        writeWithValue("Replace",
                       {{"atNode", nameOf(c.target)},
                        {"atField", fieldName(c.target, c.field)},
                        {"position", positionText(c.position)}},
                       c.value);
    }
    void write(const ReplaceRoute& c) {
        open("Replace", {{"atRoute", scope_.names.routeOf(c.routeId)}});
        writeRoute(c.route, "");  // it keeps its name
        close("Replace");
    }
    void write(const InsertNode& c) {
        writeWithValue("Insert",
                       {{"atNode", nameOf(c.target)}, {"position", positionText(c.position)}},
                       FieldValue(c.node));
    }
    void write(const InsertIndexed& c) {
        writeWithValue("Insert",
                       {{"atNode", nameOf(c.target)},
                        {"atField", fieldName(c.target, c.field)},
                        {"position", positionText(c.position)}},
                       c.value);
    }
    void write(const InsertRoute& c) {
        open("Insert");
        writeRoute(c.route);
        close("Insert");
    }
    void write(const DeleteNode& c) { empty("Delete", {{"atNode", nameOf(c.target)}}); }
    void write(const DeleteIndexed& c) {
        empty("Delete", {{"atNode", nameOf(c.target)},
                         {"atField", fieldName(c.target, c.field)},
                         {"position", positionText(c.position)}});
    }
    void write(const DeleteRoute& c) {
        empty("Delete", {{"atRoute", scope_.names.routeOf(c.routeId)}});
    }

    // ---- Descriptors
    template <class T>
    static void add(Attributes& attributes, std::string_view name, T value, T unless) {
        if (value != unless) attributes.push_back({name, fmt::format("{}", value)});
    }
    void writeConfig(const BifsConfig& config) {
        const bool v2 = config.version == 2;
        const std::string_view type = v2 ? "BIFSv2Config" : "BIFSConfig";
        Attributes attributes;
        if (v2) {
            add(attributes, "use3DMeshCoding", config.use3DMeshCoding, false);
            add(attributes, "usePredictiveMFField", config.usePredictiveMFField, false);
        }
        add(attributes, "nodeIDbits", config.nodeIdBits, 0);
        add(attributes, "routeIDbits", config.routeIdBits, 0);
        if (v2) add(attributes, "protoIDbits", config.protoIdBits, 0);
        open("decSpecificInfo");
        open(type, attributes);
        const Attributes metric = {{"pixelMetric", config.pixelMetric ? "true" : "false"}};
        if (config.hasSize) {
            open("commandStream", metric);
            empty("size", {{"pixelWidth", fmt::format("{}", config.pixelWidth)},
                           {"pixelHeight", fmt::format("{}", config.pixelHeight)}});
            close("commandStream");
        } else {
            empty("commandStream", metric);
        }
        close(type);
        close("decSpecificInfo");
    }
    void writeStream(const ElementaryStream& stream, const BifsConfig* config) {
        Attributes attributes;
        if (stream.esId != 0)
            attributes = {{"ES_ID", fmt::format("es{}", stream.esId)},
                          {"binaryID", fmt::format("{}", stream.esId)}};
        if (stream.dependsOnEsId)
            attributes.push_back({"dependsOn_ES_ID", fmt::format("es{}", *stream.dependsOnEsId)});
        if (stream.ocrEsId)
            attributes.push_back({"OCR_ES_ID", fmt::format("es{}", *stream.ocrEsId)});
        add<int>(attributes, "streamPriority", stream.streamPriority, 0);
        if (!stream.url.empty()) attributes.push_back({"URLstring", stream.url});
        open("ES_Descriptor", attributes);

        Attributes decoder;
        add<int>(decoder, "objectTypeIndication", stream.objectTypeIndication, 0);
        decoder.push_back({"streamType", fmt::format("{}", static_cast<int>(stream.streamType))});
        add(decoder, "upStream", stream.upStream, false);
        add(decoder, "bufferSizeDB", stream.bufferSizeDB, 0u);
        add(decoder, "maxBitrate", stream.maxBitrate, 0u);
        add(decoder, "avgBitrate", stream.avgBitrate, 0u);
        open("decConfigDescr");
        if (config || !stream.decoderSpecificInfo.empty()) {
            open("DecoderConfigDescriptor", decoder);
            if (config) {
                writeConfig(*config);
            } else {
                open("decSpecificInfo");
                empty("DecoderSpecificInfo",
                      {{"type", "auto"},
                       {"src", "data:application/octet-string," +
                                   percentText(stream.decoderSpecificInfo)}});
                close("decSpecificInfo");
            }
            close("DecoderConfigDescriptor");
        } else {
            empty("DecoderConfigDescriptor", decoder);
        }
        close("decConfigDescr");
        if (stream.timescale != 1000) {
            open("slConfigDescr");
            open("SLConfigDescriptor");
            empty("custom", {{"useAccessUnitStartFlag", "true"},
                             {"useAccessUnitEndFlag", "true"},
                             {"timeStampResolution", fmt::format("{}", stream.timescale)},
                             {"timeStampLength", "32"}});
            close("SLConfigDescriptor");
            close("slConfigDescr");
        }
        if (!stream.fileName.empty() && !stream.samples.empty()) {
            const MuxTimes times = muxTimes(stream);
            Attributes mux = {{"url", stream.fileName}};
            add(mux, "startTime", times.startMs, 0.0);
            add(mux, "frameRate", times.frameRate, 0.0);
            if (times.frameRate != 0 || times.durationMs != 1000)
                mux.push_back({"duration", fmt::format("{}", times.durationMs)});
            empty("StreamSource", mux);
        }
        close("ES_Descriptor");
    }
    void writeInitialDescriptor() {
        const InitialObjectDescriptor& iod = document_.iod;
        Attributes attributes = {{"objectDescriptorID", fmt::format("od{}", iod.id)},
                                 {"binaryID", fmt::format("{}", iod.id)}};
        if (!iod.url.empty()) attributes.push_back({"URLstring", iod.url});
        open("InitialObjectDescriptor", attributes);
        Attributes profiles;
        add(profiles, "includeInlineProfileLevelFlag", iod.includeInlineProfileLevel, false);
        profiles.push_back({"ODProfileLevelIndication", fmt::format("{}", iod.odProfileLevel)});
        profiles.push_back(
            {"sceneProfileLevelIndication", fmt::format("{}", iod.sceneProfileLevel)});
        profiles.push_back(
            {"audioProfileLevelIndication", fmt::format("{}", iod.audioProfileLevel)});
        profiles.push_back(
            {"visualProfileLevelIndication", fmt::format("{}", iod.visualProfileLevel)});
        profiles.push_back(
            {"graphicsProfileLevelIndication", fmt::format("{}", iod.graphicsProfileLevel)});
        empty("Profiles", profiles);
        open("Descr");
        open("esDescr");
        writeStream(sceneStreamForText(document_), &document_.bifsConfig);
        if (hasOdStream(document_)) writeStream(odStreamForText(document_), nullptr);
        close("esDescr");
        close("Descr");
        close("InitialObjectDescriptor");
    }
    void writeOd(const ObjectDescriptor& od) {
        Attributes attributes = {{"objectDescriptorID", fmt::format("od{}", od.id)},
                                 {"binaryID", fmt::format("{}", od.id)}};
        if (!od.url.empty()) attributes.push_back({"URLstring", od.url});
        if (od.streams.empty()) {
            empty("ObjectDescriptor", attributes);
            return;
        }
        open("ObjectDescriptor", attributes);
        open("Descr");
        open("esDescr");
        for (const ElementaryStream& stream : od.streams) writeStream(stream, nullptr);
        close("esDescr");
        close("Descr");
        close("ObjectDescriptor");
    }
    Result<void> writeOdFrame(const OdFrame& frame) {
        const double seconds = static_cast<double>(frame.time) / document_.odStream.timescale;
        // The first, too: others look for the descriptors of the start in such an element.
        const bool rap = frame.randomAccess || &frame == &document_.odFrames.front();
        beginTime(seconds, rap);
        for (const OdCommand& command : frame.commands) {
            if (const auto* update = std::get_if<UpdateObjectDescriptors>(&command)) {
                open("ObjectDescriptorUpdate");
                open("OD");
                for (const ObjectDescriptor& od : update->descriptors) writeOd(od);
                close("OD");
                close("ObjectDescriptorUpdate");
            } else if (const auto* remove = std::get_if<RemoveObjectDescriptors>(&command)) {
                std::string ids;
                for (const int id : remove->ids)
                    ids += fmt::format("{}od{}", ids.empty() ? "" : " ", id);
                empty("ObjectDescriptorRemove", {{"objectDescriptorID", ids}});
            } else {
                return fail(ErrorCode::unsupported,
                            "the object descriptors change single streams or carry IPMP, which the "
                            "text forms here do not have; keep this presentation as .mp4");
            }
        }
        endTime(seconds, rap);
        return {};
    }

    const Document& document_;
    WritingScope scope_;
    Job& job_;
    std::string out_;
    int depth_ = 0;
    bool replaced_ = false;
    Result<void> fits_;    ///< the first buffer of commands that has no text
    int bufferDepth_ = 0;  ///< in how many buffers what is written is
};

}  // namespace

Result<std::string> writeXmt(const Document& document, Job& job) {
    STX_TRY(auto names, TextNames::make(document, job.limits));
    return XmtWriter(document, std::move(names), job).write();
}

}  // namespace stx::mpeg4
