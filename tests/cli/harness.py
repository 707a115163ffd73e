"""What the Python tests of the program share: running it, small inputs, looking for leftovers."""
import argparse
import json
import math
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time

PREFIX = ".stx-tmp-"

QUAD_OBJ = """mtllib quad.mtl
v -1 -1 0.1
v 1 -1 0
v 1 1 -0.2
v -1 1 0.3
vt 0 0
vt 1 0
vt 1 1
vt 0 1
usemtl paint
f 1/1 2/2 3/3
f 1/1 3/3 4/4
"""
QUAD_MTL = "newmtl paint\nKd 0.8 0.4 0.2\n"


def arguments(description, **extra):
    """The arguments that every test gets from CMake: the program, the model, the shared folder."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("stx")
    parser.add_argument("model")
    parser.add_argument("shared")
    for name, value in extra.items():
        parser.add_argument("--" + name, type=type(value), default=value)
    args = parser.parse_args()
    args.stx = os.path.abspath(args.stx)
    args.model = os.path.abspath(args.model)
    args.shared = os.path.abspath(args.shared)
    return args


class Done:
    """How a run ended."""

    def __init__(self, command, code, out, err, seconds, usage=None):
        self.command, self.code, self.out, self.err = command, code, out, err
        self.seconds, self.usage = seconds, usage

    def __str__(self):
        return (f"$ {' '.join(map(str, self.command))}\n  exit code {self.code}, {self.seconds:.1f} s\n"
                f"  {self.err.decode('utf-8', 'replace')[-600:]}")


def run(command, cwd, timeout=120, cpu_seconds=0, env=None, umask=-1):
    """Runs it to its end; a run past `timeout` is killed and has code None."""

    def limits():
        if cpu_seconds:
            resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds + 1))

    start = time.monotonic()
    # Files rather than pipes: os.wait4 can then be used for the peak of memory.
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = subprocess.Popen(command, cwd=cwd, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                                   preexec_fn=limits, env=env, umask=umask)
        code, usage = None, None
        while True:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                code = os.waitstatus_to_exitcode(status)
                break
            if time.monotonic() - start > timeout:
                process.kill()
                os.wait4(process.pid, 0)
                break
            time.sleep(0.002)
        process.returncode = 0 if code is None else code
        out.seek(0)
        err.seek(0)
        return Done(command, code, out.read(), err.read(), time.monotonic() - start, usage)


def must(command, cwd, **options):
    """Runs what has to succeed before the test can begin."""
    done = run(command, cwd, **options)
    if done.code != 0:
        sys.exit(f"cannot prepare: {done}")
    return done


def write(path, content):
    with open(path, "wb") as file:
        file.write(content.encode() if isinstance(content, str) else content)


def quad(folder):
    """A mesh of two triangles with a material."""
    write(os.path.join(folder, "quad.obj"), QUAD_OBJ)
    write(os.path.join(folder, "quad.mtl"), QUAD_MTL)
    return os.path.join(folder, "quad.obj")


def tree(folder):
    """Each file below a folder with its bytes."""
    found = {}
    for root, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(root, name)
            key = os.path.relpath(path, folder)
            if os.path.islink(path) or not os.path.isfile(path):
                found[key] = b"(not a regular file)"
                continue
            with open(path, "rb") as file:
                found[key] = file.read()
    return found


def temporaries(folder):
    """Unfinished outputs that are left in a folder."""
    return sorted(os.path.join(root, name) for root, folders, names in os.walk(folder)
                  for name in folders + names if name.startswith(PREFIX))


def commands_of(stx):
    """The commands that this program has."""
    listed = subprocess.run([stx, "--help"], capture_output=True, text=True, check=True).stdout.split()
    known = ("convert", "select", "pack", "bake", "background", "panorama", "render", "extract", "info", "validate",
             "compare", "sheet", "report")
    return {c for c in known
            if c in listed}


def copy_into(source, folder):
    target = os.path.join(folder, os.path.basename(source))
    if os.path.isdir(source):
        shutil.copytree(source, target)
    else:
        shutil.copyfile(source, target)
    return target


def turn_set(folder, count=3, width=160, height=120):
    """Makes `folder` with pictures (.pgm) of a camera that turned to the left by 12 degrees between them: soft
    noise all around it. The folder's name."""
    os.makedirs(folder)
    cells = {}
    rng = random.Random(5)

    def noise(p):
        i = [math.floor(c) for c in p]
        t = [c - f for c, f in zip(p, i)]
        t = [u * u * (3 - 2 * u) for u in t]
        total = 0.0
        for corner in range(8):
            at = tuple(f + (corner >> axis & 1) for axis, f in enumerate(i))
            if at not in cells:
                cells[at] = rng.random()
            weight = 1.0
            for axis in range(3):
                weight *= t[axis] if corner >> axis & 1 else 1 - t[axis]
            total += weight * cells[at]
        return total

    for k in range(count):
        c, s = math.cos(math.radians(12 * k)), math.sin(math.radians(12 * k))
        values = bytearray()
        for row in range(height):
            for column in range(width):
                x, y = (column + 0.5 - width / 2) / width, (height / 2 - row - 0.5) / width
                ray = (c * x - s, y, -s * x - c)
                length = math.sqrt(sum(v * v for v in ray))
                values.append(int(255 * noise([v * 12 / length for v in ray]) + 0.5))
        write(os.path.join(folder, f"t_{k}.pgm"), b"P5 %d %d 255\n" % (width, height) + bytes(values))
    return folder


def film_set(stx, bundle, folder):
    """Makes an image set with time in `folder`: a bundle's views are pictures of one camera, which moves."""
    must([stx, "extract", bundle, "-o", folder], os.path.dirname(folder))
    path = os.path.join(folder, "transforms.json")
    with open(path, encoding="utf-8") as file:
        data = json.load(file)
    for i, frame in enumerate(data["frames"]):
        frame.update(time=i / 10, camera="c")
    with open(path, "w", encoding="utf-8") as file:
        json.dump(data, file)
