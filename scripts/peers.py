#!/usr/bin/env python3
"""Corners, time, memory and lengths of other programs beside this one's, on the same rendered pictures whose truth is known.

    scripts/peers.py PROGRAM WORLD       the table; WORLD is what `stereocal simulate` wrote
    scripts/peers.py --worker WAY WORLD  one program's corners as JSON, in a process of its own so that its memory is its own

Each corner found is given the number of the true corner nearest to it (none is nearer than half a square), so that only places
are compared. Lengths: the corners go through the same bundle, `stereocal camera-check --corners`, which says the largest error of held-out lengths.
"""

import csv
import json
import resource
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np

# Inner corners of the preset's check board along x and y, and its squares.
SIZE, SQUARES, SQUARE_MM = (19, 19), "20x20", "10"
# A corner farther from every true one is none of the board's, px.
FAR_PX = 2.0


def grey(path):
    import cv2

    return cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)


def opencv_classic():
    import cv2

    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 40, 1e-4)

    def find(picture):
        found, at = cv2.findChessboardCorners(picture, SIZE)
        return cv2.cornerSubPix(picture, at, (11, 11), (-1, -1), stop).reshape(-1, 2) if found else None

    return f"OpenCV {cv2.__version__}, findChessboardCorners + cornerSubPix", grey, find


def opencv_sb():
    import cv2

    flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY

    def find(picture):
        found, at = cv2.findChessboardCornersSB(picture, SIZE, flags)
        return at.reshape(-1, 2) if found else None

    return f"OpenCV {cv2.__version__}, findChessboardCornersSB", grey, find


def boofcv():
    import pyboof

    pyboof.init_pyboof()
    target = pyboof.ConfigGridDimen(SIZE[1] + 1, SIZE[0] + 1, float(SQUARE_MM))
    detector = pyboof.FactoryFiducialCalibration.chessboardX(target)

    def find(picture):
        detector.detect(picture)
        # BoofCV's pixel (0, 0) is its upper left corner; ours is its middle.
        return np.array([(x - 0.5, y - 0.5) for _, x, y in detector.detected_points]) if detector.detected_points else None

    return f"BoofCV (PyBoof {version('PyBoof')}), chessboardX", lambda path: pyboof.load_single_band(str(path), np.float32), find


def libcbdetect():
    from PyCBD.pipelines import CBDPipeline

    pipeline = CBDPipeline()

    def find(picture):
        result, at, _ = pipeline.detect_checkerboard(picture, (SIZE[1], SIZE[0]))
        return np.asarray(at) if result else None

    return f"libcbdetect (PyCBD {version('PyCBD')})", grey, find


WAYS = {"classic": opencv_classic, "sb": opencv_sb, "boofcv": boofcv, "libcbdetect": libcbdetect}


def pictures(world):
    for side in ("left", "right"):
        for path in sorted((world / "check" / side).iterdir()):
            yield side, path


def worker(way, world):
    """Corners of every picture, seconds a picture without reading it, and the largest memory in MB."""
    name, load, find = WAYS[way]()
    found, seconds = [], 0.0
    for side, path in pictures(world):
        picture = load(path)
        start = time.perf_counter()
        corners = find(picture)
        seconds += time.perf_counter() - start
        found.append({"side": side, "pair": path.stem, "corners": [] if corners is None else corners.tolist()})
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 + java_mb()
    print(json.dumps({"name": name, "seconds": seconds / len(found), "mb": memory, "found": found}))


