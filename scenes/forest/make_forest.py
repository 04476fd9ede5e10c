#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes a forest of any number of trees: trees hold branches, branches twigs, twigs leaves.

  make_forest.py wood.txt -o DIR [--trees N] [--kinds K | --distinct | --flat] [--leaves shapes|objects]

DIR/forest.pbrt is the scene. By default a species has K trees (3), each with branches of its own, which all others
share, turned and scaled. With --distinct no two trees are alike: there the branches themselves stand in the scene, in
files of placements of 48 bytes each. Leaves are triangles of their twigs, or with --leaves objects placed one by one,
which is a level more (and slower, since each is a single leaf). With --flat a tree is one object without others in it,
placed by ObjectInstance, which is what `--integrator images` can make images of. The same input gives the same bytes.
"""
import argparse
import array
import math
import os
import random
import struct
import sys
from pathlib import Path

BRANCH_KINDS, TWIG_KINDS, CHUNK, LARGE_MESH = 3, 3, 4096, 3000
COUNTS = {"height": 1, "trunk": 1, "crown": 2, "branches": 2, "twigs": 2, "leaves": 4, "bark": 3, "reflectance": 3,
          "transmittance": 3}


def fail(path, line, what):
    sys.exit(f"{path}:{line}: {what}")


def read_lines(path):
    for number, line in enumerate(Path(path).read_text().splitlines(), 1):
        words = line.split("#")[0].split()
        if words:
            yield number, words


def number(path, line, word):
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        fail(path, line, f"'{word}' is no number")
    return value


def read_species(path):
    species, current = {}, None
    for line, (key, *values) in read_lines(path):
        if key in ("species", "shape") and len(values) != 1:
            fail(path, line, f"expected one word after '{key}'")
        if key == "species":
            current = species[values[0]] = {"name": values[0]}
        elif current is None:
            fail(path, line, f"'{key}' stands before the first species")
        elif key == "shape" and values[0] in ("round", "cone", "column"):
            current[key] = values[0]
        elif key in COUNTS and len(values) == COUNTS[key]:
            current[key] = [number(path, line, v) for v in values]
        else:
            fail(path, line, f"'{key}' is unknown here, or has not its {COUNTS.get(key, '')} numbers")
    for s in species.values():
        missing = [k for k in [*COUNTS, "shape"] if k not in s]
        if missing:
            sys.exit(f"{path}: species {s['name']} has no {', '.join(missing)}")
    return species


def read_wood(path, species):
    wood = {"trees": 100.0, "density": 300.0, "seed": 1.0}
    shares = {}
    for line, (key, *values) in read_lines(path):
        if len(values) != 1:
            fail(path, line, "expected a name and a number")
        value = number(path, line, values[0])
        if value < 0 or (key == "density" and value == 0):
            fail(path, line, f"{key} is {value:g}")
        if key in wood:
            wood[key] = value
        elif key in species:
            shares[key] = value
        else:
            fail(path, line, f"'{key}' is none of trees, density, seed, {', '.join(species)}")
    if not sum(shares.values()) > 0:
        sys.exit(f"{path}: no species has a share")
    return wood, shares


# Maps are tuples of three rows.
def turned(axis, degrees):
    x, y, z = axis
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    t = 1 - c
    return ((t * x * x + c, t * x * y - s * z, t * x * z + s * y, 0.0),
            (t * x * y + s * z, t * y * y + c, t * y * z - s * x, 0.0),
            (t * x * z - s * y, t * y * z + s * x, t * z * z + c, 0.0))


def times(a, b):
    return tuple(tuple(sum(a[r][k] * b[k][c] for k in range(3)) + (a[r][3] if c == 3 else 0) for c in range(4))
                 for r in range(3))


def at(p, m):
    return tuple((*m[r][:3], m[r][3] + p[r]) for r in range(3))


def scaled(m, s):
    return tuple((m[r][0] * s, m[r][1] * s, m[r][2] * s, m[r][3]) for r in range(3))


IDENTITY = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))


class Mesh:
    def __init__(self):
        self.points, self.indices = [], []

    def tube(self, spine, radii, sides):
        first = len(self.points)
        for (x, y, z), r in zip(spine, radii):
            for k in range(sides):
                a = 2 * math.pi * k / sides
                self.points.append((x + r * math.cos(a), y + r * math.sin(a), z))
        for ring in range(len(spine) - 1):
            for k in range(sides):
                a, b = first + ring * sides + k, first + ring * sides + (k + 1) % sides
                self.indices += [a, b, b + sides, a, b + sides, a + sides]

    def leaf(self, m, length, width, fold):
        up = width / 2 * math.sin(math.radians(fold))
        half = width / 2 * math.cos(math.radians(fold))
        corners = [(0, 0, 0), (half, up, 0.45 * length), (0, 0, length), (-half, up, 0.45 * length)]
        first = len(self.points)
        for p in corners:
            self.points.append(tuple(m[r][0] * p[0] + m[r][1] * p[1] + m[r][2] * p[2] + m[r][3] for r in range(3)))
        self.indices += [first, first + 1, first + 2, first, first + 2, first + 3]

    def add(self, other, m):
        first = len(self.points)
        self.points += [tuple(m[r][0] * p[0] + m[r][1] * p[1] + m[r][2] * p[2] + m[r][3] for r in range(3))
                        for p in other.points]
        self.indices += [first + i for i in other.indices]

    def text(self):
        numbers = " ".join(f"{x:.7g}" for p in self.points for x in p)
        return (f'Shape "trianglemesh" "point3 P" [ {numbers} ] "integer indices" [ '
                f'{" ".join(map(str, self.indices))} ]\n')

    def ply(self, path):
        head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(self.points)}\nproperty float x\n"
                f"property float y\nproperty float z\nelement face {len(self.indices) // 3}\n"
                "property list uchar int vertex_indices\nend_header\n")
        with open(path, "wb") as out:
            out.write(head.encode())
            out.write(struct.pack(f"<{3 * len(self.points)}f", *(x for p in self.points for x in p)))
            for i in range(0, len(self.indices), 3):
                out.write(struct.pack("<B3i", 3, *self.indices[i:i + 3]))
        return f'Shape "plymesh" "string filename" "{path.name}"\n'


def instance(name, m):
    columns = [m[r][c] if r < 3 else (1 if c == 3 else 0) for c in range(4) for r in range(4)]
    return (f'AttributeBegin ConcatTransform [ {" ".join(f"{x:.7g}" for x in columns)} ] '
            f'ObjectInstance "{name}" AttributeEnd\n')


class Part:
    """What a definition holds: wood, leaves, and other parts by name."""

    def __init__(self):
        self.wood, self.leaves, self.inner = Mesh(), Mesh(), []

    def text(self, s, name, folder):
        out = ""
        for mesh, material in ((self.wood, "bark"), (self.leaves, "leaf")):
            if mesh.points:
                large = len(mesh.indices) > LARGE_MESH
                shape = mesh.ply(folder / f"{s['name']}-{name}-{material}.ply") if large else mesh.text()
                out += f'NamedMaterial "{s["name"]}-{material}"\n' + shape
        return out + "".join(instance(f"{s['name']}-{name}", m) for name, m in self.inner)

    def flat(self, parts):
        out = Part()
        out.wood.add(self.wood, IDENTITY)
        out.leaves.add(self.leaves, IDENTITY)
        for name, m in self.inner:
            inner = parts[name].flat(parts)
            out.wood.add(inner.wood, m)
            out.leaves.add(inner.leaves, m)
        return out


def twig(s, rng, leaves_are_objects):
    count, length, width, fold = s["leaves"]
    reach = s["twigs"][1]
    part = Part()
    part.wood.tube([(0, 0, 0), (0, 0, 0.9 * reach)], [0.006, 0.002], 3)
    for i in range(int(count)):
        z = reach * (0.1 + 0.9 * (i + rng.random()) / count)
        m = times(turned((0, 0, 1), 137.5 * i + 40 * rng.random()),
                  times(turned((0, 1, 0), 50 + 30 * rng.random()), turned((0, 0, 1), 60 * rng.random() - 30)))
        m = at((0, 0, z), m)
        if leaves_are_objects:
            part.inner.append(("leaf", scaled(m, 0.8 + 0.4 * rng.random())))
        else:
            part.leaves.leaf(m, length * (0.8 + 0.4 * rng.random()), width, fold)
    return part


def branch(s, rng):
    """A branch of 1 m along z, to be scaled; twigs keep their size for branches as long as the crown's radius."""
    length = s["crown"][1]
    bend = [(0.1 * math.sin(2 * t) * rng.uniform(-1, 1), 0.12 * t * t, t) for t in (0, 0.3, 0.6, 1)]
    part = Part()
    part.wood.tube(bend, [0.014, 0.01, 0.006, 0.002], 5)
    count = int(s["twigs"][0])
    for i in range(count):
        t = 0.2 + 0.8 * (i + rng.random()) / count
        m = times(turned((0, 0, 1), 137.5 * i), turned((0, 1, 0), 30 + 35 * rng.random()))
        m = at((0, 0.12 * t * t, t), scaled(m, (0.7 + 0.5 * rng.random()) / length))
        part.inner.append((f"twig-{rng.randrange(TWIG_KINDS)}", m))
    return part


