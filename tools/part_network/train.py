"""Trains the network of body parts on people that `tryon-bench render-people` makes, and writes it as ONNX.

One command trains from nothing: `python train.py --out ../../src/tracking/segment/part_network/parts.onnx`. It renders the
people beside the training, continues from `--checkpoint` where it was stopped, and logs every minute.
"""

import argparse
import json
import math
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import torch
from torch import nn
from torch.nn import functional

SIDE = 96
CLASSES = 27
NECK = 26
NOT_PERSON = CLASSES
UNKNOWN = 255
CELLS = SIDE // 4
YAW_BINS = 16
DEPTH_STEPS = 8192.0
NO_DEPTH = -32768
RECORD = np.dtype(
    [
        ("depth", "<i2", (SIDE, SIDE)),
        ("label", "u1", (SIDE, SIDE)),
        ("anchors", "<f4", (CLASSES, 4)),
        ("yaw", "<f4"),
        ("metres", "<f4"),
    ]
)
FRAMES = 4  # of one person
TEST = 1024  # records that the training doesn't see
FIRST = 12_000  # records at the first step
NEW = 40  # more records at each step
# Other side of a class.
MIRRORED = np.array([c ^ 1 if c < NECK else c for c in range(CLASSES)])
# Classes that may give no return together, and how often: dark hair, trousers, sleeves.
WITHOUT_RETURN = [([0, 1], 0.1), ([16, 17, 18, 19, 20, 21, 22, 23], 0.06), ([4, 5, 6, 7, 8, 9], 0.04)]


class Block(nn.Module):
    """Inverted residual block (Sandler et al. 2018)."""

    def __init__(self, channels, expansion, kernel=3):
        super().__init__()
        wide = channels * expansion
        self.layers = nn.Sequential(
            *convolution(channels, wide, 1),
            *convolution(wide, wide, kernel, groups=wide),
            nn.Conv2d(wide, channels, 1, bias=False),
            nn.BatchNorm2d(channels),
        )

    def forward(self, x):
        return x + self.layers(x)


def convolution(inputs, outputs, kernel, stride=1, groups=1):
    return [
        nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, groups=groups, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
    ]


def halved(inputs, outputs):
    """Half the resolution: depthwise with stride 2, then across the channels."""
    return convolution(inputs, inputs, 3, stride=2, groups=inputs) + convolution(inputs, outputs, 1)


class PartNetwork(nn.Module):
    """Picture [3, 96, 96] to classes [28, 24, 24], heat maps [27, 24, 24], depths [27, 24, 24] and yaw [16]."""

    def __init__(self, fine=48, middle=96, coarse=128):
        super().__init__()
        self.stem = nn.Sequential(*convolution(3, 24, 3, stride=2), *halved(24, fine))
        self.fine = nn.Sequential(Block(fine, 3), Block(fine, 3))
        self.middle = nn.Sequential(*halved(fine, middle), *[Block(middle, 3) for _ in range(4)])
        self.coarse = nn.Sequential(*halved(middle, coarse), *[Block(coarse, 3, 5) for _ in range(3)])
        self.to_middle = nn.Sequential(*convolution(coarse, middle, 1))
        self.up_middle = Block(middle, 2)
        self.to_fine = nn.Sequential(*convolution(middle, 64, 1))
        self.from_fine = nn.Sequential(*convolution(fine, 64, 1))
        self.up_fine = nn.Sequential(Block(64, 2), Block(64, 2))
        self.maps = nn.Conv2d(64, (CLASSES + 1) + 3 * CLASSES, 1)
        self.yaw = nn.Sequential(nn.Linear(2 * coarse, 96), nn.ReLU(inplace=True), nn.Linear(96, YAW_BINS))

    def forward(self, picture):
        fine = self.fine(self.stem(picture))
        middle = self.middle(fine)
        coarse = self.coarse(middle)
        yaw = self.yaw(torch.cat([coarse.mean((2, 3)), coarse.amax((2, 3))], 1))
        x = middle + functional.interpolate(self.to_middle(coarse), scale_factor=2.0, mode="nearest")
        x = self.to_fine(self.up_middle(x))
        x = self.from_fine(fine) + functional.interpolate(x, scale_factor=2.0, mode="nearest")
        maps = self.maps(self.up_fine(x))
        classes, heat, share, behind = maps.split([CLASSES + 1, CLASSES, CLASSES, CLASSES], 1)
        # A joint lies a little behind the nearer or the farther of what is read in a cell: a hand before the trunk shares
        # its cells with it.
        near, far, is_read = readings(picture)
        depth = near + share.sigmoid() * (far - near) + behind
        return classes, heat, depth * is_read, yaw


def readings(picture):
    """Least and largest depth in each cell, and 1 where the person is read in it."""
    depth, read = picture[:, 0:1], picture[:, 1:2]
    beyond = 4.0 * (1.0 - read)  # no depth comes so far
    near = -functional.max_pool2d(-depth - beyond, 4)
    far = functional.max_pool2d(depth - beyond, 4)
    return near, far, functional.max_pool2d(read, 4)


