# SPDX-License-Identifier: Apache-2.0
"""What stands in made rooms. Each is drawn in its own frame, in metres: on z = 0, its front towards -y."""
import math


def table(s, material, width, depth, height, legs=None):
    legs = legs or material
    s.box(material, (-width / 2, -depth / 2, height - .03), (width / 2, depth / 2, height))
    for x in (-width / 2 + .05, width / 2 - .05):
        for y in (-depth / 2 + .05, depth / 2 - .05):
            s.box(legs, (x - .03, y - .03, 0), (x + .03, y + .03, height - .03))


def chair(s, material, seat=None):
    s.box(seat or material, (-.22, -.22, .43), (.22, .22, .47))
    for x in (-.19, .19):
        s.box(material, (x - .02, -.21, 0), (x + .02, -.17, .43))
        s.box(material, (x - .02, .17, 0), (x + .02, .21, .92))
    for z in (.6, .74, .86):
        s.box(material, (-.17, .18, z), (.17, .2, z + .07))


def swivel_chair(s, cloth, metal):
    s.box(cloth, (-.24, -.24, .44), (.24, .24, .52))
    s.box(cloth, (-.22, .2, .56), (.22, .26, 1.05))
    s.rod(metal, (0, 0, .08), (0, 0, .44), .03)
    for i in range(5):
        a = math.tau * i / 5
        s.rod(metal, (0, 0, .08), (.3 * math.cos(a), .3 * math.sin(a), .04), .02)


def bench(s, material, width):
    s.box(material, (-width / 2, -.22, .4), (width / 2, .22, .46))
    for x in (-width / 2 + .2, width / 2 - .2):
        s.box(material, (x - .04, -.18, 0), (x + .04, .18, .4))


def sofa(s, cloth, width=2.1):
    s.box(cloth, (-width / 2, -.45, .12), (width / 2, .4, .42))
    s.box(cloth, (-width / 2, .2, .42), (width / 2, .45, .85))
    for x in (-width / 2, width / 2 - .18):
        s.box(cloth, (x, -.45, .1), (x + .18, .42, .62))
    for i in range(3):
        with s.at((i - 1) * (width - .4) / 3, .08, .55, turn=s.between(-8, 8), tilt=-18):
            s.box(cloth, (-.27, -.07, -.14), (.27, .07, .2))


def cupboard(s, material, metal, width, depth, height, doors):
    s.box(material, (-width / 2, -depth / 2, .06), (width / 2, depth / 2, height))
    for i in range(doors):
        x = -width / 2 + width * i / doors
        s.box(material, (x + .006, -depth / 2 - .02, .09), (x + width / doors - .006, -depth / 2, height - .03))
        s.sphere(metal, x + width / doors - .06, -depth / 2 - .035, height * .6, .014)


def shelf(s, material, width, depth, height, boards, back=True):
    """Returns the heights on which things stand."""
    for x in (-width / 2, width / 2 - .02):
        s.box(material, (x, -depth / 2, 0), (x + .02, depth / 2, height))
    if back:
        s.box(material, (-width / 2, depth / 2 - .01, 0), (width / 2, depth / 2, height))
    heights = [.06 + (height - .08) * i / boards for i in range(boards + 1)]
    for z in heights:
        s.box(material, (-width / 2 + .02, -depth / 2, z - .02), (width / 2 - .02, depth / 2 - .01, z))
    return heights[:-1]


def books(s, names, width, depth, height, fill=.95):
    """Instances of book objects, each 1 x 1 x 1 about its lower front corner, side by side along x."""
    x = -width / 2
    while True:
        thick, tall, deep = s.between(.012, .05), height * s.between(.62, .95), depth * s.between(.6, .9)
        if x + thick > width / 2:
            return
        if s.rng.random() < fill:
            s.place(s.rng.choice(names), x, -depth / 2 + .02, 0, scale=(thick * .97, deep, tall))
            x += thick
        else:
            x += s.between(.05, .25)


def book_objects(s, count):
    """Definitions for `books`: a spine and covers about pages."""
    s.diffuse("pages", (.75, .72, .62))
    names = []
    for i in range(count):
        cover = s.coated(f"cover {i}", s.any_colour(s.between(.15, .6), s.between(.2, .8)), s.between(.15, .5))
        names.append(f"book {i}")
        with s.object(names[-1]):
            s.box(cover, (0, 0, 0), (1, .04, 1))
            s.box(cover, (0, .04, 0), (.08, 1, 1))
            s.box(cover, (.92, .04, 0), (1, 1, 1))
            s.box("pages", (.08, .04, .02), (.92, .97, .98))
    return names


