# SPDX-License-Identifier: Apache-2.0
"""Builds a scene in Blender, exports it as glTF, and renders it with Cycles: the peer of bench/gltf_scene.py.

blender -b --factory-startup -P bench/blender_scene.py -- OUT.glb OUT.exr SAMPLES THREADS

Pictures as colours, as roughness and metalness, and as normals; metal, matt and glossy materials; a mesh that glows, a sun, a point and a spot;
two objects of one mesh; a bar bent by two bones; a camera.
"""
import math
import sys

import bpy
import numpy as np
from mathutils import Vector

SIZE = (240, 160)


def image(name, pixels, is_data=False):
    h, w = pixels.shape[:2]
    made = bpy.data.images.new(name, w, h, alpha=False)
    if is_data:
        made.colorspace_settings.name = "Non-Color"
    rgba = np.ones((h, w, 4), dtype=np.float32)
    rgba[:, :, :3] = pixels
    made.pixels = rgba.ravel()
    made.pack()
    return made


def checker(n, a, b, size=512):
    y, x = np.mgrid[0:size, 0:size] * n // size
    return np.where(((x + y) % 2 == 0)[:, :, None], a, b)


def waves(size=256, steepness=0.2):
    """Normals of a surface with waves along u."""
    x = np.mgrid[0:size, 0:size][1] / size
    slope = steepness * np.sin(2 * math.pi * 4 * x)
    n = np.stack([-slope, np.zeros_like(slope), np.ones_like(slope)], axis=2)
    return (n / np.linalg.norm(n, axis=2, keepdims=True) + 1) / 2


def material(name, color=(0.8, 0.8, 0.8), roughness=0.5, metallic=0.0, specular=0.0, color_image=None, orm_image=None, normal_image=None,
             emission=None, strength=1.0):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    principled = nodes["Principled BSDF"]
    principled.distribution = "MULTI_GGX"
    values = {"Base Color": (*color, 1), "Roughness": roughness, "Metallic": metallic, "Specular": specular}
    if emission:
        values["Emission"], values["Emission Strength"] = (*emission, 1), strength
    for socket, value in values.items():
        principled.inputs[socket].default_value = value

    def texture(of):
        node = nodes.new("ShaderNodeTexImage")
        node.image = of
        return node.outputs["Color"]

    if specular == 0:
        export_without_highlight(made)
    if color_image:
        links.new(texture(color_image), principled.inputs["Base Color"])
    if orm_image:
        split = nodes.new("ShaderNodeSeparateColor")
        links.new(texture(orm_image), split.inputs[0])
        links.new(split.outputs[1], principled.inputs["Roughness"])
        links.new(split.outputs[2], principled.inputs["Metallic"])
    if normal_image:
        bump = nodes.new("ShaderNodeNormalMap")
        links.new(texture(normal_image), bump.inputs["Color"])
        links.new(bump.outputs["Normal"], principled.inputs["Normal"])
    return made


def export_without_highlight(of):
    """By the node group that the exporter looks for; its inputs are glTF's."""
    group = bpy.data.node_groups.get("glTF Settings") or bpy.data.node_groups.new("glTF Settings", "ShaderNodeTree")
    if not group.inputs:
        group.inputs.new("NodeSocketFloat", "Specular")
        group.inputs.new("NodeSocketColor", "Specular Color")
    node = of.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.inputs["Specular"].default_value = 0
    node.inputs["Specular Color"].default_value = (1, 1, 1, 1)


