#!/usr/bin/env python3
"""OpenColorIO on a chart: ocio.py IN.f32 OUT.f32 table FILE.cube | space NAME

Both files are little-endian float32, three to a pixel. `table` applies a look-up table with tetrahedral interpolation,
`space` brings linear Rec. 709 to a colour space of OpenColorIO's own configuration for ACES."""

import array
import sys

import PyOpenColorIO as ocio

source, target, what, name = sys.argv[1:]
if what == "table":
    config = ocio.Config.CreateRaw()
    transform = ocio.FileTransform(name, interpolation=ocio.INTERP_TETRAHEDRAL)
    processor = config.getProcessor(transform)
else:
    config = ocio.Config.CreateFromBuiltinConfig("cg-config-v1.0.0_aces-v1.3_ocio-v2.1")
    processor = config.getProcessor("Linear Rec.709 (sRGB)", name)
pixels = array.array("f")
with open(source, "rb") as file:
    pixels.frombytes(file.read())
processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGB(pixels)
with open(target, "wb") as file:
    file.write(pixels.tobytes())
