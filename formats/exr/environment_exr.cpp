#include "formats/exr/environment_exr.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "formats/exr/exr_colour.hpp"
#include "formats/files/text_numbers.hpp"
#include "lib/base/placed.hpp"
#include "lib/environment/environment_map.hpp"
#include "lib/model/srgb8.hpp"

namespace stx {
namespace {

using Type = ExrChannel::Type;

/// Our faces in the order of OpenEXR's, and which are turned by half a turn there.
constexpr std::array kColumn = {CubeFace::left,   CubeFace::right, CubeFace::top,
                                CubeFace::bottom, CubeFace::front, CubeFace::back};
bool isTurned(CubeFace face) {
    return face == CubeFace::top || face == CubeFace::bottom;
}

template <class P>
Image<P> turned(const Image<P>& image) {
    Image<P> out = image;
    std::reverse(out.pixels().begin(), out.pixels().end());
    return out;
}

Image<glm::vec4> crop(const Image<glm::vec4>& image, int top, int size) {
    Image<glm::vec4> out(size, size);
    std::copy_n(image.row(top).begin(), out.count(), out.data());
    return out;
}

std::string gradientText(const std::vector<glm::vec3>& colours, const std::vector<double>& angles) {
    std::string text;
    for (std::size_t i = 0; i < colours.size(); ++i) {
        if (i > 0) text += fmt::format(" {} ", angles[i - 1]);
        text += fmt::format("{} {} {}", colours[i].r, colours[i].g, colours[i].b);
    }
    return text;
}

Result<void> readGradient(const ExrPart& part, const char* name, std::vector<glm::vec3>& colours,
                          std::vector<double>& angles) {
    const auto* text = part.attribute<std::string>(name);
    if (!text) return {};
    const auto numbers = numbersFrom(*text);
    if (!numbers || numbers->size() % 4 != 3)
        return fail(ErrorCode::invalidInput,
                    "part '{}': {} is '{}'; r g b, then angle r g b for each further colour is "
                    "expected",
                    part.name, name, text->substr(0, 100));
    for (std::size_t i = 0; i + 3 <= numbers->size(); i += 4) {
        if (i > 0) angles.push_back((*numbers)[i - 1]);
        colours.emplace_back((*numbers)[i], (*numbers)[i + 1], (*numbers)[i + 2]);
    }
    return {};
}

}  // namespace

int environmentPartOf(const ExrReader& reader) {
    int standard = -1;
    for (std::size_t i = 0; i < reader.parts().size(); ++i) {
        const ExrPart& part = reader.parts()[i];
        if (part.attribute<std::string>("stx:environment")) return static_cast<int>(i);
        if (standard < 0 && part.envmap != ExrPart::Envmap::none) standard = static_cast<int>(i);
    }
    return standard;
}

Result<ExrEnvironmentHeader> environmentHeader(const ExrPart& part) {
    ExrEnvironmentHeader header;
    Environment& e = header.environment;
    header.bytes = part.bytes;
    const auto* ours = part.attribute<std::string>("stx:environment");
    const auto* colour = part.attribute<std::string>("stx:colour");
    header.linear = !ours || !colour || *colour != "sRGB8";
    // Other programs that change the layout leave our attributes as they were.
    const bool cube = part.envmap == ExrPart::Envmap::none ? ours && *ours == "cube"
                                                           : part.envmap == ExrPart::Envmap::cube;
    if (cube) {
        e.layout = Environment::Layout::cube;
        if (part.height != 6 * part.width)
            return fail(ErrorCode::invalidInput,
                        "part '{}' is an environment of six faces with {}x{} pixels; the height is "
                        "six times the width",
                        part.name, part.width, part.height);
        header.size = {part.width, part.width};
        const auto* there = ours ? part.attribute<std::string>("stx:faces") : nullptr;
        for (int f = 0; f < 6; ++f)
            if (!there || (" " + *there + " ").find(fmt::format(" {} ", kCubeFaceNames[f])) !=
                              std::string::npos)
                header.faces.push_back(static_cast<CubeFace>(f));
    } else {
        e.layout = Environment::Layout::equirectangular;
        // OpenEXR's envmap is of the data window; a picture without is the display window.
        const bool plain = !ours && part.envmap == ExrPart::Envmap::none;
        header.size = plain ? glm::ivec2(part.displayWidth, part.displayHeight)
                            : glm::ivec2(part.width, part.height);
        if (part.envmap == ExrPart::Envmap::none && ours && *ours == "none") {
            e.layout = Environment::Layout::cube;
            header.size = glm::ivec2(0);
        } else if (header.size.x != 2 * header.size.y) {
            return fail(ErrorCode::invalidInput,
                        "part '{}' is an environment with {}x{} pixels; a picture all around is "
                        "twice as wide as high",
                        part.name, header.size.x, header.size.y);
        }
    }
    if (!ours) return header;
    STX_CHECK(readGradient(part, "stx:sky", e.skyColours, e.skyAngles));
    STX_CHECK(readGradient(part, "stx:ground", e.groundColours, e.groundAngles));
    if (const auto* text = part.attribute<std::string>("stx:quaternion")) {
        const auto q = numbersFrom(*text);
        if (!q || q->size() != 4)
            return fail(ErrorCode::invalidInput,
                        "part '{}': stx:quaternion is '{}'; four numbers are expected", part.name,
                        text->substr(0, 100));
        e.orientation = glm::dquat((*q)[0], (*q)[1], (*q)[2], (*q)[3]);
    }
    return header;
}

void makeFinite(std::span<float> values, std::span<const std::string> channels,
                const std::string& where, Job& job) {
    std::int64_t infinite = 0, nothing = 0;
    for (std::size_t c = 0; c < channels.size(); ++c) {
        const bool alpha = channels[c] == "A";
        const auto isColour = [&](const char* name) { return channels[c] == name; };
        if (!alpha && std::ranges::none_of(std::array{"R", "G", "B", "Y"}, isColour)) continue;
        for (std::size_t i = c; i < values.size(); i += channels.size()) {
            if (std::isfinite(values[i])) continue;
            values[i] = !(values[i] > 0) ? 0.0f : alpha ? 1.0f : kLargestHalf;
            ++(values[i] > 0 ? infinite : nothing);
        }
    }
    if (infinite > 0)
        job.note(fmt::format("{}: {} values of the environment are infinite: they count as {}",
                             where, infinite, kLargestHalf));
    if (nothing > 0)
        job.note(fmt::format("{}: {} values of the environment are no numbers: they count as 0",
                             where, nothing));
}

Result<std::shared_ptr<const Environment>> readEnvironmentPart(const ExrReader& reader, int index,
                                                               Job& job) {
    const ExrPart& part = reader.parts()[index];
    STX_TRY(auto header, within(reader.where(), environmentHeader(part)));
    auto environment = std::make_shared<Environment>(std::move(header.environment));
    const auto count = static_cast<std::uint64_t>(part.width) * part.height +
                       static_cast<std::uint64_t>(header.size.x) * header.size.y;
    STX_CHECK(within(reader.where(),
                     job.limits.checkAllocation(count, sizeof(glm::vec4), "the environment")));
    if (header.size.x > 0) {
        const bool rgb = part.channel("R") && part.channel("G") && part.channel("B");
        if (!rgb && !part.channel("Y"))
            return failAt(reader.where(), ErrorCode::invalidInput,
                          "part '{}' has no channels R G B or Y", part.name);
        Image<glm::vec4> pixels(part.width, part.height);
        float* const at = &pixels.data()->x;
        std::vector<ExrPixels> channels = {{rgb ? "R" : "Y", at, 4}};
        if (rgb) channels.insert(channels.end(), {{"G", at + 1, 4}, {"B", at + 2, 4}});
        if (part.channel("A")) channels.push_back({"A", at + 3, 4});
        STX_CHECK(reader.readPart(index, channels));
        for (glm::vec4& p : pixels.pixels()) {
            if (!rgb) p.g = p.b = p.r;
            if (!part.channel("A")) p.a = 1.0f;
        }
        static const std::vector<std::string> kNames = {"R", "G", "B", "A"};
        makeFinite({at, pixels.count() * kNames.size()}, kNames, reader.where(), job);
        if (rgb && part.rec709FromRgb)
            for (glm::vec4& p : pixels.pixels())
                p = glm::vec4(glm::mat3(*part.rec709FromRgb) * glm::vec3(p), p.a);
        const auto texture = [&](const Image<glm::vec4>& image) {
            return header.linear ? textureFromPremultiplied(image)
                                 : textureFromPremultiplied8(image);
        };
        if (environment->layout == Environment::Layout::equirectangular) {
            if (pixels.size() != header.size) {
                Image<glm::vec4> whole(header.size.x, header.size.y,
                                       glm::vec4(0, 0, 0, part.channel("A") ? 0 : 1));
                place(pixels.data(), pixels.size(), {part.originX, part.originY}, whole.data(),
                      whole.size());
                pixels = std::move(whole);
            }
            environment->pictures.push_back(texture(pixels));
        } else {
            environment->pictures.resize(6);
            for (std::size_t i = 0; i < kColumn.size(); ++i) {
                if (std::ranges::find(header.faces, kColumn[i]) == header.faces.end()) continue;
                const auto face = crop(pixels, static_cast<int>(i) * part.width, part.width);
                environment->pictures[static_cast<std::size_t>(kColumn[i])] =
                    texture(isTurned(kColumn[i]) ? turned(face) : face);
            }
        }
    }
    STX_CHECK(within(reader.where(), environment->check()));
    return std::shared_ptr<const Environment>(std::move(environment));
}

Result<ExrEnvironmentPart> environmentPart(const Environment& given, Job& job) {
    STX_CHECK(given.check());
    ExrEnvironmentPart out{{}, given};
    Environment& e = out.environment;
    ExrPart& part = out.part;
    const bool any = e.pictureCount() > 0;
    part.name = "environment";
    if (!any) {
        part.width = part.height = 1;
    } else if (e.layout == Environment::Layout::cube) {
        const int size = cubeSizeOf(e);
        const auto fits = [&](const Texture& t) {
            return t.empty() || (t.width() == size && t.height() == size);
        };
        if (!std::ranges::all_of(e.pictures, fits)) {
            job.note(fmt::format(
                "the environment's faces are not equal squares; OpenEXR's are: {}x{} each", size,
                size));
            STX_TRY(e, asCube(given, size, job.limits));
            // Faces that are not there stay so.
            for (std::size_t f = 0; f < 6; ++f)
                if (given.pictures[f].empty()) e.pictures[f] = Texture();
        }
        part.width = size;
        part.height = 6 * size;
        part.envmap = ExrPart::Envmap::cube;
    } else {
        glm::ivec2 size = equirectangularSizeOf(e);
        if (size.x != 2 * size.y) {
            size.x = 2 * size.y;
            job.note(fmt::format(
                "the environment's picture is {}x{}; OpenEXR's are twice as wide as high: {}x{}",
                e.pictures[0].width(), e.pictures[0].height(), size.x, size.y));
            STX_TRY(e, asEquirectangular(given, size.x, size.y, job.limits));
        }
        part.width = size.x;
        part.height = size.y;
        part.envmap = ExrPart::Envmap::latlong;
    }
    part.displayWidth = part.width;
    part.displayHeight = part.height;
    const bool linear = e.linear();
    for (const char* c : {"R", "G", "B", "A"})
        part.channels.push_back({c, linear ? Type::float32 : Type::half});
    auto& a = part.attributes;
    a["stx:environment"] = std::string(!any                                    ? "none"
                                       : e.layout == Environment::Layout::cube ? "cube"
                                                                               : "latlong");
    a["stx:colour"] = std::string(linear ? "linear" : "sRGB8");
    const glm::dquat& q = e.orientation;
    if (q != glm::dquat(1, 0, 0, 0))
        a["stx:quaternion"] = fmt::format("{} {} {} {}", q.w, q.x, q.y, q.z);
    if (!e.skyColours.empty()) a["stx:sky"] = gradientText(e.skyColours, e.skyAngles);
    if (!e.groundColours.empty()) a["stx:ground"] = gradientText(e.groundColours, e.groundAngles);
    if (any && e.layout == Environment::Layout::cube && e.pictureCount() < 6) {
        std::string there;
        for (std::size_t f = 0; f < 6; ++f)
            if (!e.pictures[f].empty())
                there += (there.empty() ? "" : " ") + std::string(kCubeFaceNames[f]);
        a["stx:faces"] = there;
    }
    return out;
}

void joinParts(ExrPart& part, const std::vector<ExrPart>& others) {
    part.displayWidth = others[0].displayWidth;
    part.displayHeight = others[0].displayHeight;
    part.pixelAspectRatio = others[0].pixelAspectRatio;
    const auto taken = [&] {
        return std::ranges::any_of(others, [&](const ExrPart& p) { return p.name == part.name; });
    };
    while (taken()) part.name += "_";
}

Result<void> writeEnvironmentPart(ExrWriter& writer, int index, const ExrEnvironmentPart& part) {
    const Environment& e = part.environment;
    Image<glm::vec4> pixels(part.part.width, part.part.height, glm::vec4(0.0f));
    if (e.pictureCount() > 0 && e.layout == Environment::Layout::equirectangular) {
        pixels = premultipliedLinear(e.pictures[0]);
    } else if (e.pictureCount() > 0) {
        for (std::size_t i = 0; i < kColumn.size(); ++i) {
            const Texture& t = e.pictures[static_cast<std::size_t>(kColumn[i])];
            if (t.empty()) continue;
            Image<glm::vec4> face = premultipliedLinear(t);
            if (isTurned(kColumn[i])) face = turned(face);
            std::copy_n(face.data(), face.count(),
                        pixels.row(static_cast<int>(i) * face.width()).begin());
        }
    }
    const float* const at = &pixels.data()->x;
    return writer.writePart(index,
                            {{"R", at, 4}, {"G", at + 1, 4}, {"B", at + 2, 4}, {"A", at + 3, 4}});
}

Result<void> writeEnvironmentExr(const Environment& environment, const std::filesystem::path& path,
                                 Job& job, OutputFile::Options options) {
    STX_TRY(auto part, environmentPart(environment, job));
    part.part.name.clear();
    STX_TRY(auto file, OutputFile::create(path, options));
    STX_TRY(auto writer, ExrWriter::create(file, {part.part}));
    STX_CHECK(writeEnvironmentPart(writer, 0, part));
    STX_CHECK(writer.finish());
    return file.commit();
}

Result<std::shared_ptr<const Environment>> readEnvironmentExr(const std::filesystem::path& path,
                                                              Job& job) {
    STX_TRY(const auto reader, ExrReader::open(path, job.limits));
    int at = environmentPartOf(reader);
    const ExrPart& first = reader.parts()[0];
    if (at < 0 && first.displayWidth == 2 * first.displayHeight) at = 0;
    if (at < 0)
        return failAt(reader.where(), ErrorCode::invalidInput,
                      "it has no environment: no part with the attribute envmap, and its first "
                      "picture of {}x{} is not twice as wide as high",
                      first.displayWidth, first.displayHeight);
    if (const std::string& note = reader.parts()[at].primariesNote; !note.empty())
        job.note(reader.where() + ": " + note);
    return readEnvironmentPart(reader, at, job);
}

}  // namespace stx
