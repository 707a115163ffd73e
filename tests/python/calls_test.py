#!/usr/bin/env python3
"""Notes, jobs, progress, threads, Ctrl-C; and an installed module that was moved."""
import os
import signal
import subprocess
import sys
import threading
import unittest
import warnings

from harness import MODEL, Case, np, plate, run, stx

# Minutes of work on any machine, which reports its progress often.
LONG = {"views": "sphere:200", "size": (1024, 1024), "supersampling": 8}
# Says when it works; what it prints at the end says how it ended.
INTERRUPTED = f"""
import stx
begun = []
def progress(done, total, what):
    if not begun: print("working", flush=True)
    begun.append(done)
try:
    stx.convert({MODEL!r}, **{LONG!r}, job=stx.Job(progress=progress))
    print("done")
except KeyboardInterrupt:
    print("stopped")
stx.convert({MODEL!r}, views="ring:2", size=(32, 32))
print("works on")
"""
# Ends while another thread works.
LEFT = f"""
import threading, stx
begun = threading.Event()
def work():
    stx.convert({MODEL!r}, **{LONG!r}, job=stx.Job(progress=lambda *_: begun.set()))
threading.Thread(target=work, daemon=True).start()
begun.wait()
print("left")
"""


class Calls(Case):
    def setUp(self):
        super().setUp()
        self.mesh = stx.open(MODEL, job=stx.Job())

    def test_notes_are_warnings_of_who_calls(self):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            stx.convert(self.mesh, views="ring:2", size=(32, 32), depth_bits=8)
        self.assertEqual([w.category for w in caught], [stx.Note])
        self.assertIn("depth in 8 bits", str(caught[0].message))
        self.assertEqual(caught[0].filename, __file__)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with self.assertRaises(stx.Note):
                stx.convert(self.mesh, views="ring:2", size=(32, 32), depth_bits=8)

    def test_settings_of_meshes_are_noted_of_views(self):
        job = stx.Job()
        bundle = stx.convert(MODEL, views="ring:2", size=(32, 32))
        stx.convert(bundle, depth_bits=16, job=job)
        self.assertEqual(job.notes, ())
        stx.convert(bundle, views="ring:4", size=(32, 512), job=job)
        self.assertEqual(job.notes, ("views, width are of meshes and not used: the model has views already",))

    def test_video_of_a_film_of_one_frame_is_noted(self):
        bundle = stx.Bundle([plate(stx.Camera((8, 8), 9), 2.0)])
        for frames, notes in (([bundle], ["h264 is of films and not used: nothing moves"]), ([bundle, bundle], [])):
            job = stx.Job()
            try:
                stx.Film(frames).save("one.mp4", h264=20, job=job)
            except stx.Error as error:
                if error.code != "unsupported":  # without the module of video
                    raise
            self.assertEqual([note for note in job.notes if "not used" in note], notes)

    def test_keywords_that_do_not_matter_to_what_is_opened_are_noted(self):
        bundle = stx.convert(self.mesh, views="ring:2", size=(32, 32))
        bundle.save("a.exr")
        moving = stx.Film([stx.Bundle([plate(stx.Camera((8, 8), 9), depth)]) for depth in (2.0, 3.0)])
        moving.save("f.mp4")
        moving.save("f_%d.exr")
        everything = {"depth_unit": .5, "depth_range": (1, 2), "no_depth": "unknown", "mask": "none.png", "depth": "d_{name}.png",
                      "refine": "noise", "depth_bits": 8, "deep_colour": True, "moving": False, "strict": True, "texture": "t.png"}
        more = {"intrinsics": np.array([1., 1, 1, 1]), "focal": 3, "baseline": 3, "fov": 30, "every": 2, "frame": 1, "materials": True}
        for path, call, keywords, sentences in (
                ("a.exr", stx.open, {"depth_unit": .5}, ("depth_unit is of image sets and not used: 'a.exr' is an OpenEXR bundle",)),
                ("a.exr", stx.open, {**everything, **more}, (
                    "texture, materials are of meshes and not used: 'a.exr' is an OpenEXR bundle",
                    "frame, moving, every, strict, depth, mask, depth_range, depth_unit, no_depth, intrinsics, focal, baseline, fov, "
                    "depth_bits, deep_colour, refine are of image sets and not used: 'a.exr' is an OpenEXR bundle")),
                ("f.mp4", stx.open_film, everything, (
                    "texture is of meshes and not used: 'f.mp4' is an MPEG-4 file",
                    "moving, depth, mask, depth_range, depth_unit, no_depth, depth_bits, deep_colour, refine are of image sets and "
                    "not used: 'f.mp4' is an MPEG-4 file")),
                (MODEL, stx.open, {"materials": True, "every": 2, "refine": "noise"}, (
                    "every, refine are of image sets and not used: 'amphora.obj' is a mesh",))):
            job, usual = stx.Job(), stx.Job()
            call(path, job=job, **keywords)
            call(path, job=usual)
            self.assertEqual(job.notes, usual.notes + sentences)
        for path, kind in (("f.mp4", "an MPEG-4 file"), ("f_%d.exr", "a film of numbered files")):
            self.fails("usage", f"frame is of image sets, and '{path}' is {kind}; stx.open_film() of it has all", stx.open, path, frame=1)
            stx.open(path, frame=0)

    def test_keywords_that_do_not_matter_to_drawing_are_noted(self):
        bundle = stx.convert(self.mesh, views="ring:2", size=(32, 32))
        film, camera = stx.Film([bundle, bundle]), bundle.views[0].camera
        surface, splat = "splat, splat_coefficient are not used: they are of mode splat", "quality is not used: it is of mode surface"
        on_mesh = "mode, without are not used: a mesh is rasterised itself, on the processor"
        for model, keywords, sentence in ((bundle, {"splat": "paper", "splat_coefficient": 1.0, "quality": "best"}, surface),
                                          (bundle, {"mode": "splat", "quality": "best", "splat": "point"}, splat),
                                          (film, {"mode": "splat", "quality": "best"}, splat),
                                          (self.mesh, {"mode": "splat", "without": ["holes"]}, on_mesh)):
            job = stx.Job()
            frames = stx.render(model, [camera, camera], job=job, **keywords)
            self.assertEqual(len(list(frames)), 2)
            self.assertEqual([note for note in job.notes if "not used" in note], [sentence])

    def test_a_number_of_numpy_is_one_time(self):
        bundle = stx.convert(MODEL, views="ring:2", size=(32, 32), job=stx.Job())
        film, camera = stx.Film([bundle, bundle], rate=4), bundle.views[0].camera
        for time in (np.float32(0.25), np.int64(0), np.array(0.25), 0):
            self.assertIsInstance(stx.render(film, camera, times=time), stx.Frame)
        self.assertEqual(len(list(stx.render(film, camera, times=np.array([0.0, 0.25])))), 2)

    def test_names_of_plain_video_may_come_one_by_one(self):
        camera = stx.Camera((16, 12), 20)
        bundle = stx.Bundle([plate(camera)])
        for i in range(3):
            stx.render(bundle, camera).save(f"p_{i}.png")
        still = stx.background(f"p_{i}.png" for i in range(3))
        self.assertEqual(still.colour.shape, (12, 16, 4))

    def test_frames_of_a_film_count_from_one_origin(self):
        bundles = []
        for i in range(3):
            with open("far.obj", "w") as file:
                for a, b, c in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)):
                    file.write(f"v {500000 + 10 * i + a} {b} {c}\n")
                file.write("f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
            bundles.append(stx.convert("far.obj", views="ring:2", size=(16, 16), job=stx.Job()))
        self.assertEqual(len({tuple(bundle.origin) for bundle in bundles}), 3)
        film = stx.Film(bundles)
        film.save("film.mp4")
        film.save("f_%d.exr")
        for frames in (film, stx.open_film("film.mp4"), stx.open_film("f_%d.exr")):
            for frame, bundle in zip(frames, bundles):
                self.assertEqual(tuple(frame.origin), tuple(bundles[0].origin))
                np.testing.assert_allclose(frame.views[0].camera.position + frame.origin,
                                           bundle.views[0].camera.position + bundle.origin, atol=1e-4)

    def test_bundles_of_views_have_their_origin(self):
        bundles = []
        for x in (500000, 500010):
            with open("far.obj", "w") as file:
                for a, b, c in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)):
                    file.write(f"v {x + a} {b} {c}\n")
                file.write("f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
            bundles.append(stx.convert("far.obj", views="ring:2", size=(16, 16), job=stx.Job()))
        a, b = bundles
        self.assertNotEqual(tuple(a.origin), tuple(b.origin))
        self.assertEqual(tuple(stx.Bundle(a.views).origin), tuple(a.origin))
        fresh = stx.View(a.views[1].colour, a.views[1].depth, a.views[1].camera, name="fresh")
        both = stx.Bundle([fresh, a.views[0], b.views[1]])
        self.assertEqual(tuple(both.origin), tuple(a.origin))
        for view, (model, k) in zip(both.views, ((a, 1), (a, 0), (b, 1))):
            np.testing.assert_allclose(view.camera.position + both.origin, model.views[k].camera.position + model.origin, atol=1e-9)
        given = stx.Bundle([fresh, b.views[0]], origin=(499000, 0, 0))
        self.assertEqual(tuple(given.origin), (499000, 0, 0))
        np.testing.assert_array_equal(given.views[0].camera.position, fresh.camera.position)
        np.testing.assert_allclose(given.views[1].camera.position + given.origin, b.views[0].camera.position + b.origin, atol=1e-9)
        self.assertEqual(tuple(stx.Bundle([fresh]).origin), (0, 0, 0))
        self.fails("usage", "origin", stx.Bundle, [fresh], origin=3)

    def test_a_film_is_not_replaced_while_it_is_open(self):
        bundle = stx.Bundle([plate(stx.Camera((16, 12), 20))])
        stx.Film([bundle] * 3).save("q_%d.exr")
        for i in (2, 1, 0):
            os.rename(f"q_{i}.exr", f"q_{i + 1}.exr")
        film = stx.open_film("q_%d.exr")
        self.fails("usage", "'q_1.exr' is a file of a film that is open, which would be lost; give the output another name",
                   film.save, "q_%d.exr")
        self.assertEqual(sorted(os.listdir()), ["q_1.exr", "q_2.exr", "q_3.exr"])
        self.assertEqual(len(list(film)), 3)

    def test_what_is_saved_can_be_opened(self):
        def bundle(camera):
            # A second view, so that no origin is near both.
            cameras = (camera, stx.Camera((16, 12), 20))
            return stx.Bundle([stx.View(np.zeros((12, 16, 3), "u1"), np.full((12, 16), 2.0, "f4"), c, name=f"v{i}")
                               for i, c in enumerate(cameras)])
        far = stx.Camera((16, 12), 20, world_from_camera=[[1, 0, 0, 4e38], [0, 1, 0, 0], [0, 0, 1, 0]])
        for camera, text in ((far, "the camera's position (4e+38 0 0) does not fit 32-bit floats; write .exr"),
                             (stx.Camera((16, 12), 1e-7), "the camera's fieldOfView would be 3.1415927 "),
                             (stx.Camera((16, 12), 1e-40, orthographic=True), "fieldOfView would be inf inf in 32-bit floats")):
            self.fails("unsupported", text, bundle(camera).save, "x.mp4")
            self.assertFalse(os.path.exists("x.mp4"))
            bundle(camera).save("x.exr")
            stx.open("x.exr")

    def test_names_of_views_are_unique(self):
        cameras = [view.camera for view in stx.convert(MODEL, views="ring:2", size=(16, 16), job=stx.Job()).views]
        self.fails("usage", "two views have the name 'a'; names are unique in a bundle", stx.convert, MODEL, cameras=cameras,
                   names=["a", "a"])

    def test_a_frame_keeps_its_time_and_duration(self):
        film = stx.Film([stx.Bundle([plate(stx.Camera((16, 12), 20))])] * 3, rate=10)
        for i in (0, 1):
            film[i].save("f.mp4")
            frame = stx.open("f.mp4")
            self.assertEqual((frame.time, frame.duration), (film[i].time, film[i].duration))

    def test_times_outside_a_film_are_noted(self):
        bundle = stx.convert(MODEL, views="ring:2", size=(32, 32), job=stx.Job())
        film, camera, job = stx.Film([bundle, bundle]), bundle.views[0].camera, stx.Job()
        stx.render(film, camera, times=0.04, job=job)
        next(stx.render(film, camera, job=job))
        self.assertEqual(job.notes, ())
        stx.render(film, camera, times=99.0, job=job)
        next(stx.render(film, camera, times=[-1, 0.04, 99], job=job))
        where = "outside the film, which is from 0 to 0.08 s by its own clock: the frame nearest in time is shown"
        self.assertEqual(job.notes, ("the time 99 s is " + where, "2 of 3 times are " + where))

    def test_a_job_keeps_notes_and_tells_progress(self):
        told = []
        job = stx.Job(threads=1, progress=lambda *news: told.append(news))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            stx.convert(self.mesh, views="sphere:30", size=(256, 256), depth_bits=8, job=job)
        self.assertEqual(len(job.notes), 1)
        for done, total, what in told:
            self.assertTrue(0 <= done <= total and isinstance(what, str))

    def test_the_same_on_any_number_of_threads(self):
        depths = [stx.convert(MODEL, views="ring:2", size=(64, 64), job=stx.Job(threads=n)).views[0].depth for n in (1, 2)]
        np.testing.assert_array_equal(*depths)

    def test_what_progress_raises_stops_the_call(self):
        def progress(done, total, what):
            raise KeyError(what)
        with self.assertRaises(KeyError):
            stx.convert(MODEL, **LONG, job=stx.Job(progress=progress))

    def test_another_thread_cancels(self):
        begun = threading.Event()
        job = stx.Job(progress=lambda *_: begun.set())

        def cancel():
            begun.wait()
            job.cancel()
        thread = threading.Thread(target=cancel)
        thread.start()
        self.fails("failed", "stopped", stx.convert, MODEL, **LONG, job=job)
        thread.join()
        self.fails("failed", "stopped", stx.convert, MODEL, views="ring:2", size=(32, 32), job=job)

    def test_control_c(self):
        child = subprocess.Popen([sys.executable, "-c", INTERRUPTED], stdout=subprocess.PIPE, text=True)
        try:
            self.assertEqual(child.stdout.readline(), "working\n")
            child.send_signal(signal.SIGINT)
            out, _ = child.communicate(timeout=300)
        finally:
            child.kill()
        self.assertEqual((out, child.returncode), ("stopped\nworks on\n", 0))

    def test_a_process_ends_while_a_thread_works(self):
        done = subprocess.run([sys.executable, "-c", LEFT], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=300)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "left\n", ""))

    def test_progress_hears_the_end(self):
        heard = []
        bundle = stx.convert(self.mesh, views="ring:3", size=(64, 64), job=stx.Job())
        stx.bake(bundle, job=stx.Job(progress=lambda *news: heard.append(news)))
        self.assertEqual(heard[-1], (3, 3, "baking normals and splats"))

        def progress(done, total, what):
            if done == total:
                raise KeyError(what)
        with self.assertRaises(KeyError):
            stx.bake(bundle, job=stx.Job(progress=progress))

    def test_names_of_any_bytes_are_shown(self):
        name = os.fsdecode(b"caf\xe9.obj")
        with open(name, "wb") as file:
            file.write(b"mtllib T\xfcre.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        note = "material file 'T\\xfcre.mtl' cannot be read; its materials have no colour"
        job = stx.Job()
        mesh = stx.open(name, job=job)
        self.assertIn(note, job.notes)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            stx.open(name)
        self.assertIn(note, [str(warning.message) for warning in caught])
        self.assertEqual(mesh.title, "caf\\xe9")
        bundle = stx.convert(mesh, views="ring:2", size=(16, 16), job=job)
        self.assertEqual((bundle.title, repr(bundle)), ("caf\\xe9", "<stx.Bundle 'caf\\xe9', 2 views>"))
        self.fails("io", "none\\xfe.obj", stx.open, os.fsdecode(b"none\xfe.obj"))

    def test_views_without_a_name_get_one_that_is_free(self):
        camera = stx.Camera((6, 4), 5)
        pixels, depth = np.zeros((4, 6, 3), np.uint8), np.ones((4, 6), np.float32)
        named, unnamed = stx.View(pixels, depth, camera, name="view001"), stx.View(pixels, depth, camera)
        for views, names in (([unnamed, unnamed], ["view000", "view001"]), ([named, unnamed], ["view001", "view002"]),
                             ([unnamed, unnamed, named], ["view000", "view002", "view001"])):
            self.assertEqual([view.name for view in stx.Bundle(views).views], names)

    def test_threads_of_python_draw_together(self):
        bundle = stx.convert(MODEL, views="ring:4", size=(64, 64))
        path = stx.orbit(bundle, 4, size=(48, 48))
        alone = [frame.colour for frame in stx.render(bundle, path)]
        together = [None] * len(path)

        def draw(i):
            together[i] = stx.render(bundle, path[i]).colour
        threads = [threading.Thread(target=draw, args=(i,)) for i in range(len(path))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        np.testing.assert_array_equal(alone, together)

    def test_calls_leave_no_memory_behind(self):
        def resident():
            with open("/proc/self/statm") as file:
                return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

        def call(times):
            for _ in range(times):
                stx.compare("plate.png", "plate.png")
        stx.render(stx.Bundle([plate(stx.Camera((8, 8), 9), 2.0)]), stx.Camera((8, 8), 9)).save("plate.png")
        call(200)
        before = resident()
        call(800)
        # A thread for each call took 4 MiB in all.
        self.assertLess(resident() - before, 1 << 20)

    def test_a_forked_process_works_on(self):
        stx.open(MODEL)
        child = os.fork()
        if child == 0:
            try:
                stx.open(MODEL)
                os._exit(0)
            finally:
                os._exit(1)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0)

    def test_the_environment_is_shown_unless_it_is_not_wanted(self):
        sky = np.zeros((8, 16, 3), np.uint8)
        sky[:] = (10, 200, 30)
        bundle = stx.convert(MODEL, views="ring:4", size=(64, 64))
        camera = bundle.views[0].camera
        # Any picture twice as wide as high will do.
        stx.render(stx.Bundle([stx.View(sky, np.ones((8, 16)), stx.Camera((16, 8), 8))]), stx.Camera((16, 8), 8)).save("sky.png")
        shown = stx.render(bundle, camera, environment="sky.png")
        self.assertEqual(shown.alpha[0, 0], 1)
        self.assertEqual(stx.render(bundle, camera, environment=False).alpha[0, 0], 0)
        self.fails("io", "none.png", stx.render, bundle, camera, environment="none.png")
        self.assertEqual(os.listdir(), ["sky.png"])

    def test_a_bundle_of_the_views_of_another_keeps_its_environment(self):
        sky = np.zeros((8, 16, 3), np.uint8)
        sky[:] = (10, 200, 30)
        # Any picture twice as wide as high will do.
        stx.render(stx.Bundle([stx.View(sky, np.ones((8, 16)), stx.Camera((16, 8), 8))]), stx.Camera((16, 8), 8)).save("sky.png")
        run("convert", MODEL, "-o", "around.exr", "--views", "ring:2", "--size", "32x32", "--environment", "sky.png")
        around = stx.open("around.exr")
        camera = around.views[0].camera
        depth = np.full((32, 32), np.inf)
        depth[3, 3] = 1
        fresh = stx.View(np.zeros((32, 32, 3), np.uint8), depth, camera)
        for views in (around.views, [fresh, around.views[1]]):
            self.assertEqual(stx.render(stx.Bundle(views, origin=around.origin), camera).alpha.min(), 1)
        self.assertEqual(stx.render(stx.Bundle(around.views), camera, environment=False).alpha.min(), 0)


if __name__ == "__main__":
    unittest.main()
