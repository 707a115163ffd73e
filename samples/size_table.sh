#!/bin/sh
# What 16 views of 512x512 of a model take as files, and how good they render: bytes and the mean PSNR of RGB
# of four novel views (--orbit 4 --elevation 23) against the model. Beside them the model itself, and the model
# as Draco packs it (geometry and texture coordinates, at Draco's own settings).
# Usage: samples/size_table.sh MODEL...      (stx, assimp and draco_encoder must be on the PATH)
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
view="--orbit 4 --elevation 23 --size 512x512 --background 0,0,0 --quiet"

bytes() { find "$@" -type f -exec cat {} + | wc -c; }
row() { # NAME FILE
    # shellcheck disable=SC2086
    stx render "$2" -o "$work/ours_%04d.png" $view
    stx compare "$work/ours_%04d.png" "$work/truth_%04d.png" --format json > "$work/compare.json" || test $? = 7
    mean=$(python3 -c 'import json, sys
frames = json.load(open(sys.argv[1]))["frames"]
print("%.1f" % (sum(f["psnr"]["rgb"] for f in frames) / len(frames)))' "$work/compare.json")
    echo "| $name | $1 | $(bytes "$2") | $mean |"
}

echo "| model | as | bytes | dB |"
echo "|---|---|---|---|"
for model in "$@"; do
    model=$(realpath "$model")
    name=$(basename "$model" | sed 's/\.[^.]*$//')
    folder=$(dirname "$model")
    parts=$(find "$folder" -maxdepth 1 -name '*.bin' -o -maxdepth 1 -name '*.png' -o -maxdepth 1 -name '*.jpg')
    # shellcheck disable=SC2086
    echo "| $name | the model and its pictures | $(bytes "$model" $parts) | |"
    # draco_encoder takes OBJ, not glTF.
    if (cd "$work" && assimp export "$model" draco.obj && draco_encoder -i draco.obj -o draco.drc -cl 10) > "$work/log" 2>&1
    then
        pictures=$(find "$folder" -maxdepth 1 -name '*.png' -o -maxdepth 1 -name '*.jpg')
        # shellcheck disable=SC2086
        echo "| $name | .drc and its pictures | $(bytes "$work/draco.drc" $pictures) | |"
    fi
    # shellcheck disable=SC2086
    stx render "$model" -o "$work/truth_%04d.png" $view
    make() { stx convert "$model" --views sphere:16 --quiet "$@"; }
    make -o "$work/float.exr" --depth-bits 32
    row ".exr, float depth" "$work/float.exr"
    make -o "$work/png16.mp4"
    row ".mp4, PNG, 16-bit depth" "$work/png16.mp4"
    make -o "$work/png8.mp4" --depth-bits 8
    row ".mp4, PNG, 8-bit depth" "$work/png8.mp4"
    for quality in 92 75; do
        make -o "$work/jpeg.mp4" --colour jpeg --quality $quality
        row ".mp4, JPEG $quality, 16-bit depth" "$work/jpeg.mp4"
    done
    stx pack "$work/png16.mp4" -o "$work/atlas" --layout tight --quiet
    row "atlas, PNG, 16-bit depth" "$work/atlas"
    stx pack "$work/png16.mp4" -o "$work/pruned" --layout tight --prune --quiet
    row "atlas, pruned" "$work/pruned"
    for quality in 92 75; do
        stx pack "$work/png16.mp4" -o "$work/atlas" --layout tight --colour jpeg --quality $quality --quiet
        row "atlas, JPEG $quality" "$work/atlas"
    done
    stx pack "$work/png16.mp4" -o "$work/pruned" --layout tight --prune --colour jpeg --quality 75 --quiet
    row "atlas, pruned, JPEG 75" "$work/pruned"
    stx pack "$work/png8.mp4" -o "$work/pruned" --layout tight --prune --colour jpeg --quality 75 --quiet
    row "atlas, pruned, JPEG 75, 8-bit depth" "$work/pruned"
    rm -rf "$work/atlas" "$work/pruned"
done
