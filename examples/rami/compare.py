#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How far path tracing, and the plane-parallel solution of measured leaf statistics, are from a RAMI reference in the principal plane.

  dapple canopy reflect het01.pbrt ... --principal-plane=-75,75,2 -o het01.reflect.json
  dapple canopy measure het01.pbrt --period ... -o het01.measure.json
  PYTHONPATH=build/release/python examples/rami/compare.py --dapple build/release/dapple --figure rami.svg \\
    HET01 het01.reflect.json het01.measure.json het01_brfpp_ref.csv  [HET04 ...]
"""
import argparse
import csv
import json
import math
import subprocess
import tempfile
from pathlib import Path

from dapple import plot


def signed(view, sun_azimuth):
    """Zenith angle, negative on the sun's side."""
    towards = math.cos(math.radians(view["azimuth_deg"] - sun_azimuth)) > 0
    return -view["zenith_deg"] if towards else view["zenith_deg"]


def solve(program, canopy, angles, clumping, leaf_size):
    canopy = json.loads(json.dumps(canopy))
    azimuth = canopy["sun"]["azimuth_deg"]
    canopy["view"] = [{"zenith_deg": abs(a), "azimuth_deg": azimuth + (180 if a > 0 else 0)} for a in angles]
    for layer in canopy["layers"]:
        layer["clumping_index"] = clumping
    if leaf_size:
        canopy["hot_spot"] = {"leaf_size_m": leaf_size}
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "canopy.json"
        source.write_text(json.dumps(canopy))
        done = subprocess.run([program, "canopy", "solve", source], stdout=subprocess.PIPE, check=True)
    return [v["reflectance_factor"][0] for v in json.loads(done.stdout)["view"]]


def rms(values, reference):
    return math.sqrt(sum((v / r - 1) ** 2 for v, r in zip(values, reference)) / len(reference))


def mean(values, reference):
    return sum(v / r - 1 for v, r in zip(values, reference)) / len(reference)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dapple", default="build/release/dapple", help="the program")
    parser.add_argument("--figure", required=True, help="SVG to draw")
    parser.add_argument("--leaf-size", type=float, default=0, help="of the hot spot, m; 0: none")
    parser.add_argument("sets", nargs="+", metavar="NAME REFLECT MEASURE REFERENCE", help="four for each canopy")
    options = parser.parse_args()
    if len(options.sets) % 4:
        parser.error("expected NAME REFLECT MEASURE REFERENCE for each canopy")

    panels = []
    for k in range(0, len(options.sets), 4):
        name, reflect, measure, reference = options.sets[k:k + 4]
        traced, canopy = (json.loads(Path(p).read_text()) for p in (reflect, measure))
        with open(reference, encoding="ascii") as lines:
            known = {round(float(r["vza"])): float(r["brf"]) for r in csv.DictReader(line for line in lines if not line.startswith("#"))}
        views = sorted((signed(v, traced["sun"]["azimuth_deg"]), v) for v in traced["view"])
        angles = [a for a, _ in views]
        truth = [known[round(a)] for a in angles]
        curves = {
            "path tracing": [v["reflectance_factor"][0] for _, v in views],
            f"plane-parallel, clumping {canopy['measured']['clumping']['index']:.3f}":
                solve(options.dapple, canopy, angles, canopy["layers"][0]["clumping_index"], options.leaf_size),
            "plane-parallel, leaves at random": solve(options.dapple, canopy, angles, 1, options.leaf_size),
        }
        panel = plot.Panel(f"{name}, principal plane", "view zenith (degrees; negative: the sun's side)", "reflectance factor", zero=True)
        panel.points(angles, truth, "reference")
        print(f"{name}: leaf area index {canopy['measured']['leaf_area_index']:.3f}")
        for label, values in curves.items():
            print(f"  {label:36} RMS {100 * rms(values, truth):6.2f} %   mean {100 * mean(values, truth):+6.2f} %")
            panel.line(angles, values, f"{label}: RMS {100 * rms(values, truth):.2g} %", "" if label == "path tracing" else "6 3")
        errors = [v["standard_error"][0] for _, v in views]
        print(f"  standard error of path tracing       RMS {100 * math.sqrt(sum((e / t) ** 2 for e, t in zip(errors, truth)) / len(truth)):6.2f} %")
        panels.append(panel)
    Path(options.figure).write_text(plot.figure(panels), encoding="utf-8")


if __name__ == "__main__":
    main()
