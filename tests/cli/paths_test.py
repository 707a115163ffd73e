#!/usr/bin/env python3
"""Names inside files reach nothing outside the folder of the file.

A secret lies outside; scenes, models and atlases name it by an absolute path, `..`, links and URLs,
and name devices and FIFOs. No output of any command may hold the secret's bytes or its picture, and
no command may wait for a FIFO or read a device. What a name means with --allow-outside is tested, too, so
that the refusals are known to be for the right reason.
"""
import json
import os
import shutil
import struct
import sys
import tempfile
import zlib

from harness import arguments, commands_of, must, quad, run, tree, write

SECRET = b"THE-SECRET-8f2c71aa-OF-ANOTHER-FOLDER"
FAILED = []


def expect(good, what, detail=""):
    if not good:
        FAILED.append(what)
        print(f"FAILED: {what}\n  {detail}", flush=True)


def secret_png(width=24, height=24):
    """A picture of one colour that occurs nowhere else, with the secret as a text chunk."""
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    rows = (b"\0" + bytes((13, 239, 121)) * width) * height
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
            chunk(b"tEXt", b"Comment\0" + SECRET) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def names(bundle, outside, own):
    """Ways to name the secret from the folder of the bundle; `own` is the file's usual folder."""
    inner = os.path.join(bundle, own) if own else bundle
    yield "absolute", os.path.join(outside, "secret.png")
    yield "dot dot", "../secret/secret.png"
    yield "dot dot inside", (own + "/" if own else "./") + "../../secret/secret.png"
    yield "backslashes", "..\\secret\\secret.png"
    yield "file URL", "file://" + os.path.join(outside, "secret.png")
    yield "http URL", "http://127.0.0.1:9/secret.png"
    yield "network", "//127.0.0.1/secret.png"
    yield "percent", "%2e%2e/secret/secret.png"
    os.symlink(os.path.join(outside, "secret.png"), os.path.join(inner, "link.png"))
    yield "link", (own + "/" if own else "") + "link.png"
    os.symlink(outside, os.path.join(bundle, "folderlink"))
    yield "link of a folder", "folderlink/secret.png"
    os.mkfifo(os.path.join(inner, "fifo.png"))
    yield "FIFO", (own + "/" if own else "") + "fifo.png"
    for device in ("/dev/zero", "/dev/stdin", "/proc/self/environ"):
        yield "device " + device, device
    os.symlink("/dev/zero", os.path.join(inner, "zero.png"))
    yield "link to a device", (own + "/" if own else "") + "zero.png"


def runs(args, have, source, where, ok_codes):
    """Every command over the file; nothing of the secret in what it writes or says."""
    count = 0
    out = tempfile.mkdtemp(prefix="out-", dir=os.path.dirname(os.path.dirname(source)))
    lines = {"info": ["info", source, "--format", "json"], "validate": ["validate", source],
             "convert": ["convert", source, "-o", "a.exr", "--views", "ring:2", "--size", "24x24"],
             "copy": ["convert", source, "-o", "a.mp4", "--views", "ring:2", "--size", "24x24"],
             "render": ["render", source, "-o", "a.png", "--size", "24x24", "--backend", "cpu"],
             "pack": ["pack", source, "-o", "atlas"], "bake": ["bake", source, "-o", "b.mp4"],
             "extract": ["extract", source, "-o", "images"],
             "sheet": ["sheet", source, "-o", "a.png"]}
    for name, words in lines.items():
        if words[0] not in have:
            continue
        done = run([args.stx] + words + ["--max-memory", "256", "--threads", "1"], out, timeout=60, cpu_seconds=10)
        count += 1
        what = f"{where}: {name}"
        expect(done.code in ok_codes, f"{what}: exit code {done.code}", done)
        told = {"stdout": done.out, "stderr": done.err, **tree(out)}
        for place, content in told.items():
            if place != "stderr" or name != "info":
                expect(SECRET not in content, f"{what}: the secret is in {place}")
        expect(not any(c for p, c in tree(out).items() if secret_png() in c), f"{what}: the picture is copied")
        for path in os.listdir(out):
            full = os.path.join(out, path)
            shutil.rmtree(full) if os.path.isdir(full) else os.unlink(full)
    shutil.rmtree(out)
    return count


