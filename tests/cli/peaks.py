"""What the tests of memory share: inputs that are large or many, and what a run may take."""
import hashlib
import json
import math
import os
import random
import struct
import sys
import zlib

from harness import write

# What a process takes beside the pictures, MiB: the program, its libraries, pieces of work of each thread; and what a
# driver in software takes for its compiler and what that makes.
PROGRAM, DRIVER = 90, 220
# A limit that nothing here reaches, MiB.
IN_MEMORY = 16384
# What many views take of what few take, at most: tables of what is where grow with them.
MOST = 1.15
# Times that what takes more is measured again.
TRIES = 3
# What refining keeps of each view, and what compares views does, MiB: points by which they are compared.
COMPARED = 0.2
# Views of a sensor that turned in place.
TURNED_VIEWS = 36


def png(path, width, height, kind, rows):
    def chunk(name, body):
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    bits, colour = {"rgb": (8, 2), "depth": (16, 0)}[kind]
    packer = zlib.compressobj(1)
    body = b"".join(packer.compress(b"\0" + rows(y)) for y in range(height)) + packer.flush()
    write(path, b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0))
          + chunk(b"IDAT", body) + chunk(b"IEND", b""))


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


def film_set(folder, count, side):
    """Two moments of a ball from inside."""
    turned_set(folder, count, side)
    png(os.path.join(folder, "later.png"), side, side, "rgb", lambda y: bytes(v for x in range(side) for v in (90, x * 255 // side, y * 255 // side)))
    with open(os.path.join(folder, "transforms.json"), encoding="utf-8") as file:
        scene = json.load(file)
    scene["frames"] = [view | {"camera": i, "time": moment, "file_path": picture}
                       for moment, picture in ((0, "c.png"), (1, "later.png")) for i, view in enumerate(scene["frames"])]
    write(os.path.join(folder, "transforms.json"), json.dumps(scene))


def files_of(path):
    """What tells a file, or those of a folder, from others. Not their bytes: a process counts those of the one that starts it."""
    def digest(file):
        with open(file, "rb") as opened:
            return hashlib.file_digest(opened, "sha256").digest()

    if not os.path.isdir(path):
        return digest(path)
    return {os.path.relpath(os.path.join(folder, name), path): digest(os.path.join(folder, name))
            for folder, _, names in os.walk(path) for name in names}


def hold(args, name, done, limit, asked, wrong):
    """Adds to `wrong` a run whose peak is above its --max-memory, `limit`, where that is the one `asked` of; with --measure says the peak."""
    peak = done.usage.ru_maxrss / 1024
    if args.measure:
        print(f"{name:25} {peak:6.1f} MiB at --max-memory {limit}", flush=True)
    elif limit == asked and peak > limit + PROGRAM:
        wrong.append(f"{name}: {peak:.1f} MiB at --max-memory {limit}")


def end(wrong):
    """Prints what is wrong and ends the test."""
    print("\n".join(wrong))
    sys.exit(1 if wrong else 0)
