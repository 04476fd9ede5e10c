# SPDX-License-Identifier: Apache-2.0
"""dapple.canopy: the numbers of library forest, NumPy in and out, and errors that name what is wrong."""
import json
import os
import tempfile
import unittest
import xml.etree.ElementTree

import numpy as np

from dapple import canopy, plot


def solver(amounts=(1, 1), **options):
    leaves = canopy.Leaves("horizontal", [0.45, 0.1], [0.45, 0.05])
    return canopy.Solver([leaves], [0, 1, 2], amounts, [0.15, 0.1], **options)


class Canopy(unittest.TestCase):
    def test_horizontal_leaves(self):
        """Closed form for horizontal leaves, LAI 2 (illumination under trees, 5.9): 1e-10."""
        s = solver()
        for field, incident in ((s.beam(0.6), 0.6), (s.sky(), 1)):
            f = s.fluxes(field)
            self.assertEqual(f["up"].shape, (3, 2))
            self.assertAlmostEqual(f["up"][2, 0] / incident, 0.4317546137538, delta=1e-10)
            self.assertAlmostEqual((f["down_direct"] + f["down_diffuse"])[0, 0] / incident, 0.4469496437598, delta=1e-10)
        radiance = s.radiance(s.beam(0.6), 0.3, np.array([0, 1, 2]))
        self.assertEqual(radiance.shape, (3, 3, 2))
        np.testing.assert_allclose(radiance[:, 2, 0] * np.pi / 0.6, 0.4317546137538, atol=1e-9)
        np.testing.assert_array_equal(s.heights_m, [0, 1, 2])
        np.testing.assert_allclose(s.irradiance(s.sky(), -1)[2], s.fluxes(s.sky())["up"][2], rtol=1e-9)

    def test_solves_files(self):
        """What the program writes for a file; the layer is that of test_horizontal_leaves."""
        layer = {"bottom_m": 0, "top_m": 2, "leaf_area_index": 2, "reflectance": 0.45, "transmittance": 0.45, "leaf_angle_distribution": "horizontal"}
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "canopy.json")
            with open(path, "w") as file:
                json.dump({"layers": [layer], "ground": {"reflectance": 0.15}, "sky": {"type": "uniform", "irradiance_W_m2": 1}}, file)
            solution = canopy.solve_file(path)
            self.assertAlmostEqual(np.ravel(solution["albedo"]["white_sky"])[0], 0.4317546137538, delta=1e-9)
            with open(path, "w") as file:
                json.dump({"layers": [dict(layer, reflectance=2)]}, file)
            with self.assertRaisesRegex(ValueError, "reflectance"):
                canopy.solve_file(path)
            with self.assertRaisesRegex(ValueError, "cannot read"):
                canopy.solve_file(os.path.join(folder, "none.json"))

    def test_methods_agree(self):
        leaves = canopy.Leaves(canopy.LeafAngles.beta(1.0, 0.3), np.array([0.4]), np.array([0.3]))
        albedo = []
        for method in ("adding_doubling", "riccati"):
            s = canopy.Solver([leaves], [0, 1], [2.5], [0.2], method=method)
            albedo.append(s.fluxes(s.beam(0.7))["up"][-1, 0])
        self.assertAlmostEqual(albedo[0], albedo[1], delta=1e-9)

    def test_projection_takes_arrays(self):
        np.testing.assert_allclose(canopy.LeafAngles("spherical").projection(np.linspace(0.1, 1, 5)), 0.5, atol=1e-9)
        self.assertAlmostEqual(canopy.LeafAngles("horizontal").projection(0.3), 0.3)

    def test_mixtures(self):
        """Two halves of the same leaves are the whole."""
        leaves = [canopy.Leaves("spherical", [0.4], [0.3]) for _ in range(2)]
        half = canopy.Solver(leaves, [0, 1], [[1, 1]], [0.1])
        whole = canopy.Solver(leaves[:1], [0, 1], [2], [0.1])
        self.assertAlmostEqual(half.fluxes(half.sky())["up"][1, 0], whole.fluxes(whole.sky())["up"][1, 0], delta=1e-12)

    def test_errors_name_what_is_wrong(self):
        leaves = canopy.Leaves("spherical", [0.4], [0.3])
        cases = [
            (lambda: canopy.Leaves("round", [0.4], [0.3]), "round"),
            (lambda: canopy.Leaves("spherical", [0.8], [0.3]), "0.8|sum|above|most"),
            (lambda: canopy.Leaves("spherical", [float("nan")], [0.3]), "reflectance holds nan"),
            (lambda: canopy.Leaves("spherical", [[0.1]], [0.3]), "reflectance has 2 dimensions"),
            (lambda: solver(nodes=0), "nodes is 0, expected 1 to 64"),
            (lambda: solver(modes=100), "modes is 100"),
            (lambda: solver(method="magic"), 'method is "magic"'),
            (lambda: solver(amounts=[1]), r"shape \(slabs, constituents\) = \(2, 1\)"),
            (lambda: solver(amounts=[-1, 1]), "."),
            (lambda: canopy.Solver([], [0, 1], [1], [0]), "constituents is empty"),
            (lambda: canopy.Solver([leaves], [0], [1], [0]), "edges_m has 1"),
            (lambda: canopy.Solver([leaves], [1, 0], [1], [0]), "."),
            (lambda: canopy.Solver([leaves], [0, 1], [1], [1.5]), "."),
            (lambda: solver().beam(0), "mu is 0"),
            (lambda: solver().beam(float("nan")), "mu is nan"),
            (lambda: solver().sky("starry"), 'type is "starry"'),
            (lambda: solver().radiance(solver().beam(0.5), 1.5, [0]), "mu is 1.5"),
        ]
        for call, says in cases:
            with self.subTest(says), self.assertRaisesRegex(ValueError, says):
                call()

    def test_plots_are_drawings(self):
        text = plot.figure([plot.Panel("a & b", "x", "y", log_x=True, log_y=True).line([1, 10], [2, 0], "l").points([3], [4], "<p>")])
        root = xml.etree.ElementTree.fromstring(text)
        self.assertTrue(root.tag.endswith("svg"))
        self.assertNotIn("nan", text)
        with self.assertRaises(ValueError):
            plot.figure([plot.Panel("t", "x", "y").line([], [], "l")])


if __name__ == "__main__":
    unittest.main()
