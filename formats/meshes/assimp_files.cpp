#include "formats/meshes/assimp_files.hpp"

#include <cstring>

#include "formats/meshes/text_encoding.hpp"

namespace stx {
namespace {

class MemoryStream final : public Assimp::IOStream {
  public:
    explicit MemoryStream(ByteSpan bytes) : bytes_(bytes) {}
    explicit MemoryStream(Bytes owned) : owned_(std::move(owned)), bytes_(owned_) {}

    std::size_t Read(void* to, std::size_t size, std::size_t count) override {
        if (size == 0 || count == 0) return 0;
        const auto n = std::min(count, (bytes_.size() - at_) / size);
        if (n > 0) std::memcpy(to, bytes_.data() + at_, n * size);
        at_ += n * size;
        return n;
    }
    std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
    aiReturn Seek(std::size_t offset, aiOrigin origin) override {
        const auto base = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? at_ : bytes_.size();
        if (offset > bytes_.size() - base) return aiReturn_FAILURE;
        at_ = base + offset;
        return aiReturn_SUCCESS;
    }
    std::size_t Tell() const override { return at_; }
    std::size_t FileSize() const override { return bytes_.size(); }
    void Flush() override {}

  private:
    Bytes owned_;
    ByteSpan bytes_;
    std::size_t at_ = 0;
};

}  // namespace

std::string AssimpFiles::relative(const char* name) const {
    std::string_view text(name);
    while (text.starts_with("./")) text.remove_prefix(2);
    if (text.starts_with(kFolder)) {
        text.remove_prefix(std::strlen(kFolder));
        // Assimp joins folder and name with one slash too many at times.
        while (text.starts_with('/')) text.remove_prefix(1);
    }
    return std::string(text);
}

bool AssimpFiles::Exists(const char* name) const {
    const auto file = relative(name);
    if (file == modelName_) return true;
    const auto path = files_.find(file);
    if (!path && missing_.empty())
        missing_ = fmt::format("'{}' {}", file, whyNotThere(path.error()));
    return path.has_value();
}

Assimp::IOStream* AssimpFiles::Open(const char* name, const char*) {
    const auto file = relative(name);
    if (file == modelName_) return new MemoryStream(model_);
    const auto path = files_.find(file);
    if (!path) {
        if (missing_.empty()) missing_ = fmt::format("'{}' {}", file, whyNotThere(path.error()));
        return nullptr;
    }
    // Files that name their materials thousands of times: once read, all is known.
    if (!opened_.insert(path->string()).second) {
        static constexpr std::string_view kNothing = "# This file has been read already.\n";
        return new MemoryStream(std::as_bytes(std::span(kNothing)));
    }
    auto bytes = readFile(*path, files_.job().limits);
    if (!bytes) {
        if (!error_) error_ = bytes.error().at(fmt::format("material file '{}'", file));
        return nullptr;
    }
    if (auto text = utf8FromMarked(*bytes)) *bytes = std::move(*text);
    if (sideTexts_.empty()) {
        const auto folder = path->parent_path().lexically_relative(files_.folder());
        if (folder != ".") materialFolder_ = folder.generic_string();
    }
    sideTexts_.emplace_back(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    return new MemoryStream(std::move(*bytes));
}

}  // namespace stx
