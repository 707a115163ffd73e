#!/usr/bin/env python3
"""Files of Gaussian splats against @playcanvas/splat-transform: it reads what stx writes (count, bounds, mean colour), and
stx reads what it writes. By hand: `npm install --no-save @playcanvas/splat-transform@3.7.0` in tests/browser (215 MB)."""
import gzip
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile

from pages import NODE_MODULES, psnr
from viewer_test import Test

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../cli"))
from harness import arguments  # noqa: E402

TOOL = os.path.join(NODE_MODULES, "@playcanvas/splat-transform/bin/cli.mjs")
DEGREE_0 = 0.28209479177387814


def transform(*arguments, cwd):
    return subprocess.run(["node", TOOL, "-q", "-w", *arguments], cwd=cwd, capture_output=True, text=True, timeout=300, check=True).stdout


def stats(name, cwd, *options):
    """Count, least and largest place of the splats of a file, as splat-transform finds them."""
    found = json.loads(transform(name, *options, "--stats", "json", "null", cwd=cwd))["stats"][0]
    columns, data = found["columns"], found["data"]
    of = {key: [data[key][columns.index(c)] for c in ("x", "y", "z")] for key in ("min", "max")}
    return found["numGaussians"], of["min"], of["max"]


def info(test, name):
    return json.loads(test.stx_run("info", name, "--format", "json").out)


def mean_colour(path):
    """Of a PLY that stx wrote: the mean of 0.5 + 0.282 f_dc, times 255."""
    with open(path, "rb") as file:
        content = file.read()
    at = content.index(b"end_header\n") + 11
    names = [line.split()[-1] for line in content[:at].decode().splitlines() if line.startswith("property")]
    values = struct.iter_unpack("<f", content[at:])
    columns = [0.0] * len(names)
    count = 0
    for i, (value,) in enumerate(values):
        columns[i % len(names)] += value
        count = i // len(names) + 1
    return [255 * (0.5 + DEGREE_0 * columns[names.index(f"f_dc_{k}")] / count) for k in range(3)]


def main():
    args = arguments(__doc__)
    if not shutil.which("node") or not os.path.exists(TOOL):
        print("SKIP: needs node and `npm install --no-save @playcanvas/splat-transform@3.7.0` in tests/browser")
        return 77
    with tempfile.TemporaryDirectory(prefix="stx-splats-") as folder:
        test = Test(args, folder)
        test.stx_run("convert", args.model, "-o", "model.exr", "--views", "sphere:8", "--size", "160x160")
        for name in ("a.ply", "a.spz", "a.glb"):
            test.stx_run("extract", "model.exr", "-o", name, "--as", "splats")
        colour = mean_colour(test.path("a.ply"))
        for name in ("a.ply", "a.spz"):
            count, _, _ = stats(name, folder)
            # Our bounds leave out what lets more than half of the light through.
            _, low, high = stats(name, folder, "-V", "opacity,gte,0.5")
            ours = info(test, name)
            test.check(count == ours["splats"]["count"], f"{name}: {count} splats, ours {ours['splats']['count']}")
            off = max(abs(a - b) for a, b in zip(low + high, ours["bounds"]["min"] + ours["bounds"]["max"]))
            test.check(off <= 1e-5, f"{name}: bounds off by {off:g}")
            # Told in the file's own order of columns; SPZ's colours are 8 bits.
            transform(name, "back.ply", cwd=folder)
            off = max(abs(a - b) for a, b in zip(mean_colour(test.path("back.ply")), colour))
            test.check(off <= 0.5, f"{name}: mean colour off by {off:g} of 255")
        # What it writes of our PLY, which it takes to be turned by half around Z.
        for target, options in (("t.ply", ()), ("t.glb", ()), ("t.spz", ("--spz-version", "3")),
                                ("t4.spz", ("--spz-version", "4"))):
            transform("a.ply", target, *options, cwd=folder)
            theirs, ours = info(test, target), info(test, "a.ply")
            test.check(theirs["splats"]["count"] == ours["splats"]["count"], f"{target}: {theirs['splats']}")
            low, high = ours["bounds"]["min"], ours["bounds"]["max"]
            if target == "t.glb":
                low, high = ([-high[0], -high[1], low[2]], [-low[0], -low[1], high[2]])
            off = max(abs(a - b) for a, b in zip(low + high, theirs["bounds"]["min"] + theirs["bounds"]["max"]))
            test.check(off <= (1e-3 if target.endswith(".spz") else 1e-5), f"{target}: bounds off by {off:g}")
        view = ("--size", "200x200", "--up=-Y")
        test.stx_run("render", "a.ply", "-o", "ours.png", *view)
        test.stx_run("render", "t.ply", "-o", "theirs.png", *view)
        test.check(psnr(args.stx, "ours.png", "theirs.png", folder) >= 60, "t.ply is drawn as a.ply is")
        with open(test.path("t.spz"), "rb") as file:
            test.check(gzip.decompress(file.read())[4] == 3, "t.spz is of version 3")
        with open(test.path("t4.spz"), "rb") as file:
            test.check(file.read(5)[4] == 4, "t4.spz is of version 4")
        for name in ("t.spz", "t4.spz"):
            test.stx_run("render", name, "-o", "spz.png", *view)
            found = psnr(args.stx, "ours.png", "spz.png", folder)
            test.check(found >= 30, f"{name} is drawn as a.ply is: {found:.1f} dB")
        return 1 if test.failed else 0


if __name__ == "__main__":
    sys.exit(main())
