#!/usr/bin/env python3
"""Pictures, models, atlases and cubes of views that do not fit memory: they take no more than their limit allows, and are the same as
those of a larger one. `--measure` prints what each takes:

    tests/cli/peak_of_few_test.py build/release/bin/stx MODEL.obj SHARED_DIR --measure 1
"""
import json
import os
import tempfile

import harness
from harness import must
from peaks import IN_MEMORY, PROGRAM, TURNED_VIEWS, end, files_of, film_set, hold, turned_set


# Of pictures of 36 views of 512² under a limit for less than a half of them, MiB: what they may take, the program and its
# pictures included. In memory they take 190 to 410.
FEW_LIMIT, FEW = 80, 200
# Of surfaces and of splats of 36 views of 512² under limits for a fifth and a half of what is asked for them in memory, MiB:
# what they may take, with the program. In memory they take 180 and 500.
MODEL_LIMIT, MODEL = 140, 120
SPLATS_LIMIT, SPLATS = 600, 200
# Of pruning 36 views of 512² of which a third is points, and of an atlas of them, bytes for each pixel of the views. All
# views, what pruning knows of each pixel and the atlas side by side take 40.
PRUNE = 20
# Of the same into OpenEXR, which is written a few rows at a time: the pages alone take 8.
PACK_EXR = 13
# Of pruning them by pictures, MiB: a limit with room for the atlas, but not for all views beside it.
PRUNE_LIMIT = 224
# Of views of a sensor that turned in place, for a half of what they take in memory, MiB.
CUBE_LIMIT = 80


def compare(args, name, every, few, most, same, made, wrong):
    """Adds to `wrong` a run of `few` views at a time that takes more than `most` MiB, or whose result is not that of `every` view in memory."""
    peak = few.usage.ru_maxrss / 1024
    if args.measure:
        print(f"{name:46} {peak:6.1f} MiB, in memory {every.usage.ru_maxrss / 1024:6.1f}", flush=True)
    elif peak > most:
        wrong.append(f"{name}: {peak:.1f} MiB")
    if not same:
        wrong.append(f"{name}: {made} not that of a larger --max-memory")


def from_few(args, folder):
    """What is not the same, or takes too much, of pictures of 36 views that do not fit memory."""
    wrong = []
    for kind in (".exr", ".mp4", "set") if os.path.exists(args.model) else ():
        for options in ("", "--quality best --light dir:0.5,-1.5,-1", "--mode splat"):
            name = f"few {kind} {options}"
            if args.only not in name:
                continue
            line = f"render many36{kind} --orbit 3 --elevation 20 --size 512x512 --backend cpu --threads 2 {options}".split()
            every = must([args.stx] + line + ["-o", "all_%d.png"], folder)
            few = must([args.stx] + line + ["-o", "few_%d.png", "--max-memory", str(FEW_LIMIT)], folder)
            pictures = [open(os.path.join(folder, f"{which}_{i}.png"), "rb").read() for which in ("all", "few") for i in range(3)]
            compare(args, name, every, few, FEW, pictures[:3] == pictures[3:], "what it draws is", wrong)
    return wrong


def model_of_few(args, folder):
    """What is not the same, or takes too much, of a model of 36 views that do not fit memory."""
    wrong = []
    models_of = ((".exr", "glb", "", MODEL_LIMIT, MODEL), (".mp4", "glb", "", MODEL_LIMIT, MODEL),
                 (".exr", "ply", "--as splats", SPLATS_LIMIT, SPLATS),
                 (".exr", "ply", "--as splats --max-splats 100000", SPLATS_LIMIT, SPLATS))
    for kind, ending, options, limit, most in models_of if os.path.exists(args.model) else ():
        name = f"few {kind} {ending} {options}"
        if args.only not in name:
            continue
        line = ["extract", f"many36{kind}", "--threads", "2"] + options.split() + ["-o"]
        every = must([args.stx] + line + ["all." + ending, "--max-memory", str(IN_MEMORY)], folder)
        few = must([args.stx] + line + ["few." + ending, "--max-memory", str(limit)], folder)
        models = [files_of(os.path.join(folder, f"{which}.{ending}")) for which in ("all", "few")]
        compare(args, name, every, few, most, models[0] == models[1], "the model is", wrong)
    return wrong


