#!/bin/sh
# What 16 views of 512x512 of a model take as files, and how good they render: bytes and the mean PSNR of RGB
# of four novel views (--orbit 4 --elevation 23) against the model. Beside them the model itself, and the model
# as Draco packs it (geometry and texture coordinates, at Draco's own settings).
# Usage: samples/size_table.sh MODEL...      (stx, assimp and draco_encoder must be on the PATH)
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
view="--orbit 4 --elevation 23 --size 512x512 --background 0,0,0 --quiet"

# The files that a model names, a line each: its pictures, and with "all" its buffers, too.
parts() { # MODEL pictures|all
    python3 -c '
import json, os, re, sys, urllib.parse
model, which = sys.argv[1:]
beside = lambda name: os.path.join(os.path.dirname(model), name)
ending, names = os.path.splitext(model)[1].lower(), []
if ending == ".gltf":
    with open(model, encoding="utf-8") as file:
        scene = json.load(file)
    named = scene.get("images", []) + (scene.get("buffers", []) if which == "all" else [])
    names = [urllib.parse.unquote(n["uri"]) for n in named if not n.get("uri", "data:").startswith("data:")]
elif ending == ".obj":
    lines = lambda path: open(path, encoding="utf-8", errors="replace")
    for materials in [line.split(None, 1)[1].strip() for line in lines(model) if line.startswith("mtllib ")]:
        if not os.path.exists(beside(materials)):
            continue
        # A name comes after options such as "-bm 2" and "-s 1 1 1".
        named = (re.match(r"\s*(?:map_\S+|bump|disp|decal|norm|refl)\s+(?:-[a-z]+\s+(?:(?:[-+.\d]+|on|off|[rgbmlz])\s+)*)*(.+)", line)
                 for line in lines(beside(materials)))
        names += [match[1].strip().replace("\\", "/") for match in named if match]
print("\n".join(sorted({beside(name) for name in names})))' "$1" "$2"
}
sized() { # FILE, and names of others on stdin
    { cat "$1"; while IFS= read -r part; do test -z "$part" || cat "$part"; done; } | wc -c
}
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
    echo "| $name | the model and its pictures | $(parts "$model" all | sized "$model") | |"
    # draco_encoder takes OBJ, not glTF.
    if (cd "$work" && assimp export "$model" draco.obj && draco_encoder -i draco.obj -o draco.drc -cl 10) > "$work/log" 2>&1
    then
        echo "| $name | .drc and its pictures | $(parts "$model" pictures | sized "$work/draco.drc") | |"
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
