#include "formats/meshes/fbx_elements.hpp"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>
#include <vector>

namespace stx {
namespace {

using FbxVisit = std::function<void(const FbxElement&)>;

constexpr std::size_t kMostValues = 8;
constexpr std::size_t kMostNesting = 64;  ///< what is read is never in more than four
constexpr std::string_view kBlanks = " \t\r";

class TextElements {
  public:
    TextElements(std::string_view text, const FbxVisit& visit) : text_(text), visit_(visit) {}

    void read() {
        while (at_ < text_.size()) {
            const char c = text_[at_];
            if (c == '}') {
                if (!inside_.empty()) inside_.pop_back();
                ++at_;
            } else if (c == ';') {
                at_ = std::min(text_.find('\n', at_), text_.size());
            } else if (c == '\n' || c == '{' || kBlanks.find(c) != std::string_view::npos) {
                ++at_;
            } else if (!readElement()) {
                return;
            }
        }
    }

  private:
    bool readElement() {
        const auto colon = text_.find_first_of(":\n{}", at_);
        if (colon == std::string_view::npos) return false;
        if (text_[colon] != ':') {
            at_ = colon + (text_[colon] == '\n' ? 1 : 0);
            return true;
        }
        const auto name = text_.substr(at_, colon - at_);
        at_ = colon + 1;
        readValues();
        visit_({name, values_, inside_});
        if (at_ < text_.size() && text_[at_] == '{') {
            if (inside_.size() == kMostNesting) return false;
            inside_.push_back(name);
            ++at_;
        }
        return true;
    }

    /// Up to the end of the line, or to a brace. A line that ends in a comma goes on.
    void readValues() {
        values_.clear();
        bool goesOn = false;
        while (at_ < text_.size()) {
            const char c = text_[at_];
            if (c == '{' || c == '}' || (c == '\n' && !goesOn)) return;
            if (c == ',' || c == '\n' || kBlanks.find(c) != std::string_view::npos) {
                goesOn = goesOn || c == ',';
                ++at_;
                continue;
            }
            goesOn = false;
            FbxValue value;
            if (c == '"') {
                const auto end = std::min(text_.find('"', at_ + 1), text_.size());
                value.text = text_.substr(at_ + 1, end - at_ - 1);
                at_ = std::min(end + 1, text_.size());
            } else {
                const auto end = std::min(text_.find_first_of(", \t\r\n{}", at_), text_.size());
                const auto* first = text_.data() + at_;
                const auto* last = text_.data() + end;
                if (values_.size() < kMostValues) {
                    std::from_chars(first, last, value.integer);
                    std::from_chars(first, last, value.number);
                }
                at_ = end;
            }
            if (values_.size() < kMostValues) values_.push_back(value);
        }
    }

    std::string_view text_;
    const FbxVisit& visit_;
    std::size_t at_ = 0;
    std::vector<std::string_view> inside_;
    std::vector<FbxValue> values_;
};

/// Records as those of FbxRecords (scene_claims.cpp), which has looked at their nesting before.
class BinaryElements {
  public:
    BinaryElements(ByteSpan bytes, const FbxVisit& visit) : bytes_(bytes), visit_(visit) {
        field_ = number<std::uint32_t>(23).value_or(0) >= 7500 ? 8 : 4;
    }

    void read() {
        std::vector<std::uint64_t> ends = {bytes_.size()};
        std::uint64_t at = 27;
        while (!ends.empty()) {
            const auto end = at < ends.back() ? field(at) : std::nullopt;
            if (!end || *end == 0) {
                at = ends.back();
                ends.pop_back();
                if (!inside_.empty()) inside_.pop_back();
                continue;
            }
            const auto count = field(at + field_), length = field(at + 2 * field_);
            const auto nameLength = number<std::uint8_t>(at + 3 * field_);
            if (!count || !length || !nameLength || *end <= at || *end > bytes_.size()) return;
            const auto properties = at + 3 * field_ + 1 + *nameLength;
            if (properties > *end || *length > *end - properties) return;
            const auto name = text(properties - *nameLength, *nameLength);
            readValues(properties, *count, *end);
            visit_({name, values_, inside_});
            at = properties + *length;
            if (at >= *end) continue;
            if (ends.size() == kMostNesting) return;
            ends.push_back(*end);
            inside_.push_back(name);
        }
    }

  private:
    template <class T>
    [[nodiscard]] std::optional<T> number(std::uint64_t at) const {
        if (at > bytes_.size() || sizeof(T) > bytes_.size() - at) return std::nullopt;
        T value{};
        std::memcpy(&value, bytes_.data() + at, sizeof(T));
        return value;
    }
    [[nodiscard]] std::optional<std::uint64_t> field(std::uint64_t at) const {
        if (field_ == 8) return number<std::uint64_t>(at);
        return number<std::uint32_t>(at);
    }
    [[nodiscard]] std::string_view text(std::uint64_t at, std::uint64_t size) const {
        return {reinterpret_cast<const char*>(bytes_.data()) + at, size};
    }

    template <class T>
    void addNumber(std::uint64_t& at) {
        const T value = number<T>(at).value_or(T{});
        at += sizeof(T);
        if constexpr (std::is_integral_v<T>)
            values_.push_back({{}, static_cast<std::int64_t>(value), static_cast<double>(value)});
        else
            values_.push_back({{}, 0, static_cast<double>(value)});
    }

    void readValues(std::uint64_t at, std::uint64_t count, std::uint64_t end) {
        values_.clear();
        while (count-- > 0 && at < end && values_.size() < kMostValues) {
            const auto type = static_cast<char>(bytes_[at++]);
            if (type == 'Y') {
                addNumber<std::int16_t>(at);
            } else if (type == 'C' || type == 'B') {
                addNumber<std::int8_t>(at);
            } else if (type == 'I') {
                addNumber<std::int32_t>(at);
            } else if (type == 'L') {
                addNumber<std::int64_t>(at);
            } else if (type == 'F') {
                addNumber<float>(at);
            } else if (type == 'D') {
                addNumber<double>(at);
            } else if (type == 'S' || type == 'R') {
                const auto size = number<std::uint32_t>(at);
                at += 4;
                if (!size || at > end || *size > end - at) return;
                values_.push_back({text(at, *size), 0, 0});
                at += *size;
            } else {
                return;
            }
        }
    }

    ByteSpan bytes_;
    const FbxVisit& visit_;
    std::uint64_t field_ = 4;  ///< bytes of a number: 8 from version 7.5 on
    std::vector<std::string_view> inside_;
    std::vector<FbxValue> values_;
};

}  // namespace

void eachFbxElement(ByteSpan bytes, const FbxVisit& visit) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (text.starts_with("Kaydara FBX Binary"))
        BinaryElements(bytes, visit).read();
    else
        TextElements(text, visit).read();
}

}  // namespace stx