def picture(s, canvas, frame, width, height):
    """Hangs on the plane y = 0, its middle at the origin."""
    s.quad(canvas, (-width / 2, -.02, -height / 2), (width / 2, -.02, -height / 2), (width / 2, -.02, height / 2), (-width / 2, -.02, height / 2))
    for z in (-height / 2 - .04, height / 2):
        s.box(frame, (-width / 2 - .04, -.045, z), (width / 2 + .04, 0, z + .04))
    for x in (-width / 2 - .04, width / 2):
        s.box(frame, (x, -.045, -height / 2), (x + .04, 0, height / 2))


def window(s, frame, pane, width, height, columns=2, rows=1, depth=.06):
    """In the plane y = 0, from x = 0 and z = 0; `pane` may be nothing."""
    for i in range(columns + 1):
        x = (width - .05) * i / columns
        s.box(frame, (x, -depth / 2, 0), (x + .05, depth / 2, height))
    for i in range(rows + 1):
        z = (height - .05) * i / rows
        s.box(frame, (.05, -depth / 2 + .002, z), (width - .05, depth / 2 - .002, z + .05))
    if pane:
        s.quad(pane, (.02, 0, .02), (width - .02, 0, .02), (width - .02, 0, height - .02), (.02, 0, height - .02))


def door(s, material, metal, width=.9, height=2.05):
    """In the plane y = 0, hinged at x = 0."""
    s.box(material, (0, 0, .01), (width, .04, height))
    for z in (.15, 1.1):
        s.box(material, (.12, -.01, z), (width - .12, .05, z + .8))
    for y in (-.06, .1):
        s.sphere(metal, width - .07, y, 1.02, .03)
        s.rod(metal, (width - .07, y, 1.02), (width - .07, .02, 1.02), .01)


def shaded_lamp(s, shade, metal, radiance, height=1.5, radius=.22, bulb="bulb"):
    """A standing lamp: a translucent shade about a bulb."""
    s.disk(metal, 0, 0, .02, .14)
    s.rod(metal, (0, 0, 0), (0, 0, height - .25), .012)
    s.lathe(shade, [(radius, height - .3), (radius * .75, height)], 32)
    with s.glowing(radiance):
        s.sphere(bulb, 0, 0, height - .15, .04)


def pendant(s, material, radiance, drop, radius=.2, bulb="bulb"):
    """Hangs from the origin: a metal cone, open below, and a bulb."""
    s.rod(material, (0, 0, 0), (0, 0, -drop + .16), .006)
    s.lathe(material, [(radius, -drop), (.05, -drop + .16), (.0, -drop + .17), (.045, -drop + .155), (radius - .005, -drop)], 32)
    with s.glowing(radiance):
        s.sphere(bulb, 0, 0, -drop + .06, .035)


def plant(s, leaf, pot, height, leaves):
    """A pot with leaves, each a quad that its material's alpha cuts out."""
    s.lathe(pot, [(0, 0), (.11, 0), (.15, .26), (.135, .26), (.12, .22), (0, .22)], 20)
    for i in range(leaves):
        z = .25 + (height - .3) * i / leaves
        s.place(leaf, 0, 0, z, turn=137.5 * i + s.between(-20, 20), tilt=s.between(-10, 55) * (1 - .4 * i / leaves), scale=s.between(.7, 1.2) * (.25 + .3 * height))


def leaf_object(s, name, colour):
    """A leaf of 1 x .4 from the origin along +y, cut out by a pattern."""
    for axis, mapped in (("u", "x"), ("v", "y")):
        s.lines += [f'Texture "{name} {mapped}" "float" "coordinate" "string which" "{axis}"',
                    f'Texture "{name} {mapped} c" "float" "subtract" "texture in1" "{name} {mapped}" "float in2" .5',
                    f'Texture "{name} {mapped} s" "float" "multiply" "texture in1" "{name} {mapped} c" "texture in2" "{name} {mapped} c"']
    s.lines += [f'Texture "{name} r" "float" "add" "texture in1" "{name} x s" "texture in2" "{name} y s"',
                f'Texture "{name} alpha" "float" "ifgreater" "texture value1" "{name} r" "float value2" .23 "float in1" 0 "float in2" 1']
    s.material(name + " green", "diffusetransmission", reflectance=colour, transmittance=tuple(.6 * c for c in colour))
    with s.object(name):
        vertices = [(-.2, 0, 0), (.2, 0, 0), (-.24, .5, .14), (.24, .5, .14), (-.15, 1, .02), (.15, 1, .02)]
        uv = [(0, 0), (1, 0), (0, .5), (1, .5), (0, 1), (1, 1)]
        s.mesh(name + " green", vertices, [(0, 1, 3), (0, 3, 2), (2, 3, 5), (2, 5, 4)], uv=uv, more=f' "texture alpha" "{name} alpha"')
    return name


