"""Renders the gallery with Mitsuba 3 and writes NAME.txt: one line per pixel, row by row, with the mean of red, green and blue
over independent renders and the standard errors of these means. Usage: reference.py [NAME ...]; needs Mitsuba 3.9.1."""
import glob
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
RENDERS, SPP = 32, 8192
for path in [f"{n}.xml" for n in sys.argv[1:]] or sorted(glob.glob("*.xml")):
    scene = mi.load_file(path)
    renders = np.array([np.array(mi.render(scene, spp=SPP, seed=i))[..., :3] for i in range(RENDERS)], "f8")
    mean, error = renders.mean(0), renders.std(0, ddof=1) / RENDERS**0.5
    with open(path.replace(".xml", ".txt"), "w") as f:
        f.write(f"# Mitsuba {mi.__version__}, llvm_ad_rgb, path, {RENDERS} renders of {SPP} samples per pixel\n")
        for m, e in zip(mean.reshape(-1, 3), error.reshape(-1, 3)):
            f.write(" ".join([*(f"{v:.6g}" for v in m), *(f"{v:.2g}" for v in e)]) + "\n")
    print(path, mean.mean((0, 1)), (error / np.maximum(mean, 1e-9)).max())
