"""Writes the small pictures of this folder (Pillow), renders its scenes with Mitsuba 3 and writes means.txt: one line for
every render with the scene, definitions, and the mean of red, green and blue over the picture. Needs Mitsuba 3.9.1.

    python reference.py
"""

import mitsuba as mi
import numpy as np
from PIL import Image

SPP = 4096
RAW = ["", "raw=true"]
RENDERS = {
    "mask": RAW,
    "blend": RAW,
    "roughness": RAW,
    "principled": RAW,
    "normalmap": RAW,
    "bumpmap": RAW,
    "references": [""],
    "spectrum": [""],
    "serialized": ["", "index=1"],
    "spot-texture": [""],
    "mesh-attribute": ["", "name=face_color"],
    "bmp": [""],
}


def pictures():
    y, x = np.mgrid[0:8, 0:8]
    Image.fromarray(np.full((8, 8), 128, np.uint8)).save("grey.png")
    Image.fromarray((20 + 30 * x).astype(np.uint8)).save("ramp.png")
    Image.fromarray(np.full((8, 8, 3), (170, 140, 230), np.uint8)).save("normal.png")
    slide = np.stack([30 * x, 30 * y, 20 + 15 * (x + y)], -1).astype(np.uint8)
    Image.fromarray(slide).save("slide.png")
    Image.fromarray(slide).save("slide.bmp")


def main():
    mi.set_variant("scalar_rgb")
    pictures()
    with open("means.txt", "w") as f:
        f.write(f"# Mitsuba {mi.__version__}, scalar_rgb, path, {SPP} samples per pixel\n")
        for name, definitions in RENDERS.items():
            for definition in definitions:
                scene = mi.load_file(f"{name}.xml", **dict(d.split("=") for d in definition.split()))
                mean = np.array(mi.render(scene, spp=SPP))[..., :3].mean((0, 1))
                line = " | ".join([f"{name}.xml", definition, " ".join(f"{v:.4f}" for v in mean)])
                f.write(line + "\n")
                print(line)


main()
