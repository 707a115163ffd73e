#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "formats/mpeg4/scene/document.hpp"
#include "lib/base/job.hpp"

/// Object descriptors in the text forms. BT and XMT-A spell them differently but say the same; both
/// readers make a TextDescriptor of what they see, which is then understood in one place.
namespace stx::mpeg4 {

/// A descriptor as a text has it: its type, its scalar fields and the descriptors in it.
/// XMT-A elements that only group (`Descr`, `Profiles`, `custom`, `size`, ...) are flattened away.
struct TextDescriptor {
    struct Field {
        std::string name;
        std::string value;
        std::string where;
    };
    std::string type;
    std::string where;
    std::vector<Field> fields;
    std::vector<TextDescriptor> children;

    /// The first field of one of these names, in any case of letters; null when there is none.
    [[nodiscard]] const Field* find(std::initializer_list<std::string_view> names) const;
    [[nodiscard]] const TextDescriptor* child(std::initializer_list<std::string_view> types) const;
};

/// Numbers behind the string ids of XMT-A (`objectDescriptorID="od10" binaryID="7"`).
using TextIds = std::map<std::string, std::uint32_t, std::less<>>;

/// The types that readers keep as descriptors of their own.
[[nodiscard]] bool isDescriptorType(std::string_view type);

/// Adds the string ids of a descriptor and all in it.
void collectTextIds(const TextDescriptor& descriptor, TextIds& odIds, TextIds& esIds);

/// Streams with a file name get their samples, with times but without bytes; loadMedia()
/// (mpeg4.hpp) brings those. Errors name the place of a value that makes no sense. Fields without a
/// place in the document are passed over.
[[nodiscard]] Result<ElementaryStream> streamFromText(const TextDescriptor& descriptor,
                                                      const TextIds& esIds);
[[nodiscard]] Result<ObjectDescriptor> objectDescriptorFromText(const TextDescriptor& descriptor,
                                                                const TextIds& odIds,
                                                                const TextIds& esIds);
/// The IOD with the scene's and the OD stream, and the BIFS config.
[[nodiscard]] Result<void> initialDescriptorFromText(const TextDescriptor& descriptor,
                                                     const TextIds& odIds, const TextIds& esIds,
                                                     Document& document, Job& job);

/// `%00%14`, and back; nothing when it is not such a text.
[[nodiscard]] std::string percentText(ByteSpan bytes);
[[nodiscard]] std::optional<Bytes> bytesFromPercentText(std::string_view text);

/// The number in the text of an objectDescriptorID or ES_ID: a number, or a string id.
[[nodiscard]] std::optional<std::uint32_t> numberOfTextId(std::string_view text,
                                                          const TextIds& ids);

/// What MuxInfo says of the times of a stream's samples.
struct MuxTimes {
    double startMs = 0;
    double durationMs = 1000;  ///< of all samples together
    double frameRate = 0;      ///< samples a second; 0: one sample
};
[[nodiscard]] MuxTimes muxTimes(const ElementaryStream& stream);

/// The descriptors of the scene's and the OD stream as texts name them: with an ES_ID and types
/// even where the document leaves them to the writer.
[[nodiscard]] ElementaryStream sceneStreamForText(const Document& document);
[[nodiscard]] ElementaryStream odStreamForText(const Document& document);
[[nodiscard]] bool hasOdStream(const Document& document);

/// The names of the files of a stream's samples: one name, or a `%04d` pattern with a number each.
/// Empty where the name has another % in it.
[[nodiscard]] std::vector<std::string> sampleFileNames(const ElementaryStream& stream);

}  // namespace stx::mpeg4
