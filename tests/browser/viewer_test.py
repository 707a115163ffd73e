#!/usr/bin/env python3
"""`stx extract -o view.html` in a real Chromium: its pictures against `stx render --mode splat`, what people
touch, and what is said where WebGL 2 is missing."""
import contextlib
import http.server
import json
import math
import os
import shlex
import sys
import tempfile
import threading

import chromium
from pages import READY, drawn, must, psnr, show

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../cli"))
from harness import arguments  # noqa: E402

LEAST = 36.0  # dB against stx's own splats
SIZE = "360x300"
MODELS = {"spot": "spot_triangulated.obj", "fox": "Fox.gltf", "truck": "CesiumMilkTruck.gltf"}


# The share of the pixels that have the background's colour, pure green.
OPEN = """(() => {
    const shown = document.querySelector('canvas'), copy = document.createElement('canvas');
    [copy.width, copy.height] = [shown.width, shown.height];
    const context = copy.getContext('2d');
    context.drawImage(shown, 0, 0);
    const p = context.getImageData(0, 0, copy.width, copy.height).data;
    let open = 0;
    for (let i = 0; i < p.length; i += 4) open += p[i] === 0 && p[i + 1] === 255 && p[i + 2] === 0;
    return open / (p.length / 4);
})()"""


def find_model(shared, name):
    """A model by its file's name, wherever it lies below the shared meshes, and not packed by Draco."""
    for root, _, names in sorted(os.walk(os.path.join(shared, "data/meshes"))):
        if name in names and "raco" not in root[len(shared):].replace("draco-repo", ""):
            return os.path.join(root, name)
    return None


class Test:
    def __init__(self, args, folder):
        self.stx, self.model, self.folder, self.failed = args.stx, args.model, folder, 0

    def check(self, holds, text):
        print(("ok: " if holds else "FAILED: ") + text, flush=True)
        self.failed += not holds

    def stx_run(self, *words):
        return must([self.stx, *words], self.folder, timeout=300)

    def path(self, name):
        return os.path.join(self.folder, name)

    def compare(self, browser, name, page, source, eye, target, light=False, fov=40):
        """A picture of the page against stx's own."""
        width, height = SIZE.split("x")
        fragment = f"eye={eye}&target={target}&fov={fov}&size={SIZE}&ui=off&background=%23000000"
        words = ["--light=dir:-1,-1,-0.5", "--ambient", "0.25"] if light else []
        show(browser, self.path(page), fragment + ("&light=-1,-1,-0.5&ambient=0.25" if light else ""))
        browser.picture(self.path("shot.png"), int(width), int(height))
        self.stx_run("render", source, "-o", "wanted.png", "--mode", "splat", f"--eye={eye}", f"--target={target}", "--fov", str(fov),
                     "--size", SIZE, "--background", "black", "--backend", "cpu", *words)
        found = psnr(self.stx, "shot.png", "wanted.png", self.folder)
        self.check(found >= LEAST, f"{name}: {found:.1f} dB")


