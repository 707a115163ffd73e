#!/bin/sh
# The pictures of lib/packing/README.md: an atlas before and after pruning, and what few views show.
# Usage: samples/make_atlas_pictures.sh MODEL [FOLDER]      (stx must be on the PATH)
set -eu
model=$1
out=${2:-$(dirname "$0")/pictures}
mkdir -p "$out"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

stx convert "$model" -o "$work/bundle.exr" --views sphere:16 --size 128x128 --quiet
stx pack "$work/bundle.exr" -o "$work/whole" --layout tight --quiet
stx pack "$work/bundle.exr" -o "$work/pruned" --layout tight --prune
for atlas in whole pruned; do cp "$work/$atlas"/colour.png "$out/atlas_$atlas.png"; done

# Four views each: even ones and selected ones.
camera="--orbit 1 --elevation 60 --size 240x240 --background 1,1,1 --quiet"
# shellcheck disable=SC2086
stx render "$model" -o "$work/truth.png" $camera
for views in sphere auto; do
    stx convert "$model" -o "$work/$views.exr" --views "$views:4" --size 256x256 --quiet
    # shellcheck disable=SC2086
    stx render "$work/$views.exr" -o "$out/four_$views.png" $camera
    stx compare "$out/four_$views.png" "$work/truth.png" | head -1 || test $? = 7
done

# One budget of pixels: all of a few even views, and what is left of sixteen when they are pruned to as many.
orbit="--orbit 8 --elevation 35 --size 512x512 --background 1,1,1 --quiet"
# shellcheck disable=SC2086
stx render "$model" -o "$work/truth_%d.png" $orbit
stx convert "$model" -o "$work/sixteen.exr" --views sphere:16 --size 512x512 --quiet
for count in 6 11 8; do
    stx convert "$model" -o "$work/few.exr" --views "sphere:$count" --size 512x512 --quiet
    stx pack "$work/few.exr" -o "$work/few" --layout tight --quiet
    pixels=$(stx info "$work/few" --format json | python3 -c 'import json, sys; print(json.load(sys.stdin)["pixels"]["kept"])')
    stx pack "$work/sixteen.exr" -o "$work/sixteen" --layout tight --budget "$pixels"
    for atlas in few sixteen; do
        # shellcheck disable=SC2086
        stx render "$work/$atlas" -o "$work/${atlas}_%d.png" $orbit
        stx compare "$work/${atlas}_%d.png" "$work/truth_%d.png" | head -1 || test $? = 7
    done
done
for atlas in few sixteen; do oiiotool "$work/${atlas}_5.png" --cut 260x200+110+50 -o "$out/budget_$atlas.png"; done
