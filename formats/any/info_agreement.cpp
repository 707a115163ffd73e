#include "formats/any/info_agreement.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "lib/base/printable.hpp"
#include "lib/refine/poses.hpp"
#include "lib/registration/disagreement_by_view.hpp"

namespace stx {
namespace {

std::string percentOf(const nlohmann::ordered_json& share) {
    return fmt::format("{:.2f} %", 100 * share.get<double>());
}

std::string quotedName(const nlohmann::ordered_json& name) {
    return "'" + printable(name.get_ref<const std::string&>()) + "'";
}

}  // namespace

Result<nlohmann::ordered_json> agreementJson(const ViewTable& table, bool notes, Job& job) {
    const Bundle& bundle = table.about();
    STX_TRY(const DepthDisagreement found, measureDepthDisagreement(table, job));
    auto out = nlohmann::ordered_json::array();
    for (std::size_t v = 0; v < bundle.views.size(); ++v) {
        const ViewDisagreement& of = found.views[v];
        out.push_back({{"view", bundle.views[v].name}, {"partners", of.partners}});
        auto& view = out.back();
        if (of.beyond > 0) view["beyond"] = of.beyond;
        if (of.partners == 0) {
            if (of.beyond > 0) view["disagrees"] = true;
            continue;
        }
        view["overlap"] = of.overlap;
        view["disagreement"] = of.relative;
        view["oneSurface"] = of.oneSurface;
        view["disagrees"] = of.disagrees();
        view["most"] = {{"view", bundle.views[of.farthest].name}, {"disagreement", of.farthestBy}};
    }
    if (const auto note = disagreementNote(bundle, found, posesWereAligned(bundle)); note && notes)
        job.note(*note);
    return out;
}

std::string agreementText(const nlohmann::ordered_json& agreement) {
    std::size_t width = 4;
    for (const auto& view : agreement) width = std::max(width, quotedName(view["view"]).size());
    std::string out = fmt::format(
        "agreement: by what share of the distance views differ from those that overlap them; ! is "
        "more than one surface\n{:<{}}  views  overlap   differs  one surface  most from\n",
        "view", width);
    for (const auto& view : agreement) {
        out += fmt::format("{:<{}}  {:>5}", quotedName(view["view"]), width,
                           view["partners"].get<int>());
        const bool beyond = view.contains("beyond");
        const std::string differs =
            beyond                  ? fmt::format("> {:g} %", 100 * view["beyond"].get<double>())
            : view.contains("most") ? percentOf(view["disagreement"])
                                    : "";
        if (beyond && !view.contains("most")) out += fmt::format("{:9}  {:>7}!", "", differs);
        if (view.contains("most"))
            out += fmt::format(
                "  {:>5.0f} %  {:>7}{}  {:>11}  {} {}", 100 * view["overlap"].get<double>(),
                differs, view["disagrees"].get<bool>() ? '!' : ' ', percentOf(view["oneSurface"]),
                quotedName(view["most"]["view"]), percentOf(view["most"]["disagreement"]));
        out += "\n";
    }
    return out;
}

}  // namespace stx
