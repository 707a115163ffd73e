#include "lib/base/printable.hpp"
#include "lib/selection/selection.hpp"

namespace stx {
std::string selectionPlotSvg(const Selection& selection, const std::string& title) {
    constexpr int kWidth = 720, kHeight = 440, kLeft = 64, kTop = 48, kRight = 24, kBottom = 56;
    const int count = std::max<int>(1, static_cast<int>(selection.quality.size()));
    const auto xOf = [&](int views) {
        return kLeft + static_cast<double>(views) / count * (kWidth - kLeft - kRight);
    };
    const auto yOf = [&](double quality) {
        return kTop + (1 - quality) * (kHeight - kTop - kBottom);
    };

    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} "
        "{1}\" "
        "font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" "
        "fill=\"#ffffff\"/>\n<text x=\"{2}\" y=\"28\" font-size=\"16\">{3}</text>\n",
        kWidth, kHeight, kLeft, xmlText(title));
    for (int percent = 0; percent <= 100; percent += 20) {
        const double y = yOf(percent / 100.0);
        svg += fmt::format(
            "<line x1=\"{}\" x2=\"{}\" y1=\"{:.2f}\" y2=\"{:.2f}\" stroke=\"#dddddd\"/>\n<text "
            "x=\"{}\" "
            "y=\"{:.2f}\" text-anchor=\"end\">{} %</text>\n",
            kLeft, kWidth - kRight, y, y, kLeft - 8, y + 4, percent);
    }
    const int every = (count + 15) / 16;
    for (int i = every; i <= count; i += every)
        svg += fmt::format("<text x=\"{:.2f}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", xOf(i),
                           kHeight - kBottom + 20, i);
    svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">reference views</text>\n",
                       (kLeft + kWidth - kRight) / 2, kHeight - 14);
    std::string points = fmt::format("{:.2f},{:.2f}", xOf(0), yOf(0));
    for (std::size_t i = 0; i < selection.quality.size(); ++i)
        points +=
            fmt::format(" {:.2f},{:.2f}", xOf(static_cast<int>(i) + 1), yOf(selection.quality[i]));
    svg += fmt::format(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#1f5fa8\" stroke-width=\"2\"/>\n", points);
    for (std::size_t i = 0; i < selection.quality.size() && count <= 100; ++i)
        svg += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"3\" fill=\"#1f5fa8\"/>\n",
                           xOf(static_cast<int>(i) + 1), yOf(selection.quality[i]));
    svg += fmt::format(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{} of {} views: at least {:.1f} % of the best "
        "possible, {:.1f} % of the surface seen</text>\n</svg>\n",
        kWidth - kRight - 8, kHeight - kBottom - 12, selection.views.size(), selection.candidates,
        100 * selection.certificate, 100 * selection.coverage);
    return svg;
}

}  // namespace stx
