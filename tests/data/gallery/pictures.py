"""The gallery's small pictures, from formulas (numpy). Bottom row first, as PFM has it."""
import numpy as np


def pfm(name, rows):
    """`rows[0]` is the top row."""
    rows = np.asarray(rows, "<f4")
    with open(name, "wb") as f:
        f.write(b"PF\n%d %d\n-1.0\n" % (rows.shape[1], rows.shape[0]))
        f.write(rows[::-1].tobytes())


y, x = np.mgrid[0:8, 0:8]
pfm("pattern.pfm", np.stack([0.1 + 0.1 * x, 0.9 - 0.1 * y, 0.2 + 0.05 * ((3 * x + 5 * y) % 8)], -1))
u, v = (x + 0.5) / 8, (y + 0.5) / 8
heights = 0.05 * np.sin(2 * np.pi * u) * np.cos(2 * np.pi * v) + 0.02 * np.cos(4 * np.pi * u)
pfm("heights.pfm", np.repeat(heights[..., None], 3, -1))
n = np.stack([0.4 * np.sin(2 * np.pi * u), 0.3 * np.cos(2 * np.pi * v), np.ones_like(u)], -1)
pfm("normals.pfm", 0.5 + 0.5 * n / np.linalg.norm(n, axis=-1, keepdims=True))
row, column = np.mgrid[0:8, 0:16]
sky = np.stack([0.3 + 0.02 * column, 0.4 + 0.02 * row, 0.8 - 0.05 * row], -1)
sky[2, 5] = [300, 280, 240]
pfm("sky.pfm", sky)
