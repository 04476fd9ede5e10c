# SPDX-License-Identifier: Apache-2.0
"""What writes made rooms, and what is computed from their pictures. DAPPLE names a program that is to understand all of them."""
import functools
import math
import os
import re
import subprocess
import tempfile
import unittest
import unittest.mock

import made_rooms
import numpy as np
import run
import scene_writer
from equal_time import Reference, display, display_slope


def corners(line):
    """Vertices and triangles of a written mesh."""
    find = lambda key: [float(v) for v in re.search(rf'"{key}" \[([^\]]*)\]', line).group(1).split()]
    return np.reshape(find("point3 P"), (-1, 3)), np.reshape(find("integer indices"), (-1, 3)).astype(int)


def written_normals(line):
    return np.reshape([float(v) for v in re.search(r'"normal N" \[([^\]]*)\]', line).group(1).split()], (-1, 3))


def volume(lines):
    """Enclosed by written meshes whose faces are counter-clockwise from outside."""
    total = 0
    for line in lines:
        if "trianglemesh" in line:
            p, t = corners(line)
            total += np.einsum("ij,ij->i", p[t[:, 0]], np.cross(p[t[:, 1]], p[t[:, 2]])).sum() / 6
    return total


@functools.cache
def made(kind, variant):
    return made_rooms.KINDS[kind](variant)


class Scenes(unittest.TestCase):
    def test_every_kind_and_variant(self):
        """Each is the same whenever it is made, another for another number, of a believable number of things, and steers no result."""
        for kind, make in made_rooms.KINDS.items():
            scene = made(kind, 1)
            text = scene.text()
            self.assertEqual(text, make(1).text(), kind)
            self.assertNotEqual(text[100:], make(2).text()[100:], kind)  # the first line names the variant
            self.assertTrue(30 <= scene.count <= 4000, f"{kind}: {scene.count}")
            self.assertNotIn("Integrator", text)
            self.assertEqual(re.findall(r"Sampler.*", text), ['Sampler "zsobol" "integer pixelsamples" 16'])
            self.assertEqual(text.count("AttributeBegin"), text.count("AttributeEnd"), kind)
            self.assertNotIn("nan", text)

    def test_units_and_origins(self):
        units = {made(kind, 1).unit for kind in made_rooms.KINDS}
        self.assertTrue({1, 100} < units and len(units) > 2)
        self.assertTrue(any(max(made(kind, 1).origin) > 1e5 for kind in made_rooms.KINDS))

    def test_written_files_are_kept_where_they_are_right(self):
        with tempfile.TemporaryDirectory() as folder:
            path = made_rooms.write(folder, "cave", 1)
            os.utime(path, (1, 1))
            self.assertEqual(made_rooms.write(folder, "cave", 1).stat().st_mtime, 1)
            path.write_text("")
            self.assertGreater(made_rooms.write(folder, "cave", 1).stat().st_size, 1000)

    @unittest.skipUnless(os.environ.get("DAPPLE"), "DAPPLE names no program")
    def test_the_program_understands_all(self):
        with tempfile.TemporaryDirectory() as folder:
            for kind in made_rooms.KINDS:
                done = subprocess.run([os.environ["DAPPLE"], "info", "--strict", made_rooms.write(folder, kind, 3)], capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, f"{kind}: {done.stderr}")
                self.assertNotIn("warning", done.stderr, kind)


class Writer(unittest.TestCase):
    def test_a_wall_is_what_its_holes_leave(self):
        s = scene_writer.Scene("wall", 1, unit=10, origin=(100, 0, 0))
        s.wall("w", (1, 1), (4, 5), 3, .2, [(1, 2, 1, 2), (1.5, 3, 2.2, 2.7), (4, 4.5, 0, 2), (4, 4.5, .5, 1)])
        self.assertAlmostEqual(volume(s.lines) / 1000, .2 * (5 * 3 - 1 - .75 - 1), 5)

    def test_lathes_are_closed_and_face_outwards(self):
        s = scene_writer.Scene("lathe", 1)
        with s.at(3, 1, 2, tilt=30, scale=(1, 2, 1)):
            s.lathe("m", [(0, 0), (1, 0), (1, 2), (0, 2)], 96)
        self.assertAlmostEqual(volume(s.lines), 2 * math.pi * 2, delta=.01)
        p, t = corners(s.lines[-1])
        normals = written_normals(s.lines[-1])
        faces = np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]])
        self.assertTrue((np.einsum("ij,ij->i", faces, normals[t].sum(1)) > 0).all())
        with s.at(scale=(1, 2, 1)):
            s.lathe("m", [(1, 0), (1, 2)], 96)
        p, t = corners(s.lines[-1])
        across = p[:96] / [1, 4, 1]  # the gradient of x^2 + y^2 / 4
        self.assertLess(np.abs(np.cross(across, written_normals(s.lines[-1])[:96])).max(), 1e-3)

    def test_instances_stand_where_shapes_would(self):
        """In another unit, far away, within frames: the matrix takes what the object wrote to where the frame would have written it."""
        s = scene_writer.Scene("place", 1, unit=39.37, origin=(1e5, -2e5, 10))
        corner = (.3, .4, .5)
        with s.object("thing"):
            s.box("m", (0, 0, 0), corner)
        own = corners(s.lines[-2])[0][-1]
        with s.at(1, 2, 3, turn=35):
            s.place("thing", 4, 5, 6, turn=50, tilt=20, roll=10, scale=(1, 2, 3))
            with s.at(4, 5, 6, 50, 20, 10, (1, 2, 3)):
                wanted = s.world(corner)
        matrix = np.reshape([float(v) for v in re.search(r"Transform \[([^\]]*)\]", "\n".join(s.lines)).group(1).split()], (4, 4)).T
        np.testing.assert_allclose((matrix @ [*own, 1])[:3], wanted, atol=.01)

    def test_rods_end_where_they_are_to(self):
        s = scene_writer.Scene("rod", 1)
        a, b = np.array((1, 2, 3)), np.array((-1, 2.5, 2))
        s.rod("m", a, b, .1)
        matrix = np.reshape([float(v) for v in re.search(r"Transform \[([^\]]*)\]", s.lines[1]).group(1).split()], (4, 4)).T
        np.testing.assert_allclose((matrix @ [0, 0, np.linalg.norm(b - a), 1])[:3], b, atol=1e-6)


