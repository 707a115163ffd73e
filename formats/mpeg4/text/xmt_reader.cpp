#include "formats/mpeg4/text/xmt_reader.hpp"

#include "formats/mpeg4/text/xml_encoding.hpp"

namespace stx::mpeg4 {

namespace {

/// Elements that hold commands of one time.
bool isTimed(std::string_view type) {
    return type == "par" || type == "seq";
}
bool isSceneCommand(std::string_view type) {
    return type == "Replace" || type == "Insert" || type == "Delete";
}

/// The attributes of an element of the body. atES_ID names a stream: those of a scene are one here.
std::vector<std::string_view> commandAttributes(std::string_view type, bool inBuffer) {
    std::vector<std::string_view> names;
    // What is in a buffer acts when the buffer is played.
    if (!inBuffer) names = {"begin", "isRAP", "atES_ID"};
    if (isSceneCommand(type))
        names.insert(names.end(), {"atNode", "atField", "atRoute", "position", "value"});
    if (type == "ObjectDescriptorRemove") names.emplace_back("objectDescriptorID");
    return names;
}

}  // namespace

Result<void> XmtReader::checkCommandAttributes(xml_node node) const {
    const auto known = commandAttributes(localName(node), bufferDepth_ > 0);
    for (const auto attribute : node.attributes()) {
        const std::string_view own = attribute.name();
        if (own == "xmlns" || own.find(':') != std::string_view::npos) continue;
        const bool isKnown = std::ranges::any_of(known, [&](std::string_view one) {
            // Some write objectDescriptorId.
            return own == one || (one == "objectDescriptorID" && equalNoCase(own, one));
        });
        if (!isKnown)
            return failAt(where(node), ErrorCode::invalidInput,
                          "<{}> has no attribute '{}'; it has {}", localName(node), excerpt(own),
                          fmt::join(known, ", "));
    }
    return {};
}

Result<double> XmtReader::timeOf(xml_node node, double seconds) const {
    const auto attribute = node.attribute("begin");
    if (attribute.empty()) return seconds;
    const auto begin = doubleFromText(attribute.value());
    // A command that has a time of its own does not count from its par (as GPAC reads it).
    const double from = isTimed(localName(node)) ? seconds : 0;
    if (!begin || !(*begin >= 0) || *begin > 1e9 || from + *begin > 1e9)
        return failAt(where(node), ErrorCode::invalidInput,
                      "begin is '{}', expected a time of 0 or more seconds",
                      excerpt(attribute.value()));
    return from + *begin;
}

Result<void> XmtReader::readCommands(xml_node parent, double seconds, int depth) {
    STX_CHECK(checkDepth(parent, depth));
    for (const xml_node node : elements(parent)) {
        const std::string_view type = localName(node);
        if (bufferDepth_ > 0 && !isSceneCommand(type))
            return unexpectedElement(node, "Replace, Insert or Delete in a buffer");
        if (!isTimed(type) && !isSceneCommand(type) && type != "ObjectDescriptorUpdate" &&
            type != "ObjectDescriptorRemove")
            return unexpectedElement(node,
                                     "Replace, Insert, Delete, ObjectDescriptorUpdate, "
                                     "ObjectDescriptorRemove or par");
        STX_CHECK(checkCommandAttributes(node));
        STX_TRY(const double begin, timeOf(node, seconds));
        const auto ticks = [&](std::uint32_t timescale) {
            return static_cast<std::uint64_t>(std::llround(begin * timescale));
        };
        const std::uint64_t sceneTime = ticks(document_.sceneStream.timescale);
        const std::uint64_t odTime = ticks(document_.odStream.timescale);
        const bool begins = equalNoCase(node.attribute("isRAP").as_string(), "yes");
        const std::size_t sceneBefore = begins ? commandsAt(document_.frames, sceneTime) : 0;
        const std::size_t odBefore = begins ? commandsAt(document_.odFrames, odTime) : 0;
        if (isTimed(type)) {
            STX_CHECK(readCommands(node, begin, depth + 1));
        } else if (type == "ObjectDescriptorUpdate") {
            STX_CHECK(readOdUpdate(node, odTime));
        } else if (type == "ObjectDescriptorRemove") {
            STX_CHECK(readOdRemove(node, odTime));
        } else {
            inCommand_ = !document_.frames.empty();
            STX_CHECK(readCommand(node, type, sceneTime));
        }
        if (!begins) continue;
        if (commandsAt(document_.frames, sceneTime) > sceneBefore)
            markRandomAccess(document_.frames, sceneTime);
        if (commandsAt(document_.odFrames, odTime) > odBefore)
            markRandomAccess(document_.odFrames, odTime);
    }
    return {};
}

Result<std::optional<Position>> XmtReader::positionOf(xml_node node, std::string_view text) const {
    if (equalNoCase(text, "END") || equalNoCase(text, "LAST")) return std::optional(Position());
    if (equalNoCase(text, "BEGIN") || equalNoCase(text, "FIRST")) return std::optional(Position{0});
    const auto number = integerFromText(text);
    if (!number || *number < 0 || *number > 65535)
        return failAt(where(node), ErrorCode::invalidInput,
                      "position is '{}', expected BEGIN, END or 0 to 65535", excerpt(text));
    return std::optional(Position{static_cast<int>(*number)});
}

Result<FieldValue> XmtReader::commandValue(xml_node node, const Node& target, int field,
                                           bool item) {
    const FieldInfo& info = target.info->fields[field];
    const FieldType type = item ? itemType(info.type) : info.type;
    if (type == FieldType::SFNode || type == FieldType::MFNode) {
        NodeList list;
        for (const xml_node child : elements(node)) {
            int height = 0;
            STX_TRY(auto made, readNode(child, 1, height, nullptr, -1, -1));
            STX_CHECK(checkNodePlace(made.get(), info.nodeType, target.info->name, info.name,
                                     where(child)));
            list.push_back(std::move(made));
        }
        if (type == FieldType::MFNode) return FieldValue(std::move(list));
        if (list.size() > 1)
            return failAt(where(node), ErrorCode::invalidInput, "{} takes one node, found {}",
                          info.name, list.size());
        return FieldValue(list.empty() ? NodePtr() : std::move(list[0]));
    }
    const auto inner = elements(node);
    if (type == FieldType::SFCommandBuffer && !inner.empty()) {
        FieldValue placeholder = buffers_.addValue(proto_);
        STX_CHECK(passBuffer(inner[0], buffers_.last()));
        return placeholder;
    }
    return attributeValue(node, "value", node.attribute("value").value(), type);
}

Result<void> XmtReader::collectIds(xml_node root) {
    struct IdCollector : pugi::xml_tree_walker {
        std::vector<xml_node> found;
        bool for_each(xml_node& node) override {
            const auto type = localName(node);
            if (type == "ObjectDescriptor" || type == "InitialObjectDescriptor" ||
                type == "ES_Descriptor")
                found.push_back(node);
            return true;
        }
    } walker;
    root.traverse(walker);
    for (const xml_node node : walker.found) {
        TextDescriptor flat;
        flat.type = localName(node);
        for (const auto attribute : node.attributes())
            flat.fields.push_back({attribute.name(), attribute.value(), {}});
        collectTextIds(flat, odIds_, esIds_);
    }
    return {};
}

Result<Document> readXmt(std::string_view text, const std::string& name, Job& job) {
    if (auto ok = job.limits.checkAllocation(text.size(), 2, "the text"); !ok)
        return tl::unexpected(ok.error().at(fmt::format("'{}'", name)));
    STX_TRY(const auto utf8, utf8FromXml(text, name));
    return XmtReader(utf8 ? *utf8 : text, name, job).read();
}

}  // namespace stx::mpeg4