def pictures(records, rng):
    """A batch with its truth as tensors, each mirrored or not, some with parts that give no return."""
    depth = records["depth"].copy()
    label = records["label"].copy()
    anchors = records["anchors"].copy()
    yaw = records["yaw"].copy()
    for i in range(len(records)):
        if rng.random() < 0.5:
            depth[i], label[i] = depth[i, :, ::-1], label[i, :, ::-1]
            known = label[i] < NECK
            label[i][known] ^= 1
            anchors[i] = anchors[i][MIRRORED]
            anchors[i, :, 0] = 1.0 - anchors[i, :, 0]
            yaw[i] = -yaw[i]
        spoil(depth[i], label[i], rng)
    read = depth != NO_DEPTH
    label[~read] = UNKNOWN
    picture = np.zeros((len(records), 3, SIDE, SIDE), np.float32)
    picture[:, 0] = np.where(read, depth / DEPTH_STEPS, 0.0)
    picture[:, 1] = read
    picture[:, 2] = records["metres"][:, None, None]
    # One label a cell: of the pixel next to its middle.
    return tuple(map(torch.from_numpy, (picture, label[:, 2::4, 2::4].astype(np.int64), anchors, yaw)))


def spoil(depth, label, rng):
    """Takes readings away: of parts without return, of strips and spots."""
    for classes, share in WITHOUT_RETURN:
        if rng.random() < share:
            kept = rng.random(depth.shape) < rng.choice([0.0, 0.0, 0.15])
            depth[np.isin(label, classes) & ~kept] = NO_DEPTH
    if rng.random() < 0.15:
        for _ in range(rng.integers(1, 4)):
            half = rng.integers(1, 12, 2)
            at = rng.integers(0, SIDE, 2)
            low = np.maximum(at - half, 0)
            depth[low[0] : at[0] + half[0], low[1] : at[1] + half[1]] = NO_DEPTH
    if rng.random() < 0.2:
        depth[rng.random(depth.shape) < rng.random() * 0.3] = NO_DEPTH


GRID = (torch.arange(CELLS) + 0.5) / CELLS


def losses(outputs, truth):
    """Cross entropy of classes, heat maps and yaw; absolute error of the places and depths that the heat maps give."""
    classes, heat, depth, yaw = outputs
    picture, label, anchors, true_yaw = truth
    parts = functional.cross_entropy(classes, label.masked_fill(label == UNKNOWN, -1), ignore_index=-1)
    at, valid = anchors[..., :2], anchors[..., 3] > 0
    seen = valid & (at > 0.0).all(-1) & (at < 1.0).all(-1)
    # The target is a Gaussian of one cell; joints outside the window ask for no place.
    x = torch.exp(-0.5 * ((GRID - at[..., :1]) * CELLS) ** 2)
    y = torch.exp(-0.5 * ((GRID - at[..., 1:]) * CELLS) ** 2)
    target = y[..., :, None] * x[..., None, :]
    # Sigmoids: a map without a joint is empty.
    target = target * seen[..., None, None]
    weight = 1.0 + 20.0 * target
    places = (functional.binary_cross_entropy_with_logits(heat, target, reduction="none") * weight).mean()
    share = heat.flatten(2).softmax(-1)
    found_x = (share.unflatten(2, (CELLS, CELLS)).sum(2) * GRID).sum(-1)
    found_y = (share.unflatten(2, (CELLS, CELLS)).sum(3) * GRID).sum(-1)
    # Depth where the joint is: the Gaussian's mean of the map's cells that have a reading.
    near = target * readings(picture)[2]
    total = near.sum((2, 3))
    found_depth = (depth * near).sum((2, 3)) / total.clamp(min=1e-6)
    count = seen.sum().clamp(min=1)
    is_read = seen & (total > 0.5)
    spread = ((found_x - at[..., 0]).abs() + (found_y - at[..., 1]).abs())[seen].sum() / count
    away = (found_depth - anchors[..., 2]).abs()[is_read].sum() / is_read.sum().clamp(min=1)
    has_yaw = ~true_yaw.isnan()
    bins = torch.arange(YAW_BINS) * (2 * math.pi / YAW_BINS)
    soft = torch.softmax(12.0 * torch.cos(true_yaw[has_yaw, None] - bins), 1)
    turn = functional.cross_entropy(yaw[has_yaw], soft)
    return {"parts": parts, "places": 10.0 * places, "spread": 2.0 * spread, "away": 5.0 * away, "yaw": 0.4 * turn}


