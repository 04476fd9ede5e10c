# SPDX-License-Identifier: Apache-2.0
"""Made rooms as they are lived in, and small sets of things."""
import math

import room_furniture as f
from scene_writer import Scene

BLACK = (.02, .02, .02)
WARM, COOL = (1, .78, .5), (.85, .93, 1)


def light(colour, amount):
    return tuple(c * amount for c in colour)


def basics(s):
    s.diffuse("bulb", BLACK)
    s.diffuse("white", (.8, .79, .76))
    s.material("steel", "conductor", '"float roughness" .1', reflectance=(.62, .61, .6))
    s.diffuse("black", BLACK)


def attic(variant):
    """Inches. Sun through a small window in the gable; boxes and trunks under beams."""
    s = Scene("attic", variant, unit=39.37)
    basics(s)
    length, half, knee, ridge = s.between(6.5, 8.5), s.between(2.2, 2.6), .9, s.between(2.9, 3.3)
    s.wood("boards", s.vary((.42, .29, .17)), along="y")
    s.wood("beam", s.vary((.33, .21, .12)), along="y")
    s.diffuse("card", s.vary((.5, .37, .22)))
    s.coated("trunk", s.vary((.2, .1, .06)), .25)
    s.diffuse("plaster", s.vary((.62, .56, .48)))
    s.diffuse("sheet", (.7, .69, .66))
    s.sky(s.between(52, 64), s.between(80, 100), light((1, .88, .7), 30), light((.5, .7, 1), 6))
    window = (half + s.between(-.6, -.1), half + s.between(.3, .6), 1.3, 2.25)
    s.box("boards", (-half, 0, -.1), (half, length, 0))
    for side in (-1, 1):
        s.box("plaster", (min(side * half, side * half + side * .1), 0, 0), (max(side * half, side * half + side * .1), length, knee))
        run, rise = half, ridge - knee
        with s.at(side * half, 0, knee, roll=side * math.degrees(math.atan2(rise, run))):
            slope = math.hypot(run, rise)
            s.box("boards", (-slope if side > 0 else 0, 0, 0), (0 if side > 0 else slope, length, .08))
            for i in range(7):
                y = .3 + (length - .6) * i / 6
                s.box("beam", (-slope if side > 0 else 0, y - .05, -.12), (0 if side > 0 else slope, y + .05, 0))
    s.wall("plaster", (half, length), (-half, length), ridge, .15, [window])
    s.wall("plaster", (-half, 0), (half, 0), ridge, .15)
    with s.at(half - window[0], length + .05, window[2], turn=180):
        f.window(s, "beam", None, window[1] - window[0], window[3] - window[2], 2, 2)
    for i in range(5):
        y = 1 + (length - 1.6) * i / 4
        s.box("beam", (-half * .75, y - .06, 2.05), (half * .75, y + .06, 2.17))
    for i in range(26):
        x = s.rng.choice((-1, 1)) * s.between(.7, half - .35)
        y, size = s.between(1.6, length - .5), s.between(.25, .6)
        s.block("card", x, y, 0, size, size * s.between(.7, 1.3), size * s.between(.5, 1), turn=s.between(0, 90))
        if s.rng.random() < .4:
            s.block("card", x, y, size * .75, size * .6, size * .6, size * .5, turn=s.between(0, 90))
    for x, y in ((-.9, length - 1.2), (1.1, length - 2.3)):
        s.block("trunk", x, y, 0, 1, .55, .5, turn=s.between(-25, 25))
    with s.at(.9, length - 1.1, 0, turn=s.between(0, 360)):
        f.chair(s, "beam")
    with s.at(-1.3, length - 2.6, 0, turn=s.between(0, 90)):
        f.table(s, "beam", .9, .6, .7)
        s.sphere("steel", .1, 0, .82, .12)
    s.camera((s.between(-.4, .4), .5, 1.6), (0, length, 1.05), 62)
    s.iso = 800
    return s


