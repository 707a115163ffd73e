# find_package(stx) gives stx::stx, the shared library; its headers use GLM, fmt and tl::expected.
include(CMakeFindDependencyMacro)
find_dependency(glm)
find_dependency(fmt)
include("${CMAKE_CURRENT_LIST_DIR}/stxTargets.cmake")
