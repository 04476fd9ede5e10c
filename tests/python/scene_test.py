# SPDX-License-Identifier: Apache-2.0
"""import dapple: scenes in NumPy terms."""
import os
import signal
import subprocess
import tempfile
import threading
import time
import unittest

import numpy as np

import dapple

TOON = os.environ["DAPPLE_TOON"]  # the example plug-in
ROOM = """
LookAt 0 1 -5  0 1 0  0 1 0
Camera "perspective" "float fov" 45
Film "rgb" "integer xresolution" 24 "integer yresolution" 16
Sampler "zsobol" "integer pixelsamples" 4
Integrator "path" "integer maxdepth" 3
WorldBegin
LightSource "point" "string name" "key" "rgb I" [20 20 20] "point3 from" [1 2.5 -2] "string group" "key"
LightSource "infinite" "rgb L" [.2 .2 .3] "string group" "sky"
MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [.7 .1 .1]
NamedMaterial "red"
Shape "sphere" "string name" "ball"
"""


class SceneTest(unittest.TestCase):
    def setUp(self):
        self.scene = dapple.parse(ROOM)

    def test_renders_arrays(self):
        session = dapple.Session(self.scene, aovs=["albedo", "depth"], light_groups=True)
        image = session.render()
        self.assertEqual((image.shape, image.dtype), ((16, 24, 3), np.float32))
        self.assertEqual(session.aovs["depth"].shape, (16, 24, 1))
        self.assertEqual(set(session.aovs), {"albedo", "depth", "light.default", "light.key", "light.sky"})
        np.testing.assert_allclose(session.aovs["light.key"] + session.aovs["light.sky"], image, rtol=1e-4, atol=1e-6)
        self.assertEqual(session.statistics["pixel_samples"], 4)
        np.testing.assert_array_equal(image, self.scene.render())

    def test_light_is_linear(self):
        before = self.scene.render(denoise=False)
        self.scene.lights["key"].intensity *= 3
        self.scene.lights["infinite:1"].intensity = 3
        np.testing.assert_allclose(self.scene.render(denoise=False), 3 * before, rtol=1e-4)
        self.assertEqual(self.scene.lights["key"].intensity, 3)
        self.scene.lights["key"].on = False
        self.scene.lights["infinite:1"].remove()
        self.assertEqual(float(np.max(self.scene.render())), 0)

    def test_gains(self):
        layers = dapple.Session(self.scene, light_groups=True)
        layers.render()
        key, sky = layers.aovs["light.key"], layers.aovs["light.sky"]
        self.assertEqual(list(self.scene.gains), ["default", "key", "sky"])
        self.scene.gains["key"] = 2
        self.scene.gains["key"] *= (1, .5, 2)
        np.testing.assert_array_equal(self.scene.gains["key"], (2, 1, 4))
        mixed = self.scene.render()
        np.testing.assert_allclose(mixed, key * np.float32((2, 1, 4)) + sky, rtol=1e-5, atol=1e-6)
        with self.assertRaises(dapple.SceneError):
            self.scene.gains["kay"] = 1
        with self.assertRaises(KeyError):
            self.scene.gains["kay"]
        live = dapple.LiveSession(self.scene)
        np.testing.assert_array_equal(live.gains["key"], (2, 1, 4))
        np.testing.assert_array_equal(live.wait().image, mixed)
        live.gains["key"] = 0
        live.gains["sky"] *= 3
        frame = live.wait()
        self.assertEqual(frame.statistics["rays"], 0)
        np.testing.assert_allclose(frame.image, 3 * sky, rtol=1e-5, atol=1e-6)

        def change(scene):
            scene.gains["sky"] = .5

        live.edit(change).result()
        np.testing.assert_array_equal(live.gains["sky"], (.5, .5, .5))
        np.testing.assert_allclose(live.wait().image, .5 * sky, rtol=1e-5, atol=1e-6)
        with self.assertRaises(KeyError):
            live.gains["kay"] = 1
        live.close()

    def test_gains_of_shaders_with_stages(self):
        def tone():
            scene = dapple.parse(ROOM)
            scene.materials["red"].edit(type="plugin", filename=TOON, tones=2, rim=0.0)
            return scene

        live = dapple.LiveSession(tone(), integrator="distribution", denoise=False)
        before = live.wait().image
        live.gains["key"] = 50
        live.gains["sky"] = .5
        frame = live.wait()
        self.assertGreater(frame.statistics["rays"], 0)
        fresh = tone()
        fresh.gains["key"], fresh.gains["sky"] = 50, .5
        np.testing.assert_array_equal(frame.image, fresh.render(integrator="distribution", denoise=False))
        # The shader's brightest tone is of luminance 1, whatever the lights are.
        luminance = frame.image[8, 12] @ np.float32((.2126, .7152, .0722))
        self.assertAlmostEqual(float(luminance), 1, places=3)
        self.assertGreater(np.abs(frame.image - before).max(), .1)
        live.close()

    def test_refused_gains(self):
        live = dapple.LiveSession(self.scene)
        for wrong in (-1, float("nan"), 1e12):
            live.gains["key"] = wrong
            with self.assertRaises(dapple.SceneError):
                live.wait()
            np.testing.assert_array_equal(live.gains["key"], (1, 1, 1))
        live.gains["key"] = -1
        with self.assertRaises(dapple.SceneError):
            while True:
                live.gains["sky"] = 2
                time.sleep(.01)
        live.wait()
        with self.assertRaises(dapple.SceneError):
            live.edit(lambda s: s.gains.__setitem__("key", -1)).result()
        np.testing.assert_array_equal(live.gains["key"], (1, 1, 1))
        live.edit(lambda s: time.sleep(.2))
        live.gains["key"] = 2
        np.testing.assert_array_equal(live.gains["key"], (2, 2, 2))
        live.wait()
        np.testing.assert_array_equal(live.gains["key"], (2, 2, 2))
        live.edit(lambda s: (time.sleep(.2), s.lights["key"].__setitem__("string group", "sun")))
        live.gains["sun"] = 3
        live.wait()
        np.testing.assert_array_equal(live.gains["sun"], (3, 3, 3))
        live.close()

    def test_items(self):
        s = self.scene
        self.assertEqual(list(s.lights), ["key", "infinite:1"])
        self.assertIn("red", s.materials)
        self.assertNotIn("blue", s.materials)
        np.testing.assert_allclose(s.materials["red"].reflectance, [.7, .1, .1], rtol=1e-6)
        s.materials["red"].reflectance = (.1, .1, .7)
        image = s.render()
        self.assertGreater(image[..., 2].mean(), image[..., 0].mean())
        self.assertEqual(s.camera.fov, 45)
        s.camera.fov = 30
        s.film.edit(xresolution=30, yresolution=20)
        self.assertEqual(s.render().shape, (20, 30, 3))
        s.shapes["ball"].move(dapple.translate(100, 0, 0))  # only the sky is left
        np.testing.assert_allclose(s.render(denoise=False), np.broadcast_to([.2, .2, .3], (20, 30, 3)), rtol=1e-5)
        with self.assertRaises(AttributeError):
            s.lights["key"].power
        with self.assertRaises(KeyError):
            s.lights["kay"]

    def test_made_in_python(self):
        """A floor of albedo .5 under a lamp: .5 / pi * I / h^2 straight up."""
        s = dapple.Scene()
        s.set_camera("orthographic", dapple.look_at((0, 0, 3), (0, 0, 0), (0, 1, 0)),
                     {"float screenwindow": (-.01, .01, -.01, .01)})
        s.film["integer xresolution"], s.film["integer yresolution"] = 8, 8
        s.add_material("grey", "diffuse", {"rgb reflectance": (.5, .5, .5)})
        n = 9  # more vertices than become text
        x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
        P = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
        i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
        faces = np.concatenate([np.stack([i, i + 1, i + n + 1], 1), np.stack([i, i + n + 1, i + n], 1)])
        s.add_shape("trianglemesh", {"point3 P": P, "integer indices": faces}, material="grey")
        s.add_light("lamp", "point", {"rgb I": (4, 4, 4)}, dapple.translate(0, 0, 2))
        image = s.render(integrator="path", pixel_samples=4, denoise=False)
        np.testing.assert_allclose(image, .5 / np.pi, rtol=.01)

    def test_written_scenes_are_the_same(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "room.pbrt")
            with open(path, "w") as file:
                file.write(ROOM)
            scene = dapple.load(path)
            scene.lights["key"].I = (1, 2, 3)
            scene.add_object("blob", [{"type": "sphere", "params": {"float radius": .3}, "material": "red"}])
            scene.add_instance("blob", placement=dapple.translate(0, 2, 0) @ dapple.scale(1, 2, 1) @ dapple.rotate(30, (0, 0, 1)))
            shot = os.path.join(folder, "shot.pbrt")
            scene.write(shot)
            np.testing.assert_array_equal(dapple.load(shot).render(), scene.render())
            self.assertIn(path, scene.files)

    def test_pictures(self):
        session = dapple.Session(self.scene, aovs=["albedo", "normal"])
        image = session.render()
        clean = dapple.denoise(image, session.aovs["albedo"], session.aovs["normal"])
        self.assertEqual(clean.shape, image.shape)
        self.assertFalse(np.array_equal(clean, image))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.exr")
            dapple.write(path, image, {"albedo": session.aovs["albedo"]})
            np.testing.assert_array_equal(dapple.read(path), image)
            np.testing.assert_array_equal(dapple.read_layers(path)["albedo"], session.aovs["albedo"])
            with self.assertRaises(dapple.SceneError):
                dapple.write(os.path.join(folder, "a.gif"), image)

    def test_files_say_what_render_says(self):
        """A crop has the border that `dapple render` gives it, and its file the header that `dapple denoise` reads."""
        session = dapple.Session(self.scene, crop=(6, 4, 18, 12), denoise=True, aovs=["albedo", "normal", "variance"])
        image = session.render()
        self.assertEqual(session.header["dapple/samples"], 4)
        self.assertEqual(session.header["dapple/independentSamples"], 1)
        self.assertEqual(len(session.header["worldToCamera"]), 16)
        with tempfile.TemporaryDirectory() as folder:
            path, room = os.path.join(folder, "a.exr"), os.path.join(folder, "room.pbrt")
            with open(room, "w") as file:
                file.write(ROOM)
            program = os.environ["DAPPLE_PROGRAM"]
            subprocess.run([program, "render", room, "-o", path, "--crop", "6,4,18,12", "--denoise", "on", "--float",
                            "--aov", "albedo,normal,variance"], check=True, capture_output=True)
            np.testing.assert_array_equal(dapple.read(path)[4:12, 6:18], image)
            whole = dapple.Session(self.scene, denoise=True, aovs=["albedo", "normal", "direct", "variance"])
            image = whole.render()
            mine, cleaned = os.path.join(folder, "mine.exr"), os.path.join(folder, "cleaned.exr")
            dapple.write(mine, image, whole.aovs, whole.header)
            subprocess.run([program, "denoise", mine, "-o", cleaned], check=True, capture_output=True)
            np.testing.assert_array_equal(dapple.read(cleaned), image)  # from its noisy layer, by all the others

    def test_headers(self):
        image = np.zeros((4, 5, 3), np.float32)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.exr")
            dapple.write(path, image + 1, {"normal": image, "depth": image[..., :1]},
                         {"a": np.float32(2), "b": np.int64(3), "c": True, "m": np.eye(4), "t": "text",
                          "dapple/window": (2, 3, 20, 10)})
            whole = dapple.read(path)
            self.assertEqual(whole.shape, (10, 20, 3))  # the film, of which this is a crop
            np.testing.assert_array_equal(whole[3:7, 2:7], image + 1)
            layers = dapple.read_layers(path)
            self.assertEqual({name: layer.shape[2] for name, layer in layers.items()}, {"": 3, "normal": 3, "depth": 1})
            for entry in ({"bad": 2**40}, {"bad": [1, 2]}, {"bad": None}, {"dapple/window": "no"}):
                with self.assertRaisesRegex(ValueError, next(iter(entry))):
                    dapple.write(path, image, {}, entry)

    def test_errors(self):
        with self.assertRaises(dapple.SceneError) as caught:
            dapple.parse("WorldBegin\nShape 3\n")
        self.assertEqual((caught.exception.line, caught.exception.column, caught.exception.kind), (2, 7, "input"))
        with self.assertRaises(ValueError):
            dapple.Session(self.scene, integrator="magic").render()
        with self.assertRaisesRegex(dapple.SceneError, "not a finite"):
            self.scene.lights["key"].scale = float("nan")
        with self.assertRaises(TypeError):
            self.scene.lights["key"].scale = object()
        with self.assertRaisesRegex(ValueError, "4 x 4"):
            self.scene.add_light("", "point", {}, np.eye(3))

    def test_progress(self):
        calls = []

        def progress(fraction, seconds, samples):
            calls.append(fraction)
            return len(calls) < 3

        session = dapple.Session(self.scene, pixel_samples=10**6, progress=progress)
        session.render()
        self.assertEqual(len(calls), 3)
        self.assertFalse(session.statistics["finished"])
        session.progress = lambda *_: 1 / 0
        with self.assertRaises(ZeroDivisionError):
            session.render()

    def test_what_is_of_the_wrong_kind_is_named(self):
        for option, value in (("pixel_samples", 2.0), ("pixel_samples", 2**31), ("denoise", "on"), ("resolution", "64x36"),
                              ("resolution", (64,)), ("pixel_samples", "a" + 60 * "\u00e9"), ("seed", -1), ("cache_mb", "100"), ("aovs", [1])):
            with self.subTest(option=option, value=value), self.assertRaisesRegex(TypeError, f'"{option}": expected'):
                self.scene.render(**{option: value})
        for value in ([[1, 2], [3]], b"12", 1j, [None], np.array(["a"]), np.array([1j] * 30)):
            with self.subTest(value=value), self.assertRaisesRegex(TypeError, '"float fov": expected'):
                self.scene.camera.edit(**{"float fov": value})
        with self.assertRaisesRegex(TypeError, "name of a layer"):
            dapple.write("never.exr", np.ones((2, 2, 3)), {1: np.ones((2, 2, 3))})
        for threads in (-5, 100000):
            with self.assertRaisesRegex(dapple.SceneError, "from 0 to 1024"):
                dapple.set_threads(threads)
        with self.assertRaisesRegex(dapple.SceneError, "65500"):
            dapple.write("never.jpg", np.ones((1, 65501, 3)))

    def test_large_whole_numbers(self):
        self.scene._core.edit("integrator", "", {"integer maxdepth": 300000})
        self.scene._core.edit("sampler", "", {"integer seed": 2000000000})
        points = np.zeros((100003, 3))
        points[100000:] = np.eye(3)
        for indices in ([100000, 100001, 100002], np.array([100000, 100001, 100002] * 6),
                        np.array([100000., 100001., 100002.] * 6)):
            self.scene.add_shape("trianglemesh", {"point3 P": points, "integer indices": indices})
        self.assertEqual(self.scene.render(pixel_samples=1).shape, (16, 24, 3))

    def test_interrupts_and_other_threads(self):
        counts = []
        done = threading.Event()

        def count():
            while not done.is_set():
                counts.append(1)
                time.sleep(.01)

        thread = threading.Thread(target=count)
        thread.start()
        threading.Timer(.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        begin = time.monotonic()
        with self.assertRaises(KeyboardInterrupt):
            self.scene.render(pixel_samples=10**6)
        self.assertLess(time.monotonic() - begin, 10)
        done.set()
        thread.join()
        self.assertGreater(len(counts), 10)  # the GIL was free


if __name__ == "__main__":
    unittest.main()
