"""Orbbec Gemini, Femto, Astra 2 and others of Orbbec's SDK 2, or a recording of one: frames to the capture service.

    pip install pyorbbecsdk2 grpcio grpcio-tools numpy
    python3 orbbec.py [--address 127.0.0.1:7451] [--camera front] [--play FILE.bag]
"""

import pyorbbecsdk as ob
import tryon_push as push

ENCODINGS = {
    ob.OBFormat.RGB: push.RGB8,
    ob.OBFormat.BGR: push.BGR8,
    ob.OBFormat.MJPG: push.JPEG,
    ob.OBFormat.YUYV: push.YUYV,
}
# Polynomials of the ray, as OpenCV's.
MODELS = ("NONE", "BROWN_CONRADY", "BROWN_CONRADY_K6", "MODIFIED_BROWN_CONRADY")


def lens(k, d):
    if d.model.name not in MODELS:
        raise SystemExit(f"lens model {d.model.name} is not known here")
    coefficients = (d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6)
    return push.lens(k.width, k.height, k.fx, k.fy, k.cx, k.cy, coefficients)


def described(pipeline, depth):
    """Description of a started pipeline and a depth frame of it."""
    c, info = pipeline.get_camera_param(), pipeline.get_device().get_device_info()
    return {
        "depth": lens(c.depth_intrinsic, c.depth_distortion),
        "color": lens(c.rgb_intrinsic, c.rgb_distortion),
        # Lengths of this SDK are millimetres.
        "color_from_depth": push.pose(c.transform.rot.reshape(3, 3), c.transform.transform * 1e-3),
        "depth_unit": depth.get_depth_scale() * 1e-3,
        "device": f"{info.get_name()} {info.get_serial_number()}"[:64],
    }


def main():
    args = push.parser(__doc__).parse_args()
    pipeline, config = ob.Pipeline(ob.PlaybackDevice(args.play)) if args.play else ob.Pipeline(), ob.Config()
    for sensor in (ob.OBSensorType.DEPTH_SENSOR, ob.OBSensorType.COLOR_SENSOR):
        config.enable_stream(pipeline.get_stream_profile_list(sensor).get_default_video_stream_profile())
    config.set_frame_aggregate_output_mode(ob.OBFrameAggregateOutputMode.FULL_FRAME_REQUIRE)
    pipeline.enable_frame_sync()
    pipeline.start(config)
    sender = None
    while frames := pipeline.wait_for_frames(5000):
        depth, color = frames.get_depth_frame(), frames.get_color_frame()
        sender = sender or push.opened(args, **described(pipeline, depth))
        sender.send(depth.get_data(), color.get_data(), ENCODINGS[color.get_format()], depth.get_timestamp_us() * 1000)
    if sender:
        sender.close()


if __name__ == "__main__":
    main()
