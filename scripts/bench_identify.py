#!/usr/bin/env python3
"""The peers of `cargo bench --bench identify` on the same data: pyswarms with a vectorised numpy objective, scipy's least_squares.

    python3 -m venv target/peers/venv && target/peers/venv/bin/pip install numpy scipy pyswarms   # or scripts/peers
    stereocal simulate --points-only --preset paper --out paper
    cargo bench --bench identify -- paper/measurements.csv paper/robot.toml
    target/peers/venv/bin/python scripts/bench_identify.py paper/measurements.csv paper/robot.toml

All minimise eq. (12) over the distances to the groups' centres, in a box of 1 mm and 1 deg, all 27 parameters free but
those that no distance sees.
"""

import csv
import logging
import sys
import time
import tomllib

import numpy as np
from scipy.optimize import least_squares

PARTICLES, ITERATIONS = 100, 500
# The base parameters of varied orientation: what remains without alpha_0, a_0, theta_1, d_1, d_3, d_4, theta_6, v_z.
DROPPED = {0, 1, 2, 3, 11, 15, 22, 26}


def read(measurements, robot):
    with open(robot, "rb") as file:
        model = tomllib.load(file)
    nominal = np.array(
        [v for j in model["joint"] for v in (np.radians(j["alpha_deg"]), j["a_mm"], np.radians(j["theta_deg"]), j["d_mm"])]
        + [model["tool"][k] for k in ("x_mm", "y_mm", "z_mm")]
    )
    count = len(model["joint"])
    with open(measurements, newline="") as file:
        rows = [r for r in csv.DictReader(file) if r["role"] != "verify" and r["x_mm"]]
    joints = np.radians([[float(r[f"j{i + 1}_deg"]) for i in range(count)] for r in rows])
    points = np.array([[float(r[k]) for k in ("x_mm", "y_mm", "z_mm")] for r in rows])
    centers = {r["group"]: i for i, r in enumerate(rows) if r["role"] == "center"}
    sample = np.array([i for i, r in enumerate(rows) if r["role"] == "sample"])
    center = np.array([centers[rows[i]["group"]] for i in sample])
    return nominal, joints, points, sample, center


def targets(parameters, joints):
    """Target points, (particles, poses, 3), of parameters (particles, 4N + 3)."""
    count = joints.shape[1]
    x, y, z = (np.repeat(parameters[:, 4 * count + k, None], len(joints), axis=1) for k in range(3))
    for i in reversed(range(count)):
        alpha, a, theta, d = (parameters[:, 4 * i + k, None] for k in range(4))
        angle = joints[None, :, i] + theta
        s, c = np.sin(angle), np.cos(angle)
        x, y, z = c * x - s * y, s * x + c * y, z + d
        sa, ca = np.sin(alpha), np.cos(alpha)
        x, y, z = x + a, ca * y - sa * z, sa * y + ca * z
    return np.stack([x, y, z], axis=-1)


def main():
    nominal, joints, points, sample, center = read(*sys.argv[1:3])
    free = np.array([i for i in range(len(nominal)) if i not in DROPPED])
    bound = np.array([np.radians(1.0) if i % 4 in (0, 2) and i < len(nominal) - 3 else 1.0 for i in free])
    measured = np.linalg.norm(points[sample] - points[center], axis=1)
    evaluations = 0

    def residuals(scaled):
        nonlocal evaluations
        scaled = np.atleast_2d(scaled)
        evaluations += len(scaled)
        parameters = np.repeat(nominal[None], len(scaled), axis=0)
        parameters[:, free] += scaled * bound
        p = targets(parameters, joints)
        return np.linalg.norm(p[:, sample] - p[:, center], axis=2) - measured

    def cost(scaled):
        return 0.5 * (residuals(scaled) ** 2).sum(axis=1)

    import pyswarms

    logging.disable(logging.CRITICAL)
    box = (-np.ones(len(free)), np.ones(len(free)))
    options = {"c1": 2.0, "c2": 2.0, "w": 1.0}
    np.random.seed(1)
    swarm = pyswarms.single.GlobalBestPSO(
        n_particles=PARTICLES, dimensions=len(free), options=options, bounds=box, velocity_clamp=(-0.2, 0.2)
    )
    start = time.perf_counter()
    best, _ = swarm.optimize(cost, iters=ITERATIONS, verbose=False)
    print(f"pyswarms      {time.perf_counter() - start:.3f} s, cost {best:.6f} mm2, {evaluations} evaluations")
    evaluations = 0
    start = time.perf_counter()
    found = least_squares(lambda x: residuals(x)[0], np.zeros(len(free)), bounds=box, xtol=1e-12, ftol=1e-12)
    print(f"least_squares {time.perf_counter() - start:.3f} s, cost {found.cost:.6f} mm2, {evaluations} evaluations")


if __name__ == "__main__":
    main()
