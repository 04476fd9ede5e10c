# SPDX-License-Identifier: Apache-2.0
"""The triangles, reflectances, emission and camera of the measured Cornell box, read from its pbrt file, so that all renderers are given
the same numbers. Understands what scenes/cornell-box/cornell.pbrt uses, and no more. Plain Python: Blender's interpreter reads it too."""
import re
from pathlib import Path

TOKEN = re.compile(r'#[^\n]*|"([^"]*)"|(\[)|(\])|([^\s\[\]"]+)')


def read_scene(path):
    """-> (shapes, camera): shapes as (vertices, indices, reflectance, emission), camera as (eye, look, up, fov)."""
    tokens = [m for m in TOKEN.finditer(Path(path).read_text()) if not m.group(0).startswith("#")]
    shapes, named, camera = [], {}, {}
    reflectance, emission, stack = (0.5, 0.5, 0.5), None, []
    i = 0

    def strings_and_params():
        """Quoted words after a directive, then "type name" values, up to the next directive."""
        nonlocal i
        words, params = [], {}
        while i < len(tokens) and tokens[i].group(1) is not None:
            text = tokens[i].group(1)
            i += 1
            if " " not in text:
                words.append(text)
                continue
            values = []
            if tokens[i].group(2):
                i += 1
                while not tokens[i].group(3):
                    values.append(tokens[i].group(1) or tokens[i].group(0))
                    i += 1
            else:
                values.append(tokens[i].group(1) or tokens[i].group(0))
            i += 1
            params[text.split()[1]] = values
        return words, params

    while i < len(tokens):
        directive = tokens[i].group(0)
        i += 1
        if directive == "LookAt":
            numbers = [float(t.group(0)) for t in tokens[i : i + 9]]
            i += 9
            camera["eye"], camera["look"], camera["up"] = numbers[0:3], numbers[3:6], numbers[6:9]
        elif directive == "Scale":
            # The coordinates are right-handed, pbrt is not.
            assert [float(t.group(0)) for t in tokens[i : i + 3]] == [-1, 1, 1]
            i += 3
        elif directive == "AttributeBegin":
            stack.append((reflectance, emission))
        elif directive == "AttributeEnd":
            reflectance, emission = stack.pop()
        else:
            words, params = strings_and_params()
            if directive == "Camera":
                camera["fov"] = float(params["fov"][0])
            elif directive == "MakeNamedMaterial":
                named[words[0]] = tuple(map(float, params["reflectance"]))
            elif directive == "NamedMaterial":
                reflectance = named[words[0]]
            elif directive == "Material":
                reflectance = tuple(map(float, params["reflectance"]))
            elif directive == "AreaLightSource":
                emission = tuple(map(float, params["L"]))
            elif directive == "Shape":
                p = list(map(float, params["P"]))
                shapes.append((list(zip(p[0::3], p[1::3], p[2::3])), list(map(int, params["indices"])), reflectance, emission))
    return shapes, camera
