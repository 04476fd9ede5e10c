# SPDX-License-Identifier: Apache-2.0
"""Made places under a sky, or nearly."""
import math

import room_furniture as f
from rooms_at_home import BLACK, COOL, WARM, basics, light
from scene_writer import Scene


def street(variant):
    """Metres. At night: shining windows, lamps, wet asphalt, cars."""
    s = Scene("street", variant)
    basics(s)
    width, length = s.between(11, 14), s.between(45, 60)
    s.ramp("asphalt tone", "fbm", '"integer octaves" 6', [(.03, .03, .033), (.07, .07, .07)], (.3, .3, .3))
    s.texture("puddles", "float", "fbm", '"integer octaves" 3', (2.5, 2.5, 2.5))
    s.lines.append('Texture "wetness" "float" "remap" "texture in" "puddles" "float inlow" -.4 "float inhigh" .4 "float outlow" .02 "float outhigh" .35')
    s.material("asphalt", "coateddiffuse", '"texture roughness" "wetness"', reflectance="asphalt tone")
    s.diffuse("kerb", (.25, .25, .24))
    s.coated("car glass", BLACK, .01)
    s.diffuse("rubber", BLACK)
    s.infinite((.004, .006, .014))
    s.box("asphalt", (-width / 2 - 3, -6, -.3), (width / 2 + 3, length, 0))
    for side in (-1, 1):
        s.box("kerb", (side * width / 2 - 2.2 if side > 0 else -width / 2, -6, 0), (width / 2 if side > 0 else -width / 2 + 2.2, length, .13))
        y, house = -4, 0
        while y < length:
            front, floors = s.between(8, 13), s.rng.choice((3, 4, 5))
            high = floors * 3.2 + .6
            name = s.diffuse(f"front {side} {house}", s.vary(s.rng.choice([(.45, .36, .28), (.4, .22, .16), (.5, .48, .44), (.35, .38, .36)])))
            columns = int(front / 2.2)
            gap = front / columns
            holes = [(gap * (i + .5) - .55, gap * (i + .5) + .55, 3.2 * k + 1.1, 3.2 * k + 2.7) for i in range(columns) for k in range(floors)]
            start, end = ((width / 2, y), (width / 2, y + front)) if side > 0 else ((-width / 2, y + front), (-width / 2, y))
            s.wall(name, start, end, high, .35, holes)
            with s.at(*start, 0, turn=90 * side):
                s.box(name, (0, -6, high), (front, 0, high + .3))
                s.box("black", (0, -6, 0), (front, -5.9, high))
                for u0, u1, z0, z1 in holes:
                    with s.at(u0, -.2, z0):
                        f.window(s, "white", None, u1 - u0, z1 - z0, 2, 2)
                    if s.rng.random() < .38:
                        with s.glowing(light(s.rng.choice((WARM, WARM, COOL, (1, .6, .3))), s.between(.5, 2.2))):
                            s.quad("bulb", (u1, -.3, z0), (u0, -.3, z0), (u0, -.3, z1), (u1, -.3, z1))
                    else:
                        s.quad("car glass", (u1, -.3, z0), (u0, -.3, z0), (u0, -.3, z1), (u1, -.3, z1))
            y, house = y + front, house + 1
        for i in range(int(length / 12)):
            x, y = side * (width / 2 - 2.0), 3 + 12 * i + (6 if side > 0 else 0)
            s.rod("steel", (x, y, .13), (x, y, 5), .05)
            s.rod("steel", (x, y, 5), (x - side * 1.1, y, 5.2), .035)
            with s.glowing(light((1, .72, .4), s.between(60, 90))):
                s.sphere("bulb", x - side * 1.1, y, 5.05, .14)
    for i in range(9):
        side = s.rng.choice((-1, 1))
        with s.at(side * (width / 2 - 3.3), 4 + 5.4 * i + s.between(-.4, .4), 0, turn=90 * side):
            f.car(s, s.coated(f"paint {i}", s.any_colour(s.between(.1, .6), s.between(0, .8)), .03), "car glass", "rubber", "steel")
    s.box("black", (-width, length, 0), (width, length + .5, 14))
    s.camera((s.between(-1.5, 1.5), -3, 1.7), (0, length * .6, 2.6), 58)
    s.iso = 300
    return s


