#!/usr/bin/env python3
"""Outputs are whole or absent.

Every command is killed at many (seeded) moments: its target is then the old one, the new one or
not there, and after the next run no temporary file is left. The same with disks that fill up, a
file system that may only be read, an output with the name of the input, and --no-clobber, which
refuses before the input is opened. SIGINT and SIGTERM stop within a second and leave nothing.
"""
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from harness import PREFIX, arguments, film_set, must, quad, run, temporaries, tree, turn_set, write

FAILED = []


def expect(good, what, detail=""):
    if not good:
        FAILED.append(what)
        print(f"FAILED: {what}\n  {detail}", flush=True)


class Command:
    """A command that writes `targets` (names in its folder); `options` makes another output of it."""

    def __init__(self, name, words, targets, options=("--size", "16x16")):
        self.name, self.words, self.targets, self.options = name, words, targets, list(options)


def commands(inputs):
    views = ["--views", "ring:4", "--size", "160x160"]
    mesh, bundle, atlas = inputs["mesh"], inputs["bundle"], inputs["atlas"]
    yield Command("convert mp4", ["convert", mesh, "-o", "t.mp4"] + views, ["t.mp4"])
    yield Command("convert exr", ["convert", mesh, "-o", "t.exr"] + views, ["t.exr"])
    yield Command("convert xmt", ["convert", mesh, "-o", "t.xmt"] + views, ["t.xmt"])
    yield Command("convert bt", ["convert", mesh, "-o", "t.bt"] + views, ["t.bt"])
    yield Command("bake", ["bake", bundle, "-o", "t.mp4"], ["t.mp4"], ["--method", "paper"])
    yield Command("pack folder", ["pack", bundle, "-o", "t"], ["t"], ["--layout", "tight"])
    yield Command("pack exr", ["pack", bundle, "-o", "t.exr"], ["t.exr"], ["--layout", "tight"])
    yield Command("select", ["select", bundle, "-o", "t.mp4"], ["t.mp4"], ["--count", "1"])
    yield Command("extract transforms", ["extract", bundle, "-o", "t"], ["t"], ["extract", inputs["other"]])
    yield Command("extract miv", ["extract", bundle, "-o", "t", "--cameras", "miv"], ["t"],
                  ["extract", inputs["other"]])
    yield Command("extract ply", ["extract", bundle, "-o", "t.ply"], ["t.ply"], ["extract", inputs["other"]])
    yield Command("extract drc", ["extract", bundle, "-o", "t.drc"], ["t.drc"], ["--position-bits", "8"])
    yield Command("extract glb", ["extract", bundle, "-o", "t.glb"], ["t.glb"], ["extract", inputs["other"]])
    yield Command("extract rgbd", ["extract", bundle, "-o", "t.png", "--as", "rgbd"], ["t.png"], ["extract", inputs["other"]])
    yield Command("extract spz", ["extract", bundle, "-o", "t.spz"], ["t.spz"], ["extract", inputs["other"]])
    yield Command("extract html", ["extract", bundle, "-o", "t.html"], ["t.html"], ["extract", inputs["other"]])
    yield Command("render png", ["render", bundle, "-o", "t.png", "--backend", "cpu", "--size", "400x400"], ["t.png"])
    yield Command("render sequence", ["render", atlas, "-o", "t_%04d.png", "--orbit", "6", "--backend", "cpu", "--size",
                                      "200x200"], [f"t_{i:04d}.png" for i in range(6)])
    yield Command("background", ["background", inputs["frames"], "-o", "t.png"], ["t.png"], ["--method", "n2pg"])
    yield Command("sheet", ["sheet", bundle, "-o", "t.png"], ["t.png"], ["--size", "500x500"])
    yield Command("panorama", ["panorama", inputs["turn"], "-o", "t.png"], ["t.png"], ["--size", "64x32"])
    yield Command("panorama faces", ["panorama", inputs["turn"], "-o", "t"], ["t"], ["--faces", "16"])
    yield Command("convert film", ["convert", inputs["film"], "-o", "t.mp4"], ["t.mp4"], ["--every", "2"])
    yield Command("bake film", ["bake", inputs["film"], "-o", "t.mp4"], ["t.mp4"], ["--method", "paper"])


