"""OLATs by the sketch of reflectance transfer, for `tests/transfer.rs`: transfer.py SKETCH FOLDER.

SKETCH is the sketch's file. FOLDER has `about.json` (width, height, poses, lamps with directions, weights of the interview's
light) and float32 planes: `frame`, `frame_mask`, and for each pose `lit_N`, `mask_N`, `olats_N`. Writes `olats`."""

import importlib.util
import json
import sys
import types

import numpy as np


def main():
    sketch, folder = sys.argv[1:]
    # The sketch needs this module for EXR files, but only when run directly.
    sys.modules.setdefault("OpenEXR", types.ModuleType("OpenEXR"))
    spec = importlib.util.spec_from_file_location("sketch", sketch)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    about = json.load(open(f"{folder}/about.json"))
    shape = (about["height"], about["width"])
    plane = lambda name: np.fromfile(f"{folder}/{name}", np.float32).reshape(-1, *shape)
    directions = np.array(about["directions"])
    exemplars = []
    for pose in range(about["poses"]):
        e = {"lit": plane(f"lit_{pose}")[0], "mask": plane(f"mask_{pose}")[0] > 0.5, "olats": plane(f"olats_{pose}")}
        e["depth"] = module.depth(module.normals(e["olats"], directions), e["mask"])
        exemplars.append(e)
    mask = plane("frame_mask")[0] > 0.5
    olats = module.transfer(plane("frame")[0], mask, exemplars, directions, np.array(about["weights"]))
    olats.astype(np.float32).tofile(f"{folder}/olats")


if __name__ == "__main__":
    main()
