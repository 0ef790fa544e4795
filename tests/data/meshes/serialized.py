"""Writes version4.serialized by the layout in the documentation of Mitsuba 0.6 ("Serialized mesh loader"), and prints
what Mitsuba 3.9.1 (scalar_rgb) reads in it; the unit tests of src/load/serialized.rs hold the same numbers.

    python serialized.py
"""

import struct
import zlib
from pathlib import Path

NORMALS, UVS, COLORS, SINGLE, DOUBLE = 0x1, 0x2, 0x8, 0x1000, 0x2000


def mesh(name, flags, positions, normals, uvs, colors, triangles):
    number = "d" if flags & DOUBLE else "f"
    body = struct.pack("<I", flags) + name.encode() + b"\0" + struct.pack("<QQ", len(positions), len(triangles))
    for rows in (positions, normals, uvs, colors):
        for row in rows:
            body += struct.pack(f"<{len(row)}{number}", *row)
    for row in triangles:
        body += struct.pack("<3I", *row)
    return struct.pack("<HH", 0x041C, 4) + zlib.compress(body)


def main():
    quad = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0.5)]
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    normals = [(0, 0, 1), (0, 0.6, 0.8), (0, 0, 1), (0, 0, 1)]
    colors = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]
    meshes = [
        mesh("tile", SINGLE, quad, [], [], [], [(0, 1, 2), (0, 2, 3)]),
        mesh("all of it", DOUBLE | NORMALS | UVS | COLORS, quad, normals, corners, colors, [(0, 1, 2), (0, 2, 3)]),
    ]
    out, offsets = b"", []
    for m in meshes:
        offsets.append(len(out))
        out += m
    out += struct.pack(f"<{len(offsets)}Q", *offsets) + struct.pack("<I", len(offsets))
    path = Path(__file__).parent / "version4.serialized"
    path.write_bytes(out)

    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    for index in range(len(meshes)):
        shape = mi.load_dict({"type": "serialized", "filename": str(path), "shape_index": index})
        params = mi.traverse(shape)
        for key in ("vertex_positions", "vertex_normals", "vertex_texcoords", "faces"):
            print(index, key, list(params[key]))


main()