def models(test, browser, args):
    """Four kinds of content: as captured, baked and lit, pruned in an atlas, and a scene of its own."""
    sources = {"amphora": args.model}
    for name, path in MODELS.items():
        found = find_model(args.shared, path)
        if found:
            sources[name] = found
    for name, path in sources.items():
        texture = os.path.join(os.path.dirname(path), f"{name}_texture.png")
        more = ["--texture", texture] if os.path.isfile(texture) else []
        test.stx_run("convert", path, "-o", f"{name}.mp4", "--views", "sphere:16", "--size", "256x256", *more)
        test.stx_run("extract", f"{name}.mp4", "-o", f"{name}.html")
        bounds = bounds_of(test, f"{name}.mp4")
        centre = [(a + b) / 2 for a, b in zip(*bounds)]
        reach = 1.3 * sum((b - a) ** 2 for a, b in zip(*bounds)) ** 0.5
        place = lambda v: ",".join(f"{c + reach * d:.6g}" for c, d in zip(centre, v))
        test.compare(browser, name, f"{name}.html", f"{name}.mp4", place((0.45, 0.35, 0.82)), place((0, 0, 0)))
    test.stx_run("bake", "amphora.mp4", "-o", "baked.mp4")
    test.stx_run("extract", "baked.mp4", "-o", "baked.html")
    test.compare(browser, "amphora, baked, under a light", "baked.html", "baked.mp4", "1.5,1.2,2.5", "0,0.5,0", light=True)
    test.stx_run("pack", "amphora.mp4", "-o", "atlas", "--prune", "--layout", "tight")
    test.stx_run("extract", "atlas", "-o", "atlas.html")
    test.compare(browser, "amphora, pruned, as an atlas", "atlas.html", "atlas", "-1.5,1.4,2.2", "0,0.5,0")
    boxes(test, browser)
    glass(test, browser)
    coarse_views(test, browser, args.model)
    test.stx_run("extract", "amphora.mp4", "-o", "jpeg.html", "--colour", "jpeg")
    test.compare(browser, "amphora, with JPEG", "jpeg.html", "amphora.mp4", "1.5,1.2,2.5", "0,0.5,0")
    copied_pictures(test, browser)
    # 16 views of 256² take 46 MiB for a page.
    test.stx_run("extract", "amphora.mp4", "-o", "parts.html", "--max-memory", "16")
    test.compare(browser, "amphora, with memory for a third of its views", "parts.html", "amphora.mp4", "1.5,1.2,2.5", "0,0.5,0")
    test.compare(browser, "amphora, from afar", "amphora.html", "amphora.mp4", "4,3,9", "0,0.5,0")
    test.compare(browser, "amphora, from above", "amphora.html", "amphora.mp4", "0,3,0", "0,0.5,0")
    test.compare(browser, "amphora, near", "amphora.html", "amphora.mp4", "0.9,1.1,1.1", "0.1,0.7,0")
    test.compare(browser, "amphora, very near", "amphora.html", "amphora.mp4", "0.5,0.6,0.5", "-0.3,0.5,0.3", fov=80)
    test.stx_run("convert", args.model, "-o", "few.mp4", "--views", "cube", "--size", "128x128")
    test.stx_run("extract", "few.mp4", "-o", "few.html")
    test.compare(browser, "amphora, near, of few small views", "few.html", "few.mp4", "0.2,0.6,0.8", "0,0.5,0")


def coarse_views(test, browser, model):
    """Views of 16² among views of 256², whose splats are left out."""
    for name, layout, size in [("fine", "sphere:16", "256x256"), ("fine/coarse", "sphere:5", "16x16")]:
        test.stx_run("convert", model, "-o", "of_mixed.exr", "--views", layout, "--size", size)
        test.stx_run("extract", "of_mixed.exr", "-o", name)
    with open(test.path("fine/transforms.json")) as fine, open(test.path("fine/coarse/transforms.json")) as coarse:
        mixed, more = json.load(fine), json.load(coarse)["frames"]
    for frame in more:
        frame["stx:name"] = "coarse " + frame["stx:name"]
        for kind in ("file_path", "depth_file_path"):
            frame[kind] = "coarse/" + frame[kind]
    mixed["frames"] += more
    with open(test.path("fine/mixed.json"), "w") as out:
        json.dump(mixed, out)
    test.stx_run("convert", "fine/mixed.json", "-o", "mixed.mp4")
    test.stx_run("extract", "mixed.mp4", "-o", "mixed.html")
    test.compare(browser, "amphora, coarse views among fine ones", "mixed.html", "mixed.mp4", "1.5,1.2,2.5", "0,0.5,0")


def write_boxes(path, boxes, first=""):
    """An OBJ of boxes, each (least corner, size, material or none), that begins with `first`."""
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
    with open(path, "w", encoding="ascii") as file:
        file.write(first)
        for n, (at, size, material) in enumerate(boxes):
            if material:
                file.write(f"usemtl {material}\n")
            for corner in corners:
                file.write("v " + " ".join(str(a + s * c) for a, s, c in zip(at, size, corner)) + "\n")
            for face in faces:
                file.write("f " + " ".join(str(8 * n + k) for k in face) + "\n")