def pruned_one_by_one(args, folder):
    """What takes too much of an atlas of many views."""
    wrong = []
    rows = [("many36.exr", 36, ""), ("many36.exr --prune", 36, ""), ("many36.exr --prune --layout tight", 36, ""), ("many36.exr many12.exr", 48, "")]
    rows += [("many36.exr --max-memory 100", 36, ".exr"), ("many36.exr --prune", 36, ".exr")]
    for number, (words, views, ending) in enumerate(rows if os.path.exists(args.model) else ()):
        name, mega = f"many pack {words}", views * 512 * 512 / 1e6
        if args.only not in name:
            continue
        done = must([args.stx, "pack"] + words.split() + ["-o", f"packed{number}{ending}", "--threads", "2"], folder)
        peak = done.usage.ru_maxrss / 1024
        each = (peak - 40) * 1.048576 / mega
        if args.measure:
            print(f"{name:46} {peak:6.1f} MiB, {each:.1f} bytes a pixel", flush=True)
        elif each > (PACK_EXR if ending else PRUNE):
            wrong.append(f"{name}: {peak:.1f} MiB, {each:.1f} bytes a pixel")
        if number == 0:
            found = json.loads(must([args.stx, "info", "many36.exr", "--memory", "--threads", "2", "--format", "json"], folder).out)
            said, = (row["bytes"] / (1 << 20) for row in found["memory"]["commands"] if row["command"] == "pack")
            if args.measure:
                print(f"{name:46} {said:6.1f} MiB by stx info --memory", flush=True)
            # The pages are 24 bytes a pixel at most, of views in memory 32.
            elif not peak - PROGRAM <= said <= 1.7 * peak:
                wrong.append(f"{name}: {peak:.1f} MiB, but stx info --memory says {said:.1f}")
    name, made = "few pack --min-psnr", []
    if os.path.exists(args.model) and args.only in name:
        for limit in (IN_MEMORY, PRUNE_LIMIT):
            done = must([args.stx, "pack", "many36.exr", "-o", f"measured{limit}", "--min-psnr", "20", "--threads", "2", "--max-memory", str(limit)], folder)
            made.append(files_of(os.path.join(folder, f"measured{limit}")))
            peak = done.usage.ru_maxrss / 1024
            if args.measure:
                print(f"{name:46} {peak:6.1f} MiB at --max-memory {limit}", flush=True)
            elif peak > PRUNE_LIMIT + PROGRAM:
                wrong.append(f"{name}: {peak:.1f} MiB at --max-memory {limit}")
        if made[0] != made[1]:
            wrong.append(f"{name}: the atlas is not that of a larger --max-memory")
    return wrong


def cube_of_few(args, folder):
    """What is not the same, or takes too much, of the cube of views that do not fit memory."""
    wrong = []
    if args.only not in "cube":
        return wrong
    turned_set(os.path.join(folder, "turned"), TURNED_VIEWS, 512)
    must([args.stx, "convert", "turned", "-o", "turned.exr"], folder)
    cubes = []
    for limit in (IN_MEMORY, CUBE_LIMIT):
        done = must([args.stx, "convert", "turned.exr", "-o", f"cube{limit}.mp4", "--cube", "--threads", "2", "--max-memory", str(limit)], folder)
        cubes.append(open(os.path.join(folder, f"cube{limit}.mp4"), "rb").read())
        hold(args, "cube", done, limit, CUBE_LIMIT, wrong)
    if cubes[0] != cubes[1]:
        wrong.append("cube: it is not that of a larger --max-memory")
    return wrong


def film_of_few(args, folder):
    """What is not the same, or takes too much, of pictures of a film whose frames do not fit memory."""
    wrong = []
    films = [(mode, film) for mode in ("surface", "splat") for film in ("film_%d.exr", "film.mp4", "film") if args.only in f"film {mode} {film}"]
    if not films:
        return wrong
    film_set(os.path.join(folder, "film"), TURNED_VIEWS, 512)
    for film in ("film_%d.exr", "film.mp4"):
        must([args.stx, "convert", "film", "-o", film], folder)
    for number, (mode, film) in enumerate(films):
        name, pictures = f"film {mode} {film}", []
        for limit in (IN_MEMORY, CUBE_LIMIT):
            done = must([args.stx, "render", film, "-o", f"shown{number}_{limit}/%d.png", "--mode", mode, "--times", "all", "--size", "256x256",
                         "--threads", "2", "--max-memory", str(limit)] + "--eye 0.1,0,0 --target 0,0,-3".split(), folder)
            pictures.append(files_of(os.path.join(folder, f"shown{number}_{limit}")))
            hold(args, name, done, limit, CUBE_LIMIT, wrong)
        if len(set(pictures[0].values())) != 2 or pictures[0] != pictures[1]:
            wrong.append(f"{name}: its pictures are not those of a larger --max-memory")
    return wrong


def main():
    args = harness.arguments(__doc__, measure=0, only="")
    with tempfile.TemporaryDirectory(prefix="stx-peak-") as folder:
        if os.path.exists(args.model):
            for count in (12, 36):
                must([args.stx, "convert", os.path.abspath(args.model), "-o", f"many{count}.exr", "--views", f"sphere:{count}", "--size", "512x512"], folder)
            must([args.stx, "convert", "many36.exr", "-o", "many36.mp4"], folder)
            # What a set takes in memory where it is small (heldWhole()) is more than what its views take one by one.
            must([args.stx, "extract", "many36.exr", "-o", "many36set"], folder)
        end(from_few(args, folder) + model_of_few(args, folder) + pruned_one_by_one(args, folder) + cube_of_few(args, folder) + film_of_few(args, folder))


if __name__ == "__main__":
    main()
