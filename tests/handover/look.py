"""Renders the light of a handed-over shot with Cycles, after the shot's script: look.py FRAME FOLDER

sky.exr is the camera's view of the world within 90°; world.exr and lamps.exr show a matte ball of albedo 0.5 under the world
alone and under the lamps alone, from the front and without perspective."""

import math
import os
import sys

import bpy

frame, folder = sys.argv[-2:]
scene = bpy.context.scene
scene.render.use_compositing = False
scene.render.engine = "CYCLES"
scene.render.resolution_x = scene.render.resolution_y = 32
scene.cycles.samples = 128
scene.cycles.use_denoising = False
scene.cycles.use_adaptive_sampling = False
scene.cycles.max_bounces = 1
scene.cycles.pixel_filter_type = "BOX"
scene.frame_set(int(frame))
# Both kinds of light use the artist's switches.
lamps = bpy.data.collections["Lamps"]
background = next(n for n in scene.world.node_tree.nodes if n.type == "BACKGROUND")
camera = scene.camera.data


def render(name):
    scene.render.filepath = os.path.join(folder, name)
    bpy.ops.render.render(write_still=True)


scene.camera.location = (0, 0, 0)
camera.angle = math.radians(90)
render("sky.exr")

bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=1)
ball = bpy.context.object
bpy.ops.object.shade_smooth()
matte = bpy.data.materials.new("Matte")
matte.use_nodes = True
nodes = matte.node_tree.nodes
nodes.clear()
diffuse = nodes.new("ShaderNodeBsdfDiffuse")
diffuse.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
output = nodes.new("ShaderNodeOutputMaterial")
matte.node_tree.links.new(diffuse.outputs[0], output.inputs[0])
ball.data.materials.append(matte)
scene.camera.location = (0, -3, 0)
camera.type = "ORTHO"
camera.ortho_scale = 2
render("world.exr")
background.inputs["Strength"].default_value = 0
lamps.hide_render = False
render("lamps.exr")
