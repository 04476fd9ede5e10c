#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes a pbrt scene for Dapple from a canopy as the RAMI intercomparison defines it: files that list disks (radius x y z nx ny nz) of a
cloud, and files that list where clouds stand (x y z).

  rami_scene.py --half 50 --ground .159 --cloud SPHERE.def POSITIONS.def REFLECTANCE TRANSMITTANCE > het01.pbrt

The ground is a square of twice --half metres; the sun's zenith angle is --sun. Disk files are named, not copied. After that:

  dapple canopy reflect het01.pbrt --period -50,50,-50,50 --height 30 --principal-plane -75,75,2
"""
import argparse
import math
import os
import sys


def positions(path):
    with open(path, encoding="ascii") as lines:
        for number, line in enumerate(lines, 1):
            words = line.split()
            if not words:
                continue
            try:
                x, y, z = (float(word) for word in words)
            except ValueError:
                sys.exit(f"{path}:{number}: expected x y z, found {line.strip()[:60]!r}")
            yield x, y, z


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--half", type=float, required=True, help="half the length of the plot's side, m")
    parser.add_argument("--ground", type=float, required=True, help="reflectance of the ground, 0 to 1")
    parser.add_argument("--sun", type=float, default=20, help="zenith angle of the sun, degrees; its azimuth is 0")
    parser.add_argument("--cloud", nargs=4, action="append", required=True,
                        metavar=("DISKS", "POSITIONS", "REFLECTANCE", "TRANSMITTANCE"), help="may be repeated")
    options = parser.parse_args()

    sun = math.radians(options.sun)
    half, grey = options.half, options.ground
    print(f"""WorldBegin
LightSource "distant" "rgb L" [ 1 1 1 ] "point3 from" [ {math.sin(sun):.9g} 0 {math.cos(sun):.9g} ] "point3 to" [ 0 0 0 ]
MakeNamedMaterial "ground" "string type" [ "diffuse" ] "rgb reflectance" [ {grey:g} {grey:g} {grey:g} ]
NamedMaterial "ground"
Shape "bilinearmesh" "point3 P" [ {-half:g} {-half:g} 0  {half:g} {-half:g} 0  {-half:g} {half:g} 0  {half:g} {half:g} 0 ]""")
    for index, (disks, places, reflectance, transmittance) in enumerate(options.cloud):
        rho, tau = float(reflectance), float(transmittance)
        print(f"""MakeNamedMaterial "leaf{index}" "string type" [ "diffusetransmission" ] "rgb reflectance" [ {rho:g} {rho:g} {rho:g} ]
  "rgb transmittance" [ {tau:g} {tau:g} {tau:g} ]
ObjectBegin "cloud{index}"
  NamedMaterial "leaf{index}"
  Shape "disks" "string filename" [ "{os.path.abspath(disks)}" ]
ObjectEnd""")
        for x, y, z in positions(places):
            print(f'AttributeBegin  Translate {x:g} {y:g} {z:g}  ObjectInstance "cloud{index}"  AttributeEnd')


if __name__ == "__main__":
    main()
