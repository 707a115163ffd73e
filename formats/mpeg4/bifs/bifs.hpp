#pragma once

#include <memory>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "formats/mpeg4/scene/document.hpp"

/// BIFS: the binary form of scenes (ISO/IEC 14496-11, clause 8).
namespace stx::mpeg4 {

/// The decoder config of a BIFS stream from its DecoderSpecificInfo. The version is that of the
/// objectTypeIndication; where the length does not come out, the other version is tried.
[[nodiscard]] Result<BifsConfig> decodeBifsConfig(ByteSpan bytes,
                                                  std::uint8_t objectTypeIndication);
[[nodiscard]] Bytes encodeBifsConfig(const BifsConfig& config);

/// What the commands of a buffer can name: the nodes of the scene, or of the body of a PROTO, that
/// the buffer is in, by their ids, and the PROTOs that it may have instances of.
struct BufferScene {
    std::unordered_map<std::uint32_t, NodePtr> nodes;
    std::vector<ProtoPtr> protos;
};

/// The coding of commands in a stream.
[[nodiscard]] CommandCoding codingOf(const BifsConfig& config, bool useNames);

/// Reads the access units of a scene in their order: later ones name the nodes of earlier ones.
class BifsDecoder {
  public:
    BifsDecoder(BifsConfig config, const Limits& limits);
    ~BifsDecoder();
    BifsDecoder(BifsDecoder&&) noexcept;

    /// The commands of one access unit. Errors (invalidInput, where = "bit N") on anything that the
    /// syntax or the table does not have; (unsupported) on predictive MF coding and on XREPLACE:
    /// begun() then has the commands before it. MULTIPLEREPLACE, MULTIPLEINDREPLACE and XDELETE are
    /// the plain commands that do the same; GLOBALQP is in the values, and nothing without them.
    [[nodiscard]] Result<std::vector<Command>> decode(ByteSpan accessUnit);
    [[nodiscard]] std::vector<Command> begun();
    /// What the last ReplaceScene declares, and what commands declared since (INSERT PROTO).
    [[nodiscard]] const std::vector<ProtoPtr>& protos() const;
    /// The access units that come now are of another stream of the scene, with a config of its own.
    void setConfig(const BifsConfig& config);
    /// How the last access unit is coded.
    [[nodiscard]] CommandCoding coding() const;
    /// Names in Scripts that no program can have, so far; they have others.
    [[nodiscard]] std::size_t renamed() const;
    /// The commands of a buffer, whose nodes are those of `scene` and new ones. Errors as decode().
    [[nodiscard]] static Result<std::vector<Command>> decodeBuffer(const CommandBuffer& buffer,
                                                                   const BufferScene& scene,
                                                                   const Limits& limits);
    /// Bits that the last access unit left after its last command (at most 7 in tidy files).
    [[nodiscard]] std::uint64_t bitsLeft() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Which of the forms that mean the same is written.
struct BifsStyle {
    /// Nodes as masks and MF fields as vectors, every set field written: what strict readers take.
    static BifsStyle maskAndVector() { return {}; }
    /// The choice of the other known encoder: the shorter of mask and list by its own rule, and
    /// only fields that differ from their default.
    static BifsStyle shortest() { return {.shorterOfMaskAndList = true, .omitDefaults = true}; }

    bool shorterOfMaskAndList = false;
    bool omitDefaults = false;
};

/// Writes the access units of one stream in their order, with the ids of assignNodeIds and a config
/// that holds them (fitBifsConfig).
class BifsEncoder {
  public:
    BifsEncoder(BifsConfig config, BifsStyle style, NodeIds ids);
    ~BifsEncoder();
    BifsEncoder(BifsEncoder&&) noexcept;

    /// Errors (invalidInput) when a value has no code: an od id above 1023, an image above 4095
    /// pixels, a node where it may not be, a field without the id that a command needs.
    [[nodiscard]] Result<Bytes> encode(const std::vector<Command>& commands);
    /// The same for a buffer. `brought`: the nodes with ids that come with its commands; all others
    /// are in the scene by the time that it takes effect.
    [[nodiscard]] Result<CommandBuffer> encodeBuffer(const std::vector<Command>& commands,
                                                     const std::unordered_set<const Node*>& brought,
                                                     bool useNames);
    /// By how much a QuantizationParameter has rounded values so far, at most: numbers as they are,
    /// rotations in radians.
    [[nodiscard]] double mostRounded() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// `config` with the id widths raised to what the ids in use need (NULL is all ones).
[[nodiscard]] BifsConfig fitBifsConfig(BifsConfig config, const NodeIds& ids);

}  // namespace stx::mpeg4
