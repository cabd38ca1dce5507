"""A shot of Afterlight in Blender 3.3 to 4.5: compositor, world and lamps, in a scene of its own.

In the window: open this file in the Scripting workspace and press Run, or start `blender -P SHOT.blender.py`. Without a
window, `blender -b -P SHOT.blender.py -a` writes the rebuilt pictures to the folder SHOT.blender.

The compositor multiplies each light layer by its lamp's weight and adds all up, in the groups Key, Fill and Rim. The colour
of a node is the lamp's weight: change it to change the lamp. The world shows the environment, turned as in the shot, and the
collection "Placed lights" holds a sun for each light that was placed by hand. The collection "Lamps" holds a sun for each lamp
of the stage, which give the same light as world and placed lights together. Use one or the other: the lamps are switched off at
first. The subject stands at the origin, Z is up, and the camera looks along +Y.
"""

import os
import sys

import bpy
from mathutils import Euler, Vector

# Numbers of the shot. Lists over frames have one entry where nothing changes.
SHOT = {}

FOLDER = os.path.dirname(os.path.abspath(__file__))


def fail(sentence):
    print(f"Afterlight: {sentence}", file=sys.stderr)
    # Otherwise Blender would continue and render something else.
    sys.exit(1)


def path(name):
    found = os.path.join(FOLDER, name)
    if not os.path.isfile(found):
        fail(f"{found} is missing; keep the script beside the shot's files")
    return found


def animate(target, key, values):
    """Sets a property to the values of the frames, one by one."""
    first = SHOT["frames"][0]
    for frame, value in enumerate(values, first):
        setattr(target, key, value)
        if len(values) > 1:
            target.keyframe_insert(key, frame=frame)


class Compositor:
    """The nodes that add up the layers."""

    def __init__(self, scene):
        scene.use_nodes = True
        self.scene = scene
        self.tree = scene.node_tree
        self.tree.nodes.clear()
        self.pictures = self.read(SHOT["picture"], "Layers", 0, 0)

    def node(self, kind, name, x, y):
        node = self.tree.nodes.new(kind)
        node.name = node.label = name
        node.location = (x, y)
        return node

    def read(self, name, label, x, y):
        """An image node that shows frame n of the files in frame n of the scene."""
        first, last = SHOT["frames"]
        image = bpy.data.images.load(path(name))
        # Raw values of the file.
        image.colorspace_settings.is_data = True
        image.alpha_mode = "CHANNEL_PACKED"
        node = self.node("CompositorNodeImage", label, x, y)
        if SHOT["sequence"]:
            image.source = "SEQUENCE"
        node.image = image
        if SHOT["sequence"]:
            node.frame_duration = last - first + 1
            node.frame_start = first
            node.frame_offset = first - 1
        # Its layers are known only now.
        self.scene.frame_set(first)
        return node

    def layer(self, part, x, y):
        """The output that holds a layer."""
        if part["file"]:
            return self.read(part["file"], part["layer"], x, y).outputs["Image"]
        output = self.pictures.outputs.get(part["layer"])
        if output is None:
            fail(f"{SHOT['picture']} has no layer {part['layer']}")
        return output

    def mix(self, kind, name, x, y, first, second=None):
        node = self.node("CompositorNodeMixRGB", name, x, y)
        node.blend_type = kind
        node.inputs[0].default_value = 1.0
        self.tree.links.new(first, node.inputs[1])
        if second is not None:
            self.tree.links.new(second, node.inputs[2])
        return node

    def build(self):
        total = None
        y = 0
        for group in ("Key", "Fill", "Rim"):
            lamps = [lamp for lamp in SHOT["lamps"] if lamp["group"] == group]
            if not lamps:
                continue
            frame = self.tree.nodes.new("NodeFrame")
            frame.label = group
            together = None
            for lamp in lamps:
                layer = self.layer(lamp, 300, y)
                gain = self.mix("MULTIPLY", f"{lamp['layer']} {lamp['name']}", 600, y, layer)
                weights = [(r, g, b, 1.0) for r, g, b in lamp["weights"]]
                animate(gain.inputs[2], "default_value", weights)
                gain.parent = frame
                together = self.add(together, gain, f"{group} + {lamp['layer']}", 800, y)
                y -= 200
            # Gain of the group.
            whole = self.mix("MULTIPLY", group, 1000, y + 200, together.outputs[0])
            whole.inputs[2].default_value = (1.0, 1.0, 1.0, 1.0)
            total = self.add(total, whole, f"With {group}", 1200, y + 200)
        for part in SHOT["rest"]:
            layer = self.layer(part, 300, y)
            total = self.mix("ADD", "With rest", 1200, y, total.outputs[0], layer)
        alpha = self.node("CompositorNodeSetAlpha", "Alpha", 1400, y)
        alpha.mode = "REPLACE_ALPHA"
        self.tree.links.new(total.outputs[0], alpha.inputs[0])
        self.tree.links.new(self.pictures.outputs["Alpha"], alpha.inputs[1])
        end = alpha
        if SHOT["straight"]:
            end = self.node("CompositorNodePremulKey", "Premultiplied", 1600, y)
            end.mapping = "STRAIGHT_TO_PREMUL"
            self.tree.links.new(alpha.outputs[0], end.inputs[0])
        output = self.node("CompositorNodeComposite", "Rebuilt", 1800, y)
        self.tree.links.new(end.outputs[0], output.inputs[0])

    def add(self, sum_so_far, node, name, x, y):
        if sum_so_far is None:
            return node
        return self.mix("ADD", name, x, y, sum_so_far.outputs[0], node.outputs[0])


