"""Small image sets of every kind that can be converted, for tests that damage them."""
import json
import os
import struct
import zlib

from harness import must, quad, write

WIDTH, HEIGHT = 16, 12


def png(channels, bits, value):
    """A PNG of 16x12 pixels; value(x, y) gives a number, or one for each channel."""
    rows = bytearray()
    for y in range(HEIGHT):
        rows.append(0)
        for x in range(WIDTH):
            v = value(x, y)
            for number in v if channels > 1 else (v,):
                rows += struct.pack(">H", number) if bits == 16 else bytes([number])

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", WIDTH, HEIGHT, bits, 2 if channels == 3 else 0, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(bytes(rows))) +
            chunk(b"IEND", b""))


COLOUR = png(3, 8, lambda x, y: (x * 15, y * 20, 90))
MILLIMETRES = png(1, 16, lambda x, y: 2000 + 40 * x + 30 * y)
CODES8 = png(1, 8, lambda x, y: 50 + 7 * x + 5 * y)
CODES16 = png(1, 16, lambda x, y: 20000 + 900 * x + 700 * y)
# A camera at the origin that looks along -z; one in the axes of computer vision.
GL_POSE = [[1, 0, 0, 0.1], [0, 1, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]]


def floats(value):
    return b"".join(struct.pack("<f", value(x, y)) for y in range(HEIGHT) for x in range(WIDTH))


def transforms():
    return {"transforms.json": json.dumps({
        "w": WIDTH, "h": HEIGHT, "fl_x": 20, "fl_y": 21, "cx": 8, "cy": 6, "k1": 0.01, "k2": 0, "p1": 0, "p2": 0,
        "frames": [{"file_path": f"images/{i}.png", "depth_file_path": f"depth/{i}.png", "transform_matrix": GL_POSE}
                   for i in range(2)]}),
            **{f"images/{i}.png": COLOUR for i in range(2)}, **{f"depth/{i}.png": MILLIMETRES for i in range(2)}}


def miv():
    def camera(name, rest):
        return {"Name": name, "Position": [1, 2, 3], "Rotation": [30, -20, 10], "Depth_range": [1, 20],
                "Resolution": [WIDTH, HEIGHT], "BitDepthColor": 8, "BitDepthDepth": 16, **rest}

    luma = bytes(16 + x + y for y in range(HEIGHT) for x in range(WIDTH))
    depth = struct.pack("<192H", *range(9000, 9000 + 100 * 192, 100))
    return {"list.json": json.dumps({"cameras": [
        camera("a", {"Projection": "Perspective", "Focal": [20, 21], "Principle_point": [8, 6]}),
        camera("b", {"Projection": "Orthographic", "Hor_range": [-4, 4], "Ver_range": [-2, 4]}),
        camera("c", {"Projection": "Equirectangular", "Hor_range": [-180, 180], "Ver_range": [-90, 90]})]}),
        "a_texture_16x12_yuv420p.yuv": luma + b"\x80" * 96, "a_depth_16x12_yuv420p16le.yuv": depth + b"\0" * 192,
        "b_color.png": COLOUR, "b_depth16.png": CODES16, "c_color.png": COLOUR, "c_depth16.png": CODES16}


def msr():
    camera = "{}\n20 0 8\n0 21 6\n0 0 1\n0\n0\n1 0 0 {}\n0 1 0 0\n0 0 1 0\n"
    return {"calibParams-test.txt": camera.format(0, 0) + camera.format(1, -0.5),
            **{f"cam{i}/color-cam{i}-f000.png": COLOUR for i in range(2)},
            **{f"cam{i}/depth-cam{i}-f000.png": CODES8 for i in range(2)}}


def colmap(binary):
    depth = b"16&12&1&" + floats(lambda x, y: 2 + 0.1 * x)
    files = {"images/a.png": COLOUR, "stereo/depth_maps/a.png.geometric.bin": depth}
    if binary:
        files["sparse/cameras.bin"] = struct.pack("<QIIQQ4d", 1, 1, 1, WIDTH, HEIGHT, 20, 21, 8, 6)
        files["sparse/images.bin"] = (struct.pack("<QI7dI", 1, 1, 1, 0, 0, 0, 0, 0, 0, 1) + b"a.png\0" +
                                      struct.pack("<QddQ", 1, 1, 2, 7))
    else:
        files["sparse/cameras.txt"] = "# cameras\n1 OPENCV 16 12 20 21 8 6 0.01 0 0 0\n"
        files["sparse/images.txt"] = "# images\n1 1 0 0 0 0 0 0 1 a.png\n1 2 7\n"
    return files


def middlebury():
    return {"calib.txt": "cam0=[20 0 8; 0 20 6; 0 0 1]\ncam1=[20 0 8; 0 20 6; 0 0 1]\ndoffs=0\nbaseline=0.2\n"
                         "width=16\nheight=12\nndisp=8\n",
            **{f"im{i}.png": COLOUR for i in range(2)},
            **{f"disp{i}.pfm": b"Pf\n16 12\n-1.0\n" + floats(lambda x, y: 1 + 0.1 * x) for i in range(2)}}


def tum():
    return {"rgb.txt": "# colour\n10.0 rgb/0.png\n11.0 rgb/1.png\n", "depth.txt": "10.01 depth/0.png\n11.01 depth/1.png\n",
            "groundtruth.txt": "# t tx ty tz qx qy qz qw\n" + "".join(f"{t} 0 0 {t / 50} 0 0 0 1\n"
                                                                     for t in (9.9, 10.0, 10.1, 11.0, 11.1)),
            "intrinsics.txt": "20 21 7.5 5.5\n", **{f"rgb/{i}.png": COLOUR for i in range(2)},
            **{f"depth/{i}.png": MILLIMETRES for i in range(2)}}


def seven_scenes():
    return {"frame-000000.color.png": COLOUR, "frame-000000.depth.png": MILLIMETRES,
            "frame-000000.pose.txt": "1 0 0 0.1\n0 1 0 0.2\n0 0 1 0.3\n0 0 0 1\n"}


def panorama():
    return {"picture.png": COLOUR, "depth.png": MILLIMETRES}


def cameras():
    return {"cameras.json": json.dumps({"cameras": [{
        "texture": "t.png", "depth": "d.png", "width": WIDTH, "height": HEIGHT, "position": [0, 0, 0],
        "orientation": [0, 1, 0, 0.2], "fx": 20, "fy": 21, "cx": 8, "cy": 6, "nearPlane": 0.1, "farPlane": 40}]}),
        "t.png": COLOUR, "d.png": CODES16}


def write_all(folder, stx):
    """Makes a set of each kind below `folder`; gives {kind: (its folder, options of convert)}."""
    sets = {"transforms": (transforms(), []), "miv": (miv(), []), "msr": (msr(), ["--depth-range", "44,120"]),
            "colmap": (colmap(False), []), "colmap-binary": (colmap(True), []), "middlebury": (middlebury(), []),
            "tum": (tum(), []), "7scenes": (seven_scenes(), ["--intrinsics", "20,21,7.5,5.5"]),
            "panorama": (panorama(), []), "cameras": (cameras(), []), "exr": ({}, [])}
    made = {}
    for kind, (files, options) in sets.items():
        root = os.path.join(folder, kind)
        os.makedirs(root)
        for name, content in files.items():
            os.makedirs(os.path.dirname(os.path.join(root, name)), exist_ok=True)
            write(os.path.join(root, name), content)
        made[kind] = (root, options)
    model = quad(folder)
    must([stx, "render", model, "-o", os.path.join(made["exr"][0], "shot.exr"), "--size", "16x12"], folder)
    return made
