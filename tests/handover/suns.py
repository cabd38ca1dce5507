"""Writes the placed lights of a handed-over shot in each frame, after the shot's script: suns.py FOLDER

suns.json has an object for each frame: by light name, its position, the direction to it from the subject, its angle
and its irradiance per channel."""

import json
import os
import sys

import bpy

scene = bpy.context.scene


def sun(thing):
    light = thing.data
    return {
        "stands": list(thing.matrix_world.translation),
        # A sun shines along its −Z.
        "direction": list(thing.matrix_world.col[2].xyz),
        "angle": light.angle,
        "light": [light.energy * channel for channel in light.color],
    }


placed = bpy.data.collections["Placed lights"].objects
frames = []
for frame in range(scene.frame_start, scene.frame_end + 1):
    scene.frame_set(frame)
    frames.append({thing.name: sun(thing) for thing in placed})
with open(os.path.join(sys.argv[-1], "suns.json"), "w") as file:
    json.dump(frames, file)