def glass_profile(kind, height, radius, wall=.0025):
    """Closed profiles of drinking glasses for `Scene.lathe`."""
    if kind == "tumbler":
        return [(0, 0), (radius * .8, 0), (radius, height), (radius - wall, height), (radius * .8 - wall, .012), (0, .012)]
    if kind == "bowl":
        outer = [(radius * math.sin(t), height * (1 - math.cos(t))) for t in (i * math.pi / 16 for i in range(9))]
        return outer + [(max(0, (radius - wall * 2) * math.sin(t)), wall * 2 + (height - wall * 2) * (1 - math.cos(t)))
                        for t in (i * math.pi / 16 for i in range(8, -1, -1))]
    stem = height * .45
    cup = [(radius * math.sin(t), stem + (height - stem) * (1 - math.cos(t)) / 1.3) for t in (i * math.pi / 14 for i in range(1, 10))]
    inner = [((radius - wall) * math.sin(t), stem + .006 + (height - stem - .006) * (1 - math.cos(t)) / 1.3) for t in (i * math.pi / 14 for i in range(9, 0, -1))]
    return [(0, 0), (radius * .85, 0), (radius * .8, .003), (.006, .009), (.004, stem * .5), (.005, stem * .96)] + cup + inner + [(0, stem + .006)]


def bottle_profile(height, radius, wall=.003):
    """A closed profile of a bottle with an open neck."""
    neck = radius * .35
    outer = [(0, 0), (radius, 0), (radius, height * .6), (radius * .8, height * .7), (neck, height * .8), (neck, height)]
    return outer + [(neck - wall, height), (neck - wall, height * .8), (radius * .8 - wall, height * .695), (radius - wall, height * .595), (radius - wall, wall), (0, wall)]


def plate(s, material, radius):
    s.lathe(material, [(0, 0), (radius * .6, 0), (radius, .02), (radius * .98, .024), (radius * .58, .006), (0, .006)], 36)


def radiator(s, material, width, height=.6):
    for i in range(int(width / .05)):
        x = -width / 2 + .05 * i
        s.box(material, (x, -.05, .1), (x + .035, .05, .1 + height))
    for z in (.13, height + .05):
        s.rod(material, (-width / 2, 0, z), (width / 2, 0, z), .015)


def car(s, paint, glass, rubber, metal):
    """4.3 m long along x."""
    profile = [(-2.15, .35), (2.15, .35), (2.15, .75), (1.2, .88), (.6, 1.4), (-1.0, 1.45), (-1.8, .95), (-2.15, .9)]
    vertices = [(x, y, z) for y in (-.85, .85) for x, z in profile]
    n = len(profile)
    sides = [(0, i, i + 1) for i in range(1, n - 1)]
    triangles = sides + [(a + n, c + n, b + n) for a, b, c in sides]
    for i in range(n):
        j = (i + 1) % n
        triangles += [(i, i + n, j + n), (i, j + n, j)]
    s.mesh(paint, vertices, triangles)
    for y in (-.856, .856):
        s.mesh(glass, [(-1.5, y, .95), (1.0, y, .95), (.55, y, 1.33), (-.95, y, 1.37)], [(0, 1, 2), (0, 2, 3)])
    for x in (-1.35, 1.35):
        for y in (-.87, .67):
            s.rod(rubber, (x, y, .32), (x, y + .2, .32), .32)
            with s.at(x, y + (.2 if y > 0 else 0), .32, tilt=90):
                s.disk(metal, 0, 0, 0, .31)


def fallen_rock(s, material, radius, around=10, rough=.25):
    """A stone of one mesh, with its middle at the origin."""
    rings = around // 2
    vertices = [(0, 0, -radius * .8)]
    for j in range(1, rings):
        t = math.pi * j / rings
        for i in range(around):
            r = radius * s.between(1 - rough, 1 + rough)
            vertices.append((r * math.sin(t) * math.cos(math.tau * i / around), r * math.sin(t) * math.sin(math.tau * i / around), -.8 * r * math.cos(t)))
    vertices.append((0, 0, radius * .8))
    triangles, last = [], len(vertices) - 1
    for i in range(around):
        k = (i + 1) % around
        triangles += [(0, 1 + k, 1 + i), (last, last - around + i, last - around + k)]
        for j in range(rings - 2):
            a, b = 1 + j * around + i, 1 + j * around + k
            triangles += [(a, b, b + around), (a, b + around, a + around)]
    s.mesh(material, vertices, triangles)
