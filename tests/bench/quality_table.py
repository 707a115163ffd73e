#!/usr/bin/env python3
"""How good the pictures of every test set are, in every mode, beside what a naive warp gives.

    tests/bench/quality_table.py build/release/bin/stx
    tests/bench/quality_table.py build/release/bin/stx --sets statue,oaktree --modes best --gpu-modes best
    tests/bench/quality_table.py build/release/bin/stx --sets statue,oaktree,spheres-miv --damage all

Prints a table of Markdown: mean PSNR in dB over the novel views of each set, of RGB (spheres-miv: of
full-range Y, as MPEG measures). The naive warp is that of the view that comes nearest to the truth
(naive_warp.cpp); "where it covers" are the pixels that this warp covers. --damage gives the sources
the faults of real depth and of real cameras first (noisy_depth.cpp). Sets that are not in STX_SHARED_DIR are left out. README.md here has its table; tests/golden holds it.
"""

import argparse
import json
import os
import pathlib
import subprocess
import tempfile

HERE = pathlib.Path(__file__).resolve().parents[2]
MODES = {
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
DAMAGE = ["noise0.5", "noise2", "codes8", "missing3", "edges1", "light"]
SIDE = 512
BLACK = ["--background", "0,0,0"]


def mean(values):
    values = list(values)
    return sum(values) / len(values)


class Scene:
    """Novel views of a bundle: what `stx render` is told, what naive_warp is told, and the truth."""

    def __init__(self, table, name, bundle, cameras, naive_cameras, truth, mask=None, key="rgb"):
        self.table, self.name, self.bundle = table, name, bundle
        self.cameras, self.naive_cameras, self.truth = cameras, naive_cameras, truth
        self.mask, self.key = mask, key
        self.file = "".join(c if c.isalnum() else "_" for c in name)
        self.covered = table.work / f"{self.file}_covered_%d.png"

    def naive(self):
        """PSNR over the whole frame and over the pixels that the warp covers."""
        done = self.table.call(self.table.naive_warp, self.bundle, self.truth, self.covered,
                               self.naive_cameras)
        frames = json.loads(done)["frames"]
        return [mean(f[part][self.key] for f in frames) for part in ("whole", "covered")]

    def draw(self, mode, backend):
        out = self.table.work / f"{self.file}_{backend}_{mode}_%d.png"
        self.table.run("render", self.bundle, "-o", out, *self.cameras, "--backend", backend, *BLACK,
                       *MODES[mode])
        return out

    def psnr(self, pictures, covered=False):
        count = 0
        while os.path.exists(str(self.truth) % count):
            count += 1
        values = []
        for i in range(count):
            mask = str(self.covered) % i if covered else self.mask
            values.append(self.table.compare(str(pictures) % i, str(self.truth) % i, self.key,
                                             *(["--mask", mask] if mask else [])))
        return mean(values)


class Table:
    def __init__(self, stx, shared, work):
        self.stx, self.shared, self.work = stx, shared, work
        self.naive_warp = pathlib.Path(stx).resolve().parents[1] / "tests/naive_warp"

    def call(self, *command):
        done = subprocess.run([*map(str, command)], capture_output=True, text=True)
        if done.returncode not in (0, 7):
            raise SystemExit(f"{' '.join(map(str, command))}\n{done.stderr}")
        return done.stdout

    def run(self, *arguments):
        return self.call(self.stx, *arguments)

    def compare(self, ours, truth, key, *more):
        report = json.loads(self.run("compare", ours, truth, "--format", "json", *more))
        psnr = report["psnr"][key]
        return 99.0 if psnr is None else psnr

    def damaged(self, scene, kind):
        """The same novel views, drawn from sources with faulty depth."""
        bundle = scene.bundle.with_name(f"{scene.bundle.stem}_{kind}.exr")
        if not bundle.exists():
            self.call(self.naive_warp.with_name("noisy_depth"), scene.bundle, bundle, kind)
        return Scene(self, f"{scene.name}, {kind}", bundle, scene.cameras, scene.naive_cameras,
                     scene.truth, scene.mask, scene.key)

    def mesh_file(self, name):
        found = sorted((self.shared / "data/meshes").rglob(name))
        return found[0] if found else None

    def imageset(self, name):
        """Sets of views with depth, and novel views of them."""
        folder = self.shared / "data/imagesets" / name
        if not folder.is_dir():
            return
        bundle, count = self.work / f"{name}.exr", 0
        self.run("convert", folder / "transforms.json", "-o", bundle)
        for frame in json.loads((folder / "transforms_test.json").read_text())["frames"]:
            (self.work / f"{name}_truth_{count}.png").symlink_to(folder / frame["file_path"])
            count += 1
        cameras = folder / "transforms_test.json"
        yield Scene(self, f"{name}, {count} views", bundle, ["--cameras", cameras], cameras,
                    self.work / f"{name}_truth_%d.png")

    def model(self, name, source, label, cameras, naive_cameras):
        bundle = self.work / f"{name}.exr"
        if not bundle.exists():
            self.run("convert", source, "-o", bundle, "--views", "sphere:16", "--size",
                     f"{SIDE}x{SIDE}")
        cameras = [*cameras, "--size", f"{SIDE}x{SIDE}"]
        scene = Scene(self, f"{name}, {label}", bundle, cameras, naive_cameras, None)
        scene.truth = self.work / f"{scene.file}_truth_%d.png"
        self.run("render", source, "-o", scene.truth, *cameras)
        return scene

    def spheres(self):
        folder = self.shared / "data/imagesets/spheres-miv"
        if not folder.is_dir():
            return
        bundle = self.work / "spheres.exr"
        self.run("convert", folder / "cameras.json", "-o", bundle)
        everything = json.loads((folder / "cameras.json").read_text())
        for view, label in (("center", "center"), ("near", "near"),
                            ("outside", "outside, covered part")):
            chosen = [c for c in everything["cameras"] if view in c.get("Name", c.get("name", ""))]
            file = self.work / f"cameras_{view}.json"
            file.write_text(json.dumps({**everything, "cameras": chosen[:1]}))
            truth = self.work / f"spheres_{view}_truth_%d.png"
            pathlib.Path(str(truth) % 0).symlink_to(folder / f"gt_{view}_color.png")
            mask = folder / f"gt_{view}_covered.png" if view == "outside" else None
            yield Scene(self, f"spheres-miv, {label}", bundle, ["--cameras", file], file, truth, mask,
                        "y")

    def scenes(self, wanted):
        def want(name):
            return not wanted or any(name.startswith(w) for w in wanted)

        if want("spheres-miv"):
            yield from self.spheres()
        for name in ("statue", "oaktree"):
            if want(name):
                yield from self.imageset(name)
        for name, file in MODELS.items():
            source = self.mesh_file(file)
            if source and want(name):
                for elevation in (23, -12):
                    yield self.model(name, source, f"elevation {elevation}",
                                     ["--orbit", "4", "--elevation", str(elevation)],
                                     f"orbit:4:{elevation}:{SIDE}")
        source = self.mesh_file("TwoSidedPlane.gltf")
        if source and want("TwoSidedPlane"):
            yield self.model("TwoSidedPlane", source, "eye 0,3,1",
                             ["--eye", "0,3,1", "--target", "0,0,0", "--fov", "50"],
                             f"eye:0,3,1:50:{SIDE}")


def names(text):
    return [name for name in text.split(",") if name]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stx")
    parser.add_argument("--sets", default="", help="names, comma-separated (default: all)")
    parser.add_argument("--modes", default=",".join(MODES), help="on the processor")
    parser.add_argument("--gpu-modes", default="normal",
                        help="on the GPU, a software driver where there is none (best takes ten minutes there)")
    parser.add_argument("--damage", default="", help=f"all, or of {', '.join(DAMAGE)}: print these instead")
    options = parser.parse_args()
    shared = pathlib.Path(os.environ.get("STX_SHARED_DIR", HERE.parent / "shared"))
    columns = [(mode, "cpu") for mode in names(options.modes)]
    columns += [(mode, "gpu") for mode in names(options.gpu_modes)]
    heads = ["set", "naive warp"] + [m if b == "cpu" else f"{m}, GPU" for m, b in columns]
    shown = columns.index(("best", "cpu")) if ("best", "cpu") in columns else len(columns) - 1
    heads += ["naive warp where it covers", f"{heads[shown + 2]} there"] if columns else []
    print("| " + " | ".join(heads) + " |\n" + "|---" * len(heads) + "|")
    with tempfile.TemporaryDirectory() as work:
        table = Table(options.stx, shared, pathlib.Path(work))
        kinds = DAMAGE if options.damage == "all" else names(options.damage)
        scenes = table.scenes(names(options.sets))
        if kinds:
            scenes = (table.damaged(scene, kind) for scene in scenes for kind in kinds)
        for scene in scenes:
            whole, covered = scene.naive()
            pictures = [scene.draw(mode, backend) for mode, backend in columns]
            values = [whole, *map(scene.psnr, pictures)]
            if columns:
                values += [covered, scene.psnr(pictures[shown], covered=True)]
            print(f"| {scene.name} | " + " | ".join(f"{v:.2f}" for v in values) + " |", flush=True)


if __name__ == "__main__":
    main()
