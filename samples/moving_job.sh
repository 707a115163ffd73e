#!/bin/sh
# A film with depth, what it hides, and a walk through it: MODEL (samples/amphora.obj) turns and walks
# before another one and a wall, seen by one camera that stands still. The film becomes MPEG-4, gets the
# background that the walker uncovers, and is drawn from cameras that move sideways, beside the same
# without the background, and out of atlases. usage: moving_job.sh MODEL FOLDER
set -eu
model=$1 out=$2 frames=24
folder=$(dirname "$model") name=$(basename "$model" .obj)
mkdir -p "$out/frames"
cp "$folder/$name.mtl" "$folder/$name.png" "$out/frames/"

# One mesh a frame: a wall, a model that stands, a model that turns and walks from left to right.
k=0
while [ $k -lt $frames ]; do
    number=$(printf %04d $k)
    awk -v k=$k -v n=$frames -v mtl="$name.mtl" '
        BEGIN { print "mtllib " mtl; t = k / (n - 1); a = 4 * t; c = cos(a); s = sin(a) }
        $1 == "mtllib" || $1 == "vn" || $1 == "s" { next }
        $1 == "usemtl" { use = $0; next }
        $1 == "v" { v[++nv] = $2 " " $3 " " $4; x[nv] = $2; y[nv] = $3; z[nv] = $4 }
        $1 == "vt" { vt[++nt] = $0 }
        $1 == "f" { f[++nf] = $0 }
        function faces(dv,    i, j, w, p, line) {
            for (i = 1; i <= nf; ++i) {
                w = split(f[i], p, " "); line = "f"
                for (j = 2; j <= w; ++j) { split(p[j], q, "/"); line = line " " (q[1] + dv) "/" q[2] }
                print line
            }
        }
        END {
            print use
            for (i = 1; i <= nv; ++i) print "v " x[i] + 0.5, y[i], z[i] - 0.6
            for (i = 1; i <= nv; ++i)
                print "v " c * x[i] + s * z[i] - 1.1 + 2.2 * t, y[i], c * z[i] - s * x[i] + 0.5
            print "v -3 -0.5 -1.5\nv 3 -0.5 -1.5\nv 3 2 -1.5\nv -3 2 -1.5"
            for (i = 1; i <= nt; ++i) print vt[i]
            print "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1"
            faces(0); faces(nv)
            print "f " 2*nv+1 "/" nt+1 " " 2*nv+2 "/" nt+2 " " 2*nv+3 "/" nt+3 " " 2*nv+4 "/" nt+4
        }' "$model" > "$out/frames/$number.obj"
    k=$((k + 1))
done

# Cameras look along -Z: one that films, and a walk of others for each frame.
camera() {
    printf '{"file_path":"c%s","fl_x":420,"fl_y":420,"cx":240,"cy":160,"w":480,"h":320,' "$1"
    printf '"transform_matrix":[[1,0,0,%s],[0,1,0,0.65],[0,0,1,3.2],[0,0,0,1]]}' "$2"
}
printf '{"frames":[%s]}' "$(camera 0 0)" > "$out/camera.json"
k=0 walk=
while [ $k -lt $frames ]; do
    x=$(awk -v k=$k -v n=$frames 'BEGIN { print 0.55 * sin(6.2832 * k / n) }')
    walk="$walk${walk:+,}$(camera $k "$x")"
    k=$((k + 1))
done
printf '{"frames":[%s]}' "$walk" > "$out/walk.json"

k=0
while [ $k -lt $frames ]; do
    number=$(printf %04d $k)
    stx convert "$out/frames/$number.obj" -o "$out/frames/$number.exr" --views "$out/camera.json" --quiet
    k=$((k + 1))
done
stx convert "$out/frames/%04d.exr" -o "$out/film.mp4" --quiet
stx info "$out/film.mp4"
stx background "$out/film.mp4" -o "$out/film_bg.mp4" --quiet
for film in film film_bg; do
    stx render "$out/$film.mp4" -o "$out/${film}_%04d.png" --cameras "$out/walk.json" --times all --quiet
done
# Packed: an atlas for each frame, the rectangles of all alike; drawn from, it is the same film.
stx pack "$out/film_bg.mp4" -o "$out/atlas_%04d" --layout tight --quiet
eye='--eye=0.5,0.65,3.2 --target 0,0.65,0 --size 480x320 --time 0.5'
stx render "$out/atlas_%04d" -o "$out/packed.png" $eye --quiet
stx render "$out/film_bg.mp4" -o "$out/unpacked.png" $eye --quiet
stx compare "$out/packed.png" "$out/unpacked.png" --min-psnr 40
if command -v ffmpeg > /dev/null; then
    ffmpeg -loglevel error -y -framerate 25 -i "$out/film_bg_%04d.png" -pix_fmt yuv420p "$out/walk.mp4"
    echo "the walk: $out/walk.mp4"
fi
if command -v montage > /dev/null; then
    montage "$out/film_0005.png" "$out/film_0011.png" "$out/film_0017.png" "$out/film_bg_0005.png" \
        "$out/film_bg_0011.png" "$out/film_bg_0017.png" -tile 3x2 -geometry 400x+4+4 "$out/sheet.png"
    echo "the walk without (above) and with the background: $out/sheet.png"
fi
