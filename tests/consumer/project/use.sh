#!/bin/sh
# What a user of an installed stx does: `use.sh PREFIX CMAKE COMPILER FORBIDDEN...`, run in an empty folder
# beside project/ and amphora.obj.
set -eu
prefix=$1 cmake=$2 compiler=$3
shift 3
libdir=$(dirname "$(find "$prefix" -name libstx.so)")

"$prefix/bin/stx" convert ../amphora.obj -o bundle.exr --views sphere:6 --size 128x128 --quiet
"$prefix/bin/stx" bake bundle.exr -o baked.exr --quiet
"$prefix/bin/stx" pack baked.exr -o atlas --quiet
"$prefix/bin/stx" render atlas -o novel.png --eye=1.5,1.2,2.5 --target 0,0.5,0 --size 160x120 \
    --background 0,0,0 --quiet
oiiotool novel.png -o novel.tif
"$prefix/bin/stx" compare novel.png novel.tif

# By CMake.
"$cmake" -S ../project -B by_cmake -G Ninja -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_COMPILER="$compiler"
"$cmake" --build by_cmake
by_cmake/use_stx ../amphora.obj novel.png novel.tif "$@"
cmp baked.exr library.exr
cmp novel.png library.png

# By pkg-config.
export PKG_CONFIG_PATH="$libdir/pkgconfig"
# shellcheck disable=SC2046
"$compiler" -std=c++20 ../project/main.cpp $(pkg-config --cflags --libs stx) -o by_pkg_config
rm -r library*
LD_LIBRARY_PATH="$libdir" ./by_pkg_config ../amphora.obj novel.png novel.tif "$@"
cmp baked.exr library.exr
