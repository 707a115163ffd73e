#!/usr/bin/env python3
"""The impostors of samples/engines: three.js in a real Chromium, and Godot 3, against `stx render` of the same atlas."""
import functools
import http.server
import os
import shutil
import subprocess
import sys
import tempfile
import threading

import chromium
from pages import NODE_MODULES, psnr
from viewer_test import Test

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../cli"))
import material_model  # noqa: E402
from harness import arguments  # noqa: E402

ENGINES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../samples/engines")
SIZE = "360x360"
LONGEST = 150  # lines of a shader
# dB against surface mode, which fuses all views instead of blending three.
# spot: 29.1; 26.4 with holes where the head hides the neck from two of the three views.
LEAST = {"octahedral": 26.0, "hemi-octahedral": 26.0, "up": 26.0, "glowing": 26.0, "spot": 28.0}


class Files(http.server.SimpleHTTPRequestHandler):
    """What index.html asks for; scripts in modules are not read from files."""

    def __init__(self, *args, folder, **options):
        self.roots = {"/node_modules/": NODE_MODULES, "/three/": os.path.join(ENGINES, "three"),
                      "/babylon/": os.path.join(ENGINES, "babylon"), "/": folder}
        super().__init__(*args, **options)

    def translate_path(self, path):
        path = path.split("?")[0]
        root = next(r for r in self.roots if path.startswith(r))
        return os.path.join(self.roots[root], path[len(root):])

    def log_message(self, *_):
        pass


def three(test, browser, port, grid, eye, target, name=""):
    browser.open(f"http://127.0.0.1:{port}/three/index.html?atlas=/{grid}&object={name}&eye={eye}&target={target}&fov=40"
                 f"&size={SIZE}")
    browser.until("document.title === 'ready' || document.title.startsWith('failed')")
    title = browser.ask("document.title")
    if title != "ready":
        test.check(False, f"three.js, {grid}: {title}")
    browser.picture(test.path("shot.png"), *map(int, SIZE.split("x")))


def godot(test, grid, eye, target, name=""):
    project = test.path("project")
    shutil.rmtree(project, ignore_errors=True)
    shutil.copytree(os.path.join(ENGINES, "godot3"), project)
    shutil.copytree(test.path(grid), os.path.join(project, "atlas"))
    open(os.path.join(project, "atlas", ".gdignore"), "w").close()
    done = subprocess.run(["xvfb-run", "-a", "-s", f"-screen 0 {SIZE}x24", "godot3", "--path", project, "--resolution", SIZE,
                           "--audio-driver", "Dummy", "--picture", test.path("shot.png"), eye, target, name],
                          capture_output=True, text=True, timeout=300, env=dict(os.environ, HOME=test.folder))
    if "SHADER ERROR" in done.stdout + done.stderr or done.returncode:
        test.check(False, f"Godot, {grid}: {(done.stdout + done.stderr)[-2000:]}")


def upright_on_z(model, path):
    """The same model with its up along +Z."""
    with open(model, encoding="utf-8") as lines, open(path, "w", encoding="utf-8") as out:
        for line in lines:
            words = line.split()
            if words and words[0] in ("v", "vn"):
                x, y, z = words[1:4]
                line = f"{words[0]} {x} {-float(z):.9g} {y}\n"
            out.write(line)
    shutil.copy(model.replace(".obj", ".mtl"), os.path.dirname(path))
    shutil.copy(model.replace(".obj", ".png"), os.path.dirname(path))


def compare(test, name, grid):
    found = psnr(test.stx, "shot.png", f"{grid}.png", test.folder)
    test.check(found >= LEAST[grid], f"{name}, {grid}: {found:.1f} dB")


