"""What libk4a says of a recording of an Azure Kinect: its playback, its calibration, its projection of rays."""

import numpy as np
from pyk4a import CalibrationType, PyK4APlayback

from .families import Expected


def rectified(calibration, depth):
    """Depth at the pixel nearest to where the SDK draws the ray of each pixel of the pinhole; 0 where it draws none."""
    (fx, _, cx), (_, fy, cy), _ = calibration.get_camera_matrix(CalibrationType.DEPTH)
    out = np.zeros_like(depth)
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            point = ((u - cx) / fx * 1000.0, (v - cy) / fy * 1000.0, 1000.0)
            try:
                x, y = calibration.convert_3d_to_2d(point, CalibrationType.DEPTH)
            except ValueError:
                continue
            column, row = round(x), round(y)
            if 0 <= column < depth.shape[1] and 0 <= row < depth.shape[0]:
                out[v, u] = depth[row, column]
    return out


def expected(path):
    playback = PyK4APlayback(path)
    playback.open()
    calibration, capture = playback.calibration, playback.get_next_capture()
    depth = rectified(calibration, capture.depth)
    rotation, translation = calibration.get_extrinsic_parameters(CalibrationType.DEPTH, CalibrationType.COLOR)

    def pinhole(camera):
        k = calibration.get_camera_matrix(camera)
        return (k[0, 0], k[1, 1], k[0, 2], k[1, 2])

    return Expected(
        depth_k=pinhole(CalibrationType.DEPTH),
        depth_mm=lambda t: depth if t == capture.depth_timestamp_usec * 1000 else None,
        color_k=pinhole(CalibrationType.COLOR),
        rotation=rotation,
        translation=tuple(translation.ravel()),
        # Floats of the SDK, halves of a pixel.
        share=0.999,
    )
