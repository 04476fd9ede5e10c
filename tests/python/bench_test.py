# SPDX-License-Identifier: Apache-2.0
"""What the benchmarks compute from pictures and times: curves of error against time, reprojection, and the scene that POV-Ray is given."""
import math
import re
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import against_povray
import common
import constants
import numpy as np
import run
import time_to_error
from reprojection import Camera, found_again, temporal_variation


class Names(unittest.TestCase):
    def test_all_are_benchmarks(self):
        """Importing them needs nothing that is compiled."""
        for name, module in run.BENCHMARKS.items():
            self.assertTrue(callable(module.bench), name)


class Curves(unittest.TestCase):
    def test_power_law(self):
        """On t = .01 / e^2 interpolation in log-log is exact."""
        settings = [(e, 0.01 / e**2) for e in (0.02, 0.1, 0.05)]
        for error in (0.02, 0.03, 0.05, 0.07, 0.1):
            self.assertAlmostEqual(common.seconds_to(error, settings), 0.01 / error**2, places=9)

    def test_what_is_worse_does_not_count(self):
        settings = [(0.1, 1), (0.05, 4), (0.06, 5), (0.05, 6), (0.2, 1.5)]
        self.assertEqual(common.best(settings), [(0.1, 1), (0.05, 4)])
        self.assertAlmostEqual(common.seconds_to(0.1 / math.sqrt(2), settings), 2)

    def test_outside_the_settings(self):
        settings = [(0.1, 1), (0.05, 4)]
        self.assertIsNone(common.seconds_to(0.04, settings))
        self.assertIsNone(common.seconds_to(0.11, settings))
        self.assertIsNone(common.seconds_to(0.1, []))
        self.assertEqual(common.seconds_to(0.1, [(0.1, 1)]), 1)

    def test_equal_error(self):
        frame = lambda error, seconds: {"rmse": error, "cpu_seconds": seconds, "wall_seconds": seconds / 2}
        ours, theirs = [frame(0.1, 1), frame(0.02, 25)], [frame(0.1, 3), frame(0.03, 3 / 0.09)]
        rows, found = against_povray.at_equal_error(ours, theirs)
        self.assertEqual([f["rmse"] for f in found], list(against_povray.TARGETS))
        self.assertAlmostEqual(found[0]["cpu_ratio"], 3)
        self.assertAlmostEqual(found[0]["wall_ratio"], 3)
        self.assertIsNone(found[-1]["cpu_ratio"])
        self.assertEqual(rows[-1], ["2.5 %", "16.00 s", "-", "-", "8.00 s", "-", "-"])

    def test_noise_of_references_is_taken_off(self):
        """Errors of a picture with error .03, as seen against two with noise .04 of their own."""
        between = {frozenset("xa"): 0.05, frozenset("xb"): 0.05, frozenset("ab"): 0.04 * math.sqrt(2)}
        with mock.patch.object(common, "compare", lambda _, a, b: (between[frozenset(a + b)],) * 2 + (0.01,)):
            self.assertAlmostEqual(common.compare_without_noise(None, "x", "ab")[0], 0.03)

    def test_kept_pictures_are_known_by_what_they_show(self):
        """Other text, or other files that it names or that these name: another picture."""
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            files = {"scene.pbrt": 'Include "trees.pbrt"', "trees.pbrt": 'Shape "plymesh" "string filename" "leaf.ply"', "leaf.ply": "ply"}
            for name, text in files.items():
                (folder / name).write_text(text)
            names = [common.scene_digest(folder / "scene.pbrt")]
            for name in files:
                (folder / name).write_text(files[name] + "\n")
                names.append(common.scene_digest(folder / "scene.pbrt"))
            self.assertEqual(len(set(names)), 4)
            for name, text in files.items():
                (folder / name).write_text(text)
            self.assertEqual(common.scene_digest(folder / "scene.pbrt"), names[0])

    def test_kept_pictures_are_made_again_for_another_version(self):
        with tempfile.TemporaryDirectory() as folder, mock.patch.object(common, "render", lambda _, scene, image, *options: image.write_text("")):
            context, scene = SimpleNamespace(out=Path(folder), threads=1), Path(folder) / "scene.pbrt"
            scene.write_text("WorldBegin")
            kept = lambda: common.path_traced(context, "a", scene, seeds=(1, 2))
            before = kept()
            self.assertEqual(len(set(before)), 2)
            self.assertEqual(kept(), before)
            with mock.patch.object(common, "REFERENCE_VERSION", common.REFERENCE_VERSION + 1):
                self.assertFalse(set(kept()) & set(before))


