# SPDX-License-Identifier: Apache-2.0
"""Sparse voxels of microflakes ("flake bricks") against the two trees of shared/scenes/forest, and against leaves at random: bytes, gaps, blocks, scattered light, time
of a shadow ray. docs/design/measurements/033-flake-bricks.md"""
import json
import math
import random

import common

SCENE = """Camera "orthographic"
WorldBegin
{shapes}"""
BARK = 'Material "diffuse" "rgb reflectance" {bark}\nShape "plymesh" "string filename" "{folder}/{tree}_bark.ply"\n'
LEAF = 'Material "diffusetransmission" "rgb reflectance" {reflectance} "rgb transmittance" {transmittance}\n'
LEAVES = 'Shape "plymesh" "string filename" "{folder}/{tree}_leaf.ply"\n'
COLOURS = {"green": {"bark": "[ .12 .12 .12 ]", "reflectance": "[ .11 .11 .11 ]", "transmittance": "[ .1 .1 .1 ]"},
           "near infrared": {"bark": "[ .4 .4 .4 ]", "reflectance": "[ .46 .46 .46 ]", "transmittance": "[ .44 .44 .44 ]"}}
TREES = {"aspen": "quaking_aspen", "maple": "small_maple", "random leaves": None}
HEADER = ["tree", "pixels high", "voxels, pixels", "voxels", "kB", "gaps: mean, worst direction, points", "cover, %", "blocks, points", "sun once, %", "sky once, %", "all light, green, %",
          "near infrared, %", "look-ups a shadow ray", "us"]


def random_leaves(count=20000, side=4.0, width=0.05):
    """Squares that lie and are turned at random in a cube: what flakes stand for without error."""
    rng, corners, faces = random.Random(1), [], []
    for first in range(0, 4 * count, 4):
        z, around = rng.uniform(-1, 1), rng.uniform(0, 2 * math.pi)
        across, s, c = math.sqrt(1 - z * z), math.sin(around), math.cos(around)
        axes = (c * z, s * z, -across), (-s, c, 0)
        middle = [rng.uniform(0, side) for _ in range(3)]
        for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            corners += [f"{m + width / 2 * (u * a + v * b):.5g}" for m, a, b in zip(middle, *axes)]
        faces += [first, first + 1, first + 2, first, first + 2, first + 3]
    return f'Shape "trianglemesh" "point3 P" [ {" ".join(corners)} ] "integer indices" [ {" ".join(map(str, faces))} ]\n'


def bench(context, options=()):
    """options: of bench_flake_bricks."""
    folder = common.ROOT.parent / "shared/scenes/forest"
    if not folder.exists():
        raise common.Skip(f"{folder} is absent")
    context.out.mkdir(parents=True, exist_ok=True)
    result, rows = {}, []
    for tree, name in TREES.items():
        found = {}
        for colour, colours in COLOURS.items():
            shapes = BARK + LEAF + LEAVES if name else LEAF + random_leaves()
            scene = context.out / f"flakes_{tree}_{colour}.pbrt".replace(" ", "_")
            scene.write_text(SCENE.format(shapes=shapes.format(folder=folder, tree=name, **colours)))
            found[colour] = [json.loads(line) for line in common.run([context.program("bench_flake_bricks"), scene, *options]).splitlines()]
        result[tree] = found
        for g, infrared in zip(*found.values()):
            percents = [f"{100 * g[what]:+.1f}" for what in ("sun_once", "sky_once", "all")] + [f"{100 * infrared['all']:+.1f}"]
            rows.append([tree, f"{g['pixels']:g}", f"{g['voxel']:g}" if g["voxel"] else "the tree again", f"{g['voxels']:,}", f"{g['bytes'] / 1000:.1f}",
                         f"{100 * g['gap_bias']:+.1f}, {100 * g['gap_worst']:+.1f}", f"{100 * g['cover']:+.1f}", f"{100 * g['blocks']:.1f}", *percents, f"{g['lookups']:.0f}", f"{g['us']:.2f}"])
    return result, common.table(HEADER, rows)
