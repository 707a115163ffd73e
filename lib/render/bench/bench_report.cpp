#include <iterator>

#include "lib/render/bench/bench.hpp"

namespace stx {
namespace {

std::string escaped(std::string_view text, bool forXml) {
    std::string out;
    for (const char c : text) {
        if (forXml && c == '<')
            out += "&lt;";
        else if (forXml && c == '>')
            out += "&gt;";
        else if (forXml && c == '&')
            out += "&amp;";
        else if (!forXml && (c == '"' || c == '\\'))
            out += std::string("\\") + c;
        else if (static_cast<unsigned char>(c) < 0x20)
            out += ' ';
        else
            out += c;
    }
    return out;
}

/// The measurements in a row of the paper's tables: one scene, all paths.
std::vector<std::vector<const BenchRow*>> byScene(const BenchReport& report) {
    std::vector<std::vector<const BenchRow*>> out;
    for (const auto& row : report.rows) {
        if (out.empty() || out.back()[0]->table != row.table ||
            out.back()[0]->references != row.references)
            out.emplace_back();
        out.back().push_back(&row);
    }
    return out;
}

std::string sceneName(const BenchRow& row) {
    return fmt::format("{}, {} reference{}", row.table == 1 ? "object 256x256" : "scene 1024x768",
                       row.references, row.references == 1 ? "" : "s");
}

}  // namespace

std::string benchText(const BenchReport& report) {
    std::string out;
    auto to = std::back_inserter(out);
    fmt::format_to(to, "GPU: {}\nCPU: {}, {} threads\n",
                   report.device.empty() ? "none" : report.device, report.processor,
                   report.threads);
    int table = 0;
    for (const auto& scene : byScene(report)) {
        const BenchRow& first = *scene[0];
        if (first.table != table) {
            table = first.table;
            fmt::format_to(
                to, "\nTable {}: {}\n{:>10} {:>10}  {:<12}{:<8}{:>12}{:>14}\n", table,
                table == 1 ? "an object, views of 256x256" : "a full scene, views of 1024x768",
                "references", "points", "path", "splats", "frames/s", "Mpoints/s");
        }
        for (const BenchRow* row : scene)
            fmt::format_to(to, "{:>10} {:>10}  {:<12}{:<8}{:>12.2f}{:>14.2f}\n", row->references,
                           row->points, row->path, row->splat, row->fps, row->mpps);
    }
    return out;
}

std::string benchJson(const BenchReport& report) {
    std::string out;
    auto to = std::back_inserter(out);
    fmt::format_to(to, "{{\"device\":\"{}\",\"processor\":\"{}\",\"threads\":{},\"rows\":[",
                   escaped(report.device, false), escaped(report.processor, false), report.threads);
    for (std::size_t i = 0; i < report.rows.size(); ++i) {
        const BenchRow& row = report.rows[i];
        fmt::format_to(
            to,
            "{}\n{{\"table\":{},\"references\":{},\"points\":{},\"path\":\"{}\",\"splat\":\"{}\","
            "\"fps\":{:.3f},"
            "\"mpps\":{:.3f}}}",
            i ? "," : "", row.table, row.references, row.points, row.path, row.splat, row.fps,
            row.mpps);
    }
    out += "\n]}\n";
    return out;
}

std::string benchSvg(const BenchReport& report) {
    constexpr int kLeft = 210, kRight = 90, kBar = 16, kGap = 14, kTop = 64, kPlot = 560;
    const std::vector<std::string> colours{"#3b6fb6", "#d98032", "#4f9d5d", "#7a5fa8",
                                           "#8a8a8a", "#b0413e", "#2f9c95"};
    const auto colourOf = [&](const std::string& path) -> const std::string& {
        const auto at = std::find(benchPaths().begin(), benchPaths().end(), path);
        return colours[static_cast<std::size_t>(at - benchPaths().begin()) % colours.size()];
    };
    const auto scenes = byScene(report);
    double low = 1e300, high = 0;
    for (const auto& row : report.rows) {
        low = std::min(low, row.mpps);
        high = std::max(high, row.mpps);
    }
    if (!(high > 0)) low = high = 1;
    const double from = std::floor(std::log10(low * 0.7)), until = std::ceil(std::log10(high));
    const double decades = std::max(1.0, until - from);
    const auto x = [&](double mpps) {
        return kLeft + kPlot * std::clamp((std::log10(mpps) - from) / decades, 0.0, 1.0);
    };
    int height = kTop + 40;
    for (const auto& scene : scenes) height += static_cast<int>(scene.size()) * kBar + kGap;

    std::string out;
    auto to = std::back_inserter(out);
    fmt::format_to(
        to,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 "
        "{0} {1}\" font-family=\"sans-serif\" font-size=\"12\">\n"
        "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n"
        "<text x=\"12\" y=\"22\" font-size=\"15\">Million points a second</text>\n"
        "<text x=\"12\" y=\"42\" fill=\"#555\">{2}; {3}, {4} threads</text>\n",
        kLeft + kPlot + kRight, height,
        report.device.empty() ? "no GPU" : escaped(report.device, true),
        escaped(report.processor, true), report.threads);
    for (int d = 0; d <= static_cast<int>(decades); ++d) {
        const double value = std::pow(10.0, from + d), at = x(value);
        fmt::format_to(
            to,
            "<line x1=\"{0:.1f}\" y1=\"{1}\" x2=\"{0:.1f}\" y2=\"{2}\" stroke=\"#ddd\"/>\n"
            "<text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4:g}</text>\n",
            at, kTop - 8, height - 30, height - 14, value);
    }
    int y = kTop;
    for (const auto& scene : scenes) {
        fmt::format_to(to, "<text x=\"12\" y=\"{}\">{}</text>\n", y + 12, sceneName(*scene[0]));
        fmt::format_to(to, "<text x=\"12\" y=\"{}\" fill=\"#555\">{} points</text>\n", y + 28,
                       scene[0]->points);
        for (const BenchRow* row : scene) {
            fmt::format_to(to,
                           "<rect x=\"{}\" y=\"{}\" width=\"{:.1f}\" height=\"{}\" fill=\"{}\"/>\n"
                           "<text x=\"{:.1f}\" y=\"{}\">{} {:.1f}</text>\n",
                           kLeft, y, std::max(1.0, x(row->mpps) - kLeft), kBar - 3,
                           colourOf(row->path), x(row->mpps) + 5, y + 11,
                           row->splat == "paper" ? row->path + " (paper)" : row->path, row->mpps);
            y += kBar;
        }
        y += kGap;
    }
    out += "</svg>\n";
    return out;
}

}  // namespace stx
