"""Threads of OpenCV in the processes of a rig."""

import os

import cv2

VARIABLE = "OPENCV_FOR_THREADS_NUM"  # of OpenCV itself


def use_one_thread() -> None:
    """Let OpenCV work in the calling thread only, for the whole process; the environment variable overrides this.

    By default OpenCV shares each operation among all cores.  A service has one image at a time, of which an operation
    takes a fraction of a millisecond, and a machine runs several services: four viewers and the tracker at 640 x 480 and
    30/s used 10 % less processor time with one thread, with shorter latencies; two viewers at 1280 x 720 as much.
    """
    if not os.environ.get(VARIABLE):
        cv2.setNumThreads(1)
