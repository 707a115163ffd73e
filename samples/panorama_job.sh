#!/bin/sh
# A place and an object in it: pictures of a camera that turned on the spot become a panorama, the panorama
# becomes what is behind MODEL (samples/amphora.obj) in its scene, and lights it. The place is made here, too:
# hills under a sky, whose colours and heights are sums of waves, so that no two directions look alike.
# usage: panorama_job.sh MODEL FOLDER
set -eu
model=$1 out=$2
mkdir -p "$out"

# 1. The place, a coloured mesh: hills out to a distance of 60, a dome of sky behind them, the eye at 0,0,0.
awk 'BEGIN {
    n = 400; rings = 130; dome = 60; pi = atan2(0, -1)
    printf "ply\nformat ascii 1.0\nelement vertex %d\n", n * (rings + dome)
    printf "property float x\nproperty float y\nproperty float z\n"
    printf "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    printf "element face %d\nproperty list uchar int vertex_indices\nend_header\n", n * (rings + dome - 2)
    for (i = 0; i < rings; ++i) for (j = 0; j < n; ++j) {
        a = 2 * pi * j / n; r = i ? 0.05 * exp(7.2 * i / rings) : 0.001; x = r * cos(a); z = r * sin(a)
        y = -0.9 + r * 0.05 * (sin(0.21 * x + 1) + cos(0.17 * z + 0.3 * x) + 0.5 * sin(0.9 * z + a)) \
            + 0.02 * r * waves(3 * a, 0.8 * r)
        p = sqrt(r * r + 0.8); g = 0.5 + 0.15 * waves(2.1 * x, 2.3 * z) + 0.2 * waves((21 * x + 9 * z) / p, (19 * z - 11 * x) / p) + 0.3 * waves((57 * x + 13 * z) / p, (49 * z - 17 * x) / p); h = 0.5 + 0.5 * waves(0.3 * x + 5, 0.37 * z)
        stone = waves((37 * x + 9 * z) / p, (33 * z - 11 * x) / p) > 0.45 && r < 6
        printf "%.4f %.4f %.4f %d %d %d\n", x, y, z, stone ? 190 : 70 + 120 * g * h, stone ? 185 : 80 + 90 * g, stone ? 170 : 40 + 50 * h
    }
    for (i = 0; i < dome; ++i) for (j = 0; j < n; ++j) {
        a = 2 * pi * j / n; b = -0.25 + (pi / 2 + 0.249) * i / (dome - 1)
        x = cos(b) * cos(a); z = cos(b) * sin(a); y = sin(b)
        c = waves(7 * x + 2 * y, 7 * z - 3 * y) + 0.6 * waves(19 * x, 17 * z + 9 * y) + 0.5 * waves(45 * x, 41 * z + 20 * y); c = c > 0 ? c : 0
        c = c > 1 ? 1 : c; up = y > 0 ? y : 0
        printf "%.4f %.4f %.4f %d %d %d\n", 80 * x, 80 * y, 80 * z, \
            (150 - 90 * up) * (1 - c) + 245 * c, (185 - 70 * up) * (1 - c) + 240 * c, 225 * (1 - c) + 235 * c
    }
    strip(0, rings); strip(rings, dome)
}
function waves(u, v) {
    return (sin(u + 1.7 * sin(0.7 * v)) + sin(0.8 * v + 1.3 * sin(0.9 * u)) + sin(1.9 * u - 2.3 * v) / 2 + sin(3.1 * u + 2.7 * v) / 3) / 2.9
}
function strip(first, count,    i, j, k) {
    for (i = 0; i < count - 1; ++i) for (j = 0; j < n; ++j) {
        k = (j + 1) % n
        print 4, (first + i) * n + j, (first + i) * n + k, (first + i + 1) * n + k, (first + i + 1) * n + j
    }
}' > "$out/place.ply"

# 2. Twenty-eight pictures of it by a camera that turns: rows of eight above and below the horizon, six up and down.
awk 'BEGIN {
    pi = atan2(0, -1); printf "{\"frames\":["
    for (row = 0; row < 4; ++row) {
        tilt = row == 0 ? 0.3 : row == 1 ? -0.4 : row == 2 ? 1.05 : -1.05; n = row < 2 ? 8 : 6
        for (k = 0; k < n; ++k) turn(2 * pi * (k + row / 3) / n, tilt)
    }
    print "]}"
}
function turn(a, b,    ca, sa, cb, sb) {
    ca = cos(a); sa = sin(a); cb = cos(b); sb = sin(b)
    printf "%s{\"file_path\":\"t%02d\",\"fl_x\":300,\"fl_y\":300,\"cx\":240,\"cy\":180,\"w\":480,\"h\":360,", made++ ? "," : "", made
    printf "\"transform_matrix\":[[%.9f,%.9f,%.9f,0],[0,%.9f,%.9f,0],[%.9f,%.9f,%.9f,0],[0,0,0,1]]}", \
        ca, sa * sb, sa * cb, cb, -sb, -sa, ca * sb, ca * cb
}' > "$out/turn.json"
stx render "$out/place.ply" -o "$out/turn_%02d.png" --cameras "$out/turn.json" --quiet

# 3. The pictures alone, without what is known of them, become all that is around the camera.
stx panorama "$out"/turn_*.png -o "$out/around.png" --report "$out/around.json"

# 4. The object before it: a scene with a Background, drawn from two places, as captured and lit by the place.
stx convert "$model" -o "$out/views.exr" --views sphere:16 --size 512x512 --environment "$out/around.png" --quiet
stx bake "$out/views.exr" -o "$out/scene.mp4" --quiet
stx info "$out/scene.mp4" | grep environment
for k in 1 2; do
    eye=1.7,0.85,2.1
    [ $k = 2 ] && eye=-2.4,0.35,1.2
    stx render "$out/scene.mp4" -o "$out/seen_$k.png" --eye=$eye --target 0,0.5,0 --fov 45 --size 480x480 --quiet
    stx render "$out/scene.mp4" -o "$out/lit_$k.png" --eye=$eye --target 0,0.5,0 --fov 45 --size 480x480 \
        --light environment --specular 0.15 --quiet
done
if command -v montage > /dev/null; then
    montage "$out/seen_1.png" "$out/lit_1.png" "$out/seen_2.png" "$out/lit_2.png" -tile 4x1 -geometry 300x300+2+2 "$out/row.png"
    convert "$out/around.png" -resize 1216x608 "$out/top.png"
    convert "$out/top.png" "$out/row.png" -append -depth 8 -strip -quality 95 "$out/sheet.png"
    echo "the panorama, and the object before it: $out/sheet.png"
fi