def main():
    args = arguments(__doc__)
    have = commands_of(args.stx)
    count = refused = 0
    with tempfile.TemporaryDirectory(prefix="stx-paths-") as top:
        outside = os.path.join(top, "secret")
        os.mkdir(outside)
        write(os.path.join(outside, "secret.png"), secret_png())
        made = os.path.join(top, "made")
        os.mkdir(made)
        quad(made)
        must([args.stx, "convert", "quad.obj", "-o", "own.mp4", "--views", "ring:2", "--size", "24x24"], made)
        for name in ("own.xmt", "own.bt"):
            must([args.stx, "convert", "own.mp4", "-o", name], made)
        must([args.stx, "pack", "own.mp4", "-o", "atlas"], made)

        def scene(kind):
            text = open(os.path.join(made, "own." + kind), encoding="utf-8").read()
            images = sorted(d for d in os.listdir(made) if os.path.isdir(os.path.join(made, d)) and d != "atlas")
            for folder in images:
                for image in sorted(os.listdir(os.path.join(made, folder))):
                    if f"{folder}/{image}" in text:
                        return text, f"{folder}/{image}", images
            raise SystemExit(f"own.{kind} names no image")

        def case(kind, way, name, bundle):
            """The file in `bundle` that names `name`, and the codes that are right for it."""
            if kind in ("xmt", "bt"):
                text, image, images = scene(kind)
                for folder in images:
                    for file in os.listdir(os.path.join(made, folder)):
                        os.makedirs(os.path.join(bundle, folder), exist_ok=True)
                        shutil.copyfile(os.path.join(made, folder, file), os.path.join(bundle, folder, file))
                path = os.path.join(bundle, "own." + kind)
                write(path, text.replace(image, name.replace("\\", "\\\\") if kind == "bt" else name))
                return path
            if kind == "atlas":
                for file in os.listdir(os.path.join(made, "atlas")):
                    shutil.copyfile(os.path.join(made, "atlas", file), os.path.join(bundle, file))
                path = os.path.join(bundle, "atlas.json")
                description = json.load(open(path, encoding="utf-8"))
                description["textures"][0]["file"] = name
                write(path, json.dumps(description))
                return path
            if kind == "obj":
                quad(bundle)
                write(os.path.join(bundle, "quad.mtl"), f"newmtl paint\nKd 1 1 1\nmap_Kd {name}\n")
                return os.path.join(bundle, "quad.obj")
            if kind == "mtllib":
                write(os.path.join(bundle, "quad.obj"), f"mtllib {name}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
                return os.path.join(bundle, "quad.obj")
            if kind == "transforms":
                path = os.path.join(bundle, "transforms.json")
                write(path, json.dumps({
                    "camera_angle_x": 0.7, "w": 24, "h": 24, "fl_x": 30, "fl_y": 30, "cx": 12, "cy": 12,
                    "frames": [{"file_path": name, "depth_file_path": name,
                                "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2], [0, 0, 0, 1]]}]}))
                return path
            positions = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
            write(os.path.join(bundle, "ok.bin"), positions + struct.pack("<6f", 0, 0, 1, 0, 0, 1))
            model = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                     "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
                     "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
                     "textures": [{"source": 0}], "images": [{"uri": name if kind == "gltf image" else "none.png"}],
                     "buffers": [{"uri": name if kind == "gltf buffer" else "ok.bin", "byteLength": 60}],
                     "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 24}],
                     "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                                    "min": [0, 0, 0], "max": [1, 1, 0]},
                                   {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"}]}
            path = os.path.join(bundle, "model.gltf")
            write(path, json.dumps(model))
            return path

        for kind in ("xmt", "bt", "atlas", "obj", "mtllib", "gltf image", "gltf buffer", "transforms"):
            own = {"xmt": scene("xmt")[2][0], "bt": scene("bt")[2][0]}.get(kind, "")
            plan = tempfile.mkdtemp(dir=top)
            os.makedirs(os.path.join(plan, own), exist_ok=True)
            for index, (way, _) in enumerate(list(names(plan, outside, own))):
                bundle = tempfile.mkdtemp(prefix="bundle-", dir=top)
                os.makedirs(os.path.join(bundle, own), exist_ok=True)
                name = list(names(bundle, outside, own))[index][1]
                path = case(kind, way, name, bundle)
                # A model may be shown without its texture, and headers read without images.
                count += runs(args, have, path, f"{kind} by {way}", (0, 2, 3, 5, 7))
                if kind in ("xmt", "bt", "atlas"):
                    done = run([args.stx, "render", path, "-o", "a.png", "--size", "8x8"], bundle, timeout=60)
                    expect(done.code in (2, 3), f"{kind} by {way}: is not refused", done)
                    refused += 1
                if kind == "obj" and way in ("absolute", "dot dot", "link"):
                    # The same names are good ones when asked for: the refusals above are no accident.
                    for allow in ([], ["--allow-outside"]):
                        run([args.stx, "render", path, "-o", "a.png", "--size", "32x32", "--eye", "0,0,4"] + allow, bundle)
                        info = run([args.stx, "render", path, "-o", "b.png", "--size", "32x32", "--eye", "0,0,4"] + allow,
                                   bundle)
                        expect(info.code in (0, 2, 3), f"{kind} by {way} {allow}", info)
                        allowed = tree(bundle).get("a.png", b"")
                        write(os.path.join(bundle, "plain.mtl"), "newmtl paint\nKd 1 1 1\n")
                        if allow:
                            expect(allowed != refusal, f"{kind} by {way}: --allow-outside changes nothing")
                        refusal = allowed
                shutil.rmtree(bundle)
    print(f"{count} runs, {refused} refusals; {len(FAILED)} failed")
    return 1 if FAILED else 0


if __name__ == "__main__":
    sys.exit(main())
