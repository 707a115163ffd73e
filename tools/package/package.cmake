# What `cpack` makes of a build: stx, libstx0.1, libstx-dev and (where the module was built) python3-stx for
# Debian 12, and a .tar.gz of all of it.
# What is installed without a component of its own belongs to stx.
set(STX_PACKAGE_CONTACT "The stx authors <stx@users.noreply.github.com>" CACHE STRING
    "Maintainer of the packages that cpack makes: Name <address>")
set(package_dir ${CMAKE_CURRENT_LIST_DIR})
set(runtime libstx${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})

set(CPACK_GENERATOR "DEB;TGZ")
set(CPACK_PACKAGE_NAME stx)
set(CPACK_PACKAGE_VENDOR "The stx authors")
set(CPACK_PACKAGE_CONTACT ${STX_PACKAGE_CONTACT})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "toolkit for MPEG-4 AFX SimpleTexture, models as pictures with depth")
set(CPACK_PACKAGE_CHECKSUM SHA256)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_THREADS 0)
# For debian.cmake, which adds what Debian wants beside the files that are installed.
set(CPACK_PRE_BUILD_SCRIPTS ${package_dir}/debian.cmake)
set(CPACK_STX_PACKAGE_DIR ${package_dir})
set(CPACK_STX_CHANGELOG ${CMAKE_SOURCE_DIR}/CHANGELOG.md)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL stx runtime dev)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# The module of codecs is among the files of stx, so that its libraries are dependencies, too, though
# it is only opened when an image needs it. OpenGL is opened by libepoxy, which depends on none.
set(CPACK_DEBIAN_STX_PACKAGE_NAME stx)
set(CPACK_DEBIAN_STX_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_STX_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_STX_PACKAGE_RECOMMENDS "libegl1, libopengl0, libgl1-mesa-dri")
set(CPACK_DEBIAN_STX_PACKAGE_SUGGESTS "ffmpeg")
set(CPACK_COMPONENT_STX_DESCRIPTION
    "stx turns 3D models and photographs with depth into SimpleTexture bundles\n(MPEG-4 AFX, ISO/IEC 14496-16), packs them into textures, bakes normals and\nsplats, and renders relit novel views, on a GPU or on plain processor cores.")

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME ${runtime})
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "stx, libegl1, libopengl0, libgl1-mesa-dri")
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION
    "The shared library, for programs that use it. Images other than PNG, JPEG\nand OpenEXR, foreign models and films are read by modules and a program that\nthe package stx has.")
file(WRITE ${CMAKE_BINARY_DIR}/package/shlibs
     "libstx ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} ${runtime} (>= ${PROJECT_VERSION})\n")
file(WRITE ${CMAKE_BINARY_DIR}/package/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA
    "${CMAKE_BINARY_DIR}/package/shlibs;${CMAKE_BINARY_DIR}/package/triggers")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libstx-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
    "${runtime} (= ${PROJECT_VERSION}-1), libglm-dev, libfmt-dev, libexpected-dev")
set(CPACK_COMPONENT_DEV_DESCRIPTION
    "The header of libstx, with a call for each command of stx, and what CMake and\npkg-config find it by.")

if(TARGET stx_python)
    list(APPEND CPACK_COMPONENTS_ALL python)
    get_target_property(python_version stx_python STX_PYTHON_VERSION)
    string(REGEX MATCH "[0-9]+$" minor ${python_version})
    math(EXPR minor "${minor} + 1")
    set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-stx)
    set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
    set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
        "${runtime} (= ${PROJECT_VERSION}-1), python3 (>= ${python_version}), python3 (<< 3.${minor}), python3-numpy")
    # Of libstx itself it depends by the line above.
    set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
    set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${STX_BUILD_LIBDIR})
    set(CPACK_COMPONENT_PYTHON_DESCRIPTION
        "stx for Python: what the program does, on numpy arrays.")
    # Compiled files come and go with the package.
    set(scripts ${CMAKE_BINARY_DIR}/package/python)
    file(WRITE ${scripts}/postinst "#!/bin/sh\nset -e\nif [ \"$1\" = configure ]; then py3compile -p python3-stx; fi\n")
    file(WRITE ${scripts}/prerm "#!/bin/sh\nset -e\npy3clean -p python3-stx\n")
    set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA "${scripts}/postinst;${scripts}/prerm")
endif()
include(CPack)
