#!/usr/bin/env python3
"""The memory of many views: commands that look at one at a time take no more for 36 of them than for 12, also of noisy views that
are refined and of films, and what is made of views that do not fit memory is the same. `--measure` prints what each takes:

    tests/cli/peak_of_many_test.py build/release/bin/stx MODEL.obj SHARED_DIR --only many --measure 1
"""
import json
import os
import shutil
import tempfile

import harness
from harness import must
from peaks import COMPARED, IN_MEMORY, MOST, PROGRAM, TRIES, end, files_of, film_set, noisy_set


# Of a model and of a film: how many views are few, and how many are many. Of a set of 24 all would be held in memory (heldWhole()).
MODEL, FILM = (12, 36), (12, 36)
# The same of noisy views, which take longer.
NOISY = (8, 24)
# What selecting keeps beside that of each view, MiB: how it sees the samples of the surface.
SEEN = 0.25


def of_many():
    """Commands that hold one view for each thread. {} is a bundle, VIEWS the words for views of a model, SET an image set."""
    yield "model to exr", "convert MODEL -o OUT.exr VIEWS"
    yield "model to mp4", "convert MODEL -o OUT.mp4 VIEWS"
    yield "exr to exr", "convert {}.exr -o OUT.exr"
    yield "exr to mp4", "convert {}.exr -o OUT.mp4"
    yield "exr to bt", "convert {}.exr -o OUT.bt"
    yield "exr to 8 bits", "convert {}.exr -o OUT.mp4 --depth-bits 8"
    yield "mp4 to exr", "convert {}.mp4 -o OUT.exr"
    for kind in ("exr", "mp4"):
        yield f"bake {kind}", f"bake {{}}.{kind} -o OUT.{kind}"
        yield f"extract {kind}", f"extract {{}}.{kind} -o OUT"
        yield f"sheet {kind}", f"sheet {{}}.{kind} -o OUT.png"
        yield f"points {kind}", f"extract {{}}.{kind} -o OUT.ply"
        yield f"validate {kind}", f"validate {{}}.{kind}"
        yield f"agreement {kind}", f"info {{}}.{kind} --agreement"
        yield f"select {kind}", f"select {{}}.{kind} -o OUT.exr --count 6"
    yield "set to exr", "convert SET -o OUT.exr"
    yield "set to mp4", "convert SET -o OUT.mp4"
    yield "bake set", "bake SET -o OUT.exr"
    yield "extract set", "extract SET -o OUT"
    yield "sheet set", "sheet SET -o OUT.png"
    yield "validate set", "validate SET"
    yield "select set", "select SET -o OUT.mp4 --count 6"
    yield "extract png", "extract {}.exr -o OUT --depth png"
    yield "extract miv", "extract {}.exr -o OUT --cameras miv"
    yield "extract colmap", "extract {}.exr -o OUT --cameras colmap"


def many_views(args, folder):
    """What takes more for many views than for few; the model fills much of each."""
    if not os.path.exists(args.model):
        return []
    model, wrong, counts = os.path.abspath(args.model), [], MODEL

    def views(count):
        return ["--views", f"sphere:{count}", "--size", "512x512"]

    for count in counts:
        must([args.stx, "convert", model, "-o", f"many{count}.exr"] + views(count), folder)
        must([args.stx, "convert", f"many{count}.exr", "-o", f"many{count}.mp4"], folder)
        # What a set takes in memory where it is small (heldWhole()) is more than what all take one by one.
        must([args.stx, "extract", f"many{count}.exr", "-o", f"many{count}set"], folder)
    for number, (name, line) in enumerate(of_many()):
        if args.only not in "many " + name:
            continue
        def peak(count):
            words = [part for word in line.split() for part in (views(count) if word == "VIEWS" else [word])]
            words = [word.replace("OUT", f"many{count}_{number}").replace("{}", f"many{count}").replace("SET", f"many{count}set")
                     .replace("MODEL", model) for word in words]
            # Threads of more processors would hold more of both.
            return must([args.stx] + words + ["--threads", "2"], folder).usage.ru_maxrss / 1024

        few, many = (peak(count) for count in counts)
        kept = {"select": SEEN, "agreement": COMPARED}.get(name.split()[0], 0)
        more = kept * (counts[1] - counts[0])
        # Whether two threads hold the most at one moment is chance, and likelier of many views.
        for _ in range(0 if args.measure else TRIES):
            if many > MOST * few + more:
                few, many = max(few, peak(counts[0])), min(many, peak(counts[1]))
        if args.measure:
            print(f"many {name:22} {few:6.1f} MiB of {counts[0]} views, {many:6.1f} of {counts[1]}: {many / few:.2f}", flush=True)
        elif many > MOST * few + more:
            wrong.append(f"{name}: {many:.1f} MiB of {counts[1]} views, {few:.1f} of {counts[0]}")
    return wrong


