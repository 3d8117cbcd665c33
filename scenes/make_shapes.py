#!/usr/bin/env python3
"""Makes the meshes of the scenes that ship with wisp, in shapes/:
    head.ply   the bald bust that the hair scenes grow hair on
    ball.ply   a sphere of radius 0.1
    quad.ply   the square from (-1, -1, 0) to (1, 1, 0), for lights and walls

The bust is a signed distance field of blended ellipsoids, round cones and
spheres, in metres: y up, the face towards +z, the origin between the ears.
Its zero set is meshed with naive surface nets on a grid that is finer at the
face than at the shoulders, and the vertices are then drawn onto the surface.

    python3 make_shapes.py        (needs NumPy)
"""

import os
import struct

import numpy as np


def vec(*v):
    return np.array(v, dtype=np.float64)


def length(p):
    return np.sqrt((p * p).sum(axis=-1))


def sphere(p, c, r):
    return length(p - vec(*c)) - r


def ellipsoid(p, c, r, turn=0.0):
    """Turned about the x axis by `turn` degrees."""
    q = p - vec(*c)
    if turn:
        a = np.radians(turn)
        y = np.cos(a) * q[..., 1] + np.sin(a) * q[..., 2]
        z = -np.sin(a) * q[..., 1] + np.cos(a) * q[..., 2]
        q = np.stack([q[..., 0], y, z], axis=-1)
    r = vec(*r)
    k0 = length(q / r)
    k1 = length(q / (r * r))
    return k0 * (k0 - 1) / np.maximum(k1, 1e-9)


def cone(p, a, b, ra, rb):
    """A capsule whose radius runs from ra to rb."""
    a, b = vec(*a), vec(*b)
    ab = b - a
    t = np.clip(((p - a) @ ab) / (ab @ ab), 0, 1)
    return length(p - a - t[..., None] * ab) - (ra + (rb - ra) * t)


def union(a, b, k):
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - h * h * h * k / 6


def cut(a, b, k):
    return -union(-a, b, k)


def bust(p):
    """Distance to the bust. Left and right are mirror images."""
    p = np.stack([np.abs(p[..., 0]), p[..., 1], p[..., 2]], axis=-1)

    # skull, face, jaw
    d = ellipsoid(p, (0, 0.036, -0.016), (0.0765, 0.088, 0.097))
    d = union(d, ellipsoid(p, (0, 0.035, 0.036), (0.062, 0.060, 0.052)), 0.03)
    d = union(d, ellipsoid(p, (0, -0.030, 0.030), (0.060, 0.066, 0.058)), 0.04)
    d = union(d, ellipsoid(p, (0, -0.068, 0.034), (0.045, 0.046, 0.050), -10), 0.035)
    d = union(d, ellipsoid(p, (0.041, -0.062, 0.008), (0.019, 0.032, 0.028), 20), 0.04)
    d = union(d, ellipsoid(p, (0, -0.102, 0.070), (0.019, 0.014, 0.013)), 0.022)
    d = union(d, ellipsoid(p, (0.028, -0.050, 0.048), (0.024, 0.030, 0.026)), 0.03)
    d = union(d, ellipsoid(p, (0.041, -0.020, 0.055), (0.020, 0.014, 0.018)), 0.035)

    # brow, sockets, closed eyes
    d = union(d, ellipsoid(p, (0.028, 0.021, 0.0745), (0.025, 0.008, 0.011)), 0.025)
    d = cut(d, ellipsoid(p, (0.030, 0.001, 0.098), (0.018, 0.013, 0.016)), 0.016)
    d = union(d, sphere(p, (0.031, 0.001, 0.0715), 0.0138), 0.004)
    lid = length((p - vec(0.031, -0.0045, 0.078)) * vec(0.62, 1.0, 1.0)) - 0.0078
    slit = np.abs(p[..., 1] + 0.0050 + 14 * (p[..., 0] - 0.031) ** 2 * -1.0) - 0.0006
    d = cut(d, np.maximum(slit, lid), 0.002)

    # nose
    d = union(d, cone(p, (0, 0.014, 0.083), (0, -0.030, 0.104), 0.0065, 0.0090), 0.014)
    d = union(d, sphere(p, (0, -0.0335, 0.1045), 0.0098), 0.006)
    d = union(d, ellipsoid(p, (0.0105, -0.0375, 0.0945), (0.0072, 0.0068, 0.0095)), 0.006)
    d = cut(d, ellipsoid(p, (0.0062, -0.0450, 0.0985), (0.0036, 0.0040, 0.0050)), 0.004)

    # mouth
    d = union(d, ellipsoid(p, (0, -0.066, 0.072), (0.025, 0.017, 0.017)), 0.018)
    d = union(d, ellipsoid(p, (0.0065, -0.0605, 0.0868), (0.0125, 0.0046, 0.0058)), 0.006)
    d = union(d, ellipsoid(p, (0, -0.0720, 0.0858), (0.0160, 0.0056, 0.0066)), 0.005)
    d = cut(d, ellipsoid(p, (0, -0.0662, 0.0930), (0.0245, 0.0011, 0.0075)), 0.003)
    d = cut(d, cone(p, (0, -0.047, 0.0955), (0, -0.056, 0.0945), 0.0024, 0.0030), 0.005)
    d = cut(d, ellipsoid(p, (0, -0.0845, 0.0930), (0.016, 0.0045, 0.0070)), 0.010)

    # ears: a shell with a hollow
    ear = ellipsoid(p, (0.0770, -0.006, -0.012), (0.0080, 0.031, 0.018), -12)
    ear = cut(ear, ellipsoid(p, (0.0860, -0.004, -0.009), (0.0075, 0.021, 0.0105), -12), 0.005)
    d = union(d, ear, 0.010)

    # neck, shoulders, chest
    d = union(d, cone(p, (0, -0.070, -0.026), (0, -0.200, -0.040), 0.050, 0.056), 0.030)
    d = union(d, cone(p, (0.028, -0.080, -0.010), (0.010, -0.195, 0.012), 0.013, 0.010), 0.022)
    d = union(d, cone(p, (0.030, -0.170, -0.050), (0.150, -0.222, -0.048), 0.034, 0.042), 0.055)
    d = union(d, sphere(p, (0.168, -0.250, -0.045), 0.058), 0.040)
    d = union(d, ellipsoid(p, (0, -0.300, -0.030), (0.165, 0.110, 0.082)), 0.050)
    d = union(d, cone(p, (0.020, -0.210, 0.020), (0.135, -0.204, -0.012), 0.012, 0.010), 0.050)
    return cut(d, p[..., 1] + 0.305, 0.02)


