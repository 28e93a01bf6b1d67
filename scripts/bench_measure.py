#!/usr/bin/env python3
"""What a plain OpenCV script costs for the pictures of `cargo bench --bench measure -- speed`.

    python3 -m venv target/peers/venv && target/peers/venv/bin/pip install opencv-python-headless   # or scripts/peers
    target/peers/venv/bin/python scripts/bench_measure.py POSES CALIBRATION [sb|classic] [pairs]

Reads every pair, finds the target's 6x5 inner corners, undistorts, triangulates. Prints seconds a pair.
"""
import json
import sys
import time
from pathlib import Path

import cv2
import numpy as np

poses, calibration = Path(sys.argv[1]), json.load(open(sys.argv[2]))
way = sys.argv[3] if len(sys.argv) > 3 else "sb"
names = sorted(p.name for p in (poses / "left").iterdir())[: int(sys.argv[4]) if len(sys.argv) > 4 else None]
size = (6, 5)


def corners(picture):
    if way == "sb":
        return cv2.findChessboardCornersSB(picture, size)
    found, at = cv2.findChessboardCorners(picture, size)
    if found:
        stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 30, 1e-3)
        at = cv2.cornerSubPix(picture, at, (11, 11), (-1, -1), stop)
    return found, at


def camera(c):
    return np.array([[c["fx"], 0, c["cx"]], [0, c["fy"], c["cy"]], [0, 0, 1]]), np.array(c["distortion"])


k1, d1 = camera(calibration["left"])
k2, d2 = camera(calibration["right"])
rig = calibration["right_from_left"]
p1 = np.eye(3, 4)
p2 = np.hstack([np.array(rig["rotation"]), np.array(rig["translation_mm"])[:, None]])
start, measured = time.time(), 0
for name in names:
    pair = [cv2.imread(str(poses / side / name), cv2.IMREAD_GRAYSCALE) for side in ("left", "right")]
    (a, left), (b, right) = corners(pair[0]), corners(pair[1])
    if a and b:
        left, right = cv2.undistortPoints(left, k1, d1), cv2.undistortPoints(right, k2, d2)
        cv2.triangulatePoints(p1, p2, left.reshape(-1, 2).T, right.reshape(-1, 2).T)
        measured += 1
seconds = time.time() - start
print(f"{way}: {measured} of {len(names)} pairs, {seconds / len(names):.3f} s a pair")
