#!/usr/bin/env python3
"""Runs one CLI case: a text file of commands with all that they must print.

    # comment
    $ stx info missing.mp4        a command, run by sh in a fresh folder
    ? 2                           its exit code (0 when there is no such line)
    > a line of stdout            all of stdout, line by line
    ! a line of stderr            all of stderr, line by line
    = file                        exists after the command
    - file                        does not exist after the command

In > and ! lines, {*} stands for any text within the line; a line {...} for any number of lines.
$MODEL is the sample model, $SHARED the folder of real inputs, $SOURCE the checkout. A line
`needs: path` skips the case (exit code 77) when the path under $SHARED is missing; `needs-program:
name` when the program is not installed; `needs-gpu:` when stx finds no OpenGL without a display;
`needs-video:` and `needs-heif:` when the module of video or of HEIC was not built.
"""
import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile


# What a line asks for: the module, and the package that it is built with.
MODULES = {"needs-video:": ("stx_video.so", "libavformat-dev"), "needs-heif:": ("stx_heif.so", "libheif-dev")}


def matcher(line):
    return re.compile(".*".join(re.escape(p) for p in line.split("{*}")) + r"\Z")


def matches(expected, got):
    """Whether the lines match; {...} takes any number of lines."""
    if not expected:
        return not got
    if expected[0] == "{...}":
        return any(matches(expected[1:], got[i:]) for i in range(len(got) + 1))
    return bool(got) and bool(matcher(expected[0]).match(got[0])) and matches(expected[1:], got[1:])


def parse(path):
    steps, needs, programs, gpu, modules = [], [], [], False, []
    for number, raw in enumerate(open(path, encoding="utf-8"), 1):
        line = raw.rstrip("\n")
        if not line or line.startswith("#"):
            continue
        if line.startswith("needs:"):
            needs.append(line[6:].strip())
            continue
        if line.startswith("needs-program:"):
            programs.append(line[14:].strip())
            continue
        if line.startswith("needs-gpu:"):
            gpu = True
            continue
        if line in MODULES:
            modules.append(line)
            continue
        kind, text = line[0], line[2:]
        if kind == "$":
            steps.append({"command": text, "line": number, "code": 0, ">": [], "!": [], "=": [], "-": []})
        elif kind == "?":
            steps[-1]["code"] = int(text)
        elif kind in ">!=-":
            steps[-1][kind].append(text)
        else:
            sys.exit(f"{path}:{number}: a line starts with $ ? > ! = or -, not '{kind}'")
    return steps, needs, programs, gpu, modules


def main():
    case, stx, model, shared, source = sys.argv[1:6]
    steps, needs, programs, gpu, modules = parse(case)
    for need in needs:
        if not os.path.exists(os.path.join(shared, need)):
            print(f"SKIPPED: needs {os.path.join(shared, need)}, which is not here")
            return 77
    for program in programs:
        if not shutil.which(program):
            print(f"SKIPPED: needs the program {program}, which is not installed")
            return 77
    if gpu and subprocess.run([stx, "render", "--list-devices"], capture_output=True).returncode:
        print("SKIPPED: needs OpenGL without a display, which is not here")
        return 77
    for name, package in map(MODULES.get, modules):
        if not glob.glob(os.path.join(os.path.dirname(stx), "..", "lib*", "**", name), recursive=True):
            print(f"SKIPPED: needs the module {name}, which was not built ({package})")
            return 77
    env = dict(os.environ, MODEL=model, SHARED=shared, SOURCE=source,
               PATH=os.path.dirname(stx) + ":" + os.environ["PATH"])
    failed = False
    with tempfile.TemporaryDirectory(prefix="stx-cli-") as folder:
        for step in steps:
            done = subprocess.run(["sh", "-c", step["command"]], cwd=folder, env=env, capture_output=True,
                                  timeout=240, stdin=subprocess.DEVNULL)
            out = done.stdout.decode("utf-8", "replace").splitlines()
            err = done.stderr.decode("utf-8", "replace").splitlines()
            problems = []
            if done.returncode != step["code"]:
                problems.append(f"exit code {done.returncode}, expected {step['code']}")
            for name, expected, got in (("stdout", step[">"], out), ("stderr", step["!"], err)):
                if not matches(expected, got):
                    problems.append(f"{name} is not as expected:\n" + "\n".join("  want " + x for x in expected) +
                                    "\n" + "\n".join("  got  " + x for x in got))
            for name in step["="]:
                if not os.path.exists(os.path.join(folder, name)):
                    problems.append(f"'{name}' is not there")
            for name in step["-"]:
                if os.path.lexists(os.path.join(folder, name)):
                    problems.append(f"'{name}' is there")
            left = [n for r, _, f in os.walk(folder) for n in f if ".stx-tmp" in n]
            if left:
                problems.append(f"temporary files stay: {left}")
            if problems:
                failed = True
                print(f"{case}:{step['line']}: $ {step['command']}\n" + "\n".join(problems))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
