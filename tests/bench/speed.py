#!/usr/bin/env python3
"""How fast the program is, from the file to the picture, as one table.

    tests/bench/speed.py build/release                          # all rows, in less than three minutes
    tests/bench/speed.py build/release --only convert --json > new.json
    tests/bench/speed.py build/release --against old.json       # what became slower; exit code 1 then

A machine's speed is measured by the yardstick: one thread projects points and keeps the nearest of each
pixel (yardstick.hpp). It is measured beside each row, and a row's figure is a ratio, so that tables of
different machines can be compared:

    share    points a second, as a share of the yardstick's                        (more is better);
             "in vectors": of the same loop in vectors on all threads
    points   million points that the yardstick projects in the row's time          (less is better)
    peer     the time of another job, measured in turn with it                     (less is better)
    memory   MB of the process at its largest                                      (less is better)

Times are those of the fastest of a few runs. Rows whose inputs are not in STX_SHARED_DIR are left out,
and so are rows of benchmarks that were not built; what is left out is listed.
"""

import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parents[2]
VERSION = 1
UNITS = {"share": "of the yardstick", "points": "million points", "peer": "times", "memory": "MB"}
# The machine on which the limits in seconds were set: million points a second of its yardstick.
REFERENCE = 102.0


def points(seconds):
    """A limit in seconds of the reference machine, as points of the yardstick."""
    return seconds * REFERENCE


class Row:
    """One line of the table. `asked` is the limit of `ratio`, or None for rows that others refer to."""

    def __init__(self, job, kind, ratio, asked=None, wall=None, processor=None, yardstick=None, peer="", vectors=None):
        self.job, self.kind, self.ratio, self.asked = job, kind, ratio, asked
        self.wall, self.processor, self.yardstick, self.peer = wall, processor, yardstick, peer
        self.vectors = vectors  # share of the yardstick in vectors on all threads

    def holds(self):
        if self.asked is None:
            return None
        return self.ratio >= self.asked if self.kind == "share" else self.ratio <= self.asked

    def slower_than(self, old):
        """How many times the old row's cost this one has."""
        return old.ratio / self.ratio if self.kind == "share" else self.ratio / old.ratio

    def to_json(self):
        return {k: v for k, v in vars(self).items() if v not in (None, "")}

    @staticmethod
    def from_json(value):
        if not isinstance(value, dict) or value.get("kind") not in UNITS:
            raise ValueError(f"a row with one of the kinds {', '.join(UNITS)} is expected, not {value!r}")
        if not isinstance(value.get("ratio"), (int, float)) or not value["ratio"] > 0:
            raise ValueError(f"row '{value.get('job')}' has no ratio above 0")
        known = ("job", "kind", "ratio", "asked", "wall", "processor", "yardstick", "peer", "vectors")
        return Row(**{k: value[k] for k in known if k in value})


def read_table(path):
    """The rows of a file that --json wrote. Errors: ValueError with the file's name."""
    try:
        table = json.loads(pathlib.Path(path).read_text())
        if not isinstance(table, dict) or table.get("version") != VERSION:
            raise ValueError(f"a table of version {VERSION} is expected")
        return [Row.from_json(row) for row in table["rows"]]
    except (OSError, KeyError, ValueError) as error:
        raise ValueError(f"'{path}' is not a table of speed.py --json: {error}") from error


def seconds(value):
    if value is None:
        return ""
    return f"{value:.2f} s" if value >= 1 else f"{value * 1000:.0f} ms"


def figure(kind, value):
    return f"{value:.0f}" if kind in ("points", "memory") and value >= 10 else f"{value:.2f}"


def cells(row):
    unit = f"times {row.peer}" if row.peer else UNITS[row.kind]
    if row.vectors is not None:
        unit += f", {row.vectors:.3f} in vectors"
    sign = "≥" if row.kind == "share" else "≤"
    asked = "" if row.asked is None else f"{sign} {figure(row.kind, row.asked)}"
    holds = {None: "", True: "yes", False: "no"}[row.holds()]
    yardstick = "" if row.yardstick is None else f"{row.yardstick:.0f}"
    return [row.job, seconds(row.wall), seconds(row.processor), yardstick,
            f"{figure(row.kind, row.ratio)} {unit}", asked, holds]


HEADER = ["job", "wall", "processor", "yardstick", "ratio", "asked", "holds"]


def markdown(values):
    return f"| {' | '.join(values)} |"


