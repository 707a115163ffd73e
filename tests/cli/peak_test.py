#!/usr/bin/env python3
"""The memory of one large picture: a command refuses it under a limit that is too small, before it takes the memory, and
does it under the limit that it names. `--measure` prints what each takes, in bytes a pixel. And of many views: commands that
look at one at a time take no more for 36 of them than for 12, also of noisy views that are refined, and what is made of views that
do not fit memory is the same.

    tests/cli/peak_test.py build/release/bin/stx MODEL.obj SHARED_DIR --measure 1 --pixels 52
    tests/cli/peak_test.py build/release/bin/stx MODEL.obj SHARED_DIR --only many --measure 1
"""
import hashlib
import json
import math
import os
import random
import re
import shutil
import struct
import sys
import tempfile
import zlib

import harness
from harness import must, run, write

# What a process takes beside the pictures, MiB: the program, its libraries, pieces of work of each thread; and what a
# driver in software takes for its compiler and what that makes.
PROGRAM, DRIVER = 90, 220


def png(path, width, height, kind, rows):
    def chunk(name, body):
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    bits, colour = {"rgb": (8, 2), "depth": (16, 0)}[kind]
    packer = zlib.compressobj(1)
    body = b"".join(packer.compress(b"\0" + rows(y)) for y in range(height)) + packer.flush()
    write(path, b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0))
          + chunk(b"IDAT", body) + chunk(b"IEND", b""))


