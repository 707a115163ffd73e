#!/usr/bin/env python3
"""A capture that memory does not hold: cameras along a wall, as an image set. It is converted, and a picture is drawn from
the bundle, each under a limit that a part of its views fits.

By hand, of 400 views of 12 megapixels (three quarters of an hour on two cores), with times beside those of the 16 nearest views:

    tests/cli/large_capture_test.py build/release/bin/stx - - --measure 1 --views 400 --width 4096 --convert 2048 --picture 4096
"""
import json
import os
import re
import struct
import sys
import tempfile

import harness
from harness import must, run, write
from peaks import PROGRAM, png

# From view to view the cameras go on by a part of a picture's width, and the wall's pattern repeats after as much: one colour
# and one depth picture serve all of them.
STEP_PART, DISTANCE = 8, 3.0


def wall(folder, count, width, height):
    """Fills a folder."""
    os.makedirs(folder)
    period = width // STEP_PART

    def colours(y):
        return bytes(v for x in range(period) for v in (96 + x * 96 // period, 64 + y * 128 // height, 160 - (x * 8 // period) * 8)) * STEP_PART

    png(os.path.join(folder, "c.png"), width, height, "rgb", colours)
    png(os.path.join(folder, "d.png"), width, height, "depth",
        lambda y: struct.pack(">H", int(1000 * DISTANCE)) * width)
    frames = []
    for i in range(count):
        frames.append({"file_path": "c.png", "depth_file_path": "d.png",
                       "transform_matrix": [[1, 0, 0, i * DISTANCE / STEP_PART], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]})
    write(os.path.join(folder, "transforms.json"),
          json.dumps({"w": width, "h": height, "fl_x": width, "fl_y": width, "cx": width / 2, "cy": height / 2, "frames": frames}))


def main():
    args = harness.arguments(__doc__, measure=0, views=40, width=1024, convert=80, picture=160)
    height = args.width * 3 // 4
    wrong = []
    texels = args.views * args.width * height
    with tempfile.TemporaryDirectory(prefix="stx-capture-", dir=os.environ.get("STX_LARGE_FOLDER")) as folder:
        wall(os.path.join(folder, "set"), args.views, args.width, height)
        middle = args.views // 2 * DISTANCE / STEP_PART + DISTANCE / STEP_PART / 3

        def step(name, line, limit):
            done = run([args.stx] + line.split() + ["--max-memory", str(limit), "--threads", "2"], folder, timeout=7200)
            peak = done.usage.ru_maxrss / 1024
            if args.measure:
                print(f"{name:28} exit {done.code} {peak:8.1f} MiB of {limit} {done.seconds:8.1f} s "
                      f"{done.usage.ru_utime + done.usage.ru_stime:8.1f} s of processors", flush=True)
            if done.code != 0 or peak > limit + PROGRAM:
                wrong.append(f"{name}: exit {done.code}, {peak:.1f} MiB of {limit}: {done.err.decode()}")
            return done

        # What has no depth here is empty: views of a scanner that is exact. Others are refined side by side.
        step("convert", "convert set -o all.exr --no-depth empty", args.convert)
        view = f"--eye {middle},0,0 --target {middle},0,-3 --fov 40 --size 1920x1080 --backend cpu"
        step("picture", f"render all.exr -o all.png {view}", args.picture)
        if texels * 8 <= args.convert << 20:
            wrong.append("the capture fits the limit")
        if args.measure:
            nearest = os.path.join(folder, "set", "nearest.json")
            with open(os.path.join(folder, "set", "transforms.json")) as file:
                described = json.load(file)
            first = max(0, args.views // 2 - 8)
            described["frames"] = described["frames"][first:first + 16]
            write(nearest, json.dumps(described))
            step("convert of 16", "convert set/nearest.json -o near.exr --no-depth empty", args.convert)
            step("picture from 16", f"render near.exr -o near.png {view}", args.picture)
        else:
            # The picture is that of all views in memory.
            must([args.stx] + f"render all.exr -o memory.png {view} --max-memory 16384".split(), folder)
            if open(os.path.join(folder, "all.png"), "rb").read() != open(os.path.join(folder, "memory.png"), "rb").read():
                wrong.append("the picture is not that of a larger --max-memory")
            # A limit that does not hold a view names one that is enough.
            small = run([args.stx] + "convert set -o small.exr --max-memory 8".split(), folder)
            more = re.search(rb"--max-memory (\d+)", small.err)
            if small.code != 3 or not more or os.path.exists(os.path.join(folder, "small.exr")):
                wrong.append(f"convert in 8 MiB: exit {small.code} {small.err.decode()}")
            else:
                must([args.stx, "convert", "set", "-o", "small.exr", "--threads", "1", "--max-memory", more.group(1).decode()], folder)
    print("\n".join(wrong))
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
