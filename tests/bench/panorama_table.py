#!/usr/bin/env python3
"""How exact panoramas are, and OpenCV's Stitcher and Hugin beside them.

  tests/bench/panorama_table.py build/release/bin/stx SHARED/data/panorama [--peers] [--left-out] [--only NAME] [--keep FOLDER]

Series that are cut out of known spheres (panorama_series.py) tell the error of rotations (the largest, after
all were turned as one), focal length, and what comes back of the original (PSNR, after a gain). Real series
tell residuals and, where EXIF has it, how far the focal length is from it. --left-out: each picture drawn again
out of the others. Seconds are the processor's, of all its cores together. With --peers, OpenCV's
Stitcher and Hugin's command line (pto_gen, cpfind, cpclean, autooptimiser, nona, enblend) run on the same. The table
gives what they left out, and their rotations where they are known: a peer fails where it leaves out a picture or
a rotation is off by more than a degree.
Needs python3-opencv; the peers need hugin-tools and enblend. Exit code 1 when a figure misses what is promised.
"""
import argparse
import glob
import json
import math
import os
import re
import resource
import subprocess
import sys
import tempfile

import cv2
import numpy as np

from panorama_series import matrix_of as camera_matrix
from panorama_series import painted_sphere, seen_in, write_series

MOST_TURN, MOST_FOCAL, LEAST_PSNR, MOST_RMS, MOST_GAP = 0.02, 0.1, 35.0, 0.6, 0.1
MOST_PEER_TURN = 1.0

# The second half tells what the first does not: which pictures it used, and how they look. They are the steps
# and settings of cv::Stitcher's estimateTransform() (4.6).
CHILD_OPENCV = """
import cv2, json, math, resource, sys
import numpy as np
pictures = [cv2.imread(f) for f in sys.argv[2:]]
status, picture = cv2.Stitcher_create().stitch(pictures)
if status == 0: cv2.imwrite(sys.argv[1], picture)
used = resource.getrusage(resource.RUSAGE_SELF)
found = {"status": status, "seconds": used.ru_utime + used.ru_stime, "cameras": {}}
if status != 0:
    print(json.dumps(found))
    sys.exit(0)
try:
    scale = min(1.0, math.sqrt(0.6e6 / (pictures[0].shape[0] * pictures[0].shape[1])))
    small = [cv2.resize(p, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR_EXACT) for p in pictures]
    features = [cv2.detail.computeImageFeatures2(cv2.ORB_create(), p) for p in small]
    matches = cv2.detail_BestOf2NearestMatcher(False).apply2(features)
    kept = [int(k) for k in np.ravel(cv2.detail.leaveBiggestComponent(features, matches, 1.0))]
    features = [features[k] for k in kept]
    matches = cv2.detail_BestOf2NearestMatcher(False).apply2(features)
    good, cameras = cv2.detail_HomographyBasedEstimator().apply(features, matches, None)
    for camera in cameras: camera.R = camera.R.astype(np.float32)
    adjuster = cv2.detail_BundleAdjusterRay()
    adjuster.setConfThresh(1.0)
    good, cameras = adjuster.apply(features, matches, cameras)
    flip = np.diag([1.0, -1, -1])
    for k, camera in zip(kept, cameras):
        found["cameras"][k] = {"rotation": (flip @ camera.R.astype(float) @ flip).tolist(), "focal": camera.focal / scale}
except Exception as error:
    found["why"] = str(error)
print(json.dumps(found))
"""


def timed(words, folder, seconds=600):
    """Exit code, output and the processor's seconds of a command; code 124 when it takes more than so many."""
    limit = lambda: resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=6 * seconds, check=False,
                              preexec_fn=limit)
        code, out = done.returncode, done.stdout + done.stderr
        code = 124 if code in (-24, -9) else code
    except subprocess.TimeoutExpired:
        code, out = 124, ""
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return code, out, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def matrix_of(q):
    w, x, y, z = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def turn_between(truth, found):
    """The rotation from the found world into the true one, and the largest error of a picture, degrees."""
    total = sum(t @ f.T for t, f in zip(truth, found))
    u, _, v = np.linalg.svd(total)
    turn = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
    worst = max(np.linalg.norm(t - turn @ f) / math.sqrt(2) for t, f in zip(truth, found))
    return turn, math.degrees(2 * math.asin(min(1, worst / 2)))