def state(folder, target):
    """What a target is now, with the images that a text scene names; None when it is not there."""
    path = os.path.join(folder, target)
    if not os.path.lexists(path):
        return None
    if os.path.isdir(path):
        return tree(path)
    with open(path, "rb") as file:
        content = file.read()
    if target.endswith((".xmt", ".bt")):
        images = [n for n in sorted(os.listdir(folder)) if os.path.isdir(os.path.join(folder, n))
                  and not n.startswith(PREFIX)]
        return content, {n: tree(os.path.join(folder, n)) for n in images}
    return content


def states(folder, targets):
    return {t: state(folder, t) for t in targets}


def overridden(words, options):
    """The command with options (or, behind its name, the input) replaced or added."""
    words = list(words)
    for key, value in zip(options[::2], options[1::2]):
        if key in words:
            words[words.index(key) + 1] = value
        else:
            words += [key, value]
    return words


def kill_moments(args, command, folder, kills, rng):
    old_folder, new_folder, work = (os.path.join(folder, n) for n in ("old", "new", "work"))
    for path in (old_folder, new_folder):
        os.makedirs(path)
    must([args.stx] + overridden(command.words, command.options), old_folder)
    start = time.monotonic()
    must([args.stx] + command.words, new_folder)
    duration = time.monotonic() - start
    old, new = states(old_folder, command.targets), states(new_folder, command.targets)
    expect(old != new, f"{command.name}: the test's two outputs are the same")
    counts = {"old": 0, "new": 0, "absent": 0}
    left = 0
    for i in range(kills):
        shutil.rmtree(work, ignore_errors=True)
        had = i % 3 != 0
        if had:
            shutil.copytree(old_folder, work)
        else:
            os.makedirs(work)
        process = subprocess.Popen([args.stx] + command.words, cwd=work, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        # Most moments near the end, where the files are written.
        moment = duration * (rng.uniform(0, 1.1) if i % 4 == 0 else rng.uniform(0.6, 1.15))
        time.sleep(moment)
        process.kill()
        process.wait()
        for target, now in states(work, command.targets).items():
            kind = ("absent" if now is None else "new" if now == new[target]
                    else "old" if had and now == old[target] else "half")
            if kind == "half" or (kind == "absent" and had and not target.endswith((".xmt", ".bt"))):
                expect(False, f"{command.name}: '{target}' is {kind} after a kill at {moment:.3f} s of {duration:.3f} s",
                       f"files: {sorted(tree(work))}")
            else:
                counts[kind] += 1
        if temporaries(work):
            left += 1
        # Each run that left something, and the last one, is followed by a whole run.
        if temporaries(work) or i + 1 == kills:
            must([args.stx] + command.words, work)
            expect(not temporaries(work), f"{command.name}: temporaries stay after the next run",
                   str(temporaries(work)))
            expect(states(work, command.targets) == new, f"{command.name}: the next run writes something else")
    print(f"{command.name}: {kills} kills in {duration:.2f} s: {counts}, {left} left temporaries to the next run",
          flush=True)
    return kills, left


def can_mount(folder):
    done = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "none", folder], capture_output=True)
    if done.returncode == 0:
        subprocess.run(["umount", folder], check=True)
    return done.returncode == 0


def full_disk(args, all_commands, folder):
    """Each command on disks of several sizes, each smaller than its output."""
    mounted = os.path.join(folder, "disk")
    os.makedirs(mounted)
    if not can_mount(mounted):
        print("disk full: not run, mounting a tmpfs is not allowed here")
        return 0
    runs = 0
    whole = {}
    for command in all_commands:
        if len(command.targets) > 1:
            roomy = tempfile.mkdtemp(dir=folder)
            must([args.stx] + command.words, roomy)
            whole[command.name] = states(roomy, command.targets)
    for command in all_commands:
        for kilobytes in (4, 12, 40):
            subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "none", mounted], check=True)
            try:
                old = b"old" if "." in command.targets[0] else None
                if old:
                    write(os.path.join(mounted, command.targets[0]), old)
                done = run([args.stx] + command.words, mounted)
                runs += 1
                name = f"{command.name} on a disk of {kilobytes} kB"
                expect(not temporaries(mounted), f"{name}: temporaries stay", str(temporaries(mounted)))
                if done.code == 0:
                    continue
                expect(done.code == 2, f"{name}: exit code", done)
                expect(b"No space left" in done.err, f"{name}: does not say why", done)
                expect(b".stx-tmp-" not in done.err, f"{name}: names a file that nobody knows", done)
                if len(command.targets) == 1:
                    expect(sorted(tree(mounted).items()) == ([(command.targets[0], old)] if old else []),
                           f"{name}: the old target is gone, or something else is there", sorted(tree(mounted)))
                for target in command.targets if len(command.targets) > 1 else []:
                    now = state(mounted, target)
                    expect(now in (None, b"old", whole[command.name][target]), f"{name}: '{target}' is cut short")
            finally:
                subprocess.run(["umount", mounted], check=True)
    # A file system that may only be read.
    for command in all_commands:
        subprocess.run(["mount", "-t", "tmpfs", "-o", "ro,size=4k", "none", mounted], check=True)
        try:
            done = run([args.stx] + command.words, mounted)
            runs += 1
            expect(done.code == 2, f"{command.name} on a disk that may only be read: exit code", done)
        finally:
            subprocess.run(["umount", mounted], check=True)
    print(f"disk full and read-only: {runs} runs")
    return runs


