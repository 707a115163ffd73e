#include "formats/meshes/text_coordinates.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <vector>

#include "formats/files/text_encoding.hpp"
#include "formats/meshes/vertex_colours.hpp"
#include "lib/geometry/origin.hpp"
#include "lib/model/strays.hpp"

namespace stx {
namespace {

/// A line of the keyword: its place in the world, and what follows the coordinates.
struct CoordinateLine {
    glm::dvec3 position{0.0};
    std::string_view rest;
    std::optional<glm::vec3> colour;  ///< the rest is r g b
    std::optional<double> alpha;      ///< was behind them, and is not in the rest
};

/// What doubles cannot hold is 0 or infinite, as Assimp has it.
bool takeNumber(std::string_view& text, double& value) {
    while (!text.empty() && isBlank(text.front())) text.remove_prefix(1);
    if (text.starts_with('+')) text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const auto number = text.substr(0, static_cast<std::size_t>(end - text.data()));
    if (error == std::errc::result_out_of_range) {
        const bool tiny = number.find('-', 1) != std::string_view::npos;  // the exponent's
        value = tiny ? 0 : std::numeric_limits<double>::infinity();
    } else if (error != std::errc()) {
        return false;
    }
    text.remove_prefix(number.size());
    return text.empty() || isBlank(text.front());
}

/// `values` is what follows the keyword. OBJ: x y z, x y z w, x y z r g b, or x y z r g b a.
std::optional<CoordinateLine> parse(std::string_view values) {
    CoordinateLine line;
    values = trimmed(values);
    for (int k = 0; k < 3; ++k) {
        if (!takeNumber(values, line.position[k])) return std::nullopt;
    }
    line.rest = trimmed(values);
    double w = 1;
    if (auto last = line.rest; !last.empty() && takeNumber(last, w) && trimmed(last).empty()) {
        if (w == 0) return std::nullopt;
        line.position /= w;
        line.rest = {};
    }
    double colour[3] = {};
    auto numbers = line.rest;
    if (!std::ranges::all_of(colour, [&](double& c) { return takeNumber(numbers, c); }))
        return line;
    line.colour = glm::vec3(colour[0], colour[1], colour[2]);
    const auto rgb = line.rest.substr(0, line.rest.size() - numbers.size());
    if (double alpha = 1; takeNumber(numbers, alpha) && trimmed(numbers).empty()) {
        line.alpha = alpha;
        line.rest = rgb;
    }
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
        // To the line's end: another point, another comment may be far away.
        const auto upTo = text.substr(0, end);
        const auto last = continued ? upTo.rfind('\\') : end;
        if (!values && !elements) {
            // Names may have a #, so what is behind one stays.
            if (!continued || line.find('#') == std::string_view::npos) continue;
            replace(last, last + 1, " ");
            continued = false;
            continue;
        }
        const auto comment = std::min(upTo.find('#', start), end);
        for (auto at = upTo.find('.', start); at < comment; at = upTo.find('.', at + 1)) {
            const bool first = at == start || isBlank(text[at - 1]);
            if (first && at + 1 < end && isDigit(text[at + 1])) replace(at, at, "0");
        }
        if (comment < end) {
            replace(comment, end, "");
            continued = false;
        } else if (values && continued) {
            replace(last, std::min(end + 1, text.size()), " ");
        }
    }
    if (copied == 0) return std::nullopt;
    append(out, text.substr(copied));
    return out;
}

PlainText plainCoordinates(ByteSpan bytes, std::string_view keyword) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    PlainText out;
    std::vector<glm::dvec3> positions;  // that are a place
    std::size_t vertices = 0, coloured = 0, withAlpha = 0, notOne = 0, notByte = 0;
    ColourRange range;
    eachLine(text, keyword, [&](std::string_view whole, const auto& values) {
        if (!values) return true;
        const auto line = parse(*values);
        if (!line) {
            out.unread = trimmed(whole);
            return false;
        }
        ++vertices;
        const glm::vec3 p(line->position);
        if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))
            positions.push_back(line->position);
        if (!line->colour) return true;
        ++coloured;
        range.add(*line->colour);
        if (!line->alpha) return true;
        ++withAlpha;
        notOne += *line->alpha == 1 ? 0 : 1;
        notByte += *line->alpha == 255 ? 0 : 1;
        return true;
    });
    if (!out.unread.empty()) return out;
    out.dropsAlpha = (range.isBytes() ? notByte : notOne) > 0;
    const auto strays = findStrays(positions.size(), [&](std::uint64_t i) {
        return Piece{positions[i], positions[i]};
    });
    out.origin = originFor(strays.bounds);
    const bool mixed = coloured > 0 && coloured < vertices;
    if (out.origin == glm::dvec3(0.0) && !mixed && withAlpha == 0) return out;
    const std::string_view white = range.isBytes() ? "255 255 255" : "1 1 1";
    auto& plain = out.text.emplace();
    plain.reserve(text.size() + vertices * 8);
    eachLine(text, keyword, [&](std::string_view line, const auto& values) {
        if (!values) {
            append(plain, line);
            return true;
        }
        const auto parsed = *parse(*values);
        const glm::vec3 p(parsed.position - out.origin);
        const auto rest = mixed && !parsed.colour ? white : parsed.rest;
        append(plain, fmt::format("{} {} {} {} {}\n", keyword, p.x, p.y, p.z, rest));
        return true;
    });
    return out;
}

}  // namespace stx