def slower(old, new, tolerance=0.10):
    """Lines about the rows of `new` that cost more than the rows of `old` by more than `tolerance`, and
    rows that `old` has and `new` does not."""
    before = {row.job: row for row in old}
    lines = []
    for row in new:
        was = before.pop(row.job, None)
        if was is None or was.kind != row.kind:
            continue
        factor = row.slower_than(was)
        if factor > 1 + tolerance:
            lines.append(f"{row.job}: {figure(row.kind, was.ratio)} → {figure(row.kind, row.ratio)} "
                         f"{UNITS[row.kind]}, {100 * (factor - 1):.0f} % slower")
    return lines, [job for job in before]


class Cost:
    """Of the fastest of some runs: wall and processor seconds, MB; the fastest yardstick beside them."""

    def __init__(self):
        self.wall = self.processor = self.memory = float("inf")
        self.yardstick = 0.0

    def add(self, wall, processor, memory, yardstick):
        self.wall, self.processor = min(self.wall, wall), min(self.processor, processor)
        self.memory, self.yardstick = min(self.memory, memory), max(self.yardstick, yardstick)


class Measurement:
    def __init__(self, build, shared, work, only):
        self.stx, self.tests = build / "bin/stx", build / "tests"
        self.shared, self.work, self.only = shared, work, only
        self.left_out = []
        self.ruler = subprocess.Popen([self.tests / "bench_yardstick"], stdin=subprocess.PIPE,
                                      stdout=subprocess.PIPE, text=True)

    def close(self):
        self.ruler.stdin.close()
        self.ruler.wait()

    def yardstick(self):
        self.ruler.stdin.write("\n")
        self.ruler.stdin.flush()
        return float(self.ruler.stdout.readline())

    def wanted(self, *jobs):
        return any(word in job for job in jobs for word in self.only) if self.only else True

    def missing(self, what, *jobs):
        """True, and told, when an input or a program of the jobs is not there."""
        if what.exists():
            return False
        self.left_out.append(f"{what} is not there: {', '.join(jobs)}")
        return True

    def run(self, command):
        """Runs it to its end; wall and processor seconds and MB at its largest."""
        command = [str(c) for c in command]
        start = time.monotonic()
        with tempfile.TemporaryFile() as said:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=said)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            wall = time.monotonic() - start
            if process.returncode:
                said.seek(0)
                raise SystemExit(f"{' '.join(command)}\n{said.read().decode('utf-8', 'replace')}")
        return wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024

    def stx_once(self, *arguments):
        self.run([self.stx, *arguments, "-q"])

    def costs(self, commands, repeats):
        """Commands in turn, each after the yardstick."""
        found = [Cost() for _ in commands]
        for _ in range(repeats):
            for cost, command in zip(found, commands):
                ruler = self.yardstick()
                wall, processor, memory = self.run([self.stx, *command, "-q"])
                cost.add(wall, processor, memory, max(ruler, self.yardstick()))
        return found

    def timed(self, job, limit, command, repeats=3):
        """A command whose wall time is limited to `limit` seconds of the reference machine."""
        if not self.wanted(job):
            return
        (cost,) = self.costs([command], repeats)
        yield Row(job, "points", cost.wall * cost.yardstick, points(limit), cost.wall, cost.processor,
                  cost.yardstick)

    # ---- Rows ----

    def spheres(self):
        bundle = self.work / "spheres.exr"
        if not bundle.exists():
            self.stx_once("convert", self.shared / "data/imagesets/spheres-miv/cameras.json", "-o", bundle)
        return bundle

    def spot_model(self):
        return self.shared / "data/meshes/obj/spot/spot_triangulated.obj"

    def spot(self, name, *views):
        bundle = self.work / name
        if not bundle.exists():
            self.stx_once("convert", self.spot_model(), "-o", bundle, *views)
        return bundle

    def novel_cameras(self):
        """Twelve cameras that sway between the four of spheres-miv."""
        path = self.work / "novel.json"
        scene = json.loads((self.shared / "data/imagesets/spheres-miv/cameras.json").read_text())
        pose = next(c for c in scene["cameras"] if c["Name"] == "gt_center")
        scene["cameras"] = [
            pose | {"Name": f"n{i}", "Position": [0.01 * i, 0.02 * (i - 5.5), 1.2 + 0.015 * (i % 5 - 2)]}
            for i in range(12)
        ]
        scene["sourceCameraNames"] = []
        path.write_text(json.dumps(scene))
        return path

    def sequences(self):
        """A sequence as files, against the same as a stream."""
        for mode, settings in (("surface", []), ("splat", ["--mode", "splat"])):
            names = [f"12 frames of spheres, {mode} → {ending}" for ending in ("y4m", "png", "exr")]
            if not self.wanted(*names) or self.missing(self.shared / "data/imagesets/spheres-miv", *names):
                continue
            common = ["render", self.spheres(), "--cameras", self.novel_cameras(), *settings]
            outputs = [["-o", "-", "--file-format", "y4m"]]
            outputs += [["-o", self.work / f"frame_%02d.{ending}"] for ending in ("png", "exr")]
            costs = self.costs([common + o for o in outputs], 3)
            stream = costs[0]
            yield Row(names[0], "points", stream.wall * stream.yardstick / 12, None, stream.wall,
                      stream.processor, stream.yardstick)
            for name, cost, asked in zip(names[1:], costs[1:], (1.15, 1.3)):
                yield Row(name, "peer", cost.wall / stream.wall, asked, cost.wall, cost.processor,
                          cost.yardstick, "y4m")

    def first_pictures(self):
        job = "spheres.exr → one png"
        if self.wanted(job) and not self.missing(self.shared / "data/imagesets/spheres-miv", job):
            yield from self.timed(job, 0.35, ["render", self.spheres(), "--cameras", self.one_camera(),
                                              "-o", self.work / "one.png"], 5)
        job = "spot.mp4 → one png of 512²"
        if self.wanted(job) and not self.missing(self.spot_model(), job):
            yield from self.timed(job, 0.40, ["render", self.spot("spot.mp4"), "-o", self.work / "one.png"], 5)

    def moving_sources(self):
        """Four sources of 1024x768 that are new in each frame, as PNG files of colour and of depth."""
        frames = 12
        job = f"{frames} frames of four moving sources → png"
        if not self.wanted(job) or self.missing(self.shared / "data/imagesets/spheres-miv", job):
            return
        folder = self.work / "moving"
        if not folder.exists():
            self.stx_once("extract", self.spheres(), "-o", folder, "--depth", "png")
            scene = json.loads((folder / "transforms.json").read_text())
            scene["frames"] = [self.at_moment(folder, i, source, moment) for moment in range(frames)
                               for i, source in enumerate(scene["frames"])]
            (folder / "transforms.json").write_text(json.dumps(scene))
        command = ["render", folder / "transforms.json", "--cameras", self.one_camera(), "--times", "all",
                   "-o", self.work / "moved_%02d.png"]
        yield from self.timed(job, 0.25 * frames, command)

    @staticmethod
    def at_moment(folder, camera, source, moment):
        """A source once more, in files of its own."""
        moved = source | {"time": moment / 25, "camera": camera}
        for key in ("file_path", "depth_file_path"):
            old = pathlib.Path(source[key])
            moved[key] = str(old.with_stem(f"{old.stem}_{moment}"))
            shutil.copy(folder / old, folder / moved[key])
        return moved

    def one_camera(self):
        path = self.work / "one.json"
        scene = json.loads(self.novel_cameras().read_text())
        scene["cameras"] = scene["cameras"][:1]
        path.write_text(json.dumps(scene))
        return path

    def drawn(self, bundle, cameras, modes, frames):
        """Milliseconds of a frame by mode, and the yardstick, of bench_spheres."""
        command = [self.tests / "bench_spheres", "--json", "--frames", frames, bundle, cameras, *modes]
        done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
        if done.returncode:
            raise SystemExit(done.stderr)
        return [json.loads(line) for line in done.stdout.splitlines()]

    def drawing(self, scene, bundle, cameras, limits, frames):
        names = {mode: f"drawing {scene}, {mode}" for mode in limits}
        modes = [mode for mode, name in names.items() if self.wanted(name)]
        if not modes or self.missing(self.tests / "bench_spheres", *names.values()):
            return
        for found in self.drawn(bundle(), cameras(), modes, frames):
            wall = found["milliseconds"] / 1000
            share = found["points"] / wall / 1e6 / found["yardstick"]
            yield Row(names[found["mode"]], "share", share, limits[found["mode"]], wall,
                      found["processor"] / 1000, found["yardstick"],
                      vectors=found["points"] / wall / 1e6 / found["vectors"])

    def frames(self):
        if not self.missing(self.shared / "data/imagesets/spheres-miv", "drawing spheres"):
            yield from self.drawing("spheres", self.spheres, self.novel_cameras,
                                    {"normal": 0.5, "best": 0.35, "splat": 1.3}, 24)
        if self.missing(self.spot_model(), "drawing spot"):
            return
        # 65, 100 and 30 ms of 1.6 million points on the reference machine.
        yield from self.drawing("spot, 16 views", lambda: self.spot("spot.exr"), lambda: "orbit:60",
                                {"normal": 0.25, "best": 0.16, "splat": 0.52}, 30)
        jobs = {views: f"drawing spot, {views} views against 16, normal" for views in (64, 256)}
        jobs = {views: job for views, job in jobs.items() if self.wanted(job)}
        if not jobs or self.missing(self.tests / "bench_spheres", *jobs.values()):
            return
        few = self.drawn(self.spot("spot.exr"), "orbit:60", ["normal"], 20)[0]
        for views, job in jobs.items():
            bundle = self.spot(f"spot{views}.exr", "--views", f"sphere:{views}")
            many = self.drawn(bundle, "orbit:60", ["normal"], 20)[0]
            bundle.unlink()
            yield Row(job, "peer", many["milliseconds"] / few["milliseconds"], 1.1, many["milliseconds"] / 1000,
                      many["processor"] / 1000, many["yardstick"], "16 views")

    def conversions(self):
        job = "convert spot → 16 views, mp4"
        if self.wanted(job) and not self.missing(self.spot_model(), job):
            yield from self.timed(job, 0.6, ["convert", self.spot_model(), "-o", self.work / "spot.mp4"])
        job, memory = "convert 5 million triangles → 16 views, exr: processor", "the same: memory"
        if self.wanted(job, memory) and not self.missing(self.tests / "bench_mesh", job):
            mesh = self.work / "mesh.ply"
            self.run([self.tests / "bench_mesh", mesh, 5000000])
            (cost,) = self.costs([["convert", mesh, "-o", self.work / "mesh.exr"]], 1)
            mesh.unlink()
            # Half of what it took once: 38 s of processor and 1.5 GB.
            yield Row(job, "points", cost.processor * cost.yardstick, points(19), cost.wall, cost.processor,
                      cost.yardstick)
            yield Row(memory, "memory", cost.memory, 750)
        job = "pack --prune spheres"
        if self.wanted(job) and not self.missing(self.shared / "data/imagesets/spheres-miv", job):
            yield from self.timed(job, 1.0, ["pack", "--prune", self.spheres(), "-o", self.work / "atlas"])

    def rows(self):
        for part in (self.sequences, self.first_pictures, self.moving_sources, self.frames, self.conversions):
            yield from part()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path, help="folder of a release build")
    parser.add_argument("--only", action="append", default=[], metavar="TEXT", help="rows whose job has this in its name")
    parser.add_argument("--json", action="store_true", help="the table as JSON, for --against")
    parser.add_argument("--against", metavar="TABLE.json", help="tell what became slower by more than 10 %%")
    options = parser.parse_args()
    try:
        old = read_table(options.against) if options.against else None
    except ValueError as error:
        raise SystemExit(str(error)) from error
    shared = pathlib.Path(os.environ.get("STX_SHARED_DIR", HERE.parent / "shared"))
    build = options.build.resolve()
    for program in ("bin/stx", "tests/bench_yardstick"):
        if not (build / program).exists():
            raise SystemExit(f"'{build / program}' is not there; build all of a preset with tests first")
    rows = []
    with tempfile.TemporaryDirectory() as work:
        measurement = Measurement(build, shared, pathlib.Path(work), options.only)
        if not options.json:
            print(markdown(HEADER), "|---" * len(HEADER) + "|", sep="\n", flush=True)
        for row in measurement.rows():
            rows.append(row)
            if not options.json:
                print(markdown(cells(row)), flush=True)
        measurement.close()
    for line in measurement.left_out:
        print(f"left out: {line}", file=sys.stderr)
    if options.json:
        print(json.dumps({"version": VERSION, "rows": [r.to_json() for r in rows]}, indent=1))
    if old is None:
        return 0
    lines, gone = slower(old, rows)
    if not options.only:
        for job in gone:
            print(f"not measured now: {job}", file=sys.stderr)
    for line in lines:
        print(f"slower: {line}", file=sys.stderr)
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
