#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/mpeg4/text/scene_text.hpp"
#include "formats/mpeg4/text/text_buffers.hpp"

namespace stx::mpeg4 {

/// What the readers of BT and XMT-A have in common: the names of nodes, the PROTOs around what is
/// read, and the buffers of commands that wait until all nodes have names. The readers derive from
/// it and bring the syntax. `where` is the place in the text that errors name.
class TextReader {
  protected:
    explicit TextReader(Job& job) : job_(job), names_(job.limits) {}

    // ---- PROTOs
    /// An instance of the innermost PROTO of that name. Null: none is declared so far.
    [[nodiscard]] NodePtr makeNamedInstance(std::string_view name) const;

    /// A PROTO without content. Errors when there are too many, they are nested too deeply, or its
    /// name cannot be one.
    [[nodiscard]] Result<std::shared_ptr<Proto>> makeProto(std::string name, int depth,
                                                           const std::string& where);

    /// The fields of a PROTO's interface with the values that an instance has by default.
    struct Interface {
        std::vector<FieldInfo> fields;
        std::shared_ptr<FieldDefaults> defaults = std::make_shared<FieldDefaults>();
    };
    /// Adds a field and its default value. `readValue(holder)` reads the value into field 0 of the
    /// holder; it is left out (null) where the text gives none.
    [[nodiscard]] Result<void> addField(
        Interface& interface, const Proto& proto, const FieldInfo& field, const std::string& where,
        const std::function<Result<void>(const NodePtr&)>& readValue);
    static void setInterface(Proto& proto, Interface interface);

    /// Reads the body of a PROTO by `read`, with names, PROTOs and buffers of its own, and adds the
    /// PROTO to the innermost scope.
    [[nodiscard]] Result<void> readInside(const std::shared_ptr<Proto>& proto,
                                          const std::function<Result<void>()>& read);

    /// IS: links a field of a node to the field `linked` of the PROTO whose body is read.
    [[nodiscard]] Result<void> addLink(const NodePtr& node, int field, std::string_view linked,
                                       const std::string& where);
    [[nodiscard]] bool isLinked(const NodePtr& node, int field) const {
        return linked_.contains({node.get(), field});
    }

    /// Adds a declared field to a Script; gives its index.
    [[nodiscard]] Result<int> addOwnField(Node& script, const FieldInfo& field,
                                          const std::string& where) const;

    /// RouteNames::idOf(); in a buffer only routes that have a number can be reached.
    [[nodiscard]] Result<std::uint32_t> routeId(const std::string& name, const std::string& where);

    // ---- Buffers of commands
    /// Remembers a buffer until readBuffers(): `read` then adds its commands to document_.frames.
    [[nodiscard]] Result<void> addBuffer(std::size_t number, const std::string& where,
                                         std::function<Result<void>()> read);
    /// Reads the commands of the buffers that were added so far.
    [[nodiscard]] Result<void> readBuffers();

    Job& job_;
    NodeNames names_;
    RouteNames routes_;
    Document document_;
    TextBuffers buffers_;
    std::vector<std::vector<ProtoPtr>> protoScopes_ = std::vector<std::vector<ProtoPtr>>(1);
    Proto* proto_ = nullptr;  ///< whose body is read
    int bufferDepth_ = 0;     ///< in how many buffers the commands that are read are
    bool inCommand_ = false;

  private:
    struct WaitingBuffer {
        std::size_t number;
        std::function<Result<void>()> read;
    };

    std::set<std::pair<const Node*, int>> linked_;  ///< fields with an IS
    std::size_t protoCount_ = 0;
    std::vector<WaitingBuffer> waiting_;
};

}  // namespace stx::mpeg4
