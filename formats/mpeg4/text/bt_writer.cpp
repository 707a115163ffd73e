#include <iterator>

#include "formats/mpeg4/scene/proto_links.hpp"
#include "formats/mpeg4/text/bt.hpp"
#include "formats/mpeg4/text/scene_text.hpp"
#include "formats/mpeg4/text/text_descriptors.hpp"
#include "formats/mpeg4/text/text_values.hpp"

namespace stx::mpeg4 {
namespace {

class BtWriter {
  public:
    BtWriter(const Document& document, TextNames names)
        : document_(document), scope_{std::move(names), nullptr, {}} {}

    Result<std::string> write() {
        writeInitialDescriptor();
        // A scene that replaces all at the start is written bare, as people write it.
        bool bare = true;
        std::size_t od = 0;
        for (const CommandFrame& frame : document_.frames) {
            std::size_t first = 0;
            if (bare && frame.time == 0 && !frame.commands.empty()) {
                if (const auto* scene = std::get_if<ReplaceScene>(&frame.commands[0]);
                    scene && scene->root) {
                    line("");
                    scope_.names.beginScene();
                    writeProtos(scene->protos);
                    indent();
                    writeNode(scene->root);
                    out_ += '\n';
                    for (const Route& route : scene->routes) {
                        writeRouteStatement(route);
                        out_ += '\n';
                    }
                    first = 1;
                }
            }
            bare = false;
            for (; od < document_.odFrames.size() && odTime(od) <= sceneTime(frame); ++od)
                STX_CHECK(writeOdFrame(document_.odFrames[od]));
            if (first == frame.commands.size()) continue;
            line("");
            const bool rap = frame.randomAccess && &frame != &document_.frames.front();
            line("{}AT {} {{", rap ? "RAP " : "", frame.time);
            ++depth_;
            for (std::size_t i = first; i < frame.commands.size(); ++i)
                STX_CHECK(writeCommand(frame.commands[i]));
            --depth_;
            line("}}");
        }
        for (; od < document_.odFrames.size(); ++od)
            STX_CHECK(writeOdFrame(document_.odFrames[od]));
        if (!fits_) return propagate(fits_);
        return std::move(out_);
    }

  private:
    // ---- Lines
    void indent() { out_.append(static_cast<std::size_t>(depth_), ' '); }
    template <class... Args>
    void line(fmt::format_string<Args...> format, Args&&... args) {
        const std::size_t before = out_.size();
        indent();
        fmt::format_to(std::back_inserter(out_), format, std::forward<Args>(args)...);
        if (out_.size() == before + static_cast<std::size_t>(depth_)) out_.resize(before);
        out_ += '\n';
    }
    double odTime(std::size_t i) const {
        return static_cast<double>(document_.odFrames[i].time) / document_.odStream.timescale;
    }
    double sceneTime(const CommandFrame& frame) const {
        return static_cast<double>(frame.time) / document_.sceneStream.timescale;
    }

