#!/usr/bin/env python3
"""A film as a page in a real Chromium: it plays, shows the time that is asked for, and its frames are those of
`stx render --time`."""
import os
import sys
import tempfile

import chromium
from pages import drawn, psnr, show
from viewer_test import LEAST, Test

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../cli"))
from harness import arguments, film_set  # noqa: E402


def main():
    args = arguments(__doc__)
    if not chromium.find():
        print("SKIP: chromium is not installed (Debian's package chromium)")
        return 77
    with tempfile.TemporaryDirectory(prefix="stx-page-") as folder:
        test = Test(args, folder)
        test.stx_run("convert", args.model, "-o", "still.exr", "--views", "ring:4", "--size", "200x200")
        film_set(args.stx, test.path("still.exr"), test.path("film"))
        test.stx_run("convert", "film", "-o", "film.mp4")
        test.stx_run("convert", "film", "-o", "jpeg.mp4", "--colour", "jpeg")
        for name in ("film", "jpeg"):
            test.stx_run("extract", f"{name}.mp4", "-o", f"{name}.html")
        with chromium.Browser() as browser:
            browser.size(320, 240)
            eye = "--eye=0.8,1.2,3"
            for name, time in (("film", 0), ("film", 0.2), ("jpeg", 0.2)):
                show(browser, test.path(f"{name}.html"),
                     f"eye=0.8,1.2,3&target=0,0.5,0&fov=40&size=320x240&ui=off&background=%23000000&time={time}")
                browser.picture(test.path("shot.png"), 320, 240)
                test.stx_run("render", f"{name}.mp4", "-o", "wanted.png", "--mode", "splat", eye, "--target=0,0.5,0", "--fov", "40",
                             "--size", "320x240", "--background", "black", "--time", str(time), "--backend", "cpu")
                found = psnr(args.stx, "shot.png", "wanted.png", folder)
                test.check(found >= LEAST, f"{name} at {time} s: {found:.1f} dB")
            show(browser, test.path("film.html"), "")
            test.check(browser.ask("!document.getElementById('time-row').hidden"), "a film has a slider of time")
            browser.ask("viewer.seen = new Set(), viewer.show0 = viewer.showFrame.bind(viewer),"
                        "viewer.showFrame = (f) => (viewer.seen.add(f), viewer.show0(f)), 1")
            browser.key(" ")
            browser.until("viewer.seen.size >= 2")
            test.check(browser.ask("document.getElementById('play').getAttribute('aria-pressed')") == "true", "Space plays")
            browser.key(" ")
            browser.ask("(() => { const t = document.getElementById('time'); t.value = 1; t.dispatchEvent(new Event('input')); })()")
            browser.until("viewer.shownNumbers[0] === viewer.data.frames[1][0]")
            drawn(browser)
            test.check(browser.ask("document.getElementById('time-text').textContent") == "0.1 s", "the slider shows a moment")
            test.check(" --time 0.1" in browser.ask("viewer.command()"), "the command names the time")
            browser.until("location.hash.includes('time=0.1')")
            # Where there is memory for the scenes of one moment only, those of the last that was asked for stay.
            show(browser, test.path("film.html"), "time=0")
            browser.ask("viewer.leastKept = 1, viewer.load0 = Scene.load.bind(Scene),"
                        "Scene.load = async (...all) => Object.assign(await viewer.load0(...all), {texels: 1e9}), 1")
            browser.ask("(async () => { viewer.showFrame(1), await viewer.showFrame(2); viewer.asked = true; })(), 1")
            browser.until("viewer.asked")
            drawn(browser)
            test.check(browser.ask("viewer.shown.every((s) => viewer.painter.gl.isTexture(s.colour))"), "what is shown is kept")
            test.check(not browser.faults, f"no fault is logged: {browser.faults[:3]}")
        return 1 if test.failed else 0


if __name__ == "__main__":
    sys.exit(main())
