"""The feature networks of src/prediction/training/features in PyTorch, in torchvision's layout.

    features.py --network vgg16|vgg19|squeezenet --out DIR [--size N] [--seed N]

Writes weights.safetensors and weights.pth with random weights, and slices.safetensors with an input in
[0, 1], the compared layers and the gradient of the sum of their root mean squares by the input.
"""

import argparse
from pathlib import Path

import torch
from safetensors.torch import save_file
from torch import nn

MEAN = torch.tensor([0.485, 0.456, 0.406]).reshape(1, 3, 1, 1)
DEVIATION = torch.tensor([0.229, 0.224, 0.225]).reshape(1, 3, 1, 1)


class Fire(nn.Module):
    def __init__(self, inputs, squeezed, expanded):
        super().__init__()
        self.squeeze = nn.Conv2d(inputs, squeezed, 1)
        self.expand1x1 = nn.Conv2d(squeezed, expanded, 1)
        self.expand3x3 = nn.Conv2d(squeezed, expanded, 3, padding=1)

    def forward(self, x):
        x = torch.relu(self.squeeze(x))
        return torch.cat([torch.relu(self.expand1x1(x)), torch.relu(self.expand3x3(x))], 1)


class Network(nn.Module):
    """Layers under torchvision's name, and the indices of the compared ones."""

    def __init__(self, layers, compared):
        super().__init__()
        self.features = nn.Sequential(*layers)
        self.classifier = nn.Linear(4, 2)
        self.compared = compared
        for layer in self.modules():
            if isinstance(layer, nn.Conv2d):
                nn.init.kaiming_uniform_(layer.weight, nonlinearity="relu")
                nn.init.uniform_(layer.bias, -0.1, 0.1)

    def forward(self, x):
        x = (x - MEAN) / DEVIATION
        slices = []
        for i, layer in enumerate(self.features):
            x = layer(x)
            if i in self.compared:
                slices.append(x)
        return slices


def vgg(convolutions, compared):
    layers, channels = [], 3
    for width, count in zip([64, 128, 256, 512, 512], convolutions):
        for _ in range(count):
            layers += [nn.Conv2d(channels, width, 3, padding=1), nn.ReLU()]
            channels = width
        layers.append(nn.MaxPool2d(2))
    return Network(layers, compared)


def squeezenet():
    pool = [nn.MaxPool2d(3, 2, ceil_mode=True)]
    layers = [nn.Conv2d(3, 64, 3, stride=2), nn.ReLU()] + pool
    layers += [Fire(64, 16, 64), Fire(128, 16, 64)] + pool
    layers += [Fire(128, 32, 128), Fire(256, 32, 128)] + pool
    layers += [Fire(256, 48, 192), Fire(384, 48, 192), Fire(384, 64, 256), Fire(512, 64, 256)]
    return Network(layers, [1, 4, 7, 9, 10, 11, 12])


NETWORKS = {
    "vgg16": lambda: vgg([2, 2, 3, 3, 3], [3, 8, 15, 22]),
    "vgg19": lambda: vgg([2, 2, 4, 4, 4], [3, 8, 17, 26]),
    "squeezenet": squeezenet,
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--network", choices=NETWORKS, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--size", type=int, default=32)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    torch.manual_seed(options.seed)
    network = NETWORKS[options.network]()
    options.out.mkdir(parents=True, exist_ok=True)
    weights = network.state_dict()
    torch.save(weights, options.out / "weights.pth")
    save_file(weights, options.out / "weights.safetensors")
    x = torch.rand(2, 3, options.size, options.size, requires_grad=True)
    slices = network(x)
    sum(s.square().mean().sqrt() for s in slices).backward()
    values = {f"slice.{i}": s.detach().contiguous() for i, s in enumerate(slices)}
    save_file({"input": x.detach(), "gradient": x.grad, **values}, options.out / "slices.safetensors")


if __name__ == "__main__":
    main()
