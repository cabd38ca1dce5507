#!/usr/bin/env python3
"""The weights of MediaPipe's selfie segmentation under the names of src/shoot/person: person_weights.py MODEL.tflite OUT.safetensors

MODEL is selfie_segmentation.tflite (general, 256 × 256) of the npm package @mediapipe/selfie_segmentation. Its half floats
are kept unchanged; axes go from height, width, channels to burn's channels, height, width. Needs numpy, safetensors and
tflite from PyPI."""

import sys

import numpy as np
import tflite
from safetensors.numpy import save_file

source, out = sys.argv[1:]
with open(source, "rb") as file:
    model = tflite.Model.GetRootAsModel(file.read(), 0)
graph = model.Subgraphs(0)
found = {}
for i in range(graph.TensorsLength()):
    tensor = graph.Tensors(i)
    data = model.Buffers(tensor.Buffer())
    if tensor.Type() == tflite.TensorType.FLOAT16 and data.DataLength():
        values = np.frombuffer(data.DataAsNumpy().tobytes(), "<f2")
        found[tensor.Name().decode()] = values.reshape(tensor.ShapeAsNumpy())

packed = {}
count = {"conv2d": 0, "depthwise_conv2d": 0}


def layer(name, of, axes):
    packed[f"{name}.weight"] = np.ascontiguousarray(found.pop(f"{of}/Kernel").transpose(axes))
    packed[f"{name}.bias"] = found.pop(f"{of}/Bias")


def numbered(name, kind, axes):
    """The next layer of this kind: Keras numbers them in the order in which the network uses them."""
    number = count[kind]
    count[kind] += 1
    layer(name, kind if number == 0 else f"{kind}_{number}", axes)


def conv(name):
    numbered(name, "conv2d", (0, 3, 1, 2))


def depthwise(name):
    numbered(name, "depthwise_conv2d", (3, 0, 1, 2))


def gate(name):
    conv(f"{name}.reduce")
    conv(f"{name}.expand")


conv("stem")
for block in range(8):
    conv(f"blocks.{block}.expand")
    depthwise(f"blocks.{block}.depthwise")
    if block not in (1, 2):
        gate(f"blocks.{block}.gate")
    conv(f"blocks.{block}.project")
conv("features")
conv("context")
for stage in range(3):
    conv(f"stages.{stage}.narrow")
    gate(f"stages.{stage}.gate")
    conv(f"stages.{stage}.blend")
    depthwise(f"stages.{stage}.depthwise")
layer("segment", "segment", (3, 0, 1, 2))
if found:
    sys.exit(f"{source}: layers that the network of src/shoot/person has not: {', '.join(found)}")
save_file(packed, out)