    // ---- Nodes
    void writeNode(const NodePtr& node) {
        if (!node) {
            out_ += "NULL";
            return;
        }
        if (const std::string* defName = scope_.names.find(*node)) {
            if (!scope_.names.firstTime(*node)) {
                out_ += "USE " + *defName;
                return;
            }
            out_ += "DEF " + *defName + ' ';
        }
        out_ += node->info->name;
        const std::map<int, int>& links = linksOf(scope_.links, *node);
        const int own = ownFieldCount(*node);
        if (node->setFields.empty() && links.empty() && own == 0) {
            out_ += " { }";
            return;
        }
        out_ += " {\n";
        ++depth_;
        for (const FieldInfo& field : node->info->fields) {
            const bool isOwn = field.index >= static_cast<int>(node->info->fields.size()) - own;
            const auto link = links.find(field.index);
            if (!isOwn && link == links.end() && !node->isSet(field.index)) continue;
            indent();
            if (isOwn) out_ += fmt::format("{} {} ", name(field.kind), name(field.type));
            out_ += field.name;
            out_ += ' ';
            if (link != links.end())
                out_ += "IS " + scope_.proto->type.fields[link->second].name;
            else if (field.hasValue())
                writeValue(toText(*node->info, field.index, node->value(field.index)));
            out_ += '\n';
        }
        --depth_;
        indent();
        out_ += '}';
    }
    void writeProtos(const std::vector<ProtoPtr>& protos) {
        for (const ProtoPtr& proto : protos) writeProto(*proto);
    }
    void writeProto(const Proto& proto) {
        line("{} {} [", proto.isExtern ? "EXTERNPROTO" : "PROTO", proto.name);
        ++depth_;
        for (const FieldInfo& field : proto.type.fields) {
            indent();
            out_ += fmt::format("{} {} {} ", name(field.kind), name(field.type), field.name);
            if (field.hasValue()) writeValue(defaultValue(proto.type, field.index));
            out_ += '\n';
        }
        --depth_;
        indent();
        if (proto.isExtern) {
            out_ += "] ";
            writeValue(FieldValue(proto.urls));
            out_ += '\n';
            return;
        }
        out_ += "] {\n";
        ++depth_;
        WritingScope outer = std::exchange(scope_, WritingScope::ofBody(proto));
        writeProtos(proto.protos);
        for (const NodePtr& node : proto.body) {
            indent();
            writeNode(node);
            out_ += '\n';
        }
        for (const Route& route : proto.routes) {
            writeRouteStatement(route);
            out_ += '\n';
        }
        scope_ = std::move(outer);
        --depth_;
        line("}}");
    }
    void writeValue(const FieldValue& value) {
        if (const auto* node = std::get_if<NodePtr>(&value)) {
            writeNode(*node);
        } else if (const auto* list = std::get_if<NodeList>(&value)) {
            out_ += '[';
            ++depth_;
            for (const NodePtr& item : *list) {
                out_ += '\n';
                indent();
                writeNode(item);
            }
            --depth_;
            if (!list->empty()) {
                out_ += '\n';
                indent();
            }
            out_ += ']';
        } else if (const auto* buffer = std::get_if<CommandBuffer>(&value)) {
            writeBuffer(*buffer);
        } else {
            appendFieldValue(out_, value, TextStyle::bt);
        }
    }

    void writeBuffer(const CommandBuffer& buffer) {
        const auto commands = commandsToWrite(scope_.names, buffer, bufferDepth_, fits_);
        if (commands.empty()) {
            out_ += "{ }";
            return;
        }
        out_ += "{\n";
        ++depth_;
        ++bufferDepth_;
        WritingScope outer = std::move(scope_);
        scope_ = WritingScope::inside(outer, commands);
        for (const Command& command : commands) {
            std::visit([&](const auto& c) { write(c); }, command);
            out_ += '\n';
        }
        scope_ = std::move(outer);
        --bufferDepth_;
        --depth_;
        indent();
        out_ += '}';
    }

