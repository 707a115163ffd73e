# Turns shader files into one header: namespace stx::shaders { constexpr std::string_view kName }.
# Usage: cmake -DOUT=header.hpp "-DFILES=a.vert;b.frag" -P embed.cmake
set(text "#pragma once\n#include <string_view>\n\nnamespace stx::shaders {\n")
foreach(file IN LISTS FILES)
    file(READ "${file}" body)
    get_filename_component(name "${file}" NAME)
    string(MAKE_C_IDENTIFIER "${name}" id)
    string(APPEND text "inline constexpr std::string_view ${id} = R\"__glsl(${body})__glsl\";\n")
endforeach()
string(APPEND text "}  // namespace stx::shaders\n")
file(WRITE "${OUT}" "${text}")