def branches_of(s, rng):
    """Maps of a tree's branches, each with the number of its kind."""
    base, radius = s["crown"]
    height, (count, angle) = s["height"][0], s["branches"]
    for i in range(int(count)):
        h = (i + rng.random()) / count
        reach = {"cone": 1.02 - h, "column": 0.55 + 0.45 * math.sin(math.pi * h),
                 "round": math.sqrt(max(1 - (1.7 * h - 0.7) ** 2, 0.05))}[s["shape"]]
        steep = angle + abs(angle) * h + 25 * h * h + rng.uniform(-8, 8)
        m = times(turned((0, 0, 1), 137.5 * i + rng.uniform(-20, 20)), turned((0, 1, 0), 90 - steep))
        z = height * (base + (0.98 - base) * h)
        yield rng.randrange(BRANCH_KINDS), at((0, 0, z), scaled(m, radius * reach * rng.uniform(0.85, 1.1)))


def trunk(s):
    height, foot = s["height"][0], s["trunk"][0]
    part = Part()
    steps = [0, 0.04, 0.3, 0.65, 1]
    part.wood.tube([(0, 0, height * t) for t in steps], [foot * r for r in (1.3, 1, 0.75, 0.4, 0.04)], 9)
    return part


class Places:
    """A file of placements (docs/guide/scenes.md), written chunk by chunk."""

    def __init__(self, path):
        self.path, self.chunks, self.rows, self.count = path, 0, [], 0
        self.file = open(f"{path}.part", "wb")  # whole or not at all: it may be rendered meanwhile
        self.file.write(bytes(40))

    def add(self, m):
        self.rows.append(m)
        if len(self.rows) == CHUNK:
            self.flush()

    def flush(self):
        if not self.rows:
            return
        origin = [float(round(sum(m[r][3] for m in self.rows) / len(self.rows))) for r in range(3)]
        self.file.write(struct.pack("<3dQ", *origin, len(self.rows)))
        values = array.array("f", (m[r][c] - (origin[r] if c == 3 else 0) for m in self.rows for r in range(3)
                                   for c in range(4)))
        if sys.byteorder == "big":
            values.byteswap()
        values.tofile(self.file)
        self.count += len(self.rows)
        self.chunks += 1
        self.rows = []

    def close(self):
        self.flush()
        self.file.seek(0)
        self.file.write(b"dapple-places".ljust(16, b"\0") + struct.pack("<IIQQ", 1, 0, self.count, self.chunks))
        self.file.close()
        os.replace(self.file.name, self.path)