# Of noisy views of 320²: limits under which they are refined in a spool, and under which their surfaces and pictures are, MiB.
NOISY_LIMIT, SURFACES_LIMIT, PICTURES_LIMIT = 640, 140, 80
# What is refined or refines first, and then looks at one view at a time.
REFINED = {"refine exr": "refine {} -o OUT.exr", "refine mp4": "refine {} -o OUT.mp4 --without colours", "convert": "convert {} -o OUT.exr --refine noise",
           "folder": "extract {} -o OUT --refine noise", "points": "extract {} -o OUT.ply --refine noise,agree"}


def noisy_of_many(args, folder):
    """What takes more for many noisy views than for few, or is not the same as from memory."""
    wrong, (few_views, most_views) = [], NOISY
    if args.only not in "noisy " + " ".join(REFINED):
        return wrong
    for count in NOISY:
        noisy_set(os.path.join(folder, f"noisy{count}"), count, 320)
        must([args.stx, "convert", f"noisy{count}", "-o", f"noisy{count}.exr"], folder)
    for number, (name, line) in enumerate(REFINED.items()):
        output = next(word for word in line.split() if word.startswith("OUT")).replace("OUT", f"noisy_{number}")

        def refined(count, limit=NOISY_LIMIT):
            words = line.replace("OUT", f"noisy_{number}").replace("{}", f"noisy{count}.exr").split()
            done = must([args.stx] + words + ["--threads", "2", "--max-memory", str(limit)], folder)
            if b"noise" not in done.err:
                wrong.append(f"noisy {name}: the views were not refined: {done.err.decode()}")
            return done.usage.ru_maxrss / 1024, files_of(os.path.join(folder, output))

        def most():
            return MOST * few + COMPARED * (most_views - few_views)

        few = refined(few_views)[0]
        many, made = refined(most_views)
        in_memory, expected = refined(most_views, IN_MEMORY)
        for _ in range(0 if args.measure else TRIES):
            if many > most():
                few, many = max(few, refined(few_views)[0]), min(many, refined(most_views)[0])
        if args.measure:
            print(f"noisy {name:21} {few:6.1f} MiB of {few_views} views, {many:6.1f} of {most_views}: {many / few:.2f}; in memory {in_memory:.1f}", flush=True)
        elif many > most():
            wrong.append(f"noisy {name}: {many:.1f} MiB of {most_views} views, {few:.1f} of {few_views}")
        if made != expected:
            wrong.append(f"noisy {name}: it is not that of a larger --max-memory")
    for name, words, limit in (("glb", "extract noisy24.exr -o OUT.glb", SURFACES_LIMIT),
                               ("picture", "render noisy24.exr -o OUT.png --eye 5,0,0 --target 5.2,0,-3 --size 256x256 --backend cpu", PICTURES_LIMIT)):
        output = [word for word in words.split() if word.startswith("OUT")][0]
        made = []
        for most in (limit, IN_MEMORY):
            done = must([args.stx] + words.replace("OUT", f"noisy_{most}").split() + ["--threads", "2", "--max-memory", str(most)], folder)
            made.append(files_of(os.path.join(folder, output.replace("OUT", f"noisy_{most}"))))
            if args.measure:
                print(f"noisy {name:21} {done.usage.ru_maxrss / 1024:6.1f} MiB at --max-memory {most}", flush=True)
            elif done.usage.ru_maxrss / 1024 > most + PROGRAM:
                wrong.append(f"noisy {name}: {done.usage.ru_maxrss / 1024:.1f} MiB at --max-memory {most}")
        if made[0] != made[1]:
            wrong.append(f"noisy {name}: it is not that of a larger --max-memory")
    return wrong


# Of films of 512²: a limit under which no frame of them is held whole and decoded pictures of both fill their part, MiB.
FILM_LIMIT = 64
# What converts a film. {} is its name without the ending.
FILMS = {"exr to exr": "convert {}_%d.exr -o OUT_%d.exr", "exr to mp4": "convert {}_%d.exr -o OUT.mp4",
         "mp4 to exr": "convert {}.mp4 -o OUT_%d.exr", "mp4 to mp4": "convert {}.mp4 -o OUT.mp4 --depth-bits 8",
         "to jpeg": "convert {}.mp4 -o OUT.mp4 --colour jpeg",
         "set to exr": "convert {} -o OUT_%d.exr", "set to mp4": "convert {} -o OUT.mp4",
         "folder of exr": "extract {}_%d.exr -o OUT --refine off", "folder of mp4": "extract {}.mp4 -o OUT --refine off",
         "sheet of exr": "sheet {}_%d.exr -o OUT.png --refine off", "sheet of mp4": "sheet {}.mp4 -o OUT.png --refine off"}


