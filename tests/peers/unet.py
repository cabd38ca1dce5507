"""The network of src/prediction/reflectance/unet.rs in PyTorch: a source of numbers, and a peer to race.

    unet.py reference --out DIR [shape]   weights, a training step and its gradients as safetensors
    unet.py serve [shape] [peer]          timings on request: one command per line, answered by one line of JSON
    unet.py time [shape] [peer]           timings at once, as a table

Parameters have burn's names, so that weights can be exchanged as safetensors.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import torch
from safetensors.torch import load_file, save_file
from torch import nn
from torch._inductor import config as inductor
from torch.nn import functional

LEAK = 0.2
LEARNING_RATE = 1e-3
ADAM_EPSILON = 1e-8
LOSSES = 6


class Batch(nn.Module):
    """Batch normalisation under burn's names."""

    def __init__(self, channels):
        super().__init__()
        self.gamma = nn.Parameter(torch.ones(channels))
        self.beta = nn.Parameter(torch.zeros(channels))
        self.register_buffer("running_mean", torch.zeros(channels))
        self.register_buffer("running_var", torch.ones(channels))

    def forward(self, x):
        return functional.batch_norm(
            x, self.running_mean, self.running_var, self.gamma, self.beta, self.training, 0.1, 1e-5
        )


class Group(nn.Module):
    """Group normalisation over eight groups under burn's names."""

    def __init__(self, channels):
        super().__init__()
        self.gamma = nn.Parameter(torch.ones(channels))
        self.beta = nn.Parameter(torch.zeros(channels))

    def forward(self, x):
        return functional.group_norm(x, 8, self.gamma, self.beta, 1e-5)


