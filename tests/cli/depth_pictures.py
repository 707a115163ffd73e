"""Pictures of integer depth of many kinds, and of each a set with one picture, in this folder."""
import json
import os
import struct
import zlib

w, h = 64, 48
d = [500 + x + y * w // 4 for y in range(h) for x in range(w)]
def pgm(name, largest, values):
    open(name, "wb").write(b"P5 %d %d %d\n" % (w, h, largest) + struct.pack(f">{w * h}H", *values))
def tiff(name, bits, kind, pixels):
    tags = [(256, w), (257, h), (258, bits), (259, 1), (262, 1), (273, 8), (277, 1), (278, h), (279, len(pixels)), (339, kind)]
    entries = b"".join(struct.pack("<HHII", t, 4 if t in (273, 279) else 3, 1, v) for t, v in tags)
    open(name, "wb").write(b"II*\0" + struct.pack("<I", 8 + len(pixels)) + pixels + struct.pack("<H", len(tags)) + entries + bytes(4))
def png(name, bits, rows):
    chunk = lambda kind, b: struct.pack(">I", len(b)) + kind + b + struct.pack(">I", zlib.crc32(kind + b))
    open(name, "wb").write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", w, h, bits, 0, 0, 0, 0)) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
pgm("whole.pgm", 65535, d)
pgm("less.pgm", 30000, d)
tiff("int16.tif", 16, 2, struct.pack(f"<{w * h}h", *d))
tiff("int32.tif", 32, 2, struct.pack(f"<{w * h}i", *d))
tiff("uint32.tif", 32, 1, struct.pack(f"<{w * h}I", *d))
bits = "".join(f"{v:012b}" for v in d)
tiff("twelve.tif", 12, 1, bytes(int(bits[i:i + 8], 2) for i in range(0, len(bits), 8)))
tiff("far.tif", 32, 2, struct.pack(f"<{w * h}i", *[70000] * (w * h)))
tiff("minus.tif", 16, 2, struct.pack(f"<{w * h}h", *[-1] * (w * h)))
few = [1 + (x + y) % 15 for y in range(h) for x in range(w)]
pgm("few.pgm", 65535, few)
png("few.png", 4, b"".join(b"\0" + bytes(few[y * w + x] << 4 | few[y * w + x + 1] for x in range(0, w, 2)) for y in range(h)))
eye = [[float(i == j) for j in range(4)] for i in range(4)]
for name in ("whole.pgm", "less.pgm", "int16.tif", "int32.tif", "uint32.tif", "twelve.tif", "far.tif", "minus.tif"):
    frame = {"file_path": "../a.ppm", "depth_file_path": "../" + name, "transform_matrix": eye}
    os.mkdir(name + ".set")
    json.dump({"fl_x": 60, "fl_y": 60, "w": w, "h": h, "depth_unit_scale_factor": 0.001, "stx:title": "t", "frames": [frame]}, open(name + ".set/transforms.json", "w"))
