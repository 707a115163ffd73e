// Long lists of frames are parsed in parts; what comes out is what the library makes of the whole.

#include <gtest/gtest.h>

#include "formats/imagesets/json_values.hpp"

using namespace stx;
using imagesets::Json;
using imagesets::parseJson;

namespace {

constexpr int kMany = 2000;

Result<Json> parse(const std::string& text) {
    return parseJson(std::as_bytes(std::span(text.data(), text.size())));
}

/// A file of so many frames, one a line, `other` in the place of frame 1500.
std::string film(const std::string& other = "", const std::string& after = "") {
    std::string text =
        "{\"w\": 96, \"note\": \"a \\\"frames\\\": [1, 2] in words\",\n\"frames\"\n : [";
    for (int i = 0; i < kMany; ++i) {
        if (i > 0) text += ",\n";
        if (i == 1500 && !other.empty())
            text += other;
        else
            text += "{\"file_path\": \"a],[{" + std::to_string(i) + "\\\\\", \"m\": [[" +
                    std::to_string(i) + ".25, 1], [-1e-3]], \"o\": {\"k\": [], \"frames\": [3]}}";
    }
    return text + " ]" + after + ", \"h\": 64}\n";
}

TEST(ParseJson, AFilmsFramesAreAsTheLibraryReadsThem) {
    for (const std::string& text :
         {film(), film("17"), film("[\"x,y\"]"), film("", ", \"frames\": [4, 5]"),
          film("", ", \"frames\": []"), film("", ", \"others\": [1]")}) {
        const auto json = parse(text);
        ASSERT_TRUE(json) << json.error().text();
        EXPECT_TRUE(*json == Json::parse(text)) << text.substr(text.size() - 60);
    }
    EXPECT_EQ((*parse(film()))["frames"].size(), static_cast<std::size_t>(kMany));
}

TEST(ParseJson, TellsTheLineOfAFaultInAFilm) {
    // Frame 1500 is in line 2 + 1 + 1500.
    for (const char* fault : {"{\"a\": }", "1 2", " ", "}", "]"}) {
        const auto json = parse(film(fault));
        ASSERT_FALSE(json) << fault;
        EXPECT_NE(json.error().text().find("this is not valid JSON"), std::string::npos) << fault;
    }
    EXPECT_NE(parse(film("{\"a\": }")).error().text().find("line 1503"), std::string::npos)
        << parse(film("{\"a\": }")).error().text();
    const std::string deep = film(std::string(100, '[') + std::string(100, ']'));
    EXPECT_NE(parse(deep).error().text().find("nested deeper than 64"), std::string::npos);
}

}  // namespace
