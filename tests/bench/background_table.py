#!/usr/bin/env python3
"""How far backgrounds of plain video are from what was really behind, and OpenCV's MOG2 beside them.

    tests/bench/background_table.py build/release/bin/stx SHARED/data/motion/background

Prints, for each sequence (a folder with input/, derived_background.png, derived_known.png) and
method: AGE, the mean absolute difference of luma (BT.601, 0..255); pEPs, the share of pixels that
differ by more than 20; PSNR of luma; the processor's seconds. Only pixels whose background is known count.
MOG2 with its defaults, getBackgroundImage(), where python3-opencv is installed. Exit code 1 when a
figure misses what is promised.
"""

import argparse
import math
import os
import pathlib
import resource
import struct
import subprocess
import sys
import tempfile
import time
import zlib

WRONG = 20  # levels from which a pixel is an error


def read_png(path):
    """Width, height, channels and rows (bytes) of an 8-bit grey, RGB or RGBA PNG."""
    data = pathlib.Path(path).read_bytes()
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, bits, colour, _, _, interlaced = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        at += length + 12
    channels = {0: 1, 2: 3, 6: 4}[colour]
    if bits != 8 or interlaced:
        raise SystemExit(f"{path}: only plain pictures of 8 bits are read")
    raw, rows = zlib.decompress(packed), []
    stride = width * channels
    before = bytearray(stride)
    for y in range(height):
        kind = raw[y * (stride + 1)]
        row = bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        if kind == 1:
            for i in range(channels, stride):
                row[i] = (row[i] + row[i - channels]) & 255
        elif kind == 2:
            for i in range(stride):
                row[i] = (row[i] + before[i]) & 255
        elif kind == 3:
            for i in range(stride):
                row[i] = (row[i] + ((row[i - channels] if i >= channels else 0) + before[i]) // 2) & 255
        elif kind == 4:
            for i in range(stride):
                a = row[i - channels] if i >= channels else 0
                b, c = before[i], before[i - channels] if i >= channels else 0
                pa, pb, pc = abs(b - c), abs(a - c), abs(a + b - 2 * c)
                row[i] = (row[i] + (a if pa <= pb and pa <= pc else b if pb <= pc else c)) & 255
        rows.append(row)
        before = row
    return width, height, channels, rows


def luma(path):
    width, _, channels, rows = read_png(path)
    out = []
    for row in rows:
        if channels == 1:
            out += row
        else:
            out += [round(0.299 * row[i] + 0.587 * row[i + 1] + 0.114 * row[i + 2])
                    for i in range(0, width * channels, channels)]
    return out


def figures(truth, known, path):
    errors = [abs(a - b) for a, b, k in zip(luma(path), truth, known) if k >= 128]
    squared = sum(e * e for e in errors) / len(errors)
    return {"age": sum(errors) / len(errors), "peps": sum(e > WRONG for e in errors) / len(errors),
            "psnr": 10 * math.log10(255 * 255 / squared) if squared else math.inf}


def cpu_seconds(who):
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def mog2(cv2, frames, target):
    start = cpu_seconds(resource.RUSAGE_SELF)
    model = cv2.createBackgroundSubtractorMOG2()
    for frame in frames:
        model.apply(cv2.imread(str(frame)))
    cv2.imwrite(str(target), model.getBackgroundImage())
    return cpu_seconds(resource.RUSAGE_SELF) - start


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stx")
    parser.add_argument("folder")
    parser.add_argument("--keep", help="folder for the backgrounds, to look at them")
    options = parser.parse_args()
    try:
        import cv2  # pylint: disable=import-outside-toplevel
        cv2.setNumThreads(1)
    except ImportError:
        cv2 = None
        print("MOG2 is left out: python3-opencv is not installed", file=sys.stderr)

    ways = [("select", []), ("select --drift", ["--drift"]), ("n2pg", ["--method", "n2pg"]),
            ("median", ["--method", "median"])]
    found = {}
    print("| sequence | method | AGE | pEPs | PSNR | s |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as temporary:
        place = pathlib.Path(options.keep or temporary)
        for sequence in sorted(pathlib.Path(options.folder).iterdir()):
            if not (sequence / "derived_background.png").exists():
                continue
            truth = luma(sequence / "derived_background.png")
            known = luma(sequence / "derived_known.png")
            frames = sorted((sequence / "input").iterdir())

            def row(name, path, seconds):
                f = figures(truth, known, path)
                found[sequence.name, name] = f
                print(f"| {sequence.name} ({len(frames)}) | {name} | {f['age']:.2f} | {f['peps']:.3f} | "
                      f"{f['psnr']:.1f} | {seconds:.2f} |", flush=True)

            for name, more in ways:
                path = place / f"{sequence.name}_{name.replace(' --', '_')}.png"
                before = cpu_seconds(resource.RUSAGE_CHILDREN)
                subprocess.run([options.stx, "background", sequence / "input", "-o", path, "-q", "--threads", "1",
                                *more], check=True)
                row(name, path, cpu_seconds(resource.RUSAGE_CHILDREN) - before)
            if cv2:
                path = place / f"{sequence.name}_mog2.png"
                row("MOG2", path, mog2(cv2, frames, path))

    missed = []

    def promise(text, good):
        print(f"{'holds' if good else 'MISSED'}: {text}")
        if not good:
            missed.append(text)

    for sequence, most in (("HallAndMonitor", 1.0), ("Foliage", 1.0), ("Toscana", 5.5)):
        if (sequence, "select") in found:
            promise(f"select: AGE <= {most} on {sequence}", found[sequence, "select"]["age"] <= most)
    if ("HallAndMonitor", "n2pg") in found:
        promise("n2pg: 90 % of pixels right on HallAndMonitor", found["HallAndMonitor", "n2pg"]["peps"] <= 0.1)
    for sequence, name in sorted(found):
        if cv2 and name in ("select", "n2pg"):
            promise(f"{name}: AGE below MOG2's on {sequence}",
                    found[sequence, name]["age"] < found[sequence, "MOG2"]["age"])
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