def shade_as_gltf(of):
    """Blender's Principled is Disney's, and adds its highlight to all of its diffuse light. glTF's diffuse light is Lambertian, and gives way to
    the highlight by Fresnel's reflectance."""
    nodes, links = of.node_tree.nodes, of.node_tree.links
    principled, output = nodes["Principled BSDF"], nodes["Material Output"]

    def give(node, socket, source):
        from_socket = principled.inputs[source]
        if from_socket.is_linked:
            links.new(from_socket.links[0].from_socket, node.inputs[socket])
        elif hasattr(from_socket, "default_value") and source != "Normal":
            node.inputs[socket].default_value = from_socket.default_value

    diffuse, gloss = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeBsdfGlossy")
    gloss.distribution = "MULTI_GGX"
    gloss.inputs["Color"].default_value = (1, 1, 1, 1)
    fresnel = nodes.new("ShaderNodeFresnel")
    fresnel.inputs["IOR"].default_value = 1.5 if principled.inputs["Specular"].default_value > 0 else 1
    give(diffuse, "Color", "Base Color")
    give(gloss, "Roughness", "Roughness")
    for node in (diffuse, gloss, fresnel):
        give(node, "Normal", "Normal")
    plastic, surface, shining = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeAddShader")
    links.new(fresnel.outputs[0], plastic.inputs[0])
    links.new(diffuse.outputs[0], plastic.inputs[1])
    links.new(gloss.outputs[0], plastic.inputs[2])
    give(surface, 0, "Metallic")
    glow = nodes.new("ShaderNodeEmission")
    give(glow, "Color", "Emission")
    give(glow, "Strength", "Emission Strength")
    for link in list(principled.inputs["Metallic"].links):
        links.remove(link)
    principled.inputs["Metallic"].default_value = 1
    principled.inputs["Specular"].default_value = 0.5
    principled.inputs["Emission"].default_value = (0, 0, 0, 1)
    links.new(plastic.outputs[0], surface.inputs[1])
    links.new(principled.outputs[0], surface.inputs[2])
    links.new(surface.outputs[0], shining.inputs[0])
    links.new(glow.outputs[0], shining.inputs[1])
    links.new(shining.outputs[0], output.inputs["Surface"])


def add(operator, of, **options):
    operator(**options)
    thing = bpy.context.object
    thing.data.materials.append(of)
    return thing


def smooth(thing):
    for polygon in thing.data.polygons:
        polygon.use_smooth = True
    return thing


def bent_bar(of):
    """A bar along z, its upper half turned by 40 degrees with its bone."""
    bpy.ops.object.armature_add(location=(0, 0, 0))
    armature = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bones = armature.data.edit_bones
    lower = bones[0]
    lower.name, lower.head, lower.tail = "lower", (0, 0, 0), (0, 0, 1)
    upper = bones.new("upper")
    upper.head, upper.tail, upper.parent = (0, 0, 1), (0, 0, 2), lower
    bpy.ops.object.mode_set(mode="OBJECT")
    rings, sides = 17, 16
    points = [(0.25 * math.cos(2 * math.pi * s / sides), 0.25 * math.sin(2 * math.pi * s / sides), 2 * r / (rings - 1))
              for r in range(rings) for s in range(sides)]
    faces = [(r * sides + s, r * sides + (s + 1) % sides, (r + 1) * sides + (s + 1) % sides, (r + 1) * sides + s)
             for r in range(rings - 1) for s in range(sides)]
    mesh = bpy.data.meshes.new("bar")
    mesh.from_pydata(points, [], faces + [tuple(range((rings - 1) * sides, rings * sides))])
    mesh.materials.append(of)
    bar = bpy.data.objects.new("bar", mesh)
    bpy.context.scene.collection.objects.link(bar)
    groups = {name: bar.vertex_groups.new(name=name) for name in ("lower", "upper")}
    for i, p in enumerate(points):
        share = p[2] / 2
        groups["upper"].add([i], share, "REPLACE")
        groups["lower"].add([i], 1 - share, "REPLACE")
    bar.parent = armature
    bar.modifiers.new("skin", "ARMATURE").object = armature
    pose = armature.pose.bones["upper"]
    pose.rotation_mode = "XYZ"
    pose.rotation_euler = (math.radians(25), 0, 0)
    armature.location = (-2.2, 0.6, 0)
    return bar


def light(kind, name, energy, location, target, **options):
    data = bpy.data.lights.new(name, kind)
    data.energy = energy
    for option, value in options.items():
        setattr(data, option, value)
    thing = bpy.data.objects.new(name, data)
    thing.location = location
    thing.rotation_mode = "QUATERNION"
    thing.rotation_quaternion = (Vector(location) - Vector(target)).to_track_quat("Z", "Y")
    bpy.context.scene.collection.objects.link(thing)


