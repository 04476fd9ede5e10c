#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A light mixer: renders a scene once, and makes a strip of pictures by gains of its groups of lights, for which nothing
is traced: the scene as it is, then each group in front of the others.

    light_mixer.py scenes/lamps/lamps.pbrt -o strip.png
"""
import argparse
import os

import numpy as np

import dapple

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("scene", nargs="?", default=os.path.join(os.path.dirname(__file__), "../../scenes/lamps/lamps.pbrt"))
parser.add_argument("-o", "--output", default="strip.png")
parser.add_argument("--resolution", default="240x180")
parser.add_argument("--samples", type=int, default=16)
options = parser.parse_args()

scene = dapple.load(options.scene)
lights = list(scene.lights.values())
if len(scene.lights) > 1 and not any(hasattr(light, "group") for light in lights):
    for k, light in enumerate(lights):  # the scene has no groups: its lights in up to four
        light["string group"] = f"part{k * min(len(lights), 4) // len(lights) + 1}"
session = dapple.LiveSession(scene, preset="preview", pixel_samples=options.samples, denoise=True,
                             resolution=tuple(int(n) for n in options.resolution.split("x")))
whole = session.wait()
strip, names = [whole.image], []
for group in session.gains if len(session.gains) > 1 else []:
    for other in session.gains:
        session.gains[other] = 1 if other == group else 0.1
    mixed = session.wait()
    assert mixed.statistics["rays"] == 0  # light is linear
    if mixed.image.mean() < 0.11 * whole.image.mean():
        continue  # no light of this group is seen
    strip.append(mixed.image)
    names.append(group)
session.close()
dapple.write(options.output, np.concatenate(strip, axis=1))
print(f"{options.output}: as it is, then " + ", ".join(names))
