#!/usr/bin/env python3
"""Damaged files through every command that could be handed them.

Every malformed mesh and image of the shared folder, and files of ours and of the reference folder
cut short or with bytes changed (seeded); each file of image sets of all kinds likewise. Each run
must end by itself, without a signal, in little processor time and memory, with an exit code of the
contract, one `stx: ` line when that is not 0, and no output but a whole one. `--samples N` cuts and
changes each file N times; `--every N` takes each N-th case only.
"""
import collections
import concurrent.futures
import os
import random
import shutil
import sys
import tempfile

import image_sets
from harness import arguments, commands_of, copy_into, must, quad, run, temporaries, write

CODES = (0, 2, 3, 4, 5, 7)
CPU_SECONDS = 10
MEMORY_MIB = 512
PEAK_MIB = 1024  # what a run may really take: twice the limit it was given

CONVERT = ["-o", "OUT/a.mp4", "--views", "ring:2", "--size", "24x24", "--supersampling", "1"]
RENDER = ["-o", "OUT/a.png", "--size", "24x24", "--backend", "cpu"]
# What reads bundles and atlases, with every kind of output.
OTHERS = [["extract", "IN", "-o", "OUT/set"], ["extract", "IN", "-o", "OUT/points.ply"],
          ["extract", "IN", "-o", "OUT/set", "--cameras", "miv", "--depth", "png"],
          ["extract", "IN", "-o", "OUT/points.drc"], ["extract", "IN", "-o", "OUT/view.html"],
          ["extract", "IN", "-o", "OUT/model.glb"],
          ["extract", "IN", "-o", "OUT/few.glb", "--triangles", "50"], ["extract", "IN", "-o", "OUT/photo.jpg"],
          ["render", "IN", "-o", "OUT/sway_%02d.png", "--sway", "5", "--frames", "2", "--size", "24x24", "--backend", "cpu"],
          ["extract", "IN", "-o", "OUT/cloud.spz", "--max-splats", "50"],
          ["select", "IN", "-o", "OUT/a.exr", "--count", "1"], ["background", "IN", "-o", "OUT/behind.exr"],
          ["bake", "IN", "-o", "OUT/a.mp4"], ["pack", "IN", "-o", "OUT/atlas"],
          ["convert", "IN", "-o", "OUT/o.mp4", "--octree-image", "4"],
          ["sheet", "IN", "-o", "OUT/a.png", "--size", "900x700"], ["info", "IN", "--cameras", "OUT/a.svg"]]


class Case:
    """A command line in which IN is the damaged file and OUT a folder for outputs. With `inside`,
    IN is a copy of the folder `source` in which this file has the content."""

    def __init__(self, name, command, source=None, content=None, beside=(), inside=None):
        self.name, self.command, self.inside = name, command, inside
        self.source, self.content, self.beside = source, content, beside


def commands_for(name, have):
    """What may be handed a model or a bundle."""
    ending = os.path.splitext(name)[1].lower()
    lines = [["info", "IN"], ["validate", "IN"], ["convert", "IN"] + CONVERT, ["render", "IN"] + RENDER]
    if ending == ".y4m":
        lines = [["background", "IN", "-o", "OUT/a.png"], ["background", "IN", "-o", "OUT/a.png", "--method", "n2pg"]]
    if ending == ".jsonl":
        lines = [["report", "merge", "IN"]]
    if ending == ".json":
        lines = [["info", "IN"], ["validate", "IN"], ["render", "IN"] + RENDER]
    if ending in (".json", ".mp4", ".exr", ".xmt", ".bt"):
        lines += OTHERS
    return [line for line in lines if line[0] in have]


