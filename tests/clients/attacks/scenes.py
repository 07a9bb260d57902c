"""Recordings that a camera plays: pictures as large as those of a person, and walls of one colour."""

from __future__ import annotations

import json
import pathlib

import numpy as np
from PIL import Image

from .box import Camera

WIDTH, HEIGHT, RATE = 640, 480, 30.0
# Standard deviation of the noise (grey levels): JPEG of quality 80 takes about 100 kB, as that of a person does.
NOISE = 14.0
WALL_MM = 3000
# Colours of the walls, RGB; far enough apart to be told after JPEG.
COLORS = {"red": (200, 30, 30), "green": (30, 180, 30), "blue": (40, 40, 210), "grey": (128, 128, 128)}


def record(folder: pathlib.Path, images: list[np.ndarray]) -> pathlib.Path:
    """An RGBD folder (README of the program, `REC`) of colour images before a wall. Returns the folder."""
    (folder / "rgb").mkdir(parents=True)
    (folder / "depth").mkdir()
    camera = {"width": WIDTH, "height": HEIGHT, "fx": 525.0, "fy": 525.0, "cx": 319.5, "cy": 239.5, "depth_scale": 1000.0}
    (folder / "camera.json").write_text(json.dumps(camera))
    lines = {"rgb": [], "depth": []}
    wall = Image.fromarray(np.full((HEIGHT, WIDTH), WALL_MM, np.uint16))
    for i, image in enumerate(images):
        Image.fromarray(image).save(folder / f"rgb/{i:03}.png", compress_level=1)
        wall.save(folder / f"depth/{i:03}.png")
        for kind in lines:
            lines[kind].append(f"{i / RATE:.6f} {kind}/{i:03}.png")
    for kind, text in lines.items():
        (folder / f"{kind}.txt").write_text("\n".join(text) + "\n")
    return folder


def noise(folder: pathlib.Path, name: str = "front") -> Camera:
    """A camera of 640×480 at 30 Hz whose pictures compress no better than those of a person."""
    rng = np.random.default_rng(1)
    ramp = np.linspace(40, 210, WIDTH)[None, :, None] * np.ones((HEIGHT, 1, 3))
    images = [np.clip(ramp + rng.normal(0, NOISE, ramp.shape), 0, 255).astype(np.uint8) for _ in range(10)]
    return Camera(name, str(record(folder / name, images)), RATE)


def wall(folder: pathlib.Path, color: str, rate: float = 10.0) -> Camera:
    """A camera that shows one colour and nobody; its name is the colour's."""
    image = np.full((HEIGHT, WIDTH, 3), COLORS[color], np.uint8)
    return Camera(color, str(record(folder / color, [image] * 4)), rate)


def color_of(jpeg: bytes) -> str:
    """Name of the wall's colour in a picture; empty when it shows none of them."""
    import io

    pixels = np.asarray(Image.open(io.BytesIO(jpeg)).convert("RGB").resize((8, 8)), float).reshape(-1, 3)
    for name, color in COLORS.items():
        if np.abs(pixels - color).max() < 40:
            return name
    return ""
