#include "tools/commands.hpp"
#include "tools/help_text.hpp"

namespace stx::tools {

void addHelp(CommandLine& line, Program&) {
    Command c = line.add("help",
                         "All that there is to say of a command and each of its options\n\n"
                         "  stx help\n"
                         "  stx help render");
    auto name = std::make_shared<std::string>();
    c.option("COMMAND", *name, "Which command (default: what commands there are)");
    c.runs([&line, name](Program& program) -> Result<int> {
        STX_TRY(const auto text, line.help(*name, HelpDetail::whole));
        program.print(text);
        return 0;
    });
}

}  // namespace stx::tools
