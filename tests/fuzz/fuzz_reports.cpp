// Reports of shards, as `stx report merge` takes them: any text is joined, or one error.

#include "tests/fuzz/violated.hpp"
#include "tools/report_merge.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    tools::MergedReport merged;
    const auto added = merged.add(text);
    if (!added) {
        if (added.error().message.empty()) violated("an error has a message");
        return 0;
    }
    // A report that ended before its work tells of no inputs.
    if (merged.total() == 0) return 0;
    const auto counts = merged.counts();
    if (counts.ok + counts.skipped + counts.failed + merged.missingCount() != merged.total())
        violated("each input is counted once");
    if (merged.missing().size() > merged.total() - merged.missingCount() + 1)
        violated("gaps lie between entries");
    if (counts.ok + counts.skipped + counts.failed > 0 && merged.text().empty())
        violated("what is counted is written");
    return 0;
}