def psnr_back(sphere, panorama, turn):
    """PSNR of the original against the panorama, turned onto it, where it is covered; after a gain."""
    if panorama.shape[1] >= 2 * sphere.shape[1]:  # all that the original has is between its pixels
        back = seen_in(panorama, np.stack(np.broadcast_arrays(*sphere_rays(sphere.shape[1])), -1) @ turn).astype(np.float64)
        truth = sphere.astype(np.float64)
    else:
        width = panorama.shape[1] // 4 * 2
        back = seen_in(panorama, np.stack(np.broadcast_arrays(*sphere_rays(2 * width)), -1) @ turn)
        back = cv2.resize(back, (width, width // 2), interpolation=cv2.INTER_AREA).astype(np.float64)
        truth = cv2.resize(sphere, (width, width // 2), interpolation=cv2.INTER_AREA).astype(np.float64)
    covered = back[..., 3] >= 254.5
    a, b = (back[covered][:, :3] / 255) ** 2.2, (truth[covered] / 255) ** 2.2
    gain = (a * b).sum(0) / (a * a).sum(0)
    off = (np.clip(a * gain, 0, 1) ** (1 / 2.2) - (truth[covered] / 255)) * 255
    return 10 * math.log10(255 ** 2 / np.mean(off ** 2))


def sphere_rays(width):
    longitude = ((np.arange(width) + 0.5) / width * 2 - 1) * np.pi
    latitude = (0.5 - (np.arange(width // 2) + 0.5) / (width // 2)) * np.pi
    return (np.cos(latitude)[:, None] * np.sin(longitude)[None], np.sin(latitude)[:, None],
            -np.cos(latitude)[:, None] * np.cos(longitude)[None])


def series(shared, folder, only):
    """Name, pictures, sphere (or nothing), focal length in pixels (0: not known)."""
    painted = []  # made when it is asked for
    even = lambda n, span=360.0, pitch=0.0, roll=0.0: [(span * k / n, pitch, roll) for k in range(n)]
    made = {
        "turn of 18 portraits": (painted, (384, 512), 480, -0.05, even(18), True),
        "turn of 12, steep": (painted, (640, 480), 500, -0.1, even(12, pitch=25.0), False),
        "part of a turn": (painted, (640, 480), 600, 0.06,
                           [(18 * k, (k % 3 - 1) * 5.0, (k % 2) * 4.0) for k in range(7)], True),
        "three rows": (painted, (400, 300), 300, -0.04,
                       [(30 * k, p, 0) for p in (-45.0, 0.0, 45.0) for k in range(12)], False),
        "rolled by 90": (painted, (512, 384), 480, 0.0, even(14, roll=90.0), False),
        "two pictures": (painted, (640, 480), 560, 0.0, [(0, 0, 0), (25, 4.0, 2.0)], False),
    }
    for name in ("half_dome_01", "half_dome_02", "glowsticks"):
        sphere = cv2.imread(os.path.join(shared, f"boofcv-equirectangular/equirectangular_{name}.jpg"))
        made[name] = (sphere, (384, 512), 416, -0.03, even(14, pitch=-5.0), False)
    for name, (sphere, size, focal, k1, turns, gains) in made.items():
        if only and only not in name:
            continue
        if sphere is painted:
            sphere = painted_sphere(4096 if focal > 320 else 2048)  # not much finer than the pictures
        out = os.path.join(folder, name.replace(" ", "_").replace(",", ""))
        light = [1 - 0.4 * (k * 5 % 7) / 7 for k in range(len(turns))] if gains else None
        write_series(out, sphere, size, focal, k1, turns, light, shuffle=True)
        yield name, sorted(glob.glob(os.path.join(out, "*.jpg"))), sphere, focal
    real = [("kayak", "boofcv-stitch/kayak_*", 0), ("mountain", "boofcv-stitch/mountain_rotate_*", 28),
            ("trees", "boofcv-stitch/trees_rotate_*", 28), ("grass", "boofcv-stitch/grass_rotate_*", 28),
            ("apartment", "boofcv-stitch/apartment_building_*", 0), ("cave", "boofcv-stitch/cave_*", 0),
            ("JDW_03", "skimage-pano/JDW_03*", 27), ("JDW_95", "skimage-pano/JDW_95*", 60),
            ("river", "vlfeat/river*", 0)]
    for name, pattern, focal35 in real:
        files = sorted(glob.glob(os.path.join(shared, pattern)))
        height, width = cv2.imread(files[0]).shape[:2]
        yield name, files, None, focal35 / 21.633 * math.hypot(width, height) / 2


def measure_stx(stx, files, sphere, focal, folder, keep, left_out):
    """A row's cells, and what misses the promises."""
    out, report = os.path.join(folder, "stx.png"), os.path.join(folder, "stx.json")
    code, said, seconds = timed([stx, "panorama", *files, "-o", out, "--report", report], folder)
    if code != 0:
        return ["failed"] + ["-"] * 6 + [f"{seconds:.1f}"], [f"exit code {code}: {said.strip()[-200:]}"]
    with open(report, encoding="utf-8") as file:
        found = json.load(file)
    missed = []
    if found["used"] != len(files):
        missed.append(f"{found['used']} of {len(files)} pictures")
    worst = max(p["rmsPixels"] for p in found["pairs"])
    if worst > MOST_RMS:
        missed.append(f"residuals of {worst:.2f} pixels")
    focal_found = next(p["focalPixels"] for p in found["pictures"] if p["used"])
    focal_off = 100 * abs(focal_found / focal - 1) if focal else None
    gap = found.get("gapDegrees")
    if gap is not None and gap > MOST_GAP:
        missed.append(f"a gap of {gap:.2f} degrees")
    turn_off = back = None
    if sphere is not None:
        with open(os.path.join(os.path.dirname(files[0]), "truth.json"), encoding="utf-8") as file:
            truth = json.load(file)["pictures"]
        both = [(matrix_of(t["rotation"]), matrix_of(f["rotation"])) for t, f in zip(truth, found["pictures"]) if f["used"]]
        turn, turn_off = turn_between([t for t, _ in both], [f for _, f in both])
        back = psnr_back(sphere, cv2.imread(out, cv2.IMREAD_UNCHANGED), turn)
        for value, most, what in ((turn_off, MOST_TURN, "degrees of rotation"), (focal_off, MOST_FOCAL, "% of focal length"),
                                  (-back, -LEAST_PSNR, "dB back")):
            if value > most:
                missed.append(f"{abs(value):.3f} {what}")
    if keep:
        os.replace(out, os.path.join(keep, os.path.basename(os.path.dirname(files[0])) + "_" +
                                     os.path.splitext(os.path.basename(files[0]))[0] + ".png"))
    left = None
    if left_out and len(files) <= 20:
        _, said, _ = timed([stx, "panorama", *files, "-o", out, "--size", "1024x512", "--leave-one-out"], folder)
        left = re.search(r"left out ([0-9.]+) dB", said)
    show = lambda value, text: "-" if value is None else format(value, text)
    return [f"{found['used']}/{len(files)}", f"{worst:.2f}", show(turn_off, ".4f"), show(focal_off, ".3f"), show(gap, ".3f"),
            show(back, ".1f"), left.group(1) if left else "-", f"{seconds:.1f}"], missed


def judged(found, files):
    """A peer's cells from {index: (rotation, focal length)}: what failed or "ok", and the largest error of a rotation."""
    if len(found) < len(files):
        return f"failed: {len(found)} of {len(files)}", "-"
    known = os.path.join(os.path.dirname(files[0]), "truth.json")
    if not os.path.exists(known):
        return "ok", "-"
    with open(known, encoding="utf-8") as file:
        truth = [matrix_of(p["rotation"]) for p in json.load(file)["pictures"]]
    _, off = turn_between(truth, [found[k][0] for k in range(len(files))])
    return "ok" if off <= MOST_PEER_TURN else "failed: turned", f"{off:.2f}"


def measure_opencv(files, focal, folder):
    code, said, seconds = timed([sys.executable, "-c", CHILD_OPENCV, os.path.join(folder, "cv.png"), *files], folder)
    if code != 0:
        return [f"failed ({code})", "-", "-", f"{seconds:.1f}"]
    found = json.loads(said.strip().splitlines()[-1])
    if found["status"] != 0:
        return [f"failed: status {found['status']}", "-", "-", f"{found['seconds']:.1f}"]
    cameras = {int(k): (np.array(c["rotation"]), c["focal"]) for k, c in found["cameras"].items()}
    verdict, turn = judged(cameras, files)
    off = "-"
    if focal and cameras:
        off = f"{100 * abs(np.median([c[1] for c in cameras.values()]) / focal - 1):.2f}"
    return [verdict, turn, off, f"{found['seconds']:.1f}"]


def hugin_cameras(pto):
    """Rotations and focal lengths (pixels) in a project of Hugin's; its longitudes grow to the right."""
    with open(pto, encoding="utf-8") as file:
        lines = [line for line in file if line.startswith("i ")]
    value = lambda line, key: float(re.search(rf" {key}=?(-?[0-9.e+-]+)", line).group(1))
    width, view = value(lines[0], "w"), value(lines[0], "v")
    focal = width / 2 / math.tan(math.radians(view / 2))
    found = {}
    for k, line in enumerate(lines):
        yaw, pitch, roll = (math.radians(value(line, key)) for key in ("y", "p", "r"))
        found[k] = (camera_matrix(-yaw, pitch, -roll), focal)
    return found


def measure_hugin(files, focal, folder):
    """Verdict, error of rotation, of the focal length, seconds."""
    pto = os.path.join(folder, "h.pto")
    total = 0.0
    for words in (["pto_gen", "-o", pto, *files], ["cpfind", "--multirow", "-o", pto, pto], ["cpclean", "-o", pto, pto],
                  ["autooptimiser", "-a", "-m", "-l", "-s", "-o", pto, pto], ["checkpto", pto],
                  ["pano_modify", "--canvas=AUTO", "--crop=AUTO", "-o", pto, pto], ["nona", "-m", "TIFF_m", "-o", "h_", pto],
                  ["enblend", "-o", "h.tif"]):
        if words[0] == "enblend":
            words += sorted(glob.glob(os.path.join(folder, "h_*.tif")))
        code, said, seconds = timed(words, folder)
        total += seconds
        if words[0] == "checkpto" and "unconnected" in said.lower():
            return ["failed: in parts", "-", "-", f"{total:.1f}"]
        if code != 0 and words[0] != "checkpto":
            return [f"failed: {words[0]} ({code})", "-", "-", f"{total:.1f}"]
    found = hugin_cameras(pto)
    verdict, turn = judged(found, files)
    if not focal:
        return [verdict, turn, "-", f"{total:.1f}"]
    return [verdict, turn, f"{100 * abs(found[0][1] / focal - 1):.2f}", f"{total:.1f}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stx")
    parser.add_argument("shared")
    parser.add_argument("--peers", action="store_true")
    parser.add_argument("--left-out", action="store_true", help="takes as long as all the rest")
    parser.add_argument("--only", help="series whose name has this in it")
    parser.add_argument("--keep", help="folder that keeps the panoramas")
    o = parser.parse_args()
    o.stx = os.path.abspath(o.stx)
    head = ["series", "used", "rms, px", "turn, °", "focal, %", "gap, °", "back, dB", "left out, dB", "s"]
    if o.peers:
        head += ["OpenCV", "turn, °", "focal, %", "s", "Hugin", "turn, °", "focal, %", "s"]
    print("| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    failed = 0
    with tempfile.TemporaryDirectory(prefix="stx-panorama-") as folder:
        for name, files, sphere, focal in series(os.path.abspath(o.shared), folder, o.only):
            if o.only and o.only not in name:
                continue
            with tempfile.TemporaryDirectory(dir=folder) as work:
                cells, missed = measure_stx(o.stx, files, sphere, focal, work, o.keep, o.left_out)
                if o.peers:
                    cells += measure_opencv(files, focal, work) + measure_hugin(files, focal, work)
            print("| " + " | ".join([name] + cells) + " |", flush=True)
            for text in missed:
                failed += 1
                print(f"{name}: {text}", file=sys.stderr, flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
