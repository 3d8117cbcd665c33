#!/usr/bin/env python3
"""make_scene.py N FOLDER [--profile flat|round]

Writes the hair ball with N strands: brunette.json and blond.json with their
shapes for wisp, hair.txt for Mitsuba, hair.npy for Cycles.
"""

import argparse
import json
import pathlib

import numpy as np

import ball


def write_strands(path, points):
    """Binary PLY: one polyline of control points for each strand."""
    count, n = points.shape[:2]
    header = ("ply\nformat binary_little_endian 1.0\ncomment wisp basis bspline\n"
              f"element vertex {count * n}\n"
              + "".join(f"property float {name}\n" for name in ("x", "y", "z", "radius"))
              + f"element line {count}\nproperty list uchar int vertex_indices\nend_header\n")
    lines = np.zeros(count, dtype=[("n", "u1"), ("i", "<i4", (n,))])
    lines["n"] = n
    lines["i"] = np.arange(count * n).reshape(count, n)
    with open(path, "wb") as out:
        out.write(header.encode())
        out.write(points.astype("<f4").tobytes())
        out.write(lines.tobytes())


def write_faces(path, vertices, faces, normals=None):
    names = ["x", "y", "z"] + (["nx", "ny", "nz"] if normals is not None else [])
    rows = vertices if normals is None else np.concatenate([vertices, normals], axis=1)
    with open(path, "w") as out:
        out.write(f"ply\nformat ascii 1.0\nelement vertex {len(rows)}\n")
        out.writelines(f"property float {name}\n" for name in names)
        out.write(f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
        out.writelines(" ".join(f"{v:.9g}" for v in row) + "\n" for row in rows)
        out.writelines(" ".join(str(i) for i in (len(face), *face)) + "\n" for face in faces)


def wisp_scene(color, profile):
    film = 0.036
    hair = {"name": "hair", "uri": "shapes/hair.ply", "basis": "bspline"}
    if profile:
        hair["profile"] = profile
    return {
        "asset": {"version": "4.2", "generator": "bench/hair_ball/make_scene.py"},
        "cameras": [{"name": "camera",
                     "frame": [float(x) for axis in ball.camera_axes() for x in axis],
                     "aspect": 1.0, "film": film,
                     "lens": film / 2 / np.tan(np.radians(ball.CAMERA["fov"]) / 2)}],
        "environments": [{"name": "sky", "emission": [ball.SKY] * 3}],
        "shapes": [hair,
                   {"name": "head", "uri": "shapes/head.ply"},
                   {"name": "light", "uri": "shapes/light.ply"}],
        "materials": [{"name": "hair", "type": "hair", "sigma_a": list(ball.COLORS[color]),
                       **ball.HAIR},
                      {"name": "head", "type": "matte", "color": list(ball.HEAD["albedo"])},
                      {"name": "light", "type": "matte", "color": [0, 0, 0],
                       "emission": [ball.LIGHT["radiance"]] * 3}],
        "instances": [{"name": name, "shape": i, "material": i}
                      for i, name in enumerate(("hair", "head", "light"))],
    }


def make_scene(count, folder, profile=None):
    folder = pathlib.Path(folder)
    (folder / "shapes").mkdir(parents=True, exist_ok=True)
    points = ball.strands(count)
    np.save(folder / "hair.npy", points)
    with open(folder / "hair.txt", "w") as out:
        for strand in points:
            out.writelines("%.6f %.6f %.6f %.7f\n" % tuple(p) for p in strand)
            out.write("\n")
    write_strands(folder / "shapes" / "hair.ply", points)
    vertices, faces = ball.head_mesh()
    write_faces(folder / "shapes" / "head.ply", vertices * ball.HEAD["radius"], faces, vertices)
    write_faces(folder / "shapes" / "light.ply", np.array(ball.light_corners()), [(0, 1, 2, 3)])
    for color in ball.COLORS:
        with open(folder / f"{color}.json", "w") as out:
            json.dump(wisp_scene(color, profile), out, indent=1)
            out.write("\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", 1)[1])
    parser.add_argument("count", type=int, metavar="N")
    parser.add_argument("folder")
    parser.add_argument("--profile", choices=("flat", "round"), help="of wisp's strands")
    args = parser.parse_args()
    make_scene(args.count, args.folder, args.profile)
