#!/usr/bin/env python3
"""The same input and options give the same bytes.

Every command that writes runs with 1, 2 and 7 threads, a second time, from another folder, under a
locale with a decimal comma, another time zone and another umask. All its outputs must be the same.
"""
import os
import shutil
import subprocess
import sys
import tempfile

import material_model
from harness import arguments, commands_of, film_set, must, quad, run, tree, turn_set


def german(folder):
    """An environment with a decimal comma; None where the locale can neither be found nor made."""
    known = subprocess.run(["locale", "-a"], capture_output=True, text=True).stdout.split()
    for name in known:
        if name.lower().replace("-", "") in ("de_de.utf8", "fr_fr.utf8", "de_at.utf8"):
            return {"LC_ALL": name, "LANG": name}
    if shutil.which("localedef"):
        subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", os.path.join(folder, "de_DE.UTF-8")],
                       capture_output=True)
        if os.path.isdir(os.path.join(folder, "de_DE.UTF-8")):
            return {"LOCPATH": folder, "LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"}
    return None


def main():
    args = arguments(__doc__)
    have = commands_of(args.stx)
    failed = 0
    with tempfile.TemporaryDirectory(prefix="stx-same-") as top:
        quad(top)
        # Without the sample model: slower programs (with sanitizers) take the quad.
        if not os.path.isfile(args.model):
            args.model = os.path.join(top, "quad.obj")
        must([args.stx, "convert", args.model, "-o", "in.exr", "--views", "sphere:5", "--size", "96x80"], top)
        must([args.stx, "bake", "in.exr", "-o", "baked.mp4"], top)
        must([args.stx, "select", "in.exr", "-o", "one.exr", "--count", "1"], top)
        must([args.stx, "convert", "quad.obj", "-o", "quad.mp4", "--views", "cube", "--size", "40x40"], top)
        film_set(args.stx, os.path.join(top, "in.exr"), os.path.join(top, "film"))
        must([args.stx, "convert", "film", "-o", "film.mp4"], top)
        material_model.make(os.path.join(top, "metal.gltf"))
        must([args.stx, "convert", "metal.gltf", "-o", "metal.exr", "--materials", "--views", "sphere:5", "--size", "96x80"], top)
        os.mkdir(os.path.join(top, "frames"))
        must([args.stx, "render", "in.exr", "-o", "frames/f_%04d.png", "--orbit", "24", "--size", "90x70", "--backend", "cpu",
              "--background", "white"], top)
        turn_set(os.path.join(top, "turn"))
        must([args.stx, "render", "in.exr", "-o", "around.png", "--eye", "0.1,0.2,1.5", "--target", "0,0,0", "--size", "160x80",
              "--projection", "equirectangular", "--background", "grey"], top)
        views = ["--views", "sphere:5", "--size", "96x80"]
        jobs = {
            "convert mp4": ["convert", args.model, "-o", "OUT/a.mp4"] + views,
            "convert jpeg": ["convert", args.model, "-o", "OUT/a.mp4", "--colour", "jpeg"] + views,
            "convert exr": ["convert", args.model, "-o", "OUT/a.exr", "--depth-bits", "32"] + views,
            "convert materials": ["convert", "IN/metal.gltf", "-o", "OUT/a.exr", "--materials"] + views,
            "pack materials": ["pack", "IN/metal.exr", "-o", "OUT/a", "--layout", "tight"],
            "convert xmt": ["convert", "IN/in.exr", "-o", "OUT/a.xmt"],
            "convert bt": ["convert", "IN/in.exr", "-o", "OUT/a.bt", "--point-texture"],
            "convert octree": ["convert", "IN/in.exr", "-o", "OUT/o.mp4", "--octree-image", "6"],
            "convert environment": ["convert", "IN/in.exr", "-o", "OUT/a.mp4", "--environment", "IN/around.png"],
            "bake": ["bake", "IN/in.exr", "-o", "OUT/a.mp4"],
            "bake exr": ["bake", "IN/in.exr", "-o", "OUT/a.exr"],
            "pack": ["pack", "IN/baked.mp4", "-o", "OUT/a"],
            "pack tight": ["pack", "IN/baked.mp4", "-o", "OUT/a", "--layout", "tight"],
            "pack exr": ["pack", "IN/baked.mp4", "-o", "OUT/a.exr"],
            "select": ["select", "IN/in.exr", "-o", "OUT/a.mp4"],
            "render surface": ["render", "IN/in.exr", "-o", "OUT/a.png", "--size", "120x90", "--backend", "cpu"],
            "render best": ["render", "IN/baked.mp4", "-o", "OUT/a_%02d.exr", "--size", "80x60", "--orbit", "2",
                            "--quality", "best", "--backend", "cpu", "--light", "dir:0.5,-1.5,-1"],
            "render splat": ["render", "IN/baked.mp4", "-o", "OUT/a.png", "--mode", "splat", "--size", "120x90",
                             "--backend", "cpu", "--eye=0.25,0.5,3.5"],
            "render environment": ["render", "IN/baked.mp4", "-o", "OUT/a.png", "--size", "80x60", "--backend", "cpu",
                                   "--environment", "IN/around.png", "--light", "environment", "--specular", "0.3"],
            "render around": ["render", "IN/in.exr", "-o", "OUT/a.exr", "--eye", "0.1,0.2,1.5", "--target", "0,0,0", "--size",
                              "96x48", "--projection", "equirectangular", "--backend", "cpu"],
            "render mesh": ["render", args.model, "-o", "OUT/a.exr", "--size", "120x90"],
            "extract": ["extract", "IN/in.exr", "-o", "OUT/images"],
            "extract glb": ["extract", "IN/in.exr", "-o", "OUT/model.glb"],
            "extract fewer triangles": ["extract", "IN/in.exr", "-o", "OUT/few.glb", "--triangles", "500"],
            "extract pair": ["extract", "IN/in.exr", "-o", "OUT/pair.jpg"],
            "sway": ["render", "IN/in.exr", "-o", "OUT/sway_%02d.png", "--sway", "5", "--frames", "3"],
            "extract spz": ["extract", "IN/in.exr", "-o", "OUT/cloud.spz"],
            "extract splats": ["extract", "IN/in.exr", "-o", "OUT/cloud.ply", "--as", "splats", "--max-splats", "20000"],
            "extract html": ["extract", "IN/baked.mp4", "-o", "OUT/view.html"],
            "sheet": ["sheet", "IN/baked.mp4", "-o", "OUT/a.png"],
            "sheet of two": ["sheet", "IN/in.exr", "IN/baked.mp4", "-o", "OUT/a.png"],
            "sheet of a film": ["sheet", "IN/film.mp4", "-o", "OUT/a.png"],
            "background of a photograph": ["background", "IN/one.exr", "-o", "OUT/a.exr"],
            "background": ["background", "IN/frames", "-o", "OUT/a.png", "--confidence", "OUT/c.png", "--mask-of", "all",
                           "--mask-output", "OUT/m_%04d.png"],
            "background in bands": ["background", "IN/frames/f_%04d.png", "-o", "OUT/a.png", "--drift", "--max-memory", "1"],
            "panorama": ["panorama", "IN/turn", "-o", "OUT/a.png", "--size", "600x300"],
            "panorama envmap": ["panorama", "IN/turn", "-o", "OUT/a.exr", "--faces", "40"],
            "panorama faces": ["panorama", "IN/turn", "-o", "OUT/faces", "--faces", "40"],
            "convert film": ["convert", "IN/film", "-o", "OUT/a.mp4"],
            "render film": ["render", "IN/film.mp4", "-o", "OUT/a_%02d.png", "--orbit", "1", "--times", "all", "--size", "90x70",
                            "--backend", "cpu"],
            "extract film": ["extract", "IN/film.mp4", "-o", "OUT/images"],
            "select film": ["select", "IN/film.mp4", "-o", "OUT/a.mp4", "--count", "2"],
            "pack film": ["pack", "IN/film.mp4", "-o", "OUT/a_%02d", "--layout", "tight", "--prune"],
            "background n2pg": ["background", "IN/frames", "-o", "OUT/a.exr", "--method", "n2pg"],
            "batch": ["convert", "IN/quad.obj", "IN/in.exr", "-o", "OUT/{stem}.mp4", "--jobs", "2", "--views", "ring:2",
                      "--size", "40x40"],
        }
        video = run([args.stx, "convert", "film.mp4", "-o", "video.mp4", "--video", "h264"], top)
        if video.code == 5:
            print("the module of video is not here; that part is not run")
        else:
            jobs["convert film as video"] = ["convert", "IN/film.mp4", "-o", "OUT/a.mp4", "--video", "h264"]
            jobs["render video"] = ["render", "IN/video.mp4", "-o", "OUT/a_%02d.png", "--view", "0", "--times", "all",
                                    "--backend", "cpu"]
        elsewhere = os.path.join(top, "elsewhere")
        os.mkdir(elsewhere)
        locale = german(elsewhere)
        if locale is None:
            print("no locale with a decimal comma is here; that part is not run")
        ways = [("1 thread", ["--threads", "1"], {}, -1, top), ("2 threads", ["--threads", "2"], {}, -1, top),
                ("7 threads", ["--threads", "7"], {}, -1, top), ("again", ["--threads", "7"], {}, -1, top),
                ("elsewhere", ["--threads", "2"], dict(locale or {}, TZ="Pacific/Chatham"), 0o077, elsewhere)]
        for name, words in jobs.items():
            if words[0] not in have:
                continue
            first = None
            for way, more, env, umask, folder in ways:
                out = tempfile.mkdtemp(dir=top)
                inside = "../" if folder == elsewhere else "./"
                command = [w.replace("OUT/", out + "/").replace("IN/", inside) for w in words]
                done = run([args.stx] + command + more, folder, env=dict(os.environ, **env), umask=umask)
                if done.code != 0:
                    failed += 1
                    print(f"FAILED: {name}, {way}: {done}", flush=True)
                    continue
                now = tree(out)
                shutil.rmtree(out)
                if first is None:
                    first = now
                elif now != first:
                    failed += 1
                    print(f"FAILED: {name}: {way} differs from 1 thread in "
                          f"{sorted(k for k in set(now) | set(first) if now.get(k) != first.get(k))}", flush=True)
        # Text for others to read: no comma in a number.
        for words in (["info", "in.exr", "--format", "json", "--bounds"], ["info", "baked.mp4"]):
            plain = must([args.stx] + words, top)
            if locale and must([args.stx] + words, top, env=dict(os.environ, **locale)).out != plain.out:
                failed += 1
                print(f"FAILED: {words} depends on the locale")
    print(f"{len(jobs)} jobs, {len(ways)} ways each; {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
