#!/usr/bin/env python3
"""The scripts of the viewer are JavaScript that node understands, and its PNG reader reads every filter."""
import glob
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
            script = (open(os.path.join(folder, "png.js"), encoding="utf-8").read() +
                      "decodePng(new Uint8Array(require('fs').readFileSync(process.argv[1]))).then(p => console.log("
                      "[p.width, p.height, p.channels, ...p.values].join(' ')))")
            done = subprocess.run([node, "-e", script, os.path.join(top, "a.png")], capture_output=True, text=True)
            if done.stdout.split() != [str(v) for v in [width, height, channels] + wanted]:
                failed += 1
                print(f"FAILED: a PNG of kind {kind} with {bits} bits is read as {done.stdout[:80]} {done.stderr[-300:]}")
    print(f"{failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
