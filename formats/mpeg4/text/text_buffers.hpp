#pragma once

#include <vector>

#include "formats/mpeg4/bifs/bifs.hpp"
#include "formats/mpeg4/text/text_fields.hpp"

namespace stx::mpeg4 {

/// Buffers hold buffers no deeper than this.
inline constexpr int kMaxBufferNesting = 4;

/// The commands of buffers (SFCommandBuffer) that a text has, until all of it is read: only then
/// all nodes have the ids with which the commands are coded.
class TextBuffers {
  public:
    /// Makes room for the commands of a buffer in the body of `proto` (null: in the scene). They
    /// become a field of `node`.
    [[nodiscard]] std::size_t add(NodePtr node, int field, const Proto* proto);
    /// The same for a buffer that is the value of a command: this value keeps its place until
    /// encode().
    [[nodiscard]] FieldValue addValue(const Proto* proto);
    /// The number of a buffer that addValue() gave.
    [[nodiscard]] std::size_t last() const { return buffers_.size() - 1; }

    /// The commands of a buffer, and the nodes with names that come with them.
    void put(std::size_t number, std::vector<Command> commands, const NodeNames& names);

    /// Gives all nodes of the document their ids and codes the commands with them. Errors when they
    /// have no code.
    [[nodiscard]] Result<void> encode(Document& document);

  private:
    struct Buffer {
        NodePtr node;
        int field = 0;
        const Proto* proto = nullptr;
        std::vector<Command> commands;
        std::vector<NodePtr> brought;
        CommandBuffer coded;
    };
    /// Puts the coded buffers in the places that values of addValue() keep.
    void fill(std::vector<Command>& commands) const;

    std::vector<Buffer> buffers_;
};

}  // namespace stx::mpeg4
