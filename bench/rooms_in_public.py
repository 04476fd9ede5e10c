# SPDX-License-Identifier: Apache-2.0
"""Made rooms of public buildings and of work."""
import math

import room_furniture as f
from rooms_at_home import BLACK, COOL, WARM, basics, light
from scene_writer import Scene


def museum(variant):
    """Metres. Pictures, each under a spotlight, benches, sculptures on plinths."""
    s = Scene("museum", variant)
    basics(s)
    w, d, h = s.between(8, 11), s.between(10, 14), s.between(4, 5)
    s.diffuse("wall", s.vary(s.rng.choice([(.75, .74, .7), (.3, .12, .1), (.2, .28, .3)])))
    s.wood("floor", s.vary((.45, .3, .18)), .15, "y")
    s.diffuse("stone", (.7, .68, .64))
    s.coated("frame", s.vary((.35, .25, .1)), .2)
    s.material("bronze", "conductor", '"spectrum eta" "metal-Cu-eta" "spectrum k" "metal-Cu-k" "float roughness" .3')
    s.room((w, d, h), "wall", "floor", "white", {"s": [(w - 2.6, w - .6, 0, 2.6)], "n": [(.8, 2.6, 0, 2.6)]}, .3)
    s.box("wall", (-1, d + 2, 0), (w + 1, d + 2.2, h))
    s.box("floor", (-1, d, -.2), (w + 1, d + 2.2, -.001))
    s.infinite((.12, .12, .13))
    s.panel("bulb", (w / 2, d / 2, h - .01), w * .25, d * .3, light(COOL, s.between(.6, 1.5)))
    walls = [(w - .004, -90, [d * (i + .5) / 5 for i in range(5)], True), (.004, 90, [d * (i + .5) / 5 for i in range(5)], True),
             (d - .004, 0, [w * (i + 1) / 4 for i in range(1, 3)], False)]
    number = 0
    for place, turn, along, side in walls:
        for u in along:
            number += 1
            colours = [s.any_colour(s.between(.1, .8), s.between(.2, 1)) for _ in range(5)]
            s.ramp(f"paint {number}", s.rng.choice(("fbm", "worley", "wrinkled")), "", colours, (s.between(.1, .6), s.between(.1, .6), s.between(.1, .4)), -.3, .8)
            s.diffuse(f"canvas {number}", f"paint {number}")
            x, y = (place, u) if side else (u, place)
            with s.at(x, y, 1.65, turn):
                f.picture(s, f"canvas {number}", "frame", s.between(.7, 1.6), s.between(.6, 1.5))
            into = (-1 if x > w / 2 else 1, 0) if side else (0, -1)
            lamp = (x + into[0] * 1.6, y + into[1] * 1.6, h - .25)
            s.spot(lamp, (x, y, 1.6), light(WARM, s.between(40, 80)), s.between(16, 24), 6)
            s.rod("black", (lamp[0], lamp[1], h - .22), (lamp[0], lamp[1], h), .03)
    for y in (d * .35, d * .65):
        with s.at(w / 2, y, 0, turn=90):
            f.bench(s, "frame", 1.8)
        s.block("stone", w * .3, y + .9, 0, .5, .5, 1.0)
        with s.at(w * .3, y + .9, 1.0):
            s.lathe(s.rng.choice(("bronze", "stone")), [(0, 0)] + [(.08 + .1 * s.rng.random(), .06 + .07 * i) for i in range(7)] + [(0, .6)], 24)
    s.camera((s.between(.35, .65) * w, .6, 1.65), (s.between(.45, .65) * w, d, 1.75), 66)
    s.iso = 100
    return s


