"""Behavioural constants of recording videos.

Codec: of 60 frames of two simulated people with sensor noise (standard deviation 3) at 640x480, MJPEG at quality 3 took 63
MB a minute at an error of 4.4 grey values (root mean square), H.264 (ultrafast, crf 16) 97 MB at 4.8, FFV1 355 MB at 3.9,
which is the loss of colour resolution alone; processor time 2, 3 and 7 ms a frame.  A cut MJPEG file loses no other frame.
"""

from collections.abc import Mapping

CODEC, PIXELS, QUALITY = "mjpeg", "yuvj420p", 3  # measured, see above
QP2LAMBDA = 118  # FFmpeg's FF_QP2LAMBDA
QUEUE = 60  # frames that wait for a writer; more are lost and counted; chosen by hand
QUEUE_PX = 1 << 28  # pixels of these frames, 0.8 GB: fewer above 2560x1600; chosen by hand
ENDS_S = 15.0  # for a writer to end, after which its disk does not respond; chosen by hand
RESERVE_BYTES = 500_000_000  # of the disk, which stay free; chosen by hand
RESERVE_S = 5.0  # of writing at the present rate, which stay free besides; chosen by hand
LOOK_S = 0.5  # between looks at the disk; chosen by hand
DISK_HANGS = "the disk does not respond: the video is left unfinished"

# Films to look at: FFmpeg's encoder, pixels, options.  By hand, on rendered takes: no visible blocks around the figure, and
# encoding takes less time than drawing.
ENCODERS: Mapping[str, tuple[str, str, Mapping[str, str]]] = {
    "h264": ("libx264", "yuv420p", {"preset": "veryfast", "crf": "18"}),
    "vp9": (
        "libvpx-vp9", "yuv420p",
        {"deadline": "realtime", "cpu-used": "8", "row-mt": "1", "tile-columns": "1", "crf": "24", "b": "0"},
    ),
    "mpeg4": ("mpeg4", "yuv420p", {"qscale": "3", "flags": "+qscale"}),
    "webp": ("libwebp_anim", "yuva420p", {"quality": "80", "compression_level": "4"}),
}  # fmt: skip
MAX_WEBP_SIDE_PX = 16383  # of the format
