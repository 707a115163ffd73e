#pragma once

#include "tools/command_line.hpp"
#include "tools/program.hpp"

namespace stx::tools {

/// Each adds one command, from command_<name>.cpp; `program` gets the shared options.
void addConvert(CommandLine& line, Program& program);
void addSelect(CommandLine& line, Program& program);
void addPack(CommandLine& line, Program& program);
void addBake(CommandLine& line, Program& program);
void addRefine(CommandLine& line, Program& program);
void addBackground(CommandLine& line, Program& program);
void addPanorama(CommandLine& line, Program& program);
void addRender(CommandLine& line, Program& program);
void addInfo(CommandLine& line, Program& program);
void addSheet(CommandLine& line, Program& program);
void addExtract(CommandLine& line, Program& program);
void addValidate(CommandLine& line, Program& program);
void addCompare(CommandLine& line, Program& program);
void addBench(CommandLine& line, Program& program);
void addReport(CommandLine& line, Program& program);
void addDoctor(CommandLine& line, Program& program);
void addHelp(CommandLine& line, Program& program);
void addCompletion(CommandLine& line, Program& program);

}  // namespace stx::tools
