#!/usr/bin/env python3
"""Arrays show the memory of their objects, and bundles are made of arrays."""
import gc
import unittest

from harness import MODEL, Case, np, plate, stx


class Arrays(Case):
    def test_views_share_memory_and_keep_it(self):
        bundle = stx.convert(MODEL, views="ring:4", size=(64, 48))
        view = bundle.views[2]
        for name, shape, kind in (("colour", (48, 64, 4), np.uint8), ("depth", (48, 64), np.float32)):
            array = getattr(view, name)
            self.assertEqual((array.shape, array.dtype), (shape, kind))
            self.assertTrue(np.shares_memory(array, getattr(bundle.views[2], name)))
            self.assertFalse(array.flags.writeable)
            with self.assertRaises(ValueError):
                array.flags.writeable = True
        self.assertIsNone(view.normals)
        depth, before = view.depth, view.depth.copy()
        del bundle, view
        gc.collect()
        stx.convert(MODEL, views="ring:4", size=(64, 48))  # takes memory that was given back
        np.testing.assert_array_equal(depth, before)

    def test_baking_leaves_the_bundle_alone(self):
        bundle = stx.convert(MODEL, views="ring:3", size=(32, 32))
        baked = stx.bake(bundle)
        self.assertIsNone(bundle.views[0].normals)
        normals = baked.views[0].normals
        lengths = np.linalg.norm(normals, axis=2)[np.isfinite(baked.views[0].depth)]
        np.testing.assert_allclose(lengths, 1, atol=1e-3)

    def test_frames(self):
        bundle = stx.convert(MODEL, views="ring:4", size=(64, 64))
        frame = stx.render(bundle, bundle.views[0].camera, normals=True)
        for name, shape in (("colour", (64, 64, 4)), ("depth", (64, 64)), ("normals", (64, 64, 3)), ("alpha", (64, 64))):
            array = getattr(frame, name)
            self.assertEqual((array.shape, array.dtype), (shape, np.float32))
            self.assertFalse(array.flags.writeable)
        self.assertTrue(np.shares_memory(frame.alpha, frame.colour))
        alpha, before = frame.alpha, frame.alpha.copy()
        del frame
        gc.collect()
        np.testing.assert_array_equal(alpha, before)
        self.assertIsNone(stx.render(bundle, bundle.views[0].camera).normals)

    def test_cameras_come_back(self):
        camera = stx.Camera.look_at((1, 2, 3), (0, 0.5, 0), size=(200, 100), fov=50)
        again = stx.Camera((200, 100), camera.fx, world_from_camera=camera.world_from_camera)
        np.testing.assert_allclose(again.world_from_camera, camera.world_from_camera, atol=1e-12)
        turned = camera.world_from_camera @ np.diag([1.0, -1, -1, 1])
        again = stx.Camera((200, 100), camera.fx, world_from_camera=turned[:3], axes="opencv")
        np.testing.assert_allclose(again.world_from_camera, camera.world_from_camera, atol=1e-12)
        for axes in ("opengl", "opencv"):  # without a pose it is the identity of these axes
            given = stx.Camera((200, 100), 90, world_from_camera=np.eye(4), axes=axes)
            self.assertEqual(stx.Camera((200, 100), 90, axes=axes), given)
        np.testing.assert_allclose(camera.camera_from_world @ camera.world_from_camera, np.eye(4), atol=1e-12)
        self.assertAlmostEqual(camera.fy, 50 / np.tan(np.radians(25)))
        self.assertEqual(camera.resized((100, 50)).fx * 2, camera.fx)

    def test_a_point_is_where_its_pixel_says(self):
        # The middle pixel of a camera at z = 5 that looks along -Z at a plate 2 away.
        camera = stx.Camera((5, 5), 10, world_from_camera=np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]]))
        bundle = stx.Bundle([plate(camera)], title="plate")
        np.testing.assert_allclose(bundle.bounds[:, 2], 3, atol=1e-3)
        np.testing.assert_allclose(bundle.bounds[:, 0], [-0.4, 0.4], atol=1e-3)
        self.assertEqual((bundle.title, len(bundle), bundle.views[0].name), ("plate", 1, "view000"))
        bundle.save("plate.exr")
        np.testing.assert_array_equal(stx.open("plate.exr").views[0].depth, bundle.views[0].depth)

    def test_views_of_arrays_in_any_layout(self):
        camera = stx.Camera((6, 4), 5)
        colours = np.random.default_rng(3).integers(0, 255, (4, 6, 3), dtype=np.uint8)
        depth = np.full((4, 6), 2.0)
        depth[0, 0] = np.inf
        straight = stx.View(colours, depth, camera)
        turned = stx.View(np.asfortranarray(colours), np.ascontiguousarray(depth[::-1])[::-1], camera)
        np.testing.assert_array_equal(straight.colour, turned.colour)
        np.testing.assert_array_equal(straight.depth, turned.depth)
        self.assertEqual(straight.colour[0, 0, 3], 0)
        depth[0, 0] = 0  # none, as sensors have it
        zero = stx.View(colours, depth, camera)
        np.testing.assert_array_equal(straight.depth, zero.depth)
        np.testing.assert_array_equal(straight.colour, zero.colour)
        self.assertEqual(straight.near_plane, zero.near_plane)
        np.testing.assert_array_equal(straight.colour[1:, :, :3], colours[1:])
        self.assertEqual(stx.View(colours, depth, camera, no_depth="unknown").colour[0, 0, 3], 255)
        linear = stx.View(colours.astype(np.float32) / 255, depth, camera)
        self.assertEqual(linear.colour.dtype, np.float32)
        # Of any order of bytes, and of any size.
        for kind in (">f4", ">f8", np.float16, np.longdouble):
            np.testing.assert_array_equal(stx.View(colours, depth.astype(kind), camera).depth, straight.depth)
        turned = stx.View((colours.astype(np.float32) / 255).astype(">f4"), depth, camera)
        np.testing.assert_array_equal(turned.colour, linear.colour)

    def test_atlases_and_meshes(self):
        mesh = stx.open(MODEL)
        self.assertEqual(mesh.positions.shape[1], 3)
        self.assertLess(mesh.triangles.max(), len(mesh.positions))
        bundle = stx.convert(mesh, views="ring:4", size=(40, 40))
        atlas = stx.pack(bundle, padding=1)
        self.assertEqual(len(atlas.rectangles), 4)
        box = atlas.rectangles[1]
        x, y = box["atlas_x"], box["atlas_y"]
        page = atlas.pages[box["page"]].depth[y:y + box["height"], x:x + box["width"]]
        np.testing.assert_array_equal(page, bundle.views[1].depth)
        self.assertIsNone(atlas.views[0].depth)
        np.testing.assert_array_equal(stx.unpack(atlas).views[3].depth, bundle.views[3].depth)

    def test_backgrounds(self):
        frames = np.full((9, 30, 40, 3), 90, np.uint8)
        for i in range(9):
            frames[i, 10:20, 4 * i:4 * i + 5] = 250
        still = stx.background(frames)
        np.testing.assert_array_equal(still.colour[..., :3], frames[0] * 0 + 90)
        self.assertEqual((still.colour.shape, still.confidence.shape, still.frames_used), ((30, 40, 4), (30, 40), 9))
        self.assertEqual(still.mask(frames[4])[15, 18], 255)
        self.assertEqual(still.mask(frames[4])[2, 2], 0)

    def test_transparent_pixels_of_frames_do_not_count(self):
        frames = np.full((8, 30, 40, 4), (120, 120, 120, 255), np.uint8)
        frames[:6, 10:20, 10:20] = (255, 0, 0, 0)
        still = stx.background(frames)
        np.testing.assert_array_equal(still.colour[15, 15], (120, 120, 120, 255))
        np.testing.assert_array_equal(still.colour[2, 2], (120, 120, 120, 255))
        with self.assertRaises(stx.Error):
            stx.background(frames, method="n2pg")

    def test_a_film_remembers_what_was_uncovered(self):
        camera = stx.Camera((40, 30), 40)
        bundles = []
        for i in range(8):
            depth = np.full((30, 40), 4.0, np.float32)
            colours = np.full((30, 40, 3), 80, np.uint8)
            depth[8:20, 4 * i:4 * i + 8], colours[8:20, 4 * i:4 * i + 8] = 2.0, 220
            bundles.append(stx.Bundle([stx.View(colours, depth, camera, name="a")]))
        film = stx.background(stx.Film(bundles, rate=10))
        self.assertEqual((len(film), len(film[3].views)), (8, 2))
        behind = film[3].views[1]
        self.assertTrue(behind.background)
        np.testing.assert_allclose(behind.depth[12, 16], 4, atol=0.01)
        np.testing.assert_allclose(film.times, np.arange(8) / 10)
        self.assertEqual([bundle.time for bundle in film], list(film.times))


if __name__ == "__main__":
    unittest.main()
