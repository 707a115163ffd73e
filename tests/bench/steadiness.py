#!/usr/bin/env python3
"""How much pictures of a still object change from frame to frame when its depth is noisy.

  tests/bench/steadiness.py build/release/bin/stx [--noise 0.005] [--frames 50]

A striped sphere before a wall, 192x192; each frame's depth has normal noise of its own, as a share of the
distance. A camera beside the one that saw it draws all frames, and the first without noise is the truth.
Prints PSNR and the mean change of a value from frame to frame (8-bit steps; the truth has none) of each
mode, and whether the film without noise gives one picture at every time. Needs ffmpeg.
"""
import argparse
import array
import json
import math
import os
import random
import shutil
import subprocess
import tempfile

SIZE, FOCAL, UNIT = 192, 200.0, 0.0001


def scene():
    """Depths and RGB bytes: a sphere of radius 0.5 at distance 2 before a wall at 3."""
    depths, colours = [], bytearray()
    for y in range(SIZE):
        for x in range(SIZE):
            dx, dy = (x + 0.5 - SIZE / 2) / FOCAL, (y + 0.5 - SIZE / 2) / FOCAL
            a = dx * dx + dy * dy + 1
            inside = 4 - a * 3.75
            depths.append((2 - math.sqrt(inside)) / a if inside > 0 else 3.0)
            stripes = int((math.sin(x * 0.35) + math.cos(y * 0.27)) * 60 + 128)
            colours += bytes((255 - stripes, 200 if inside > 0 else 90, stripes))
    return depths, bytes(colours)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stx")
    parser.add_argument("--noise", type=float, default=0.005)
    parser.add_argument("--frames", type=int, default=50)
    o = parser.parse_args()
    stx = os.path.abspath(o.stx)
    rng = random.Random(1)
    depths, colours = scene()
    with tempfile.TemporaryDirectory(prefix="stx-steady-") as folder:
        def run(*words):
            done = subprocess.run(words, cwd=folder, check=False, capture_output=True, text=True)
            if done.returncode not in (0, 7):  # 7: compare found differences
                raise SystemExit(f"{' '.join(words)}: {done.stderr}")
            return done.stdout

        def write(name, data):
            with open(os.path.join(folder, name), "wb") as file:
                file.write(data)

        def encode(name, pixels):
            run("ffmpeg", "-nostdin", "-v", "error", "-f", "rawvideo", "-pix_fmt", pixels, "-s", f"{SIZE}x{SIZE}", "-r", "25",
                "-i", name + ".raw", "-c:v", "ffv1", *(["-pix_fmt", "bgr0"] if pixels == "rgb24" else []), name + ".mkv")

        write("colour.raw", colours * o.frames)
        encode("colour", "rgb24")
        for name, at in (("seen", [0, 0, 0]), ("beside", [0.12, 0.05, 0])):
            pose = [[float(r == c) for c in range(3)] + [at[r]] for r in range(3)] + [[0, 0, 0, 1]]
            write(name + ".json", json.dumps({"w": SIZE, "h": SIZE, "fl_x": FOCAL, "frames": [
                {"camera": "cam", "file_path": "cam", "transform_matrix": pose}]}).encode())
        for name, noise in (("clean", 0.0), ("noisy", o.noise)):
            codes = array.array("H", (max(1, min(65535, round(d * (1 + noise * rng.gauss(0, 1)) / UNIT)))
                                      for _ in range(o.frames) for d in depths))
            write(name + ".raw", codes.tobytes())
            encode(name, "gray16le")
            run(stx, "convert", "seen.json", "--texture", "colour.mkv", "--depth", name + ".mkv", "--depth-unit", str(UNIT),
                "-o", name + ".mp4", "-q")
        for mode in ("surface", "splat"):
            out = os.path.join(folder, mode)
            os.mkdir(out)
            run(stx, "render", "noisy.mp4", "--cameras", "beside.json", "--times", "all", "--mode", mode, "-o", mode + "/n_%02d.png", "-q")
            run(stx, "render", "clean.mp4", "--cameras", "beside.json", "--time", "0", "--mode", mode, "-o", mode + "/t.png", "-q")
            run(stx, "render", "clean.mp4", "--cameras", "beside.json", "--time", str((o.frames - 1) / 25), "--mode", mode,
                "-o", mode + "/u.png", "-q")
            still = []
            for name in ("t.png", "u.png"):
                with open(os.path.join(out, name), "rb") as file:
                    still.append(file.read())
            for k in range(o.frames):
                shutil.copy(os.path.join(out, "t.png"), os.path.join(out, f"t_{k:02d}.png"))
            said = run(stx, "compare", mode + "/n_%02d.png", mode + "/t_%02d.png").strip().replace("\n", "; ")
            print(f"{mode}: {said}; without noise the last frame is {'' if still[0] == still[1] else 'NOT '}the first")


if __name__ == "__main__":
    main()
