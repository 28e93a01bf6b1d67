#!/usr/bin/env python3
"""Where the cameras stand, beside OpenCV's hand-eye methods on the same poses.

    scripts/peers    # makes the environment, or: pip install "opencv-python-headless<5"
    target/peers/venv/bin/python scripts/hand_eye.py [ROBOTS]
    target/peers/venv/bin/python scripts/hand_eye.py --intervals [ROBOTS]

In: robots that the program simulates, with noise of 0.02 mm and 0.3 mrad on each reading. Out: the error of the target's point at poses that
took no part, in the camera's frame and against the truth: of `placement.json` with the identified robot, and of `calibrateHandEye` (all
methods) and `calibrateRobotWorldHandEye` with the nominal robot and with the identified one. Each group is a place of the cameras.
With `--intervals`: how many of the points at those poses lie within the error that `placement.json` states for 95 % of them, and their mean over
the mean that it states, for 60 and 30 poses with orientations and 60 points alone.
"""

import csv
import json
import subprocess
import sys
import tempfile
import tomllib
from math import radians
from pathlib import Path

import cv2
import numpy as np

PROGRAM = Path(__file__).resolve().parent.parent / "target/release/stereocal"
NOISE_MM, NOISE_RAD = 0.02, 3e-4
POINT, TURN = ("x_mm", "y_mm", "z_mm"), ("rx_rad", "ry_rad", "rz_rad")
HAND_EYE = {name: getattr(cv2, f"CALIB_HAND_EYE_{name}") for name in ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS")}
WORLD = {name: getattr(cv2, f"CALIB_ROBOT_WORLD_HAND_EYE_{name}") for name in ("SHAH", "LI")}


def rigid(rotation, shift):
    a = np.eye(4)
    a[:3, :3], a[:3, 3] = rotation, np.ravel(shift)
    return a


def turn(axis, angle):
    return rigid(cv2.Rodrigues(np.eye(3)[axis] * angle)[0], np.zeros(3))


def shift(x, z):
    return rigid(np.eye(3), [x, 0, z])


def flange(robot, row):
    a = np.eye(4)
    for i, joint in enumerate(robot["joint"]):
        q = joint.get("sign", 1) * float(row[f"j{i + 1}_deg"]) + joint["theta_deg"]
        a = a @ turn(0, radians(joint["alpha_deg"])) @ shift(joint["a_mm"], 0)
        a = a @ turn(1, radians(joint.get("beta_deg", 0))) @ turn(2, radians(q)) @ shift(0, joint["d_mm"])
    return a


def numbers(row, names):
    return np.array([float(row[name]) for name in names])


def reading(row):
    return rigid(cv2.Rodrigues(numbers(row, TURN))[0], numbers(row, POINT))


def parts(transforms):
    return [a[:3, :3] for a in transforms], [a[:3, 3] for a in transforms]


def peers(flanges, targets):
    """`base_from_camera` and `flange_from_target` of each method."""
    found = {}
    for name, method in HAND_EYE.items():
        base = rigid(*cv2.calibrateHandEye(*parts([np.linalg.inv(f) for f in flanges]), *parts(targets), method=method))
        on_flange = [np.linalg.inv(f) @ base @ t for f, t in zip(flanges, targets)]
        u, _, v = np.linalg.svd(sum(a[:3, :3] for a in on_flange))
        found[name] = (base, rigid(u @ v, np.mean([a[:3, 3] for a in on_flange], axis=0)))
    for name, method in WORLD.items():
        r, t, r_base, t_base = cv2.calibrateRobotWorldHandEye(*parts(flanges), *parts(targets), method=method)
        found[f"world {name}"] = (rigid(r_base, t_base), rigid(r, t))
    return found


def noisy(row, random):
    row = dict(row)
    row.update(zip(POINT, numbers(row, POINT) + random.normal(size=3) * NOISE_MM))
    turned = cv2.Rodrigues(random.normal(size=3) * NOISE_RAD)[0] @ cv2.Rodrigues(numbers(row, TURN))[0]
    row.update(zip(TURN, np.ravel(cv2.Rodrigues(turned)[0])))
    row.update({f"s{a}{b}_mm2": NOISE_MM**2 if a == b else 0 for a, b in ("xx", "xy", "xz", "yy", "yz", "zz")})
    return row


def identified(seed, folder, samples=60, oriented=True):
    """The true rows, those that were read, and what `identify` wrote of them into the folder."""

    def run(*words):
        subprocess.run([PROGRAM, *words], cwd=folder, check=True, capture_output=True)

    run("simulate", "--points-only", "--samples", str(samples), "--verify", "60", "--seed", str(seed), "--out", ".")
    with open(folder / "truth/measurements.csv") as file:
        truth = list(csv.DictReader(file))
    random = np.random.default_rng(seed)
    read = [noisy(row, random) for row in truth]
    if not oriented:
        read = [{name: value for name, value in row.items() if name not in TURN} for row in read]
    with open(folder / "read.csv", "w") as file:
        writer = csv.DictWriter(file, read[0].keys())
        writer.writeheader()
        writer.writerows(read)
    run("identify", "--measurements", "read.csv", "--method", "trust-region")
    return truth, read, json.loads((folder / "out/placement.json").read_text())


def record(r):
    return rigid(np.array(r["rotation"]) if "rotation" in r else np.eye(3), r["translation_mm"])


def predicted(robot, base, target, rows):
    """How far the target is from where it truly is, in the camera's frame."""
    points = [(np.linalg.inv(base) @ flange(robot, row) @ target)[:3, 3] for row in rows]
    return [np.linalg.norm(p - numbers(row, POINT)) for p, row in zip(points, rows)]


def robot_errors(seed, folder):
    truth, read, placement = identified(seed, folder)
    robots = {n: tomllib.loads((folder / f).read_text()) for n, f in (("nominal", "robot.toml"), ("identified", "out/identified.toml"))}
    squares = {}
    for group in placement["groups"]:
        fitted = [row for row in read if row["group"] == group["group"] and row["role"] != "verify"]
        fresh = [row for row in truth if row["group"] == group["group"] and row["role"] == "verify"]

        def add(name, robot, base, target):
            squares.setdefault(name, []).extend(np.square(predicted(robot, base, target, fresh)))

        add("placement.json", robots["identified"], record(group["base_from_rig"]), record(placement["flange_from_target"]))
        for name, robot in robots.items():
            for method, (base, target) in peers([flange(robot, r) for r in fitted], [reading(r) for r in fitted]).items():
                add(f"{name} {method}", robot, base, target)
    return {name: np.sqrt(np.mean(values)) for name, values in squares.items()}


def intervals(count):
    for what, kind in (("60 poses", {}), ("30 poses", {"samples": 30}), ("60 points alone", {"oriented": False})):
        within, over = [], []
        for seed in range(1, count + 1):
            with tempfile.TemporaryDirectory() as folder:
                folder = Path(folder)
                truth, _, placement = identified(seed, folder, **kind)
                robot = tomllib.loads((folder / "out/identified.toml").read_text())
            for group in placement["groups"]:
                fresh = [row for row in truth if row["group"] == group["group"] and row["role"] == "verify"]
                off = predicted(robot, record(group["base_from_rig"]), record(placement["flange_from_target"]), fresh)
                within += [o < group["error_mm"]["p95_mm"] for o in off]
                over += [o / group["error_mm"]["mean_mm"] for o in off]
        print(f"{what:16} {count} robots, {len(within)} points: {100 * np.mean(within):.1f} % within, mean over stated {np.mean(over):.2f}")


def main():
    count = int(next((word for word in sys.argv[1:] if word.isdigit()), 10))
    if "--intervals" in sys.argv:
        return intervals(count)
    found = []
    for seed in range(1, count + 1):
        with tempfile.TemporaryDirectory() as folder:
            found.append(robot_errors(seed, Path(folder)))
    print(f"{count} robots, rms error of the target at fresh poses, mm")
    for name in found[0]:
        values = [errors[name] for errors in found]
        print(f"{name:24} {np.sqrt(np.mean(np.square(values))):9.4f}   median {np.median(values):9.4f}   worst {np.max(values):9.4f}")
    for robot in ("nominal", "identified"):
        ratios = [min(v for n, v in e.items() if n.startswith(robot)) / e["placement.json"] for e in found]
        print(f"best method with the {robot} robot over placement.json: least {min(ratios):.2f}, median {np.median(ratios):.2f}")


main()
