#!/usr/bin/env python3
"""The scripts of the viewer are JavaScript that node understands, its PNG reader reads every filter, and bytes
that are written as text come back."""
import glob
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def png(width, height, kind, bits, rows):
    """A PNG whose row k has filter k % 5; `rows` are lists of bytes."""
    each = {0: 1, 2: 3, 6: 4}[kind] * bits // 8
    data, before = b"", [0] * len(rows[0])
    for number, row in enumerate(rows):
        filtered = []
        for i, value in enumerate(row):
            a, b, c = row[i - each] if i >= each else 0, before[i], before[i - each] if i >= each else 0
            p = a + b - c
            nearest = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            filtered.append((value - [0, a, b, (a + b) // 2, nearest][number % 5]) % 256)
        data += bytes([number % 5] + filtered)
        before = row
    packed = zlib.compress(data)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)) +
            chunk(b"IDAT", packed[:20]) + chunk(b"IDAT", packed[20:]) + chunk(b"IEND", b""))


def text_of(data):
    """Bytes as two of 46341 characters for each 31 bits, their number first (formats/viewer/page_text.hpp)."""
    number, values = int.from_bytes(data, "little"), [len(data)]
    for at in range(0, 8 * len(data), 31):
        values.append(number >> at & (1 << 31) - 1)
    return "".join(chr(0x2100 + value % 46341) + chr(0x2100 + value // 46341) for value in values)


def node_run(node, folder, scripts, code, *args):
    """The words that code prints which follows scripts of the viewer, in a page of {id: text}, and errors."""
    page = "const texts = {}, document = {getElementById: (id) => ({textContent: texts[id] || ''})};"
    script = page + "".join(open(os.path.join(folder, name), encoding="utf-8").read() for name in scripts) + code
    done = subprocess.run([node, "-e", script, *args], capture_output=True, text=True)
    return done.stdout.split(), done.stderr[-300:]


# A viewer without a page, and a clock and pictures that come when they are asked for.
VIEWER = """
    let clock = 0, loaded;
    const waiting = [], elements = {};
    Object.defineProperty(globalThis, "performance", {value: {now: () => clock}});
    globalThis.requestAnimationFrame = (act) => waiting.push(act);
    document.getElementById = (id) => elements[id] = elements[id] || {setAttribute() {}};
    const turn = () => new Promise((done) => setImmediate(done));
    const next = async () => { for (const act of waiting.splice(0)) act(clock); await turn(); };
    const viewer = Object.create(Viewer.prototype);
    Object.assign(viewer, {writeAddress() {}, frame: 0, shown: [], data: {
        frames: Array(100).fill([0]), times: [...Array(100).keys()].map((i) => i / 10), end: 10, slack: 1e-6}});
"""


def viewer_failures(node, folder):
    """How many of what viewer.js does by itself is wrong."""
    with tempfile.TemporaryDirectory() as top:
        for name in ("camera.js", "viewer.js"):
            with open(os.path.join(folder, name), encoding="utf-8") as file, open(os.path.join(top, name), "w", encoding="utf-8") as out:
                out.write(file.read().split("// The panel comes packed")[0])
        failed = 0
        for what, code, wanted in (
                # While a picture is loaded the film is stopped, and begun again.
                ("a run that waits ends when the film is stopped", """
                 viewer.showFrame = (frame) => (viewer.frame = frame, new Promise((done) => loaded = done));
                 (async () => {
                     viewer.play(true);
                     clock = 500;
                     await next();
                     viewer.play(false);
                     viewer.play(true);
                     loaded();
                     await turn();
                     await next();
                     console.log(viewer.frame, waiting.length);
                 })();""", ["5", "1"]),
                ("a frame without scenes is drawn", """
                 Object.assign(viewer, {painter: {gl: {isContextLost: () => false}}});
                 viewer.data.frames = [[]];
                 viewer.showFrame(0).then(() => console.log(viewer.shown.length, waiting.length));""", ["0", "1"]),
                # Of views that look away from the middle, along the axes, and at it.
                ("a view that looks away from the middle has a target as far as the object is large", """
                 Object.assign(viewer, {redraw() {}, camera: {}});
                 viewer.data.start = {centre: [0, 0, 5], radius: 2};
                 for (const position of [[0, 0, 0], [0, 0, 5], [0, 0, 9]]) {
                     viewer.data.cameras = [{name: "a", position, orientation: [1, 0, 0, 0], width: 8, height: 8, fy: 4}];
                     viewer.fromView("0");
                     console.log(lengthOf(minus(viewer.camera.target, viewer.camera.eye)));
                 }""", ["2", "2", "4"])):
            found, said = node_run(node, top, ("camera.js", "viewer.js"), VIEWER + code)
            if found != wanted:
                failed += 1
                print(f"FAILED: {what}: {found} {said}")
    return failed


def main():
    node = shutil.which("node")
    if not node:
        print("SKIP: node is not installed")
        return 77
    folder = os.path.join(sys.argv[1], "formats/viewer")
    failed = 0
    for script in sorted(glob.glob(os.path.join(folder, "*.js"))):
        done = subprocess.run([node, "--check", script], capture_output=True, text=True)
        if done.returncode:
            failed += 1
            print(done.stderr)
    with tempfile.TemporaryDirectory() as top:
        for kind, bits in ((0, 8), (0, 16), (2, 8), (6, 8)):
            width, height, channels = 7, 11, {0: 1, 2: 3, 6: 4}[kind]
            rows = [[(31 * x * x + 57 * y + x * y * 3) % 256 for x in range(width * channels * bits // 8)] for y in range(height)]
            with open(os.path.join(top, "a.png"), "wb") as file:
                file.write(png(width, height, kind, bits, rows))
            flat = [v for row in rows for v in row]
            wanted = flat if bits == 8 else [256 * a + b for a, b in zip(flat[::2], flat[1::2])]
            found, said = node_run(
                node, folder, ("unpack.js", "png.js"), "decodePng(new Uint8Array(require('fs').readFileSync(process.argv[1])))"
                ".then(p => console.log([p.width, p.height, p.channels, ...p.values].join(' ')))", os.path.join(top, "a.png"))
            if found != [str(v) for v in [width, height, channels] + wanted]:
                failed += 1
                print(f"FAILED: a PNG of kind {kind} with {bits} bits is read as {found[:20]} {said}")
    # Each length leaves another number of bits for the last characters.
    lists = [bytes((x * x * 31 + x * 57 + n) % 256 for x in range(n)) for n in range(40)] + [b"\0" * 13, b"\xff" * 13]
    texts = {f"a{k}": text_of(data) for k, data in enumerate(lists)}
    found, said = node_run(
        node, folder, ("unpack.js",), f"Object.assign(texts, {json.dumps(texts)});"
        "for (const id of Object.keys(texts)) console.log(Buffer.from(bytesOf(id)).toString('hex') || '-')")
    if found != [data.hex() or "-" for data in lists]:
        failed += 1
        print(f"FAILED: bytes are read from text as {found[:10]} {said}")
    # An arm of length 2 that is turned by 30 degrees, and how far it may be.
    found, said = node_run(
        node, folder, ("camera.js",), "for (const most of [0.1, 1]) { const arm = armWithin([1, 0, Math.sqrt(3)], [0, 0, 5], most);"
        "console.log(lengthOf(arm).toFixed(6), Math.atan2(arm[0], arm[2]).toFixed(6)); }")
    if found != ["2.000000", "0.100000", "2.000000", "0.523599"]:
        failed += 1
        print(f"FAILED: a view is turned within its bounds as {found} {said}")
    # Background, a column that glass covers a third of, glass of alpha 60 up to column 15, opaque: tests/unit/render/glass_pages_test.cpp.
    # With glass up to column 6 only it is an outline.
    for last, wanted in ((15, [0] * 3 + [85] + [255] * 12 + [0] * 8), (6, ["null"])):
        alpha = [[0 if x < 3 else 20 if x == 3 else 60 if x <= last else 255 for x in range(24)] for y in range(24)]
        found, said = node_run(
            node, folder, ("scene.js",), f"const side = {{width: 24, height: 24}}, alpha = {json.dumps(sum(alpha, []))};"
            "const found = glassCoverage({...side, values: alpha.flatMap((a) => [0, 0, 0, a])}, {...side, values: alpha});"
            "console.log(found ? [...found.values].join(' ') : null)")
        if found != [str(v) for v in wanted] * (24 if found != ["null"] else 1):
            failed += 1
            print(f"FAILED: glass up to column {last} covers {found} {said}")
    failed += viewer_failures(node, folder)
    print(f"{failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
