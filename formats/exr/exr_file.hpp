#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <glm/glm.hpp>

#include "formats/files/files.hpp"
#include "lib/base/job.hpp"

/// Parts, channels and attributes of OpenEXR files, without what they mean; no header of OpenEXR is
/// needed to use this.
namespace stx {

struct ExrChannel {
    enum class Type { half, float32, uint32 };
    std::string name;  ///< "R", "N.X", ...
    Type type = Type::float32;
    int xSampling = 1, ySampling = 1;  ///< a value for every n-th pixel; read only

    bool operator==(const ExrChannel&) const = default;
};

/// The kinds of attributes we use: int, double (and float), string, v2f/v2d, v3f/v3d and m44f/m44d.
/// Matrices are in glm's sense (m * column vector); in the file they are OpenEXR's, for row
/// vectors, with the shift in the last row.
using ExrAttribute =
    std::variant<std::int64_t, double, std::string, glm::dvec2, glm::dvec3, glm::dmat4>;

/// The header of one part.
struct ExrPart {
    std::string name;              ///< empty in single-part files
    std::string view;              ///< the standard attribute `view`, of stereo files; empty = none
    int originX = 0, originY = 0;  ///< the data window, relative to the display window
    int width = 0, height = 0;     ///< the data window, pixels
    int displayWidth = 0, displayHeight = 0;
    double pixelAspectRatio = 1.0;
    glm::dvec2 screenWindowCenter{0.0};
    double screenWindowWidth = 1.0;
    std::vector<ExrChannel> channels;
    std::map<std::string, ExrAttribute, std::less<>> attributes;
    /// The standard attribute `envmap`: the picture is all of what is seen around a point.
    enum class Envmap { none, latlong, cube };
    Envmap envmap = Envmap::none;
    bool deep = false;  ///< deep pixels cannot be read
    /// Where chromaticities are there and not those of Rec. 709: what R, G, B are multiplied with
    /// to be of these (rec709From()); read only.
    std::optional<glm::dmat3> rec709FromRgb;
    std::string primariesNote;  ///< what readers do about such chromaticities; read only
    std::string compression;    ///< "zip", "piz", ...; read only
    int zipLevel = 4;           ///< 1 (fast) to 12, see compressZlib(); written only
    std::uint64_t bytes = 0;    ///< pixels as they lie in the file; read only, 0 = not known

    [[nodiscard]] const ExrChannel* channel(std::string_view name) const;
    /// The attribute when it is there and of that kind.
    template <class T>
    [[nodiscard]] const T* attribute(std::string_view attributeName) const {
        const auto it = attributes.find(attributeName);
        return it == attributes.end() ? nullptr : std::get_if<T>(&it->second);
    }
};

/// Where values of one channel come from or go to: pixel (x, y) of the data window is
/// values[(y * width + x) * stride].
struct ExrPixels {
    std::string channel;
    float* values = nullptr;
    std::size_t stride = 1;  ///< floats
};
struct ExrConstPixels {
    std::string channel;
    const float* values = nullptr;
    std::size_t stride = 1;  ///< floats
    /// Of channels of type half, in place of values: pixel (x, y) is halves[y * width + x].
    const std::uint16_t* halves = nullptr;
};

/// An OpenEXR file that is being read. Headers are read at once, in milliseconds, pixels on
/// request.
class ExrReader {
  public:
    /// `bytes` must outlive the reader. `name` is for messages. Errors (invalidInput) of anything
    /// that is not an OpenEXR file, has more parts than limits.maxViews or windows beyond the
    /// limits.
    [[nodiscard]] static Result<ExrReader> open(ByteSpan bytes, std::string_view name,
                                                const Limits& limits);
    /// Reads no more of the file than is needed.
    [[nodiscard]] static Result<ExrReader> open(const std::filesystem::path& path,
                                                const Limits& limits);
    ExrReader(ExrReader&&) noexcept;
    ExrReader& operator=(ExrReader&&) noexcept;
    ~ExrReader();

    [[nodiscard]] const std::vector<ExrPart>& parts() const;
    /// The quoted name for messages.
    [[nodiscard]] const std::string& where() const;
    /// Errors when the part claims more pixels than its bytes can hold; asked before memory is
    /// taken.
    [[nodiscard]] Result<void> checkPlausible(int part) const;
    /// Decodes channels of a part as floats (16-bit and integer values exactly as far as floats
    /// go). A channel that the part has not is filled with zeros. Several parts may be read at
    /// once, from several threads. Errors: invalidInput (also of a file that changed since it was
    /// opened), unsupported (deep, subsampled).
    [[nodiscard]] Result<void> readPart(int part, const std::vector<ExrPixels>& pixels) const;
    /// The same a few rows at a time, for images that are made of what is read: `place(y, rows)`
    /// says where the values of `rows` rows from `y` on go, and `take(y, rows)` is called when they
    /// are there.
    using Place = std::function<std::vector<ExrPixels>(int y, int rows)>;
    using Take = std::function<void(int y, int rows)>;
    [[nodiscard]] Result<void> readPart(int part, const Place& place, const Take& take) const;

  private:
    struct Impl;
    explicit ExrReader(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// An OpenEXR file that is being written: zip compression, scan lines, Rec. 709 chromaticities, no
/// date. One part gives a single-part file. The same input gives the same bytes.
class ExrWriter {
  public:
    /// Writes the headers. All parts must have the same display window (OpenEXR's rule).
    [[nodiscard]] static Result<ExrWriter> create(OutputFile& file,
                                                  const std::vector<ExrPart>& parts);
    ExrWriter(ExrWriter&&) noexcept;
    ExrWriter& operator=(ExrWriter&&) noexcept;
    ~ExrWriter();

    /// All channels of the next part. Channels of type half are rounded to nearest.
    [[nodiscard]] Result<void> writePart(int part, const std::vector<ExrConstPixels>& pixels);
    /// The same for images that are made while they are written: `block(y, rows)` gives the values
    /// of `rows` rows from `y` on, which must live until it is called again.
    using Block = std::function<std::vector<ExrConstPixels>(int y, int rows)>;
    [[nodiscard]] Result<void> writePart(int part, const Block& block);
    /// After the last part; then OutputFile::commit() is the caller's.
    [[nodiscard]] Result<void> finish();
    /// The same, with values of attributes that were not known at create(): the parts as they were
    /// then but for numbers (int, double, vectors, matrices), whose size in the file is fixed.
    [[nodiscard]] Result<void> finish(const std::vector<ExrPart>& parts);

  private:
    struct Impl;
    explicit ExrWriter(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// Walks the headers and errors (invalidInput) when an attribute's size is not what its type takes
/// or what the file has: OpenEXR would lose its place, take other bytes for a size, and allocate
/// that. Needs no library.
[[nodiscard]] Result<void> checkExrHeaders(
    const std::function<bool(std::uint64_t offset, void* to, std::size_t size)>& readAt,
    std::uint64_t fileSize);

/// The chunks of one part, by the table of offsets.
struct ExrChunks {
    std::vector<std::uint64_t> offsets;  ///< in the file, each below its size
    std::uint64_t bytes = 0;             ///< of all of them
};

/// The chunks of each part; empty when they cannot be found. Part of ExrReader, by itself because
/// it needs no library.
[[nodiscard]] std::vector<ExrChunks> exrChunksOfParts(
    const std::function<bool(std::uint64_t offset, void* to, std::size_t size)>& readAt,
    std::uint64_t fileSize);

}  // namespace stx