def malformed(shared, have, folder):
    meshes = os.path.join(shared, "data/malformed/meshes")
    for root, _, names in sorted(os.walk(meshes)):
        for name in sorted(names):
            if os.path.splitext(name)[1].lower() in (".bin", ".png", ".jpg"):
                continue
            for line in commands_for(name, have):
                yield Case(f"mesh {name}", line, source=os.path.join(root, name))
    model = quad(folder)
    for root, _, names in sorted(os.walk(os.path.join(shared, "data/malformed/images"))):
        for name in sorted(names):
            path = os.path.join(root, name)
            lines = [["convert", model, "--texture", "IN"] + CONVERT, ["info", "IN"]]
            if "compare" in have:
                lines.append(["compare", "IN", "IN"])
            if "background" in have:
                lines.append(["background", "IN", "IN", "-o", "OUT/a.png"])
            if "panorama" in have:
                lines.append(["panorama", "IN", "IN", "-o", "OUT/a.png"])
            if name.endswith(".exr"):
                lines += commands_for(name, have)
            for line in lines:
                yield Case(f"image {name}", line, source=path)


def own_files(args, folder):
    """Small files of each kind that we write."""
    model = quad(folder)
    made = []
    for ending in ("mp4", "exr", "xmt", "bt"):
        out = os.path.join(folder, f"own.{ending}")
        must([args.stx, "convert", model, "-o", out, "--views", "ring:2", "--size", "24x24"], folder)
        made.append(out)
    must([args.stx, "bake", made[0], "-o", os.path.join(folder, "baked.mp4")], folder)
    made.append(os.path.join(folder, "baked.mp4"))
    must([args.stx, "pack", made[0], "-o", os.path.join(folder, "atlas")], folder)
    made.append(os.path.join(folder, "atlas", "atlas.json"))
    must([args.stx, "pack", made[0], "-o", os.path.join(folder, "atlas.exr")], folder)
    made.append(os.path.join(folder, "atlas.exr"))
    for name, words in (("convert.jsonl", ["convert", f"@{folder}/list", "-o", f"{folder}/{{stem}}.bt", "--size", "24x24"]),
                        ("render.jsonl", ["render", made[0], "-o", f"{folder}/p_%d.png", "--orbit", "3", "--size", "24x24"])):
        write(os.path.join(folder, "list"), model.encode() + b"\n")
        must([args.stx] + words + ["--shard", "1/2", "--report", name], folder)
        made.append(os.path.join(folder, name))
    return made + models(folder) + videos(folder)


def videos(folder):
    """Uncompressed video, from the seeds of fuzzing."""
    seeds = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../fuzz/corpus/y4m")
    return [copy_into(os.path.join(seeds, name), folder) for name in ("420jpeg.y4m", "420p10.y4m")]


