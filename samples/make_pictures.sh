#!/bin/sh
# The picture triples of lib/render/README.md: the model itself, the novel view, where they differ.
# Usage: samples/make_pictures.sh MODEL [FOLDER]      (stx must be on the PATH)
set -eu
model=$1
out=${2:-$(dirname "$0")/pictures}
mkdir -p "$out"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

stx convert "$model" -o "$work/bundle.exr" --views sphere:16 --size 512x512 --quiet
camera="--orbit 1 --elevation 25 --size 320x320 --background 1,1,1 --quiet"
# shellcheck disable=SC2086
stx render "$model" -o "$out/truth.png" $camera
for way in "surface best" "splat normal"; do
    mode=${way% *}
    # shellcheck disable=SC2086
    stx render "$work/bundle.exr" -o "$out/$mode.png" $camera --mode "$mode" --quality "${way#* }"
    stx compare "$out/$mode.png" "$out/truth.png" --error-picture "$out/$mode"_error.png || test $? = 7
done