def spaced(stops):
    """Coordinates from pieces (begin, end, spacing)."""
    out = []
    for begin, end, step in stops:
        n = max(int(round((end - begin) / step)), 1)
        out.extend(begin + (end - begin) * np.arange(n) / n)
    out.append(stops[-1][1])
    return np.array(out)


def grid():
    half = [(0.0, 0.05, 0.0036), (0.05, 0.092, 0.0060), (0.092, 0.240, 0.0165)]
    x = spaced(half)
    x = np.concatenate([-x[:0:-1], x])
    y = spaced([(-0.330, -0.24, 0.0150), (-0.24, -0.115, 0.0110), (-0.115, 0.03, 0.0033),
                (0.03, 0.136, 0.0095)])
    z = spaced([(-0.150, -0.03, 0.0125), (-0.03, 0.05, 0.0095), (0.05, 0.125, 0.0036)])
    return x, y, z


def surface_net(x, y, z):
    """Vertices and quads of the zero set: Gibson, Constrained Elastic Surface
    Nets, 1998, with the vertex of a cell at the mean of its edge crossings."""
    p = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)
    d = bust(p)
    shape = np.array(d.shape) - 1
    total = np.zeros((*shape, 3))
    count = np.zeros(shape)
    edges = []
    for axis in range(3):
        a = [slice(None)] * 3
        b = [slice(None)] * 3
        a[axis], b[axis] = slice(None, -1), slice(1, None)
        da, db = d[tuple(a)], d[tuple(b)]
        crosses = (da < 0) != (db < 0)
        t = np.where(crosses, da / np.where(crosses, da - db, 1), 0)
        q = p[tuple(a)] + t[..., None] * (p[tuple(b)] - p[tuple(a)])
        i, j = [k for k in range(3) if k != axis]
        for di in (0, 1):
            for dj in (0, 1):
                s = [slice(None)] * 3
                s[i] = slice(di, di + shape[i])
                s[j] = slice(dj, dj + shape[j])
                c = crosses[tuple(s)]
                total += np.where(c[..., None], q[tuple(s)], 0)
                count += c
        edges.append((axis, crosses, da < 0))
    index = np.full(shape, -1)
    inside = count > 0
    index[inside] = np.arange(inside.sum())
    vertices = total[inside] / count[inside][:, None]
    quads = []
    for axis, crosses, out in edges:
        i, j = (axis + 1) % 3, (axis + 2) % 3
        for cell in np.argwhere(crosses):
            if cell[i] == 0 or cell[j] == 0 or cell[i] >= shape[i] or cell[j] >= shape[j]:
                continue
            ring = []
            for di, dj in ((-1, -1), (0, -1), (0, 0), (-1, 0)):
                c = cell.copy()
                c[i] += di
                c[j] += dj
                ring.append(index[tuple(c)])
            quads.append(ring if out[tuple(cell)] else ring[::-1])
    return vertices, np.array(quads)


