#!/usr/bin/env python3
"""Nothing damaged passes for whole, and films go on where frames are lost; messages say what is wrong."""
import os
import shutil
import subprocess
import sys
import tempfile

import harness
import image_sets
from harness import must, run, write


class Test:
    def __init__(self, args, folder):
        self.stx, self.folder, self.wrong = args.stx, folder, []

    def expect(self, code, *words, says="", env=None, **options):
        done = run([self.stx, *words], self.folder, env=env, **options)
        text = done.err.decode("utf-8", "replace") + done.out.decode("utf-8", "replace")
        if done.code != code or says not in text:
            self.wrong.append(f"expected {code} and '{says}': {done}")
        return text

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def damaged_pictures(self):
        """In bundles: validate says 7, render 3."""
        ball = self.path("a.obj")
        convert = ["convert", ball, "--views", "ring:2", "--size", "96x96", "-o"]
        self.expect(0, *convert, "a.exr")
        self.expect(0, *convert, "a.mp4", "--colour", "jpeg")
        content = bytearray(open(self.path("a.exr"), "rb").read())
        content[-40:-8] = bytes(32)
        write(self.path("b.exr"), bytes(content))
        content = bytearray(open(self.path("a.mp4"), "rb").read())
        scan = content.index(b"\xff\xda")
        end = content.index(b"\xff\xd9", scan)
        content[(scan + end) // 2:end - 4] = bytes(end - 4 - (scan + end) // 2)
        write(self.path("b.mp4"), bytes(content))
        for name in ("b.exr", "b.mp4"):
            self.expect(7, "validate", name, says="damaged")
            self.expect(3, "render", name, "--view", "0", "-o", "a.png", says="damaged")
        self.expect(0, "render", "b.mp4", "--view", "0", "-o", "a.png", "--damaged", "keep",
                    says="and drawn as far as it goes")

    def lost_frames(self):
        """Of films whose frames are files with numbers, and of plain frames."""
        msr = image_sets.msr()
        for k in range(1, 4):
            msr.update({name.replace("f000", f"f00{k}"): content for name, content in image_sets.msr().items()
                        if "f000" in name})
        cases = {"whole": (), "damaged": [("cam0/depth-cam0-f002.png", b"?")], "missing": [("cam1/color-cam1-f001.png", None)],
                 "first": [("cam0/depth-cam0-f000.png", None)]}
        for name, changes in cases.items():
            for file, content in {**msr, **dict(changes)}.items():
                path = self.path(f"msr_{name}", file)
                os.makedirs(os.path.dirname(path), exist_ok=True)
                if content is not None:
                    write(path, content)
            convert = ["convert", f"msr_{name}", "--depth-range", "44,120", "-o", "a.mp4"]
            self.expect(0, *convert, says="4 frames over" if name == "whole" else "cannot be used")
            if changes:
                self.expect(3 if name == "damaged" else 2, *convert, "--strict", says="msr_")
        for k in range(4):
            write(self.path(f"f_{k}.png"), image_sets.COLOUR if k != 2 else b"\x89PNG\r\n\x1a\n?")
        self.expect(0, "background", "f_%d.png", "-o", "a.png", says="1 of 4 frames cannot be used")
        self.expect(3, "background", "f_%d.png", "-o", "a.png", "--strict", says="f_2.png")

    def two_writers(self):
        """Of one text with a folder of images: what is left is one of them, whole."""
        for _ in range(15):
            both = [subprocess.Popen([self.stx, "convert", "a.obj", "--views", f"ring:{views}", "--size", "16x16", "-o",
                                      "two.xmt", "--colour", colour], cwd=self.folder, stderr=subprocess.DEVNULL)
                    for views, colour in ((3, "png"), (2, "jpeg"))]
            for process in both:
                process.wait()
            self.expect(0, "validate", "two.xmt")

    def messages(self):
        self.expect(1, "info", "a.obj", env={**os.environ, "SOURCE_DATE_EPOCH": "abc"}, says="SOURCE_DATE_EPOCH is 'abc'")
        self.expect(0, "info", "a.obj", env={**os.environ, "SOURCE_DATE_EPOCH": ""})
        os.makedirs(self.path("links"), exist_ok=True)
        os.symlink("../target.mp4", self.path("links", "a.mp4"))
        self.expect(0, "convert", "a.obj", "--views", "ring:2", "--size", "24x24", "-o", "links/a.mp4")
        if not os.path.islink(self.path("links", "a.mp4")) or not os.path.exists(self.path("target.mp4")):
            self.wrong.append("a link to what is not there yet was replaced, not written through")
        os.symlink("loop.mp4", self.path("links", "loop.mp4"))
        self.expect(2, "convert", "a.obj", "--views", "ring:2", "--size", "24x24", "-o", "links/loop.mp4", says="symbolic links")
        for words in (["info", "-"], ["background", "-", "-o", "b.png"]):
            source = "a.mp4" if words[0] == "info" else "film.y4m"
            if words[0] == "background":
                seeds = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../fuzz/corpus/y4m/420jpeg.y4m")
                shutil.copyfile(seeds, self.path(source))
            with open(self.path(source), "rb") as stdin:
                done = subprocess.run([self.stx, *words], cwd=self.folder, input=stdin.read(), capture_output=True)
            if done.returncode != 0:
                self.wrong.append(f"{words}: {done.returncode} {done.stderr}")
        if os.geteuid() == 0:
            # Root may look everywhere.
            os.makedirs(self.path("closed"), mode=0o700)
            write(self.path("closed", "a.obj"), "v 0 0 0\n")
            os.chmod(self.folder, 0o755)
            done = subprocess.run([self.stx, "info", "closed/a.obj"], cwd=self.folder, capture_output=True, user=65534)
            if done.returncode != 2 or b"Permission denied" not in done.stderr:
                self.wrong.append(f"a folder that is closed: {done.returncode} {done.stderr}")


def main():
    args = harness.arguments(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        test = Test(args, folder)
        shutil.copyfile(args.model, test.path("a.obj"))
        for part in (test.damaged_pictures, test.lost_frames, test.two_writers, test.messages):
            part()
    print("\n".join(test.wrong))
    sys.exit(1 if test.wrong else 0)


if __name__ == "__main__":
    main()
