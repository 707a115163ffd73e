#include "formats/mpeg4/mapping/view_notes.hpp"

#include <algorithm>
#include <cmath>

#include "formats/files/base64.hpp"
#include "formats/images/images.hpp"
#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/text/text_values.hpp"

namespace stx::mpeg4 {
namespace {

/// The words of a string, at most `most`; the last holds all the rest.
std::vector<std::string_view> words(std::string_view text, std::size_t most) {
    std::vector<std::string_view> list;
    while (!text.empty() && list.size() + 1 < most) {
        const auto end = text.find(' ');
        list.push_back(text.substr(0, end));
        text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    }
    if (!text.empty()) list.push_back(text);
    return list;
}

/// The finite numbers behind the first word; none when there are not exactly `count`.
std::vector<double> numbers(std::string_view text, std::size_t count) {
    const auto w = words(text, count + 2);
    if (w.size() != count + 1) return {};
    std::vector<double> list;
    for (std::size_t i = 1; i < w.size(); ++i) {
        const auto value = doubleFromText(w[i]);
        if (!value || !std::isfinite(*value)) return {};
        list.push_back(*value);
    }
    return list;
}

}  // namespace

ViewNotes ViewNotes::parse(const std::vector<std::string>& info) {
    ViewNotes notes;
    // Anybody may write "start 2" there, and mean something else.
    if (std::ranges::find(info, kMadeByUs) == info.end()) return notes;
    for (const std::string& line : info) {
        if (line.starts_with("bounds ")) {
            const auto n = numbers(line, 6);
            if (n.empty()) continue;
            Bounds bounds;
            bounds.add({n[0], n[1], n[2]});
            bounds.add({n[3], n[4], n[5]});
            notes.bounds = bounds;
        } else if (line.starts_with("origin ")) {
            if (const auto n = numbers(line, 3); !n.empty())
                notes.origin = glm::dvec3(n[0], n[1], n[2]);
        } else if (line.starts_with("start ")) {
            if (const auto n = numbers(line, 1); !n.empty()) notes.start = n[0];
        } else if (line.starts_with("duration ")) {
            if (const auto n = numbers(line, 1); !n.empty() && n[0] > 0) notes.duration = n[0];
        } else if (line.starts_with("name ")) {
            const auto w = words(line, 3);
            if (w.size() == 3) notes.views[std::string(w[1])].name = w[2];
        } else if (line.starts_with("views ")) {
            const auto count = integerFromText(std::string_view(line).substr(6));
            if (count && *count >= 0 && *count <= 1 << 20) notes.count = static_cast<int>(*count);
        } else if (line.starts_with("padding ")) {
            const auto w = words(line, 9);
            if (w.size() != 8) continue;
            Pad pad;
            int* const sides[] = {&pad.left, &pad.top, &pad.right, &pad.bottom};
            bool good = true;
            for (std::size_t i = 0; i < 4; ++i) {
                const auto value = integerFromText(w[i + 2]);
                good = good && value && *value >= 0 && *value <= 1 << 20;
                if (good) *sides[i] = static_cast<int>(*value);
            }
            const auto cx = doubleFromText(w[6]), cy = doubleFromText(w[7]);
            if (!good || !cx || !cy) continue;
            pad.cx = *cx;
            pad.cy = *cy;
            notes.views[std::string(w[1])].padding = pad;
        } else if (line.starts_with("pruned ") || line.starts_with("unknown ") ||
                   line.starts_with("refined ")) {
            const auto w = words(line, 4);
            const auto layer = w.size() == 4 ? integerFromText(w[2]) : std::nullopt;
            if (!layer || *layer < 0 || *layer > 1 << 20) continue;
            auto& of = notes.views[std::string(w[1])].layers[static_cast<int>(*layer)];
            if (w[0] == "refined")
                of.refined = Refined::from(w[3]).value_or(Refined{});
            else
                (w[0] == "pruned" ? of.pruned : of.unknown) = w[3];
        } else if (line.starts_with("background ")) {
            const auto w = words(line, 4);
            const auto layer = w.size() == 3 ? integerFromText(w[2]) : std::nullopt;
            if (layer && *layer >= 0 && *layer <= 1 << 20)
                notes.views[std::string(w[1])].layers[static_cast<int>(*layer)].background = true;
        }
    }
    return notes;
}

std::vector<std::string> ViewNotes::text() const {
    std::vector<std::string> info;
    if (bounds && !bounds->empty())
        info.push_back(fmt::format("bounds {} {} {} {} {} {}", bounds->min.x, bounds->min.y,
                                   bounds->min.z, bounds->max.x, bounds->max.y, bounds->max.z));
    if (origin) info.push_back(fmt::format("origin {} {} {}", origin->x, origin->y, origin->z));
    if (start) info.push_back(fmt::format("start {}", *start));
    if (duration) info.push_back(fmt::format("duration {}", *duration));
    if (count && !views.empty()) info.push_back(fmt::format("views {}", *count));
    for (const auto& [key, view] : views) {
        if (!view.name.empty()) info.push_back(fmt::format("name {} {}", key, view.name));
        if (const auto& pad = view.padding)
            info.push_back(fmt::format("padding {} {} {} {} {} {} {}", key, pad->left, pad->top,
                                       pad->right, pad->bottom, pad->cx, pad->cy));
        for (const auto& [number, layer] : view.layers) {
            if (layer.pruned)
                info.push_back(fmt::format("pruned {} {} {}", key, number, *layer.pruned));
            if (layer.unknown)
                info.push_back(fmt::format("unknown {} {} {}", key, number, *layer.unknown));
            if (layer.background) info.push_back(fmt::format("background {} {}", key, number));
            if (!layer.refined.steps.empty())
                info.push_back(fmt::format("refined {} {} {}", key, number, layer.refined.text()));
        }
    }
    return info;
}

void removePadding(ReferenceView& view, const ViewNotes::Pad& pad) {
    Camera& c = view.camera;
    const int width = c.width - pad.left - pad.right, height = c.height - pad.top - pad.bottom;
    if (width < 1 || height < 1 || !(std::abs(pad.cx + pad.left - c.cx) <= 0.5 + 1e-6) ||
        !(std::abs(pad.cy + pad.top - c.cy) <= 0.5 + 1e-6))
        return;
    view.depth = view.depth.part(pad.left, pad.top, width, height);
    if (const Rgba8Image* image = view.texture.rgba8())
        view.texture = image->part(pad.left, pad.top, width, height);
    view.normal = view.normal.part(pad.left, pad.top, width, height);
    view.splatU = view.splatU.part(pad.left, pad.top, width, height);
    view.splatV = view.splatV.part(pad.left, pad.top, width, height);
    view.colourFile.x += pad.left;
    view.colourFile.y += pad.top;
    c.width = width;
    c.height = height;
    c.cx = pad.cx;
    c.cy = pad.cy;
}

void UnknownPixels::add(const Rgba8Image& texture, const Image<float>& depth) {
    size_ = {texture.width(), texture.height()};
    for (std::size_t i = 0; i < texture.count(); ++i) {
        if (hasPoint(depth.data()[i])) continue;
        if (texture.data()[i].a != 255) {
            elsewhere_ = true;
            continue;
        }
        unknown_.resize(texture.count());
        unknown_[i] = true;
    }
}

Result<std::string> UnknownPixels::text() const {
    if (!elsewhere_) return kUnknownAll;
    std::vector<std::uint8_t> grey(static_cast<std::size_t>(size_.x) * size_.y);
    for (std::size_t i = 0; i < unknown_.size(); ++i) grey[i] = unknown_[i] ? 255 : 0;
    STX_TRY(const auto png, encodePng(size_.x, size_.y, 1, 8, grey.data(), false));
    return encodeBase64(png);
}

Result<std::string> unknownMask(const Rgba8Image& texture, const Image<float>& depth) {
    UnknownPixels pixels;
    pixels.add(texture, depth);
    return pixels.text();
}

Result<void> applyUnknownMask(ReferenceView& view, const std::string& mask, const Limits& limits) {
    if (Rgba8Image* texture = view.texture.rgba8(); mask == kUnknownAll && texture) {
        for (std::size_t i = 0; i < texture->count(); ++i)
            if (!hasPoint(view.depth.pixels()[i])) texture->pixels()[i].a = 255;
        return {};
    }
    const auto png = decodeBase64(mask);
    if (!png)
        return fail(ErrorCode::invalidInput,
                    "the mask of its pixels of unknown depth is not base64");
    STX_TRY(const auto header, probeImage(*png));
    if (header.format != "png" || header.channels != 1 || header.bits != 8 ||
        header.width != view.depth.width() || header.height != view.depth.height())
        return fail(
            ErrorCode::invalidInput,
            "the mask of its pixels of unknown depth is a {} of {}x{}; a grey PNG of {}x{} is "
            "expected",
            header.format, header.width, header.height, view.depth.width(), view.depth.height());
    STX_TRY(const auto image, decodeImage(*png, "the mask of pixels of unknown depth", limits));
    const auto* grey = std::get_if<std::vector<std::uint8_t>>(&image.values);
    Rgba8Image* texture = view.texture.rgba8();
    if (!grey || !texture || grey->size() != texture->count())
        return fail(ErrorCode::invalidInput,
                    "the mask of its pixels of unknown depth does not fit it");
    for (std::size_t i = 0; i < grey->size(); ++i)
        if ((*grey)[i] != 0 && !hasPoint(view.depth.pixels()[i])) texture->pixels()[i].a = 255;
    return {};
}

}  // namespace stx::mpeg4
