"""The files of the benchmark: triangle meshes in and out, raw points."""

import numpy as np


def read_obj(path):
    """Vertices and triangles of a Wavefront OBJ; polygons become fans."""
    vertices, triangles = [], []
    with open(path, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                vertices.append([float(x) for x in words[1:4]])
            elif words[0] == "f":
                corners = [int(word.split("/")[0]) for word in words[1:]]
                corners = [c - 1 if c > 0 else len(vertices) + c for c in corners]
                triangles += [[corners[0], b, c] for b, c in zip(corners[1:], corners[2:])]
    return (np.array(vertices, np.float64).reshape(-1, 3),
            np.array(triangles, np.int32).reshape(-1, 3))


# One face record of the PLY files here: a count, always 3, and three indices.
FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write_ply(path, vertices, triangles):
    """Binary little-endian PLY, float32 coordinates, int32 indices."""
    faces = np.empty(len(triangles), FACE)
    faces["count"] = 3
    faces["corners"] = triangles
    with open(path, "wb") as out:
        out.write((f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
                   "property float x\nproperty float y\nproperty float z\n"
                   f"element face {len(triangles)}\n"
                   "property list uchar int vertex_indices\nend_header\n").encode())
        out.write(np.ascontiguousarray(vertices, "<f4").tobytes())
        out.write(faces.tobytes())


def read_ply(path):
    """Reads only what write_ply writes; says so of anything else."""
    with open(path, "rb") as file:
        data = file.read()
    end = data.find(b"end_header\n")
    header = data[:max(end, 0)].decode("ascii", "replace").split("\n")
    counts = {words[1]: int(words[2]) for words in map(str.split, header)
              if len(words) == 3 and words[0] == "element"}
    properties = [line for line in header if line.startswith("property")]
    if end < 0 or "format binary_little_endian 1.0" not in header or properties != [
            "property float x", "property float y", "property float z",
            "property list uchar int vertex_indices"]:
        raise SystemExit(f"{path}: not a PLY as make_meshes.py writes them (binary little-endian, "
                         "float x y z, lists of int); --subdivide reads OBJ files and writes such")
    start = end + len(b"end_header\n")
    if len(data) - start != 12 * counts["vertex"] + FACE.itemsize * counts["face"]:
        raise SystemExit(f"{path}: {len(data)} bytes long, but the header tells of "
                         f"{start + 12 * counts['vertex'] + FACE.itemsize * counts['face']}")
    vertices = np.frombuffer(data, "<f4", counts["vertex"] * 3, start).reshape(-1, 3)
    faces = np.frombuffer(data, FACE, counts["face"], start + vertices.nbytes)
    return vertices.astype(np.float64), np.ascontiguousarray(faces["corners"])


def read_mesh(path):
    return read_obj(path) if str(path).lower().endswith(".obj") else read_ply(path)


def write_tri(path, vertices, triangles):
    """int64 numbers of vertices and triangles, float64 coordinates, int32 corners."""
    with open(path, "wb") as out:
        out.write(np.array([len(vertices), len(triangles)], "<i8").tobytes())
        out.write(np.ascontiguousarray(vertices, "<f8").tobytes())
        out.write(np.ascontiguousarray(triangles, "<i4").tobytes())


def write_points(path, points):
    """Raw little-endian float64 x y z, no header."""
    np.ascontiguousarray(points, "<f8").tofile(path)


def read_points(path):
    return np.fromfile(path, "<f8").reshape(-1, 3)


def subdivide(vertices, triangles, times):
    """Splits every triangle in four at the middles of its edges, several times.

    The surface stays the same, and triangles that share an edge share its middle,
    so a closed mesh stays closed.
    """
    for _ in range(times):
        edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).astype(np.int64)
        keys, where = np.unique(edges[:, 0] * len(vertices) + edges[:, 1], return_inverse=True)
        low, high = np.divmod(keys, len(vertices))
        middle = (where.reshape(-1, 3) + len(vertices)).astype(np.int32)
        vertices = np.concatenate([vertices, 0.5 * (vertices[low] + vertices[high])])
        a, b, c = triangles.T
        ab, bc, ca = middle.T
        triangles = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    return vertices, np.ascontiguousarray(triangles, np.int32)


def box_points(vertices, count, random):
    """Uniform in the bounding box."""
    return random.uniform(vertices.min(axis=0), vertices.max(axis=0), (count, 3))


def near_points(vertices, triangles, count, random, spread=0.005):
    """Uniform on the surface, moved along the triangle's normal by a Gaussian.

    Its standard deviation is `spread` of the diagonal of the bounding box.
    """
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(normals, axis=1)
    cumulative = np.cumsum(doubled)
    chosen = np.searchsorted(cumulative, random.uniform(0.0, cumulative[-1], count), side="right")
    chosen = np.minimum(chosen, len(triangles) - 1)
    s, t = np.sqrt(random.uniform(size=(1, count, 1))), random.uniform(size=(1, count, 1))
    weights = np.concatenate([1.0 - s, s * (1.0 - t), s * t])
    points = (weights * corners[chosen].transpose(1, 0, 2)).sum(axis=0)
    diagonal = np.linalg.norm(vertices.max(axis=0) - vertices.min(axis=0))
    shift = random.normal(0.0, spread * diagonal, (count, 1))
    return points + shift * normals[chosen] / np.maximum(doubled[chosen], 1e-300)[:, None]