class EncoderBlock(nn.Module):
    def __init__(self, inputs, outputs, kernel, normalization):
        super().__init__()
        self.convolution = nn.Conv2d(inputs, outputs, kernel, padding=kernel // 2)
        self.batch = Batch(outputs) if normalization == "batch" else None
        self.group = Group(outputs) if normalization == "group" else None

    def forward(self, x):
        x = self.convolution(x)
        if self.batch is not None:
            x = self.batch(x)
        if self.group is not None:
            x = self.group(x)
        return functional.leaky_relu(x, LEAK)


def blur_pool(x, kernels):
    """The binomial filter [1 2 1]/4 on both axes, edges repeated, then every second pixel."""
    padded = functional.pad(x, (1, 0, 1, 0), mode="replicate")
    return functional.conv2d(padded, kernels[: x.shape[1]], stride=2, groups=x.shape[1])


class UNet(nn.Module):
    def __init__(self, size, lamps, width, most_channels, normalization):
        super().__init__()
        blocks = size.bit_length()
        most_channels = max(most_channels, width)
        widths = [min(width << block, most_channels) for block in range(blocks)]
        self.encoder = nn.ModuleList()
        channels = 3
        for block, outputs in enumerate(widths):
            pixels = size >> block
            present = block > 0 and pixels > {"batch": 1, "group": 4, "none": 0}[normalization]
            self.encoder.append(
                EncoderBlock(channels, outputs, 7 if block == 0 else 3, normalization if present else "none")
            )
            channels = outputs
        self.decoder = nn.ModuleList()
        for outputs in reversed(widths[:-1]):
            self.decoder.append(nn.Conv2d(channels, outputs, 3, padding=1))
            channels = 2 * outputs
        self.output = nn.Conv2d(channels, 3 * lamps, 3, padding=1)
        bound = 0.1 / (channels * 9.0) ** 0.5
        nn.init.uniform_(self.output.weight, -bound, bound)
        nn.init.zeros_(self.output.bias)
        taps = torch.tensor([0.25, 0.5, 0.25])
        kernels = torch.outer(taps, taps).expand(max(widths), 1, 3, 3).contiguous()
        self.register_buffer("kernels", kernels, persistent=False)

    def forward(self, x):
        skips = []
        for i, block in enumerate(self.encoder):
            if i > 0:
                skips.append(x)
                x = blur_pool(x, self.kernels)
            x = block(x)
        for convolution in self.decoder:
            x = functional.interpolate(x, scale_factor=2, mode="bilinear", align_corners=False)
            x = functional.relu(convolution(x))
            x = torch.cat([x, skips.pop()], 1)
        return torch.sigmoid(self.output(x))


def encode(light, offset=0.01):
    """The display-like encoding of src/prediction/reflectance/kernels/pointwise.rs."""
    return (light.clamp(min=0) + offset) ** (1 / 2.2) - offset ** (1 / 2.2)


def feature_distance(pictures, truths, scales=3, epsilon=1e-4):
    """The distance of src/prediction/reflectance/kernels/feature_distance.rs, without a matte."""
    difference = pictures - truths
    values = difference[0].numel()
    total = 0
    for scale in range(scales):
        if scale > 0:
            difference = functional.avg_pool2d(difference, 2)
            values /= 4
        across = difference[..., 1:] - difference[..., :-1]
        down = difference[..., 1:, :] - difference[..., :-1, :]
        changes = across.square().sum((1, 2, 3)) + down.square().sum((1, 2, 3))
        for squares in (difference.square().sum((1, 2, 3)), changes):
            total = total + (squares / values + epsilon**2).sqrt()
    return total.mean() / scales


def training_losses(output, target, plate):
    """Both losses of src/prediction/reflectance/kernels/losses.rs, for equal lamps and light."""
    lamps = output.unflatten(0, (-1, 3))
    reconstruction = feature_distance(encode(lamps), target.unflatten(0, (-1, 3)))
    return reconstruction + feature_distance(encode(lamps.mean(0, keepdim=True)), plate[None])


class Peer:
    """A network with the inputs of a training step, and PyTorch's ways to run it."""

    def __init__(self, options):
        torch.manual_seed(options.seed)
        self.network = UNet(
            options.size, options.lamps, options.width, options.most_channels, options.normalization
        )
        if options.weights is not None:
            self.network.load_state_dict(load_file(options.weights))
        self.device = torch.device(options.device)
        self.network = self.network.to(self.device)
        self.input = torch.rand(1, 3, options.size, options.size).to(self.device)
        self.target = torch.rand(1, 3 * options.lamps, options.size, options.size).to(self.device)
        if options.channels_last:
            self.network = self.network.to(memory_format=torch.channels_last)
            self.input = self.input.contiguous(memory_format=torch.channels_last)
            self.target = self.target.contiguous(memory_format=torch.channels_last)
        self.squares = options.loss == "squares"
        self.bf16 = options.bf16
        self.f16 = options.f16
        self.run, self.losses = self.network, training_losses
        if options.compile:
            # Channels last, a layout that Inductor chooses, breaks the gradient of replicated borders in PyTorch 2.15.
            inductor.layout_optimization = False
            self.run, self.losses = torch.compile(self.network), torch.compile(training_losses)
        self.optimizer = torch.optim.Adam(
            self.network.parameters(),
            lr=LEARNING_RATE,
            eps=ADAM_EPSILON,
            fused=True if options.fused else None,
        )

    def forward(self, dtype=torch.bfloat16, enabled=None):
        enabled = self.bf16 if enabled is None else enabled
        with torch.autocast(self.device.type, dtype=dtype, enabled=enabled):
            return self.run(self.input)

    def finish(self):
        """Waits for the GPU's work."""
        if self.device.type == "cuda":
            torch.cuda.synchronize()

    def memory(self):
        """Peak and current KiB: of PyTorch's allocator on a GPU, of the process on a CPU."""
        if self.device.type == "cuda":
            held, used = torch.cuda.max_memory_reserved(), torch.cuda.memory_allocated()
            most_used = torch.cuda.max_memory_allocated()
            return {
                "peak_kib": held // 1024,
                "now_kib": used // 1024,
                "peak_used_kib": most_used // 1024,
            }
        return {"peak_kib": status_kib("VmHWM"), "now_kib": status_kib("VmRSS")}

    def loss(self):
        output = self.forward().float()
        if self.squares:
            return functional.mse_loss(output, self.target)
        return self.losses(output[0], self.target[0], self.input[0])

    def step(self):
        """Runs one training step; returns its seconds, in total and by part."""
        self.network.train()
        times = [time.perf_counter()]
        self.optimizer.zero_grad()
        loss = self.loss()
        times.append(time.perf_counter())
        loss.backward()
        times.append(time.perf_counter())
        self.optimizer.step()
        loss = loss.item()
        self.finish()
        times.append(time.perf_counter())
        forward, backward, optimizer = (b - a for a, b in zip(times, times[1:]))
        return {
            "seconds": times[-1] - times[0],
            "forward": forward,
            "backward": backward,
            "optimizer": optimizer,
            "loss": loss,
        }

    def predict(self):
        self.network.eval()
        start = time.perf_counter()
        with torch.no_grad():
            if self.f16:
                self.forward(torch.float16, True)
            else:
                self.forward()
        self.finish()
        return {"seconds": time.perf_counter() - start}


def status_kib(name):
    """A line of /proc/self/status in KiB; getrusage would count the parent before exec."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(name + ":"):
            return int(line.split()[1])
    return 0


def columns(rows):
    """Turns a list of dictionaries into a dictionary of lists."""
    return {key: [row[key] for row in rows] for key in rows[0]} if rows else {}


def serve(options):
    peer = Peer(options)
    peers = {"step": peer.step, "predict": peer.predict}
    for line in sys.stdin:
        words = line.split()
        match words:
            case ["quit"]:
                break
            case ["memory"]:
                reply = peer.memory()
            case [("step" | "predict") as what, count] if count.isdigit():
                reply = columns([peers[what]() for _ in range(int(count))])
            case _:
                reply = {"error": "expected: step N, predict N, memory or quit"}
        print(json.dumps(reply), flush=True)


def time_(options):
    peer = Peer(options)
    print(f"PyTorch {torch.__version__}, {torch.get_num_threads()} threads")

    def report(what, run):
        for _ in range(2):
            run()
        rows = columns([run() for _ in range(options.repeat)])
        for key in ("seconds", "forward", "backward", "optimizer"):
            if key in rows:
                values = sorted(rows[key])
                median, least = values[len(values) // 2], values[0]
                print(f"{what:8} {key:10} median {median * 1e3:9.2f} ms  least {least * 1e3:9.2f} ms")
        memory = peer.memory()
        words = ", ".join(f"{name} {kib / 1024:.0f} MiB" for name, kib in memory.items())
        print(f"{what:8} memory {words}")

    report("predict", peer.predict)
    report("step", peer.step)


def burn_statistics(network, size):
    """The running statistics after one pass by burn's definition: its variance is over n, while
    PyTorch divides by n - 1."""
    statistics = {}
    for i, block in enumerate(network.encoder):
        if block.batch is not None:
            pixels = (size >> i) ** 2
            old = 0.9
            variance = old + (block.batch.running_var - old) * ((pixels - 1) / pixels)
            statistics[f"encoder.{i}.batch.running_mean"] = block.batch.running_mean
            statistics[f"encoder.{i}.batch.running_var"] = variance
    return statistics


def reference(options):
    peer = Peer(options)
    options.loss = "squares"
    out = Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    network = peer.network

    def plain(tensors):
        return {name: tensor.detach().clone().contiguous() for name, tensor in tensors.items()}

    weights = plain(network.state_dict())
    save_file(weights, out / "weights.safetensors")
    network.eval()
    with torch.no_grad():
        predicted = network(peer.input)
    network.train()
    output = network(peer.input)
    loss = functional.mse_loss(output, peer.target)
    loss.backward()
    save_file(
        plain({name: parameter.grad for name, parameter in network.named_parameters()}),
        out / "gradients.safetensors",
    )
    save_file(plain(burn_statistics(network, options.size)), out / "statistics.safetensors")
    logits = torch.logit(predicted).requires_grad_()
    training_loss = training_losses(torch.sigmoid(logits)[0], peer.target[0], peer.input[0])
    training_loss.backward()
    pooled_from = peer.input.clone().requires_grad_()
    pooled = blur_pool(pooled_from, network.kernels)
    pooled.square().mean().backward()
    network.load_state_dict(weights)
    losses = torch.tensor([peer.step()["loss"] for _ in range(LOSSES)])
    save_file(
        plain(
            {
                "input": peer.input,
                "target": peer.target,
                "output": output,
                "prediction": predicted,
                "losses": losses,
                "logits": logits,
                "training_loss": training_loss.reshape(1),
                "training_gradient": logits.grad,
                "pooled": pooled,
                "pooled_gradient": pooled_from.grad,
            }
        ),
        out / "step.safetensors",
    )
    shape = {
        name: getattr(options, name)
        for name in ("size", "lamps", "width", "most_channels", "normalization", "seed")
    }
    shape["torch"] = torch.__version__
    (out / "shape.json").write_text(json.dumps(shape, indent=2) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("mode", choices=["reference", "serve", "time"])
    parser.add_argument("--out", help="reference: folder to write into")
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--lamps", type=int, default=41)
    parser.add_argument("--width", type=int, default=16)
    parser.add_argument("--most-channels", type=int, default=64)
    parser.add_argument("--normalization", choices=["group", "batch", "none"], default="group")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--weights", help="safetensors to begin with, in place of fresh weights")
    parser.add_argument("--threads", type=int, default=0, help="0 leaves PyTorch's choice")
    parser.add_argument("--channels-last", action="store_true")
    parser.add_argument("--device", choices=["cpu", "cuda"], default="cpu")
    parser.add_argument("--bf16", action="store_true", help="under autocast to bfloat16")
    parser.add_argument("--f16", action="store_true", help="predictions under autocast to float16")
    parser.add_argument(
        "--exact", action="store_true", help="no TF32, which PyTorch takes for convolutions on CUDA"
    )
    parser.add_argument(
        "--loss", choices=["training", "squares"], default="squares", help="loss of a step"
    )
    parser.add_argument("--fused", action="store_true", help="PyTorch's fused Adam")
    parser.add_argument("--compile", action="store_true", help="through torch.compile")
    parser.add_argument("--repeat", type=int, default=10, help="time: runs of each kind")
    options = parser.parse_args()
    if options.mode == "reference" and options.out is None:
        parser.error("reference needs --out")
    if options.threads > 0:
        torch.set_num_threads(options.threads)
    if options.device == "cuda":
        if not torch.cuda.is_available():
            parser.error("--device cuda needs a CUDA device that PyTorch sees")
        # Kernels are timed against each other the first time, as ours are.
        torch.backends.cudnn.benchmark = True
        torch.backends.cudnn.allow_tf32 = not options.exact
    {"reference": reference, "serve": serve, "time": time_}[options.mode](options)


if __name__ == "__main__":
    main()