HEAD = """# {trees} trees on {side:.0f} m x {side:.0f} m, by make_forest.py. z up, metres.
Integrator "path" "integer maxdepth" [ 7 ]
Sampler "independent" "integer pixelsamples" [ 32 ]
PixelFilter "box"
Film "rgb" "integer xresolution" [ 960 ] "integer yresolution" [ 540 ] "string filename" [ "forest.exr" ]
LookAt {x:.6g} {y:.6g} {z:.6g}  0 0 {look:.6g}  0 0 1
Camera "perspective" "float fov" [ 40 ]
WorldBegin
LightSource "distant" "rgb L" [ 3.0 2.8 2.5 ] "point3 from" [ -0.53 -0.37 0.77 ] "point3 to" [ 0 0 0 ]
LightSource "infinite" "rgb L" [ 0.25 0.35 0.55 ]
"""


def write_species(s, rng, options):
    text = (f'MakeNamedMaterial "{s["name"]}-bark" "string type" "diffuse" "rgb reflectance" '
            f'[ {" ".join(map(str, s["bark"]))} ]\n'
            f'MakeNamedMaterial "{s["name"]}-leaf" "string type" "diffusetransmission" "rgb reflectance" '
            f'[ {" ".join(map(str, s["reflectance"]))} ] "rgb transmittance" '
            f'[ {" ".join(map(str, s["transmittance"]))} ]\n')

    parts = {}
    if options.leaves == "objects":
        parts["leaf"] = Part()
        parts["leaf"].leaves.leaf(IDENTITY, *s["leaves"][1:])
    for kind in range(TWIG_KINDS):
        parts[f"twig-{kind}"] = twig(s, rng, options.leaves == "objects")
    for kind in range(BRANCH_KINDS):
        parts[f"branch-{kind}"] = branch(s, rng)
    if options.distinct:
        parts["trunk"] = trunk(s)
    else:
        for kind in range(options.kinds):
            tree = parts[f"tree-{kind}"] = trunk(s)
            tree.inner = [(f"branch-{b}", m) for b, m in branches_of(s, rng)]
    if options.flat:
        parts = {name: part.flat(parts) for name, part in parts.items() if name.startswith("tree")}
    for name, part in parts.items():
        text += f'ObjectBegin "{s["name"]}-{name}"\n{part.text(s, name, options.output)}ObjectEnd\n'
    (options.output / f"{s['name']}.pbrt").write_text(text)


