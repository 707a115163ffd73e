#!/usr/bin/env python3
"""Python and the program give the same bytes: of the sample model, and of random small scenes."""
import os
import random
import subprocess
import sys
import unittest

from harness import MODEL, Case, np, read, run, stx

SEEDS = range(1, 7)


def random_scene(path, dice):
    """Some boxes that were turned, as a Wavefront file with colours of corners."""
    lines = []
    for box in range(dice.randint(1, 5)):
        axes = np.linalg.qr(np.array([[dice.gauss(0, 1) for _ in range(3)] for _ in range(3)]))[0]
        half = [dice.uniform(0.05, 0.6) for _ in range(3)]
        middle = np.array([dice.uniform(-1, 1) for _ in range(3)])
        for corner in range(8):
            sign = [1 if corner >> axis & 1 else -1 for axis in range(3)]
            place = middle + sum(axes[axis] * half[axis] * sign[axis] for axis in range(3))
            colour = [dice.random() for _ in range(3)]
            lines.append("v " + " ".join(f"{v:.6f}" for v in [*place, *colour]))
        for face in ([1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]):
            lines.append("f " + " ".join(str(8 * box + corner) for corner in face))
    with open(path, "w", encoding="ascii") as file:
        file.write("\n".join(lines) + "\n")


class SamePictures(Case):
    def same(self, a, b):
        self.assertTrue(read(a) == read(b), f"{a} and {b} differ")

    def same_folders(self, a, b):
        self.assertEqual(sorted(os.listdir(a)), sorted(os.listdir(b)))
        for name in os.listdir(a):
            self.same(os.path.join(a, name), os.path.join(b, name))

    def test_the_main_job(self):
        run("convert", MODEL, "-o", "a.exr", "--views", "sphere:6", "--size", "96x96")
        run("bake", "a.exr", "-o", "a_baked.exr")
        run("pack", "a_baked.exr", "-o", "a_atlas", "--layout", "tight", "--prune")
        bundle = stx.convert(MODEL, views="sphere:6", size=(96, 96))
        bundle.save("b.exr")
        self.same("a.exr", "b.exr")
        bundle.save("b.mp4")
        run("convert", "a.exr", "-o", "a.mp4")
        self.same("a.mp4", "b.mp4")
        baked = stx.bake("a.exr")
        baked.save("b_baked.exr")
        self.same("a_baked.exr", "b_baked.exr")
        atlas = stx.pack(baked, layout="tight", prune=True)
        atlas.save("b_atlas")
        self.same_folders("a_atlas", "b_atlas")
        camera = stx.Camera.look_at((1.5, 1.2, 2.5), (0, 0.5, 0), size=(120, 90))
        for kind in ("a.exr", "a_atlas", MODEL):
            at = ["--eye=1.5,1.2,2.5", "--target", "0,0.5,0", "--up", "Y", "--size", "120x90"]
            run("render", kind, "-o", "p.png", *at)
            stx.render(kind, camera).save("q.png")
            self.same("p.png", "q.png")
            run("render", kind, "-o", "p.exr", *at)
            stx.render(kind, camera, normals=True).save("q.exr")
            self.same("p.exr", "q.exr")

    def test_materials_of_a_file_are_read(self):
        maker = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "cli", "material_model.py")
        subprocess.run([sys.executable, maker, "make", "m.gltf"], check=True)
        run("convert", "m.gltf", "-o", "a.exr", "--views", "ring:2", "--size", "32x32", "--materials")
        bundle = stx.convert("m.gltf", views="ring:2", size=(32, 32), materials=True)
        self.assertIsNotNone(bundle.views[0].metallic_roughness)
        bundle.save("b.exr")
        self.same("a.exr", "b.exr")

    def test_a_path(self):
        bundle = stx.convert(MODEL, views="ring:4", size=(64, 64))
        bundle.save("a.exr")
        run("render", "a.exr", "-o", "p_%d.png", "--orbit", 3, "--size", "48x48", "--mode", "splat", "--light", "dir:-1,-1,-0.5",
            "--ambient", "0.15")
        path = stx.orbit(bundle, 3, size=(48, 48))
        frames = stx.render(bundle, path, mode="splat", lights=[stx.Light("directional", (-1, -1, -0.5))], ambient=0.15)
        for i, frame in enumerate(frames):
            frame.save("q.png")
            self.same(f"p_{i}.png", "q.png")

    def test_lit_colours_above_one(self):
        bundle = stx.convert(MODEL, views="ring:4", size=(64, 64))
        bundle.save("a.exr")
        lights = [stx.Light("directional", (-1, -1, -0.5), colour=9)]
        for mode in ("splat", "surface"):
            run("render", "a.exr", "-o", "p.exr", "--orbit", 1, "--size", "48x48", "--mode", mode, "--light", "dir:-1,-1,-0.5,9,9,9")
            camera = stx.orbit(bundle, 1, size=(48, 48))[0]
            frame = stx.render(bundle, camera, mode=mode, lights=lights, normals=True, beyond_one=True)
            self.assertGreater(frame.colour[..., :3].max(), 1)
            frame.save("q.exr")
            self.same("p.exr", "q.exr")
            self.assertLessEqual(stx.render(bundle, camera, mode=mode, lights=lights).colour[..., :3].max(), 1.001)

    def test_pixels_are_those_of_the_png(self):
        bundle = stx.convert(MODEL, views="ring:4", size=(64, 64))
        frame = stx.render(bundle, bundle.views[1].camera)
        frame.save("p.png", background=(1, 0.5, 0))
        self.assertTrue(stx.compare("p.png", frame.picture(background=(1, 0.5, 0))).identical)
        self.assertFalse(stx.compare("p.png", frame.picture()).identical)

    def test_a_film(self):
        bundle = stx.convert(MODEL, views="ring:3", size=(48, 48))
        other = stx.Bundle([stx.View(view.colour[::-1], view.depth[::-1], view.camera, name=view.name) for view in bundle.views])
        stx.Film([bundle, other, bundle], rate=10).save("f.mp4")
        run("render", "f.mp4", "-o", "p_%d.png", "--view", 0, "--times", "all")
        film = stx.open_film("f.mp4")
        self.assertEqual(len(film), 3)
        for i, frame in enumerate(stx.render(film, film[0].views[0].camera)):
            frame.save("q.png")
            self.same(f"p_{i}.png", "q.png")

    def test_random_scenes(self):
        for seed in SEEDS:
            with self.subTest(seed=seed):
                self.random_scene(random.Random(seed))

    def random_scene(self, dice):
        random_scene("s.obj", dice)
        views = dice.choice(["cube", "ring:5", "sphere:7", "hemi-octahedral:3", "octahedral:3"])
        size, bits = (dice.randint(16, 80), dice.randint(16, 80)), dice.choice([8, 16, 32])
        run("convert", "s.obj", "-o", "a.exr", "--views", views, "--size", "%dx%d" % size, "--depth-bits", bits)
        job = stx.Job()
        bundle = stx.convert("s.obj", views=views, size=size, depth_bits=bits, job=job)
        bundle.save("b.exr")
        self.same("a.exr", "b.exr")
        layout, padding = dice.choice(["grid", "tight"]), dice.randint(0, 4)
        run("pack", "a.exr", "-o", "a_atlas.exr", "--layout", layout, "--padding", padding)
        stx.pack(bundle, layout=layout, padding=padding, job=job).save("b_atlas.exr")
        self.same("a_atlas.exr", "b_atlas.exr")
        eye = [round(dice.choice([-1, 1]) * dice.uniform(1.5, 4), 3) for _ in range(3)]
        mode, fov, size = dice.choice(["surface", "splat"]), dice.randint(20, 70), (dice.randint(20, 90), dice.randint(20, 90))
        for name in ("a.exr", "a_atlas.exr"):
            run("render", name, "-o", "p.exr", "--eye=%g,%g,%g" % tuple(eye), "--target", "0,0,0", "--up", "Y", "--fov", fov,
                "--size", "%dx%d" % size, "--mode", mode)
            camera = stx.Camera.look_at(eye, (0, 0, 0), fov=fov, size=size)
            stx.render(name, camera, mode=mode, normals=True).save("q.exr")
            self.same("p.exr", "q.exr")


if __name__ == "__main__":
    unittest.main()