def glass(test, browser):
    """Glass hides what is behind it whatever its alpha is, and its outlines keep that alpha."""
    write_boxes(test.path("glass.obj"), [((-0.5, -0.5, -0.5), (1, 1, 1), "faint"), ((0.8, -0.3, -0.2), (0.4, 1.4, 0.3), "dim"),
                                         ((-1.6, -0.4, -1.2), (0.6, 0.9, 2), "full")], "mtllib glass.mtl\n")
    with open(test.path("glass.mtl"), "w", encoding="ascii") as file:
        for name, colour, alpha in (("faint", "0.9 0.3 0.2", 0.3), ("dim", "0.2 0.8 0.3", 0.75), ("full", "0.3 0.4 0.9", 1)):
            file.write(f"newmtl {name}\nKd {colour}\nd {alpha}\n")
    # Rectangles of a pruned atlas may lie on their side.
    test.stx_run("convert", "glass.obj", "-o", "glass.mp4", "--views", "sphere:12", "--size", "128x128")
    test.stx_run("pack", "glass.mp4", "-o", "glass", "--prune", "--layout", "tight")
    for name, source in (("", "glass.mp4"), (", pruned, as an atlas", "glass")):
        test.stx_run("extract", source, "-o", "glass.html")
        test.compare(browser, "glass" + name, "glass.html", source, "2,1.5,4", "0,0,0")
        test.compare(browser, f"glass{name}, under a light", "glass.html", source, "-3,1,3", "0,0,0", light=True)
    test.stx_run("extract", "glass.mp4", "-o", "glass.html", "--colour", "jpeg")
    test.compare(browser, "glass, with JPEG", "glass.html", "glass.mp4", "2,1.5,4", "0,0,0")


def boxes(test, browser):
    """Straight outlines of a pruned atlas: what its views show beside its rectangles counts. Splats that are larger than the
    picture end where stx ends them."""
    write_boxes(test.path("boxes.obj"), [((-0.5, -0.5, -0.5), (1, 1, 1), None), ((0.8, -0.3, -0.2), (0.4, 1.4, 0.3), None)])
    test.stx_run("convert", "boxes.obj", "-o", "boxes.exr", "--views", "sphere:12", "--size", "128x128")
    test.stx_run("pack", "boxes.exr", "-o", "boxes", "--prune", "--layout", "tight")
    test.stx_run("extract", "boxes", "-o", "boxes.html")
    test.compare(browser, "boxes, pruned, as an atlas", "boxes.html", "boxes", "2,1.5,4", "0.2,0.1,0")
    test.stx_run("extract", "boxes.exr", "-o", "near.html")
    test.compare(browser, "boxes, near and seen along a side", "near.html", "boxes.exr", "0.6,0.2,0.4", "0.8,0,-5", fov=100)


def copied_pictures(test, browser):
    """JPEG pictures of a bundle are in its page as they are, and browsers decode them as stx does."""
    # Cameras that look aside have padding in MPEG-4; what they see does not fit together then.
    test.stx_run("extract", "amphora.mp4", "-o", "aside")
    with open(test.path("aside/transforms.json"), encoding="utf-8") as file:
        cameras = json.load(file)
    for frame in cameras["frames"]:
        frame["cx"], frame["cy"] = frame.get("cx", cameras.get("cx")) + 9, frame.get("cy", cameras.get("cy")) - 4
    with open(test.path("aside/transforms.json"), "w", encoding="utf-8") as file:
        json.dump(cameras, file)
    test.stx_run("convert", "aside", "-o", "streams.mp4", "--colour", "jpeg")
    test.stx_run("extract", "streams.mp4", "-o", "exact.html", "--colour", "png")
    test.stx_run("extract", "streams.mp4", "-o", "streams.html")
    sizes = [os.path.getsize(test.path(f"{name}.html")) for name in ("streams", "exact")]
    test.check(sizes[0] < 0.8 * sizes[1], f"amphora of JPEG pictures: {sizes[0]} bytes, as PNG {sizes[1]}")
    for name in ("exact", "streams"):
        show(browser, test.path(f"{name}.html"), f"eye=1.5,1.2,2.5&target=0,0.5,0&fov=40&size={SIZE}&ui=off&background=%23000000")
        browser.picture(test.path(f"{name}.png"), *map(int, SIZE.split("x")))
    found = psnr(test.stx, "streams.png", "exact.png", test.folder)
    test.check(found >= 60, f"the browser's decoder against stx's: {found:.1f} dB")


