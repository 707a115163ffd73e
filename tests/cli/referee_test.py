#!/usr/bin/env python3
"""Round trips through another implementation of MPEG-4: what it makes of our texts draws the same pictures.

MPEG4_REFEREE names its program, which takes the options of MP4Box: `-mp4 IN.bt -out OUT.mp4` encodes a text,
`-bt IN.mp4 -out OUT.bt` and `-xmt` decode, `-info` lists.
"""
import os
import re
import subprocess
import sys
import tempfile

import harness


def moving(text):
    """A text whose first camera moves: its node is replaced again and again, as films are written here."""
    head, name, body = re.search(r"^( *DEF (\w+) DepthImage \{\n)(.*?)^  \}\n", text, re.S | re.M).groups()
    text = text.replace(head + body, head + body.replace("diTexture SimpleTexture", "diTexture DEF T SimpleTexture"), 1)
    rest = re.sub(r"^ *diTexture .*?^   \}\n", "", body, flags=re.S | re.M)
    for k in (1, 2, 3):
        moved = re.sub(r"position (\S+)", lambda m: f"position {float(m[1]) + 0.125 * k}", rest)
        text += f"AT {1000 * k} {{ REPLACE {name} BY DEF {name} DepthImage {{ diTexture USE T {moved} }} }}\n"
    return text


def main():
    args = harness.arguments(__doc__)
    referee = os.environ.get("MPEG4_REFEREE")
    if not referee:
        print("SKIPPED: MPEG4_REFEREE names no program of another implementation")
        return 77
    failed = []

    def other(*words):
        done = subprocess.run([referee, *words], cwd=folder, capture_output=True, text=True, timeout=120)
        said = done.stdout + done.stderr
        if done.returncode != 0 or re.search(r"\b(warning|error)\b", said, re.I):
            failed.append(f"{' '.join(words)}: exit code {done.returncode}\n{said[-600:]}")
        return done.returncode == 0

    def pictures(of, to, *options):
        harness.must([args.stx, "render", of, "-o", to, "--quiet", *options], folder)
        stem, ending = os.path.splitext(to)
        names = [n for n in sorted(os.listdir(folder)) if re.fullmatch(re.escape(stem.split("%")[0]) + r"\d*" + ending, n)]
        return [open(os.path.join(folder, n), "rb").read() for n in names]

    def same(what, a, b):
        if not a or a != b:
            failed.append(f"{what}: {len(a)} pictures are not the same as {len(b)}")

    # From where no camera that moves takes the picture with it.
    from_outside = ["--eye", "1,2,5", "--target", "0,0,0", "--size", "64x64", "--times", "all"]
    with tempfile.TemporaryDirectory(prefix="stx-referee-") as folder:
        convert = lambda *words: harness.must([args.stx, "convert", *words, "--quiet"], folder)
        convert(args.model, "-o", "still.mp4", "--views", "ring:3", "--size", "64x64")
        truth = pictures("still.mp4", "truth.png", "--view", "0")
        other("-info", "still.mp4")
        for text in ("still.bt", "still.xmt"):
            convert("still.mp4", "-o", text)
            if other("-mp4", text, "-out", "back.mp4"):
                same(text, pictures("back.mp4", "back.png", "--view", "0"), truth)
        with open(os.path.join(folder, "still.bt"), encoding="utf-8") as file:
            harness.write(os.path.join(folder, "by_hand.bt"), moving(file.read()))
        convert("by_hand.bt", "-o", "film.mp4")
        film = pictures("film.mp4", "film_%d.png", *from_outside)
        if len(film) != 4 or len(set(film)) != 4:
            failed.append(f"the film has {len(film)} pictures, {len(set(film))} different ones; 4 are expected")
        for text in ("film.bt", "film.xmt"):
            convert("film.mp4", "-o", text)
            if other("-mp4", text, "-out", "moved.mp4"):
                same(text, pictures("moved.mp4", "moved_%d.png", *from_outside), film)
        for option in ("-bt", "-xmt"):
            dump = "dump." + option[1:]
            if other(option, "film.mp4", "-out", dump):
                # It has names of files that are not there; commands and nodes are what is asked for.
                text = open(os.path.join(folder, dump), encoding="utf-8").read()
                found = len(re.findall("DepthImage(?= *[{>]| [^{]*>)", text))
                if found < 6:
                    failed.append(f"{dump} has {found} DepthImages; 3 views and 3 that replace one are expected")
    for text in failed:
        print("FAILED:", text)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
