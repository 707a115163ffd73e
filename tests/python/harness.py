"""What the tests of the Python module share. CTest gives the module, the program and the sample model by PYTHONPATH,
STX_PROGRAM and STX_MODEL; without the module or numpy a test skips (77)."""
import glob
import os
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy as np
except ImportError:
    print("SKIPPED: numpy is not here (python3-numpy)")
    sys.exit(77)
try:
    import stx
except ImportError as why:
    if glob.glob(os.path.join(os.environ.get("PYTHONPATH", ""), "stx", "_stx*.so")):
        raise
    print(f"SKIPPED: the Python module was not built, for which pybind11-dev and python3-dev are needed ({why})")
    sys.exit(77)

PROGRAM = os.environ["STX_PROGRAM"]
MODEL = os.environ["STX_MODEL"]


def run(*command):
    """Runs the program, which must succeed."""
    done = subprocess.run([PROGRAM, *map(str, command), "--quiet"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise AssertionError(f"stx {' '.join(map(str, command))} ended with {done.returncode}:\n{done.stdout}")


def read(path):
    with open(path, "rb") as file:
        return file.read()


class Case(unittest.TestCase):
    """A test in a folder of its own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="stx-python-")
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)

    def fails(self, code, text, call, *arguments, **keywords):
        """What a call raises: stx.Error of a code, whose sentence has the text in it."""
        with self.assertRaises(stx.Error) as caught:
            call(*arguments, **keywords)
        self.assertEqual(caught.exception.code, stx.ErrorCode[code])
        self.assertIn(text, str(caught.exception))
        return caught.exception


def plate(camera, depth=2.0, colour=(200, 100, 50)):
    """A view of a plate that fills the picture."""
    pixels = np.empty((camera.height, camera.width, 3), np.uint8)
    pixels[:] = colour
    return stx.View(pixels, np.full(pixels.shape[:2], depth, np.float32), camera)
