#include "tools/stage_options.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stx::tools {

Result<void> leaveOut(const std::string& names, RenderSettings& settings) {
    for (std::size_t at = 0; at <= names.size();) {
        const std::size_t end = std::min(names.find(',', at), names.size());
        const std::string name = names.substr(at, end - at);
        at = end + 1;
        const auto named = [&](const auto& info) { return info.name == name; };
        const auto all = stages();
        if (const auto s = std::find_if(all.begin(), all.end(), named); s != all.end()) {
            settings.without.add(s->stage);
        } else if (const auto step =
                       std::find_if(refineSteps().begin(), refineSteps().end(), named);
                   step != refineSteps().end()) {
            settings.refine.set(step->step, false);
        } else {
            std::string steps;
            for (const RefineStepInfo& i : refineSteps()) steps += ", " + std::string(i.name);
            return fail(ErrorCode::usage, "there is no stage '{}'; stages are: {}{}", name,
                        stageNames(), steps);
        }
    }
    return {};
}

std::string stageNames() {
    std::string names;
    for (const StageInfo& s : stages()) names += (names.empty() ? "" : ", ") + std::string(s.name);
    return names;
}

std::string explained(const StageLog& log, std::size_t frames) {
    const auto entries = log.entries();
    double once = 0, each = 0;
    // Parts of "prepare" that have rows of their own.
    const auto isPart = [](const StageLog::Entry& e) {
        return e.name == "creases" || e.name == "levels";
    };
    for (const auto& e : entries)
        if (!isPart(e)) (e.once ? once : each) += e.milliseconds;
    std::string text = fmt::format("{:<14}{:>12}{:>8}{:>12}  (of processors, all threads)\n",
                                   "stage", "ms", "share", "pixels");
    for (const bool before : {true, false}) {
        const double all = before ? once : each;
        const double count = before ? 1 : static_cast<double>(std::max<std::size_t>(frames, 1));
        text += before ? "once:\n" : "each picture:\n";
        for (const auto& e : entries)
            if (e.once == before)
                text += fmt::format(
                    "  {:<12}{:>12.2f}{:>7.1f}%{:>12}\n", (isPart(e) ? "- " : "") + e.name,
                    e.milliseconds / count, all > 0 ? 100 * e.milliseconds / all : 0.0,
                    e.pixels > 0 ? fmt::format("{:.0f}", static_cast<double>(e.pixels) / count)
                                 : "");
    }
    return text;
}

nlohmann::ordered_json stagesJson(const StageLog& log) {
    auto list = nlohmann::ordered_json::array();
    for (const auto& e : log.entries())
        list.push_back({{"name", e.name},
                        {"once", e.once},
                        {"milliseconds", e.milliseconds},
                        {"pixels", e.pixels}});
    return list;
}

}  // namespace stx::tools
