// Text calibrations: MSR, Middlebury, trajectories. The first byte chooses.

#include <cmath>
#include <cstdlib>

#include "formats/imagesets/middlebury.hpp"
#include "formats/imagesets/msr.hpp"
#include "formats/imagesets/rgbd.hpp"

using namespace stx;
using namespace stx::imagesets;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 1) return 0;
    const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
    const Limits limits;
    switch (data[0] % 3) {
        case 0:
            if (const auto cameras = parseMsrCalibration(text, limits))
                for (const MsrCamera& c : *cameras)
                    if (c.fx == 0 || !std::isfinite(c.translation.x)) std::abort();
            break;
        case 1:
            if (const auto c = parseMiddlebury(text, limits))
                if (!(c->f > 0 && c->baseline > 0)) std::abort();
            break;
        default:
            if (const auto poses = parseTrajectory(text))
                for (const TimedPose& pose : *poses)
                    if (!(std::abs(glm::length(pose.orientation) - 1) < 1e-6)) std::abort();
    }
    return 0;
}