def damaged_films(args, folder):
    """Compressed video of several containers and codings, made by ffmpeg where it is; that of others and ours."""
    os.makedirs(folder, exist_ok=True)
    lines = {}
    if shutil.which("ffmpeg"):
        def film(name, *options):
            must(["ffmpeg", "-nostdin", "-v", "error", "-y", "-f", "lavfi", "-i", "testsrc=size=48x32:rate=10:duration=1",
                  *options, name], folder)
            return os.path.join(folder, name)
        colour = film("colour.mp4", "-pix_fmt", "yuv420p", "-g", "4", "-bf", "2")
        depth = film("depth.mkv", "-c:v", "ffv1", "-slicecrc", "1", "-pix_fmt", "gray16le")
        camera = os.path.join(folder, "camera.json")
        write(camera, b'{"w":48,"h":32,"fl_x":50,"frames":[{"transform_matrix":[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}')
        pair = ["convert", camera, "--depth-unit", "0.001", "-o", "OUT/a.mp4"]
        background = ["background", "IN", "-o", "OUT/a.png"]
        lines[colour] = [background, pair + ["--texture", "IN", "--depth", depth]]
        lines[depth] = [background, pair + ["--texture", colour, "--depth", "IN"]]
        for name, options in (("a.avi", ["-c:v", "mjpeg"]), ("a.webm", ["-c:v", "libvpx"]), ("a.mov", ["-c:v", "mpeg4"])):
            lines[film(name, *options)] = [background]
        ours = os.path.join(folder, "ours.mp4")
        made = run([args.stx, "convert", camera, "--depth-unit", "0.001", "--texture", colour, "--depth", depth,
                    "--video", "h264", "-o", ours], folder)
        if made.code == 0:
            lines[ours] = [["render", "IN", "--time", "0.9", "--view", "0", "-o", "OUT/a.png"], ["validate", "IN"]]
    recording = os.path.join(args.shared, "data/motion/azure-kinect/recording.mkv")
    if os.path.exists(recording):
        lines[recording] = [["convert", "IN", "-o", "OUT/a.mp4"]]
    for path, commands in lines.items():
        for i, content in enumerate(damages(path, args.samples if path != recording else args.samples // 3, args.seed)):
            yield Case(f"{os.path.basename(path)} damaged {i}", commands[i // 2 % len(commands)], content=content,
                       source=path)


def models(folder):
    """Models whose readers are not ours, from the seeds of fuzzing (their first byte says what they are)."""
    seeds = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../fuzz/corpus/meshes")
    made = []
    for name in ("small.off", "small.dae", "small.fbx"):
        with open(os.path.join(seeds, name), "rb") as file:
            write(os.path.join(folder, name), file.read()[1:])
        made.append(os.path.join(folder, name))
    return made


def references(shared):
    for kind in ("mp4", "bt", "xmt", "motion"):
        folder = os.path.join(shared, "reference", kind)
        if not os.path.isdir(folder):
            continue
        for root, _, names in sorted(os.walk(folder)):
            for name in sorted(names):
                path = os.path.join(root, name)
                if name.endswith((".mp4", ".bt") if kind == "motion" else "." + kind) and os.path.getsize(path) < 1 << 20:
                    yield path


def companions(path):
    """The files that a text scene or an atlas names; a damaged copy needs them beside it."""
    if not path.endswith((".xmt", ".bt", ".json")):
        return []
    folder, name = os.path.split(path)
    stem = os.path.splitext(name)[0]
    return [os.path.join(folder, other) for other in sorted(os.listdir(folder))
            if other != name and (other.startswith(stem) or path.endswith(".json"))
            and not other.endswith((".xmt", ".bt", ".mp4", ".exr"))]


def damages(path, samples, seed):
    """The file cut short and changed, in turns."""
    with open(path, "rb") as file:
        whole = file.read()
    rng = random.Random(f"{seed} {os.path.basename(path)}")
    for i in range(samples):
        content = bytearray(whole)
        if i % 2 == 0:
            del content[rng.randrange(len(content)):]
        else:
            # Half of the changes go to the head, where the numbers stand.
            span = len(content) if i % 4 == 1 else min(len(content), 2048)
            for _ in range(rng.randint(1, 4)):
                content[rng.randrange(span)] = rng.choice((0, 0x7F, 0x80, 0xFF, rng.randrange(256)))
        yield bytes(content)


def damaged(path, have, samples, seed):
    lines = commands_for(path, have)
    for i, content in enumerate(damages(path, samples, seed)):
        # A cut and a change for each command before the next.
        yield Case(f"{os.path.basename(path)} damaged {i}", lines[i // 2 % len(lines)], content=content,
                   source=path, beside=companions(path))


def damaged_sets(args, folder):
    """Image sets of each kind, in which one file is damaged or missing."""
    for kind, (root, options) in image_sets.write_all(folder, args.stx).items():
        command = ["convert", "IN", "-o", "OUT/a.exr"] + options
        names = sorted(os.path.relpath(os.path.join(top, name), root)
                       for top, _, names in os.walk(root) for name in names)
        for name in names:
            # Cameras and poses have more to say than pictures, which all sets share.
            picture = name.endswith((".png", ".yuv"))
            samples = max(2, args.samples // 6) if picture else args.samples
            for i, content in enumerate(damages(os.path.join(root, name), samples, args.seed)):
                yield Case(f"{kind} set, {name} damaged {i}", command, source=root, content=content, inside=name)
            yield Case(f"{kind} set, {name} empty", command, source=root, content=b"", inside=name)
            yield Case(f"{kind} set, {name} missing", command, source=root, inside=name)


def check(done, out):
    problems = []
    lines = done.err.decode("utf-8", "replace").splitlines()
    errors = [line for line in lines if line.startswith("stx: ")]
    left = sorted(os.listdir(out))
    if done.code is None:
        problems.append("did not end")
    elif done.code < 0:
        problems.append(f"ended by signal {-done.code}")
    elif done.code == 1 and any("give the " in line and " with --" in line for line in errors):
        pass  # without its calibration file, a set's numbers can come from options
    elif done.code not in CODES:
        problems.append(f"exit code {done.code}")
    if done.code and done.code > 0 and len(errors) != (1 if done.code != 7 else len(errors)):
        problems.append(f"{len(errors)} lines that begin with 'stx: '")
    if done.code == 0 and errors:
        problems.append("says an error and ends with 0")
    strange = [line for line in lines if not line.startswith(("stx: ", "note: ")) and " → " not in line]
    if strange:
        problems.append(f"a library speaks: {strange[0]!r}")
    if any(len(line) > 2000 for line in errors):
        problems.append("an error of more than 2000 characters")
    if done.code != 0 and left:
        problems.append(f"leaves {left}")
    if temporaries(out):
        problems.append(f"leaves {temporaries(out)}")
    peak = done.usage.ru_maxrss >> 10 if done.usage else 0
    if peak > PEAK_MIB:
        problems.append(f"takes {peak} MiB at --max-memory {MEMORY_MIB}")
    return problems


def one(args, case, keep):
    with tempfile.TemporaryDirectory(prefix="stx-hostile-") as folder:
        out = os.path.join(folder, "out")
        os.mkdir(out)
        path = case.source
        if case.inside:
            path = os.path.join(folder, os.path.basename(case.source))
            shutil.copytree(case.source, path)
            if case.content is None:
                os.remove(os.path.join(path, case.inside))
            else:
                write(os.path.join(path, case.inside), case.content)
        elif case.content is not None:
            for other in case.beside:
                copy_into(other, folder)
            path = os.path.join(folder, os.path.basename(case.source))
            write(path, case.content)
        command = [args.stx] + [word.replace("OUT", out) if word.startswith("OUT/") else path if word == "IN" else word
                                for word in case.command]
        done = run(command + ["--max-memory", str(MEMORY_MIB), "--threads", "1"], folder, timeout=100,
                   cpu_seconds=CPU_SECONDS)
        problems = check(done, out)
        if problems and keep and case.content is not None:
            kept = case.name.replace(" ", "_").replace("/", "_")
            write(os.path.join(keep, kept + os.path.splitext(case.inside or path)[1]), case.content)
        return case, done, problems


def main():
    args = arguments(__doc__, samples=24, seed="one", keep="", jobs=os.cpu_count() or 2, every=1)
    have = commands_of(args.stx)
    with tempfile.TemporaryDirectory(prefix="stx-hostile-own-") as folder:
        groups = {"over malformed files": list(malformed(args.shared, have, folder)), "over damaged ones of ours": [],
                  "over damaged references": [], "over damaged image sets": [], "over damaged films": []}
        for path in own_files(args, folder):
            groups["over damaged ones of ours"] += damaged(path, have, args.samples, args.seed)
        for path in references(args.shared):
            groups["over damaged references"] += damaged(path, have, max(2, args.samples // 6), args.seed)
        groups["over damaged image sets"] += damaged_sets(args, os.path.join(folder, "sets"))
        groups["over damaged films"] += damaged_films(args, os.path.join(folder, "films"))
        groups = {name: cases[::args.every] for name, cases in groups.items()}
        cases = [case for group in groups.values() for case in group]
        codes, failed, slowest, peak = collections.Counter(), 0, 0.0, 0
        with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
            for case, done, problems in pool.map(lambda c: one(args, c, args.keep), cases):
                codes[done.code] += 1
                if done.usage:
                    slowest = max(slowest, done.usage.ru_utime + done.usage.ru_stime)
                    peak = max(peak, done.usage.ru_maxrss >> 10)
                if problems:
                    failed += 1
                    print(f"{case.name}: {'; '.join(problems)}\n  {done}", flush=True)
    print(f"{len(cases)} runs: {', '.join(f'{len(group)} {name}' for name, group in groups.items())}; "
          f"exit codes {dict(sorted(codes.items(), key=str))}; "
          f"at most {slowest:.1f} s of processor and {peak} MiB; {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
