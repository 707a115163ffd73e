#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>

#include "formats/meshes/ply_header.hpp"

namespace stx {

/// The values behind the header, one after the other.
class PlyValues {
  public:
    PlyValues(ByteSpan bytes, std::size_t at, PlyCoding coding)
        : bytes_(bytes), at_(at), coding_(coding) {}

    [[nodiscard]] std::size_t offset() const { return at_; }

    /// False at the end of the file or where text is not a number.
    bool next(PlyType type, double& value) {
        return coding_ == PlyCoding::ascii ? nextText(value) : nextBinary(type, value);
    }

    /// Text has one element a line: blank lines before it do not count, and what its properties
    /// leave of its line is passed over (MeshLab writes values there that its header does not
    /// name). False where nothing follows any more.
    bool beginElement() {
        while (coding_ == PlyCoding::ascii && at_ < bytes_.size() && isBlank(byte())) ++at_;
        return at_ < bytes_.size();
    }
    void endElement() {
        if (coding_ != PlyCoding::ascii) return;
        for (; at_ < bytes_.size() && byte() != '\n' && byte() != '\r'; ++at_)
            leftOver_ = leftOver_ || !isBlank(byte());
    }
    [[nodiscard]] bool atLineEnd() {
        if (coding_ != PlyCoding::ascii) return false;
        while (at_ < bytes_.size() && (byte() == ' ' || byte() == '\t')) ++at_;
        return at_ == bytes_.size() || byte() == '\n' || byte() == '\r';
    }
    [[nodiscard]] bool hasLeftOver() const { return leftOver_; }

  private:
    [[nodiscard]] char byte() const { return static_cast<char>(bytes_[at_]); }
    static bool isBlank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

    bool nextText(double& value) {
        const auto* const begin = reinterpret_cast<const char*>(bytes_.data());
        while (at_ < bytes_.size() && isBlank(begin[at_])) ++at_;
        if (at_ < bytes_.size() && begin[at_] == '+') ++at_;
        const auto [stop, error] = std::from_chars(begin + at_, begin + bytes_.size(), value);
        if (error == std::errc::result_out_of_range)
            value = 0;
        else if (error != std::errc())
            return false;
        at_ = static_cast<std::size_t>(stop - begin);
        return at_ == bytes_.size() || isBlank(begin[at_]);
    }

    template <class T>
    double load() {
        std::array<std::byte, sizeof(T)> raw;
        std::memcpy(raw.data(), bytes_.data() + at_, sizeof(T));
        if ((coding_ == PlyCoding::bigEndian) != (std::endian::native == std::endian::big))
            std::reverse(raw.begin(), raw.end());
        at_ += sizeof(T);
        return static_cast<double>(std::bit_cast<T>(raw));
    }

    bool nextBinary(PlyType type, double& value) {
        if (bytes_.size() - at_ < plySize(type)) return false;
        switch (type) {
            case PlyType::int8:
                value = load<std::int8_t>();
                break;
            case PlyType::uint8:
                value = load<std::uint8_t>();
                break;
            case PlyType::int16:
                value = load<std::int16_t>();
                break;
            case PlyType::uint16:
                value = load<std::uint16_t>();
                break;
            case PlyType::int32:
                value = load<std::int32_t>();
                break;
            case PlyType::uint32:
                value = load<std::uint32_t>();
                break;
            case PlyType::float32:
                value = load<float>();
                break;
            case PlyType::float64:
                value = load<double>();
                break;
        }
        return true;
    }

    ByteSpan bytes_;
    std::size_t at_;
    PlyCoding coding_;
    bool leftOver_ = false;
};

}  // namespace stx
