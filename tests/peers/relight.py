"""The sum of lamps in NumPy and PyTorch, for `benches/relight.rs`.

Answers commands on standard input, one line of JSON each: `numpy N`, `numpy-lamps N`, `torch N` and
`torch-lamps N` sum N times and reply with their seconds; `check` replies with the sum of all pixels; `quit`
ends. Field and weights equal the bench's: value i is ((i * 2654435761) >> 8 & 0xffff) / 65536,
weights are [0.01 l + 0.1, 0.3, 1 / (1 + l)].
"""

import argparse
import json
import sys
import time

import numpy as np
import torch


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--lamps", type=int, default=41)
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    torch.set_num_threads(options.threads)

    count = options.lamps * 3 * options.size**2
    bits = np.arange(count, dtype=np.uint64) * np.uint64(2654435761)
    values = ((bits >> np.uint64(8)) & np.uint64(0xFFFF)).astype(np.float32) / np.float32(65536)
    del bits
    field = values.reshape(options.lamps, 3, -1)
    lamp = np.arange(options.lamps)
    weights = np.stack([0.01 * lamp + 0.1, 0 * lamp + 0.3, 1 / (1 + lamp)], axis=1).astype(np.float32)
    field_torch, weights_torch = torch.from_numpy(field), torch.from_numpy(weights)

    def lamp_by_lamp():
        relit = np.zeros(field.shape[1:], np.float32)
        term = np.empty_like(relit)
        for weight, olat in zip(weights, field):
            np.multiply(olat, weight[:, None], out=term)
            relit += term
        return relit

    def torch_lamp_by_lamp():
        relit = torch.zeros(field.shape[1:])
        for weight, olat in zip(weights_torch, field_torch):
            relit.addcmul_(olat, weight[:, None])
        return relit

    sums = {
        "numpy": lambda: np.einsum("lc,lcn->cn", weights, field),
        "numpy-lamps": lamp_by_lamp,
        "torch": lambda: torch.einsum("lc,lcn->cn", weights_torch, field_torch),
        "torch-lamps": torch_lamp_by_lamp,
    }
    for line in sys.stdin:
        what, _, times = line.strip().partition(" ")
        if what == "quit":
            break
        if what == "check":
            reply = {"sums": [float(np.asarray(sum()).sum(dtype=np.float64)) for sum in sums.values()]}
        elif what in sums:
            seconds = []
            for _ in range(int(times)):
                start = time.perf_counter()
                sums[what]()
                seconds.append(time.perf_counter() - start)
            reply = {"seconds": seconds}
        else:
            reply = {"error": "expected: " + " N, ".join(sums) + " N, check or quit"}
        print(json.dumps(reply), flush=True)


if __name__ == "__main__":
    main()