def office(variant):
    """Metres. Many ceiling panels, glass walls, desks, screens that shine."""
    s = Scene("office", variant)
    basics(s)
    w, d, h = s.between(11, 14), s.between(15, 20), 2.8
    s.diffuse("wall", (.72, .72, .7))
    s.ramp("carpet pile", "fbm", '"integer octaves" 4', [s.vary((.18, .2, .24)), s.vary((.25, .27, .3))], (.08, .08, .08))
    s.diffuse("carpet", "carpet pile")
    s.material("pane", "thindielectric")
    s.coated("top", s.vary((.65, .6, .52)), .15)
    s.diffuse("cloth", s.any_colour(.25))
    holes = [(1.5 + 3 * i, 4 + 3 * i, .8, 2.4) for i in range(int((d - 2) / 3))]
    s.room((w, d, h), "wall", "carpet", "white", {"e": holes}, .25)
    s.sky(s.between(45, 70), s.between(-60, -20), light((1, .92, .8), s.between(0, 12)), light((.6, .78, 1), 8))
    s.box("wall", (w + 18, -10, -12), (w + 19, d + 10, 6))
    for u0, u1, z0, z1 in holes:
        with s.at(w + .12, u0, z0, turn=90):
            f.window(s, "steel", "pane", u1 - u0, z1 - z0, 2, 1)
    across, along = int(w / 2.4), int(d / 2.2)
    for i in range(across):
        for j in range(along):
            s.panel("bulb", (w * (i + .5) / across, d * (j + .5) / along, h - .012), .6, .6, light((1, .97, .9), 5 if s.rng.random() > .1 else .02))
    for j in range(int(d / 3.2)):
        for i in range(3):
            x, y = 1.6 + i * (w - 5) / 2.4, 2.6 + 3.1 * j
            for back in (0, 180):
                with s.at(x, y + (.42 if back == 0 else -.42), 0, turn=back):
                    f.table(s, "top", 1.5, .8, .73, "steel")
                    s.box("black", (-.28, .18, .85), (.28, .2, 1.2))
                    s.rod("steel", (0, .2, .73), (0, .2, .9), .02)
                    with s.glowing(light(s.any_colour(1, .4), s.between(.4, 1.5))):
                        s.quad("bulb", (-.27, .175, .86), (.27, .175, .86), (.27, .175, 1.19), (-.27, .175, 1.19))
                    for _ in range(2):
                        s.block(s.diffuse(f"paper {s.count}", s.any_colour(.7, .3)), s.between(-.6, .6), s.between(-.3, .1), .73, .21, .3, s.between(.005, .04), s.between(0, 40))
                    with s.at(s.between(-.2, .2), -.55, 0, turn=s.between(150, 210)):
                        f.swivel_chair(s, "cloth", "steel")
    for i in range(5):
        x0 = w - 3.4
        s.quad("pane", (x0, .3 + 3 * i, .05), (x0, 3.1 + 3 * i, .05), (x0, 3.1 + 3 * i, 2.6), (x0, .3 + 3 * i, 2.6))
        s.box("steel", (x0 - .025, .25 + 3 * i, 0), (x0 + .025, .3 + 3 * i, 2.8))
    s.camera((s.between(.15, .4) * w, .4, 1.55), (w * .55, d, 1.15), 68)
    s.iso = 150
    return s


def corridor(variant):
    """Metres. Many doors, small lamps on the ceiling, coats and bins along the walls."""
    s = Scene("corridor", variant)
    basics(s)
    w, d, h = s.between(1.7, 2.2), s.between(24, 34), 2.6
    s.diffuse("wall", s.vary((.62, .58, .48)))
    s.checks("squares", s.between(.25, .4), s.vary((.5, .48, .42)), s.vary((.15, .15, .16)))
    s.coated("lino", "squares", .1)
    s.coated("door", s.any_colour(.45, .5), .2)
    s.coated("bin", s.any_colour(.3), .3)
    doors = int(d / 3)
    places = [1 + i * (d - 2.4) / (doors - 1) for i in range(doors)]
    s.room((w, d, h), "wall", "lino", "white", {"e": [(u, u + .9, 0, 2.05) for u in places], "w": [(d - u - .9, d - u, 0, 2.05) for u in places]}, .15)
    open_one = s.rng.randrange(1, 4)
    for i, u in enumerate(places):
        for side in (-1, 1):
            with s.at(w + .1 if side > 0 else -.1, u if side > 0 else u + .9, 0, turn=90 * side):
                if i == open_one and side > 0:
                    s.panel("bulb", (.45, -1.2, 2.4), .6, .6, light(COOL, 9))
                    s.box("wall", (-1.5, -2.6, 0), (2.4, -2.5, h))
                    s.box("lino", (-1.5, -2.6, -.1), (2.4, 0, 0))
                    s.box("white", (-1.5, -2.6, 2.5), (2.4, -.06, 2.6))
                    s.box("wall", (-1.5, -2.6, 0), (-1.4, -.06, h))
                    s.box("wall", (2.3, -2.6, 0), (2.4, -.06, h))
                else:
                    f.door(s, "door", "steel", .9, 2.05)
    lamps = int(d / 2.6)
    for i in range(lamps):
        y = d * (i + .5) / lamps
        if s.rng.random() > .15:
            with s.glowing(light(WARM, s.between(14, 22))):
                s.sphere("bulb", w / 2, y, h - .1, .08)
        s.block("steel", w / 2, y, h - .02, .2, .2, .02)
    for i in range(9):
        side, y = s.rng.choice((-1, 1)), s.between(2, d - 2)
        with s.at(w / 2 + side * (w / 2 - .2), y, 0):
            s.lathe("bin", [(0, 0), (.13, 0), (.16, .4), (.155, .4), (.125, .01), (0, .01)], 20)
    for i in range(8):
        with s.at(w - .004 if i % 2 else .004, 2.6 + i * (d - 4) / 8, 1.5, turn=-90 if i % 2 else 90):
            f.picture(s, s.diffuse(f"notice {i}", s.any_colour(.6, .4)), "steel", .4, .5)
    s.camera((w * s.between(.35, .65), .3, 1.6), (w / 2, d, 1.15), 66)
    s.iso = 800
    return s


