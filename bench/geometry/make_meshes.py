#!/usr/bin/env python3
"""make_meshes.py OUT [--sizes 4k,17k,...] [--points N] [--tri]
make_meshes.py --subdivide IN.obj OUT.ply N [--points N] [--tri]

Writes what the geometry benchmark measures on.

The first form makes the same body at several resolutions, OUT/knot_4k.ply and so
on: a closed tube along a trefoil knot, its radius swelling and thinning, with
bumps down to one 150th of its size. It folds close to itself as scanned bodies do,
it has large smooth and small rough parts, and it belongs to nobody.
The second form splits every triangle of a mesh in four N times (0: only converts).
Polygons with more than three corners become fans; vertices are kept as they are.

Each mesh NAME.ply (binary, float32) gets two files of points, raw float64 x y z
without a header: NAME.box.f64, uniform in the bounding box, and NAME.near.f64, a
random point of the surface plus its normal times Gaussian noise of 0.005 of the
diagonal. The points depend only on the mesh and on the fixed seed.
--tri writes NAME.tri besides: int64 numbers of vertices and triangles, float64
coordinates, int32 corners.
"""

import argparse
import pathlib

import numpy as np

import meshes

# Cells around the tube; eleven times as many go along it, two triangles each, as
# the knot is about eleven times as long as its tube is round.
AROUND = {"4k": 14, "17k": 28, "70k": 56, "280k": 113, "1.1m": 224, "4.4m": 447}
ALONG = 11
SEED = 20240901


def trefoil(t):
    """The (2, 3) torus knot and its Frenet frame (normal, binormal)."""
    r = 2.0 + np.cos(3 * t)
    point = np.stack([r * np.cos(2 * t), r * np.sin(2 * t), np.sin(3 * t)], axis=-1)
    dr, ddr = -3 * np.sin(3 * t), -9 * np.cos(3 * t)
    first = np.stack([dr * np.cos(2 * t) - 2 * r * np.sin(2 * t),
                      dr * np.sin(2 * t) + 2 * r * np.cos(2 * t), 3 * np.cos(3 * t)], axis=-1)
    second = np.stack([(ddr - 4 * r) * np.cos(2 * t) - 4 * dr * np.sin(2 * t),
                       (ddr - 4 * r) * np.sin(2 * t) + 4 * dr * np.cos(2 * t),
                       -9 * np.sin(3 * t)], axis=-1)
    binormal = np.cross(first, second)
    binormal /= np.linalg.norm(binormal, axis=-1, keepdims=True)
    normal = np.cross(binormal, first)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return point, normal, binormal


def bumps(points):
    """Seven octaves of four plane waves each, between -1 and 1."""
    random = np.random.default_rng(SEED)
    value = np.zeros(len(points))
    for octave in range(7):
        for _ in range(4):
            direction = random.normal(size=3)
            direction /= np.linalg.norm(direction)
            wave = 2.0 ** octave * 1.5 * random.uniform(0.8, 1.25)
            value += 0.52 ** octave * np.sin(wave * (points @ direction) + random.uniform(0, 6.28))
    return np.tanh(0.6 * value)


def knot(around):
    """A closed, outward oriented mesh of 2 * ALONG * around^2 triangles.

    The radius stays between 0.18 and 0.75, below half the distance of the knot to
    itself and below its radius of curvature: the surface does not meet itself.
    """
    along = ALONG * around
    t = np.arange(along) * (2 * np.pi / along)
    center, normal, binormal = trefoil(t)
    angle = np.arange(around) * (2 * np.pi / around)
    outward = (np.cos(angle)[None, :, None] * normal[:, None, :]
               + np.sin(angle)[None, :, None] * binormal[:, None, :]).reshape(-1, 3)
    center = np.repeat(center, around, axis=0)
    swell = np.repeat(0.42 * (1.0 + 0.22 * np.sin(5 * t + 1.0)), around)
    vertices = center + outward * (swell * (1.0 + 0.45 * bumps(center + swell[:, None] * outward)))[
        :, None]
    i, j = np.meshgrid(np.arange(along), np.arange(around), indexing="ij")
    a = (i * around + j).ravel()
    b = ((i + 1) % along * around + j).ravel()
    c = ((i + 1) % along * around + (j + 1) % around).ravel()
    d = (i * around + (j + 1) % around).ravel()
    triangles = np.stack([a, c, b, a, d, c], axis=1).reshape(-1, 3)
    # Scanned meshes come in no order of use to a tree: shuffle.
    random = np.random.default_rng(SEED + 1)
    return vertices, random.permutation(triangles).astype(np.int32)


def write_all(path, vertices, triangles, points, tri):
    # All programs see the same mesh: the float32 one, also where they compute in double.
    vertices = vertices.astype(np.float32).astype(np.float64)
    meshes.write_ply(path, vertices, triangles)
    if tri:
        meshes.write_tri(path.with_suffix(".tri"), vertices, triangles)
    random = np.random.default_rng(SEED + 2)
    meshes.write_points(path.with_suffix(".box.f64"), meshes.box_points(vertices, points, random))
    meshes.write_points(path.with_suffix(".near.f64"),
                        meshes.near_points(vertices, triangles, points, random))
    print(f"{path}: {len(vertices)} vertices, {len(triangles)} triangles, {points} points each")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 2)[2],
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=pathlib.Path, help="where the knots go")
    parser.add_argument("--subdivide", nargs=3, metavar=("IN", "OUT.ply", "N"))
    parser.add_argument("--sizes", default=",".join(AROUND), help="some of the default")
    parser.add_argument("--points", type=int, default=200000, help="a file")
    parser.add_argument("--tri", action="store_true")
    args = parser.parse_args()
    if (args.folder is None) == (args.subdivide is None):
        parser.error("wants either a folder for the knots or --subdivide IN OUT.ply N")
    if args.subdivide:
        source, target, times = args.subdivide
        if not times.isdigit():
            parser.error(f"--subdivide wants a number of times from 0 on, not '{times}'")
        if not target.endswith(".ply"):
            parser.error(f"--subdivide writes PLY files: '{target}' should end in .ply")
        write_all(pathlib.Path(target), *meshes.subdivide(*meshes.read_mesh(source), int(times)),
                  args.points, args.tri)
        return
    unknown = [size for size in args.sizes.split(",") if size not in AROUND]
    if unknown:
        parser.error(f"unknown size {unknown[0]}; there are {', '.join(AROUND)}")
    args.folder.mkdir(parents=True, exist_ok=True)
    for size in args.sizes.split(","):
        write_all(args.folder / f"knot_{size}.ply", *knot(AROUND[size]), args.points, args.tri)


if __name__ == "__main__":
    main()