def cave(variant):
    """Metres. A winding cave with the sun at its mouth; rocks and a pool."""
    s = Scene("cave", variant)
    basics(s)
    length, around, rings = s.between(13, 17), 28, 48
    s.ramp("rock tone", "fbm", '"integer octaves" 6', [(.26, .2, .15), (.45, .37, .29), (.34, .28, .22)], (.8, .8, .4))
    s.diffuse("rock", "rock tone")
    s.coated("water", (.02, .03, .03), .001)
    bend, phase = s.between(.8, 1.4), s.between(0, 6)

    def middle(y):
        return bend * math.sin(2.2 * y / length + phase) - bend * math.sin(2.2 + phase)
    vertices, triangles = [], []
    for j in range(rings + 1):
        y = -1.5 + (length + 1.5) * j / rings
        for i in range(around):
            a = math.tau * i / around
            r = 2.0 + .35 * math.sin(3 * a + y) + .3 * math.sin(.9 * y + 2 * a + phase) + s.between(-.14, .14)
            z = 1.4 + r * math.sin(a) * .9
            vertices.append((middle(y) + r * 1.15 * math.cos(a), y, z if math.sin(a) > -.35 else -.1 + .25 * (z + .4) * s.between(.6, 1.2)))
    for j in range(rings):
        for i in range(around):
            a, b = j * around + i, j * around + (i + 1) % around
            triangles += [(a, b + around, b), (a, a + around, b + around)]
    hub = len(vertices)
    vertices.append((middle(-1.5), -2.2, 1.2))
    triangles += [(hub, i, (i + 1) % around) for i in range(around)]
    s.mesh("rock", vertices, triangles)
    for i in range(45):
        y, size = s.between(1, length + 3), s.between(.08, .4)
        with s.at(middle(min(y, length)) + s.rng.choice((-1, 1)) * s.between(.6, 1.9), y, s.between(0, .1)):
            f.fallen_rock(s, "rock", size)
    for i in range(16):
        y, size = s.between(1.5, length - 1), s.between(.05, .14)
        with s.at(middle(y) + s.between(-1, 1), y, 3.3):
            s.lathe("rock", [(0, -s.between(.5, 1.1)), (size * .5, -.4), (size, 0), (size * 1.3, .3)], 9)
    s.disk("water", middle(length * .45), length * .45, .12, 1.5)
    s.quad("rock", (-60, length, -.3), (60, length, -.3), (60, length + 120, -.3), (-60, length + 120, -.3))
    for i in range(14):
        with s.at(s.between(-25, 25), length + s.between(6, 60), -.5):
            f.fallen_rock(s, "rock", s.between(.5, 3))
    s.sky(s.between(50, 68), s.between(70, 110), light((1, .9, .75), 55), light((.55, .75, 1), 15))
    s.camera((middle(.6), .6, 1.5), (middle(length * .8), length, 1.35), 70)
    s.iso = 700
    return s


def courtyard(variant):
    """Metres. Walls with windows, an arcade, benches and trees in pots, under an overcast sky."""
    s = Scene("courtyard", variant)
    basics(s)
    w, d, h = s.between(12, 16), s.between(16, 20), s.between(9, 12)
    s.ramp("stucco tone", "fbm", '"integer octaves" 5', [s.vary((.62, .48, .32)), s.vary((.7, .58, .4))], (2, 2, 2))
    s.diffuse("stucco", "stucco tone")
    s.tiles("cobble", .22, s.vary((.38, .36, .33)), (.15, .14, .13), "xy", .05)
    s.diffuse("cobbles", "cobble")
    s.material("pane", "thindielectric")
    s.diffuse("shutter", s.any_colour(.3, .6))
    s.coated("pot", (.45, .2, .1), .4)
    s.diffuse("dark", (.1, .09, .08))
    holes = {}
    for side, length in (("n", w), ("s", w), ("e", d), ("w", d)):
        n = int(length / 2.8)
        holes[side] = [(length * (i + .5) / n - .5, length * (i + .5) / n + .5, 3.2 * k + 1, 3.2 * k + 2.5) for i in range(n) for k in range(1, int(h / 3.2))]
    s.room((w, d, h), "stucco", "cobbles", None, holes, .4)
    for side, x, y, turn in (("n", w, d, 180), ("e", w, 0, 90), ("w", 0, d, -90)):
        with s.at(x, y, 0, turn):
            for u0, u1, z0, z1 in holes[side]:
                with s.at(u0, -.2, z0):
                    f.window(s, "white", "pane", u1 - u0, z1 - z0, 2, 2)
                s.box("dark", (u0 - .1, -.6, z0 - .1), (u1 + .1, -.41, z1 + .1))
                for u in (u0 - .5, u1):
                    s.box("shutter", (u, .005, z0), (u + .48, .05, z1))
    s.sky(0, 0, (0, 0, 0), light((.9, .95, 1), s.between(7, 10)), "overcast")
    n = 6
    for i in range(n):
        y = 1 + (d - 2) * i / (n - 1)
        with s.at(w - 2.4, y, 0):
            s.lathe("stucco", [(.3, 0), (.3, .2), (.2, .28), (.19, 2.5), (.3, 2.7), (.3, 2.8)], 20)
    s.box("stucco", (w - 2.7, 0, 2.8), (w, d, 3.1))
    leaf = f.leaf_object(s, "leaf", s.vary((.12, .3, .06)))
    for i in range(6):
        with s.at(s.between(1, w - 4), s.between(5, d - 2), 0):
            f.plant(s, leaf, "pot", s.between(1, 1.8), 40)
    for i in range(3):
        with s.at(1.0, 4 + 4 * i, 0, turn=90):
            f.bench(s, "shutter", 1.6)
    with s.at(w * .4, d * .55, 0):
        s.lathe("stucco", [(1.3, 0), (1.3, .5), (1.15, .5), (1.1, .3), (0, .3)], 28)
        s.disk(s.coated("water", (.03, .05, .05), .01), 0, 0, .42, 1.12)
    s.camera((w * s.between(.2, .35), .8, 1.65), (w * .6, d, 2.4), 66)
    s.iso = 60
    return s