def bounds_of(test, name):
    done = test.stx_run("info", name, "--format", "json", "--bounds")
    bounds = json.loads(done.out)["bounds"]
    return bounds["min"], bounds["max"]


def touched(test, browser):
    """Mouse, wheel, keys, touch, the command and the address."""
    show(browser, test.path("amphora.html"), "eye=0,3,0&target=0,0.5,0")
    browser.drag((400, 150), (400, 120))
    test.check(browser.ask("lengthOf(cross(viewer.camera.eye, [0, 1, 0]))") > 0.1, "a drag leads away from straight above")
    show(browser, test.path("amphora.html"), "eye=1.5,1.2,2.5&target=0,0.5,0&fov=40")
    camera = lambda: browser.ask("JSON.stringify(viewer.camera)")
    for name, act in [
            ("a drag", lambda: browser.drag((400, 150), (460, 170))),
            ("a drag with the right button", lambda: browser.drag((400, 150), (430, 160), "right")),
            ("the wheel", lambda: browser.wheel((400, 150), 120)),
            ("an arrow key", lambda: browser.key("ArrowLeft")),
            ("plus", lambda: browser.key("+")),
            ("Shift and an arrow", lambda: browser.key("ArrowUp", 8)),
            ("the start key", lambda: browser.key("r"))]:
        before = camera()
        act()
        test.check(camera() != before, f"{name} moves the camera")
    browser.key("l")
    test.check(browser.ask("viewer.look().light.on"), "a key switches the light on")
    drawn(browser)
    browser.until("location.hash.includes('light=')")
    kept = browser.ask("location.hash")
    test.check("eye=" in kept and "target=" in kept and "fov=" in kept, f"the address has the camera: {kept}")
    # The command draws what the page shows.
    browser.ask("document.getElementById('command').click()")
    command = browser.ask("document.getElementById('command-text').value")
    browser.ask("document.getElementById('panel').hidden = true")
    browser.ask("document.activeElement.blur()")  # or its ring would be in the picture
    browser.ask("viewer.draw()")
    browser.picture(test.path("shot.png"))
    words = shlex.split(command)
    test.check(words[:2] == ["stx", "render"], command)
    test.stx_run(*words[1:], "--backend", "cpu")
    found = psnr(test.stx, "shot.png", "view.png", test.folder)
    test.check(found >= LEAST, f"the command's picture: {found:.1f} dB")


def far_from_the_origin(test, browser):
    """Coordinates of surveyors leave the address and the command as exact as others."""
    show(browser, test.path("amphora.html"), "")
    off = browser.ask("""(() => {
        viewer.data.origin = [500000, 5300000, 300];
        Object.assign(viewer.camera, {eye: [0.0123456789, 0.0345678912, 0.3], target: [0, 0, 0]});
        return lengthOf(minus(minus(viewer.world(viewer.camera.eye).split(",").map(Number), viewer.data.origin), viewer.camera.eye));
    })()""")
    test.check(off < 1e-8, f"far from the origin the address is off by {off}")


