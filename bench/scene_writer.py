# SPDX-License-Identifier: Apache-2.0
"""Writes pbrt-v4 scenes from metres with z up, in any unit of length and about any origin: meshes, quadrics, lathes, walls with holes, instances,
lights, and patterns without files."""
import contextlib
import math
import random


def numbers(values):
    return " ".join(f"{v:.10g}" for v in values)


def turned(degrees, axis="z"):
    """The rows of a rotation."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return {"x": ((1, 0, 0), (0, c, -s), (0, s, c)), "y": ((c, 0, s), (0, 1, 0), (-s, 0, c)), "z": ((c, -s, 0), (s, c, 0), (0, 0, 1))}[axis]


def product(a, b):
    return tuple(tuple(sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)) for i in range(3))


def applied(rows, p):
    return tuple(sum(row[k] * p[k] for k in range(3)) for row in rows)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def of_normals(rows):
    """What turns normals where `rows` turn and stretch points."""
    return cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1])


IDENTITY = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
BOX_FACES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))  # counter-clockwise from outside


class Scene:
    """One scene under way. `unit` is how many units of the file are a metre, `origin` where (0, 0, 0) lies, in metres; `rng` varies it."""

    def __init__(self, kind, variant, unit=1, origin=(0, 0, 0), iso=100):
        self.kind, self.variant, self.unit, self.origin, self.iso = kind, variant, unit, origin, iso
        self.rng = random.Random(f"{kind} {variant}")
        self.head, self.lines, self.count = [], [], 0
        self.frames, self.material_in_force = [(IDENTITY, (0, 0, 0))], None
        self.in_object = False

    def text(self):
        header = f"# {self.kind}, variant {self.variant}, made by bench/made_rooms.py; a metre is {numbers([self.unit])} units.\n"
        film = (f'Film "rgb" "integer xresolution" 240 "integer yresolution" 135 "string filename" "{self.kind}.exr" "float iso" {self.iso:g}\n'
                'Sampler "zsobol" "integer pixelsamples" 16\nWorldBegin\n')
        return header + "\n".join(self.head) + "\n" + film + "\n".join(self.lines) + "\n"

    def world(self, p):
        rows, shift = self.frames[-1]
        origin = (0, 0, 0) if self.in_object else self.origin
        return tuple((a + b + o) * self.unit for a, b, o in zip(applied(rows, p), shift, origin))

    def matrix(self):
        """The frame as 16 numbers of `Transform`, column by column."""
        rows, _ = self.frames[-1]
        columns = [(*(rows[i][j] for i in range(3)), 0) for j in range(3)]
        return numbers([v for column in columns for v in column] + [*self.world((0, 0, 0)), 1])

    @contextlib.contextmanager
    def at(self, x=0, y=0, z=0, turn=0, tilt=0, roll=0, scale=1):
        """What is written inside stands at (x, y, z), scaled, rolled about y, tilted about x, then turned about z."""
        rows, _ = self.frames[-1]
        sizes = scale if isinstance(scale, tuple) else (scale,) * 3
        stretch = tuple(tuple(sizes[i] if i == j else 0 for j in range(3)) for i in range(3))
        local = product(product(product(turned(turn), turned(tilt, "x")), turned(roll, "y")), stretch)
        shift = tuple(a + b for a, b in zip(applied(rows, (x, y, z)), self.frames[-1][1]))
        self.frames.append((product(rows, local), shift))
        yield
        self.frames.pop()

    # Chance

    def between(self, low, high):
        return self.rng.uniform(low, high)

    def vary(self, colour, amount=.15):
        """A colour near another, its brightness and its hue moved."""
        light = self.between(1 - amount, 1 + amount)
        return tuple(min(.92, max(.01, c * light * self.between(1 - amount / 2, 1 + amount / 2))) for c in colour)

    def any_colour(self, brightness=.5, saturation=.6):
        hue = self.between(0, 3)
        raw = [max(0, 1 - min(abs(hue - k), 3 - abs(hue - k))) for k in range(3)]
        return tuple(brightness * (1 - saturation + saturation * c) for c in raw)

    # Camera, lights

    def camera(self, eye, look, fov):
        self.head = [f"LookAt {numbers(self.world(eye))}  {numbers(self.world(look))}  0 0 1", f'Camera "perspective" "float fov" {fov:g}']

    @contextlib.contextmanager
    def attributes(self, *lines):
        self.lines += ["AttributeBegin", *lines]
        self.material_in_force, before = None, self.material_in_force
        yield
        self.lines.append("AttributeEnd")
        self.material_in_force = before

    def glowing(self, radiance, twosided=False):
        """Shapes written inside emit."""
        sides = ' "bool twosided" true' if twosided else ""
        return self.attributes(f'AreaLightSource "diffuse" "rgb L" [{numbers(radiance)}]{sides}')

    def panel(self, material, centre, width, depth, radiance):
        """A rectangle that shines downwards in its frame."""
        x, y, z = centre
        with self.glowing(radiance):
            self.quad(material, (x - width / 2, y + depth / 2, z), (x + width / 2, y + depth / 2, z), (x + width / 2, y - depth / 2, z),
                      (x - width / 2, y - depth / 2, z))

    def spot(self, eye, look, intensity, cone, soft):
        values = numbers(c * self.unit ** 2 for c in intensity)
        self.lines.append(f'LightSource "spot" "point3 from" [{numbers(self.world(eye))}] "point3 to" [{numbers(self.world(look))}] "rgb I" [{values}] '
                          f'"float coneangle" {cone:g} "float conedeltaangle" {soft:g}')

    def point(self, place, intensity):
        self.lines.append(f'LightSource "point" "point3 from" [{numbers(self.world(place))}] "rgb I" [{numbers(c * self.unit ** 2 for c in intensity)}]')

    def infinite(self, radiance):
        self.lines.append(f'LightSource "infinite" "rgb L" [{numbers(radiance)}]')

    def distant(self, towards, irradiance):
        self.lines.append(f'LightSource "distant" "point3 from" [{numbers(towards)}] "point3 to" [0 0 0] "rgb L" [{numbers(irradiance)}]')

    def sky(self, zenith, azimuth, sun, sky, model="clear"):
        """`zenith` and `azimuth` of the sun in degrees, irradiances as colours."""
        self.lines.append(f'LightSource "sky" "float sunzenith" {zenith:.4g} "float sunazimuth" {azimuth:.4g} "rgb sunirradiance" [{numbers(sun)}] '
                          f'"string skymodel" "{model}" "rgb skyirradiance" [{numbers(sky)}]')

    # Patterns and materials

    def texture(self, name, kind, type, parameters, scale=(1, 1, 1), turn=0):
        """A texture whose space is metres, stretched by `scale`."""
        stretch = numbers(self.unit * v for v in scale)
        origin = numbers(o * self.unit for o in self.origin)
        self.lines += ["AttributeBegin", f"Translate {origin} Rotate {turn:g} 0 0 1 Scale {stretch}", f'Texture "{name}" "{kind}" "{type}" {parameters}', "AttributeEnd"]

    def ramp(self, name, noise, parameters, colours, scale=(1, 1, 1), low=-.5, high=.5, turn=0):
        """A colour by a noise of space."""
        self.texture(name + " noise", "float", noise, parameters, scale, turn)
        steps = [low + (high - low) * i / (len(colours) - 1) for i in range(len(colours))]
        values = "  ".join(numbers(c) for c in colours)
        self.lines.append(f'Texture "{name}" "spectrum" "ramp" "texture in" "{name} noise" "float positions" [{numbers(steps)}] "rgb values" [{values}]')

    def tiles(self, name, size, colour, joint, axes="xy", width=.02):
        """Squares with joints, along two axes of space."""
        for axis in axes:
            t = f"{name} {axis}"
            self.texture(t, "float", "coordinate", f'"string which" "{axis}"', (size,) * 3)
            self.lines += [f'Texture "{t} f" "float" "fract" "texture in" "{t}"', f'Texture "{t} c" "float" "subtract" "texture in1" "{t} f" "float in2" .5',
                           f'Texture "{t} a" "float" "abs" "texture in" "{t} c"',
                           f'Texture "{t} j" "float" "smoothstep" "texture in" "{t} a" "float low" {.5 - width:g} "float high" {.5 - width / 2:g}']
        self.lines += [f'Texture "{name} j" "float" "max" "texture in1" "{name} {axes[0]} j" "texture in2" "{name} {axes[1]} j"',
                       f'Texture "{name}" "spectrum" "mix" "rgb tex1" [{numbers(colour)}] "rgb tex2" [{numbers(joint)}] "texture amount" "{name} j"']

    def checks(self, name, size, one, other):
        self.texture(name, "spectrum", "checkerboard", '"string mapping" "planar" "vector3 v1" [1 0 0] "vector3 v2" [0 1 0] '
                     f'"rgb tex1" [{numbers(one)}] "rgb tex2" [{numbers(other)}]', (size,) * 3)

    def material(self, name, type, parameters="", **colours):
        """Colours are numbers, or the name of a texture."""
        given = "".join(f' "texture {key}" "{v}"' if isinstance(v, str) else f' "rgb {key}" [{numbers(v)}]' for key, v in colours.items())
        self.lines.append(f'MakeNamedMaterial "{name}" "string type" "{type}"{given} {parameters}'.rstrip())
        return name

    def diffuse(self, name, colour):
        return self.material(name, "diffuse", reflectance=colour)

    def coated(self, name, colour, roughness):
        return self.material(name, "coateddiffuse", f'"float roughness" {roughness:g}', reflectance=colour)

    def wood(self, name, colour, roughness=None, along="x"):
        """Planks' grain along an axis."""
        stretch = tuple(.6 if axis == along else .05 for axis in "xyz")
        self.ramp(name + " grain", "fbm", '"integer octaves" 5', [tuple(f * c for c in colour) for f in (.55, .9, 1.1, .8)], stretch)
        return self.diffuse(name, name + " grain") if roughness is None else self.coated(name, name + " grain", roughness)

    # Shapes

    def shape(self, material, line, count=True):
        if material != self.material_in_force:
            self.lines.append(f'NamedMaterial "{material}"')
            self.material_in_force = material
        self.lines.append(line)
        self.count += count

    def mesh(self, material, vertices, triangles, normals=None, uv=None, more=""):
        line = (f'Shape "trianglemesh" "integer indices" [{" ".join(str(i) for t in triangles for i in t)}] '
                f'"point3 P" [{"  ".join(numbers(self.world(p)) for p in vertices)}]')
        if normals:
            rows = of_normals(self.frames[-1][0])
            line += f' "normal N" [{"  ".join(numbers(round(c, 5) for c in applied(rows, n)) for n in normals)}]'
        if uv:
            line += f' "point2 uv" [{"  ".join(numbers(p) for p in uv)}]'
        self.shape(material, line + more)

    def quad(self, material, a, b, c, d, more=""):
        """Corners in order; faces where they are counter-clockwise."""
        self.mesh(material, [a, b, c, d], [(0, 1, 2), (0, 2, 3)], uv=[(0, 0), (1, 0), (1, 1), (0, 1)], more=more)

    def box(self, material, low, high):
        corners = [(x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])]
        self.mesh(material, corners, [t for a, b, c, d in BOX_FACES for t in ((a, b, c), (a, c, d))])

    def block(self, material, x, y, z, width, depth, height, turn=0):
        """A box that stands on (x, y, z)."""
        with self.at(x, y, z, turn):
            self.box(material, (-width / 2, -depth / 2, 0), (width / 2, depth / 2, height))

    def quadric(self, material, type, parameters):
        self.lines += ["AttributeBegin", f"Transform [{self.matrix()}]"]
        self.shape(material, f'Shape "{type}" {parameters}')
        self.lines.append("AttributeEnd")
        self.material_in_force = None

    def sphere(self, material, x, y, z, radius):
        with self.at(x, y, z):
            self.quadric(material, "sphere", f'"float radius" {radius * self.unit:.8g}')

    def rod(self, material, a, b, radius):
        """A cylinder between two points, without ends."""
        d = [q - p for p, q in zip(a, b)]
        length = math.hypot(*d)
        with self.at(*a, turn=math.degrees(math.atan2(d[1], d[0])), roll=math.degrees(math.acos(d[2] / length))):
            self.quadric(material, "cylinder", f'"float radius" {radius * self.unit:.8g} "float zmin" 0 "float zmax" {length * self.unit:.8g}')

    def disk(self, material, x, y, z, radius, inner=0):
        with self.at(x, y, z):
            self.quadric(material, "disk", f'"float radius" {radius * self.unit:.8g} "float innerradius" {inner * self.unit:.8g}')

    def lathe(self, material, profile, around=24, smooth=True):
        """A surface of revolution of (radius, height); its outside is to the right of the profile's way."""
        vertices, normals, triangles = [], [], []
        n = len(profile)
        for j, (r, z) in enumerate(profile):
            before, after = profile[max(0, j - 1)], profile[min(n - 1, j + 1)]
            dr, dz = after[0] - before[0], after[1] - before[1]
            length = math.hypot(dr, dz) or 1
            for i in range(around):
                c, s = math.cos(2 * math.pi * i / around), math.sin(2 * math.pi * i / around)
                vertices.append((r * c, r * s, z))
                normals.append((dz / length * c, dz / length * s, -dr / length))
        for j in range(n - 1):
            for i in range(around):
                a, b = j * around + i, j * around + (i + 1) % around
                if profile[j][0] > 0:
                    triangles.append((a, b, b + around))
                if profile[j + 1][0] > 0:
                    triangles.append((a, b + around, a + around))
        self.mesh(material, vertices, triangles, normals if smooth else None)

    def wall(self, material, start, end, height, thick, holes=()):
        """A wall on the right of the way from start to end, as blocks about holes of (u0, u1, z0, z1)."""
        dx, dy = end[0] - start[0], end[1] - start[1]
        length = math.hypot(dx, dy)
        with self.at(*start, 0, turn=math.degrees(math.atan2(dy, dx))):
            cuts = sorted({0, length, *(u for hole in holes for u in hole[:2])})
            for u0, u1 in zip(cuts, cuts[1:]):
                z = 0
                for _, _, z0, z1 in sorted((h for h in holes if h[0] < (u0 + u1) / 2 < h[1]), key=lambda h: h[2]) + [(0, 0, height, height)]:
                    if z0 > z:
                        self.box(material, (u0, -thick, z), (u1, 0, z0))
                    z = max(z, z1)

    def room(self, size, wall, floor, ceiling, holes=None, thick=.2):
        """From the origin to `size`. `holes` by wall: s, e, n, w look towards -y, +x, +y, -x; u runs counter-clockwise seen from above."""
        x, y, z = size
        holes = holes or {}
        self.box(floor, (-thick, -thick, -thick), (x + thick, y + thick, 0))
        if ceiling:
            self.box(ceiling, (-thick, -thick, z), (x + thick, y + thick, z + thick))
        for side, start, end in (("s", (0, 0), (x, 0)), ("e", (x, 0), (x, y)), ("n", (x, y), (0, y)), ("w", (0, y), (0, 0))):
            self.wall(wall, start, end, z, thick, holes.get(side, ()))
        for cx, cy in ((-thick, -thick), (x, -thick), (x, y), (-thick, y)):
            self.box(wall, (cx, cy, 0), (cx + thick, cy + thick, z))

    # Objects

    @contextlib.contextmanager
    def object(self, name):
        """A definition, about its own origin."""
        self.lines.append(f'ObjectBegin "{name}"')
        frames, self.frames, self.in_object, self.material_in_force = self.frames, [(IDENTITY, (0, 0, 0))], True, None
        count = self.count
        yield
        self.count = count
        self.frames, self.in_object, self.material_in_force = frames, False, None
        self.lines.append("ObjectEnd")

    def place(self, name, x, y, z, turn=0, scale=1, tilt=0, roll=0):
        with self.at(x, y, z, turn, tilt, roll, scale):
            self.lines += ["AttributeBegin", f"Transform [{self.matrix()}]", f'ObjectInstance "{name}"', "AttributeEnd"]
        self.count += 1