def plant(wood, shares, species, options):
    """Places trees on a jittered lattice; returns the plot's side, and what places them."""
    rng = random.Random(int(wood["seed"]) * 7919 + 1)
    trees = int(wood["trees"])
    side = math.sqrt(max(trees, 1) / wood["density"] * 10000)
    columns = max(math.ceil(math.sqrt(trees)), 1)
    cell = side / columns
    files, text = {}, []

    def add(name, m):
        if options.flat:
            text.append(instance(name, m))
            return
        if name not in files:
            files[name] = Places(options.output / f"{name}.places")
        files[name].add(m)

    names, weights = list(shares), list(shares.values())
    for i in range(trees):
        s = species[rng.choices(names, weights)[0]]
        x = -side / 2 + cell * (i % columns + rng.uniform(0.15, 0.85))
        y = -side / 2 + cell * (i // columns + rng.uniform(0.15, 0.85))
        tree = at((x, y, 0.0), scaled(turned((0, 0, 1), rng.uniform(0, 360)), rng.uniform(0.7, 1.15)))
        if options.distinct:
            add(f"{s['name']}-trunk", tree)
            for branch, m in branches_of(s, rng):
                add(f"{s['name']}-branch-{branch}", times(tree, m))
        else:
            add(f"{s['name']}-tree-{rng.randrange(options.kinds)}", tree)
    for places in files.values():
        places.close()
    text += [f'ObjectInstances "{name}" "string filename" "{name}.places"\n' for name in sorted(files)]
    return side, "".join(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wood", help="what grows: trees, density, seed, and a share for each species")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder")
    parser.add_argument("--species", default=Path(__file__).parent / "species.txt", help="species to draw from")
    parser.add_argument("--trees", type=int, help="in place of the file's")
    parser.add_argument("--kinds", type=int, default=3, help="trees of a species that all others share")
    parser.add_argument("--distinct", action="store_true", help="no two trees are alike")
    parser.add_argument("--flat", action="store_true", help="trees without objects in them")
    parser.add_argument("--leaves", choices=["shapes", "objects"], default="shapes")
    options = parser.parse_args()
    species = read_species(options.species)
    wood, shares = read_wood(options.wood, species)
    if options.trees is not None:
        wood["trees"] = options.trees
    if wood["trees"] < 0 or options.kinds < 1:
        parser.error("expected --trees 0 or more, --kinds 1 or more")
    if options.flat and (options.distinct or options.leaves == "objects"):
        parser.error("--flat has no objects in objects: neither --distinct nor --leaves objects")
    options.output.mkdir(parents=True, exist_ok=True)
    for name in shares:
        write_species(species[name], random.Random(f"{name} {int(wood['seed'])}"), options)
    side, placed = plant(wood, shares, species, options)
    scene = HEAD.format(trees=int(wood["trees"]), side=side, x=0, y=-0.62 * min(side, 300), z=0.2 * min(side, 300) + 8,
                        look=6)
    scene += "".join(f'Include "{name}.pbrt"\n' for name in shares)
    scene += placed
    reach = 2 * side + 1000
    scene += ('Material "diffuse" "rgb reflectance" [ 0.13 0.1 0.07 ]\n'
              f'Shape "bilinearmesh" "point3 P" [ {-reach:.6g} {-reach:.6g} 0  {reach:.6g} {-reach:.6g} 0  '
              f'{-reach:.6g} {reach:.6g} 0  {reach:.6g} {reach:.6g} 0 ]\n')
    (options.output / "forest.pbrt").write_text(scene)


if __name__ == "__main__":
    main()
