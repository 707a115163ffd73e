#include "formats/meshes/text_coordinates.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "formats/files/text_encoding.hpp"
#include "lib/geometry/origin.hpp"
#include "lib/model/strays.hpp"

namespace stx {
namespace {

/// A line of the keyword: its place in the world, and what follows the coordinates.
struct CoordinateLine {
    glm::dvec3 position{0.0};
    std::string_view rest;
    bool coloured = false;  ///< the rest is r g b
    double brightest = 0;   ///< of these
};

bool takeNumber(std::string_view& text, double& value) {
    while (!text.empty() && isBlank(text.front())) text.remove_prefix(1);
    if (text.starts_with('+')) text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || !std::isfinite(value)) return false;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return text.empty() || isBlank(text.front());
}

/// `values` is what follows the keyword. OBJ: x y z, x y z w, or x y z r g b.
std::optional<CoordinateLine> parse(std::string_view values) {
    CoordinateLine line;
    values = trimmed(values);
    for (int k = 0; k < 3; ++k) {
        if (!takeNumber(values, line.position[k])) return std::nullopt;
    }
    line.rest = trimmed(values);
    double w = 1;
    if (auto last = line.rest; !last.empty() && takeNumber(last, w) && trimmed(last).empty()) {
        if (!(std::abs(w) > 0)) return std::nullopt;
        line.position /= w;
        line.rest = {};
    }
    double colour[3] = {};
    auto numbers = line.rest;
    line.coloured = std::ranges::all_of(colour, [&](double& c) { return takeNumber(numbers, c); });
    if (line.coloured) line.brightest = *std::ranges::max_element(colour);
    return line;
}

/// Calls visit(line, values): the line with its end, and what follows the keyword if it has it.
/// Stops when visit gives false.
template <class Visit>
bool eachLine(std::string_view text, std::string_view keyword, const Visit& visit) {
    while (!text.empty()) {
        const auto end = text.find('\n');
        const auto line = text.substr(0, end == std::string_view::npos ? end : end + 1);
        text.remove_prefix(line.size());
        auto content = line;
        while (!content.empty() && isBlank(content.front())) content.remove_prefix(1);
        const bool has = content.size() > keyword.size() && content.starts_with(keyword) &&
                         isBlank(content[keyword.size()]);
        if (has) content.remove_prefix(keyword.size());
        if (!visit(line, has ? std::optional(content) : std::nullopt)) return false;
    }
    return true;
}

void append(Bytes& to, std::string_view piece) {
    const auto* first = reinterpret_cast<const std::byte*>(piece.data());
    to.insert(to.end(), first, first + piece.size());
}

bool isDigit(char c) {
    return c >= '0' && c <= '9';
}

}  // namespace

std::optional<Bytes> plainObj(ByteSpan bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    Bytes out;
    std::size_t copied = 0;  // of the text
    const auto replace = [&](std::size_t from, std::size_t to, std::string_view by) {
        append(out, text.substr(copied, from - copied));
        append(out, by);
        copied = to;
    };
    bool continued = false, values = false, elements = false;
    for (std::size_t start = 0, end = 0; start < text.size(); start = end + 1) {
        end = std::min(text.find('\n', start), text.size());
        const auto line = trimmed(text.substr(start, end - start));
        if (!continued) {
            values = line.starts_with('v');
            elements = line.size() > 1 && (line[0] == 'f' || line[0] == 'l' || line[0] == 'p') &&
                       isBlank(line[1]);
        }
        continued = line.ends_with('\\');
        if (!values && !elements) continue;
        // To the line's end: another point, another comment may be far away.
        const auto upTo = text.substr(0, end);
        const auto comment = std::min(upTo.find('#', start), end);
        for (auto at = upTo.find('.', start); at < comment; at = upTo.find('.', at + 1)) {
            const bool first = at == start || isBlank(text[at - 1]);
            if (first && at + 1 < end && isDigit(text[at + 1])) replace(at, at, "0");
        }
        if (comment == end) continue;
        replace(comment, end, "");
        continued = false;
    }
    if (copied == 0) return std::nullopt;
    append(out, text.substr(copied));
    return out;
}

std::optional<PlainText> plainCoordinates(ByteSpan bytes, std::string_view keyword) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    std::vector<glm::dvec3> positions;
    std::size_t coloured = 0;
    double brightest = 0;
    const bool understood = eachLine(text, keyword, [&](auto, const auto& values) {
        if (!values) return true;
        const auto line = parse(*values);
        if (!line) return false;
        positions.push_back(line->position);
        coloured += line->coloured ? 1 : 0;
        brightest = std::max(brightest, line->brightest);
        return true;
    });
    if (!understood) return std::nullopt;
    const auto strays = findStrays(positions.size(), [&](std::uint64_t i) {
        return Piece{positions[i], positions[i]};
    });
    PlainText out;
    out.origin = originFor(strays.bounds);
    const bool mixed = coloured > 0 && coloured < positions.size();
    if (out.origin == glm::dvec3(0.0) && !mixed) return std::nullopt;
    // Colours are 0..1, or 0..255 as linearFromSrgbColours() finds.
    const std::string_view white = brightest > 1 ? "255 255 255" : "1 1 1";
    out.text.reserve(text.size() + positions.size() * 8);
    eachLine(text, keyword, [&](std::string_view line, const auto& values) {
        if (!values) {
            append(out.text, line);
            return true;
        }
        const auto parsed = *parse(*values);
        const glm::vec3 p(parsed.position - out.origin);
        const auto rest = mixed && !parsed.coloured ? white : parsed.rest;
        append(out.text, fmt::format("{} {} {} {} {}\n", keyword, p.x, p.y, p.z, rest));
        return true;
    });
    return out;
}

}  // namespace stx
