#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Light in a slab, from Python: DISORT's published test problems 1 and 2 (Stamnes et al. 1988, 2000) with dapple.canopy.

Isotropic and Rayleigh scatterers, thin and thick, in a beam and under a uniform sky; 16 streams are 8 nodes a hemisphere. Prints each
published flux and radiance beside Dapple's and exits with 1 if one is off by more than the print of the table. Draws the light within the slab.

  PYTHONPATH=build/release/python examples/python/disort_table.py [--figure disort.svg]
"""
import argparse
import csv
import sys
from math import pi
from pathlib import Path

import numpy as np

from dapple import canopy, plot

TABLE = Path(__file__).resolve().parents[2] / "tests/forest/references/disort_tests_1_2_published.csv"

# Optical depth, single-scattering albedo, cosine of the sun (None: a sky of radiance 1), irradiance normal to the beam, Rayleigh.
PROBLEMS = {
    "1a": (0.03125, 0.2, 0.1, pi / 0.1, False), "1b": (0.03125, 1, 0.1, pi / 0.1, False), "1c": (0.03125, 0.99, None, 0, False),
    "1d": (32, 0.2, 0.1, pi / 0.1, False), "1e": (32, 1, 0.1, pi / 0.1, False), "1f": (32, 0.99, None, 0, False),
    "2a": (0.2, 0.5, 0.080442, pi, True), "2b": (0.2, 1, 0.080442, pi, True),
    "2c": (5, 0.5, 0.080442, pi, True), "2d": (5, 1, 0.080442, pi, True),
}
FLUXES = {"rfldir": "down_direct", "rfldn": "down_diffuse", "flup": "up"}


def solve(name, slabs=1):
    """The solver of a problem over a black ground, its field, and what one unit of its source is worth."""
    depth, albedo, mu, irradiance, rayleigh = PROBLEMS[name]
    scatterers = canopy.Particles([1, 0, 0.1] if rayleigh else [1], [albedo])
    solver = canopy.Solver([scatterers], np.linspace(0, 1, slabs + 1), np.full(slabs, depth / slabs), [0], nodes=8, modes=3)
    return (solver, solver.sky("uniform"), pi) if mu is None else (solver, solver.beam(mu), irradiance)


def printed_error(text):
    """Half a unit of the last digit of a number in the table."""
    mantissa, _, exponent = text.lower().partition("e")
    digits = len(mantissa.split(".")[1]) if "." in mantissa else 0
    return 0.51 * 10.0 ** (int(exponent or 0) - digits)


def compare(table):
    wrong = checked = 0
    print("problem  quantity  level   cosine     published    dapple")
    with open(table, encoding="ascii") as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    for row in rows:
        name, quantity, level = row["test"], row["quantity"], 1 if row["level"] == "top" else 0
        if name not in PROBLEMS or quantity == "dfdt":
            continue
        solver, field, unit = solve(name)
        if quantity in FLUXES:
            value = solver.fluxes(field)[FLUXES[quantity]][level, 0] * unit
        elif PROBLEMS[name][4]:
            continue  # the file does not say the azimuths of these
        else:
            value = solver.radiance(field, float(row["mu(+up)"]), [0])[0, level, 0] * unit
        published = float(row["value"])
        # DISORT computes in single precision, and with albedo 1 - 1e-6 or so where it is 1.
        error = printed_error(row["value"]) + (4e-6 if PROBLEMS[name][1] == 1 else 1e-6) * published + (2e-6 if published == 0 else 0)
        bad = abs(value - published) > error
        checked, wrong = checked + 1, wrong + bad
        print(f"{name:7}  {quantity:8}  {row['level']:6}  {row['mu(+up)']:>8}  {row['value']:>11}  {value:12.6g}{'   WRONG' if bad else ''}")
    print(f"{checked} values, {wrong} off by more than their print")
    return wrong == 0 and checked > 100


def draw(path):
    panel = plot.Panel("Light in DISORT's thin slabs", "irradiance (of the incident)", "height (of the slab)")
    for name, label in (("2a", "albedo .5"), ("2b", "albedo 1")):
        solver, field, unit = solve(name, 40)
        incident = PROBLEMS[name][2] * unit
        f = solver.fluxes(field)
        panel.line(f["down_diffuse"][:, 0] * unit / incident, solver.heights_m, f"down, diffuse, Rayleigh, depth .2, {label}")
        panel.line(f["up"][:, 0] * unit / incident, solver.heights_m, f"up, {label}", "6 3")
    angles = np.linspace(-85, 85, 69)
    reflectance = plot.Panel("Reflectance factor of leaves in the sun's plane", "view zenith (degrees; negative: the sun's side)", "reflectance factor", zero=True)
    for leaf in ("planophile", "spherical", "erectophile"):
        leaves = canopy.Leaves(leaf, [0.45], [0.45])
        solver = canopy.Solver([leaves], [0, 1], [3], [0.15])
        sun = np.cos(np.radians(30))
        field = solver.beam(sun)
        factor = [pi / sun * solver.radiance(field, np.cos(np.radians(a)), [pi if a <= 0 else 0])[0, -1, 0] for a in angles]
        reflectance.line(angles, factor, f"{leaf} leaves, leaf area index 3")
    Path(path).write_text(plot.figure([panel, reflectance]), encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--table", default=TABLE, help="the published values")
    parser.add_argument("--figure", help="SVG to draw")
    options = parser.parse_args()
    right = compare(options.table)
    if options.figure:
        draw(options.figure)
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
