#!/usr/bin/env python3
"""The pictures of lib/render/pipeline.md: what each stage of rendering and step of refining changes in one frame.

Usage: samples/make_stage_pictures.py BUILD [FOLDER]      (a build with the Python module and the sample model; wants oiiotool)

The sample model is captured in several ways, exact and as depth cameras have it. Each stage is left out of a frame of each capture
(`stx render --without`); the capture that changes most gives the picture: a part of the frame without the stage, with it, and the difference."""
import os
import re
import subprocess
import sys
import tempfile

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
BUILD = os.path.abspath(sys.argv[1])
OUT = os.path.abspath(sys.argv[2] if len(sys.argv) > 2 else os.path.join(HERE, "pictures/stages"))
sys.path.insert(0, os.path.join(BUILD, "python"))
import stx  # noqa: E402

SIDE, PART, ZOOM = 240, 56, 2  # pixels of a frame and of the part that is shown; how much larger that is shown
VIEWS = 160                    # pixels of a view
# Where another capture than the one that changes most says more of what a stage is for.
SHOWN_OF = {"unmeasured": "unmeasured", "surroundings": "room", "levels": "exact", "sharpen": "exact", "settle": None, "exposure": "exposed",
            "strays": "noisy", "nearer": "exact", "closing": "few", "mean": "exact", "rims": "alone", "coarse": "mixed"}
RANDOM = np.random.default_rng(7)


def with_depth(view, depth, colour=None, no_depth=None):
    return stx.View(view.colour if colour is None else colour, depth.astype(np.float32), view.camera, name=view.name,
                    no_depth=no_depth or view.no_depth)


def noisy(bundle, share=0.006):
    """Noise of each pixel; views from the same place have the same, or they would not repeat each other."""
    done = {}
    for v in bundle.views:
        key = np.round(v.camera.world_from_camera, 6).tobytes()
        done.setdefault(key, v.depth * RANDOM.normal(1, share, v.depth.shape))
    return stx.Bundle([with_depth(v, done[np.round(v.camera.world_from_camera, 6).tobytes()]) for v in bundle.views])


def exposed(bundle):
    return stx.Bundle([with_depth(v, v.depth, np.concatenate([np.clip(v.colour[..., :3] * RANDOM.uniform(0.85, 1.15), 0, 255).astype(np.uint8),
                                                              v.colour[..., 3:]], axis=2)) for i, v in enumerate(bundle.views)])


def fat(bundle):
    """Surfaces in front reach over what is behind them by a pixel, as those of stereo do."""
    def grown(d):
        padded = np.pad(d, 1, mode="edge")
        near = np.min([padded[y:y + d.shape[0], x:x + d.shape[1]] for y in range(3) for x in range(3)], axis=0)
        return np.where(np.isfinite(d), near, d)
    return stx.Bundle([with_depth(v, grown(v.depth)) for v in bundle.views])


def glass(bundle):
    def half(c):
        c = c.copy()
        c[..., 3] = np.where(c[..., 3] == 255, 128, c[..., 3])
        return c
    return stx.Bundle([with_depth(v, v.depth, half(v.colour)) for v in bundle.views])


