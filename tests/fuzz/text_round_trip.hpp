#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "formats/mpeg4/scene/document.hpp"
#include "lib/base/job.hpp"
#include "tests/fuzz/violated.hpp"

namespace stx {

/// A document that a fuzzer's text gave, and what became of it in writing and reading again.
struct TextRoundTrip {
    mpeg4::Document document, again;
    std::string written;
};

/// What reads can be written (or is refused as unsupported), and what is written reads. Nothing
/// when the text does not read, or is unsupported in writing.
template <class Read, class Write>
std::optional<TextRoundTrip> textRoundTrip(std::string_view text, const Read& read,
                                           const Write& write, Job& job) {
    auto document = read(text, "fuzz", job);
    if (!document) return std::nullopt;
    auto written = write(*document, job);
    if (!written) {
        if (written.error().code != ErrorCode::unsupported) violated("what reads can be written");
        return std::nullopt;
    }
    auto again = read(*written, "again", job);
    if (!again) violated("what is written reads", again.error().text() + "\n" + *written);
    return TextRoundTrip{std::move(*document), std::move(*again), std::move(*written)};
}

}  // namespace stx