def film_of_many(args, folder):
    """What takes more for films of many views than of few, or is not the same as from memory."""
    wrong = []
    rows = {name: line for name, line in FILMS.items() if args.only in f"films {name}"}
    if not rows:
        return wrong
    for count in FILM:
        film_set(os.path.join(folder, f"film{count}"), count, 512)
        for film in (f"film{count}_%d.exr", f"film{count}.mp4"):
            must([args.stx, "convert", f"film{count}", "-o", film], folder)
    for number, (name, line) in enumerate(rows.items()):
        def converted(count, limit=FILM_LIMIT):
            words = line.replace("OUT", f"films/{number}").replace("{}", f"film{count}").split()
            os.makedirs(os.path.join(folder, "films"))
            done = must([args.stx] + words + ["--threads", "2", "--max-memory", str(limit)], folder)
            made = files_of(os.path.join(folder, "films"))
            shutil.rmtree(os.path.join(folder, "films"))
            return done.usage.ru_maxrss / 1024, made

        few = converted(FILM[0])[0]
        many, made = converted(FILM[1])
        in_memory, expected = converted(FILM[1], IN_MEMORY)
        # Views of a set are compared.
        more = COMPARED * (FILM[1] - FILM[0]) if name.startswith("set") else 0
        for _ in range(0 if args.measure else TRIES):
            if many > MOST * few + more:
                few, many = max(few, converted(FILM[0])[0]), min(many, converted(FILM[1])[0])
        if args.measure:
            print(f"films {name:21} {few:6.1f} MiB of {FILM[0]} views, {many:6.1f} of {FILM[1]}: {many / few:.2f}; in memory {in_memory:.1f}", flush=True)
        elif many > MOST * few + more:
            wrong.append(f"films {name}: {many:.1f} MiB of {FILM[1]} views, {few:.1f} of {FILM[0]}")
        if " to " in name:
            source = line.split()[1].replace("{}", f"film{FILM[1]}")
            found = json.loads(must([args.stx, "info", source, "--memory", "--threads", "2", "--format", "json"], folder).out)["memory"]
            said, = (row for row in found["commands"] if row["command"] == "convert -o NAME." + name.split()[2])
            if said["views"] != "one for each thread" or in_memory > said["bytes"] / (1 << 20) + PROGRAM:
                wrong.append(f"films {name}: {in_memory:.1f} MiB, but stx info --memory says {said}")
        if made != expected:
            wrong.append(f"films {name}: it is not that of a larger --max-memory")
    return wrong


# Views of 1024² of which a picture would take 540 MiB by splats and 750 by surfaces, and what it takes of them with the limit that nobody sets, MiB.
PICTURE_VIEWS, PICTURE_TAKES = 34, 360


def picture_of_many(args, folder):
    """A picture of many views takes what it needs, or is not the same as from memory."""
    wrong = []
    modes = [mode for mode in ("surface", "splat") if args.only in f"picture of many {mode}"]
    if not modes or not os.path.exists(args.model):
        return wrong
    must([args.stx, "convert", os.path.abspath(args.model), "-o", "picture.exr", "--views", f"sphere:{PICTURE_VIEWS}", "--size", "1024x1024"], folder)
    for mode in modes:
        made, takes = [], []
        for limit in ([], ["--max-memory", str(IN_MEMORY)]):
            done = must([args.stx, "render", "picture.exr", "-o", "picture.png", "--orbit", "1", "--size", "512x512", "--mode", mode, "--backend", "cpu", "--threads", "2"] + limit,
                        folder)
            made.append(files_of(os.path.join(folder, "picture.png")))
            takes.append(done.usage.ru_maxrss / 1024)
        if args.measure:
            print(f"picture of many {mode:8} {takes[0]:6.1f} MiB, {takes[1]:6.1f} in memory", flush=True)
        elif takes[0] > PICTURE_TAKES + PROGRAM:
            wrong.append(f"picture of many {mode}: {takes[0]:.1f} MiB")
        if made[0] != made[1]:
            wrong.append(f"picture of many {mode}: it is not that of a larger --max-memory")
    return wrong


def main():
    args = harness.arguments(__doc__, measure=0, only="")
    with tempfile.TemporaryDirectory(prefix="stx-peak-") as folder:
        end(many_views(args, folder) + noisy_of_many(args, folder) + film_of_many(args, folder) + picture_of_many(args, folder))


if __name__ == "__main__":
    main()
