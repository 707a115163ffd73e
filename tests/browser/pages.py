"""Pages of the viewer in a browser, for tests."""
import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../cli"))

from harness import must, run  # noqa: E402,F401

# Where `npm ci` in this folder puts what package.json names.
NODE_MODULES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "node_modules")
READY = "typeof viewer === 'object' && document.getElementById('message').textContent === ''"


def show(browser, path, fragment):
    """Opens a page with a camera, and waits until it is drawn."""
    browser.open(f"file://{path}#{fragment}")
    said = "(document.getElementById('message') || {textContent: ''}).textContent"
    browser.until(f"({READY}) || {said}.startsWith('The page cannot')")
    if not browser.ask(READY):
        raise RuntimeError(browser.ask(said))


def drawn(browser):
    """Waits for what was asked to be drawn, at rest."""
    browser.until("!viewer.waiting && !viewer.quick")


def psnr(stx, a, b, folder):
    """dB; what is the same to the bit has 99."""
    done = run([stx, "compare", a, b, "--format", "json"], folder)
    value = json.loads(done.out)["psnr"]["rgb"]
    return 99.0 if value is None else value