def relax(vertices, quads, rounds):
    """Evens out the mesh: each vertex moves to the mean of its neighbours and
    back onto the surface."""
    a = np.concatenate([quads[:, k] for k in range(4)])
    b = np.concatenate([quads[:, (k + 1) % 4] for k in range(4)])
    for _ in range(rounds):
        total = np.zeros_like(vertices)
        count = np.zeros(len(vertices))
        np.add.at(total, a, vertices[b])
        np.add.at(count, a, 1)
        np.add.at(total, b, vertices[a])
        np.add.at(count, b, 1)
        vertices = vertices + 0.5 * (total / count[:, None] - vertices)
        for _ in range(3):
            vertices = project(vertices)
    return vertices


def project(p):
    h = 1e-5
    d = bust(p)
    g = np.stack([bust(p + h * e) - bust(p - h * e) for e in np.eye(3)], axis=-1) / (2 * h)
    g2 = np.maximum((g * g).sum(axis=-1), 0.25)
    step = np.clip(d / g2, -0.004, 0.004)
    return p - step[:, None] * g


def normals(vertices, quads):
    """Area-weighted at the vertices."""
    p = vertices[quads]
    face = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    n = np.zeros_like(vertices)
    for k in range(4):
        np.add.at(n, quads[:, k], face)
    return n / length(n)[:, None]


def write_ply(path, vertices, quads):
    header = ("ply\nformat binary_little_endian 1.0\n"
              "comment made by make_shapes.py\n"
              f"element vertex {len(vertices)}\n"
              + "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
              + f"element face {len(quads)}\nproperty list uchar int vertex_indices\nend_header\n")
    with open(path, "wb") as f:
        f.write(header.encode())
        f.write(np.hstack([vertices, normals(vertices, quads)]).astype("<f4").tobytes())
        for q in quads:
            f.write(struct.pack("<B4i", 4, *(int(v) for v in q)))


def head():
    vertices, quads = surface_net(*grid())
    return relax(vertices, quads, 3), quads


def ball(n=16, radius=0.1):
    """A cube of 6 n^2 quads blown up to a sphere, with quads of like size."""
    index = {}
    vertices = []
    quads = []
    for axis in range(3):
        for sign in (-1, 1):
            grid_index = np.empty((n + 1, n + 1), dtype=int)
            for i in range(n + 1):
                for j in range(n + 1):
                    p = np.empty(3)
                    p[axis] = sign
                    p[(axis + 1) % 3] = np.tan((2 * i / n - 1) * np.pi / 4)
                    p[(axis + 2) % 3] = np.tan((2 * j / n - 1) * np.pi / 4)
                    key = tuple(np.round(p, 6) + 0.0)
                    if key not in index:
                        index[key] = len(vertices)
                        vertices.append(radius * p / np.linalg.norm(p))
                    grid_index[i, j] = index[key]
            for i in range(n):
                for j in range(n):
                    q = [grid_index[i, j], grid_index[i + 1, j], grid_index[i + 1, j + 1],
                         grid_index[i, j + 1]]
                    quads.append(q if sign > 0 else q[::-1])
    return np.array(vertices), np.array(quads)


def quad():
    return vec([-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]), np.array([[0, 1, 2, 3]])


def main():
    folder = os.path.join(os.path.dirname(os.path.abspath(__file__)), "shapes")
    os.makedirs(folder, exist_ok=True)
    for name, (vertices, quads) in (("head", head()), ("ball", ball()), ("quad", quad())):
        path = os.path.join(folder, name + ".ply")
        write_ply(path, vertices, quads)
        print(f"{path}: {len(vertices)} vertices, {len(quads)} quads, "
              f"{os.path.getsize(path)} bytes")


if __name__ == "__main__":
    main()