def church(variant):
    """Metres, about a surveyor's origin 5,400 km away. High coloured windows, columns, pews, candles."""
    s = Scene("church", variant, origin=(452310, 5411875, 264))
    basics(s)
    w, d, h = s.between(11, 14), s.between(24, 32), s.between(10, 13)
    s.ramp("limestone tone", "fbm", '"integer octaves" 5', [(.48, .43, .35), (.62, .57, .48), (.56, .5, .4)], (1.5, 1.5, .8))
    s.diffuse("limestone", "limestone tone")
    s.tiles("flags", .8, s.vary((.36, .33, .3)), (.16, .15, .14))
    s.coated("floor", "flags", .2)
    s.wood("pew", s.vary((.28, .16, .08)), .25)
    s.material("candle", "diffusetransmission", reflectance=(.5, .45, .36), transmittance=(.3, .25, .15))
    bays = 5
    holes = {side: [(d * (i + .5) / bays - .7, d * (i + .5) / bays + .7, 3.6, h - 2.4) for i in range(bays)] for side in "ew"}
    holes["n"] = [(w / 2 - 1.2, w / 2 + 1.2, 3.5, h - 2)]
    s.room((w, d, h), "limestone", "floor", "limestone", holes, .8)
    s.sky(s.between(40, 60), s.between(-30, 20), light((1, .9, .75), 55), light((.6, .78, 1), 12))
    panes = 0
    for x, turn, us in ((w + .4, 90, [hole[0] for hole in holes["e"]]), (-.4, -90, [d - hole[0] for hole in holes["w"]])):
        for u in us:
            with s.at(x, u, 3.6, turn):
                for i in range(2):
                    for j in range(5):
                        colour = s.any_colour(1, s.between(.5, .95))
                        panes += 1
                        name = s.material(f"pane {panes}", "diffusetransmission", reflectance=(.03, .03, .03), transmittance=tuple(.85 * c for c in colour))
                        z = (h - 6) * j / 5
                        s.quad(name, (.7 * i, 0, z), (.7 * i + .7, 0, z), (.7 * i + .7, 0, z + (h - 6) / 5), (.7 * i, 0, z + (h - 6) / 5))
                f.window(s, "black", None, 1.4, h - 6, 2, 5)
    s.material("clear", "thindielectric")
    with s.at(w / 2 + 1.2, d + .4, 3.5, turn=180):
        f.window(s, "black", "clear", 2.4, h - 5.5, 4, 6)
    for i in range(bays + 1):
        for x in (w * .22, w * .78):
            y = d * i / bays
            with s.at(x, max(.6, min(y, d - .6)), 0):
                s.lathe("limestone", [(.55, 0), (.55, .3), (.38, .45), (.36, h - 1.4), (.6, h - .8), (.6, h)], 20)
    for i in range(int(d / 1.1) - 8):
        for x in (w * .38, w * .62):
            with s.at(x, 3.2 + 1.05 * i, 0, turn=180):
                f.bench(s, "pew", w * .2)
                s.box("pew", (-w * .1, .2, .4), (w * .1, .24, .95))
    s.block("limestone", w / 2, d - 3, 0, 2.6, 1.1, 1.05)
    for i in range(9):
        x = w / 2 - 1.1 + .275 * i
        tall = s.between(.15, .4)
        s.rod("candle", (x, d - 3, 1.05), (x, d - 3, 1.05 + tall), .025)
        with s.glowing(light((1, .6, .25), 900)):
            s.sphere("bulb", x, d - 3, 1.08 + tall, .013)
    s.camera((w * s.between(.45, .55), 1.0, 1.7), (w / 2, d, s.between(3.4, 4.4)), 62)
    s.iso = 250
    return s


