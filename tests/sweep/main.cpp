// Checks rules on random cases; tests/sweep/run calls it, and tests/README.md says what the rules
// are.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "formats/stx/stx.hpp"
#include "tests/sweep/measures.hpp"
#include "tests/sweep/random.hpp"
#include "tests/sweep/rules.hpp"
#include "tests/sweep/sensor.hpp"

namespace {

struct Options {
    std::uint64_t seed = 1;
    int first = 0, cases = 1;
    std::string set;                ///< changes of fields
    std::vector<std::string> only;  ///< these rules, in every case
    std::string keep;               ///< folder for the files of a case
    bool measure = false;
    bool reduce = true;
};

/// What a rule finds in one picture; nothing when it holds or says nothing about it.
std::optional<Measure> measureOf(const SweepRule& rule, Pictures& pictures) {
    auto measured = rule.measure(pictures);
    if (!measured) return Measure{1e9, "error: " + measured.error().message};
    return std::move(*measured);
}

/// What several pictures say of one rule.
struct Sample {
    double sum = 0, squares = 0;
    int count = 0;

    void add(double value) {
        sum += value;
        squares += value * value;
        ++count;
    }
    [[nodiscard]] double mean() const { return sum / count; }
    /// The mean is known within this: two standard errors.
    [[nodiscard]] double within() const {
        return 2 * std::sqrt(std::max(0.0, squares / count - mean() * mean()) / (count - 1));
    }
};

/// What a rule finds in a case; nothing when it holds. A few pixels at edges make one picture of
/// some thousand pixels worse by half a decibel, and the next better: where the picture of a case
/// is off by decibels, others from places beside it judge. Their mean counts by what is sure of
/// it; when eight do not tell, more are asked.
std::optional<Measure> findingOf(const SweepRule& rule, Pictures& pictures) {
    auto finding = measureOf(rule, pictures);
    if (!finding || finding->amount() <= rule.allowed) return std::nullopt;
    if (std::string_view(rule.unit) != "dB") return finding;
    const double here = finding->found;
    constexpr int kFirst = 8;
    Sample sample;
    for (const SweepCase& beside : pictures.captured().from.besides()) {
        const auto captured = capturedOf(beside);
        if (!captured) continue;
        Pictures others(*captured);
        const auto measured = measureOf(rule, others);
        if (!measured) continue;
        sample.add(measured->found);
        if (sample.count < kFirst) continue;
        finding->found = sample.mean();
        if (finding->amount() <= rule.allowed) return std::nullopt;
        if (finding->amount() - sample.within() > rule.allowed) break;
    }
    if (sample.count < 2) return finding;
    finding->found = sample.mean();
    if (finding->amount() - sample.within() <= rule.allowed) return std::nullopt;
    finding->what += fmt::format("; {:.2f} dB here, mean of {} beside, sure within {:.2f}", here,
                                 sample.count, sample.within());
    return finding;
}

/// The simplest case of its kind in which the rule still finds something.
SweepCase reduced(const SweepCase& found, const SweepRule& rule) {
    SweepCase current = found;
    constexpr int kTries = 40;
    int tries = 0;
    for (bool simpler = true; simpler && tries < kTries;) {
        simpler = false;
        for (const SweepCase& candidate : current.simpler()) {
            if (++tries > kTries) break;
            const auto captured = capturedOf(candidate);
            if (!captured) continue;
            Pictures pictures(*captured);
            if (!findingOf(rule, pictures)) continue;
            current = candidate;
            simpler = true;
            break;
        }
    }
    return current;
}

std::string repeatOf(const SweepCase& c, const SweepRule& rule) {
    const std::string changes = c.changes();
    return fmt::format("tests/sweep/run --seed {} --first {} --cases 1 --rule {}{}", c.seed,
                       c.number, rule.name, changes.empty() ? "" : " --set " + changes);
}

/// The bundle, the truth and the camera of a case as files, and what draws it.
stx::Result<void> keep(const Captured& captured, const std::filesystem::path& folder) {
    using namespace stx;
    Job job;
    std::filesystem::create_directories(folder);
    STX_CHECK(save(captured.bundle, folder / "case.exr", {}, job));
    std::string what;
    STX_CHECK(save(sensor::recorded(captured, what), folder / "recorded.exr", {}, job));
    double share = 0;
    STX_CHECK(save(measures::noisyViews(Pictures(captured), share), folder / "noisy.exr", {}, job));
    Bundle truth;
    truth.views = {captured.truth};
    truth.views[0].name = "truth";
    STX_CHECK(save(truth, folder / "truth.exr", {}, job));
    fmt::print(
        "  stx extract {0}/truth.exr -o {0}/truth\n"
        "  stx render {0}/case.exr -o {0}/picture.png --cameras {0}/truth/transforms.json --fill "
        "none\n"
        "  stx compare {0}/picture.png {0}/truth/images/truth.png\n",
        folder.string());
    return {};
}

int check(const Options& options) {
    int findings = 0;
    for (int number = options.first; number < options.first + options.cases; ++number) {
        SweepCase c = SweepCase::draw(options.seed, number);
        for (std::size_t from = 0; from < options.set.size();) {
            const std::size_t to = std::min(options.set.find(',', from), options.set.size());
            if (const auto set = c.set(options.set.substr(from, to - from)); !set) {
                fmt::print(stderr, "sweep: {}\n", set.error().message);
                return 1;
            }
            from = to + 1;
        }
        // Before anything is drawn: who stops here is named by `run`.
        fmt::print("case {}:{} {}\n", options.seed, number, c.describe());
        std::fflush(stdout);
        const auto captured = capturedOf(c);
        if (!captured) {
            fmt::print("  skipped: {}\n", captured.error().message);
            continue;
        }
        if (!options.keep.empty()) {
            if (const auto kept = keep(*captured, options.keep); !kept)
                fmt::print("  {}\n", kept.error().message);
        }
        Pictures pictures(*captured);
        Random random(options.seed * 9176 + static_cast<std::uint64_t>(number) * 13 + 1);
        for (const SweepRule& rule : rules()) {
            const bool asked = random.chance(rule.share);
            if (options.only.empty() ? !asked : !std::ranges::count(options.only, rule.name))
                continue;
            if (options.measure) {
                const auto start = std::chrono::steady_clock::now();
                const auto measured = rule.measure(pictures);
                const double ms = std::chrono::duration<double, std::milli>(
                                      std::chrono::steady_clock::now() - start)
                                      .count();
                if (!measured)
                    fmt::print("  {} error {}\n", rule.name, measured.error().message);
                else if (*measured)
                    fmt::print("  {} {:.3f} {} ({}; {:.0f} ms)\n", rule.name, (*measured)->found,
                               rule.unit, (*measured)->what, ms);
                continue;
            }
            const auto finding = findingOf(rule, pictures);
            if (!finding) continue;
            ++findings;
            fmt::print("FINDING {}: {}; {:.2f} {}, allowed {} ({})\n  {}\n  {}\n", rule.name,
                       rule.sentence, finding->found, rule.unit, rule.allowed, finding->what,
                       c.describe(), repeatOf(c, rule));
            std::fflush(stdout);
            if (!options.reduce) continue;
            const SweepCase small = reduced(c, rule);
            if (small.changes() != c.changes())
                fmt::print("  reduced: {}\n  {}\n", small.describe(), repeatOf(small, rule));
            std::fflush(stdout);
        }
    }
    return findings > 0 ? 7 : 0;
}

}  // namespace

int main(int argc, char** argv) {
    Options options;
    CLI::App app("Checks rules on random scenes, captures and cameras");
    app.add_option("--seed", options.seed, "of all cases");
    app.add_option("--first", options.first, "number of the first case");
    app.add_option("--cases", options.cases, "how many");
    app.add_option("--set", options.set, "fields to change, as in views=3,width=24");
    app.add_option("--rule", options.only, "only this rule, in every case; again for more");
    app.add_option("--keep", options.keep, "folder for the files of a case");
    app.add_flag("--measure", options.measure, "prints what the rules measure, judges nothing");
    app.add_flag("--reduce,!--no-reduce", options.reduce,
                 "looks for the simplest case of a finding");
    CLI11_PARSE(app, argc, argv);
    return check(options);
}
