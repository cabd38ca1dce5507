"""Dense inverse search in OpenCV, for `benches/transfer.rs`: milliseconds of N runs as JSON.

Usage: flow.py FROM TO OFFSETS SIDE N SCALE STRIDE STEPS LINEARISATIONS ALPHA DELTA GAMMA. FROM and TO are square pictures of
8-bit codes; the offsets (x, y) are written to OFFSETS as 32-bit floats.
"""

import json
import sys
import time

import cv2
import numpy as np

side, runs, scale, stride, steps, linearisations = map(int, sys.argv[4:10])
alpha, delta, gamma = map(float, sys.argv[10:])
pictures = [np.fromfile(path, np.uint8).reshape(side, side) for path in sys.argv[1:3]]
cv2.setNumThreads(1)
search = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
search.setFinestScale(scale)
search.setPatchStride(stride)
search.setGradientDescentIterations(steps)
search.setVariationalRefinementIterations(linearisations)
search.setVariationalRefinementAlpha(alpha)
search.setVariationalRefinementDelta(delta)
search.setVariationalRefinementGamma(gamma)
times = []
for _ in range(runs + 1):
    start = time.perf_counter()
    offsets = search.calc(*pictures, None)
    times.append(1e3 * (time.perf_counter() - start))
offsets.astype(np.float32).tofile(sys.argv[3])
print(json.dumps(times[1:]))
