#!/usr/bin/env python3
"""Your own pairs of a checkerboard, calibrated by stereocal and by OpenCV: which of the two measures better what it was not calibrated on?

    scripts/held_out.py PROGRAM PICTURES SQUARES SQUARE_MM      PICTURES holds left/ and right/ with equal names

Every other pair calibrates and the others are measured, then the other way round. Each program finds its own corners. OpenCV is used as its
samples do: findChessboardCorners, cornerSubPix, calibrateCamera for each camera, stereoCalibrate, five terms of distortion. Printed are the RMS of
the distance of corresponding corners from their epipolar lines (px), the RMS error of all lengths along the board's rows and
columns (mm), and their ratios. Pairs that only one of the programs can read are left out of both.
"""

import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 50, 1e-4)


class Rig:
    """Cameras, distortions, and the right camera from the left."""

    def __init__(self, left, right, turn, shift):
        self.cameras, self.turn, self.shift = (left, right), turn, shift.reshape(3)

    def normalised(self, corners):
        """Undistorted directions of a pair's corners, left and right; corners that were not found stay NaN."""
        shape = corners[0].shape
        return [
            cv2.undistortPoints(seen.reshape(-1, 1, 2).astype(np.float64), k, d).reshape(shape)
            for seen, (k, d) in zip(corners, self.cameras)
        ]

    def epipolar_px(self, corners):
        left, right = (np.dstack([n, np.ones(n.shape[:2])]).reshape(-1, 3) for n in self.normalised(corners))
        x, y, z = self.shift
        essential = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ self.turn
        in_right, in_left = left @ essential.T, right @ essential
        steepness = np.hypot(np.linalg.norm(in_right[:, :2], axis=1), np.linalg.norm(in_left[:, :2], axis=1))
        focal = np.mean([k[0, 0] for k, _ in self.cameras])
        return focal * np.sum(right * in_right, axis=1) / steepness

    def length_errors_mm(self, corners, square_mm):
        left, right = self.normalised(corners)
        rows, columns = left.shape[:2]
        view = np.hstack([self.turn, self.shift.reshape(3, 1)])
        homogeneous = cv2.triangulatePoints(np.eye(3, 4), view, left.reshape(-1, 2).T.copy(), right.reshape(-1, 2).T.copy())
        points = (homogeneous[:3] / homogeneous[3]).T.reshape(rows, columns, 3)
        errors = []
        for steps in range(1, max(rows, columns)):
            for one, other in ((points[steps:], points[:-steps]), (points[:, steps:], points[:, :-steps])):
                if one.size:
                    errors.append(np.linalg.norm(one - other, axis=-1).ravel() - steps * square_mm)
        return np.concatenate(errors)


def opencv_corners(path, columns, rows):
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    found, corners = cv2.findChessboardCorners(picture, (columns, rows))
    if not found:
        return None, picture.shape[::-1]
    grid = corners.reshape(rows, columns, 2)
    steps = [np.linalg.norm(np.diff(grid, axis=axis), axis=-1).min() for axis in (0, 1)]
    half = int(np.clip(0.4 * min(steps), 2, 11))
    return cv2.cornerSubPix(picture, corners, (half, half), (-1, -1), STOP).reshape(rows, columns, 2), picture.shape[::-1]


def alike(left, right):
    """The right picture's corners in the left one's order: a board may be read from either end, a square one from four."""
    turns = [0, 2] if left.shape[0] != left.shape[1] else [0, 1, 2, 3]
    axes = lambda grid: [grid[:, -1].mean(0) - grid[:, 0].mean(0), grid[-1].mean(0) - grid[0].mean(0)]
    same = lambda grid: sum(a @ b / np.linalg.norm(a) / np.linalg.norm(b) for a, b in zip(axes(left), axes(grid)))
    return max((np.rot90(right, quarter) for quarter in turns), key=same)


def by_opencv(folder, names, columns, rows):
    pairs, size = {}, {}
    for name, (left, right) in names.items():
        (one, size["left"]), (other, size["right"]) = opencv_corners(left, columns, rows), opencv_corners(right, columns, rows)
        if one is not None and other is not None:
            pairs[name] = one, alike(one, other)
    return pairs, size