def addresses(test, browser):
    """The address of a page and its command say all that the page shows, and a new address only what it says."""
    given = ("eye=1.5,1.2,2.5&target=0,0.5,0&fov=33.3&light=-1,-2,-3&ambient=0.33&specular=2&splat=5&background=%23102030"
             "&size=200x150&ui=off")
    state = "JSON.stringify([viewer.camera, viewer.look(), viewer.size, document.getElementById('panel').hidden])"
    show(browser, test.path("amphora.html"), given)
    before = json.loads(browser.ask(state))
    test.check(before[1]["light"]["ambient"] == 0.33 and before[1]["light"]["specular"] == 2 and before[1]["splatSize"] == 5,
               f"values between and beyond the sliders' steps: {before[1]}")
    length = math.sqrt(14)
    off = max(abs(a - b / length) for a, b in zip(before[1]["light"]["direction"], (-1, -2, -3)))
    test.check(off < 1e-6, f"the light's direction is off by {off}")
    browser.ask("viewer.writeAddress()")
    written = browser.ask("location.hash")[1:]
    browser.ask("location.hash = ''")
    browser.until("viewer.size === null && !viewer.look().light.on")
    plain = json.loads(browser.ask(state))
    test.check(plain[1]["splatSize"] == 1 and plain[1]["light"]["ambient"] == 0.2 and not plain[3],
               "what an address does not say is as at the start")
    show(browser, test.path("amphora.html"), written)
    off = max(abs(a - b) for a, b in zip(numbers_in(before), numbers_in(json.loads(browser.ask(state)))))
    test.check(off < 1e-6, f"a page is the same at its own address: {off}")
    # What is up is not Y in all sets.
    test.stx_run("convert", test.model, "-o", "z.mp4", "--views", "ring:8", "--size", "128x128", "--up", "Z")
    test.stx_run("extract", "z.mp4", "-o", "z.html", "--refine", "off")
    show(browser, test.path("z.html"), "eye=2,1,1&target=0,0,0.5&up=0,1,0")
    browser.ask("viewer.writeAddress()")
    test.check("&up=0,1,0&" in browser.ask("location.hash"), "the address says what is up where that is not the page's")
    command = browser.ask("viewer.command()")
    test.check(" --up=0,1,0 " in command and " --refine off " in command, command)
    show(browser, test.path("z.html"), "eye=2,1,1&target=0,0,0.5")
    test.check("--up" not in browser.ask("viewer.command()"), "the command leaves to stx what is its default")


def numbers_in(value):
    """All numbers of a JSON value, in order."""
    if isinstance(value, (list, dict)):
        return [n for v in (value.values() if isinstance(value, dict) else value) for n in numbers_in(v)]
    return [value] if isinstance(value, (int, float)) else []


def lost_device(test, browser):
    """A device that comes back draws again."""
    show(browser, test.path("amphora.html"), "eye=1.5,1.2,2.5&target=0,0.5,0&size=200x150&ui=off")
    browser.picture(test.path("before.png"), 200, 150)
    browser.ask("viewer.loses = viewer.painter.gl.getExtension('WEBGL_lose_context'), viewer.loses.loseContext(), 1")
    browser.until("document.getElementById('message').textContent.startsWith('The device lost')")
    browser.ask("viewer.loses.restoreContext(), 1")
    browser.until("document.getElementById('message').textContent === ''")
    drawn(browser)
    browser.picture(test.path("after.png"), 200, 150)
    found = psnr(test.stx, "before.png", "after.png", test.folder)
    test.check(found > 60, f"after the device was lost: {found:.1f} dB")


def single(test, browser):
    """The page of one view begins at its pose, and nothing takes the eye far from it or to where the view shows nothing."""
    test.stx_run("convert", test.model, "-o", "one.mp4", "--views", "ring:1", "--size", "128x128")
    test.stx_run("extract", "one.mp4", "-o", "one.html")
    show(browser, test.path("one.html"), "")
    arm = "unit(minus(viewer.camera.eye, viewer.data.start.target))"
    at_home = "lengthOf(minus(viewer.camera.eye, viewer.data.cameras[0].position))"
    test.check(browser.ask(at_home) < 1e-9, "the page of one view begins at its pose")
    angle = f"Math.acos(Math.min(1, dot({arm}, unit(minus(viewer.data.start.eye, viewer.data.start.target))))) * 180 / Math.PI"
    browser.drag((320, 200), (330, 200))
    few = browser.ask(angle)
    test.check(0.1 < few < 4, f"a small drag turns it by {few:.2f} degrees")
    browser.drag((20, 20), (620, 380))
    most = browser.ask(angle)
    test.check(few < most < 4.6, f"a drag over all of it turns it by {most:.2f} degrees")
    eye = browser.ask("JSON.stringify(viewer.camera.eye)")
    fov = browser.ask("viewer.data.start.fov")
    browser.ask("viewer.zoom(1e-3)")
    test.check(abs(browser.ask("viewer.camera.fov") - fov / 8) < 1e-9, "it is seen eight times larger at most")
    browser.ask("viewer.pan(100, 40)")
    aside = "Math.atan2(lengthOf(minus(viewer.camera.target, viewer.data.start.target)), lengthOf(minus(viewer.data.start.eye, viewer.data.start.target)))"
    test.check(0 < browser.ask(aside) * 180 / math.pi < fov / 2 + 1e-6, "and no farther aside than it shows something")
    browser.ask("viewer.zoom(1e3)")
    test.check(browser.ask("viewer.camera.fov") == fov, "nor smaller than it is")
    test.check(browser.ask("JSON.stringify(viewer.camera.eye)") == eye, "all from where the eye is")


