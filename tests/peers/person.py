#!/usr/bin/env python3
"""MediaPipe's selfie segmentation by its own package: person.py PICTURE.png OUT.f32

OUT is the probability of a person at each pixel of PICTURE, 256 × 256, as little-endian float32, row by row. The package
includes the model, with the weights of `assets/person/weights.safetensors`."""

import sys

import cv2
import mediapipe

picture, out = sys.argv[1:]
pixels = cv2.cvtColor(cv2.imread(picture), cv2.COLOR_BGR2RGB)
if pixels.shape != (256, 256, 3):
    sys.exit(f"expected 256 × 256 pixels, found {pixels.shape}")
with mediapipe.solutions.selfie_segmentation.SelfieSegmentation(model_selection=0) as model:
    model.process(pixels).segmentation_mask.astype("<f4").tofile(out)
