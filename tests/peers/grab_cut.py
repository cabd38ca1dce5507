#!/usr/bin/env python3
"""GrabCut by OpenCV: grab_cut.py PICTURE.png MARKS.png START.f64 ROUNDS OUT.png

MARKS holds OpenCV's labels: 0 background, 1 subject, 2 perhaps background, 3 perhaps subject. START holds the colours
that the first round starts with, as OpenCV's models of background and subject: 65 little-endian float64 each. OUT is 255
on the subject."""

import sys

import cv2
import numpy as np

picture, marks, start, rounds, out = sys.argv[1:]
labels = cv2.imread(marks, cv2.IMREAD_GRAYSCALE)
back, front = np.fromfile(start, "<f8").reshape(2, 1, 65).copy()
cv2.grabCut(cv2.imread(picture), labels, None, back, front, int(rounds), cv2.GC_EVAL)
if not cv2.imwrite(out, np.where(labels % 2 == 1, 255, 0).astype(np.uint8)):
    sys.exit(f"cannot write {out}")
