#include "formats/mpeg4/text/xmt_reader.hpp"

#include "formats/mpeg4/text/xml_encoding.hpp"

namespace stx::mpeg4 {

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
