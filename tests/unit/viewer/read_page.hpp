#pragma once

#include <map>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/files/deflate.hpp"
#include "formats/images/images.hpp"
#include "formats/viewer/viewer_page.hpp"

namespace stx::pages {

using Json = nlohmann::json;

/// Units of UTF-16, lowest byte first.
inline std::u16string unitsOf(std::string_view bytes) {
    std::u16string out(bytes.size() / 2, u'\0');
    for (std::size_t i = 0; i < out.size(); ++i)
        out[i] = static_cast<char16_t>(static_cast<unsigned char>(bytes[2 * i]) |
                                       static_cast<unsigned char>(bytes[2 * i + 1]) << 8);
    return out;
}

/// What pageText() wrote, digit by digit.
inline Bytes bytesOfPageText(const std::u16string& text) {
    std::vector<std::uint64_t> values;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const std::uint64_t digit = text[i] - 0x2100u;
        EXPECT_LT(digit, 46341u);
        if (i % 2 == 0)
            values.push_back(digit);
        else
            values.back() += 46341 * digit;
    }
    Bytes bytes(values.at(0));
    for (std::size_t i = 0; i < bytes.size() * 8; ++i) {
        if (values.at(1 + i / 31) >> i % 31 & 1) bytes[i / 8] |= std::byte(1u << i % 8);
    }
    return bytes;
}

/// What packedPageText() wrote; its size is not told, and below a megabyte.
inline std::string unpackedPageText(const std::u16string& text) {
    const Bytes packed = bytesOfPageText(text);
    std::string out;
    for (std::size_t size = 1; size < 1 << 20; ++size) {
        out.resize(size);
        if (inflateZlib(packed, std::as_writable_bytes(std::span(out)))) return out;
    }
    ADD_FAILURE() << "not a stream of zlib";
    return out;
}

/// A page as a browser finds it.
struct ReadPage {
    std::string text;                               ///< what is ASCII of it, else '?'
    std::map<std::string, std::u16string> scripts;  ///< by id

    [[nodiscard]] Json json(const std::string& id) const {
        return Json::parse(unpackedPageText(scripts.at(id)));
    }
    [[nodiscard]] DecodedImage image(int number) const {
        const Bytes bytes = bytesOfPageText(scripts.at(fmt::format("image{}", number)));
        auto image = decodeImage(bytes, "page", Limits());
        EXPECT_TRUE(image);
        return std::move(*image);
    }
    [[nodiscard]] int count(const std::string& name) const {
        int n = 0;
        while (scripts.contains(fmt::format("{}{}", name, n))) ++n;
        return n;
    }
};

inline ReadPage readPage(const std::filesystem::path& path) {
    const auto bytes = readFile(path, Limits());
    EXPECT_TRUE(bytes);
    ReadPage page;
    const std::u16string units =
        unitsOf({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
    EXPECT_EQ(units[0], u'\ufeff') << "no mark of UTF-16";
    for (const char16_t unit : units) page.text += unit < 128 ? static_cast<char>(unit) : '?';
    const std::string begin = "<script type=\"", id = "\" id=\"", end = "</script>";
    for (std::size_t at = 0; (at = page.text.find(begin, at)) != std::string::npos;) {
        const std::size_t name = page.text.find(id, at) + id.size();
        const std::size_t close = page.text.find("\">", name);
        const std::size_t last = page.text.find(end, close);
        page.scripts[page.text.substr(name, close - name)] =
            units.substr(close + 2, last - close - 2);
        at = last;
    }
    return page;
}

inline Result<PageReport> write(Bundle bundle, const std::filesystem::path& path, Job& job,
                                const PageOptions& options = {"bundle.mp4", {}, {}, {}}) {
    const auto still = sequenceOf(std::move(bundle));
    return writeViewerPage(*still, path, options, job);
}

}  // namespace stx::pages