def library(variant):
    """Metres. Two thousand books in high shelves, lamps on reading tables, windows high up."""
    s = Scene("library", variant)
    basics(s)
    w, d, h = s.between(8, 10), s.between(11, 13), s.between(4.2, 5)
    s.wood("oak", s.vary((.36, .22, .12)), .2, "z")
    s.wood("floor", s.vary((.32, .2, .11)), .15, "y")
    s.coated("green", (.05, .3, .14), .05)
    s.diffuse("wall", s.vary((.6, .55, .45)))
    s.material("brass", "conductor", '"float roughness" .1', reflectance=(.78, .6, .28))
    holes = [(1.2 + 3 * i, 2.6 + 3 * i, h - 1.5, h - .3) for i in range(3)]
    s.room((w, d, h), "wall", "floor", "white", {"e": holes}, .3)
    s.sky(s.between(50, 70), s.between(-40, 40), light((1, .9, .78), 25), light((.6, .78, 1), 8))
    volumes = f.book_objects(s, 24)
    columns = int(d / 1.3)
    for side in (-1, 1):
        for i in range(columns):
            with s.at(w / 2 + side * (w / 2 - .2), .7 + i * (d - 1.4) / (columns - 1), 0, turn=-90 * side):
                for z in f.shelf(s, "oak", (d - 1.4) / (columns - 1), .3, 2.7, 7):
                    with s.at(0, 0, z):
                        f.books(s, volumes, 1.05, .28, .33, .9)
    for i in range(3):
        with s.at(w * (.25 + .25 * i), d - .25, 0):
            for z in f.shelf(s, "oak", w * .22, .3, 2.7, 7):
                with s.at(0, 0, z):
                    f.books(s, volumes, w * .2, .28, .33, .9)
    for i in range(3):
        with s.at(w / 2, 3 + 2.8 * i, 0, turn=90):
            f.table(s, "oak", 2, 1.0, .76)
            for x in (-.55, .55):
                with s.at(x, 0, .76):
                    s.lathe("brass", [(.08, 0), (.08, .01), (.01, .02), (.01, .3)], 20)
                    s.lathe("green", [(.2, .3), (.12, .4), (0, .41), (.115, .395), (.195, .3)], 28)
                    with s.glowing(light(WARM, s.between(160, 260))):
                        s.sphere("bulb", 0, 0, .34, .03)
            for _ in range(4):
                s.place(s.rng.choice(volumes), s.between(-.8, .6), s.between(-.4, .2), .78, turn=s.between(0, 360), scale=(.03, .2, .28), roll=90)
            for x in (-.5, .5):
                for turn in (0, 180):
                    with s.at(x, .75 if turn == 0 else -.75, 0, turn=turn + s.between(-15, 15)):
                        f.chair(s, "oak")
    s.camera((w * s.between(.4, .6), .5, 1.75), (w * .5, d, 1.3), 68)
    s.iso = 400
    return s


