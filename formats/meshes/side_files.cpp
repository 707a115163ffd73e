#include "formats/meshes/side_files.hpp"

#include "formats/files/text_encoding.hpp"
#include "formats/meshes/model_wire.hpp"

namespace stx {
namespace {

/// As the model names it.
std::string relative(std::string_view name) {
    const std::string_view folder = models::kModelFolder;
    while (name.starts_with("./")) name.remove_prefix(2);
    if (name.starts_with(folder)) {
        name.remove_prefix(folder.size());
        // Folder and name are joined with one slash too many at times.
        while (name.starts_with('/')) name.remove_prefix(1);
    }
    return std::string(name);
}

Bytes bytesOf(std::string_view text) {
    const auto bytes = std::as_bytes(std::span(text));
    return {bytes.begin(), bytes.end()};
}

}  // namespace

std::optional<std::filesystem::path> SideFiles::find(const std::string& file) {
    auto path = files_.find(file);
    if (path) return std::move(*path);
    if (missing_.empty())
        missing_ = fmt::format("'{}' {}", file, files_.whyNotThere(file, path.error()));
    return std::nullopt;
}

bool SideFiles::exists(std::string_view name) {
    return find(relative(name)).has_value();
}

std::optional<Bytes> SideFiles::read(std::string_view name) {
    const auto file = relative(name);
    std::optional<std::string> text;
    if (const auto path = find(file)) {
        text = readFound(file, *path);
    } else {
        for (const auto& each : materialFilesIn(file)) {
            const auto one = files_.find(each);
            if (!one) continue;
            const auto more = readFound(each, *one);
            if (!more) return std::nullopt;
            text = text.value_or("") + *more + '\n';
        }
    }
    if (!text) return std::nullopt;
    return bytesOf(*text);
}

std::optional<std::string> SideFiles::readFound(const std::string& file,
                                                const std::filesystem::path& path) {
    // Files that name their materials thousands of times: once read, all is known.
    if (!opened_.insert(path.string()).second) return "# This file has been read already.\n";
    auto bytes = readFile(path, files_.job().limits);
    if (!bytes) {
        if (!error_) error_ = bytes.error().at(fmt::format("material file '{}'", file));
        return std::nullopt;
    }
    if (auto text = utf8FromMarked(*bytes)) *bytes = std::move(*text);
    hasMaterialFile_ = true;
    const auto folder = path.parent_path().lexically_relative(files_.folder());
    auto plain = plainMtl(textOf(*bytes), folder == "." ? "" : folder.generic_string(), materials_);
    if (const auto count = plain.unread.size(); count > 0)
        files_.job().note(fmt::format("material file '{}', {}: the line is left out{}", file,
                                      plain.unread[0],
                                      count > 1 ? fmt::format(", and {} like it", count - 1) : ""));
    return std::move(plain.text);
}

}  // namespace stx
