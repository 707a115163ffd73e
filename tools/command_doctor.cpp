#include <nlohmann/json.hpp>

#include "formats/parts/parts.hpp"
#include "lib/base/printable.hpp"
#include "tools/build_text.hpp"
#include "tools/commands.hpp"

namespace stx::tools {
namespace {

nlohmann::ordered_json partJson(const Part& part) {
    return {{"name", part.name}, {"state", nameOf(part.state)}, {"detail", part.detail},
            {"use", part.use},   {"packages", part.packages},   {"needed", part.needed}};
}

Result<int> doctor(Program& program) {
    const auto parts = findParts(PartCheck::whole, program.job);
    bool whole = true;
    auto list = nlohmann::ordered_json::array();
    std::string text = fmt::format("stx {}, {}\n", STX_VERSION, buildText());
    for (const Part& part : parts) {
        list.push_back(partJson(part));
        whole = whole && (!part.needed || part.state == PartState::here);
        text +=
            fmt::format("{:<10}{:<14}{}\n", nameOf(part.state), part.name, printable(part.detail));
        if (part.state != PartState::here)
            text += fmt::format("{:<24}it is for {}{}\n", "", part.use,
                                part.packages.empty() || part.state == PartState::notBuilt
                                    ? ""
                                    : "; Debian: " + part.packages);
    }
    if (program.common.format == "json")
        program.printJson({{"$schema", "doctor.schema.json"},
                           {"version", STX_VERSION},
                           {"build", buildText()},
                           {"whole", whole},
                           {"parts", std::move(list)}});
    else
        program.print(text);
    return whole ? 0 : static_cast<int>(ErrorCode::unsupported);
}

}  // namespace

void addDoctor(CommandLine& line, Program& program) {
    Command c =
        line.add("doctor",
                 "What this machine has of what stx can use, and the Debian package of what "
                 "is missing; exit code 5 when the installation is not whole\n\n"
                 "  stx doctor\n"
                 "  stx doctor --format json");
    c.sharedOptions(program.common, kFormat);
    c.runs([](Program& p) { return doctor(p); });
}

}  // namespace stx::tools
