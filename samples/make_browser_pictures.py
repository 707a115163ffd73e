#!/usr/bin/env python3
"""The pictures of samples/README.md: the page of `stx extract -o view.html`, the impostor of engines/three and the splats
of engines/babylon, in Chromium. Usage: samples/make_browser_pictures.py MODEL [FOLDER]   (stx and oiiotool must be on the PATH; wants chromium
and `npm ci && npm install --no-save babylonjs@9.28.0 babylonjs-loaders@9.28.0` in tests/browser)"""
import functools
import http.server
import os
import subprocess
import sys
import tempfile
import threading

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "../tests/browser"))
import chromium  # noqa: E402
from engines_test import Files  # noqa: E402
from pages import show  # noqa: E402


def main():
    model, out = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2] if len(sys.argv) > 2 else os.path.join(HERE, "pictures"))
    stx = functools.partial(subprocess.run, check=True)
    with tempfile.TemporaryDirectory(prefix="stx-pictures-") as folder:
        path = functools.partial(os.path.join, folder)
        stx(["stx", "convert", model, "-o", path("amphora.mp4"), "--views", "sphere:16", "--size", "384x384", "--quiet"])
        stx(["stx", "extract", path("amphora.mp4"), "-o", path("view.html"), "--quiet"])
        stx(["stx", "convert", model, "-o", path("grid.mp4"), "--views", "octahedral:8", "--size", "256x256", "--projection",
             "orthographic", "--depth-bits", "8", "--quiet"])
        stx(["stx", "pack", path("grid.mp4"), "-o", path("atlas"), "--quiet"])
        stx(["stx", "extract", path("amphora.mp4"), "-o", path("cloud.glb"), "--as", "splats", "--quiet"])
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Files, folder=folder))
        threading.Thread(target=server.serve_forever, daemon=True).start()
        with chromium.Browser() as browser:
            browser.size(480, 420)
            show(browser, path("view.html"), "eye=1.6,1.3,2.8&target=-0.05,0.3,0&fov=40&light=-1,-0.8,-0.7&ambient=0.3&specular=0.3")
            browser.picture(path("page.png"))
            browser.size(480, 420)
            browser.open(f"http://127.0.0.1:{server.server_port}/three/index.html?atlas=/atlas&eye=1.5,1.2,2.5&target=0,0.4,0"
                         "&fov=40&size=480x420")
            browser.until("document.title === 'ready'")
            browser.picture(path("three.png"))
            browser.open(f"http://127.0.0.1:{server.server_port}/babylon/index.html?cloud=/cloud.glb&eye=1.5,1.2,2.5"
                         "&target=0,0.4,0&fov=40&size=480x420")
            browser.until("document.title === 'ready'", 300)
            browser.picture(path("babylon.png"))
        server.shutdown()
        stx(["oiiotool", path("page.png"), path("three.png"), path("babylon.png"), "--mosaic:pad=8", "3x1", "-d", "uint8", "-o",
             os.path.join(out, "browser.png")], env=dict(os.environ, SOURCE_DATE_EPOCH="0"))


if __name__ == "__main__":
    main()
