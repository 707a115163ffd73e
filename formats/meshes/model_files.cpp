#include "formats/meshes/model_files.hpp"

#include <algorithm>

#include "formats/images/images.hpp"
#include "formats/images/more_pictures.hpp"

namespace stx {

Result<Bytes> ModelFiles::read(std::string_view name) const {
    auto path = resolveInside(folder_, name, job_.limits);
    if (!path && path.error().code == ErrorCode::io && name.find('\\') != std::string_view::npos) {
        std::string slashes(name);
        std::replace(slashes.begin(), slashes.end(), '\\', '/');
        path = resolveInside(folder_, slashes, job_.limits);
    }
    if (!path) return propagate(path);
    return readFile(*path, job_.limits);
}

Result<std::filesystem::path> ModelFiles::find(std::string_view name,
                                               const std::string& alsoIn) const {
    auto path = resolveInside(folder_, name, job_.limits);
    if (path) return path;
    const auto slash = name.find_last_of("/\\");
    const auto last = std::string(slash == std::string_view::npos ? name : name.substr(slash + 1));
    if (last.empty() || last == "." || last == "..") return path;
    std::vector<std::string> places = {last, "textures/" + last, "Textures/" + last};
    if (!alsoIn.empty()) {
        places.insert(places.begin(), alsoIn + "/" + last);
        if (slash != std::string_view::npos)
            places.insert(places.begin(), fmt::format("{}/{}", alsoIn, name));
    }
    for (const auto& place : places) {
        auto found = resolveInside(folder_, place, job_.limits);
        if (!found) continue;
        // Names relative to the material file are as they should be.
        const bool own = !alsoIn.empty() && place == fmt::format("{}/{}", alsoIn, name);
        if (!own && told_.emplace(name).second)
            job_.note(fmt::format("'{}' is not there; '{}' is taken instead", name, place));
        return found;
    }
    return path;
}

std::string_view ModelFiles::whyNotThere(std::string_view name, const Error& error) const {
    if (name.empty()) return "has no name";
    std::error_code ec;
    const auto status = std::filesystem::status(folder_ / name, ec);
    if (std::filesystem::is_directory(status)) return "is a folder, not a file";
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
        return "is a device or a pipe, not a file";
    if (error.code == ErrorCode::io) return "cannot be read";
    return "is outside of the model's folder (--allow-outside reads what is there) and not in it";
}

int ModelFiles::placeOfColour(std::vector<MeshTexture>& textures, bool hasUvs) const {
    if (!replacesColour_ || !hasUvs) return -1;
    textures.push_back({Rgba8Image(1, 1)});
    return static_cast<int>(textures.size()) - 1;
}

std::optional<int> ModelFiles::known(const std::string& id, SamplerState s,
                                     std::vector<MeshTexture>& textures) {
    const auto it = first_.find(id);
    if (it == first_.end()) return std::nullopt;
    if (it->second < 0) return -1;
    const Key key{id, s.wrapU, s.wrapV, s.nearest};
    if (const auto same = textures_.find(key); same != textures_.end()) return same->second;
    MeshTexture copy = textures[it->second];
    copy.wrapU = s.wrapU;
    copy.wrapV = s.wrapV;
    copy.nearest = s.nearest;
    pixelBytes_ += copy.pixels.count() * sizeof(glm::u8vec4);
    const int index = static_cast<int>(textures.size());
    textures.push_back(std::move(copy));
    textures_[key] = index;
    return index;
}

Result<int> ModelFiles::textureFromFile(std::string_view name, SamplerState sampler,
                                        std::vector<MeshTexture>& textures,
                                        const std::string& alsoIn) {
    if (name.size() > 2 && name.starts_with('"') && name.ends_with('"'))
        name = name.substr(1, name.size() - 2);  // as some programs write names with blanks
    const auto without = [&](const Error& error) {
        if (missing_.emplace(name).second)
            job_.note(fmt::format("texture '{}' {}; the plain colour is used instead", name,
                                  whyNotThere(name, error)));
        return -1;
    };
    const auto path = find(name, alsoIn);
    if (!path) return without(path.error());
    const std::string id = path->string();
    if (const auto index = known(id, sampler, textures)) return *index;
    const auto bytes = readFile(*path, job_.limits);
    if (!bytes) {
        if (bytes.error().code == ErrorCode::io) return without(bytes.error());
        return tl::unexpected(bytes.error().at(fmt::format("texture '{}'", name)));
    }
    return decode(*bytes, name, id, sampler, textures);
}

Result<int> ModelFiles::textureFromBytes(ByteSpan bytes, std::string_view name,
                                         SamplerState sampler, std::vector<MeshTexture>& textures) {
    const std::string id(name);
    if (const auto index = known(id, sampler, textures)) return *index;
    return decode(bytes, name, id, sampler, textures);
}

Result<int> ModelFiles::decode(ByteSpan bytes, std::string_view name, const std::string& id,
                               SamplerState sampler, std::vector<MeshTexture>& textures) {
    auto pixels = decodeRgba8(bytes, name, job_.limits);
    if (!pixels) {
        if (pixels.error().code == ErrorCode::failed) return tl::unexpected(pixels.error());
        job_.note(
            fmt::format("texture '{}' cannot be decoded ({}); the plain colour is used instead",
                        name, pixels.error().message));
        first_.emplace(id, -1);
        return -1;
    }
    noteMorePictures(bytes, name, job_);
    MeshTexture texture{std::move(*pixels), sampler.wrapU, sampler.wrapV, sampler.nearest};
    pixelBytes_ += texture.pixels.count() * sizeof(glm::u8vec4);
    if (pixelBytes_ > job_.limits.maxMemoryBytes)
        return fail(
            ErrorCode::invalidInput,
            "the model's textures together need more than the memory limit of {} MiB; raise "
            "it with --max-memory if the file is to be trusted",
            job_.limits.maxMemoryBytes >> 20);
    const int index = static_cast<int>(textures.size());
    textures.push_back(std::move(texture));
    first_.emplace(id, index);
    textures_.emplace(Key{id, sampler.wrapU, sampler.wrapV, sampler.nearest}, index);
    return index;
}

std::string percentDecoded(std::string_view uri) {
    const auto digit = [](char c) {
        if (c >= '0' && c <= '9') return c - '0';
        if (c >= 'a' && c <= 'f') return c - 'a' + 10;
        if (c >= 'A' && c <= 'F') return c - 'A' + 10;
        return -1;
    };
    std::string text;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        if (uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 &&
            digit(uri[i + 2]) >= 0) {
            text += static_cast<char>(digit(uri[i + 1]) * 16 + digit(uri[i + 2]));
            i += 2;
        } else {
            text += uri[i];
        }
    }
    return text;
}

bool hasUriScheme(std::string_view name) {
    const auto colon = name.find(':');
    if (colon == std::string_view::npos || colon < 2) return false;
    return std::all_of(name.begin(), name.begin() + static_cast<std::ptrdiff_t>(colon), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '+' || c == '-' || c == '.';
    });
}

}  // namespace stx
