"""Frames that stand-ins show, and the calibration of their two cameras."""

import math

import numpy as np

COUNT = 6
DEPTH_SIZE, COLOR_SIZE = (32, 24), (48, 28)
# fx, fy, cx, cy of depth and colour.
DEPTH_K, COLOR_K = (30.0, 30.5, 15.5, 12.25), (45.0, 45.5, 23.5, 13.75)
# k1, k2, p1, p2, k3 of colour; depth has none, so that its pixels stay where they are.
COLOR_DISTORTION = (-0.05, 0.06, 0.0002, -0.0006, -0.02)
# Metres of a unit of depth: four make a millimetre.
UNIT = 0.00025
# From depth to colour: about the axis (1, 2, 3) by 20 mrad, and metres.
TRANSLATION = (0.015, -0.002, 0.001)


def rotation():
    """Rodrigues' formula."""
    axis, angle = np.array((1.0, 2.0, 3.0)) / math.sqrt(14), 0.02
    x, y, z = axis
    cross = np.array(((0, -z, y), (z, 0, -x), (-y, x, 0)))
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def depth(number):
    """Readings in units; the first is none."""
    w, h = DEPTH_SIZE
    readings = 4 * (500 + 40 * number + np.arange(w * h, dtype=np.uint16).reshape(h, w))
    readings[0, 0] = 0
    return readings


def depth_mm(number):
    return depth(number) // 4


def color(number):
    """RGB of one colour."""
    w, h = COLOR_SIZE
    return np.full((h, w, 3), (30 + 20 * number, 90, 150), np.uint8)


def time_us(number):
    return 2_000_000 + 33_333 * number