class FittedNumbers(unittest.TestCase):
    HEADER = "#pragma once\n\nstruct AnyNumbers {\n  /// a, b = 3\n  static constexpr float least = 1, most = 0.5f;\n  static constexpr int rays = 4;\n};\n"

    def test_those_that_are_measured_are_read_from_the_environment(self):
        varied = constants.read_from_environment(self.HEADER, "AnyNumbers", {"most"})
        self.assertIn("static constexpr float least = 1;", varied)
        self.assertIn('static inline const float most = varied<float>("AnyNumbers::most", 0.5f);', varied)
        self.assertIn("static constexpr int rays = 4;", varied)
        self.assertIn("#include \"dapple/base/varied.h\"", varied)

    def test_values(self):
        self.assertEqual([constants.value_now(self.HEADER, "AnyNumbers", n) for n in ("least", "most", "rays")], ["1", "0.5f", "4"])

    def test_every_number_that_is_measured_is_in_its_struct(self):
        headers = constants.headers()
        for struct, number, low, high, scenes in constants.MEASURED:
            now = constants.value_now(headers[struct].read_text(), struct, number)
            value = eval(re.sub(r"(?<=[\d.])f", "", now))  # 0.25f, 1.0f / 8
            self.assertTrue(low < value < high or low > value > high, f"{struct}::{number}")

    def test_changes(self):
        now = {"rays": 100, "seconds": 2.0, "pixels": 0.1, "blocks": 0.05, "images": "a"}
        self.assertEqual(constants.change(now, now), "same images")
        self.assertEqual(constants.change(now, {"rays": 120, "seconds": 3.0, "pixels": 0.05, "blocks": 0.05, "images": "b"}), "+20 +50 -50 +0")


class PovRay(unittest.TestCase):
    def test_box(self):
        setting = against_povray.FINEST
        shapes, camera = against_povray.read_scene(against_povray.SCENE)
        text = against_povray.povray_scene(shapes, camera, setting)
        self.assertEqual(text.count("triangle {"), 2 * len(shapes))
        self.assertEqual(text.count("light_source"), 1)
        self.assertIn(f"count {setting.count} ", text)
        # Straight below: L A / (pi d^2), with the colour that falls off with 2 / (1 + (d / FADE)^2).
        red = float(re.search(r"light_source \{ <278, 548.8, 279.5> rgb <([^,]*),", text).group(1))
        self.assertAlmostEqual(red * 2 / (1 + (500 / against_povray.FADE) ** 2), 17 * 130 * 105 / (math.pi * 500**2), places=6)

    def test_options(self):
        self.assertIn("--diffuse-rays 64,4 ", time_to_error.options("64,4", "4", 0.5, 4, 0.35))


SIZE = 40


def camera(x=0.0, z=0.0):
    return Camera((x, 0, z), (x, 0, z + 1), (0, 1, 0), 90, SIZE, SIZE, mirrored=True)