def make_world(scene):
    world = bpy.data.worlds.new(SHOT["name"])
    scene.world = world
    world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    kinds = (
        "ShaderNodeTexCoord",
        "ShaderNodeMapping",
        "ShaderNodeTexEnvironment",
        "ShaderNodeVectorMath",
        "ShaderNodeBackground",
        "ShaderNodeOutputWorld",
    )
    nodes = [tree.nodes.new(kind) for kind in kinds]
    for column, node in enumerate(nodes):
        node.location = (200 * column, 0)
    place, mapping, texture, strength, background, output = nodes
    texture.image = bpy.data.images.load(path(SHOT["world"]["file"]))
    mapping.vector_type = "POINT"
    strength.operation = "MULTIPLY"
    strength.label = "Strength"
    animate(mapping.inputs["Rotation"], "default_value", SHOT["world"]["rotation"])
    animate(strength.inputs[1], "default_value", SHOT["world"]["strength"])
    tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], texture.inputs[0])
    tree.links.new(texture.outputs[0], strength.inputs[0])
    tree.links.new(strength.outputs[0], background.inputs[0])
    tree.links.new(background.outputs[0], output.inputs[0])


def turns(directions):
    """The rotations of a sun that stands in these directions, one after the other. A sun shines along its −Z."""
    turn = Euler()
    for direction in directions:
        # Close to the previous rotation: the sun must not spin between frames.
        turn = direction.to_track_quat("Z", "Y").to_euler("XYZ", turn)
        yield turn


def make_suns(scene, name, lamps, hidden):
    """A sun for each lamp, in a collection: it shines from the lamp's direction, as large and as bright."""
    collection = bpy.data.collections.new(name)
    scene.collection.children.link(collection)
    collection.hide_render = hidden
    collection.hide_viewport = hidden
    for lamp in lamps:
        sun = bpy.data.lights.new(lamp["name"], "SUN")
        light = lamp["light"]
        energies = [max(rgb) for rgb in light]
        colors = [[c / e for c in rgb] if e > 0 else (1, 1, 1) for rgb, e in zip(light, energies)]
        animate(sun, "angle", lamp["angle"])
        animate(sun, "energy", energies)
        animate(sun, "color", colors)
        thing = bpy.data.objects.new(lamp["name"], sun)
        directions = [Vector(direction) for direction in lamp["direction"]]
        animate(thing, "location", [3 * direction for direction in directions])
        animate(thing, "rotation_euler", list(turns(directions)))
        collection.objects.link(thing)


def make_camera(scene):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, -3, 0)
    camera.rotation_euler = (1.5707963267948966, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera


def main():
    if not (3, 3) <= bpy.app.version[:2] < (5, 0):
        fail(f"this script is for Blender 3.3 to 4.5, and this is {bpy.app.version_string}")
    scene = bpy.data.scenes.new(SHOT["name"])
    if bpy.context.window is not None:
        bpy.context.window.scene = scene
    render = scene.render
    render.resolution_x, render.resolution_y = SHOT["size"]
    render.resolution_percentage = 100
    render.fps, render.fps_base = int(SHOT["rate"][0]), SHOT["rate"][1]
    scene.frame_start, scene.frame_end = SHOT["frames"]
    # Linear Rec. 709 as sRGB, without a film look.
    scene.view_settings.view_transform = "Standard"
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_mode = "RGBA"
    render.image_settings.color_depth = "32"
    render.filepath = os.path.join(FOLDER, SHOT["name"] + ".blender", SHOT["name"] + ".####")
    Compositor(scene).build()
    make_world(scene)
    make_suns(scene, "Lamps", SHOT["lamps"], True)
    make_suns(scene, "Placed lights", SHOT["placed"], False)
    make_camera(scene)
    scene.frame_set(SHOT["frames"][0])


main()
