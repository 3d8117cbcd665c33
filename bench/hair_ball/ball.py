"""The hair ball: what every renderer of the comparison is given.

A diffuse unit sphere (the head, y up) wears N curly strands that fall over it,
in clumps. A strand is a uniform cubic B-spline of 16 control points whose
radius is linear over them. A square light and a constant sky light it.
Needs numpy alone; the strands follow from N.
"""

import numpy as np

CAMERA = {"eye": (0.0, 0.35, 5.4), "at": (0.0, -0.25, 0.0), "up": (0.0, 1.0, 0.0),
          "fov": 36.0}  # degrees, of both sides of a square picture
SKY = 0.35  # radiance
LIGHT = {"center": (3.0, 3.5, 3.5), "at": (0.0, 0.0, 0.0), "half": 1.0, "radiance": 12.0}
HEAD = {"radius": 1.0, "albedo": (0.5, 0.35, 0.3)}
HAIR = {"beta_m": 0.3, "beta_n": 0.3, "alpha": 2.0, "eta": 1.55}
EUMELANIN = (0.419, 0.697, 1.37)  # absorption of a concentration of 1
COLORS = {"brunette": tuple(1.3 * s for s in EUMELANIN),
          "blond": tuple(0.3 * s for s in EUMELANIN)}
BOUNCES = 64
POINTS = 16  # control points of a strand
GUIDES = 400  # clumps
SEED = 7


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def scalp_points(rng, count):
    """Points of the sphere above the line where the hair ends."""
    found = np.empty((0, 3))
    while len(found) < count:
        v = unit(rng.normal(size=(4 * count, 3)))
        found = np.concatenate([found, v[v[:, 1] > -0.45]])
    return found[:count]


def fall(roots, length, s):
    """Positions at arc parameters s of strands that leave the scalp along its
    normal, bend down and slide over it. s < 0 lies below the root."""
    steps = 64
    ds = s[-1] / steps
    down = np.array([0.0, -1.0, 0.0])
    path = [roots]
    for k in range(steps):
        t = (k + 0.5) * ds
        outwards = roots * max(0.0, 1 - 1.15 * t) ** 1.5
        sideways = 0.35 * np.cross(roots, [0, 1, 0]) * t
        p = path[-1] + unit(outwards + down * (0.25 + 1.9 * t) + sideways) * (ds * length)[:, None]
        distance = np.linalg.norm(p, axis=1)
        lowest = 1.0 + 0.12 * min(1.0, 4 * t)
        path.append(np.where((distance < lowest)[:, None], p * (lowest / distance)[:, None], p))
    path = np.array(path)

    def at(t):
        if t < 0:
            return roots + roots * (t * length)[:, None]
        i = min(int(t / ds), steps - 1)
        w = t / ds - i
        return path[i] * (1 - w) + path[i + 1] * w

    return np.stack([at(t) for t in s], axis=1)


def radii(count):
    """Radius at root and tip: many strands are thinner, so that they cover alike."""
    root = 0.0030 * np.sqrt(20000 / count)
    return root, 0.25 * root


def strands(count):
    """float32 (count, 16, 4): x, y, z and radius of the B-spline control points."""
    # The order of the draws is part of the scene.
    rng = np.random.default_rng(SEED)
    guide_root = scalp_points(rng, GUIDES)
    phase = rng.uniform(0, 2 * np.pi, GUIDES)
    guide_length = rng.uniform(0.9, 1.25, GUIDES)
    curl = rng.uniform(0.045, 0.085, GUIDES)
    hand = np.where(rng.random(GUIDES) < 0.5, -1.0, 1.0)
    turns = rng.uniform(2.2, 3.2, GUIDES)
    root = scalp_points(rng, count)
    guide = np.argmax(root @ guide_root.T, axis=1)

    s = (np.arange(POINTS) - 1) / (POINTS - 3)  # 0 on the scalp
    grown = np.clip(s, 0, None)
    length = guide_length[guide] * rng.uniform(0.92, 1.08, count) * 1.1
    centre = fall(root, length, s)
    clump = (0.55 * np.clip(s, 0, 1) ** 0.8)[None, :, None]
    centre = centre * (1 - clump) + fall(guide_root, guide_length * 1.1, s)[guide] * clump

    # A helix around the strand.
    tangent = unit(np.gradient(centre, axis=1))
    side = unit(np.cross(tangent, np.array([0.31, 0.2, 0.93])))
    across = np.cross(tangent, side)
    start = phase[guide] + rng.normal(0, 0.35, count)
    angle = start[:, None] + hand[guide][:, None] * 2 * np.pi * turns[guide][:, None] * grown[None]
    amplitude = (curl[guide] * rng.uniform(0.8, 1.2, count))[:, None] * np.clip(3 * s, 0, 1)[None]
    points = centre + amplitude[..., None] * (np.cos(angle)[..., None] * side
                                              + np.sin(angle)[..., None] * across)
    points += rng.normal(0, 0.004, points.shape) * np.clip(4 * s, 0, 1)[None, :, None]

    r_root, r_tip = radii(count)
    radius = np.linspace(0, 1, POINTS)[None] * (r_tip - r_root) + r_root + np.zeros((count, 1))
    return np.concatenate([points, radius[..., None]], axis=-1).astype(np.float32)


def light_corners():
    """Counter-clockwise seen from the side that shines."""
    center = np.array(LIGHT["center"])
    towards = unit(np.array(LIGHT["at"]) - center)
    x = unit(np.cross([0.0, 1.0, 0.0], towards))
    y = np.cross(towards, x)
    h = LIGHT["half"]
    return [center - x * h - y * h, center + x * h - y * h,
            center + x * h + y * h, center - x * h + y * h]


def camera_axes():
    """Right, up and back of the camera, and where it is."""
    eye = np.array(CAMERA["eye"])
    back = unit(eye - np.array(CAMERA["at"]))
    right = unit(np.cross(CAMERA["up"], back))
    return right, np.cross(back, right), back, eye


def head_mesh(around=256, rows=128):
    """Vertices (which are the normals too, times the radius) and faces of a
    sphere: triangles at the poles, quads elsewhere, counter-clockwise from outside."""
    vertices = [(0.0, 1.0, 0.0)]
    for j in range(1, rows):
        a = np.pi * j / rows
        for i in range(around):
            b = 2 * np.pi * i / around
            vertices.append((np.sin(a) * np.cos(b), np.cos(a), np.sin(a) * np.sin(b)))
    vertices.append((0.0, -1.0, 0.0))

    def ring(j, i):
        return 1 + (j - 1) * around + i % around

    last = len(vertices) - 1
    faces = []
    for i in range(around):
        faces.append((0, ring(1, i + 1), ring(1, i)))
        for j in range(1, rows - 1):
            faces.append((ring(j, i), ring(j, i + 1), ring(j + 1, i + 1), ring(j + 1, i)))
        faces.append((ring(rows - 1, i), ring(rows - 1, i + 1), last))
    return np.array(vertices), faces
