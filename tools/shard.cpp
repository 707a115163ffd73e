#include "tools/shard.hpp"

#include <filesystem>
#include <span>

#include <nlohmann/json.hpp>

#include "lib/base/whole_number.hpp"
#include "lib/model/same_pictures.hpp"

namespace stx::tools {
namespace {

constexpr std::int64_t kMostShards = 1000000;

Result<void> parseShard(const std::string& text, Shard& shard) {
    const auto slash = text.find('/');
    const std::string_view view = text;
    const auto number = wholeNumber<std::int64_t>(view.substr(0, slash)).value_or(0);
    const auto count = slash == std::string::npos
                           ? 0
                           : wholeNumber<std::int64_t>(view.substr(slash + 1)).value_or(0);
    if (number < 1 || count < number || count > kMostShards)
        return fail(ErrorCode::usage,
                    "it is '{}'; K/N with 1 <= K <= N <= {} is expected, as in 3/8", text,
                    kMostShards);
    shard.number = number;
    shard.count = count;
    shard.given = true;
    return {};
}

}  // namespace

void Shard::addInputs(const std::vector<std::string>& names) {
    std::string all = job;
    // Their last part, as of other paths: machines may have copies in folders of their own.
    for (const std::string& name : names) {
        const std::filesystem::path path(name);
        all += '\0' + (path.has_filename() ? path : path.parent_path()).filename().string();
    }
    job = fmt::format("{:016x}", hashOf(std::as_bytes(std::span(all))));
}

Shard::Range Shard::rangeOf(std::size_t length) const {
    const auto n = static_cast<std::uint64_t>(count), k = static_cast<std::uint64_t>(number);
    return {static_cast<std::size_t>(length * (k - 1) / n),
            static_cast<std::size_t>(length * k / n)};
}

void addShardOption(Command c, Shard& shard, const char* what) {
    c.option(
         "--shard",
         [&shard, c](const std::string& text) {
             // But for what is of a run's machine, and of how it goes on where another stopped.
             shard.job = c.jobOf({"--shard", "--skip-existing", "--keep-going", "--jobs",
                                  "--backend", "--device", "--pipeline", "--explain"});
             return parseShard(text, shard);
         },
         fmt::format("Only part K of N of the {}, from 1: for N runs that do all of it without "
                     "speaking to each other; 'stx report merge' joins their reports",
                     what))
        .takes("K/N");
}

nlohmann::ordered_json shardJson(const Shard& shard, std::size_t total) {
    return {{"number", shard.number}, {"count", shard.count}, {"total", total}, {"job", shard.job}};
}

}  // namespace stx::tools
