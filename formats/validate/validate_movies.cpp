#include "formats/validate/validate_movies.hpp"

#include <optional>

#include "lib/model/sequence.hpp"

namespace stx {

using namespace mpeg4;

namespace {

/// An image of a view that has several pictures.
struct Movie {
    std::string field;
    NodePtr node;
    const ElementaryStream* stream = nullptr;
};

std::vector<Movie> moviesOf(const Node& texture, const StreamImages& images) {
    std::vector<Movie> movies;
    for (const Node::SetField& field : texture.setFields) {
        const auto* node = std::get_if<NodePtr>(&field.value);
        if (!node || !*node) continue;
        const ElementaryStream* stream = images.stream(**node);
        if (!stream || stream->samples.empty()) continue;
        if (stream->samples.size() > 1 || (*node)->is("MovieTexture"))
            movies.push_back({texture.info->fields[field.index].name, *node, stream});
    }
    return movies;
}

bool isPicture(const ElementaryStream& stream) {
    return stream.objectTypeIndication == oti::kJpeg || stream.objectTypeIndication == oti::kPng;
}

void checkMovie(const Movie& movie, const StreamImages& images, const std::string& where,
                const Limits& limits, Findings& findings) {
    const Node& node = *movie.node;
    const ElementaryStream& stream = *movie.stream;
    if (!node.is("MovieTexture"))
        findings.add(7005, where,
                     fmt::format("a {} with {} pictures", node.info->name, stream.samples.size()),
                     "a MovieTexture");
    else if (!(node.get<float>("speed") > 0))
        findings.add(7006, where, fmt::format("speed {:g}", node.get<float>("speed")),
                     "a speed above 0");
    if (node.is("MovieTexture") && node.get<bool>("loop") && !stream.ocrEsId)
        findings.add(7003, where, "a loop on the scene's clock",
                     "a stream with OCR_ES_ID, or loop FALSE");
    if (!stream.samples.front().sync)
        findings.add(7004, where, "a first picture that needs others", "one that stands alone");
    if (stream.samples.size() > 1) {
        const Presentation& shown = images.presentation(stream);
        std::vector<bool> seen(stream.samples.size(), false);
        for (const auto& entry : shown.shown) seen[entry.sample] = true;
        const auto hidden = std::count(seen.begin(), seen.end(), false);
        if (hidden > 0)
            findings.add(7008, where,
                         fmt::format("{} of {} pictures that the edit list never shows", hidden,
                                     seen.size()),
                         "all of them shown");
    }
    if (!isPicture(stream)) return;
    std::optional<ImageInfo> first;
    for (std::size_t i = 0; i < stream.samples.size(); ++i) {
        ByteRange head = stream.samples[i].data;
        head.size = std::min<std::uint64_t>(head.size, 1 << 16);
        const auto bytes = head.load(limits);
        if (!bytes) continue;
        const auto info = probeImage(*bytes);
        if (!info) continue;
        if (!first) {
            first = *info;
        } else if (info->width != first->width || info->height != first->height) {
            findings.add(7007, where,
                         fmt::format("picture {} of {}", i, sizeText(info->width, info->height)),
                         sizeText(first->width, first->height));
            return;
        }
    }
}

bool sameTimes(const Presentation& a, const Presentation& b) {
    const auto differ = [tick = std::max(a.tick, b.tick)](double one, double other) {
        return std::abs(one - other) > halfTick(tick, one);
    };
    if (a.shown.size() != b.shown.size() || differ(a.duration, b.duration)) return false;
    for (std::size_t i = 0; i < a.shown.size(); ++i)
        if (differ(a.shown[i].time, b.shown[i].time)) return false;
    return true;
}

/// Two images of a view that both move.
void checkPair(const Movie& a, const Movie& b, const StreamImages& images, const std::string& where,
               Findings& findings) {
    const std::string both = fmt::format("{}: {} and {}", where, a.field, b.field);
    if (a.stream->samples.size() > 1 && b.stream->samples.size() > 1) {
        // A copy, since a reference lives until the next is asked for.
        const Presentation first =  // NOLINT(performance-unnecessary-copy-initialization)
            images.presentation(*a.stream);
        const Presentation& second = images.presentation(*b.stream);
        if (!sameTimes(first, second))
            findings.add(
                7001, both,
                fmt::format("{} pictures over {:g} s and {} over {:g} s", first.shown.size(),
                            first.duration, second.shown.size(), second.duration),
                "pictures of the same times");
    }
    if (!a.node->is("MovieTexture") || !b.node->is("MovieTexture")) return;
    for (const char* field : {"loop", "speed", "startTime", "stopTime"})
        if (!sameValue(a.node->value(std::string_view(field)),
                       b.node->value(std::string_view(field))))
            findings.add(7002, both, fmt::format("another {}", field), "the same in both");
    if (a.stream->ocrEsId != b.stream->ocrEsId)
        findings.add(7002, both, "clocks of their own", "one clock (OCR_ES_ID) for both");
}

}  // namespace

void checkMovies(const Node& texture, const StreamImages& images, const std::string& where,
                 const Limits& limits, Findings& findings) {
    const auto movies = moviesOf(texture, images);
    for (const Movie& movie : movies)
        checkMovie(movie, images, fmt::format("{}: {}", where, movie.field), limits, findings);
    for (std::size_t i = 1; i < movies.size(); ++i)
        checkPair(movies[0], movies[i], images, where, findings);
}

}  // namespace stx
