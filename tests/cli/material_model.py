#!/usr/bin/env python3
"""A cube whose material has metallic-roughness and emissive maps; and what an atlas must hold of them.

    material_model.py make FILE.gltf [apart]
    material_model.py check ATLAS

The maps are of 4 x 4 texels without interpolation, so each pixel of the atlas is one of their texels. With "apart"
each map reaches the same texels by coordinates of its own: another set, or a transform.
"""
import base64
import json
import math
import os
import struct
import sys
import zlib

# R is not read; roughness is 0.5 * G, metallic B.
SURFACE = [(9 * i, 15 * i + 15, 255 - 16 * i) for i in range(16)]
# A texel of three gives off light, three times of what its code says.
GLOW = [(250, 16 * i, 10) if i % 3 == 0 else (0, 0, 0) for i in range(16)]


def png(texels):
    rows = b"".join(b"\0" + bytes(sum(texels[4 * y:4 * y + 4], ())) for y in range(4))

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 4, 4, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def pixels(path):
    """Width, height, RGB triples of an 8-bit RGB PNG (PNG specification, clause 9)."""
    data = open(path, "rb").read()
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", body[:10])
            assert (bits, colour) == (8, 2), (bits, colour)
        if kind == b"IDAT":
            packed += body
        at += 12 + size
    raw, stride, above, rows = zlib.decompress(packed), 3 * width, bytearray(3 * width), []
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for x in range(stride):
            left = row[x - 3] if x >= 3 else 0
            corner = above[x - 3] if x >= 3 else 0
            guess = left + above[x] - corner
            near = min((abs(guess - left), 0, left), (abs(guess - above[x]), 1, above[x]),
                       (abs(guess - corner), 2, corner))[2]
            row[x] = row[x] + (0, left, above[x], (left + above[x]) // 2, near)[kind] & 255
        rows.append([tuple(row[x:x + 3]) for x in range(0, stride, 3)])
        above = row
    return width, height, [p for row in rows for p in row]


def make(path, apart=False):
    positions, uvs, indices = [], [], []
    for axis in range(3):
        for side in (-1, 1):
            u, v = [0, 0, 0], [0, 0, 0]
            u[(axis + 1) % 3], v[(axis + 2) % 3] = side, 1
            first = len(positions)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                corner = [a * u[k] + b * v[k] for k in range(3)]
                corner[axis] = side
                positions.append(corner)
                uvs.append(((a + 1) / 2, (b + 1) / 2))
            indices += [first, first + 1, first + 2, first, first + 2, first + 3]
    buffer = b"".join(struct.pack("<3f", *p) for p in positions)
    buffer += b"".join(struct.pack("<2f", *p) for p in uvs) + struct.pack("<%dH" % len(indices), *indices)
    uri = lambda kind, data: f"data:{kind};base64," + base64.b64encode(data).decode()
    model = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2,
                                    "material": 0}]}],
        "buffers": [{"byteLength": len(buffer), "uri": uri("application/octet-stream", buffer)}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 288},
                        {"buffer": 0, "byteOffset": 288, "byteLength": 192},
                        {"buffer": 0, "byteOffset": 480, "byteLength": 72}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 24,
                       "min": [-1, -1, -1], "max": [1, 1, 1]},
                      {"bufferView": 1, "componentType": 5126, "type": "VEC2", "count": 24},
                      {"bufferView": 2, "componentType": 5123, "type": "SCALAR", "count": 36}],
        "images": [{"uri": uri("image/png", png(SURFACE))}, {"uri": uri("image/png", png(GLOW))}],
        "samplers": [{"magFilter": 9728, "minFilter": 9728}],
        "textures": [{"source": 0, "sampler": 0}, {"source": 1, "sampler": 0}],
        "extensionsUsed": ["KHR_materials_emissive_strength"],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.5, 0.8, 1], "roughnessFactor": 0.5,
                                                "metallicRoughnessTexture": {"index": 0}},
                       "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 1},
                       "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3}}}]}
    if apart:
        # A white base colour at TEXCOORD_0 three times as large; TEXCOORD_1 is (1 - v, u) / 2, and a turn by 90
        # degrees makes (u, v) of it: v' = v, u' = u (KHR_texture_transform, "rotation").
        material = model["materials"][0]
        start = len(buffer)
        buffer += b"".join(struct.pack("<2f", (1 - v) / 2, u / 2) for u, v in uvs)
        model["buffers"][0] = {"byteLength": len(buffer), "uri": uri("application/octet-stream", buffer)}
        model["bufferViews"].append({"buffer": 0, "byteOffset": start, "byteLength": 192})
        model["accessors"].append({"bufferView": 3, "componentType": 5126, "type": "VEC2", "count": 24})
        model["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = 3
        model["images"].append({"uri": uri("image/png", png([(255, 255, 255)] * 16))})
        model["textures"].append({"source": 2})
        model["extensionsUsed"].append("KHR_texture_transform")
        material["pbrMetallicRoughness"]["baseColorTexture"] = {
            "index": 2, "extensions": {"KHR_texture_transform": {"scale": [3, 3]}}}
        material["pbrMetallicRoughness"]["metallicRoughnessTexture"].update(
            texCoord=1, extensions={"KHR_texture_transform": {"scale": [2, 2], "rotation": math.pi / 2, "offset": [0, 1]}})
    json.dump(model, open(path, "w"))


def check(atlas):
    index = json.load(open(os.path.join(atlas, "atlas.json")))
    textures = {t["attribute"]: t for t in index["textures"]}
    width, height, surface = pixels(os.path.join(atlas, textures["metallic_roughness"]["file"]))
    assert (width, height) == (index["width"], index["height"])
    _, _, glow = pixels(os.path.join(atlas, textures["emissive"]["file"]))
    scale = textures["emissive"]["scale"]
    linear = lambda c: c / 255 / 12.92 if c <= 10 else ((c / 255 + 0.055) / 1.055) ** 2.4
    found = set()
    for s, g in zip(surface, glow):
        if s == (0, 0, 0):
            assert g == (0, 0, 0), g
            continue
        near = [i for i, texel in enumerate(SURFACE)
                if abs(0.5 * texel[1] - s[1]) <= 0.51 and texel[2] == s[2]]
        assert s[0] == 255 and len(near) == 1, s
        found.add(near[0])
        # To half a code of what the image says.
        for c in range(3):
            light = 3 * linear(GLOW[near[0]][c]) / scale
            assert linear(max(0, g[c] - 0.51)) <= light <= linear(g[c] + 0.51), (near, g, light)
    print(f"{len(found)} of 16 texels seen, light up to {scale:.4f}")


if __name__ == "__main__":
    {"make": make, "check": check}[sys.argv[1]](*sys.argv[2:])
