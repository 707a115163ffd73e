#!/usr/bin/env python3
"""Pictures of a camera that turns, cut out of an equirectangular picture, with everything known.

  panorama_series.py OUT [--sphere FILE] [--size 384x512] [--focal 480] [--k1 -0.05] [--turn 18]
                     [--rows 0] [--roll 0] [--gains] [--shuffle] [--jpeg 95]

Writes OUT/view_NN.jpg and OUT/truth.json: for each picture `rotation`, the quaternion w x y z that turns
the camera's axes (it looks along -Z, +Y up) into the world's, `focalPixels` and `k1`, and OUT/sphere.png
when there is no --sphere: discs of all sizes. Needs numpy and OpenCV (Debian: python3-opencv).
"""
import argparse
import json
import math
import os
import random

import cv2
import numpy as np


def painted_sphere(width, seed=1):
    """Soft noise of several sizes and discs of all sizes and colours on a sphere, 2 N x N, BGR."""
    rng = np.random.default_rng(seed)
    height = width // 2
    longitude = (np.arange(width) + 0.5) / width * 2 * np.pi - np.pi
    latitude = np.pi / 2 - (np.arange(height) + 0.5) / height * np.pi
    rays = np.stack([np.cos(latitude)[:, None] * np.sin(longitude)[None],
                     np.repeat(np.sin(latitude)[:, None], width, 1),
                     -np.cos(latitude)[:, None] * np.cos(longitude)[None]], -1).astype(np.float32)
    out = np.full((height, width, 3), 110, np.float32)
    for _ in range(4000):
        z = rng.uniform(-1, 1)
        turn = rng.uniform(0, 2 * np.pi)
        middle = np.array([math.sqrt(1 - z * z) * math.sin(turn), z, -math.sqrt(1 - z * z) * math.cos(turn)])
        radius = 0.006 * 14 ** (rng.uniform() * rng.uniform())
        row = (0.5 - math.asin(z) / np.pi) * height
        reach = (radius / np.pi + 3 / height) * height
        top, bottom = max(0, int(row - reach)), min(height, int(row + reach) + 1)
        level = math.sqrt(1 - z * z)
        wide = width // 2 if level < 4 * radius else int(reach / level * 1.5) + 2
        columns = (np.arange(int((turn / (2 * np.pi) + 0.5) * width) - wide,
                             int((turn / (2 * np.pi) + 0.5) * width) + wide) % width)
        if len(columns) > width:
            columns = np.arange(width)
        part = rays[top:bottom][:, columns]
        angle = 2 * np.arcsin(np.clip(np.linalg.norm(part - middle.astype(np.float32), axis=-1) / 2, 0, 1))
        inside = np.clip((radius - angle) / (4 * np.pi / width) + 0.5, 0, 1)[..., None]
        colour = rng.uniform(0, 255, 3)
        patch = out[top:bottom][:, columns]
        out[top:bottom, columns] = patch + (colour - patch) * inside
    return np.clip(out + 0.5, 0, 255).astype(np.uint8)


def matrix_of(yaw, pitch, roll):
    """worldFromCamera: to the left by yaw, up by pitch, roll counter-clockwise (radians)."""
    cy, sy, cp, sp, cr, sr = (f(a) for a in (yaw, pitch, roll) for f in (math.cos, math.sin))
    return (np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]) @
            np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]]) @
            np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]]))


def quaternion_of(m):
    w = math.sqrt(max(0, 1 + m[0, 0] + m[1, 1] + m[2, 2])) / 2
    if w > 1e-3:
        return [w, (m[2, 1] - m[1, 2]) / (4 * w), (m[0, 2] - m[2, 0]) / (4 * w), (m[1, 0] - m[0, 1]) / (4 * w)]
    values, vectors = np.linalg.eigh(m + m.T)
    x, y, z = vectors[:, 2]
    return [0.0, x, y, z]


