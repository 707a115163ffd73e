#!/usr/bin/env python3
"""Gaussian splats that stx writes (.glb) as Babylon.js draws them in a real Chromium, through samples/engines/babylon,
against `stx render --mode splat` of the bundle that they are of. By hand:
`npm install --no-save babylonjs@9.28.0 babylonjs-loaders@9.28.0` in tests/browser (130 MB)."""
import functools
import http.server
import os
import sys
import tempfile
import threading

import chromium
from engines_test import Files
from pages import NODE_MODULES, psnr
from viewer_test import Test, bounds_of, find_model

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../cli"))
from harness import arguments  # noqa: E402

SIZE = "512x512"
# The file of a model, and dB of each picture. Babylon.js widens splats by 0.075 square pixels, half as far as the rules that
# --pixels-per-texel goes by: pictures of one pixel a texel want 2.
MODELS = {"amphora": (None, 30.5), "spot": ("spot_triangulated.obj", 34.5), "fox": ("Fox.gltf", 34.0)}


def drawn(test, browser, port, cloud, eye, target):
    browser.open(f"http://127.0.0.1:{port}/babylon/index.html?cloud=/{cloud}&eye={eye}&target={target}&fov=40&size={SIZE}")
    browser.until("document.title === 'ready' || document.title.startsWith('failed')", 300)
    title = browser.ask("document.title")
    test.check(title == "ready", f"{cloud}: {title}")
    browser.picture(test.path("shot.png"), *map(int, SIZE.split("x")))


def model_test(test, browser, port, name, model, least):
    texture = os.path.join(os.path.dirname(model), f"{name}_texture.png")
    more = ["--texture", texture] if os.path.isfile(texture) else []
    test.stx_run("convert", model, "-o", f"{name}.exr", "--views", "sphere:16", "--size", SIZE, *more)
    test.stx_run("extract", f"{name}.exr", "-o", f"{name}.glb", "--as", "splats", "--pixels-per-texel", "2")
    low, high = bounds_of(test, f"{name}.exr")
    centre = [(a + b) / 2 for a, b in zip(low, high)]
    reach = 1.3 * sum((b - a) ** 2 for a, b in zip(low, high)) ** 0.5
    for direction in ((0.45, 0.35, 0.82), (-0.7, 0.2, -0.6)):
        place = [",".join(f"{c + reach * d:.6g}" for c, d in zip(centre, way)) for way in (direction, (0, 0, 0))]
        drawn(test, browser, port, f"{name}.glb", *place)
        test.stx_run("render", f"{name}.exr", "-o", "wanted.png", "--mode", "splat", f"--eye={place[0]}", f"--target={place[1]}",
                     "--fov", "40", "--size", SIZE, "--background", "black", "--backend", "cpu")
        found = psnr(test.stx, "shot.png", "wanted.png", test.folder)
        test.check(found >= least, f"{name}: {found:.1f} dB")


def main():
    args = arguments(__doc__)
    if not chromium.find() or not os.path.isdir(os.path.join(NODE_MODULES, "babylonjs-loaders")):
        print("SKIP: needs chromium and `npm install --no-save babylonjs@9.28.0 babylonjs-loaders@9.28.0` in tests/browser")
        return 77
    with tempfile.TemporaryDirectory(prefix="stx-babylon-") as folder:
        test = Test(args, folder)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Files, folder=folder))
        threading.Thread(target=server.serve_forever, daemon=True).start()
        with chromium.Browser() as browser:
            browser.size(*map(int, SIZE.split("x")))
            for name, (file, least) in MODELS.items():
                model = find_model(args.shared, file) if file else args.model
                if model:
                    model_test(test, browser, server.server_port, name, model, least)
            test.check(not browser.faults, f"no fault is logged: {browser.faults[:3]}")
        server.shutdown()
        return 1 if test.failed else 0


if __name__ == "__main__":
    sys.exit(main())
