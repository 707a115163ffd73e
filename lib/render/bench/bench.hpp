#pragma once

#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/render/api/renderer.hpp"

namespace stx {

/// What to measure (Lee & Park, tables 1 and 2; issue: `stx bench`).
struct BenchSettings {
    bool table1 = true;  ///< an object, 256x256 views, 4, 9 and 16 references
    bool table2 = true;  ///< a full scene, 1024x768 views, 1, 4 and 8 references
    int repeats = 5;     ///< frames measured for each row, after a warm one; 1 to 1000
    int device = -1;     ///< of listDevices(), -1 = the best
    /// Rule of the splats of shader, gl, software and compute: data, or paper (Lee & Park's own,
    /// size inversely proportional to the distance).
    SplatRule splat = SplatRule::data;
    /// Paths to measure; empty = all. Names as in BenchRow::path.
    std::vector<std::string> paths;
};

/// One measurement.
struct BenchRow {
    int table = 1;  ///< 1 or 2, as in the paper
    int references = 0;
    std::int64_t points = 0;
    /// The paper's three: "shader" (vertex texture fetch), "gl" (conventional OpenGL) and
    /// "software" (splats on the processor). Ours beside them: "compute" (splats by atomics on the
    /// GPU), "points" (one pixel each, on the processor), "surface" and
    /// "surface-gpu" (surface mode at normal quality on the processor and on the GPU, the time of
    /// reading back and of filling holes included; on software drivers only when named).
    std::string path;
    std::string splat;  ///< rule of its splats: "data", "paper" or "point"; empty in surface mode
    double fps = 0;     ///< frames a second, of the median frame, without reading it back
    double mpps = 0;    ///< million points a second
};

struct BenchReport {
    std::string device;     ///< GL_RENDERER; empty without one
    std::string processor;  ///< name and SIMD target
    int threads = 1;
    std::vector<BenchRow> rows;
};

/// All names that BenchSettings::paths takes, in their order in the tables.
[[nodiscard]] const std::vector<std::string>& benchPaths();

/// Makes the scenes and measures. Paths that this machine cannot run are left out with a note.
/// Errors: settings out of range, an unknown path, cancelled.
[[nodiscard]] Result<BenchReport> runBench(const BenchSettings& settings, Job& job);

/// The report as the paper's two tables, for people.
[[nodiscard]] std::string benchText(const BenchReport& report);

}  // namespace stx
