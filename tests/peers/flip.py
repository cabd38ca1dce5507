#!/usr/bin/env python3
"""FLIP by its authors' package: flip.py REFERENCE.png TEST.png MAP.f32 PIXELS_PER_DEGREE

Writes each pixel's error as little-endian float32, row by row, and prints the mean."""

import sys

import flip_evaluator

reference, test, out, pixels_per_degree = sys.argv[1:]
errors, mean, _ = flip_evaluator.evaluate(
    reference, test, "LDR", applyMagma=False, parameters={"ppd": float(pixels_per_degree)}
)
errors.astype("<f4").tofile(out)
print(mean)