def image_set(folder, count, width, height):
    """Views whose pixels all are points, in colours that hardly compress."""
    os.makedirs(folder)
    frames = []
    for i in range(count):
        noise = bytes(96 + (b >> 3) for b in random.Random(i).randbytes(3 * width))
        ramps = [struct.pack(f">{width}H", *(2000 + 40 * i + x // 16 + min(y, 64 - y) * 3 + x % 7 for x in range(width)))
                 for y in range(64)]
        png(os.path.join(folder, f"c{i}.png"), width, height, "rgb",
            lambda y: noise[3 * (y * 7 % width):] + noise[:3 * (y * 7 % width)])
        png(os.path.join(folder, f"d{i}.png"), width, height, "depth", lambda y: ramps[y % 64])
        frames.append({"file_path": f"c{i}.png", "depth_file_path": f"d{i}.png",
                       "transform_matrix": [[1, 0, 0, 0.3 * i], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]})
    write(os.path.join(folder, "transforms.json"),
          json.dumps({"w": width, "h": height, "fl_x": width, "fl_y": width, "cx": width / 2, "cy": height / 2, "frames": frames}))


def noisy_set(folder, count, side):
    """Cameras along a wall, with depth as a sensor has it: off by half a percent, each pixel by itself."""
    os.makedirs(folder)
    chance, period = random.Random(5), side // 8
    rows = [struct.pack(f">{side}H", *(int(chance.gauss(3000, 15)) for _ in range(side))) for _ in range(97)]
    png(os.path.join(folder, "c.png"), side, side, "rgb", lambda y: bytes(
        v for x in range(period) for v in (96 + x * 96 // period, 64 + y * 128 // side, 160 - (x * 8 // period) * 8)) * 8)
    frames = []
    for i in range(count):
        png(os.path.join(folder, f"d{i}.png"), side, side, "depth", lambda y: rows[(7 * y + 31 * i) % 97])
        frames.append({"file_path": "c.png", "depth_file_path": f"d{i}.png",
                       "transform_matrix": [[1, 0, 0, 3 / 8 * i], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]})
    write(os.path.join(folder, "transforms.json"),
          json.dumps({"w": side, "h": side, "fl_x": side, "fl_y": side, "cx": side / 2, "cy": side / 2, "frames": frames}))


def commands():
    """Each one's name and words; OUT is a name of its own. {} is a bundle."""
    yield "convert exr", "convert set -o OUT.exr"
    yield "convert mp4", "convert set -o OUT.mp4"
    yield "convert jpeg", "convert {}.exr -o OUT.mp4 --colour jpeg"
    for kind in ("exr", "mp4"):
        yield f"bake {kind}", f"bake {{}}.{kind} -o OUT.exr"
        yield f"refine {kind}", f"refine {{}}.{kind} -o OUT.mp4 --with noise"
        yield f"select {kind}", f"select {{}}.{kind} -o OUT.exr --count 1"
        yield f"surface {kind}", f"render {{}}.{kind} -o OUT.png --eye 0.1,0,0 --target 0,0,-3 --size 64x64 --backend cpu"
        yield f"splat {kind}", f"render {{}}.{kind} -o OUT.png --eye 0.1,0,0 --target 0,0,-3 --size 64x64 --backend cpu --mode splat"
    yield "surface gpu", "render {}.exr -o OUT.png --eye 0.1,0,0 --target 0,0,-3 --size 64x64 --backend gpu"
    yield "splat gpu", "render {}.exr -o OUT.png --eye 0.1,0,0 --target 0,0,-3 --size 64x64 --backend gpu --mode splat"
    yield "bake mp4 to mp4", "bake {}.mp4 -o OUT.mp4"
    for kind in ("ply", "html", "spz"):
        yield f"extract {kind}", f"extract {{}}.exr -o OUT.{kind}"
    # Of {}.exr each takes up to a minute.
    for kind in ("drc", "glb", "glb --triangles 100000"):
        yield f"extract {kind}", f"extract quarter.exr -o OUT.{kind}"
    yield "extract splats", "extract {}.exr -o OUT.ply --as splats"
    yield "extract fewer splats", "extract {}.exr -o OUT.ply --as splats --max-splats 2000000000"
    yield "extract rgbd", "extract {}.exr -o OUT.png --as rgbd"
    yield "extract pair", "extract {}.exr -o OUT.jpg"
    yield "extract folder", "extract {}.exr -o OUT"
    yield "extract colmap", "extract {}.exr -o OUT --cameras colmap"
    yield "pack", "pack {}.exr -o OUT"
    yield "pack tight", "pack {}.exr -o OUT.exr --layout tight"
    yield "sheet", "sheet {}.exr -o OUT.png"
    yield "sheet of two", "sheet {}.exr {}.exr -o OUT.png"
    yield "sheet of pictures", "sheet set/c0.png set/c0.png -o OUT.png"
    yield "compare", "compare set/c0.png set/c0.png"
    yield "background", "background set/c0.png set/c0.png -o OUT.png --method median"
    yield "validate", "validate {}.mp4"
    yield "info", "info {}.mp4"


# Of those of 12 views, at most: tables of what is where grow with them.
MOST = 1.15
# Times that what takes more is measured again.
TRIES = 3
# What selecting keeps beside that of each view, MiB: how it sees the samples of the surface.
SEEN = 0.25
# What refining keeps of each view, and what compares views does, MiB: points by which they are compared.
COMPARED = 0.2


def of_many():
    """Commands that hold one view for each thread. {} is a bundle, VIEWS the words for views of a model, SET an image set."""
    yield "model to exr", "convert MODEL -o OUT.exr VIEWS"
    yield "model to mp4", "convert MODEL -o OUT.mp4 VIEWS"
    yield "exr to exr", "convert {}.exr -o OUT.exr"
    yield "exr to mp4", "convert {}.exr -o OUT.mp4"
    yield "exr to bt", "convert {}.exr -o OUT.bt"
    yield "exr to 8 bits", "convert {}.exr -o OUT.mp4 --depth-bits 8"
    yield "mp4 to exr", "convert {}.mp4 -o OUT.exr"
    for kind in ("exr", "mp4"):
        yield f"bake {kind}", f"bake {{}}.{kind} -o OUT.{kind}"
        yield f"extract {kind}", f"extract {{}}.{kind} -o OUT"
        yield f"sheet {kind}", f"sheet {{}}.{kind} -o OUT.png"
        yield f"points {kind}", f"extract {{}}.{kind} -o OUT.ply"
        yield f"validate {kind}", f"validate {{}}.{kind}"
        yield f"agreement {kind}", f"info {{}}.{kind} --agreement"
        yield f"select {kind}", f"select {{}}.{kind} -o OUT.exr --count 6"
    yield "set to exr", "convert SET -o OUT.exr"
    yield "set to mp4", "convert SET -o OUT.mp4"
    yield "bake set", "bake SET -o OUT.exr"
    yield "extract set", "extract SET -o OUT"
    yield "sheet set", "sheet SET -o OUT.png"
    yield "validate set", "validate SET"
    yield "select set", "select SET -o OUT.mp4 --count 6"
    yield "extract png", "extract {}.exr -o OUT --depth png"
    yield "extract miv", "extract {}.exr -o OUT --cameras miv"
    yield "extract colmap", "extract {}.exr -o OUT --cameras colmap"


def many_views(args, folder):
    """What takes more for 36 views than for 12; the model fills much of each."""
    if not os.path.exists(args.model):
        return []
    model, wrong, counts = os.path.abspath(args.model), [], (12, 36)

    def views(count):
        return ["--views", f"sphere:{count}", "--size", "512x512"]

    for count in counts:
        must([args.stx, "convert", model, "-o", f"many{count}.exr"] + views(count), folder)
        must([args.stx, "convert", f"many{count}.exr", "-o", f"many{count}.mp4"], folder)
        # What a set takes in memory where it is small (heldWhole()) is more than what 36 views take one by one.
        must([args.stx, "extract", f"many{count}.exr", "-o", f"many{count}set"], folder)
    for number, (name, line) in enumerate(of_many()):
        if args.only not in "many " + name:
            continue
        def peak(count):
            words = [part for word in line.split() for part in (views(count) if word == "VIEWS" else [word])]
            words = [word.replace("OUT", f"many{count}_{number}").replace("{}", f"many{count}").replace("SET", f"many{count}set")
                     .replace("MODEL", model) for word in words]
            # Threads of more processors would hold more of both.
            return must([args.stx] + words + ["--threads", "2"], folder).usage.ru_maxrss / 1024

        few, many = (peak(count) for count in counts)
        kept = {"select": SEEN, "agreement": COMPARED}.get(name.split()[0], 0)
        more = kept * (counts[1] - counts[0])
        # Whether two threads hold the most at one moment is chance, and likelier of many views.
        for _ in range(0 if args.measure else TRIES):
            if many > MOST * few + more:
                few, many = max(few, peak(counts[0])), min(many, peak(counts[1]))
        if args.measure:
            print(f"many {name:22} {few:6.1f} MiB of {counts[0]} views, {many:6.1f} of {counts[1]}: {many / few:.2f}", flush=True)
        elif many > MOST * few + more:
            wrong.append(f"{name}: {many:.1f} MiB of {counts[1]} views, {few:.1f} of {counts[0]}")
    return wrong


# Of pictures of 36 views of 512² under a limit for less than a half of them, MiB: what they may take, the program and its
# pictures included. In memory they take 190 to 410.
FEW_LIMIT, FEW = 80, 200


# What stx info --memory calls a command, and such a command.
INFO_COMMANDS = {"convert -o NAME.exr": "convert {} -o OUT.exr", "convert -o NAME.mp4": "convert {} -o OUT.mp4",
        "bake -o NAME.exr": "bake {} -o OUT.exr", "bake -o NAME.mp4": "bake {} -o OUT.mp4",
        "extract -o FOLDER": "extract {} -o OUT", "sheet": "sheet {} -o OUT.png",
        "render": "render {} -o OUT.png --eye 0.1,0,0 --target 0,0,-3 --size 64x64 --backend cpu",
        "render --mode splat": "render {} -o OUT.png --eye 0.1,0,0 --target 0,0,-3 --size 64x64 --backend cpu --mode splat",
        "render --light": "render {} -o OUT.png --eye 0.1,0,0 --target 0,0,-3 --size 64x64 --backend cpu --light dir:0,0,-1",
        "render --mode splat --light": "render {} -o OUT.png --eye 0.1,0,0 --target 0,0,-3 --size 64x64 --backend cpu --mode splat --light dir:0,0,-1",
        "pack": "pack {} -o OUT", "pack --min-psnr": "pack {} -o OUT --min-psnr 40",
        "select": "select {} -o OUT.exr --count 1", "refine": "refine {} -o OUT.exr --with noise",
        "extract -o NAME.ply": "extract {} -o OUT.ply", "extract -o NAME.ply --as splats": "extract {} -o OUT.ply --as splats",
        "extract -o NAME.glb": "extract {} -o OUT.glb", "extract -o NAME.html": "extract {} -o OUT.html"}


# Of these a quarter of the pixels: all take a minute, and that the limit that they name is enough is asked of all anyway.
SLOW = ("extract -o NAME.glb",)


def above_info(args, folder):
    """What takes more than stx info --memory says, of in.exr and quarter.exr."""
    wrong = []
    for source in ("in.exr", "quarter.exr"):
        found = json.loads(must([args.stx, "info", source, "--memory", "--threads", "2", "--format", "json"], folder).out)["memory"]
        if {row["command"] for row in found["commands"]} != set(INFO_COMMANDS):
            return ["stx info --memory has other commands than this test"]
        for number, row in enumerate(found["commands"]):
            if args.only not in "info " + row["command"] or (row["command"] in SLOW) != (source == "quarter.exr"):
                continue
            words = INFO_COMMANDS[row["command"]].replace("OUT", f"listed{number}").replace("{}", source).split()
            peak = must([args.stx] + words + ["--threads", "2", "--max-memory", "16384"], folder).usage.ru_maxrss / 1024
            most = row["bytes"] / (1 << 20) + PROGRAM
            if args.measure:
                print(f"info {row['command']:32} {most:6.0f} MiB at most, {peak:6.1f} taken", flush=True)
            elif peak > most:
                wrong.append(f"{row['command']}: {peak:.0f} MiB, stx info --memory says {most:.0f} with the program")
    return wrong


def from_few(args, folder):
    """What is not the same, or takes too much, of pictures of 36 views that do not fit memory."""
    wrong = []
    for kind in (".exr", ".mp4", "set") if os.path.exists(args.model) else ():
        for options in ("", "--quality best --light dir:0.5,-1.5,-1", "--mode splat"):
            name = f"few {kind} {options}"
            if args.only not in name:
                continue
            line = f"render many36{kind} --orbit 3 --elevation 20 --size 512x512 --backend cpu --threads 2 {options}".split()
            every = must([args.stx] + line + ["-o", "all_%d.png"], folder)
            few = must([args.stx] + line + ["-o", "few_%d.png", "--max-memory", str(FEW_LIMIT)], folder)
            pictures = [open(os.path.join(folder, f"{which}_{i}.png"), "rb").read() for which in ("all", "few") for i in range(3)]
            peak = few.usage.ru_maxrss / 1024
            if args.measure:
                print(f"{name:46} {peak:6.1f} MiB, in memory {every.usage.ru_maxrss / 1024:6.1f}", flush=True)
            elif peak > FEW:
                wrong.append(f"{name}: {peak:.1f} MiB")
            if pictures[:3] != pictures[3:]:
                wrong.append(f"{name}: the pictures are not those of a larger --max-memory")
    return wrong


# Of noisy views of 320²: how many, a limit under which they are refined in a spool, MiB, and one under which they are in memory.
NOISY_VIEWS, NOISY_LIMIT, NOISY_IN_MEMORY = (8, 24), 640, 16384
# What is refined or refines first, and then looks at one view at a time.
NOISY = {"refine exr": "refine {} -o OUT.exr", "refine mp4": "refine {} -o OUT.mp4 --without colours", "convert": "convert {} -o OUT.exr --refine noise",
         "folder": "extract {} -o OUT --refine noise", "points": "extract {} -o OUT.ply --refine noise,agree"}


def files_of(path):
    """What tells a file, or those of a folder, from others. Not their bytes: a process counts those of the one that starts it."""
    def digest(file):
        with open(file, "rb") as opened:
            return hashlib.file_digest(opened, "sha256").digest()

    if not os.path.isdir(path):
        return digest(path)
    return {os.path.relpath(os.path.join(folder, name), path): digest(os.path.join(folder, name))
            for folder, _, names in os.walk(path) for name in names}


def noisy_of_many(args, folder):
    """What takes more for many noisy views than for few, or is not the same as from memory."""
    wrong, (few_views, most_views) = [], NOISY_VIEWS
    if args.only not in "noisy " + " ".join(NOISY):
        return wrong
    for count in NOISY_VIEWS:
        noisy_set(os.path.join(folder, f"noisy{count}"), count, 320)
        must([args.stx, "convert", f"noisy{count}", "-o", f"noisy{count}.exr"], folder)
    for number, (name, line) in enumerate(NOISY.items()):
        output = next(word for word in line.split() if word.startswith("OUT")).replace("OUT", f"noisy_{number}")

        def refined(count, limit=NOISY_LIMIT):
            words = line.replace("OUT", f"noisy_{number}").replace("{}", f"noisy{count}.exr").split()
            done = must([args.stx] + words + ["--threads", "2", "--max-memory", str(limit)], folder)
            if b"noise" not in done.err:
                wrong.append(f"noisy {name}: the views were not refined: {done.err.decode()}")
            return done.usage.ru_maxrss / 1024, files_of(os.path.join(folder, output))

        def most():
            return MOST * few + COMPARED * (most_views - few_views)

        few = refined(few_views)[0]
        many, made = refined(most_views)
        in_memory, expected = refined(most_views, NOISY_IN_MEMORY)
        for _ in range(0 if args.measure else TRIES):
            if many > most():
                few, many = max(few, refined(few_views)[0]), min(many, refined(most_views)[0])
        if args.measure:
            print(f"noisy {name:21} {few:6.1f} MiB of {few_views} views, {many:6.1f} of {most_views}: {many / few:.2f}; in memory {in_memory:.1f}", flush=True)
        elif many > most():
            wrong.append(f"noisy {name}: {many:.1f} MiB of {most_views} views, {few:.1f} of {few_views}")
        if made != expected:
            wrong.append(f"noisy {name}: it is not that of a larger --max-memory")
    for name, words, limit in (("glb", "extract noisy24.exr -o OUT.glb", MODEL_LIMIT),
                               ("picture", "render noisy24.exr -o OUT.png --eye 5,0,0 --target 5.2,0,-3 --size 256x256 --backend cpu", FEW_LIMIT)):
        output = [word for word in words.split() if word.startswith("OUT")][0]
        made = []
        for most in (limit, NOISY_IN_MEMORY):
            done = must([args.stx] + words.replace("OUT", f"noisy_{most}").split() + ["--threads", "2", "--max-memory", str(most)], folder)
            made.append(files_of(os.path.join(folder, output.replace("OUT", f"noisy_{most}"))))
            if args.measure:
                print(f"noisy {name:21} {done.usage.ru_maxrss / 1024:6.1f} MiB at --max-memory {most}", flush=True)
            elif done.usage.ru_maxrss / 1024 > most + PROGRAM:
                wrong.append(f"noisy {name}: {done.usage.ru_maxrss / 1024:.1f} MiB at --max-memory {most}")
        if made[0] != made[1]:
            wrong.append(f"noisy {name}: it is not that of a larger --max-memory")
    return wrong


# Of a sensor that turned in place: views of 512², and a limit for a half of what they take in memory, MiB.
TURNED_VIEWS, CUBE_LIMIT = 36, 80


def turned_set(folder, count, side):
    """A ball of 3 units from inside."""
    os.makedirs(folder)
    half = side / 2
    png(os.path.join(folder, "c.png"), side, side, "rgb", lambda y: bytes(v for x in range(side) for v in (x * 255 // side, y * 255 // side, 90)))
    png(os.path.join(folder, "d.png"), side, side, "depth", lambda y: struct.pack(
        f">{side}H", *(round(15000 / math.sqrt(1 + ((x + 0.5) / half - 1) ** 2 + ((y + 0.5) / half - 1) ** 2)) for x in range(side))))
    frames = []
    for i in range(count):
        sine, cosine = math.sin(2 * math.pi * i / count), math.cos(2 * math.pi * i / count)
        frames.append({"file_path": "c.png", "depth_file_path": "d.png",
                       "transform_matrix": [[cosine, 0, sine, 0], [0, 1, 0, 0], [-sine, 0, cosine, 0], [0, 0, 0, 1]]})
    write(os.path.join(folder, "transforms.json"),
          json.dumps({"w": side, "h": side, "fl_x": half, "fl_y": half, "cx": half, "cy": half, "integer_depth_scale": 0.0002, "frames": frames}))


def hold(args, name, done, limit, asked, wrong):
    """Adds to `wrong` a run whose peak is above its --max-memory, `limit`, where that is the one `asked` of; with --measure says the peak."""
    peak = done.usage.ru_maxrss / 1024
    if args.measure:
        print(f"{name:25} {peak:6.1f} MiB at --max-memory {limit}", flush=True)
    elif limit == asked and peak > limit + PROGRAM:
        wrong.append(f"{name}: {peak:.1f} MiB at --max-memory {limit}")


def cube_of_few(args, folder):
    """What is not the same, or takes too much, of the cube of views that do not fit memory."""
    wrong = []
    if args.only not in "cube":
        return wrong
    turned_set(os.path.join(folder, "turned"), TURNED_VIEWS, 512)
    must([args.stx, "convert", "turned", "-o", "turned.exr"], folder)
    cubes = []
    for limit in (NOISY_IN_MEMORY, CUBE_LIMIT):
        done = must([args.stx, "convert", "turned.exr", "-o", f"cube{limit}.mp4", "--cube", "--threads", "2", "--max-memory", str(limit)], folder)
        cubes.append(open(os.path.join(folder, f"cube{limit}.mp4"), "rb").read())
        hold(args, "cube", done, limit, CUBE_LIMIT, wrong)
    if cubes[0] != cubes[1]:
        wrong.append("cube: it is not that of a larger --max-memory")
    return wrong


def film_set(folder, count, side):
    """Two moments of a ball from inside."""
    turned_set(folder, count, side)
    png(os.path.join(folder, "later.png"), side, side, "rgb", lambda y: bytes(v for x in range(side) for v in (90, x * 255 // side, y * 255 // side)))
    with open(os.path.join(folder, "transforms.json"), encoding="utf-8") as file:
        scene = json.load(file)
    scene["frames"] = [view | {"camera": i, "time": moment, "file_path": picture}
                       for moment, picture in ((0, "c.png"), (1, "later.png")) for i, view in enumerate(scene["frames"])]
    write(os.path.join(folder, "transforms.json"), json.dumps(scene))


def film_of_few(args, folder):
    """What is not the same, or takes too much, of pictures of a film whose frames do not fit memory."""
    wrong = []
    films = [(mode, film) for mode in ("surface", "splat") for film in ("film_%d.exr", "film.mp4", "film") if args.only in f"film {mode} {film}"]
    if not films:
        return wrong
    film_set(os.path.join(folder, "film"), TURNED_VIEWS, 512)
    for film in ("film_%d.exr", "film.mp4"):
        must([args.stx, "convert", "film", "-o", film], folder)
    for number, (mode, film) in enumerate(films):
        name, pictures = f"film {mode} {film}", []
        for limit in (NOISY_IN_MEMORY, CUBE_LIMIT):
            done = must([args.stx, "render", film, "-o", f"shown{number}_{limit}/%d.png", "--mode", mode, "--times", "all", "--size", "256x256",
                         "--threads", "2", "--max-memory", str(limit)] + "--eye 0.1,0,0 --target 0,0,-3".split(), folder)
            pictures.append(files_of(os.path.join(folder, f"shown{number}_{limit}")))
            hold(args, name, done, limit, CUBE_LIMIT, wrong)
        if len(set(pictures[0].values())) != 2 or pictures[0] != pictures[1]:
            wrong.append(f"{name}: its pictures are not those of a larger --max-memory")
    return wrong


# Of films of 512²: how many views, and a limit under which no frame of them is held whole and decoded pictures of both fill
# their part, MiB.
FILM_VIEWS, FILM_LIMIT = (12, 36), 64
# What converts a film. {} is its name without the ending.
FILMS = {"exr to exr": "convert {}_%d.exr -o OUT_%d.exr", "exr to mp4": "convert {}_%d.exr -o OUT.mp4",
         "mp4 to exr": "convert {}.mp4 -o OUT_%d.exr", "mp4 to mp4": "convert {}.mp4 -o OUT.mp4 --depth-bits 8",
         "to jpeg": "convert {}.mp4 -o OUT.mp4 --colour jpeg",
         "set to exr": "convert {} -o OUT_%d.exr", "set to mp4": "convert {} -o OUT.mp4",
         "folder of exr": "extract {}_%d.exr -o OUT --refine off", "folder of mp4": "extract {}.mp4 -o OUT --refine off",
         "sheet of exr": "sheet {}_%d.exr -o OUT.png --refine off", "sheet of mp4": "sheet {}.mp4 -o OUT.png --refine off"}


def film_of_many(args, folder):
    """What takes more for films of many views than of few, or is not the same as from memory."""
    wrong = []
    rows = {name: line for name, line in FILMS.items() if args.only in f"films {name}"}
    if not rows:
        return wrong
    for count in FILM_VIEWS:
        film_set(os.path.join(folder, f"film{count}"), count, 512)
        for film in (f"film{count}_%d.exr", f"film{count}.mp4"):
            must([args.stx, "convert", f"film{count}", "-o", film], folder)
    for number, (name, line) in enumerate(rows.items()):
        def converted(count, limit=FILM_LIMIT):
            words = line.replace("OUT", f"films/{number}").replace("{}", f"film{count}").split()
            os.makedirs(os.path.join(folder, "films"))
            done = must([args.stx] + words + ["--threads", "2", "--max-memory", str(limit)], folder)
            made = files_of(os.path.join(folder, "films"))
            shutil.rmtree(os.path.join(folder, "films"))
            return done.usage.ru_maxrss / 1024, made

        few = converted(FILM_VIEWS[0])[0]
        many, made = converted(FILM_VIEWS[1])
        in_memory, expected = converted(FILM_VIEWS[1], NOISY_IN_MEMORY)
        # Views of a set are compared.
        more = COMPARED * (FILM_VIEWS[1] - FILM_VIEWS[0]) if name.startswith("set") else 0
        for _ in range(0 if args.measure else TRIES):
            if many > MOST * few + more:
                few, many = max(few, converted(FILM_VIEWS[0])[0]), min(many, converted(FILM_VIEWS[1])[0])
        if args.measure:
            print(f"films {name:21} {few:6.1f} MiB of {FILM_VIEWS[0]} views, {many:6.1f} of {FILM_VIEWS[1]}: {many / few:.2f}; in memory {in_memory:.1f}", flush=True)
        elif many > MOST * few + more:
            wrong.append(f"films {name}: {many:.1f} MiB of {FILM_VIEWS[1]} views, {few:.1f} of {FILM_VIEWS[0]}")
        if " to " in name:
            source = line.split()[1].replace("{}", f"film{FILM_VIEWS[1]}")
            found = json.loads(must([args.stx, "info", source, "--memory", "--threads", "2", "--format", "json"], folder).out)["memory"]
            said, = (row for row in found["commands"] if row["command"] == "convert -o NAME." + name.split()[2])
            if said["views"] != "one for each thread" or in_memory > said["bytes"] / (1 << 20) + PROGRAM:
                wrong.append(f"films {name}: {in_memory:.1f} MiB, but stx info --memory says {said}")
        if made != expected:
            wrong.append(f"films {name}: it is not that of a larger --max-memory")
    return wrong


# Of surfaces and of splats of 36 views of 512² under limits for a fifth and a half of what is asked for them in memory, MiB:
# what they may take, with the program. In memory they take 180 and 500.
MODEL_LIMIT, MODEL = 140, 120
SPLATS_LIMIT, SPLATS = 600, 200


def model_of_few(args, folder):
    """What is not the same, or takes too much, of a model of 36 views that do not fit memory."""
    wrong = []
    models_of = ((".exr", "glb", "", MODEL_LIMIT, MODEL), (".mp4", "glb", "", MODEL_LIMIT, MODEL),
                 (".exr", "ply", "--as splats", SPLATS_LIMIT, SPLATS),
                 (".exr", "ply", "--as splats --max-splats 100000", SPLATS_LIMIT, SPLATS))
    for kind, ending, options, limit, most in models_of if os.path.exists(args.model) else ():
        name = f"few {kind} {ending} {options}"
        if args.only not in name:
            continue
        line = ["extract", f"many36{kind}", "--threads", "2"] + options.split() + ["-o"]
        every = must([args.stx] + line + ["all." + ending, "--max-memory", "16384"], folder)
        few = must([args.stx] + line + ["few." + ending, "--max-memory", str(limit)], folder)
        models = [files_of(os.path.join(folder, f"{which}.{ending}")) for which in ("all", "few")]
        peak = few.usage.ru_maxrss / 1024
        if args.measure:
            print(f"{name:46} {peak:6.1f} MiB, in memory {every.usage.ru_maxrss / 1024:6.1f}", flush=True)
        elif peak > most:
            wrong.append(f"{name}: {peak:.1f} MiB")
        if models[0] != models[1]:
            wrong.append(f"{name}: the model is not that of a larger --max-memory")
    return wrong


# Of pruning 36 views of 512² of which a third is points, and of an atlas of them, bytes for each pixel of the views. All
# views, what pruning knows of each pixel and the atlas side by side take 40.
PRUNE = 20
# Of the same into OpenEXR, which is written a few rows at a time: the pages alone take 8.
PACK_EXR = 13
# Of pruning them by pictures, MiB: a limit with room for the atlas, but not for all views beside it.
PRUNE_LIMIT = 224


def pruned_one_by_one(args, folder):
    """What takes too much of an atlas of many views."""
    wrong = []
    rows = [("many36.exr", 36, ""), ("many36.exr --prune", 36, ""), ("many36.exr --prune --layout tight", 36, ""), ("many36.exr many12.exr", 48, "")]
    rows += [("many36.exr --max-memory 100", 36, ".exr"), ("many36.exr --prune", 36, ".exr")]
    for number, (words, views, ending) in enumerate(rows if os.path.exists(args.model) else ()):
        name, mega = f"many pack {words}", views * 512 * 512 / 1e6
        if args.only not in name:
            continue
        done = must([args.stx, "pack"] + words.split() + ["-o", f"packed{number}{ending}", "--threads", "2"], folder)
        peak = done.usage.ru_maxrss / 1024
        each = (peak - 40) * 1.048576 / mega
        if args.measure:
            print(f"{name:46} {peak:6.1f} MiB, {each:.1f} bytes a pixel", flush=True)
        elif each > (PACK_EXR if ending else PRUNE):
            wrong.append(f"{name}: {peak:.1f} MiB, {each:.1f} bytes a pixel")
        if number == 0:
            found = json.loads(must([args.stx, "info", "many36.exr", "--memory", "--threads", "2", "--format", "json"], folder).out)
            said, = (row["bytes"] / (1 << 20) for row in found["memory"]["commands"] if row["command"] == "pack")
            if args.measure:
                print(f"{name:46} {said:6.1f} MiB by stx info --memory", flush=True)
            # The pages are 24 bytes a pixel at most, of views in memory 32.
            elif not peak - PROGRAM <= said <= 1.7 * peak:
                wrong.append(f"{name}: {peak:.1f} MiB, but stx info --memory says {said:.1f}")
    name, made = "few pack --min-psnr", []
    if os.path.exists(args.model) and args.only in name:
        for limit in (NOISY_IN_MEMORY, PRUNE_LIMIT):
            done = must([args.stx, "pack", "many36.exr", "-o", f"measured{limit}", "--min-psnr", "20", "--threads", "2", "--max-memory", str(limit)], folder)
            made.append(files_of(os.path.join(folder, f"measured{limit}")))
            peak = done.usage.ru_maxrss / 1024
            if args.measure:
                print(f"{name:46} {peak:6.1f} MiB at --max-memory {limit}", flush=True)
            elif peak > PRUNE_LIMIT + PROGRAM:
                wrong.append(f"{name}: {peak:.1f} MiB at --max-memory {limit}")
        if made[0] != made[1]:
            wrong.append(f"{name}: the atlas is not that of a larger --max-memory")
    return wrong


# Of a cloud of points whose discs all at once would take four times as much, MiB.
CLOUD_LIMIT = 60


def clouds(args, folder):
    """Points everywhere in a box, which become discs, and a hundred in each of a thousand places, which become half balls."""
    wrong, numbers = [], random.Random(1)
    box = struct.pack("<900000f", *(numbers.uniform(-1, 1) for _ in range(900000)))
    for name, body in (("cloud", box), ("cloud of places", box[:12000] * 100)):
        if args.only not in name:
            continue
        write(os.path.join(folder, "cloud.ply"), b"ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % (len(body) // 12)
              + b"property float x\nproperty float y\nproperty float z\nend_header\n" + body)
        made = []
        for limit in (16384, CLOUD_LIMIT):
            done = must([args.stx, "convert", "cloud.ply", "-o", f"cloud{limit}.exr", "--views", "ring:2", "--size", "64x64",
                         "--threads", "2", "--max-memory", str(limit)], folder)
            made.append(files_of(os.path.join(folder, f"cloud{limit}.exr")))
            hold(args, name, done, limit, CLOUD_LIMIT, wrong)
        if made[0] != made[1]:
            wrong.append(f"{name}: it is not that of a larger --max-memory")
    return wrong


def main():
    args = harness.arguments(__doc__, measure=0, pixels=9, views=1, only="")
    wrong = []
    side = int((args.pixels * 1e6 / args.views) ** 0.5) // 64 * 64
    mega = side * side * args.views / 1e6
    # Room for the views as they are read, and for little else.
    small = int(12 * mega)
    with tempfile.TemporaryDirectory(prefix="stx-peak-") as folder:
        image_set(os.path.join(folder, "set"), args.views, side, side)
        must([args.stx, "convert", "set", "-o", "in.exr", "--max-memory", "16384"], folder)
        must([args.stx, "convert", "in.exr", "-o", "in.mp4", "--max-memory", "16384"], folder)
        image_set(os.path.join(folder, "quarterset"), args.views, side // 2, side // 2)
        must([args.stx, "convert", "quarterset", "-o", "quarter.exr", "--max-memory", "16384"], folder)

        def peak_of(words, limit):
            done = run([args.stx] + words + ["--max-memory", str(limit)], folder, timeout=600)
            return done, done.usage.ru_maxrss >> 10

        for number, (name, line) in enumerate(commands()):
            if args.only not in name:
                continue
            words = line.replace("OUT", f"out{number}").replace("{}", "in").split()
            if args.measure:
                done, peak = peak_of(words, 1 << 20)
                print(f"{name:22} exit {done.code} {peak:6} MiB {(peak - 60) * 1.048576 / mega:6.1f} bytes a pixel {done.seconds:6.1f} s", flush=True)
                continue
            done, peak = peak_of(words, small)
            text = done.err.decode("utf-8", "replace")
            beside = PROGRAM + (DRIVER if "gpu" in name else 0)
            if peak > small + beside:
                wrong.append(f"{name}: {peak} MiB at --max-memory {small}: exit code {done.code} {text}")
            if done.code == 0 or (done.code == 5 and "gpu" in name):
                continue
            # What it would need is known once the views are; of a driver in software when it has drawn them up.
            limit = small
            for _ in range(2 if "gpu" in name else 1):
                more = re.search(r"--max-memory (\d+)", text)
                if done.code != 3 or not more or int(more.group(1)) <= limit:
                    break
                limit = int(more.group(1))
                done, peak = peak_of(words, limit)
                text = done.err.decode("utf-8", "replace")
            if done.code != 0 or peak > limit + beside:
                wrong.append(f"{name}: {peak} MiB at --max-memory {limit}: exit code {done.code} {text}")
        wrong += above_info(args, folder)
        wrong += many_views(args, folder)
        wrong += from_few(args, folder)
        wrong += model_of_few(args, folder)
        wrong += pruned_one_by_one(args, folder)
        wrong += noisy_of_many(args, folder)
        wrong += cube_of_few(args, folder)
        wrong += film_of_few(args, folder)
        wrong += film_of_many(args, folder)
        wrong += clouds(args, folder)
    print("\n".join(wrong))
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
