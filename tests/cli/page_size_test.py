#!/usr/bin/env python3
"""A page (`stx extract -o view.html`) takes at most 1.15 times the bytes of the bundle that it is of, of every kind. All
bundles are larger than LEAST: the page's program, which does not grow, takes 27 kB."""
import json
import os
import sys
import tempfile

from harness import arguments, must

MOST = 1.15
LEAST = 250_000


def three_rates(path):
    """The views of a set become pictures of three cameras, each of which has another rate."""
    with open(path, encoding="utf-8") as file:
        data = json.load(file)
    shown = [("a", 0.1 * i) for i in range(6)] + [("b", 0.15 * i) for i in range(4)] + [("c", 0.3 * i) for i in range(2)]
    for frame, (camera, time) in zip(data["frames"], shown, strict=True):
        frame.update(time=time, camera=camera)
    with open(path, "w", encoding="utf-8") as file:
        json.dump(data, file)


def bytes_of(path):
    if not os.path.isdir(path):
        return os.path.getsize(path)
    return sum(os.path.getsize(os.path.join(path, name)) for name in os.listdir(path))


def main():
    args = arguments(__doc__)
    failed = 0
    with tempfile.TemporaryDirectory(prefix="stx-page-size-") as folder:

        def stx(*words):
            must([args.stx, *words, "--quiet"], folder, timeout=300)

        views = ("--views", "sphere:16", "--size", "160x160")
        stx("convert", args.model, "-o", "png.mp4", *views)
        stx("convert", args.model, "-o", "depth8.mp4", "--depth-bits", "8", *views)
        stx("convert", args.model, "-o", "jpeg.mp4", "--colour", "jpeg", *views)
        stx("bake", "png.mp4", "-o", "vectors.mp4")
        stx("convert", "png.mp4", "-o", "floats.exr", "--depth-bits", "32")
        stx("pack", "png.mp4", "-o", "grid")
        stx("pack", "png.mp4", "-o", "jpeg_grid", "--colour", "jpeg")
        stx("pack", "png.mp4", "-o", "pruned", "--layout", "tight", "--prune")
        stx("convert", args.model, "-o", "twelve.exr", "--views", "ring:12", "--size", "200x200")
        stx("extract", "twelve.exr", "-o", "set")
        three_rates(os.path.join(folder, "set/transforms.json"))
        stx("convert", "set", "-o", "film.mp4")
        stx("convert", "set", "-o", "jpeg_film.mp4", "--colour", "jpeg")
        bundles = ["png.mp4", "depth8.mp4", "jpeg.mp4", "vectors.mp4", "floats.exr", "grid", "jpeg_grid", "pruned", "film.mp4",
                   "jpeg_film.mp4"]
        room = os.path.join(args.shared, "data/imagesets/spheres-miv")
        if os.path.isdir(room):
            stx("convert", room, "-o", "room.mp4")
            bundles.append("room.mp4")
            stx("convert", room, "-o", "jpeg_room.mp4", "--colour", "jpeg")
            bundles.append("jpeg_room.mp4")
        for name in bundles:
            stx("extract", name, "-o", "page.html")
            bundle, page = bytes_of(os.path.join(folder, name)), bytes_of(os.path.join(folder, "page.html"))
            holds = bundle >= LEAST and page <= MOST * bundle
            print(f"{'ok' if holds else 'FAILED'}: {name}: {bundle} bytes, as a page {page}, {page / bundle:.3f} times")
            failed += not holds
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
