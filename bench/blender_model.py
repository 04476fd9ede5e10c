# SPDX-License-Identifier: Apache-2.0
"""Renders a model as Blender imports it, with Cycles: the peer of bench/models.py.

blender -b --factory-startup -P bench/blender_model.py -- JOB.json

The job says which model, which picture (linear EXR), size, samples, and in the model's own axes and metres camera (eye, look, up; fov across
the shorter side, degrees), sun (direction to it, irradiance) and sky (radiance). Models whose y is up were turned by Blender, so these are too.
"""
import json
import math
import sys

import bpy
import numpy
from mathutils import Matrix, Vector

numpy.bool = bool  # which Blender 3.4 asks for, and NumPy has no more

IMPORTERS = {
    "glb": lambda f: bpy.ops.import_scene.gltf(filepath=f),
    "gltf": lambda f: bpy.ops.import_scene.gltf(filepath=f),
    "obj": lambda f: bpy.ops.wm.obj_import(filepath=f),
    "fbx": lambda f: bpy.ops.import_scene.fbx(filepath=f),
    "dae": lambda f: bpy.ops.wm.collada_import(filepath=f),
    "stl": lambda f: bpy.ops.import_mesh.stl(filepath=f),
    "ply": lambda f: bpy.ops.import_mesh.ply(filepath=f),
    "x3d": lambda f: bpy.ops.import_scene.x3d(filepath=f),
}


def append_blend(path):
    with bpy.data.libraries.load(path) as (there, here):
        here.objects = there.objects
    for thing in here.objects:
        if thing and thing.type == "MESH":
            bpy.context.scene.collection.objects.link(thing)
    for material in bpy.data.materials:  # of Blender's own renderer, which is gone: what is left is the colour of the viewport
        if not material.use_nodes:
            color = tuple(material.diffuse_color)
            material.use_nodes = True
            material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = color


def add_light(scene, job, turn):
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*job["sky"], 1)
    background.inputs["Strength"].default_value = 1
    scene.world = world
    data = bpy.data.lights.new("sun of the bench", "SUN")
    data.energy, data.color, data.angle = job["sun"]["irradiance"], (1, 1, 1), 0
    sun = bpy.data.objects.new("sun of the bench", data)
    sun.rotation_mode = "QUATERNION"
    sun.rotation_quaternion = (turn @ Vector(job["sun"]["to"])).to_track_quat("Z", "Y")
    scene.collection.objects.link(sun)


def add_camera(scene, job, turn):
    camera = job["camera"]
    data = bpy.data.cameras.new("camera of the bench")
    width, height = job["size"]
    data.sensor_fit = "VERTICAL" if height <= width else "HORIZONTAL"
    data.angle = math.radians(camera["fov"])
    eye, look, up = (turn @ Vector(camera[k]) for k in ("eye", "look", "up"))
    distance = (eye - look).length
    data.clip_start, data.clip_end = distance * 1e-3, distance * 1e3
    backward = (eye - look).normalized()
    right = up.cross(backward).normalized()
    thing = bpy.data.objects.new("camera of the bench", data)
    thing.matrix_world = Matrix.Translation(eye) @ Matrix((right, backward.cross(right), backward)).transposed().to_4x4()
    scene.collection.objects.link(thing)
    scene.camera = thing


def configure(scene, job):
    render = scene.render
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = job["size"]
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", job["threads"]
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    scene.cycles.device = "CPU"
    scene.cycles.samples = job["samples"]
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = scene.cycles.glossy_bounces = job["bounces"]
    scene.cycles.transparent_max_bounces = 32
    scene.cycles.pixel_filter_type = "BOX"


def show_vertex_colors():
    """Blender reads colours of vertices, but gives them to no material; who looks at a model wants to see them."""
    for thing in bpy.context.scene.objects:
        if thing.type != "MESH" or not thing.data.color_attributes or any(m for m in thing.data.materials):
            continue
        material = bpy.data.materials.new("colours of vertices")
        material.use_nodes = True
        nodes = material.node_tree.nodes
        color = nodes.new("ShaderNodeVertexColor")
        color.layer_name = thing.data.color_attributes[0].name
        material.node_tree.links.new(color.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
        thing.data.materials.append(material)


def main():
    job = json.loads(open(sys.argv[sys.argv.index("--") + 1]).read())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="io_scene_x3d")
    extension = job["model"].rsplit(".", 1)[1].lower()
    if extension == "blend":
        append_blend(job["model"])
    else:
        IMPORTERS[extension](job["model"])
    scene = bpy.context.scene
    for thing in list(scene.objects):
        if thing.type in ("LIGHT", "CAMERA"):
            bpy.data.objects.remove(thing)
        elif thing.animation_data and job.get("rest", True):
            thing.animation_data_clear()
    show_vertex_colors()
    turn = Matrix() if job["z_up"] else Matrix.Rotation(math.pi / 2, 4, "X")
    turn = turn.to_3x3()
    add_light(scene, job, turn)
    add_camera(scene, job, turn)
    configure(scene, job)
    bpy.ops.render.render()
    bpy.data.images["Render Result"].save_render(job["out"])
    meshes = [o for o in scene.objects if o.type == "MESH"]
    print(json.dumps({"blender": bpy.app.version_string, "meshes": len(meshes)}))


main()