def java_mb():
    """Memory of what this process has started (BoofCV's Java), MB."""
    total = 0.0
    for children in Path("/proc/self/task").glob("*/children"):
        for child in children.read_text().split():
            try:
                lines = Path(f"/proc/{child}/status").read_text().splitlines()
            except OSError:
                continue
            total += sum(float(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024
    return total


def true_corners(world):
    true = {}
    with open(world / "truth" / "corners.csv", newline="") as file:
        for row in csv.DictReader(file):
            at = (int(row["col"]), int(row["row"]), float(row["x_px"]), float(row["y_px"]))
            true.setdefault((row["side"], row["pair"]), []).append(at)
    return true


def numbered(true, found):
    """Corners with the numbers of the true ones that they are next to, and how far they are off, px."""
    rows, off = [], []
    for picture in found:
        places = np.array([(x, y) for _, _, x, y in true[(picture["side"], picture["pair"])]])
        taken = set()
        for x, y in picture["corners"]:
            distances = np.hypot(places[:, 0] - x, places[:, 1] - y)
            k = int(distances.argmin())
            if distances[k] > FAR_PX or k in taken:
                continue
            taken.add(k)
            col, row, tx, ty = true[(picture["side"], picture["pair"])][k]
            rows.append((picture["pair"], picture["side"], col, row, x, y))
            off.append((x - tx, y - ty))
    return rows, np.array(off).reshape(-1, 2)


def held_out_mm(program, world, rows):
    """Largest error of held-out lengths with these corners, mm; none where they give no rig."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "corners.csv"
        with open(file, "w", newline="") as out:
            writer = csv.writer(out)
            writer.writerow(["pair", "side", "col", "row", "x_px", "y_px"])
            writer.writerows(rows)
        size = picture_size(world)
        command = [program, "camera-check", "--corners", str(file), "--squares", SQUARES, "--square-mm", SQUARE_MM]
        done = subprocess.run([*command, "--picture-size", size, "--out", folder, "--json"], capture_output=True, text=True, check=False)
        return json.loads(done.stdout)["max_abs_error_mm"] if done.returncode in (0, 1) and done.stdout else None


def picture_size(world):
    height, width = grey(next(pictures(world))[1]).shape
    return f"{width}x{height}"


def ours(program, world):
    """This program's corners. Its time is what the command takes longer than again with the corners kept: reading, detecting, refining."""
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "camera-check", str(world / "check"), "--out", folder, "--quiet", "--threads", "1"]
        times = []
        for _ in range(2):
            start = time.perf_counter()
            subprocess.run(command, capture_output=True, check=False)
            times.append(time.perf_counter() - start)
        seconds = times[0] - times[1]
        memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
        by_picture = {}
        with open(Path(folder) / "corners.csv", newline="") as file:
            for row in csv.DictReader(file):
                if row["used"] == "1":
                    by_picture.setdefault((row["side"], row["pair"]), []).append((float(row["x_px"]), float(row["y_px"])))
    found = [{"side": s, "pair": p, "corners": c} for (s, p), c in by_picture.items()]
    name = subprocess.run([program, "-V"], capture_output=True, text=True, check=True).stdout.strip()
    return {"name": name, "seconds": seconds / len(list(pictures(world))), "mb": memory, "found": found}


def main():
    program, world = sys.argv[1], Path(sys.argv[2])
    # First of all children, so that the largest memory of a child is the program's.
    results = [ours(program, world)]
    for way in WAYS:
        done = subprocess.run([sys.executable, __file__, "--worker", way, str(world)], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            print(f"left out: {way} ({(done.stderr.strip().splitlines() or ['no message'])[-1]})")
            continue
        results.append(json.loads(done.stdout.strip().splitlines()[-1]))
    true = true_corners(world)
    count = len(list(pictures(world)))
    print(f"Corners: {count} rendered pictures of {picture_size(world)} px, {SIZE[0]}x{SIZE[1]} corners each, one thread; the time of stereocal holds reading the files, the others' does not")
    print(f"{'':60} {'boards':>7} {'corners':>8} {'RMS px':>8} {'max px':>8} {'ms':>7} {'MB':>6} {'held-out mm':>12}")
    for result in results:
        rows, off = numbered(true, result["found"])
        boards = sum(1 for picture in result["found"] if picture["corners"])
        rms = np.sqrt((off**2).mean()) if len(off) else float("nan")
        largest = np.hypot(off[:, 0], off[:, 1]).max() if len(off) else float("nan")
        length = held_out_mm(program, world, rows)
        shown = "-" if length is None else f"{length:.4f}"
        print(
            f"{result['name']:60} {boards:4}/{count:<2} {len(rows):8} {rms:8.4f} {largest:8.4f} "
            f"{1e3 * result['seconds']:7.0f} {result['mb']:6.0f} {shown:>12}"
        )


if __name__ == "__main__":
    if sys.argv[1] == "--worker":
        worker(sys.argv[2], Path(sys.argv[3]))
    else:
        main()