def size_limit(args, all_commands, folder):
    """`ulimit -f`: writing fails in the middle of the file."""
    for command in all_commands:
        work = os.path.join(folder, "limited", command.name.replace(" ", "-"))
        os.makedirs(work)
        done = run(["sh", "-c", 'ulimit -f 2; exec "$@"', "sh", args.stx] + command.words, work)
        if done.code != 0:
            expect(done.code == 2, f"{command.name} under ulimit -f: exit code", done)
            if len(command.targets) == 1:
                expect(not tree(work), f"{command.name} under ulimit -f: leaves {sorted(tree(work))}")


def in_place(args, inputs, folder):
    """The output has the name of the input: the result is that of another name."""
    for name, words in (("a.mp4", ["convert", "a.mp4", "-o", "OUT", "--depth-bits", "8"]),
                        ("a.exr", ["convert", "a.exr", "-o", "OUT", "--depth-bits", "8"]),
                        ("a.xmt", ["convert", "a.xmt", "-o", "OUT", "--depth-bits", "8"]),
                        ("a.bt", ["convert", "a.bt", "-o", "OUT"]),
                        ("a.mp4", ["bake", "a.mp4", "-o", "OUT"]),
                        ("a.exr", ["bake", "a.exr", "-o", "OUT"]),
                        ("a.mp4", ["select", "a.mp4", "-o", "OUT"])):
        ending = os.path.splitext(name)[1]
        first, second = (tempfile.mkdtemp(dir=folder) for _ in range(2))
        for where in (first, second):
            must([args.stx, "convert", inputs["bundle"], "-o", name], where)
        aside = "b" + ending if ending not in (".xmt", ".bt") else os.path.join("other", name)
        os.makedirs(os.path.join(first, "other"))
        must([args.stx] + [aside if w == "OUT" else w for w in words], first)
        done = run([args.stx] + [name if w == "OUT" else w for w in words], second)
        expect(done.code == 0, f"in place: {' '.join(words)}", done)
        expect(not temporaries(second), f"in place: {' '.join(words)} leaves temporaries")
        whole = state(os.path.dirname(os.path.join(first, aside)), os.path.basename(aside))
        expect(state(second, name) == whole, f"in place: {' '.join(words)} writes something else")


def no_clobber(args, all_commands, folder):
    """Refuses before the input is looked at: here it does not even exist."""
    for command in all_commands:
        work = tempfile.mkdtemp(dir=folder)
        first = os.path.join(work, command.targets[0])
        if "." in command.targets[0]:
            write(first, b"old")
        else:
            os.makedirs(first)
        words = list(command.words) + ["--no-clobber"]
        if len(command.targets) == 1:
            words[1] = "missing.file"
        done = run([args.stx] + words, work)
        expect(done.code == 2 and b"--no-clobber" in done.err, f"--no-clobber: {command.name}", done)
        if os.path.isfile(first):
            expect(tree(work) == {command.targets[0]: b"old"}, f"--no-clobber: {command.name} changes something")