def bathroom(variant):
    """Centimetres. Glossy tiles, a mirror, chrome, a glass shower screen."""
    s = Scene("bathroom", variant, unit=100)
    basics(s)
    w, d, h = s.between(2.4, 3.2), s.between(2.8, 3.6), 2.5
    joint = (.55, .53, .5)
    tile = s.vary(s.rng.choice([(.75, .75, .72), (.35, .5, .52), (.6, .5, .4), (.25, .33, .42)]))
    for name, axes, size in (("tile xz", "xz", .15), ("tile yz", "yz", .15), ("tile xy", "xy", s.between(.2, .4))):
        s.tiles(name, size, tile if "z" in axes else s.vary((.3, .29, .28)), joint, axes)
        s.coated(name + " glazed", name, .03)
    s.material("mirror", "conductor", '"float roughness" 0', reflectance=(.9, .9, .9))
    s.material("chrome", "conductor", '"spectrum eta" "metal-Ag-eta" "spectrum k" "metal-Ag-k" "float roughness" .02')
    s.material("screen", "thindielectric")
    s.coated("ceramic", (.82, .82, .8), .02)
    s.diffuse("towel", s.any_colour(.6))
    s.material("frosted", "diffusetransmission", reflectance=(.25, .25, .25), transmittance=(.6, .62, .64))
    s.box("tile xy glazed", (0, 0, -.1), (w, d, 0))
    s.box("white", (0, 0, h), (w, d, h + .1))
    u = s.between(.5, w - 1.4)
    s.wall("tile xz glazed", (w, d), (0, d), h, .12, [(u, u + .8, 1.2, 2.1)])
    s.quad("frosted", (w - u - .8, d + .05, 1.2), (w - u, d + .05, 1.2), (w - u, d + .05, 2.1), (w - u - .8, d + .05, 2.1))
    s.wall("tile xz glazed", (0, 0), (w, 0), h, .12)
    s.wall("tile yz glazed", (w, 0), (w, d), h, .12)
    s.wall("tile yz glazed", (0, d), (0, 0), h, .12)
    s.infinite(light(COOL, 3))
    for x, y in ((w * .3, d * .35), (w * .7, d * .35), (w * .5, d * .75)):
        s.panel("bulb", (x, y, h - .004), .09, .09, light(WARM, 60))
    y0 = s.between(.9, 1.3)
    s.box("mirror", (.012, y0 - .5, 1.05), (.02, y0 + .5, 1.95))
    with s.glowing(light(WARM, 25)):
        s.rod("bulb", (.06, y0 - .35, 2.03), (.06, y0 + .35, 2.03), .018)
    s.box("ceramic", (0, y0 - .45, .78), (.5, y0 + .45, .86))
    with s.at(.27, y0, .86):
        s.lathe("ceramic", [(.12, 0), (.19, .1), (.185, .1), (.11, .01), (0, .01)], 32)
    s.rod("chrome", (.05, y0, .86), (.05, y0, 1.08), .014)
    s.rod("chrome", (.05, y0, 1.07), (.2, y0, 1.04), .011)
    for i in range(4):
        flask = s.coated(f"flask {i}", s.any_colour(.5), .1)
        with s.at(.08 + .07 * (i // 2), y0 + .28 + .07 * (i % 2), .86):
            s.lathe(flask, [(0, 0), (.025, 0), (.025, .1 + .02 * i), (.01, .13 + .02 * i), (0, .13 + .02 * i)], 16)
    with s.at(w - .42, d - 1.0, 0, scale=(.58, 1.3, 1)):
        s.lathe("ceramic", [(.66, 0), (.66, .5), (.7, .56), (.7, .58), (.62, .56), (.5, .1), (0, .1)], 40)
    s.rod("chrome", (w - .04, d - .9, .75), (w - .2, d - .9, .72), .014)
    s.quad("screen", (w - .85, d - .9, .55), (w - .85, d - .05, .55), (w - .85, d - .05, 2.0), (w - .85, d - .9, 2.0))
    s.rod("chrome", (w - .85, d - .9, .55), (w - .85, d - .9, 2.0), .01)
    s.rod("chrome", (.04, d - .9, 1.2), (.04, d - .2, 1.2), .011)
    s.box("towel", (.03, d - .75, .62), (.055, d - .35, 1.21))
    s.block("towel", w - .3, .6, 0, .4, .3, .45)
    s.camera((w * .78, .25, 1.5), (w * .3, d, 1.0), 72)
    s.iso = 400
    return s


def living_room(variant):
    """Metres. At night: bulbs in translucent shades, a sofa, shelves of books, a rug."""
    s = Scene("living_room", variant)
    basics(s)
    w, d, h = s.between(5, 6.5), s.between(4.4, 5.4), s.between(2.5, 2.9)
    s.diffuse("wall", s.vary((.68, .6, .48)))
    s.wood("parquet", s.vary((.45, .28, .15)), .2)
    s.wood("oak", s.vary((.5, .34, .19)), .3, "z")
    s.diffuse("cloth", s.any_colour(.4, .5))
    s.checks("rug squares", s.between(.15, .4), s.any_colour(.5), s.any_colour(.25))
    s.diffuse("rug", "rug squares")
    s.material("shade", "diffusetransmission", reflectance=(.45, .42, .36), transmittance=(.45, .38, .27))
    s.infinite((.004, .006, .012))
    u = s.between(1.5, 2.5)
    s.room((w, d, h), "wall", "parquet", "white", {"n": [(u, u + 1.6, .9, 2.2)]})
    with s.at(w - u, d + .1, .9, turn=180):
        f.window(s, "white", None, 1.6, 1.3, 2, 1)
    s.box("rug", (w * .25, d * .25, 0), (w * .75, d * .7, .012))
    with s.at(w * .5, d * .78, 0):
        f.sofa(s, "cloth")
    with s.at(w * .5, d * .48, .012):
        f.table(s, "oak", 1.1, .6, .42)
        for i in range(5):
            s.block(s.diffuse(f"magazine {i}", s.any_colour(.5)), s.between(-.35, .35), s.between(-.15, .15), .42 + .006 * i, .21, .28, .005, s.between(0, 90))
    volumes = f.book_objects(s, 10)
    with s.at(.2, d * .5, 0, turn=90):
        for i, z in enumerate(f.shelf(s, "oak", 2, .3, 2.1, 6)):
            with s.at(0, 0, z):
                f.books(s, volumes, 1.9, .28, .3, .85)
    for x, y, height in ((.8, d - .5, s.between(1.4, 1.7)), (w - .6, d * .6, s.between(1.3, 1.6)), (w * .15, .9, s.between(1.2, 1.5))):
        with s.at(x, y, 0):
            f.shaded_lamp(s, "shade", "steel", light(WARM, s.between(250, 420)), height)
    for i in range(4):
        canvas = s.diffuse(f"print {i}", s.any_colour(.5, .7))
        with s.at(w - .005, .9 + i * .8, s.between(1.5, 1.65), turn=-90):
            f.picture(s, canvas, "black", .5, s.between(.35, .6))
    with s.at(w - 1.2, d * .3, 0, turn=s.between(-110, -60)):
        f.sofa(s, "cloth", 1.0)
    s.camera((w * .42, .25, 1.45), (w * .5, d, .95), 75)
    s.iso = 130
    return s


def dining_room(variant):
    """Centimetres. Pendants over a laid table; wood everywhere."""
    s = Scene("dining_room", variant, unit=100)
    basics(s)
    w, d, h = s.between(4, 5), s.between(4.5, 5.5), 2.7
    s.diffuse("wall", s.vary((.55, .58, .52)))
    s.wood("floor", s.vary((.38, .24, .14)), .15, "y")
    s.wood("walnut", s.vary((.3, .17, .09)), .12)
    s.wood("beech", s.vary((.55, .38, .23)), along="z")
    s.coated("porcelain", (.8, .8, .78), .03)
    s.material("glass", "dielectric", '"float eta" 1.5')
    s.coated("enamel", s.any_colour(.35, .7), .15)
    s.infinite(light(COOL, .12))
    u = s.between(.8, 1.6)
    s.room((w, d, h), "wall", "floor", "white", {"e": [(u, u + 1.8, .9, 2.2)]})
    with s.at(w + .1, u, .9, turn=90):
        f.window(s, "white", None, 1.8, 1.3, 3, 1)
    places = s.rng.choice((3, 4))
    length = .65 * places + .3
    cx, cy = w / 2, d * .52
    for i in range(3):
        with s.at(cx, cy + (i - 1) * length / 3, h):
            f.pendant(s, "enamel", light(WARM, 650), s.between(1.05, 1.2), s.between(.14, .2))
    with s.at(cx, cy, 0, turn=90):
        f.table(s, "walnut", length, .9, .75)
    for i in range(places):
        for side in (-1, 1):
            y = cy + (i - (places - 1) / 2) * .65
            with s.at(cx + side * s.between(.5, .7), y, 0, turn=-90 * side + s.between(-12, 12)):
                f.chair(s, "beech", "walnut")
            with s.at(cx + side * .3, y, .75):
                f.plate(s, "porcelain", .13)
            with s.at(cx + side * .16, y + .17, .75):
                s.lathe("glass", f.glass_profile("stem" if i % 2 else "tumbler", .19 if i % 2 else .11, .036), 28)
            for k in (-.16, .16):
                s.block("steel", cx + side * .3, y + k, .75, .2, .018, .003)
    with s.at(cx, cy, .75):
        s.lathe("porcelain", f.glass_profile("bowl", .1, .14, .004), 32)
        for i in range(5):
            s.sphere(s.coated(f"fruit {i}", s.vary((.6, .25, .06), .4), .2), .055 * math.cos(i * 1.257), .055 * math.sin(i * 1.257), .062, .038)
    with s.at(w * .5, d - .25, 0):
        f.cupboard(s, "walnut", "steel", 2, .45, .9, 4)
        for i in range(4):
            with s.at(-.7 + .45 * i, 0, .9):
                s.lathe("glass" if i % 2 else "porcelain", f.bottle_profile(s.between(.2, .32), .045), 24)
    for i in range(3):
        canvas = s.diffuse(f"canvas {i}", s.any_colour(.5, .6))
        with s.at(w * (.25 + .25 * i), d - .005, 1.6):
            f.picture(s, canvas, "beech", .6, .45)
    s.camera((.4, .35, 1.55), (w * .58, d * .6, .85), 64)
    s.iso = 200
    return s


def door_ajar(variant):
    """Metres. A door ajar between a lit room and the dark one in which we stand."""
    s = Scene("door_ajar", variant)
    basics(s)
    s.diffuse("paint", s.vary((.65, .63, .58)))
    s.wood("floor", s.vary((.4, .27, .17)), .25, "y")
    s.coated("door", s.vary((.55, .5, .42)), .2)
    s.diffuse("cloth", s.any_colour(.35))
    s.wood("oak", s.vary((.5, .34, .2)), along="z")
    w, d, h = s.between(3.6, 4.4), s.between(3.6, 4.2), 2.5
    u = s.between(1.0, w - 1.9)
    hole = (u, u + .9, 0, 2.05)
    s.room((w, d, h), "paint", "floor", "white", {"n": [hole]}, .12)
    with s.at(0, d + .12, 0):
        back = (w - u - .9, w - u, 0, 2.05)
        s.box("floor", (-.5, 0, -.12), (w + .5, 3.5, 0))
        s.box("white", (-.5, -.001, h), (w + .5, 3.5, h + .1))
        s.wall("paint", (w + .5, 3.5), (-.5, 3.5), h, .1)
        s.wall("paint", (w + .5, 0), (w + .5, 3.5), h, .1)
        s.wall("paint", (-.5, 3.5), (-.5, 0), h, .1)
        s.panel("bulb", (w / 2, 1.8, h - .02), .6, .6, light((1, .9, .75), 40))
        with s.at(back[0] - .02, 3.2, 0):
            f.cupboard(s, "oak", "steel", 1.4, .4, 1.9, 3)
    with s.at(w - u - .9, d + .02, 0, turn=s.between(30, 60)):
        f.door(s, "door", "steel", .88, 2.03)
    with s.at(w - .7, d * .45, 0, turn=-90):
        f.sofa(s, "cloth", 1.9)
    volumes = f.book_objects(s, 6)
    with s.at(.2, d * .6, 0, turn=90):
        for z in f.shelf(s, "oak", 1.4, .3, 1.9, 5):
            with s.at(0, 0, z):
                f.books(s, volumes, 1.3, .28, .33, .8)
    with s.at(w * .5, d * .4, 0, turn=s.between(0, 90)):
        f.table(s, "oak", .9, .6, .45)
        s.sphere("steel", 0, 0, .53, .08)
    for i in range(2):
        canvas = s.diffuse(f"canvas {i}", s.any_colour(.5, .7))
        with s.at(w - .005, d * (.5 + .25 * i), 1.5, turn=-90):
            f.picture(s, canvas, "black", .5, .6)
    s.camera((w * .5, .2, 1.5), (w * .5, d, 1.1), 74)
    s.iso = 1600
    return s


def kitchen_shelf(variant):
    """Centimetres. Close to a shelf of glasses and jars, light from a window and from a strip under the board above."""
    s = Scene("kitchen_shelf", variant, unit=100)
    basics(s)
    s.wood("board", s.vary((.48, .33, .2)), .2)
    s.tiles("wall tiles", .1, s.vary((.66, .68, .66)), (.4, .4, .38), "xz", .03)
    s.coated("tiles", "wall tiles", .05)
    s.material("glass", "dielectric", '"float eta" 1.5')
    s.coated("porcelain", (.8, .79, .76), .04)
    s.diffuse("counter", s.vary((.3, .3, .31)))
    s.material("copper", "conductor", '"spectrum eta" "metal-Cu-eta" "spectrum k" "metal-Cu-k" "float roughness" .08')
    s.room((2.6, 2.2, 2.4), "white", "counter", "white", {"w": [(.5, 1.6, .9, 2.0)]}, .15)
    s.infinite(light(COOL, 2.2))
    s.box("tiles", (0, 2.18, .9), (2.6, 2.2, 2.0))
    s.box("counter", (0, 1.6, .86), (2.6, 2.2, .9))
    for z in (1.3, 1.62):
        s.box("board", (.3, 1.96, z), (2.3, 2.18, z + .025))
        with s.glowing(light(WARM, s.between(9, 15))):
            s.quad("bulb", (.4, 2.0, z - .003), (.4, 2.012, z - .003), (2.2, 2.012, z - .003), (2.2, 2.0, z - .003))
    x = .4
    while x < 2.2:
        what = s.rng.choice(("stem", "tumbler", "tumbler", "jar", "bottle", "cup", "bowl"))
        for z in (1.325, 1.645):
            with s.at(x + s.between(-.01, .01), 2.07 + s.between(-.03, .03), z):
                if what in ("stem", "tumbler", "bowl"):
                    height = {"stem": .2, "tumbler": .12, "bowl": .06}[what]
                    s.lathe("glass" if z < 1.5 or what == "stem" else "porcelain", f.glass_profile(what, height, .035 if what != "bowl" else .06), 28)
                elif what == "bottle":
                    s.lathe("glass", f.bottle_profile(.24, .035), 24)
                elif what == "jar":
                    s.lathe("copper" if z > 1.5 else "porcelain", [(0, 0), (.05, 0), (.05, .12), (.045, .13), (.045, .14), (0, .145)], 28)
                else:
                    s.lathe(s.coated(f"cup {s.count}", s.any_colour(.5), .05), f.glass_profile("tumbler", .09, .042, .004), 28)
        x += .11 if what != "bowl" else .14
    for i in range(6):
        with s.at(.5 + .3 * i + s.between(-.05, .05), 1.95 + s.between(-.08, .1), .9):
            if i % 3:
                for k in range(5):
                    with s.at(0, 0, .014 * k):
                        f.plate(s, "porcelain", .11)
            else:
                s.lathe("steel", [(0, 0), (.09, 0), (.09, .13), (.087, .13), (.087, .004), (0, .004)], 36)
    s.camera((s.between(1.0, 1.5), 1.15, 1.5), (1.3, 2.1, 1.38), 52)
    s.iso = 150
    return s


def product_shot(variant):
    """Centimetres. Glossy things on a curved backdrop between softboxes."""
    s = Scene("product_shot", variant, unit=100)
    basics(s)
    paper = s.diffuse("paper", s.vary((.6, .6, .6), .3))
    arc = [(.9 + .5 * math.sin(t), .5 * (1 - math.cos(t))) for t in (i * math.pi / 24 for i in range(13))]
    profile = [(-1.5, 0)] + arc + [(1.4, 2.2)]
    vertices = [(x, y, z) for x in (-2, 2) for y, z in profile]
    n = len(profile)
    normals = [(0, 0, 1)] + [(0, -math.sin(i * math.pi / 24), math.cos(i * math.pi / 24)) for i in range(13)] + [(0, -1, 0)]
    s.mesh(paper, vertices, [t for i in range(n - 1) for t in ((i, i + n, i + n + 1), (i, i + n + 1, i + 1))], normals * 2)
    s.box("black", (-2.5, -2.5, -.1), (2.5, 2.5, -.01))
    s.infinite((.05, .05, .055))
    for side, strength in ((-1, s.between(7, 11)), (1, s.between(2, 5))):
        with s.at(side * 1.1, -.3, 1.0, turn=side * s.between(50, 75)):
            width, height = s.between(.5, .8), s.between(.7, 1.0)
            with s.glowing(light((1, .98, .95), strength)):
                s.quad("bulb", (-width / 2, 0, -height / 2), (-width / 2, 0, height / 2), (width / 2, 0, height / 2), (width / 2, 0, -height / 2))
            s.box("black", (-width / 2, -.2, -height / 2), (width / 2, -.01, height / 2))
    s.panel("bulb", (0, .3, 1.7), .9, .5, (3, 3, 3.1))
    s.material("glass", "dielectric", '"float eta" 1.52')
    s.material("gold", "conductor", '"spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "float roughness" .12')
    lacquer = s.material("lacquer", "openpbr", '"float coat_weight" 1 "float coat_roughness" .02 "float specular_roughness" .3', base_color=s.any_colour(.5, .8))
    metal = s.material("flake", "openpbr", '"float base_metalness" 1 "float specular_roughness" .25', base_color=s.any_colour(.7, .5))
    rubber = s.material("rubber", "openpbr", '"float specular_roughness" .7 "float base_diffuse_roughness" .6', base_color=(.05, .05, .055))
    names = [lacquer, metal, rubber, "gold", "steel", "glass"]
    s.diffuse("liquid", s.any_colour(.6, .7))
    with s.at(s.between(-.1, .1), .15, 0):
        s.lathe("glass", f.bottle_profile(.2, .05, .006), 40)
        s.lathe("liquid", [(0, .008), (.042, .008), (.042, .11), (0, .11)], 40)
        s.lathe("gold", [(.024, .2), (.024, .24), (0, .242)], 32)
    for i in range(26):
        a, r = s.between(0, math.tau), s.between(.12, .5)
        x, y, size = r * math.cos(a), .15 + r * math.sin(a) * .8, s.between(.012, .05)
        name = s.rng.choice(names)
        if s.rng.random() < .45:
            s.sphere(name, x, y, size, size)
        elif s.rng.random() < .6:
            s.block(name, x, y, 0, size * 2, size * 1.5, size * s.between(.6, 3), s.between(0, 90))
        else:
            with s.at(x, y, 0):
                s.lathe(name, [(0, 0), (size, 0), (size, size * .9), (size * .9, size), (0, size)], 36)
    s.camera((s.between(-.15, .15), -.85, .38), (0, .2, .1), 36)
    s.iso = 100
    return s


KINDS = {"attic": attic, "bathroom": bathroom, "living_room": living_room, "dining_room": dining_room, "door_ajar": door_ajar, "kitchen_shelf": kitchen_shelf,
         "product_shot": product_shot}
