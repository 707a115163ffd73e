#include "formats/info.hpp"
#include "tools/program.hpp"

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

Command addInfo(CLI::App& app, Program& program) {
    auto* c = app.add_subcommand("info",
                                 "What is in a file: container, nodes, views, cameras, bytes\n\n"
                                 "  stx info model.mp4\n"
                                 "  stx info model.exr --format json --bounds");
    auto o = std::make_shared<InfoCommandOptions>();
    c->add_option("FILE", o->input, "Bundle, atlas, mesh or image set")->required();
    c->add_flag(
        "--bounds", o->info.bounds,
        "Compute the bounds and point counts from the pixels where the file does not tell them");
    addCommonOptions(*c, program, kFormat | kOutside);
    return {c, [o](Program& p) { return info(*o, p); }};
}

}  // namespace stx::tools
