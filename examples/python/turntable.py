#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A turntable: the camera goes round the middle of a scene. What is built stays from frame to frame.

    turntable.py scenes/bust/bust.pbrt --frames 24 --up 0,1,0 -o turn/
"""
import argparse
import os

import numpy as np

import dapple

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("scene")
parser.add_argument("-o", "--output", default="turn")
parser.add_argument("--frames", type=int, default=24)
parser.add_argument("--up", default="0,0,1")
parser.add_argument("--centre", default="0,0,0")
parser.add_argument("--samples", type=int)
options = parser.parse_args()

scene = dapple.load(options.scene)
scene.keep_dicing_camera()
centre = np.array([float(x) for x in options.centre.split(",")])
turn = (dapple.translate(*centre) @ dapple.rotate(360 / options.frames, [float(x) for x in options.up.split(",")])
        @ dapple.translate(*-centre))
session = dapple.Session(scene, pixel_samples=options.samples)
os.makedirs(options.output, exist_ok=True)
for frame in range(options.frames):
    dapple.write(os.path.join(options.output, f"{frame:04d}.png"), session.render())
    print(f"frame {frame}: {session.statistics['seconds']:.2f} s, built in {session.statistics['build_seconds']:.2f} s")
    scene.camera.move(turn)