def frame(x, light, z=0.0, near=np.inf, albedo=lambda p: np.full(p.shape, 0.5)):
    """A camera at (x, 0, z) that looks along z at a wall at 4, and one at 2 that hides it where x > near; light as a function of places."""
    c = camera(x, z)
    rows, columns = np.mgrid[:SIZE, :SIZE]
    sx, sy = -(columns + 0.5 - SIZE / 2) * c.pixel, -(rows + 0.5 - SIZE / 2) * c.pixel  # +x is on the left
    far = np.where(x + sx * (2 - z) > near, 2 - z, 4 - z)
    position = np.stack([x + sx * far, sy * far, z + far], axis=-1)
    normal = np.broadcast_to([0.0, 0, -1], position.shape)
    return SimpleNamespace(camera=c, position=position, normal=normal, albedo=albedo(position), light=light(position))


class Reprojection(unittest.TestCase):
    def test_points_are_where_they_are_seen(self):
        f = frame(0.3, lambda p: p, z=0.5)
        x, y, depth = f.camera.project(f.position)
        rows, columns = np.mgrid[:SIZE, :SIZE]
        np.testing.assert_allclose(x, columns + 0.5, atol=1e-9)
        np.testing.assert_allclose(y, rows + 0.5, atol=1e-9)
        np.testing.assert_allclose(depth, 3.5)

    def test_linear_light_is_found_again(self):
        light = lambda p: 5 + p[..., :1] - 0.3 * p[..., 1:2]
        first, second = frame(0, light), frame(0.123, light, z=0.2)
        value, there = found_again(first, second)
        np.testing.assert_allclose(value[there], first.light[there], atol=1e-9)
        self.assertGreater(there.mean(), 0.85)
        self.assertFalse(there.all())  # some have left the image

    def test_nothing_is_compared_across_edges(self):
        """Left of x = 0 the wall is nearer, and hides more of what is behind as the camera moves."""
        light = lambda p: np.where(p[..., 2:3] < 3, 1.0, 9.0)
        first, second = frame(-0.4, light, near=0), frame(0.53, light, near=0)
        value, there = found_again(first, second)
        np.testing.assert_allclose(value[there], first.light[there], atol=1e-9)
        self.assertGreater((there & (first.light[..., 0] == 1)).sum(), 100)
        self.assertGreater((there & (first.light[..., 0] == 9)).sum(), 100)

    def test_nothing_is_compared_across_materials(self):
        albedo = lambda p: np.where(p < 0.1, 0.2, 0.8)
        light = lambda p: albedo(p)[..., :1]
        first, second = frame(0, light, albedo=albedo), frame(0.123, light, albedo=albedo)
        value, there = found_again(first, second)
        np.testing.assert_allclose(value[there], first.light[there], atol=1e-9)
        self.assertGreater((there & (first.light[..., 0] == 0.2)).sum(), 100)
        self.assertGreater((there & (first.light[..., 0] == 0.8)).sum(), 100)

    def test_still_light_does_not_flicker(self):
        light = lambda p: 5 + p[..., :1] + 0.2 * p[..., 1:2]
        self.assertLess(temporal_variation([frame(0.05 * f, light) for f in range(5)]).noise, 1e-9)

    def test_noise_is_given_as_its_deviation(self):
        random = np.random.default_rng(1)
        v = temporal_variation([frame(0, lambda p: 2 + 0.3 * random.standard_normal((*p.shape[:2], 3))) for _ in range(8)])
        self.assertAlmostEqual(v.noise, 0.15, delta=0.004)
        np.testing.assert_allclose(v.pairs, 0.15, atol=0.005)

    def test_drift_is_no_noise_and_a_pop_is_seen(self):
        drift = temporal_variation([frame(0, lambda p: np.full((SIZE, SIZE, 3), 1 + 0.01 * f)) for f in range(6)])
        self.assertLess(drift.noise, 1e-9)
        pop = temporal_variation([frame(0, lambda p: np.full((SIZE, SIZE, 3), 2.0 if f >= 3 else 1.0)) for f in range(6)])
        self.assertEqual(np.argmax(pop.pairs), 2)
        self.assertAlmostEqual(pop.pairs[2], 1 / math.sqrt(2) / 1.5)


if __name__ == "__main__":
    unittest.main()
