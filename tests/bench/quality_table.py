#!/usr/bin/env python3
"""How good the pictures of every test set are, in every mode.

    tests/bench/quality_table.py build/release/bin/stx
    tests/bench/quality_table.py build/release/bin/stx --sets statue,oaktree --modes normal,best --backend gpu

Prints a table of Markdown: mean PSNR in dB over the novel views of each set, of RGB (spheres-miv: of
full-range Y, as MPEG measures). Sets that are not in STX_SHARED_DIR are left out. README.md here has
its table; tests/golden holds it.
"""

import argparse
import json
import os
import pathlib
import subprocess
import tempfile

HERE = pathlib.Path(__file__).resolve().parents[2]
MODES = {
    "draft": ["--quality", "draft"],
    "normal": ["--quality", "normal"],
    "best": ["--quality", "best"],
    "splat": ["--mode", "splat"],
}
MODELS = {
    "spot": "spot_triangulated.obj",
    "Fox": "Fox.gltf",
    "CesiumMilkTruck": "CesiumMilkTruck.gltf",
    "2CylinderEngine": "2CylinderEngine.gltf",
}


class Table:
    def __init__(self, stx, shared, work, backend):
        self.stx, self.shared, self.work = stx, shared, work
        self.drawing = ["--backend", backend]

    def run(self, *arguments):
        done = subprocess.run([self.stx, *map(str, arguments)], capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"stx {' '.join(map(str, arguments))}\n{done.stderr}")
        return done.stdout

    def compare(self, ours, truth, key, *more):
        done = subprocess.run(
            [self.stx, "compare", str(ours), str(truth), "--format", "json", *map(str, more)],
            capture_output=True,
            text=True,
        )
        if not done.stdout:
            raise SystemExit(done.stderr)
        report = json.loads(done.stdout)
        frames = report.get("frames") or [report]
        values = [99.0 if f["psnr"][key] is None else f["psnr"][key] for f in frames]
        return sum(values) / len(values)

    def mesh_file(self, name):
        found = sorted((self.shared / "data/meshes").rglob(name))
        return found[0] if found else None

    def imageset(self, name):
        """Sets of views with depth, and novel views of them."""
        folder = self.shared / "data/imagesets" / name
        if not folder.is_dir():
            return None
        bundle, count = self.work / f"{name}.exr", 0
        self.run("convert", folder / "transforms.json", "-o", bundle)
        tests = json.loads((folder / "transforms_test.json").read_text())["frames"]
        for i, frame in enumerate(tests):
            (self.work / f"{name}_truth_{i}.png").symlink_to(folder / frame["file_path"])
            count += 1

        def measure(mode):
            out = self.work / f"{name}_{mode}_%d.png"
            self.run("render", bundle, "-o", out, "--cameras", folder / "transforms_test.json",
                     "--background", "0,0,0", *self.drawing, *MODES[mode])
            return self.compare(out, self.work / f"{name}_truth_%d.png", "rgb")

        return [(f"{name}, {count} views", measure)]

    def model(self, name, source, elevation, cameras=None):
        bundle = self.work / f"{name}.exr"
        if not bundle.exists():
            self.run("convert", source, "-o", bundle, "--views", "sphere:16", "--size", "512x512")
        cameras = cameras or ["--orbit", "4", "--elevation", str(elevation)]
        pattern = f"_%d.png" if "--orbit" in cameras else ".png"
        tag = f"{name}_{elevation}"
        truth = self.work / f"{tag}_truth{pattern}"
        self.run("render", source, "-o", truth, *cameras, "--size", "512x512")

        def measure(mode):
            out = self.work / f"{tag}_{mode}{pattern}"
            self.run("render", bundle, "-o", out, *cameras, "--size", "512x512", *self.drawing,
                     *MODES[mode])
            return self.compare(out, truth, "rgb")

        return measure

    def spheres(self):
        folder = self.shared / "data/imagesets/spheres-miv"
        if not folder.is_dir():
            return None
        bundle = self.work / "spheres.exr"
        self.run("convert", folder / "cameras.json", "-o", bundle)
        drawn = {}

        def measure(view, mode):
            out = self.work / f"spheres_{mode}_%d.png"
            if mode not in drawn:
                self.run("render", bundle, "-o", out, "--cameras", folder / "cameras.json", *self.drawing,
                         *MODES[mode])
                drawn[mode] = True
            number = self.camera_number(folder / "cameras.json", view)
            mask = ["--mask", folder / f"gt_{view}_covered.png"] if view == "outside" else []
            return self.compare(str(out) % number, folder / f"gt_{view}_color.png", "y", *mask)

        return [
            (f"spheres-miv, {label}", lambda mode, view=view: measure(view, mode))
            for view, label in (("center", "center"), ("near", "near"), ("outside", "outside, covered part"))
        ]

    @staticmethod
    def camera_number(path, view):
        names = [c.get("Name", c.get("name", "")) for c in json.loads(path.read_text())["cameras"]]
        return next(i for i, n in enumerate(names) if view in n)

    def rows(self, wanted):
        def want(name):
            return not wanted or any(name.startswith(w) for w in wanted)

        if want("spheres-miv"):
            yield from self.spheres() or []
        for name in ("statue", "oaktree"):
            if want(name):
                yield from self.imageset(name) or []
        for name, file in MODELS.items():
            source = self.mesh_file(file)
            if source and want(name):
                for elevation in (23, -12):
                    yield f"{name}, elevation {elevation}", self.model(name, source, elevation)
        source = self.mesh_file("TwoSidedPlane.gltf")
        if source and want("TwoSidedPlane"):
            eye = ["--eye", "0,3,1", "--target", "0,0,0", "--fov", "50"]
            yield "TwoSidedPlane, eye 0,3,1", self.model("TwoSidedPlane", source, "eye", eye)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stx")
    parser.add_argument("--sets", default="", help="names, comma-separated (default: all)")
    parser.add_argument("--modes", default=",".join(MODES))
    parser.add_argument("--backend", default="cpu")
    options = parser.parse_args()
    shared = pathlib.Path(os.environ.get("STX_SHARED_DIR", HERE.parent / "shared"))
    modes = options.modes.split(",")
    print("| set | " + " | ".join(modes) + " |\n|---" * 1 + "|---" * len(modes) + "|")
    with tempfile.TemporaryDirectory() as work:
        table = Table(options.stx, shared, pathlib.Path(work), options.backend)
        for name, measure in table.rows([w for w in options.sets.split(",") if w]):
            print(f"| {name} | " + " | ".join(f"{measure(m):.2f}" for m in modes) + " |", flush=True)


if __name__ == "__main__":
    main()
