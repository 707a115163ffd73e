#!/usr/bin/env python3
"""How good N selected views (auto:N) render against N even ones (sphere:N).

    tests/bench/selection_table.py build/release/bin/stx spot.obj Fox.gltf --counts 8 12

Prints, for each model and count, the mean PSNR of RGB in dB over 40 random novel views of 512x512
against the mesh itself. Deterministic; README.md here has its table.
"""

import argparse
import json
import math
import pathlib
import random
import subprocess
import tempfile


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def quaternion(x, y, z):
    """x y z w of the rotation with these columns."""
    candidates = [
        [1 + x[0] - y[1] - z[2], x[1] + y[0], z[0] + x[2], y[2] - z[1]],
        [x[1] + y[0], 1 - x[0] + y[1] - z[2], y[2] + z[1], z[0] - x[2]],
        [z[0] + x[2], y[2] + z[1], 1 - x[0] - y[1] + z[2], x[1] - y[0]],
        [y[2] - z[1], z[0] - x[2], x[1] - y[0], 1 + x[0] + y[1] + z[2]],
    ]
    return unit(max(candidates, key=lambda q: sum(c * c for c in q)))


def novel_cameras(bounds, seed, count, size):
    low, high = bounds["min"], bounds["max"]
    centre = [(a + b) / 2 for a, b in zip(low, high)]
    radius = math.dist(low, high) / 2
    fov = math.radians(40)
    source = random.Random(seed)
    cameras = []
    for i in range(count):
        z = unit([source.gauss(0, 1) for _ in range(3)])
        distance = radius / math.sin(fov / 2) * source.uniform(0.8, 0.95)
        x = unit(cross([0, 1, 0], z))
        cameras.append(
            {
                "name": f"n{seed}_{i:02}",
                "width": size,
                "height": size,
                "position": [c + d * distance for c, d in zip(centre, z)],
                "quaternion": quaternion(x, cross(z, x), z),
                "fieldOfView": [fov, fov],
            }
        )
    return cameras


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stx")
    parser.add_argument("models", nargs="+")
    parser.add_argument("--counts", type=int, nargs="+", default=[8, 12])
    parser.add_argument("--size", type=int, default=512)
    options = parser.parse_args()

    def stx(*arguments):
        command = [options.stx, *map(str, arguments)]
        done = subprocess.run(command, stdout=subprocess.PIPE, check=False)
        if done.returncode not in (0, 7):
            raise SystemExit(f"{' '.join(command)} ended with {done.returncode}")
        return done.stdout

    print("| model | views | even | selected |\n|---|---|---|---|")
    for model in options.models:
        with tempfile.TemporaryDirectory() as folder:
            place = pathlib.Path(folder)
            bundle = place / "views.exr"
            stx("convert", model, "-o", bundle, "--views", "cube", "--size", "256x256", "-q")
            bounds = json.loads(stx("info", bundle, "--format", "json"))["bounds"]
            cameras = [c for seed in (1, 2) for c in novel_cameras(bounds, seed, 20, options.size)]
            (place / "novel.json").write_text(json.dumps({"cameras": cameras}))
            shared = ["--cameras", place / "novel.json", "--background", "0,0,0", "-q"]
            (place / "truth").mkdir()
            (place / "ours").mkdir()
            stx("render", model, "-o", place / "truth/%04d.png", *shared)
            for count in options.counts:
                cells = []
                for views in (f"sphere:{count}", f"auto:{count}"):
                    stx("convert", model, "-o", bundle, "--views", views, "-q")
                    stx("render", bundle, "-o", place / "ours/%04d.png", *shared)
                    found = stx("compare", place / "ours/%04d.png", place / "truth/%04d.png",
                                "--format", "json")
                    frames = [f["psnr"]["rgb"] for f in json.loads(found)["frames"]]
                    cells.append(f"{sum(frames) / len(frames):.2f}")
                print(f"| {pathlib.Path(model).stem} | {count} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