def photo(test, browser):
    """A photograph with what is behind it: hardly anything of its frame is open when the eye goes 5 or 8 % of the distance to a
    side. (One layer is behind it: what that hides in turn, beside a cone before a box, stays open.)"""
    file = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../samples/photos/solids_gdepth.jpg")
    test.stx_run("convert", file, "-o", "photo.mp4")
    test.stx_run("extract", "photo.mp4", "-o", "photo.html")
    show(browser, test.path("photo.html"), "")
    eye, target, fov = json.loads(browser.ask("JSON.stringify([viewer.data.start.eye, viewer.data.start.target, viewer.data.start.fov])"))
    distance = math.dist(eye, target)
    for percent, most in ((5, 2e-4), (8, 6e-4)):
        share = 0
        for side, up in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            moved = (eye[0] + side * percent / 100 * distance, eye[1] + up * percent / 100 * distance, eye[2])
            show(browser, test.path("photo.html"), f"eye={','.join(map(str, moved))}&target={','.join(map(str, target))}&fov={fov}"
                                                   "&size=400x300&ui=off&background=%2300ff00")
            share += browser.ask(OPEN) / 4
        test.check(share <= most, f"from beside by {percent} %: {100 * share:.4f} % of the page is open")


def captured(test, browser, args):
    """What a depth camera has no depth of is drawn where stx draws it."""
    kitchen = os.path.join(args.shared, "data/imagesets/7scenes-kitchen")
    if not os.path.isdir(kitchen):
        return
    test.stx_run("convert", kitchen, "-o", "kitchen.exr")
    test.stx_run("extract", "kitchen.exr", "-o", "kitchen.html")
    show(browser, test.path("kitchen.html"), f"size={SIZE}&ui=off&background=%23000000")
    browser.ask("viewer.fromView('0')")
    drawn(browser)
    browser.picture(test.path("shot.png"), *map(int, SIZE.split("x")))
    test.stx_run(*shlex.split(browser.ask("viewer.command()"))[1:], "--backend", "cpu")
    found = psnr(test.stx, "shot.png", "view.png", test.folder)
    test.check(found >= LEAST, f"a kitchen of which some has no depth: {found:.1f} dB")


def odd_addresses(test, browser):
    """What means nothing is passed over and said; nothing that the page does is against its own policy."""
    said = "document.getElementById('message').textContent"
    show(browser, test.path("amphora.html"), "%")
    start = browser.ask("JSON.stringify([viewer.camera, viewer.look()])")
    number, three, any_three = "one number, 0 or more, is", "X,Y,Z is", "X,Y,Z, not all of them 0, is"
    for address, expected in (("eye=%E0%A4%A&fov=%", f"eye=%E0%A4%A ({three} expected); fov=% (one number above 0 and below 180 is expected)"),
                              ("eye=1,2&up=-Y&=&&", f"eye=1,2 ({three} expected); up=-Y ({any_three} expected)"),
                              ("ambient=0.9,0.1,0.1", f"ambient=0.9,0.1,0.1 ({number} expected)"),
                              ("light=0,0,0&splat=&time=soon", f"time=soon (one number is expected); light=0,0,0 ({any_three} expected); "
                                                               "splat= (one number above 0 is expected)"),
                              ("background=red&size=640", "size=640 (WIDTHxHEIGHT, as 640x480, is expected); "
                                                          "background=red (%23rrggbb is expected)")):
        browser.open(f"file://{test.path('amphora.html')}#{address}")
        browser.until(f"typeof viewer === 'object' && {said}.startsWith('Not taken')")
        test.check(browser.ask(said) == f"Not taken from the address: {expected}.", f"a page at #{address} says: {browser.ask(said)}")
        test.check(browser.ask("JSON.stringify([viewer.camera, viewer.look()])") == start, f"a page draws at #{address} as at the start")
    browser.ask("location.hash = 'specular=-1'")
    browser.until(f"{said} === 'Not taken from the address: specular=-1 ({number} expected).'")
    browser.ask("viewer.changed()")
    browser.until(f"{said} === ''")
    test.check("specular" not in browser.ask("location.hash"), "what is not taken is said until the page writes its address")
    for size in ("0x0", "99999x99999", "1x100000"):
        try:
            show(browser, test.path("amphora.html"), f"size={size}")
            said = "nothing"
        except RuntimeError as error:
            said = str(error)
        test.check(f"#size={size} is not possible" in said and "pixels" in said, f"size {size}: {said}")
    show(browser, test.path("amphora.html"), "size=80x60")
    browser.ask("location.hash = 'size=0x0'")
    browser.until("document.getElementById('message').className === 'failed'")
    browser.ask("location.hash = 'size=60x80'")
    browser.until("document.getElementById('message').textContent === ''")
    drawn(browser)
    test.check(browser.ask("viewer.canvas.width") == 60, "an address that is put right draws again")
    policy = browser.ask("document.querySelector('meta[http-equiv=Content-Security-Policy]').content")
    test.check("default-src 'none'" in policy, "a page asks for nothing outside of itself")
    test.check(not [f for f in browser.faults if "Content Security Policy" in str(f)], str(browser.faults))