    // ---- Commands
    [[nodiscard]] std::string nameOf(const NodePtr& node) const {
        const std::string* found = node ? scope_.names.find(*node) : nullptr;
        return found ? *found : "NULL";
    }
    [[nodiscard]] std::string fieldOf(const NodePtr& node, int field) const {
        return nameOf(node) + '.' + node->info->fields[field].name;
    }
    static std::string indexText(Position position) {
        return position.index == Position::kLast ? "[LAST]" : fmt::format("[{}]", position.index);
    }
    void writeRouteName(const Route& route) {
        if (const std::string text = scope_.names.define(route); !text.empty())
            out_ += "DEF " + text + ' ';
    }
    void writeRoute(const Route& route) {
        out_ += fieldOf(route.from, route.fromField) + " TO " + fieldOf(route.to, route.toField);
    }
    void writeRouteStatement(const Route& route) {
        indent();
        writeRouteName(route);
        out_ += "ROUTE ";
        writeRoute(route);
    }
    void beginCommand(std::string_view words) {
        indent();
        out_ += words;
    }
    Result<void> writeCommand(const Command& command) {
        std::visit([&](const auto& c) { write(c); }, command);
        out_ += '\n';
        return {};
    }
    void write(const ReplaceScene& c) {
        beginCommand("REPLACE SCENE BY ");
        scope_.names.beginScene();
        if (!c.protos.empty()) {
            out_ += '\n';
            writeProtos(c.protos);
            indent();
        }
        writeNode(c.root);
        for (const Route& route : c.routes) {
            out_ += '\n';
            writeRouteStatement(route);
        }
    }
    void write(const ReplaceNode& c) {
        beginCommand("REPLACE " + nameOf(c.target) + " BY ");
        writeNode(c.replacement);
    }
    void write(const ReplaceField& c) {
        beginCommand("REPLACE " + fieldOf(c.target, c.field) + " BY ");
        writeValue(c.value);
    }
    void write(const ReplaceIndexed& c) {
        beginCommand("REPLACE " + fieldOf(c.target, c.field) + indexText(c.position) + " BY ");
        writeValue(c.value);
    }
    void write(const ReplaceRoute& c) {
        beginCommand("REPLACE ROUTE " + scope_.names.routeOf(c.routeId) + " BY ");
        writeRoute(c.route);
    }
    void writeInsert(const std::string& target, Position position) {
        if (position.index == Position::kLast) {
            beginCommand("APPEND TO " + target + ' ');
        } else {
            beginCommand("INSERT AT " + target + indexText(position) + ' ');
        }
    }
    void write(const InsertNode& c) {
        writeInsert(nameOf(c.target) + ".children", c.position);
        writeNode(c.node);
    }
    void write(const InsertIndexed& c) {
        writeInsert(fieldOf(c.target, c.field), c.position);
        writeValue(c.value);
    }
    void write(const InsertRoute& c) {
        beginCommand("INSERT ROUTE ");
        writeRouteName(c.route);
        writeRoute(c.route);
    }
    void write(const DeleteNode& c) { beginCommand("DELETE " + nameOf(c.target)); }
    void write(const DeleteIndexed& c) {
        beginCommand("DELETE " + fieldOf(c.target, c.field) + indexText(c.position));
    }
    void write(const DeleteRoute& c) {
        beginCommand("DELETE ROUTE " + scope_.names.routeOf(c.routeId));
    }

