#include "formats/meshes/fbx_elements.hpp"

#include <algorithm>
#include <charconv>
#include <vector>

#include "formats/files/text_encoding.hpp"
#include "formats/meshes/fbx_records.hpp"

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

/// Of a file of which scene_claims has looked at the nesting.
class BinaryElements {
  public:
    BinaryElements(ByteSpan bytes, const FbxVisit& visit) : bytes_(bytes), visit_(visit) {}

    void read() {
        (void)eachFbxRecord(bytes_, [this](const FbxRecord& record) -> Result<void> {
            inside_.resize(record.depth);
            readValues(record.properties, record.count, record.end);
            visit_({record.name, values_, inside_});
            if (record.opens) inside_.push_back(record.name);
            return {};
        });
    }

  private:
    template <class T>
    void addNumber(std::uint64_t& at) {
        const T value = numberAt<T>(bytes_, at).value_or(T{});
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
                const auto size = numberAt<std::uint32_t>(bytes_, at);
                at += 4;
                if (!size || at > end || *size > end - at) return;
                values_.push_back({textOf(bytes_).substr(at, *size), 0, 0});
                at += *size;
            } else {
                return;
            }
        }
    }

    ByteSpan bytes_;
    const FbxVisit& visit_;
    std::vector<std::string_view> inside_;
    std::vector<FbxValue> values_;
};

}  // namespace

void eachFbxElement(ByteSpan bytes, const FbxVisit& visit) {
    const std::string_view text = textOf(bytes);
    if (text.starts_with("Kaydara FBX Binary"))
        BinaryElements(bytes, visit).read();
    else
        TextElements(text, visit).read();
}

}  // namespace stx