def stairwell(variant):
    """Metres. Flights about a well, a railing, a lamp on each landing, windows."""
    s = Scene("stairwell", variant)
    basics(s)
    w, d, floors, rise = s.between(4.6, 5.4), s.between(5.6, 6.6), 4, 3.2
    s.diffuse("wall", s.vary((.7, .67, .6)))
    s.ramp("terrazzo chips", "worley", "", [(.5, .48, .45), (.3, .28, .27), (.62, .6, .57)], (.02, .02, .02), 0, 1)
    s.coated("terrazzo", "terrazzo chips", .12)
    s.coated("rail", s.vary((.25, .12, .06)), .15)
    h = floors * rise
    s.room((w, d, h), "wall", "terrazzo", "white", {"n": [(w / 2 - .6, w / 2 + .6, rise * i + 2.2, rise * i + 3.4) for i in range(floors - 1)]}, .25)
    s.sky(s.between(45, 65), s.between(60, 100), light((1, .9, .78), 20), light((.6, .78, 1), 10))
    s.diffuse("street", (.2, .2, .19))
    s.quad("street", (-80, d + .3, -.1), (80, d + .3, -.1), (80, d + 160, -.1), (-80, d + 160, -.1))
    flight, steps = 1.5, 10
    for k in range(floors - 1):
        z0 = rise * k
        for half in range(2):
            x0 = .0 if half == 0 else w - flight
            for i in range(steps):
                t = i if half == 0 else steps - 1 - i
                y0, y1 = 1.4 + (d - 2.8) * t / steps, 1.4 + (d - 2.8) * (t + 1) / steps
                z = z0 + half * rise / 2 + (i + 1) * rise / 2 / steps
                s.box("terrazzo", (x0, y0, z - .17), (x0 + flight, y1 + .02, z))
                x = flight - .05 if half == 0 else w - flight + .05
                s.rod("steel", (x, (y0 + y1) / 2, z), (x, (y0 + y1) / 2, z + .9), .01)
            start, end = (1.4, d - 1.4) if half == 0 else (d - 1.4, 1.4)
            s.rod("rail", (x, start, z0 + half * rise / 2 + .95), (x, end, z0 + (half + 1) * rise / 2 + .95), .03)
        s.box("terrazzo", (0, d - 1.4, z0 + rise / 2 - .17), (w, d, z0 + rise / 2))
        s.box("terrazzo", (0, 0, z0 + rise - .17), (w, 1.4, z0 + rise))
        for y, z in ((d - .7, z0 + rise / 2 - .19), (.7, z0 + rise - .19)):
            with s.glowing(light(WARM, s.between(18, 26))):
                s.sphere("bulb", w / 2, y, z - .06, .09)
    for i in range(floors * 2):
        with s.at(.004 if i % 2 else w - .004, s.between(1.5, d - 1.5), .8 + i * rise / 2, turn=90 if i % 2 else -90):
            f.picture(s, s.diffuse(f"print {i}", s.any_colour(.6, .6)), "rail", .5, .4)
    s.camera((w * s.between(.4, .6), .5, rise + 1.6), (w * .5, d, rise + s.between(.6, 1.6)), 76)
    s.iso = 300
    return s


def garage(variant):
    """Metres. Fluorescent tubes under a low concrete ceiling, columns, cars, pipes."""
    s = Scene("garage", variant)
    basics(s)
    w, d, h = s.between(15, 18), s.between(24, 32), 2.7
    s.ramp("concrete tone", "fbm", '"integer octaves" 6', [(.3, .3, .29), (.45, .44, .42), (.36, .35, .33)], (1.2, 1.2, 1.2))
    s.diffuse("concrete", "concrete tone")
    s.coated("floor", "concrete tone", .3)
    s.diffuse("yellow", (.7, .5, .05))
    s.coated("car glass", BLACK, .01)
    s.diffuse("rubber", BLACK)
    s.coated("pipe", s.any_colour(.5, .8), .3)
    s.room((w, d, h), "concrete", "floor", "concrete", {"n": [(w * .4, w * .4 + 4, 0, 2.3)]}, .3)
    s.infinite((.5, .6, .8))
    for j in range(int(d / 4)):
        for i in range(3):
            x, y = w * (i + .5) / 3, 2 + 4 * j
            s.box("white", (x - .07, y - .65, h - .08), (x + .07, y + .65, h))
            if s.rng.random() > .2:
                with s.glowing(light(COOL, s.between(18, 24))):
                    s.rod("bulb", (x, y - .6, h - .11), (x, y + .6, h - .11), .018)
    for j in range(int(d / 5)):
        for x in (w * .3, w * .7):
            s.block("concrete", x, 3.5 + 5 * j, 0, .5, .5, h)
            s.block("yellow", x, 3.5 + 5 * j, .3, .51, .51, .3)
    for j in range(int(d / 2.7)):
        for side in (-1, 1):
            x, y = w / 2 + side * (w / 2 - 2.7), 1.5 + 2.6 * j
            s.box("white", (x - 2.5, y - 1.35, .0005), (x + 2.5, y - 1.27, .002))
            if s.rng.random() < .5:
                with s.at(x + s.between(-.3, .3), y, 0, turn=s.rng.choice((0, 180)) + s.between(-3, 3)):
                    f.car(s, s.coated(f"paint {s.count}", s.any_colour(s.between(.1, .7), s.between(0, .9)), .03), "car glass", "rubber", "steel")
    for i in range(4):
        x = w * (.2 + .2 * i)
        s.rod("pipe", (x, 0, h - .3), (x, d, h - .3), s.between(.04, .09))
    s.camera((w * s.between(.42, .58), .5, 1.6), (w / 2, d, 1.1), 66)
    s.iso = 800
    return s


KINDS = {"museum": museum, "office": office, "corridor": corridor, "church": church, "library": library, "stairwell": stairwell, "garage": garage}