def phone(test, browser):
    browser.size(360, 640, phone=True)
    show(browser, test.path("amphora.html"), "")
    test.check(browser.ask("document.documentElement.scrollWidth <= innerWidth"), "nothing is wider than a phone's screen")
    before = browser.ask("JSON.stringify(viewer.camera)")
    browser.touch("touchStart", (180, 200))
    browser.touch("touchMove", (220, 210))
    browser.touch("touchEnd")
    turned = browser.ask("JSON.stringify(viewer.camera)")
    test.check(turned != before, "a finger turns the object")
    browser.touch("touchStart", (150, 200), (210, 200))
    browser.touch("touchMove", (120, 200), (240, 200))
    browser.touch("touchEnd")
    nearer = "Math.hypot(...viewer.camera.eye.map((v, i) => v - viewer.camera.target[i]))"
    test.check(browser.ask("JSON.stringify(viewer.camera)") != turned, f"two fingers move it: {browser.ask(nearer):.2f}")
    unlabelled = browser.ask("[...document.querySelectorAll('input,select,textarea')].filter(e => !e.labels.length).length")
    test.check(unlabelled == 0, "every field has a label")


@contextlib.contextmanager
def served(path):
    """The address of a file on a server that says that all is UTF-8."""
    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.end_headers()
            with open(path, "rb") as file:
                self.wfile.write(file.read())

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()


def main():
    args = arguments(__doc__)
    if not chromium.find():
        print("SKIP: chromium is not installed (Debian's package chromium)")
        return 77
    with tempfile.TemporaryDirectory(prefix="stx-page-") as folder:
        test = Test(args, folder)
        with chromium.Browser() as browser:
            browser.size(640, 400)
            models(test, browser, args)
            touched(test, browser)
            far_from_the_origin(test, browser)
            addresses(test, browser)
            lost_device(test, browser)
            single(test, browser)
            photo(test, browser)
            captured(test, browser, args)
            odd_addresses(test, browser)
            phone(test, browser)
            test.check(not browser.faults, f"no fault is logged: {browser.faults[:3]}")
            outside = [r for r in browser.requests if not r.startswith(("file:", "about:", "blob:", "data:"))]
            test.check(not outside, f"nothing is asked of the network: {outside[:3]}")
        with chromium.Browser(["--disable-3d-apis"]) as browser:
            browser.open("file://" + test.path("amphora.html"))
            browser.until("document.getElementById('message').className === 'failed'")
            said = browser.ask("document.getElementById('message').textContent")
            test.check("needs WebGL 2" in said, f"without WebGL 2: {said}")
            # The mark at the page's start counts more than what a server says of it.
            with served(test.path("amphora.html")) as address:
                browser.open(address)
                browser.until("document.getElementById('message').className === 'failed'")
                kind = browser.ask("document.characterSet + ' ' + document.getElementById('message').textContent")
                test.check(kind.startswith("UTF-16LE This page needs"), f"from a server that says UTF-8: {kind[:30]}")
        return 1 if test.failed else 0


if __name__ == "__main__":
    assert READY
    sys.exit(main())
