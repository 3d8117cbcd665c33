#!/usr/bin/env python3
"""cycles_render.py FOLDER COLOR SAMPLES SEED OUT.exr REPORT.json RESOLUTION THREADS

The hair ball by Cycles, from the Python module bpy: Principled Hair by Chiang,
curves as tubes, nothing clamped, no denoiser, no adaptive sampling.
"""

import os
import sys
import time

import ball
import usage


def set_up(bpy, samples, seed, resolution, threads):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    settings = {
        "device": "CPU", "samples": samples, "seed": seed, "use_adaptive_sampling": False,
        "use_denoising": False, "sample_clamp_direct": 0, "sample_clamp_indirect": 0,
        "blur_glossy": 0, "caustics_reflective": True, "caustics_refractive": True,
        "pixel_filter_type": "BOX", "filter_width": 1.0, "use_auto_tile": False,
        "light_sampling_threshold": 0,
    }
    for kind in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
        settings[f"{kind}_bounces"] = ball.BOUNCES
    for name, value in settings.items():
        setattr(scene.cycles, name, value)
    scene.cycles_curves.shape = "THICK"
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    scene.render.resolution_x = scene.render.resolution_y = resolution
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"
    return scene


def add_camera(bpy, scene):
    import mathutils
    import numpy as np
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "HORIZONTAL"
    camera.angle = np.radians(ball.CAMERA["fov"])
    matrix = np.eye(4)
    for column, axis in enumerate(ball.camera_axes()):
        matrix[:3, column] = axis
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.camera.matrix_world = mathutils.Matrix(matrix.tolist())
    scene.collection.objects.link(scene.camera)


def add_sky(bpy, scene):
    world = scene.world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    background.inputs["Strength"].default_value = ball.SKY
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs[0])


def material(bpy, name, node_type, inputs, attributes=None):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    node = tree.nodes.new(node_type)
    for key, value in (attributes or {}).items():
        setattr(node, key, value)
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs[0])
    return made


def hair_material(bpy, color):
    import math
    made = material(
        bpy, "hair", "ShaderNodeBsdfHairPrincipled",
        {"Absorption Coefficient": ball.COLORS[color], "Roughness": ball.HAIR["beta_m"],
         "Radial Roughness": ball.HAIR["beta_n"], "IOR": ball.HAIR["eta"],
         "Offset": math.radians(ball.HAIR["alpha"]), "Coat": 0.0},
        {"model": "CHIANG", "parametrization": "ABSORPTION"})
    # All strands alike.
    for node in made.node_tree.nodes:
        for socket in node.inputs:
            if socket.name.startswith("Random") and hasattr(socket, "default_value"):
                socket.default_value = 0
    return made


def add_mesh(bpy, scene, name, vertices, faces, shading, smooth):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, v)) for v in vertices], [], faces)
    mesh.materials.append(shading)
    for polygon in mesh.polygons:
        polygon.use_smooth = smooth
    scene.collection.objects.link(bpy.data.objects.new(name, mesh))


def add_hair(bpy, scene, folder, shading):
    """Cycles has Catmull-Rom curves only: through the knots of the B-splines."""
    import numpy as np
    points = np.load(os.path.join(folder, "hair.npy")).astype(np.float64)
    knots = ((points[:, :-2] + 4 * points[:, 1:-1] + points[:, 2:]) / 6).astype(np.float32)
    curves = bpy.data.hair_curves.new("hair")
    curves.add_curves([knots.shape[1]] * knots.shape[0])
    curves.attributes["position"].data.foreach_set("vector", knots[..., :3].ravel())
    radius = curves.attributes.get("radius") or curves.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", knots[..., 3].ravel())
    curves.materials.append(shading)
    scene.collection.objects.link(bpy.data.objects.new("hair", curves))


def main(folder, color, samples, seed, out, report, resolution, threads):
    import bpy
    scene = set_up(bpy, int(samples), int(seed), int(resolution), int(threads))
    add_camera(bpy, scene)
    add_sky(bpy, scene)
    add_mesh(bpy, scene, "light", ball.light_corners(), [(0, 1, 2, 3)],
             material(bpy, "light", "ShaderNodeEmission",
                      {"Color": (1, 1, 1, 1), "Strength": ball.LIGHT["radiance"]}), False)
    vertices, faces = ball.head_mesh()
    add_mesh(bpy, scene, "head", vertices * ball.HEAD["radius"], faces,
             material(bpy, "head", "ShaderNodeBsdfDiffuse",
                      {"Color": (*ball.HEAD["albedo"], 1)}), True)
    add_hair(bpy, scene, folder, hair_material(bpy, color))
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
    scene.render.filepath = os.path.abspath(out)
    before = (time.time(), usage.cpu_seconds())
    bpy.ops.render.render(write_still=True)
    after = (time.time(), usage.cpu_seconds())
    usage.write_report(report, before, after, {"version": bpy.app.version_string})


if __name__ == "__main__":
    if len(sys.argv) != 9:
        sys.exit(__doc__)
    main(*sys.argv[1:])
