#!/usr/bin/env python3
"""What a terminal shows: the line of progress with the time left, gone before anything else is said."""
import os
import pty
import re
import subprocess
import sys
import tempfile

import harness


def on_terminal(command, cwd):
    """All that the command writes to a terminal as its stderr."""
    try:
        ours, theirs = pty.openpty()
    except OSError as error:
        print(f"SKIPPED: no pseudo terminal can be made here: {error}")
        sys.exit(77)
    process = subprocess.Popen(command, cwd=cwd, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=theirs)
    os.close(theirs)
    text = b""
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:  # the other end is closed
            break
        if not piece:
            break
        text += piece
    os.close(ours)
    return process.wait(), text.decode("utf-8", "replace")


def shown(text):
    """The lines that stay on the screen, given that \\r goes back and ESC [ K erases."""
    lines = []
    for line in text.split("\n"):
        screen = ""
        for part in line.rstrip("\r").split("\r"):
            if part.startswith("\x1b[K"):
                screen = part[3:]
            elif part:
                screen = part + screen[len(part):]
        lines.append(screen)
    return lines


def main():
    args = harness.arguments(__doc__)
    failed = []
    with tempfile.TemporaryDirectory(prefix="stx-progress-") as folder:
        harness.must([args.stx, "convert", args.model, "-o", "m.exr", "--views", "sphere:8", "--size", "256x256",
                      "--quiet"], folder)
        # Long enough for a forecast on any machine: until there is one, more pictures.
        for count in (30, 120, 360):
            code, text = on_terminal([args.stx, "render", "m.exr", "-o", "n_%04d.png", "--orbit", str(count), "--size",
                                      "320x240", "--quality", "best", "--threads", "1"], folder)
            if re.search(r"rendering \d+/\d+, \d.* left", text):
                break
        else:
            failed.append(f"no time left is shown:\n{text[-300:]!r}")
        if code != 0:
            failed.append(f"exit code {code}")
        for line in shown(text):
            if "rendering" in line:
                failed.append(f"progress stays on the screen: {line!r}")
        if not any(line.startswith("m.exr → ") for line in shown(text)):
            failed.append(f"the result is not at the start of a line:\n{text[-300:]!r}")

        # The same with workers, which say things while another process shows the progress.
        for i in range(12):
            harness.write(os.path.join(folder, f"q{i}.obj"), harness.QUAD_OBJ + "f 1/1 1/1 2/2\n")
        harness.write(os.path.join(folder, "quad.mtl"), harness.QUAD_MTL)
        code, text = on_terminal([args.stx, "convert", *[f"q{i}.obj" for i in range(12)], "-o", "o_{stem}.exr", "--views",
                                  "sphere:8", "--size", "384x384"], folder)
        if code != 0:
            failed.append(f"exit code {code}: {text}")
        for line in shown(text):
            if re.search(r"inputs \d+/\d+", line):
                failed.append(f"progress stays on the screen: {line!r}")
    print("\n".join(failed))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
