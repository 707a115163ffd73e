#include "formats/meshes/scene_claims.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/meshes/fbx_records.hpp"
#include "formats/meshes/stl_colours.hpp"

namespace stx {
namespace {

Result<void> tooDeep(const Limits& limits) {
    return fail(ErrorCode::invalidInput,
                "the file's elements are nested deeper than {}; no model is", limits.maxNesting);
}

/// What the records of a binary FBX file claim.
class FbxClaims {
  public:
    FbxClaims(ByteSpan bytes, const Limits& limits) : bytes_(bytes), limits_(limits) {}

    Result<void> check() {
        return eachFbxRecord(bytes_, [this](const FbxRecord& record) -> Result<void> {
            STX_CHECK(checkArrays(record.properties, record.count, record.end));
            if (record.opens && record.depth + 2 > static_cast<std::size_t>(limits_.maxNesting))
                return tooDeep(limits_);
            return {};
        });
    }

  private:
    /// Adds up what the arrays among the properties of a record take.
    Result<void> checkArrays(std::uint64_t at, std::uint64_t count, std::uint64_t end) {
        for (std::uint64_t i = 0; i < count && at < end; ++i) {
            const auto type = static_cast<char>(bytes_[at++]);
            const std::string_view single = "YCBIFDL";
            constexpr std::uint64_t kSizes[] = {2, 1, 1, 4, 4, 8, 8};
            if (const auto k = single.find(type); k != std::string_view::npos) {
                at += kSizes[k];
                continue;
            }
            const auto length = numberAt<std::uint32_t>(bytes_, at);
            if (!length) return {};
            if (type == 'S' || type == 'R') {
                at += 4 + *length;
                continue;
            }
            const auto packed = numberAt<std::uint32_t>(bytes_, at + 8);
            if (!packed || std::string_view("fdlibc").find(type) == std::string_view::npos)
                return {};
            const std::uint64_t each = type == 'd' || type == 'l'   ? 8
                                       : type == 'b' || type == 'c' ? 1
                                                                    : 4;
            claimed_ += std::uint64_t{*length} * each;
            STX_CHECK(limits_.checkAllocation(claimed_, 2, "the arrays of the FBX file"));
            at += 12 + *packed;
        }
        return {};
    }

    ByteSpan bytes_;
    const Limits& limits_;
    std::uint64_t claimed_ = 0;
};

}  // namespace

Result<void> checkColladaClaims(ByteSpan bytes, const Limits& limits) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    int depth = 0;
    for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at)) {
        const auto rest = text.substr(at);
        if (rest.starts_with("<!--")) {
            at = text.find("-->", at);
        } else if (rest.starts_with("<![CDATA[")) {
            at = text.find("]]>", at);
        } else {
            const auto end = text.find('>', at);
            if (end == std::string_view::npos) return {};
            const bool closes = rest.starts_with("</"), aside = rest[1] == '?' || rest[1] == '!';
            if (closes)
                --depth;
            else if (!aside && text[end - 1] != '/' && ++depth > limits.maxNesting)
                return tooDeep(limits);
            at = end;
        }
        if (at == std::string_view::npos) return {};
    }
    return {};
}

Result<void> checkFbxClaims(ByteSpan bytes, const Limits& limits) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (text.starts_with("Kaydara FBX Binary")) return FbxClaims(bytes, limits).check();
    int depth = 0;
    for (const char c : text) {
        if (c == '{' && ++depth > limits.maxNesting) return tooDeep(limits);
        if (c == '}') --depth;
    }
    return {};
}

Result<void> checkStlEnd(ByteSpan bytes) {
    constexpr std::size_t kTail = 4096;  // a name behind the word is no longer
    const auto text = [&](std::size_t from, std::size_t size) {
        std::string part(reinterpret_cast<const char*>(bytes.data()) + from, size);
        for (char& c : part) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
        return part;
    };
    const std::string head = text(0, std::min(bytes.size(), kTail));
    // Binary files may begin with the word, too.
    if (facetsOfBinaryStl(bytes) || head.find("solid") == std::string::npos ||
        head.find("facet") == std::string::npos)
        return {};
    const std::size_t size = std::min(bytes.size(), kTail);
    const std::string tail = text(bytes.size() - size, size);
    const auto end = tail.rfind("endsolid"), facet = tail.rfind("facet");
    if (end != std::string::npos && (facet == std::string::npos || facet < end)) return {};
    return fail(ErrorCode::invalidInput,
                "the STL ends without 'endsolid' at byte {}; it is cut off", bytes.size());
}

}  // namespace stx