def greenhouse(variant):
    """Metres. Panes on iron bars, benches of plants whose leaves are cut out of quads, sun."""
    s = Scene("greenhouse", variant)
    basics(s)
    w, d, eave, ridge = s.between(5, 6.5), s.between(9, 12), 2.2, s.between(3.4, 4)
    s.material("pane", "thindielectric")
    s.coated("iron", (.7, .71, .68), .3)
    s.coated("pot", (.45, .2, .1), .4)
    s.ramp("gravel tone", "worley", "", [(.4, .37, .32), (.25, .22, .18), (.5, .47, .42)], (.04, .04, .04), 0, 1)
    s.diffuse("gravel", "gravel tone")
    s.wood("planks", s.vary((.45, .33, .22)), along="y")
    s.diffuse("grass", (.12, .2, .05))
    s.quad("grass", (-40, -40, -.05), (40, -40, -.05), (40, 60, -.05), (-40, 60, -.05))
    s.box("gravel", (0, 0, -.1), (w, d, 0))
    s.sky(s.between(30, 55), s.between(20, 160), light((1, .9, .78), 12), light((.55, .75, 1), 3.5))
    n = int(d / .9)
    for i in range(n + 1):
        y = d * i / n
        s.box("iron", (-.03, y - .025, 0), (.03, y + .025, eave))
        s.box("iron", (w - .03, y - .025, 0), (w + .03, y + .025, eave))
        s.rod("iron", (0, y, eave), (w / 2, y, ridge), .03)
        s.rod("iron", (w, y, eave), (w / 2, y, ridge), .03)
        if i < n:
            y1 = d * (i + 1) / n
            for x in (0, w):
                s.quad("pane", (x, y, .4), (x, y1, .4), (x, y1, eave), (x, y, eave))
                s.quad("pane", (x, y, eave), (x, y1, eave), (w / 2, y1, ridge), (w / 2, y, ridge))
                s.box("planks", (x - .05, y, 0), (x + .05, y1, .4))
    for y in (0, d):
        s.mesh("pane", [(0, y, .4), (w, y, .4), (w, y, eave), (w / 2, y, ridge), (0, y, eave)], [(0, 1, 2), (0, 2, 3), (0, 3, 4)])
        s.box("planks", (0, y - .05, 0), (w, y + .05, .4))
        for i in range(1, 6):
            s.rod("iron", (w * i / 6, y, .4), (w * i / 6, y, eave + (ridge - eave) * (1 - abs(i - 3) / 3)), .025)
    for z in (eave,):
        for x in (0, w):
            s.rod("iron", (x, 0, z), (x, d, z), .035)
    s.rod("iron", (w / 2, 0, ridge), (w / 2, d, ridge), .04)
    leaves = [f.leaf_object(s, f"leaf {i}", s.vary((.1, .26, .05), .4)) for i in range(4)]
    for x in (.75, w - .75):
        s.box("planks", (x - .45, .8, .72), (x + .45, d - .8, .76))
        for j in range(5):
            y = 1 + (d - 2.2) * j / 4
            for k in (-.4, .36):
                s.box("planks", (x + k, y, 0), (x + k + .05, y + .05, .72))
        for j in range(int((d - 2) / .55)):
            with s.at(x + s.between(-.15, .15), 1.1 + .55 * j, .76):
                f.plant(s, s.rng.choice(leaves), "pot", s.between(.45, 1.1), 26)
    for j in range(3):
        with s.at(w / 2 + s.between(-.8, .8), d * (.55 + .17 * j), 0):
            f.plant(s, leaves[j], "pot", s.between(1.2, 1.9), 40)
    s.camera((w * s.between(.4, .6), .5, 1.6), (w / 2, d, 1.25), 66)
    s.iso = 45
    return s


KINDS = {"street": street, "cave": cave, "courtyard": courtyard, "greenhouse": greenhouse}