def rays_of(size, focal, k1):
    """Camera-space rays of the pixels: OpenCV's first radial coefficient, the axis in the middle."""
    width, height = size
    x, y = np.meshgrid((np.arange(width) + 0.5 - width / 2) / focal, (height / 2 - np.arange(height) - 0.5) / focal)
    seen = np.hypot(x, y)
    r = seen.copy()
    for _ in range(30):
        r -= (r * (1 + k1 * r * r) - seen) / (1 + 3 * k1 * r * r)
    scale = np.where(seen > 0, r / np.maximum(seen, 1e-12), 1)
    return np.stack([x * scale, y * scale, -np.ones_like(x)], -1)


def seen_in(sphere, directions):
    """The equirectangular picture in these directions (any length)."""
    height, width = sphere.shape[:2]
    longitude = np.arctan2(directions[..., 0], -directions[..., 2])
    latitude = np.arctan2(directions[..., 1], np.hypot(directions[..., 0], directions[..., 2]))
    x = (longitude / np.pi + 1) * width / 2 - 0.5
    y = (0.5 - latitude / np.pi) * height - 0.5
    edge = 4
    around = np.concatenate([sphere[:, -edge:], sphere, sphere[:, :edge]], 1)
    return cv2.remap(around, (x + edge).astype(np.float32), y.astype(np.float32), cv2.INTER_CUBIC,
                     borderMode=cv2.BORDER_REPLICATE)


def write_series(folder, sphere, size, focal, k1, turns, gains=None, shuffle=False, jpeg=95, ending="jpg"):
    """turns: (yaw, pitch, roll) in degrees of each picture."""
    os.makedirs(folder, exist_ok=True)
    rays = rays_of(size, focal, k1)
    order = list(range(len(turns)))
    if shuffle:
        random.Random(7).shuffle(order)
    pictures = [None] * len(turns)
    for k, turn in enumerate(turns):
        world = matrix_of(*(math.radians(t) for t in turn))
        picture = seen_in(sphere, rays @ world.T)
        if gains is not None:
            picture = np.clip((picture / 255.0) ** 2.2 * gains[k], 0, 1) ** (1 / 2.2) * 255 + 0.5
            picture = picture.astype(np.uint8)
        name = f"view_{order[k]:02d}.{ending}"
        cv2.imwrite(os.path.join(folder, name), picture, [cv2.IMWRITE_JPEG_QUALITY, jpeg])
        pictures[order[k]] = {"name": name, "rotation": quaternion_of(world)}
    truth = {"focalPixels": focal, "k1": k1, "width": size[0], "height": size[1], "pictures": pictures}
    with open(os.path.join(folder, "truth.json"), "w", encoding="utf-8") as file:
        json.dump(truth, file, indent=1)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--sphere")
    parser.add_argument("--sphere-width", type=int, default=4096)
    parser.add_argument("--size", default="384x512")
    parser.add_argument("--focal", type=float, default=480)
    parser.add_argument("--k1", type=float, default=-0.05)
    parser.add_argument("--turn", type=int, default=18, help="pictures of a full turn")
    parser.add_argument("--part", type=float, default=360, help="degrees that they span")
    parser.add_argument("--rows", default="0", help="pitches of the rows, degrees")
    parser.add_argument("--roll", type=float, default=0)
    parser.add_argument("--gains", action="store_true")
    parser.add_argument("--shuffle", action="store_true")
    parser.add_argument("--jpeg", type=int, default=95)
    o = parser.parse_args()
    os.makedirs(o.out, exist_ok=True)
    if o.sphere:
        sphere = cv2.imread(o.sphere)
    else:
        sphere = painted_sphere(o.sphere_width)
        cv2.imwrite(os.path.join(o.out, "sphere.png"), sphere)
    size = tuple(int(n) for n in o.size.split("x"))
    turns = [(o.part * k / o.turn, float(row), o.roll) for row in o.rows.split(",") for k in range(o.turn)]
    gains = [1 - 0.4 * (k * 5 % 7) / 7 for k in range(len(turns))] if o.gains else None
    write_series(o.out, sphere, size, o.focal, o.k1, turns, gains, o.shuffle, o.jpeg)


if __name__ == "__main__":
    main()