class Figures(unittest.TestCase):
    def setUp(self):
        self.rng = np.random.default_rng(1)
        self.truth_image = np.full((90, 150, 3), .4)
        self.noisy = lambda: self.truth_image + self.rng.normal(0, .1, self.truth_image.shape)
        self.truth = Reference(self.noisy(), self.noisy())

    def test_means_and_their_standard_errors(self):
        """Over many pictures with an error of 2 % errors vary as the standard error says."""
        found = [made_rooms.mean_error([1.02 * self.noisy() for _ in range(2)], Reference(self.noisy(), self.noisy())) for _ in range(60)]
        errors, deviations = np.array(found).T
        self.assertAlmostEqual(errors.mean(), .02, delta=.001)
        self.assertTrue(.8 < np.sqrt((deviations ** 2).mean()) / errors.std() < 1.6)  # the larger one of two estimates

    def test_what_errs_alike_everywhere_is_in_standard_errors(self):
        pictures = [self.truth_image * (1 + e) for e in (.05, -.05)]
        self.assertAlmostEqual(made_rooms.mean_error(pictures, Reference(self.truth_image, self.truth_image))[1], .05, places=5)

    def test_pictures_that_squares_do_not_divide(self):
        """Noise beyond the last whole square counts: here there is no other."""
        noise = np.zeros((20, 31, 3))
        noise[15:, 30:] = .1
        truth = Reference(np.full(noise.shape, .4), np.full(noise.shape, .4))
        found = made_rooms.mean_error([.4 + noise, .4 - noise], truth)[1]
        self.assertAlmostEqual(found, .1 * 5 / (.4 * 20 * 31), places=6)

    def test_display_error_is_without_the_references_noise(self):
        frames = [(self.truth_image * (1 + .05 * (-1) ** np.arange(150))[:, None], self.noisy(), s) for s in (2, 8)]
        found = made_rooms.summary(frames, self.truth)
        exact = Reference(self.truth_image, self.truth_image).errors(frames[0][0])["display"]
        self.assertAlmostEqual(found["denoised"], exact, delta=.06 * exact)
        self.assertAlmostEqual(found["seconds"], 4)

    def test_grainy_halves(self):
        """Display errors of pictures that are 10 % too bright, against halves whose pixels err by .7 of their value: as against what they are of."""
        truth = self.truth_image * np.linspace(.05, 1.2, 150)[:, None]
        grain = lambda: truth * np.exp(self.rng.normal(-.2, .4 ** .5, truth.shape))
        exact = Reference(truth, truth).errors(1.1 * truth)["display"]
        halves = grain(), grain()
        self.assertAlmostEqual(Reference(*halves, .98 * truth).errors(1.1 * truth)["display"], exact, delta=.1 * exact)
        self.assertGreater(Reference(*halves).errors(1.1 * truth)["display"], 1.5 * exact)

    def test_slope_of_display(self):
        x = np.array([.0005, .01, .2, .45, .7])
        difference = (display(x + 1e-7, 2) - display(x - 1e-7, 2)) / 2e-7
        np.testing.assert_allclose(display_slope(x, 2), difference, rtol=1e-4)

    def test_times_sooner(self):
        at = lambda error, seconds: {"denoised": error, "seconds": seconds}
        self.assertAlmostEqual(made_rooms.times_sooner(at(.025, 8), at(.1, 1), at(.05, 4)), 2)
        self.assertAlmostEqual(made_rooms.times_sooner(at(.2, 1), at(.1, 1), at(.05, 4)), .25)
        self.assertIsNone(made_rooms.times_sooner(at(.2, 1), at(.1, 1), at(.1, 4)))
        self.assertIsNone(made_rooms.times_sooner(at(.05, 1), at(.1, 1), at(1e-10, 4)))

    def test_options(self):
        self.assertEqual(made_rooms.parsed(["--scenes", "cave,office", "--seeds", "3,4", "--options", "--preset", "draft"]).options, ["--preset", "draft"])
        for wrong in (["--scenes", "moon"], ["--seeds", "1"]):
            with self.assertRaises(SystemExit), open(os.devnull, "w") as nowhere, unittest.mock.patch("sys.stderr", nowhere):
                made_rooms.parsed(wrong)
        with self.assertRaises(SystemExit), open(os.devnull, "w") as nowhere, unittest.mock.patch("sys.stderr", nowhere), \
                unittest.mock.patch("sys.argv", ["run.py", "presets", "--variant", "2"]):
            run.main()
