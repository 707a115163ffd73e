#include <iterator>

#include "lib/render/bench/bench.hpp"

namespace stx {
std::string benchText(const BenchReport& report) {
    std::string out;
    auto to = std::back_inserter(out);
    fmt::format_to(to, "GPU: {}\nCPU: {}, {} threads\n",
                   report.device.empty() ? "none" : report.device, report.processor,
                   report.threads);
    int table = 0;
    for (const BenchRow& row : report.rows) {
        if (row.table != table) {
            table = row.table;
            fmt::format_to(
                to, "\nTable {}: {}\n{:>10} {:>10}  {:<12}{:<8}{:>12}{:>14}\n", table,
                table == 1 ? "an object, views of 256x256" : "a full scene, views of 1024x768",
                "references", "points", "path", "splats", "frames/s", "Mpoints/s");
        }
        fmt::format_to(to, "{:>10} {:>10}  {:<12}{:<8}{:>12.2f}{:>14.2f}\n", row.references,
                       row.points, row.path, row.splat, row.fps, row.mpps);
    }
    return out;
}

}  // namespace stx