def stopping(args, inputs, folder):
    """Signals end a long run and a batch soon, with 128 + signal, and leave nothing half-written."""
    for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
        for batch in (False, True):
            work = tempfile.mkdtemp(dir=folder)
            names = []
            for i in range(100):
                names.append(f"m{i}.obj")
                shutil.copyfile(inputs["mesh"], os.path.join(work, names[-1]))
            os.makedirs(os.path.join(work, "out"))
            write(os.path.join(work, "list.txt"), "\n".join(names))
            words = (["@list.txt", "-o", "out/{stem}.exr", "--jobs", "3", "--views", "sphere:12", "--size", "400x400",
                      "--report", "r.jsonl"]
                     if batch else ["m0.obj", "-o", "out/m0.exr", "--views", "ring:64", "--size", "2048x2048"])
            process = subprocess.Popen([args.stx, "convert"] + words, cwd=work, stdin=subprocess.DEVNULL,
                                       stderr=subprocess.PIPE,
                                       preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
            time.sleep(0.5)
            while batch and process.poll() is None and not any(n.endswith(".exr") for n in tree(os.path.join(work, "out"))):
                time.sleep(0.02)
            process.send_signal(number)
            start = time.monotonic()
            err = process.communicate()[1]
            seconds = time.monotonic() - start
            what = f"{signal.Signals(number).name} to {'a batch' if batch else 'a conversion'}"
            expect(process.returncode == code, f"{what}: exit code {process.returncode}", err)
            # Generous, for machines under load; an idle one takes well below a second.
            expect(seconds < 10, f"{what}: {seconds:.1f} s to stop")
            expect(not temporaries(work), f"{what}: leaves {temporaries(work)}")
            if batch and code:
                lines = open(os.path.join(work, "r.jsonl"), encoding="utf-8").read().splitlines()
                done = len(os.listdir(os.path.join(work, "out")))
                # Those that were between their last step and their report are done, too.
                expect(done - 3 <= len(lines) <= done, f"{what}: reports {len(lines)} of {done} outputs")
            for name in os.listdir(os.path.join(work, "out")):
                done = run([args.stx, "info", os.path.join("out", name)], work)
                expect(done.code == 0, f"{what}: '{name}' is not whole", done)
            print(f"{what}: {process.returncode} after {seconds:.2f} s, {len(os.listdir(os.path.join(work, 'out')))} outputs")


def main():
    args = arguments(__doc__, kills=6, seed=1)
    rng = random.Random(args.seed)
    with tempfile.TemporaryDirectory(prefix="stx-kill-") as folder:
        inputs = {"mesh": quad(folder), "bundle": os.path.join(folder, "in.mp4"), "atlas": os.path.join(folder, "in")}
        must([args.stx, "convert", inputs["mesh"], "-o", "in.mp4", "--views", "ring:4", "--size", "160x160"], folder)
        must([args.stx, "pack", "in.mp4", "-o", "in"], folder)
        inputs["frames"] = os.path.join(folder, "frames")
        os.makedirs(inputs["frames"])
        must([args.stx, "render", "in.mp4", "-o", "frames/f_%04d.png", "--orbit", "8", "--backend", "cpu", "--size",
              "200x200", "--background", "white"], folder)
        inputs["turn"] = turn_set(os.path.join(folder, "turn"))
        inputs["other"] = os.path.join(folder, "other.mp4")
        must([args.stx, "convert", inputs["mesh"], "-o", "other.mp4", "--views", "ring:2", "--size", "20x20"], folder)
        inputs["film"] = os.path.join(folder, "film")
        film_set(args.stx, inputs["bundle"], inputs["film"])
        all_commands = list(commands(inputs))
        kills = left = 0
        for command in all_commands:
            k, n = kill_moments(args, command, os.path.join(folder, command.name.replace(" ", "-")), args.kills, rng)
            kills, left = kills + k, left + n
        batch = Command("batch", ["convert", inputs["bundle"], inputs["other"], inputs["mesh"], "-o", "t_{stem}.exr",
                                  "--jobs", "2", "--keep-going", "--views", "ring:4", "--size", "160x160"],
                        ["t_in.exr", "t_other.exr", "t_quad.exr"])
        full_disk(args, all_commands + [batch], os.path.join(folder, "mounts"))
        size_limit(args, all_commands, folder)
        in_place(args, inputs, folder)
        no_clobber(args, all_commands, folder)
        stopping(args, inputs, folder)
    print(f"{kills} kills, {left} left temporaries which the next run removed; {len(FAILED)} failed")
    return 1 if FAILED else 0


if __name__ == "__main__":
    sys.exit(main())