def build():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    floor = material("floor", color_image=image("tiles", checker(8, (0.8, 0.6, 0.3), (0.15, 0.3, 0.5))))
    add(bpy.ops.mesh.primitive_plane_add, floor, size=10)
    orm = image("parts", checker(4, (0, 0.5, 1), (0, 0.6, 0)), is_data=True)
    smooth(add(bpy.ops.mesh.primitive_uv_sphere_add, material("parts", (0.7, 0.5, 0.2), orm_image=orm), radius=0.8, location=(0, 0, 0.8),
               segments=48, ring_count=24))
    add(bpy.ops.mesh.primitive_cube_add, material("waves", (0.6, 0.2, 0.2), normal_image=image("waves", waves(), is_data=True)), size=1.2,
        location=(1.9, 0.3, 0.6), rotation=(0, 0, 0.5))
    ring = smooth(add(bpy.ops.mesh.primitive_torus_add, material("ring", (0.3, 0.6, 0.3)), major_radius=0.5, minor_radius=0.18,
                      location=(1, -1.6, 0.18)))
    twin = ring.copy()  # the same mesh
    twin.location, twin.rotation_euler, twin.scale = (-1.2, -1.6, 0.5), (1.2, 0.3, 0), (0.8, 0.8, 0.8)
    scene.collection.objects.link(twin)
    smooth(add(bpy.ops.mesh.primitive_uv_sphere_add, material("glossy", (0.2, 0.25, 0.6), roughness=0.3, specular=0.5), radius=0.4,
               location=(2.3, -1.3, 0.4), segments=48, ring_count=24))
    bent_bar(material("bar", (0.7, 0.7, 0.7)))
    add(bpy.ops.mesh.primitive_plane_add, material("panel", (0, 0, 0), emission=(1, 0.7, 0.4), strength=6), size=1.2, location=(-4.2, 1, 1.6),
        rotation=(0, math.radians(80), 0))
    light("SUN", "sun", 1.5, (4, -3, 6), (0, 0, 0), angle=0)
    light("POINT", "bulb", 150, (-3, -2, 3), (0, 0, 0), shadow_soft_size=0, color=(1, 0.9, 0.7))
    light("SPOT", "spot", 400, (3, -3, 4), (0.5, 0, 0.5), shadow_soft_size=0, spot_size=math.radians(50), spot_blend=0)
    data = bpy.data.cameras.new("shot")
    data.sensor_fit, data.angle = "VERTICAL", math.radians(40)
    camera = bpy.data.objects.new("shot", data)
    camera.location = (1.0, -7.5, 3.2)
    camera.rotation_mode = "QUATERNION"
    camera.rotation_quaternion = (camera.location - Vector((0, 0, 0.7))).to_track_quat("Z", "Y")
    scene.collection.objects.link(camera)
    scene.camera = camera
    world = bpy.data.worlds.new("black")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
    scene.world = world
    return scene


def configure(scene, samples, threads):
    render = scene.render
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = SIZE
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", threads
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    cycles = scene.cycles
    cycles.device, cycles.samples = "CPU", samples
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 4
    cycles.pixel_filter_type = "BOX"
    cycles.blur_glossy, cycles.caustics_reflective = 0, True


def main():
    model, picture, samples, threads = sys.argv[sys.argv.index("--") + 1:]
    scene = build()
    configure(scene, int(samples), int(threads))
    bpy.ops.export_scene.gltf(filepath=model, export_format="GLB", export_lights=True, export_cameras=True, export_animations=False,
                              export_current_frame=True, export_original_specular=True)
    for of in bpy.data.materials:
        if of.use_nodes and "Principled BSDF" in of.node_tree.nodes:
            shade_as_gltf(of)
    bpy.ops.render.render()
    bpy.data.images["Render Result"].save_render(picture)


main()
