#!/usr/bin/env python3
"""OpenCV's corners of boards with markers beside this program's on the same rendered pictures: peers_coded.py FOLDER

`cargo bench --bench corners -- coded FIRST COUNT FOLDER` (or `-- tags ...`) writes the pictures (NAME.pgm) and their tables (NAME.csv: the board's name, then id, true
place, place found by this program, whether the margin round the markers is three blurs and two px). OpenCV's own constant offset is taken out first. Grids of tags are found by
OpenCV's marker detector and refined by cornerSubPix in a window of 11x11 px (Kalibr: 5x5, in which
fewer converge).
"""
import sys
from pathlib import Path

import cv2
import numpy as np


def tags_in(name, image):
    """Corners by their numbers: four to a tag, counter-clockwise from the lower left of a tag as its makers print it."""
    _, _, family, _, _ = name.split(":")
    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, "DICT_APRILTAG_" + family.removeprefix("tag")))
    settings = cv2.aruco.DetectorParameters()
    settings.markerBorderBits = 2
    places, ids, _ = cv2.aruco.ArucoDetector(known, settings).detectMarkers(image)
    found = {}
    for place, tag in zip(places, [] if ids is None else ids.ravel()):
        stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 30, 0.1)
        refined = cv2.cornerSubPix(image, place.reshape(-1, 1, 2).astype(np.float32), (5, 5), (-1, -1), stop).reshape(-1, 2)
        # OpenCV has the tags of this family upside down: its first corner is the lower right one, and it goes on clockwise.
        for corner, k in enumerate((1, 0, 3, 2)):
            found[4 * int(tag) + corner] = refined[k].astype(float)
    return found


def charuco_in(name, image):
    found, ids, _, _ = detector(name).detectBoard(image)
    return {} if ids is None else dict(zip((int(i) for i in ids.ravel()), found.reshape(-1, 2).astype(float)))


def detector(name):
    _, squares, square, marker, dictionary, layout = name.split(":")
    size = tuple(int(n) for n in squares.split("x"))
    names = {n.upper(): n for n in dir(cv2.aruco) if n.startswith("DICT_")}
    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, names[dictionary.upper()]))
    board = cv2.aruco.CharucoBoard(size, float(square), float(marker), known)
    board.setLegacyPattern(layout == "old")
    return cv2.aruco.CharucoDetector(board)


def main():
    folder = Path(sys.argv[1])
    print("OpenCV", cv2.__version__)
    off = {"ours": [], "opencv": []}
    both = {"ours": [], "opencv": []}
    wrong = seen = 0
    for table in sorted(folder.glob("*.csv")):
        name, *lines = table.read_text().splitlines()
        rows = [line.split(",") for line in lines]
        truth = {int(r[0]): np.array([float(r[1]), float(r[2])]) for r in rows}
        ours = {int(r[0]): np.array([float(r[3]), float(r[4])]) for r in rows if r[3]}
        margin = {int(r[0]) for r in rows if r[5] == "1"}
        image = cv2.imread(str(table.with_suffix(".pgm")), cv2.IMREAD_GRAYSCALE)
        theirs = (tags_in if name.startswith("apriltag") else charuco_in)(name, image)
        theirs = {i: place for i, place in theirs.items() if i in truth}
        seen += len(theirs)
        for i, place in theirs.items():
            neighbours = [truth[k] for k in truth if k != i]
            step = min(np.linalg.norm(truth[i] - n) for n in neighbours)
            if np.linalg.norm(place - truth[i]) > 0.4 * step:
                wrong += 1
            elif i in margin and i in ours:
                both["opencv"].append(place - truth[i])
                both["ours"].append(ours[i] - truth[i])
            off["opencv"].append(place - truth[i])
        off["ours"] += [place - truth[i] for i, place in ours.items()]
    print(f"corners: ours {len(off['ours'])}, OpenCV {seen} of which {wrong} are 0.4 squares off or more")
    offset = np.median(both["opencv"], axis=0)
    print(f"OpenCV's constant offset {offset[0]:.4f} {offset[1]:.4f} px is taken out")
    rms = {k: float(np.sqrt(np.mean(np.square(np.array(v) - (offset if k == "opencv" else 0))))) for k, v in both.items()}
    median = {k: float(np.median(np.linalg.norm(np.array(v) - (offset if k == "opencv" else 0), axis=1))) for k, v in both.items()}
    print(f"{len(both['ours'])} corners that both have, with a margin: median px ours {median['ours']:.4f}, OpenCV {median['opencv']:.4f}; rms px ours {rms['ours']:.4f}, OpenCV {rms['opencv']:.4f}, "
          f"ratio {rms['opencv'] / rms['ours']:.1f}")


if __name__ == "__main__":
    main()
