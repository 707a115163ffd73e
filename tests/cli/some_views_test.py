#!/usr/bin/env python3
"""Pictures along a wall: shards read the views that their pictures need, and draw what all views draw. Whatever writes
exact views into .exr says what is known of them, and of no others. What a file says of views that disagrees with their
pixels is damage."""
import json
import math
import os
import re
import shutil
import sys
import tempfile

import harness

LENGTH, VIEWS, PICTURES, SHARDS = 128, 256, 16, 8
READ = 2.5  # times the file, by all shards


def wall(folder):
    """A wall along X, in waves and with ledges, that ends where no camera sees it."""
    step = 0.2
    columns, rows = int((LENGTH + 10) / step), int(6 / step)
    with open(os.path.join(folder, "wall.obj"), "w") as out:
        for j in range(rows):
            for i in range(columns):
                x, y = i * step - 5, j * step - 3
                z = 0.15 * math.sin(2.1 * x) * math.cos(1.7 * y) + (0.25 if i % 10 < 2 else 0)
                colour = [0.5 + 0.4 * math.sin(a) for a in (3 * x + y, 2 * y - 1.3 * x, 1.5 * x + 4 * y)]
                out.write("v %.3f %.3f %.3f %.3f %.3f %.3f\n" % (x, y, z, *colour))
        for j in range(rows - 1):
            for i in range(columns - 1):
                a = j * columns + i + 1
                out.write(f"f {a} {a + 1} {a + columns + 1} {a + columns}\n")


def cameras(folder, name, count, first, last, size):
    """Cameras along the wall that look at it, each turned a little."""
    frames = []
    for k in range(count):
        x = first + (last - first) * k / (count - 1)
        turn = 0.2 * math.sin(1.3 * x + first)
        c, s = math.cos(turn), math.sin(turn)
        at = (x, 0.1 * math.cos(3 * x), 2 + 0.2 * math.sin(x))
        frames.append({"file_path": f"{k}.png",
                       "transform_matrix": [[c, 0, s, at[0]], [0, 1, 0, at[1]], [-s, 0, c, at[2]], [0, 0, 0, 1]]})
    with open(os.path.join(folder, name), "w") as out:
        json.dump({"camera_angle_x": 0.9, "w": size, "h": size, "frames": frames}, out)


def bytes_read(command, folder):
    """What the command reads of files, by /proc/self/io of a shell that waited for it."""
    done = harness.must(["sh", "-c", '"$@" >&2 && cat /proc/$$/io', "sh"] + command, folder)
    found = re.search(rb"rchar: (\d+)", done.out)
    if not found:
        print("SKIPPED: this system does not count what programs read")
        sys.exit(77)
    return int(found.group(1))


def read(folder, name):
    with open(os.path.join(folder, name), "rb") as file:
        return file.read()


def summaries(data):
    """Where the texts of summaries begin in a file."""
    return [m.end() for m in re.finditer(rb"stx:summary\0string\0....", data, re.DOTALL)]


def without_summaries(folder, name, target):
    """The same file, whose summaries are of a version that nobody knows."""
    data = bytearray(read(folder, name))
    for place in summaries(data):
        data[place] = ord("z")
    with open(os.path.join(folder, target), "wb") as file:
        file.write(data)


def check_shards(stx, folder):
    wrong, total = [], 0
    size = os.path.getsize(os.path.join(folder, "views.exr"))
    draw = [stx, "render", "--cameras", "path.json", "--backend", "cpu", "--quiet"]
    for shard in range(1, SHARDS + 1):
        total += bytes_read(draw + ["views.exr", "-o", "some_%02d.png", "--shard", f"{shard}/{SHARDS}"], folder)
    print(f"{SHARDS} shards read {total / size:.2f} times the file")
    if total > READ * size:
        wrong.append(f"{SHARDS} shards read {total / size:.2f} times the file; at most {READ} are expected")
    harness.must(draw + ["plain.exr", "-o", "all_%02d.png"], folder)
    for k in range(PICTURES):
        with open(os.path.join(folder, f"some_{k:02d}.png"), "rb") as some:
            with open(os.path.join(folder, f"all_{k:02d}.png"), "rb") as of_all:
                if some.read() != of_all.read():
                    wrong.append(f"picture {k} is not that from all views")
    # Views that are exact and larger than memory are looked at one by one.
    harness.must([stx, "refine", "plain.exr", "-o", "few.exr", "--quiet", "--max-memory", "64"], folder)
    if read(folder, "few.exr") != read(folder, "views.exr"):
        wrong.append("refine with little memory does not write the same")
    # From a file beside the picture, too.
    harness.must(draw + ["views.exr", "-o", "tight_%02d.png", "--shard", f"3/{SHARDS}", "--max-memory", "24"], folder)
    for k in range(4, 6):
        with open(os.path.join(folder, f"tight_{k:02d}.png"), "rb") as tight:
            with open(os.path.join(folder, f"all_{k:02d}.png"), "rb") as of_all:
                if tight.read() != of_all.read():
                    wrong.append(f"picture {k} with little memory is not that from all views")
    return wrong


