#!/usr/bin/env python3
"""The examples of tools/python/README.md run, in order."""
import contextlib
import io
import os
import pathlib
import re
import shutil
import unittest

from harness import MODEL, Case

PAGE = pathlib.Path(__file__).resolve().parents[2] / "tools/python/README.md"


class Examples(Case):
    def test_they_run(self):
        for name in (MODEL, MODEL.replace(".obj", ".mtl")):
            shutil.copy(name, ".")
        for name in pathlib.Path(MODEL).parent.glob("amphora*.png"):
            shutil.copy(name, ".")
        blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
        self.assertGreaterEqual(len(blocks), 5)
        names = {}
        with contextlib.redirect_stdout(io.StringIO()) as out:
            for block in blocks:
                exec(compile(block, str(PAGE), "exec"), names)
        self.assertIn("io | ", out.getvalue())
        for name in ("atlas/atlas.json", "novel.png", "orbit_0011.png", "half.mp4", "film.mp4"):
            self.assertTrue(os.path.exists(name), name)


if __name__ == "__main__":
    unittest.main()
