# SPDX-License-Identifier: Apache-2.0
"""Renders the measured Cornell box with Blender's Cycles on the CPU.

blender -b --factory-startup -P bench/cycles.py -- SCENE.pbrt OUT.exr [--resolution N] [--samples N] [--bounces N] [--threads N]

The scene is read by box_scene.py. Prints a line of JSON with the seconds of Blender's render call, start-up and scene set-up left out; the
seconds of the rendering proper stand in the header of the EXR (cycles.ViewLayer.render_time).
"""
import argparse
import json
import math
import sys
import time
from pathlib import Path

import bpy
import mathutils

sys.path.insert(0, str(Path(__file__).resolve().parent))  # Blender does not
from box_scene import read_scene


def make_material(reflectance, emission):
    material = bpy.data.materials.new("m")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    if emission:
        shader = nodes.new("ShaderNodeEmission")
        strength = max(emission)
        shader.inputs["Color"].default_value = (*[c / strength for c in emission], 1)
        shader.inputs["Strength"].default_value = strength
    else:
        shader = nodes.new("ShaderNodeBsdfDiffuse")
        shader.inputs["Color"].default_value = (*reflectance, 1)
        shader.inputs["Roughness"].default_value = 0
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def build(shapes, camera):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    for vertices, indices, reflectance, emission in shapes:
        mesh = bpy.data.meshes.new("mesh")
        mesh.from_pydata(vertices, [], list(zip(indices[0::3], indices[1::3], indices[2::3])))
        mesh.materials.append(make_material(reflectance, emission))
        scene.collection.objects.link(bpy.data.objects.new("shape", mesh))
    world = bpy.data.worlds.new("black")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
    scene.world = world

    data = bpy.data.cameras.new("camera")
    data.angle = math.radians(camera["fov"])
    data.clip_start, data.clip_end = 0.1, 1e5
    eye, look, up = (mathutils.Vector(camera[k]) for k in ("eye", "look", "up"))
    backward = (eye - look).normalized()
    right = up.cross(backward).normalized()
    rotation = mathutils.Matrix((right, backward.cross(right), backward)).transposed()
    camera_object = bpy.data.objects.new("camera", data)
    camera_object.matrix_world = mathutils.Matrix.Translation(eye) @ rotation.to_4x4()
    scene.collection.objects.link(camera_object)
    scene.camera = camera_object
    return scene


def configure(scene, options):
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = options.resolution
    scene.render.resolution_percentage = 100
    scene.render.threads_mode = "FIXED"
    scene.render.threads = options.threads
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.exr_codec = "ZIP"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = options.samples
    cycles.seed = 1
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.max_bounces = cycles.diffuse_bounces = options.bounces
    cycles.pixel_filter_type = "BOX"
    cycles.use_auto_tile = False


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("out")
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--bounces", type=int, default=1)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])

    scene = build(*read_scene(options.scene))
    configure(scene, options)
    start = time.perf_counter()
    bpy.ops.render.render()
    seconds = time.perf_counter() - start
    bpy.data.images["Render Result"].save_render(options.out)
    print(json.dumps({"blender": bpy.app.version_string, "call_seconds": seconds}))


main()
