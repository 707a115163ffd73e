// Microsoft's 7-Scenes: frame-NNNNNN.color.png, .depth.png (16 bits, millimetres; 0 and 65535 are
// missing) and .pose.txt (camera to world, y down, z forward).

#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/messages.hpp"
#include "formats/imagesets/pictures.hpp"
#include "formats/imagesets/poses.hpp"
#include "formats/imagesets/text_lines.hpp"

namespace stx::imagesets {

Result<SetDescription> describeSevenScenes(const path& given, const ImageSetOptions& options,
                                           Job& job) {
    const std::string where = inQuotes(given.string());
    std::vector<std::string> stems;
    for (const std::string& name : filesIn(given))
        if (name.ends_with(".pose.txt")) stems.push_back(name.substr(0, name.size() - 9));
    if (stems.empty())
        return failAt(
            where, ErrorCode::io,
            "no frame-NNNNNN.pose.txt was found in it; give the folder of one sequence (seq-01)");
    STX_CHECK(
        checkViewCount(stems.size() / static_cast<std::size_t>(options.every), job.limits, where));
    SetDescription set;
    std::optional<glm::ivec2> size;
    for (const std::string& stem : stems) {
        const std::string poseName = stem + ".pose.txt";
        const std::string place = inQuotes((given / poseName).string());
        STX_TRY(const auto bytes, readFile(given / poseName, job.limits));
        std::vector<double> n;
        for (const TextLine& line : linesOf(textOf(bytes))) {
            for (const auto word : line.words()) {
                STX_TRY(const double value, within(place, numberOf(word, line.where())));
                n.push_back(value);
            }
            if (n.size() > 16) break;
        }
        if (n.size() != 16)
            return failAt(place, ErrorCode::invalidInput, "{} numbers; 4 rows of 4 are expected",
                          n.size());
        SetView view;
        view.name = stem;
        STX_CHECK(
            findPictures(given, stem + ".color.png", stem + ".depth.png", where, job.limits, view));
        if (view.missing) {
            set.views.push_back(std::move(view));
            continue;
        }
        if (!size) {
            STX_TRY(size, within(where, imageSizeOf(view.texture, job)));
        }
        VisionCamera v;
        const auto* k = options.intrinsics;
        v.fx = k[0] != 0 ? k[0] : 585;
        v.fy = k[0] != 0 ? k[1] : 585;
        v.cx = k[0] != 0 ? k[2] + 0.5 : 320;
        v.cy = k[0] != 0 ? k[3] + 0.5 : 240;
        if (v.fx == 0 || v.fy == 0)
            return failAt(where, ErrorCode::usage, "the focal lengths are {:g} and {:g}", v.fx,
                          v.fy);
        v.width = size->x;
        v.height = size->y;
        glm::dmat3 rotation;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column)
                rotation[column][row] = n[static_cast<std::size_t>(row * 4 + column)];
            v.centre[row] = n[static_cast<std::size_t>(row * 4 + 3)];
        }
        STX_TRY(v.worldFromCamera, repairRotation(rotation, v.fx, place, job));
        view.camera = cameraFromVision(v);
        view.distances = scaledIntegers(0.001, 65535);
        view.sensor = true;
        set.views.push_back(std::move(view));
    }
    if (options.intrinsics[0] == 0)
        job.note(
            "the set does not tell its intrinsics; 7-Scenes' published ones are used (f 585, "
            "centre 320, 240); others with --intrinsics");
    job.note("7-Scenes' colour and depth come from two cameras 25 mm apart and are taken as one");
    return set;
}

}  // namespace stx::imagesets
