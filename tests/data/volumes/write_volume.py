"""Writes mitsuba.vol with Mitsuba 3.9.1: 3 x 2 x 2 samples of 0, 1/16, 2/16, …"""
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
values = 0.0625 * np.arange(12, dtype=np.float32).reshape(2, 2, 3, 1)
mi.VolumeGrid(values).write("mitsuba.vol")
