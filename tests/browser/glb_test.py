#!/usr/bin/env python3
"""`stx extract -o model.glb`: Khronos's validator finds nothing in it, Assimp reads it, and stx draws it nearly as the model
that the bundle was made of."""
import json
import os
import shutil
import subprocess
import sys
import tempfile

from pages import NODE_MODULES, psnr
from viewer_test import MODELS, Test, find_model

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../cli"))
from harness import arguments  # noqa: E402

VALIDATE = """
const validator = require(process.argv[1]), fs = require('fs');
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2])))
    .then(report => console.log(JSON.stringify(report)));
"""
LEAST = {"amphora": 34.0, "spot": 42.0}  # dB against the mesh itself


def validate(path):
    module = os.path.join(NODE_MODULES, "gltf-validator")
    done = subprocess.run(["node", "-e", VALIDATE, module, path], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def main():
    args = arguments(__doc__)
    if not shutil.which("node") or not os.path.isdir(os.path.join(NODE_MODULES, "gltf-validator")):
        print("SKIP: needs node and `npm ci` in tests/browser")
        return 77
    with tempfile.TemporaryDirectory(prefix="stx-glb-") as folder:
        test = Test(args, folder)
        sources = {"amphora": args.model}
        found = find_model(args.shared, MODELS["spot"])
        if found:
            sources["spot"] = found
        for name, path in sources.items():
            texture = os.path.join(os.path.dirname(path), f"{name}_texture.png")
            more = ["--texture", texture] if os.path.isfile(texture) else []
            test.stx_run("convert", path, "-o", f"{name}.mp4", "--views", "sphere:16", "--size", "256x256", *more)
            test.stx_run("bake", f"{name}.mp4", "-o", "baked.mp4")
            test.stx_run("pack", f"{name}.mp4", "-o", "atlas", "--prune", "--layout", "tight")
            for source, model, *words in ((f"{name}.mp4", f"{name}.glb"), ("baked.mp4", "baked.glb"), ("atlas", "atlas.glb"),
                                          ("baked.mp4", "fewer.glb", "--triangles", "20000")):
                test.stx_run("extract", source, "-o", model, *words)
                issues = validate(test.path(model))["issues"]
                test.check(issues["numErrors"] + issues["numWarnings"] == 0, f"{model}: {issues['messages'][:3]}")
            if shutil.which("assimp"):
                done = subprocess.run(["assimp", "info", test.path(f"{name}.glb")], capture_output=True, text=True)
                test.check(done.returncode == 0 and "view015" in done.stdout, f"Assimp reads {name}.glb")
            camera = ["--eye=1.5,1.2,2.5", "--target=0,0.4,0", "--fov", "40", "--size", "640x400", "--background", "black"]
            test.stx_run("render", f"{name}.glb", "-o", "shown.png", *camera)
            test.stx_run("render", path, "-o", "wanted.png", *camera, *more)
            value = psnr(args.stx, "shown.png", "wanted.png", folder)
            test.check(value >= LEAST[name], f"{name}.glb, read back: {value:.1f} dB against the mesh")
        test.stx_run("convert", "amphora.glb", "-o", "again.mp4", "--views", "ring:2", "--size", "64x64")
        return 1 if test.failed else 0


if __name__ == "__main__":
    sys.exit(main())
