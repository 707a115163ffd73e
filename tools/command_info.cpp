#include "formats/info.hpp"
#include "tools/commands.hpp"

namespace stx::tools {
namespace {

struct InfoCommandOptions {
    std::string input;
    InfoOptions info;
};

Result<int> info(const InfoCommandOptions& o, Program& program) {
    STX_TRY(const auto found, describe(o.input, o.info, program.job));
    if (program.common.format == "json")
        program.printJson(found);
    else
        program.print(describeAsText(found));
    return 0;
}

}  // namespace

void addInfo(CommandLine& line, Program& program) {
    Command c = line.add("info",
                         "What is in a file: container, nodes, views, cameras, bytes\n\n"
                         "  stx info model.mp4\n"
                         "  stx info model.exr --format json --bounds");
    auto o = std::make_shared<InfoCommandOptions>();
    c.option("FILE", o->input, "Bundle, atlas, mesh or image set").required();
    c.flag("--bounds", o->info.bounds,
           "Compute the bounds and point counts from the pixels where the file does not hold them");
    c.sharedOptions(program.common, kFormat | kOutside);
    c.runs([o](Program& p) { return info(*o, p); });
}

}  // namespace stx::tools