    // ---- Descriptors
    template <class T>
    void number(std::string_view name, T value, T unless) {
        if (value != unless) line("{} {}", name, static_cast<std::uint64_t>(value));
    }
    template <class Inner>
    void block(std::string_view head, Inner inner, std::string_view open = "{",
               std::string_view close = "}") {
        line("{} {}", head, open);
        ++depth_;
        inner();
        --depth_;
        line("{}", close);
    }
    void writeConfigInfo(const BifsConfig& config) {
        if (config.version == 2) {
            if (config.use3DMeshCoding) line("use3DMeshCoding true");
            if (config.usePredictiveMFField) line("usePredictiveMFField true");
        }
        number("nodeIDbits", config.nodeIdBits, 0);
        number("routeIDbits", config.routeIdBits, 0);
        if (config.version == 2) number("protoIDbits", config.protoIdBits, 0);
        line("isCommandStream {}", config.isCommandStream);
        line("pixelMetric {}", config.pixelMetric);
        if (config.hasSize) {
            line("pixelWidth {}", config.pixelWidth);
            line("pixelHeight {}", config.pixelHeight);
        }
    }
    void writeStream(const ElementaryStream& stream, const BifsConfig* config) {
        block("ES_Descriptor", [&] {
            number("ES_ID", stream.esId, 0u);
            if (stream.dependsOnEsId) line("dependsOn_ES_ID {}", *stream.dependsOnEsId);
            if (stream.ocrEsId) line("OCR_ES_ID {}", *stream.ocrEsId);
            number<int>("streamPriority", stream.streamPriority, 0);
            if (!stream.url.empty()) line("URLstring {}", quotedText(stream.url));
            block("decConfigDescr DecoderConfigDescriptor", [&] {
                number<int>("objectTypeIndication", stream.objectTypeIndication, 0);
                line("streamType {}", static_cast<int>(stream.streamType));
                if (stream.upStream) line("upStream true");
                number("bufferSizeDB", stream.bufferSizeDB, 0u);
                number("maxBitrate", stream.maxBitrate, 0u);
                number("avgBitrate", stream.avgBitrate, 0u);
                if (config) {
                    block(config->version == 2 ? "decSpecificInfo BIFSv2Config"
                                               : "decSpecificInfo BIFSConfig",
                          [&] { writeConfigInfo(*config); });
                } else if (!stream.decoderSpecificInfo.empty()) {
                    block("decSpecificInfo DecoderSpecificInfo",
                          [&] { line("info {}", percentText(stream.decoderSpecificInfo)); });
                }
            });
            if (stream.timescale != 1000) {
                block("slConfigDescr SLConfigDescriptor", [&] {
                    line("useAccessUnitStartFlag true");
                    line("useAccessUnitEndFlag true");
                    line("useTimeStampsFlag true");
                    line("timeStampResolution {}", stream.timescale);
                    line("timeStampLength 32");
                });
            }
            if (!stream.fileName.empty() && !stream.samples.empty()) {
                block("muxInfo MuxInfo", [&] {
                    line("fileName {}", quotedText(stream.fileName));
                    const MuxTimes times = muxTimes(stream);
                    if (times.startMs != 0) line("startTime {}", times.startMs);
                    if (times.frameRate != 0) line("frameRate {}", times.frameRate);
                    if (times.durationMs != 1000 || times.frameRate != 0)
                        line("duration {}", times.durationMs);
                });
            }
        });
    }
    void writeInitialDescriptor() {
        const InitialObjectDescriptor& iod = document_.iod;
        block("InitialObjectDescriptor", [&] {
            line("objectDescriptorID {}", iod.id);
            if (iod.includeInlineProfileLevel) line("includeInlineProfileLevelFlag true");
            if (!iod.url.empty()) line("URLstring {}", quotedText(iod.url));
            line("ODProfileLevelIndication {}", iod.odProfileLevel);
            line("sceneProfileLevelIndication {}", iod.sceneProfileLevel);
            line("audioProfileLevelIndication {}", iod.audioProfileLevel);
            line("visualProfileLevelIndication {}", iod.visualProfileLevel);
            line("graphicsProfileLevelIndication {}", iod.graphicsProfileLevel);
            block(
                "esDescr",
                [&] {
                    writeStream(sceneStreamForText(document_), &document_.bifsConfig);
                    if (hasOdStream(document_)) writeStream(odStreamForText(document_), nullptr);
                },
                "[", "]");
        });
    }
    Result<void> writeOdFrame(const OdFrame& frame) {
        line("");
        const bool rap = frame.randomAccess && &frame != &document_.odFrames.front();
        line("{}AT {} {{", rap ? "RAP " : "", frame.time);
        ++depth_;
        for (const OdCommand& command : frame.commands) {
            if (const auto* update = std::get_if<UpdateObjectDescriptors>(&command)) {
                block(
                    "UPDATE OD",
                    [&] {
                        for (const ObjectDescriptor& od : update->descriptors) writeOd(od);
                    },
                    "[", "]");
            } else if (const auto* remove = std::get_if<RemoveObjectDescriptors>(&command)) {
                line("REMOVE OD [{}]", fmt::join(remove->ids, " "));
            } else {
                return fail(ErrorCode::unsupported,
                            "the object descriptors change single streams or carry IPMP, which the "
                            "text forms here do not have; keep this presentation as .mp4");
            }
        }
        --depth_;
        line("}}");
        return {};
    }
    void writeOd(const ObjectDescriptor& od) {
        block("ObjectDescriptor", [&] {
            line("objectDescriptorID {}", od.id);
            if (!od.url.empty()) line("URLstring {}", quotedText(od.url));
            if (od.streams.empty()) return;
            block(
                "esDescr",
                [&] {
                    for (const ElementaryStream& stream : od.streams) writeStream(stream, nullptr);
                },
                "[", "]");
        });
    }

    const Document& document_;
    WritingScope scope_;
    Result<void> fits_;  ///< the first buffer of commands that has no text
    std::string out_;
    int depth_ = 0;
    int bufferDepth_ = 0;  ///< in how many buffers what is written is
};

}  // namespace

Result<std::string> writeBt(const Document& document, Job& job) {
    STX_TRY(auto names, TextNames::make(document, job.limits));
    return BtWriter(document, std::move(names)).write();
}

}  // namespace stx::mpeg4
