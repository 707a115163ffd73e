#!/bin/sh
# The main job on one model: MODEL -> bundle, atlas, normal map, relit novel views in FOLDER.
# Usage: main_job.sh [MODEL [FOLDER]]      (stx must be on the PATH)
# Without MODEL: the amphora that is installed beside this script; without FOLDER: stx-sample here.
set -eu
case "${1:-}" in
-h | --help)
    sed -n '2,4s/^# //p' "$0"
    exit 0
    ;;
esac
model=${1:-$(dirname "$0")/amphora.obj}
out=${2:-stx-sample}
mkdir -p "$out"

# 1. The model as 16 reference views: colour, depth, camera each.
stx convert "$model" -o "$out/bundle.exr" --views sphere:16 --size 512x512

# 2. Normals and splat axes from the depth: SimpleTexture becomes SimpleTextureV2.
stx bake "$out/bundle.exr" -o "$out/baked.exr"

# 3. All views in at most four textures: colour, depth, normal, splat.
stx pack "$out/baked.exr" -o "$out/atlas"

# 4. Novel views from the atlas: as captured, relit, and an orbit.
stx render "$out/atlas" -o "$out/novel.png" --orbit 1 --elevation 25 --size 768x768 --quality best
stx render "$out/atlas" -o "$out/relit.png" --orbit 1 --elevation 25 --size 768x768 --quality best \
    --light dir:-1,-1,-0.6,1,0.9,0.7 --light dir:1,0.2,-0.5,0.15,0.2,0.35 --ambient 0.12 \
    --specular 0.35 --shininess 40
stx render "$out/atlas" -o "$out/orbit_%02d.png" --orbit 8 --elevation 25 --size 512x512

# 5. The model itself from the same place, and how close the novel view comes to it.
stx render "$model" -o "$out/truth.png" --orbit 1 --elevation 25 --size 768x768
stx compare "$out/novel.png" "$out/truth.png" --error-picture "$out/error.png" || test $? = 7

echo
echo "Pictures to look at, in $out:"
for f in atlas/colour.png atlas/normal.png novel.png relit.png truth.png error.png orbit_00.png; do
    echo "  $out/$f"
done