def opencv_rig(pairs, size, square_mm):
    rows, columns = next(iter(pairs.values()))[0].shape[:2]
    board = np.zeros((rows * columns, 3), np.float32)
    board[:, :2] = np.mgrid[0:columns, 0:rows].T.reshape(-1, 2) * square_mm
    seen = [[np.ascontiguousarray(pair[side], np.float32).reshape(-1, 1, 2) for pair in pairs.values()] for side in (0, 1)]
    boards = [board] * len(pairs)
    single = [cv2.calibrateCamera(boards, seen[i], size[side], None, None)[1:3] for i, side in enumerate(("left", "right"))]
    joint = cv2.stereoCalibrate(boards, *seen, *single[0], *single[1], size["left"], flags=cv2.CALIB_USE_INTRINSIC_GUESS)
    return Rig(joint[1:3], joint[3:5], joint[5], joint[6])


def stereocal(program, pictures, board, out):
    command = [program, "camera-check", str(pictures), *board, "--out", str(out), "--quiet"]
    subprocess.run(command, capture_output=True, check=False)


def stereocal_corners(path):
    grids = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            if row["sxx_px2"]:
                at = int(row["row"]), int(row["col"])
                grids.setdefault(row["pair"], {}).setdefault(row["side"], {})[at] = float(row["x_px"]), float(row["y_px"])
    pairs = {}
    for name, sides in grids.items():
        if len(sides) == 2:
            shape = [1 + max(at[k] for grid in sides.values() for at in grid) for k in (0, 1)]
            both = [np.full((*shape, 2), np.nan) for _ in sides]
            for filled, side in zip(both, ("left", "right")):
                for at, place in sides[side].items():
                    filled[at] = place
            pairs[name] = tuple(both)
    return pairs


def stereocal_rig(path):
    file = json.loads(path.read_text())
    camera = lambda c: (np.array([[c["fx"], 0, c["cx"]], [0, c["fy"], c["cy"]], [0, 0, 1.0]]), np.array(c["distortion"], float))
    link = file["right_from_left"]
    return Rig(camera(file["left"]), camera(file["right"]), np.array(link["rotation"]), np.array(link["translation_mm"]))


def rms(parts):
    values = np.concatenate(parts)
    return float(np.sqrt(np.nanmean(values**2)))


def main():
    program, folder, squares, square_mm = Path(sys.argv[1]).resolve(), Path(sys.argv[2]), sys.argv[3], float(sys.argv[4])
    columns, rows = sorted((int(n) - 1 for n in squares.split("x")), reverse=True)
    board = ["--squares", squares, "--square-mm", str(square_mm)]
    right = {path.stem: path for path in (folder / "right").iterdir()}
    names = {path.stem: (path, right[path.stem]) for path in sorted((folder / "left").iterdir()) if path.stem in right}
    results = {"stereocal": [], "OpenCV": []}
    theirs, size = by_opencv(folder, names, columns, rows)
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        stereocal(program, folder.resolve(), board, scratch / "all")
        ours = stereocal_corners(scratch / "all/corners.csv")
        both = [name for name in names if name in theirs and name in ours]
        for half in (0, 1):
            calibrate, measure = both[half::2], both[1 - half :: 2]
            for name in calibrate:
                for side, path in zip(("left", "right"), names[name]):
                    link = scratch / f"half{half}" / side / path.name
                    link.parent.mkdir(parents=True, exist_ok=True)
                    link.symlink_to(path.resolve())
            stereocal(program, scratch / f"half{half}", board, scratch / f"out{half}")
            rigs = {
                "stereocal": (stereocal_rig(scratch / f"out{half}/calibration.json"), ours),
                "OpenCV": (opencv_rig({name: theirs[name] for name in calibrate}, size, square_mm), theirs),
            }
            for program_name, (rig, corners) in rigs.items():
                epipolar = rms([rig.epipolar_px(corners[name]) for name in measure])
                lengths = rms([rig.length_errors_mm(corners[name], square_mm) for name in measure])
                results[program_name].append((epipolar, lengths))
    means = {name: np.mean(halves, axis=0) for name, halves in results.items()}
    ratios = np.mean(np.array(results["stereocal"]) / np.array(results["OpenCV"]), axis=0)
    print(f"{len(both)} of {len(names)} pairs read by both; the mean of both halves, each measured by what the other calibrated")
    print(f"{'':12} {'epipolar RMS px':>16} {'length RMS mm':>14}")
    for name, (epipolar, lengths) in means.items():
        print(f"{name:12} {epipolar:16.3f} {lengths:14.3f}")
    print(f"{'ratio':12} {ratios[0]:16.2f} {ratios[1]:14.2f}")


if __name__ == "__main__":
    main()