def unmeasured(bundle):
    """A depth camera that measures nothing at the upper and left borders of its pictures."""
    def cut(d):
        d = d.copy()
        d[:, : VIEWS // 8] = np.inf
        d[: VIEWS // 4] = np.inf
        return d
    return stx.Bundle([with_depth(v, cut(v.depth), no_depth="unknown") for v in bundle.views])


def apart(bundle):
    return stx.Bundle([with_depth(v, v.depth * (1 + 0.008 * (i % 2)), no_depth="unknown") for i, v in enumerate(bundle.views)])


def room_obj(model, folder):
    """The sample model in a room of painted walls."""
    text = open(model).read()
    count = sum(line.startswith("v ") for line in text.splitlines())
    textures = sum(line.startswith("vt ") for line in text.splitlines())
    a, b, c, d = (-2, -0.3, -2), (2, -0.3, -2), (2, 2.2, -2), (-2, 2.2, -2)
    e, f, g, h = (-2, -0.3, 3), (2, -0.3, 3), (2, 2.2, 3), (-2, 2.2, 3)
    corners = [a, b, c, d, e, f, g, h]
    text += "".join("v %g %g %g\n" % p for p in corners) + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    for face in ((1, 2, 3, 4), (5, 1, 4, 8), (2, 6, 7, 3), (5, 6, 2, 1), (4, 3, 7, 8)):
        text += "f " + " ".join(f"{count + k}/{textures + 1 + i}" for i, k in enumerate(face)) + "\n"
    path = os.path.join(folder, "room.obj")
    open(path, "w").write(text)
    for ending in (".mtl", ".png"):
        data = open(model[:-4] + ending, "rb").read()
        open(os.path.join(folder, os.path.basename(model)[:-4] + ending), "wb").write(data)
    return path


def captures(folder):
    """Name of each capture: its bundle, and the options of the cameras that draw it."""
    model = os.path.join(BUILD, "samples/amphora.obj")
    size = (VIEWS, VIEWS)
    sphere = stx.convert(model, views="sphere:16", size=size)
    room = stx.convert(room_obj(model, folder), cameras=[
        stx.Camera.look_at((x, 0.8, 2.7), (0.3 * x, 0.5, 0), size=size, fov=52) for x in (-0.5, 0.5)])
    around = ["--eye=1.6,1.3,2.6", "--target=0,0.42,0", "--fov=34", f"--size={SIDE}x{SIDE}"]
    small = around[:3] + ["--size=56x56"]
    inside = ["--eye=0.9,0.9,2.5", "--target=0,0.5,0", "--fov=52", f"--size={SIDE}x{SIDE}"]
    return {
        "exact": (sphere, around), "few": (stx.convert(model, views="sphere:5", size=size), around), "small": (sphere, small),
        "grid": (noisy(stx.convert(model, views="octahedral:4", size=size)), around), "noisy": (noisy(sphere), around),
        "exposed": (exposed(stx.convert(model, views="sphere:16", size=(256, 256))), around), "fat": (fat(sphere), around),
        "glass": (glass(sphere), around), "room": (room, inside), "unmeasured": (unmeasured(room), inside), "apart": (apart(room), inside),
        "alone": (stx.Bundle([room.views[0]]), inside),
        "mixed": (stx.Bundle([*sphere.views, *(stx.View(v.colour, v.depth, v.camera, name="coarse")
                                               for v in stx.convert(model, views="ring:1", size=(12, 12)).views)]), around),
    }


def stages():
    """Name and mode of each stage and step, from their lists."""
    text = open(os.path.join(HERE, "../lib/render/api/stages.hpp")).read()
    found = re.findall(r"STAGE\((\w+), (both|surface|splat),", text)
    steps = open(os.path.join(HERE, "../lib/refine/README.md")).read()
    return found + [(name, "splat" if "splat" in when else "surface")
                    for name, when in re.findall(r"^\| `(\w+)` \| refine \| ([^|]*)", steps, re.M)]


def pixels(file):
    """Of a picture, rows of R, G and B."""
    subprocess.run(["oiiotool", file, "--ch", "R,G,B", "-d", "uint8", "-o", file + ".ppm"], check=True)
    data = open(file + ".ppm", "rb").read()
    width, height = (int(n) for n in re.match(rb"P6\s+(\d+)\s+(\d+)", data).groups())
    return np.frombuffer(data[-3 * width * height:], np.uint8).reshape(height, width, 3).astype(int)


def drawn(file, camera, mode, without=None):
    out = os.path.join(os.path.dirname(file), "drawn.png")
    subprocess.run([os.path.join(BUILD, "bin/stx"), "render", file, "-o", out, *camera, "--mode", mode, "--background=1,1,1", "--quiet",
                    "--quality=best", *(["--without", without] if without else [])], check=True)
    return pixels(out)


def overview(file, camera):
    """A view, its depth (near is dark), the frame without any stage or step, the frame."""
    view = stx.open(file).views[1]
    found = np.isfinite(view.depth)
    near, far = view.depth[found].min(), view.depth[found].max()
    depth = np.where(found, 40 + 180 * (view.depth - near) / (far - near), 255)
    alpha = view.colour[..., 3:] / 255
    tiles = [view.colour[..., :3] * alpha + 255 * (1 - alpha), depth[..., None].repeat(3, 2)]
    camera = [*camera[:3], f"--size={VIEWS}x{VIEWS}"]
    tiles += [drawn(file, camera, "surface", ",".join(name for name, _ in stages())), drawn(file, camera, "surface")]
    return np.concatenate([t[:, VIEWS // 8: -VIEWS // 8] for t in tiles], axis=1)


def write(picture, file, zoom=1):
    picture = np.minimum((picture + 4) // 8 * 8, 255).repeat(zoom, 0).repeat(zoom, 1)  # small files
    with open(file + ".ppm", "wb") as out:
        out.write(b"P6 %d %d 255\n" % picture.shape[1::-1] + picture.astype(np.uint8).tobytes())
    subprocess.run(["oiiotool", file + ".ppm", "--attrib", "DateTime", "", "-d", "uint8", "--compression", "zip:9", "-o", file], check=True,
                   env=dict(os.environ, SOURCE_DATE_EPOCH="0"))
    os.remove(file + ".ppm")


def part_that_changes(change):
    """First row and column of the part with the greatest change."""
    sums = np.pad(change.sum(axis=2), ((1, 0), (1, 0))).cumsum(0).cumsum(1)
    parts = sums[PART:, PART:] - sums[:-PART, PART:] - sums[PART:, :-PART] + sums[:-PART, :-PART]
    return np.unravel_index(parts.argmax(), parts.shape), parts.max()


def main():
    os.makedirs(OUT, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="stx-stages-") as folder:
        files = {}
        for name, (bundle, camera) in captures(folder).items():
            files[name] = os.path.join(folder, name + ".exr"), camera
            bundle.save(files[name][0])
        whole = {(name, mode): drawn(*files[name], mode) for name in files for mode in ("surface", "splat")}
        for stage, mode in stages():
            mode = "splat" if mode == "splat" else "surface"
            best = (0,)
            for name in [SHOWN_OF[stage]] if stage in SHOWN_OF else files:
                if name is None:  # the same picture in less time
                    continue
                without = drawn(*files[name], mode, stage)
                (y, x), change = part_that_changes(abs(without - whole[name, mode]))
                if change > best[0]:
                    best = change, name, *(p[y:y + PART, x:x + PART] for p in (without, whole[name, mode]))
            print(stage, *best[:2])
            if len(best) == 1:
                continue
            tiles = [*best[2:], np.clip(255 - 4 * abs(best[2] - best[3]), 0, 255)]
            gap = np.full((PART, 4, 3), 255)
            strip = np.concatenate([tiles[0], gap, tiles[1], gap, tiles[2]], axis=1)
            write(strip, os.path.join(OUT, stage + ".png"), ZOOM)
        write(overview(*files["noisy"]), os.path.join(OUT, "frame.png"))


main()