def check_lies(stx, folder):
    """A summary of other pixels."""
    wrong = []
    data = bytearray(read(folder, "views.exr"))
    for place in summaries(data):
        data[place + 17] ^= 1  # the last digit of the points
    with open(os.path.join(folder, "lies.exr"), "wb") as file:
        file.write(data)
    draw = [stx, "render", "lies.exr", "-o", "lie.png", "--eye=8,0,2", "--target", "8,0,0", "--backend", "cpu"]
    done = harness.run(draw, folder)
    text = done.err.decode("utf-8", "replace")
    if done.code != 3 or "its summary is not that of its pixels" not in text:
        wrong.append(f"a summary of other pixels: exit code 3 is expected\n{done}")
    if os.path.exists(os.path.join(folder, "lie.png")):
        wrong.append("a summary of other pixels: there is a picture")
    # What no stx wrote says nothing, and all views are read.
    without_summaries(folder, "lies.exr", "lies.exr")
    harness.must(draw + ["--quiet"], folder)
    return wrong


def check_writers(stx, folder):
    """Which files have summaries."""
    wrong = []

    def made(words, name, count):
        harness.must([stx] + words + ["-o", name, "--quiet"], folder, timeout=600)
        found = len(summaries(read(folder, name)))
        if found != count:
            wrong.append(f"{' '.join(words)}: {found} summaries, {count} are expected")
        return read(folder, name)

    few = ["--views", "ring:5", "--size", "96x96"]
    whole = made(["convert", "wall.obj"] + few, "few.exr", 5)
    without_summaries(folder, "few.exr", "bare.exr")
    for name in ("few.exr", "bare.exr"):
        if made(["convert", name], "again.exr", 5) != whole:
            wrong.append(f"convert {name}: the copy is not that of the mesh")
    made(["convert", "few.exr", "--report", "report.json"], "reported.exr", 5)
    made(["bake", "few.exr"], "baked.exr", 5)
    made(["select", "few.exr", "--count", "3"], "selected.exr", 3)
    harness.must([stx, "convert", "few.exr", "-o", "few.mp4", "--quiet"], folder)
    made(["convert", "few.mp4"], "of_mp4.exr", 5)
    # Nothing is known of views that look along parallel lines, of points, and of captured ones whose missing depth
    # may be anything.
    made(["convert", "wall.obj", "--projection", "orthographic"] + few, "parallel.exr", 0)
    with open(os.path.join(folder, "points.obj"), "w") as out, open(os.path.join(folder, "wall.obj")) as of:
        out.writelines(line for line in of if line[0] == "v")
    made(["convert", "points.obj"] + few, "points.exr", 0)
    harness.must([stx, "extract", "few.exr", "-o", "set", "--quiet"], folder)
    made(["convert", "set"], "of_set.exr", 5)
    made(["convert", "set", "--no-depth", "unknown"], "captured.exr", 0)
    return wrong


def main():
    args = harness.arguments(__doc__)
    folder = tempfile.mkdtemp(prefix="stx-some-views-")
    try:
        wall(folder)
        cameras(folder, "views.json", VIEWS, 0, LENGTH, 160)
        cameras(folder, "path.json", PICTURES, 1, LENGTH - 1, 128)
        harness.must([args.stx, "convert", "wall.obj", "-o", "views.exr", "--views", "views.json", "--quiet"], folder,
                     timeout=600)
        found = len(summaries(read(folder, "views.exr")))
        wrong = [] if found == VIEWS else [f"{found} summaries, {VIEWS} are expected"]
        without_summaries(folder, "views.exr", "plain.exr")
        wrong += check_shards(args.stx, folder) + check_lies(args.stx, folder) + check_writers(args.stx, folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    for line in wrong:
        print(line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