@torch.no_grad()
def score(network, records):
    """Share of seen anchors within 10 cm, of facings within a quarter turn, of right cells."""
    network.eval()
    hits, facings, cells = [], [], []
    for batch in np.array_split(records, max(1, len(records) // 64)):
        picture, label, anchors, true_yaw = pictures(batch, Unspoilt())
        classes, heat, depth, yaw = network(picture)
        best = heat.flatten(2).argmax(-1)
        at = torch.stack([(best % CELLS + 0.5) / CELLS, (best // CELLS + 0.5) / CELLS], -1)
        away = depth.flatten(2).gather(2, best[..., None])[..., 0]
        error = torch.cat([at - anchors[..., :2], (away - anchors[..., 2])[..., None]], -1).norm(dim=-1)
        error = error * torch.from_numpy(batch["metres"].copy())[:, None]
        seen = torch.stack([(label == c).sum((1, 2)) >= 2 for c in range(CLASSES)], 1)
        hits.append((error < 0.1)[seen])
        bins = torch.arange(YAW_BINS) * (2 * math.pi / YAW_BINS)
        share = yaw.softmax(1)
        turn = torch.atan2((share * bins.sin()).sum(1), (share * bins.cos()).sum(1))
        has_yaw = ~true_yaw.isnan()
        facings.append(torch.cos(turn - true_yaw)[has_yaw] > 0)
        known = label != UNKNOWN
        cells.append((classes.argmax(1) == label)[known])
    network.train()
    return {k: 100 * torch.cat(v).float().mean().item() for k, v in [("joints", hits), ("facings", facings), ("cells", cells)]}


class Unspoilt:
    """In place of random numbers: nothing mirrored, nothing taken away."""

    def random(self, shape=None):
        return 1.0 if shape is None else np.ones(shape)


def export(network, path):
    """Writes the network as ONNX, with normalisation folded into the convolutions by the exporter."""
    network.eval()
    torch.onnx.export(
        network,
        (torch.zeros(1, 3, SIDE, SIDE),),
        str(path),
        input_names=["picture"],
        output_names=["classes", "heat", "depth", "yaw"],
        opset_version=17,
        dynamo=False,
    )
    network.train()


def first_records(path, step, people):
    """The records that a step draws from: more with each step, so that rendering and training run side by side and a step
    draws from the same ones each time. Waits for them."""
    most = people * FRAMES * 9 // 10  # some people give fewer than four pictures
    count = min(most, FIRST + NEW * step)
    while not path.exists() or path.stat().st_size < count * RECORD.itemsize:
        time.sleep(1.0)
    return np.memmap(path, RECORD, "r", shape=count)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="ONNX file to write")
    parser.add_argument("--records", type=Path, default=Path("people.bin"), help="rendered people; made if missing")
    parser.add_argument("--people", type=int, default=30_000, help="people to render, four pictures each")
    parser.add_argument("--bench", default="tryon-bench", help="the program that renders")
    parser.add_argument("--checkpoint", type=Path, default=Path("parts.pt"))
    parser.add_argument("--steps", type=int, default=7500)
    parser.add_argument("--batch", type=int, default=64)
    parser.add_argument("--rate", type=float, default=3e-3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1, help="of the training; more wait for each other beside the rendering")
    args = parser.parse_args()
    torch.set_num_threads(args.threads)
    torch.manual_seed(args.seed)
    if not args.records.exists():
        subprocess.Popen([args.bench, "render-people", "--out", args.records, "--people", str(args.people), "--seed", str(args.seed)])
    network = PartNetwork().to(memory_format=torch.channels_last)
    size = sum(p.numel() for p in network.parameters())
    steps = args.steps
    optimiser = torch.optim.AdamW(network.parameters(), lr=args.rate, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, args.rate, total_steps=steps, pct_start=0.08)
    first = 0
    if args.checkpoint.exists():
        saved = torch.load(args.checkpoint, weights_only=True)
        network.load_state_dict(saved["network"])
        optimiser.load_state_dict(saved["optimiser"])
        schedule.load_state_dict(saved["schedule"])
        first = saved["step"]
    print(json.dumps({"weights": size, "steps": steps, "first": first, **vars(args)}, default=str), flush=True)
    log, said, sums = time.monotonic(), time.monotonic(), {}
    for step in range(first, steps):
        # A function of seed and step, so that a continued training is the same.
        rng = np.random.default_rng((args.seed, step))
        records = first_records(args.records, step, args.people)
        chosen = np.sort(rng.integers(TEST, len(records), args.batch))
        truth = pictures(records[chosen], rng)
        outputs = network(truth[0].to(memory_format=torch.channels_last))
        terms = losses(outputs, truth)
        optimiser.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimiser.step()
        schedule.step()
        for k, v in terms.items():
            sums[k] = sums.get(k, 0.0) + v.item()
        sums["n"] = sums.get("n", 0) + 1
        now = time.monotonic()
        if now - said > 60 or step + 1 == steps:
            mean = {k: round(v / sums["n"], 4) for k, v in sums.items() if k != "n"}
            rate = round(sums["n"] * args.batch / (now - said))
            print(json.dumps({"step": step + 1, "of": steps, "pictures a second": rate, **mean}), flush=True)
            said, sums = now, {}
        if now - log > 300 or step + 1 == steps:
            log = now
            state = {"network": network.state_dict(), "optimiser": optimiser.state_dict(), "schedule": schedule.state_dict(), "step": step + 1}
            torch.save(state, args.checkpoint)
            export(network, args.out)
            print(json.dumps({"step": step + 1, **score(network, records[:TEST])}), flush=True)


if __name__ == "__main__":
    sys.exit(main())
