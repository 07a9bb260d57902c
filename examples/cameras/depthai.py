"""Luxonis OAK cameras with stereo (DepthAI 3): frames to the capture service.

    pip install depthai grpcio grpcio-tools numpy
    python3 depthai.py [--address 127.0.0.1:7451] [--camera front] [--play FILE]
"""

import datetime
import sys

folder = sys.path.pop(0)  # The SDK has the name of this file.
import depthai as dai  # noqa: E402

sys.path.insert(0, folder)
import tryon_push as push  # noqa: E402

SIZE = (640, 400)
COLOR = dai.CameraBoardSocket.CAM_A


def linked(pipeline, platform):
    """Queue of depth drawn in the view of undistorted colour, so that one pinhole serves both."""
    color = pipeline.create(dai.node.Camera).build(COLOR).requestOutput(SIZE, enableUndistortion=True)
    stereo, sync = pipeline.create(dai.node.StereoDepth).build(True, size=SIZE), pipeline.create(dai.node.Sync)
    depth = stereo.depth
    if platform == dai.Platform.RVC4:
        align = pipeline.create(dai.node.ImageAlign)
        depth.link(align.input)
        color.link(align.inputAlignTo)
        depth = align.outputAligned
    else:
        color.link(stereo.inputAlignTo)
    depth.link(sync.inputs["depth"])
    color.link(sync.inputs["color"])
    return sync.out.createOutputQueue()


def main():
    args = push.parser(__doc__).parse_args()
    pipeline = dai.Pipeline()
    device = pipeline.getDefaultDevice()
    queue = linked(pipeline, device.getPlatform())
    (fx, _, cx), (_, fy, cy), _ = device.readCalibration().getCameraIntrinsics(COLOR, *SIZE)
    name = f"{device.getDeviceName()} {device.getDeviceId()}"
    if args.play:
        # On a device that is connected, as DepthAI's recordings are.
        pipeline.enableHolisticReplay(args.play)
    pipeline.start()
    sender = push.opened(args, depth=push.lens(*SIZE, fx, fy, cx, cy), device=name[:64])
    while pipeline.isRunning():
        pair = queue.get()
        time_us = pair["depth"].getTimestampDevice() // datetime.timedelta(microseconds=1)
        sender.send(pair["depth"].getFrame(), pair["color"].getCvFrame(), push.BGR8, time_us * 1000)
    sender.close()


if __name__ == "__main__":
    main()
