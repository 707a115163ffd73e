#pragma once

#include <string>

#include <gtest/gtest.h>

#include "formats/mpeg4/mpeg4.hpp"
#include "formats/mpeg4/text/bt.hpp"
#include "formats/mpeg4/text/xmt.hpp"
#include "tests/unit/mpeg4/core_fixtures.hpp"

/// Documents written and read again; what fails is a failure of the test.
namespace stx::mpeg4 {

inline Document mustReadBt(const std::string& text) {
    Job job;
    auto document = readBt(text, "test.bt", job);
    if (!document) ADD_FAILURE() << document.error().text() << "\n" << text;
    return document ? std::move(*document) : Document();
}

inline std::string btOf(const Document& document) {
    Job job;
    auto text = writeBt(document, job);
    if (!text) ADD_FAILURE() << text.error().text();
    return text.value_or("");
}

/// The document as its own .xmt reads.
inline Document throughXmt(const Document& document) {
    Job job;
    const auto text = writeXmt(document, job);
    if (!text) {
        ADD_FAILURE() << text.error().text();
        return {};
    }
    auto back = readXmt(*text, "test.xmt", job);
    if (!back) ADD_FAILURE() << back.error().text() << "\n" << *text;
    return back ? std::move(*back) : Document();
}

/// What reading a text says.
inline std::string btErrorOf(const std::string& bt) {
    Job job;
    const auto document = readBt(bt, "test.bt", job);
    return document ? "no error" : document.error().text();
}

/// The document as its own .mp4 reads.
inline Document throughMp4(const Document& document, BifsStyle style = {}) {
    Job job;
    const auto bytes = writeMp4(document, job, {style});
    if (!bytes) {
        ADD_FAILURE() << bytes.error().text();
        return {};
    }
    auto back = readMp4(ByteSource::fromBytes(*bytes), job);
    if (!back) ADD_FAILURE() << back.error().text();
    return back ? std::move(*back) : Document();
}

}  // namespace stx::mpeg4
