#!/usr/bin/env python3
"""Wrong input gives stx.Error, or TypeError, in one sentence that says what was found and what is expected."""
import os
import unittest

from harness import MODEL, Case, np, plate, stx


class WrongInput(Case):
    def setUp(self):
        super().setUp()
        self.camera = stx.Camera((6, 4), 5)
        self.bundle = stx.Bundle([plate(self.camera)])

    def test_files(self):
        error = self.fails("io", "missing.obj", stx.open, "missing.obj")
        self.assertEqual(str(error), f"{error.place}: {error.message}" if error.place else error.message)
        with open("text.exr", "w", encoding="ascii") as file:
            file.write("no picture")
        self.fails("invalidInput", "text.exr", stx.open, "text.exr")
        self.fails("usage", "a.xyz", self.bundle.save, "a.xyz")
        self.fails("io", "nowhere", self.bundle.save, "nowhere/a.exr")
        self.bundle.save("a.exr")
        self.fails("io", "a.exr", self.bundle.save, "a.exr", no_clobber=True)
        frame = stx.render(self.bundle, self.camera)
        self.fails("usage", "a.xyz", frame.save, "a.xyz")
        self.fails("usage", "quality is 0; 1 to 100", frame.save, "a.jpg", quality=0)
        before = os.listdir()
        for thing in (frame, stx.pack(self.bundle)):
            self.fails("usage", "'-' is standard output, which is the program's; a", thing.save, "-")
        self.fails("usage", "'-' ends in ''; a bundle is written as", self.bundle.save, "-")
        self.assertEqual(os.listdir(), before)
        self.fails("io", "missing.png", stx.compare, "missing.png", frame)

    def test_memory(self):
        self.fails("invalidInput", "memory limit", stx.convert, MODEL, size=(4096, 4096), job=stx.Job(max_memory=16))
        self.fails("usage", "max_memory is 0", stx.Job, max_memory=0)
        self.fails("usage", "threads is -1", stx.Job, threads=-1)

    def test_types_of_arrays(self):
        colour, depth = np.zeros((4, 6, 3), np.uint8), np.ones((4, 6), np.float32)
        view = stx.View
        error = self.fails("usage", "colour is float64 of shape (4, 6, 3); an array of uint8 (sRGB) or float32", view,
                           colour.astype(float), depth, self.camera)
        self.assertIn("is expected", error.remedy)
        self.fails("usage", "colour is uint8 of shape (4, 6)", view, colour[..., 0], depth, self.camera)
        self.fails("usage", "colour is list", view, [[0]], depth, self.camera)
        self.fails("usage", "depth is uint16 of shape (4, 6); an array of floats", view, colour, depth.astype(np.uint16), self.camera)
        self.fails("usage", "depth is float32 of shape (4, 6, 1)", view, colour, depth[..., None], self.camera)
        self.fails("usage", "normals is float32 of shape (4, 6)", view, colour, depth, self.camera, normals=depth)
        self.fails("usage", "colour is uint8 of shape (0, 6, 3); each side is 1", view, colour[:0], depth[:0], self.camera)

    def test_values_of_arrays(self):
        colour, depth = np.zeros((4, 6, 3), np.uint8), np.ones((4, 6), np.float32)
        self.fails("invalidInput", "6x4", stx.View, colour[:3], depth, self.camera)
        self.fails("invalidInput", "6x4", stx.View, colour, depth[:, :5], self.camera)
        for wrong in (np.nan, -1.0):
            spoilt = depth.copy()
            spoilt[1, 2] = wrong
            self.fails("invalidInput", "distances are 0 or more", stx.View, colour, spoilt, self.camera)
        linear = colour.astype(np.float32)
        linear[0, 0, 0] = np.nan
        self.fails("usage", "colour holds NaN", stx.View, linear, depth, self.camera)
        for wrong in (-0.5, 1.5):
            covered = np.ones((4, 6, 4), np.float32)
            covered[1, 2, 3] = wrong
            self.fails("usage", "colour has an alpha of %g; 0 to 1 is expected" % wrong, stx.View, covered, depth, self.camera)
        normals = np.zeros((4, 6, 3), np.float32)
        normals[..., 2] = 1
        normals[0, 0] = 0  # none is known there
        stx.View(colour, depth, self.camera, normals=normals)
        for wrong in (np.nan, np.inf):
            spoilt = normals.copy()
            spoilt[1, 2, 0] = wrong
            self.fails("usage", "normals holds NaN or infinity; finite values", stx.View, colour, depth, self.camera, normals=spoilt)
        spoilt = normals.copy()
        spoilt[1, 2] = (0, 0, 0.5)
        self.fails("usage", "normals has a length of 0.5 at pixel (2, 1); 1, or 0 where there is none, is expected", stx.View, colour,
                   depth, self.camera, normals=spoilt)
        nowhere = depth.copy()
        nowhere[1, 2] = np.inf
        stx.View(colour, nowhere, self.camera, normals=spoilt)  # nothing is there
        self.fails("usage", "no_depth is 'none'; empty or unknown", stx.View, colour, depth, self.camera, no_depth="none")
        self.fails("usage", "depthBits is 12", stx.View, colour, depth, self.camera, depth_bits=12)
        one = stx.View(colour, depth, self.camera, name="a")
        self.fails("usage", "two views have the name 'a'", stx.Bundle, [one, one])
        self.fails("invalidInput", "view", stx.Bundle, [])

    def test_masked_arrays(self):
        def masked(array):
            return np.ma.masked_array(array, mask=np.zeros(array.shape, bool))

        colour, depth = np.zeros((4, 6, 3), np.uint8), np.ones((4, 6), np.float32)
        self.fails("usage", "colour is a masked array; .filled(VALUE)", stx.View, masked(colour), depth, self.camera)
        self.fails("usage", "depth is a masked array", stx.View, colour, masked(depth), self.camera)
        self.fails("usage", "normals is a masked array", stx.View, colour, depth, self.camera, normals=masked(np.ones((4, 6, 3))))
        self.fails("usage", "mask is a masked array", stx.compare, colour, colour, mask=masked(depth > 0))
        self.fails("usage", "world_from_camera is a masked array", stx.Camera, (6, 4), 5, world_from_camera=masked(np.eye(4)))
        self.fails("usage", "frames is a masked array", stx.background, masked(np.zeros((8, 24, 32, 3), np.uint8)))

    def test_cameras(self):
        pose = np.eye(4)
        for wrong, text in ((np.nan, "not a rotation"), (2.0, "not a rotation")):
            spoilt = pose.copy()
            spoilt[1, 1] = wrong
            self.fails("usage", text, stx.Camera, (6, 4), 5, world_from_camera=spoilt)
        mirrored = np.diag([1.0, 1, -1, 1])
        self.fails("usage", "mirror", stx.Camera, (6, 4), 5, world_from_camera=mirrored)
        away = pose.copy()
        away[0, 3] = np.inf
        self.fails("usage", "finite", stx.Camera, (6, 4), 5, world_from_camera=away)
        self.fails("usage", "world_from_camera is float64 of shape (3, 3)", stx.Camera, (6, 4), 5, world_from_camera=np.eye(3))
        self.fails("usage", "world_from_camera is str", stx.Camera, (6, 4), 5, world_from_camera="a")
        self.fails("usage", "size is 0x4", stx.Camera, (0, 4), 5)
        self.fails("usage", "size is 7; (width, height)", stx.Camera, 7, 5)
        self.fails("usage", "axes is 'up'", stx.Camera, (6, 4), 5, axes="up")
        self.fails("invalidInput", "", stx.Camera, (6, 4), float("nan"))
        self.fails("invalidInput", "", stx.Camera, (6, 4), -5)
        look = stx.Camera.look_at
        self.fails("usage", "", look, (1, 1, 1), (1, 1, 1))
        self.fails("usage", "eye is [1, nan, 1]; three finite numbers", look, [1, np.nan, 1], (0, 0, 0))
        self.fails("usage", "target is (0, 0)", look, (1, 1, 1), (0, 0))
        self.fails("usage", "the field of view is 180 degrees; it must be above 0 and below 180", look, (1, 1, 1), (0, 0, 0), fov=180)
        self.fails("usage", "the window of an orthographic camera is -1 high; above 0", look, (1, 1, 1), (0, 0, 0),
                   ortho=-1)
        self.fails("usage", "up is", look, (1, 1, 1), (0, 0, 0), up=(0, 0, 0))
        with self.assertRaisesRegex(TypeError, "no keyword 'fow'; it has up, size, fov and ortho"):
            look((1, 1, 1), (0, 0, 0), fow=3)
        self.fails("usage", "0 cameras", stx.orbit, self.bundle, 0)

    def test_drawing(self):
        render, bundle, camera = stx.render, self.bundle, self.camera
        self.fails("usage", "mode is 'wire'; one of surface, splat is expected", render, bundle, camera, mode="wire")
        self.fails("usage", "mode is 3; a text", render, bundle, camera, mode=3)
        self.fails("usage", "no stage 'x'", render, bundle, camera, without=["x"])
        self.fails("usage", "ambient is -1, -1, -1; light is 0 or more", render, bundle, camera, ambient=-1)
        for name, value in (("ambient", 0.9), ("specular", 0.5), ("shininess", 3), ("beyond_one", True)):
            self.fails("usage", f"{name} is of lighting; give lights, too", render, bundle, camera, **{name: value})
            render(bundle, camera, lights=[stx.Light("point", (0, 0, 1))], **{name: value})
        self.fails("usage", "colour is negative; light is 0 or more", stx.Light, "point", (0, 0, 1), colour=-1)
        for wrong in (np.nan, np.inf, -np.inf, 1e300):
            for name in ("ambient", "specular"):
                self.fails("usage", f"{name} is {wrong}; finite", render, bundle, camera, **{name: wrong})
            frame = render(bundle, camera)
            self.fails("usage", f"background is {wrong}; finite", frame.picture, background=wrong)
            self.fails("usage", f"background is {wrong}; finite", frame.save, "a.png", background=wrong)
            self.fails("usage", f"background is {wrong}; finite", stx.compare, frame, frame, background=wrong)
        self.fails("usage", "shininess is 0", render, bundle, camera, shininess=0)
        self.fails("usage", "no stage 'y'", render, bundle, camera, without="holes,y")
        self.fails("usage", "lights is [3]; a list of stx.Light", render, bundle, camera, lights=[3])
        self.fails("usage", "device is 1.5; a whole number", render, bundle, camera, device=1.5)
        self.fails("usage", "kind is 'spot'; one of directional, point", stx.Light, "spot", (0, 0, 1))
        self.fails("usage", "must point somewhere", stx.Light, "directional", (0, 0, 0))
        # Before the first picture is asked for.
        self.fails("usage", "mode is 'wire'", render, bundle, [camera], mode="wire")
        with self.assertRaisesRegex(TypeError, "cameras holds ndarray; stx.Camera is expected"):
            render(bundle, [np.eye(4)])
        with self.assertRaisesRegex(TypeError, "times are of a stx.Film"):
            render(bundle, camera, times=1.0)
        with self.assertRaisesRegex(TypeError, "this is dict; stx.Mesh, stx.Bundle, stx.Atlas or the name of its file"):
            render({}, camera)

    def test_models(self):
        mesh = stx.open(MODEL)
        self.fails("usage", "'circle:3' is not a view layout", stx.convert, mesh, views="circle:3")
        self.fails("usage", "'circle:3' is not a view layout", stx.convert, self.bundle, views="circle:3")
        self.fails("usage", "the views are 'auto:x'", stx.convert, self.bundle, views="auto:x")
        self.fails("usage", "size is 0x5", stx.convert, mesh, size=(0, 5))
        self.fails("usage", "cameras is ['a']; a list of stx.Camera", stx.convert, mesh, cameras=["a"])
        for views in ("sphere:2", "cube", "auto:2"):
            self.fails("usage", f"elevation is of views on a ring; ring:N, not '{views}', is expected", stx.convert, mesh, views=views,
                       elevation=70)
        self.fails("usage", "names are of cameras; 2 are given, and no cameras", stx.convert, mesh, names=["a", "b"])
        stx.convert(mesh, cameras=[self.camera], names=["a"], elevation=70)
        self.fails("usage", "intrinsics is (1, 2); four numbers", stx.open, MODEL, intrinsics=(1, 2))
        self.fails("usage", "depthBits is 12", stx.convert, mesh, depth_bits=12)
        self.fails("usage", "supersampling is 'x'; a whole number", stx.convert, mesh, supersampling="x")
        self.fails("usage", "discontinuity", stx.bake, self.bundle, discontinuity=0)
        self.fails("usage", "method is 'none'; one of robust, paper", stx.bake, self.bundle, method="none")
        self.fails("usage", "padding", stx.pack, self.bundle, padding=65)
        self.fails("usage", "budget is -1", stx.pack, self.bundle, budget=-1)
        with self.assertRaisesRegex(TypeError, "this is Mesh; stx.Bundle or the name of its file is expected"):
            stx.bake(mesh)

    def test_films(self):
        film = stx.Film([self.bundle, self.bundle])
        with self.assertRaisesRegex(IndexError, "frame 2 of a film of 2"):
            film[2]
        self.assertEqual(film[-1].time, film.times[1])
        self.fails("usage", "no bundles", stx.Film, [])
        self.fails("usage", "rate is 0", stx.Film, [self.bundle], rate=0)
        one = self.bundle.views[0]
        second = stx.View(one.colour, one.depth, one.camera, name="second")
        self.fails("invalidInput", "", stx.Film, [self.bundle, stx.Bundle([one, second])])
        # Sizes may change, but not in MPEG-4.
        resized = stx.Film([self.bundle, stx.Bundle([plate(stx.Camera((7, 4), 5))])])
        self.fails("unsupported", "keeps one size for a whole film; write .exr", resized.save, "resized.mp4")
        self.fails("usage", "2 cameras and 3 times", stx.render, film, [self.camera] * 2, times=[0, 1, 2])
        for wrong in (np.nan, np.inf, -np.inf):
            self.fails("usage", f"time is {wrong}; a finite number of seconds", film.frame_at, wrong)
            self.fails("usage", f"times holds {wrong}; finite numbers of seconds", stx.render, film, self.camera, times=wrong)
            self.fails("usage", f"times holds {wrong}", stx.render, film, self.camera, times=[0.0, wrong])
        self.fails("usage", "h264 is 52", film.save, "a.mp4", h264=52)
        self.fails("usage", "'a_%d_%d.exr' has several numbers; one is possible", film.save, "a_%d_%d.exr")
        self.fails("usage", "'a.exr': JPEG is of MPEG-4 containers; .exr keeps colours", self.bundle.save, "a.exr", jpeg_quality=5)
        self.fails("usage", "'a_0.exr': JPEG is of MPEG-4 containers; .exr keeps", film.save, "a_%d.exr", jpeg_quality=5)
        self.fails("usage", "'a_0.exr': video is of MPEG-4 containers; .exr keeps", film.save, "a_%d.exr", h264=20)
        self.assertEqual(os.listdir(), [])
        self.fails("usage", "method is of plain video, whose background is a picture", stx.background, film, method="median")
        self.fails("usage", "frames is of plain video", stx.background, film, frames=2)
        self.fails("usage", "support is of a stx.Film", stx.background, np.zeros((5, 8, 8, 3), np.uint8), support=0.5)
        self.fails("usage", "support is 2", stx.background, film, support=2)
        self.fails("invalidInput", "one frame", stx.background, stx.Film([self.bundle]))

    def test_backgrounds(self):
        frames = np.zeros((5, 8, 8, 3), np.uint8)
        self.fails("usage", "frames are float64 of shape (5, 8, 8, 3); uint8", stx.background, frames.astype(float))
        self.fails("usage", "frames are uint8 of shape (8, 8, 3)", stx.background, frames[0])
        self.fails("invalidInput", "", stx.background, frames[:1])
        self.fails("io", "nowhere", stx.background, "nowhere")
        with self.assertRaisesRegex(TypeError, "this is int; a stx.Film, an array of frames or names"):
            stx.background(3)
        still = stx.background(frames)
        self.fails("invalidInput", "", still.mask, frames[0, :4])

    def test_comparing(self):
        a = np.zeros((8, 8, 3), np.uint8)
        self.fails("invalidInput", "", stx.compare, a, a[:4])
        self.fails("usage", "b is float64", stx.compare, a, a.astype(float))
        self.fails("usage", "mask is float64", stx.compare, a, a, mask=np.ones((8, 8)))
        self.fails("invalidInput", "", stx.compare, a, a, mask=np.zeros((8, 8), bool))
        self.fails("usage", "background is 2; values of 0 to 1", stx.compare, a, a, background=2)
        large = np.zeros((2000, 2000, 3), np.uint8)
        self.fails("invalidInput", "more than the memory limit of 64 MiB", stx.compare, large, large, job=stx.Job(max_memory=64))


if __name__ == "__main__":
    unittest.main()
