#!/usr/bin/env python3
"""OpenColorIO on a chart: ocio.py IN.f32 OUT.f32 table FILE.cube | space NAME | config CONFIG SOURCE LOOKS TARGET…

Both files are little-endian float32, three to a pixel. `table` applies a look-up table with tetrahedral interpolation,
`space` converts linear Rec. 709 to a colour space of OpenColorIO's own configuration for ACES. `config` converts the colour space
SOURCE of a configuration to each TARGET, after LOOKS if they are not empty: a colour space, or a display and a view separated by a
tab; the results follow each other. Without a SOURCE it starts at linear Rec. 709 and goes through the colour space that the
configuration shares with OpenColorIO's own."""

import array
import sys

import PyOpenColorIO as ocio

source, target, what, name, *rest = sys.argv[1:]
pixels = array.array("f")
with open(source, "rb") as file:
    pixels.frombytes(file.read())


def apply(processor, pixels):
    made = array.array("f", pixels)
    processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGB(made)
    return made


def transform(space, looks, wanted):
    if "\t" not in wanted:
        if looks:
            return ocio.LookTransform(space, wanted, looks)
        return ocio.ColorSpaceTransform(space, wanted)
    display, view = wanted.split("\t")
    group = ocio.GroupTransform()
    if looks:
        group.appendTransform(ocio.LookTransform(space, space, looks))
    group.appendTransform(
        ocio.DisplayViewTransform(space, display, view, looksBypass=bool(looks))
    )
    return group


if what == "table":
    config = ocio.Config.CreateRaw()
    made = apply(
        config.getProcessor(
            ocio.FileTransform(name, interpolation=ocio.INTERP_TETRAHEDRAL)
        ),
        pixels,
    )
elif what == "space":
    config = ocio.Config.CreateFromBuiltinConfig("cg-config-v1.0.0_aces-v1.3_ocio-v2.1")
    made = apply(config.getProcessor("Linear Rec.709 (sRGB)", name), pixels)
else:
    config = ocio.Config.CreateFromFile(name)
    space, looks, *wanted = rest
    if not space:
        space = config.getColorSpace("scene_linear").getName()
        common = ocio.Config.GetProcessorFromBuiltinColorSpace(
            "Linear Rec.709 (sRGB)", config, space
        )
        pixels = apply(common, pixels)
    made = array.array("f")
    for one in wanted:
        made.extend(apply(config.getProcessor(transform(space, looks, one)), pixels))
with open(target, "wb") as file:
    file.write(made.tobytes())
