#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <pugixml.hpp>

#include "formats/files/files.hpp"

namespace stx::photos {

/// A packet of XMP (ISO 16684-1: RDF in XML). Properties are found by the address of their
/// namespace and their name, whatever prefix the file has for it.
class Xmp {
  public:
    /// Errors (invalidInput): not XML; more elements and attributes than any photo's packet has.
    [[nodiscard]] static Result<Xmp> parse(ByteSpan packet);

    /// The text of a property, an attribute or an element, the first anywhere; nothing where there
    /// is none.
    [[nodiscard]] std::optional<std::string_view> text(std::string_view space,
                                                       std::string_view name) const;
    /// The same as a finite number.
    [[nodiscard]] std::optional<double> number(std::string_view space, std::string_view name) const;
    /// The numbers of a property that is a list (rdf:Seq); empty where it is missing or holds
    /// anything else.
    [[nodiscard]] std::vector<double> numbers(std::string_view space, std::string_view name) const;
    /// All elements of a name, in the packet's order.
    [[nodiscard]] std::vector<pugi::xml_node> all(std::string_view space,
                                                  std::string_view name) const;
    /// The text of a property of one element: its attribute, or its child.
    [[nodiscard]] std::optional<std::string_view> textIn(pugi::xml_node node,
                                                         std::string_view space,
                                                         std::string_view name) const;

  private:
    [[nodiscard]] bool is(const char* qualified, std::string_view space,
                          std::string_view name) const;

    std::unique_ptr<pugi::xml_document> document_;
    std::vector<std::pair<std::string, std::string>> prefixes_;  ///< namespace, prefix
};

}  // namespace stx::photos