def main():
    args = arguments(__doc__)
    has_three = chromium.find() and os.path.isdir(os.path.join(NODE_MODULES, "three"))
    has_godot = shutil.which("godot3") and shutil.which("xvfb-run")
    if not has_three and not has_godot:
        print("SKIP: needs chromium and `npm ci` in tests/browser, or godot3 and xvfb")
        return 77
    with tempfile.TemporaryDirectory(prefix="stx-engines-") as folder:
        test = Test(args, folder)
        for shader in ("three/impostor_shader.js", "godot3/impostor.shader"):
            with open(os.path.join(ENGINES, shader), encoding="utf-8") as file:
                lines = len(file.readlines())
            test.check(lines < LONGEST, f"{shader} has {lines} lines")
        cameras = {"octahedral": ("1.5,1.2,2.5", "0,0.43,0"), "hemi-octahedral": ("-1.3,1.9,2.3", "0,0.43,0")}
        # What is in front hides from single views what others show: the head of a cow, its neck.
        spot = os.path.join(args.shared, "data/meshes/obj/spot/spot_triangulated.obj")
        others = {"spot": ("1.5,1,2.5", "0,0,0")} if os.path.exists(spot) else {}
        others["up"] = ("-1.3,-2.3,1.9", "0,0,0.43")
        upright_on_z(args.model, test.path("up.obj"))
        models = {"spot": spot, "up": test.path("up.obj")}
        for grid, (eye, target) in {**cameras, **others}.items():
            views = grid if grid in cameras else "hemi-octahedral"
            test.stx_run("convert", models.get(grid, args.model), "-o", f"{grid}.mp4", "--views", f"{views}:8", "--size", "256x256",
                         "--projection", "orthographic", "--depth-bits", "8", "--up", "Z" if grid == "up" else "Y")
            test.stx_run("pack", f"{grid}.mp4", "-o", grid)
            test.stx_run("render", grid, "-o", f"{grid}.png", f"--eye={eye}", f"--target={target}", "--up=0,1,0", "--fov", "40",
                         "--size", SIZE, "--background", "black", "--backend", "cpu")
        # Both share one sheet; each is drawn as from an atlas of its own.
        test.stx_run("pack", "octahedral.mp4", "hemi-octahedral.mp4", "-o", "sheet", "--size", "power-of-two")
        if has_three:
            server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Files, folder=folder))
            threading.Thread(target=server.serve_forever, daemon=True).start()
            with chromium.Browser() as browser:
                browser.size(*map(int, SIZE.split("x")))
                for grid, (eye, target) in cameras.items():
                    three(test, browser, server.server_port, grid, eye, target)
                    compare(test, "three.js", grid)
                    three(test, browser, server.server_port, "sheet", eye, target, grid)
                    compare(test, "three.js, from a sheet", grid)
                for grid, (eye, target) in others.items():
                    three(test, browser, server.server_port, grid, eye, target)
                    compare(test, "three.js", grid)
                # Light in a texture of its own; in the truth it is in the colour.
                eye, target = "3.9,3.1,6.5", "0,0,0"
                material_model.make(test.path("glowing.gltf"))
                for name, options in (("glowing", ["--materials"]), ("whole", [])):
                    test.stx_run("convert", "glowing.gltf", "-o", f"{name}.exr", "--views", "octahedral:8", "--size", "256x256",
                                 "--projection", "orthographic", "--depth-bits", "8", *options)
                    test.stx_run("pack", f"{name}.exr", "-o", name)
                test.stx_run("render", "whole", "-o", "glowing.png", f"--eye={eye}", f"--target={target}", "--fov", "40", "--size",
                             SIZE, "--background", "black", "--backend", "cpu")
                three(test, browser, server.server_port, "glowing", eye, target)
                compare(test, "three.js", "glowing")
                faults = [f for f in browser.faults if "404" not in f]  # a browser asks for favicon.ico
                test.check(not faults, f"no fault is logged: {faults[:3]}")
            server.shutdown()
        if has_godot:
            for grid, (eye, target) in cameras.items():
                godot(test, grid, eye, target)
                compare(test, "Godot 3", grid)
                godot(test, "sheet", eye, target, grid)
                compare(test, "Godot 3, from a sheet", grid)
            for grid, (eye, target) in others.items():
                godot(test, grid, eye, target)
                compare(test, "Godot 3", grid)
        return 1 if test.failed else 0


if __name__ == "__main__":
    sys.exit(main())
