#!/usr/bin/env python3
"""Holds wisp's walks on spheres to finite elements.

    python3 bench/pde/finite_elements.py WISP MESH [--points 200] [--walks 4096]

Fills a closed mesh (.obj, .ply, .stl) with tetrahedra by TetGen and solves the same
problems with quadratic elements by scikit-fem, on two meshes, the finer of which has about
a quarter of the volume in each tetrahedron: what they differ by is taken for the error of
the finer one. A mesh that TetGen refuses, as one that intersects itself, is repaired by
MeshFix first, for both. Then runs `wisp solve` at random points and compares in units of both errors.
Needs: pip install scikit-fem tetgen pymeshfix pyamg meshio scipy numpy
"""

import argparse
import csv
import json
import math
import os
import subprocess
import sys
import tempfile

import meshio
import numpy as np
import pyamg
import pymeshfix
import tetgen
from scipy.sparse.linalg import cg
from skfem import Basis, BilinearForm, ElementTetP2, LinearForm, MeshTet, condense
from skfem.helpers import dot, grad


def problems(size):
    """With formulas for wisp and functions for the elements; k makes x of about 1 to 10."""
    k = 6 / size
    smooth = lambda x: np.sin(k * x[0]) * np.cos(k * x[1]) + (k * x[2]) ** 2 / 10
    smooth_text = f"sin({k}*x)*cos({k}*y) + ({k}*z)^2/10"
    bump = lambda x: -k * k * np.cos(k * x[1] + 0.5 * k * x[0])
    bump_text = f"-{k * k}*cos({k}*y + {0.5 * k}*x)"
    zero = lambda x: 0 * x[0]
    result = {"laplace": (0, smooth, zero, {"equation": "laplace", "boundary": smooth_text}),
              "poisson": (0, smooth, bump, {"equation": "poisson", "boundary": smooth_text,
                                            "source": bump_text})}
    for c in (1, 100, 10000):
        result[f"screened, c = {c} / size^2"] = (
            c / size**2, smooth, bump,
            {"equation": "screened_poisson", "screening": c / size**2, "boundary": smooth_text,
             "source": bump_text})
    result["biharmonic"] = (None, smooth, bump, {
        "equation": "biharmonic", "boundary": smooth_text, "boundary_laplacian": bump_text})
    return result


def solve_linear(a, b):
    """Conjugate gradients with algebraic multigrid."""
    grids = pyamg.smoothed_aggregation_solver(a.tocsr())
    x, info = cg(a, b, rtol=1e-10, M=grids.aspreconditioner(), maxiter=1000)
    if info != 0:
        sys.exit("finite_elements: the linear solver did not converge")
    return x


class Elements:
    def __init__(self, vertices, faces, volume):
        filler = tetgen.TetGen(vertices, faces)
        # boundary faces are kept (Y), so that both have the same domain
        nodes, cells = filler.tetrahedralize(switches=f"pqYa{volume:g}Q")[:2]
        self.mesh = MeshTet(nodes.T.copy(), cells.T.copy().astype(np.int64))
        self.basis = Basis(self.mesh, ElementTetP2(), intorder=5)
        self.stiffness = BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(self.basis)
        self.mass = BilinearForm(lambda u, v, w: u * v).assemble(self.basis)
        self.edge = self.basis.get_dofs().flatten()

    def solve(self, c, g, load):
        """lap u - c u = f, u = g on the boundary; `load` is that of f."""
        u = np.zeros(self.basis.N)
        u[self.edge] = g(self.basis.doflocs[:, self.edge])
        a, b, x, free = condense(self.stiffness + c * self.mass, -load, x=u, D=self.edge)
        x[free] = solve_linear(a, b)
        return x

    def run(self, c, g, f):
        if c is not None:
            return self.solve(c, g, LinearForm(lambda v, w: f(w.x) * v).assemble(self.basis))
        v = self.solve(0, f, np.zeros(self.basis.N))  # f stands for the Laplacian on the boundary
        return self.solve(0, g, self.mass @ v)

    def at(self, points, u):
        return self.basis.probes(points.T) @ u


def check_elements(elements):
    """Against a solution that is known."""
    nodes = elements.basis.doflocs
    k = 3 / np.ptp(nodes[0])
    u = lambda x: np.exp(k * x[0]) * np.sin(k * x[1])
    off = np.abs(elements.run(0, u, lambda x: 0 * x[0]) - u(nodes)).max() / np.abs(u(nodes)).max()
    print(f"finite elements against exp(x) sin(y): off by {off:.1e} of the largest value")
    if off > 1e-3:
        sys.exit("finite_elements: the finite elements are wrong")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("wisp", help="the wisp command")
    parser.add_argument("mesh", help="a closed mesh")
    parser.add_argument("--points", type=int, default=200)
    parser.add_argument("--walks", type=int, default=4096)
    parser.add_argument("--volume", type=float, default=4e-6,
                        help="of the coarser tetrahedra, relative to the box's diagonal cubed")
    args = parser.parse_args()

    surface = meshio.read(args.mesh)
    vertices = np.asarray(surface.points, dtype=float)
    faces = np.vstack([c.data for c in surface.cells if c.type == "triangle"])
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    try:
        coarse = Elements(vertices, faces, args.volume * size**3)
    except RuntimeError as refused:
        print(f"repairing the mesh, as TetGen says: {refused}")
        fixed = pymeshfix.MeshFix(vertices, faces)
        fixed.repair()
        vertices, faces = np.asarray(fixed.points), np.asarray(fixed.faces)
        coarse = Elements(vertices, faces, args.volume * size**3)
    fine = Elements(vertices, faces, args.volume / 4 * size**3)
    print(f"{coarse.mesh.nelements} and {fine.mesh.nelements} tetrahedra, "
          f"{fine.basis.N} unknowns")
    check_elements(coarse)

    # points of the finer mesh: in tetrahedra by volume
    rng = np.random.default_rng(1)
    corners = fine.mesh.p[:, fine.mesh.t]
    edges = corners[:, 1:] - corners[:, :1]
    volumes = np.abs(np.linalg.det(edges.transpose(2, 0, 1)))
    chosen = rng.choice(len(volumes), args.points, p=volumes / volumes.sum())
    weights = rng.dirichlet(np.ones(4), args.points)
    points = np.einsum("dcp,pc->pd", corners[:, :, chosen], weights)

    cases = problems(size)
    with tempfile.TemporaryDirectory() as folder:
        shape = os.path.join(folder, "mesh.ply")
        meshio.write(shape, meshio.Mesh(vertices, [("triangle", faces)]))
        where = os.path.join(folder, "points.csv")
        np.savetxt(where, points, delimiter=",", header="x,y,z", comments="", fmt="%.17g")
        scene = os.path.join(folder, "scene.json")
        with open(scene, "w") as file:
            json.dump({"shapes": [{"name": "mesh", "uri": shape}],
                       "solids": [{"name": "body", "sdf": {"mesh": "mesh"}}],
                       "problems": [dict(p[3], name=n, domain="body") for n, p in cases.items()]},
                      file)
        print("| problem | range | RMS of elements' error | RMS standard error of wisp "
              "| RMS difference | mean z | RMS z |")
        print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
        worst = 0
        for name, (c, g, f, _) in cases.items():
            a, b = (e.at(points, e.run(c, g, f)) for e in (coarse, fine))
            out = os.path.join(folder, "out.csv")
            subprocess.run([args.wisp, "solve", scene, "--problem", name, "--points", where,
                            "--walks", str(args.walks), "--epsilon", str(1e-6 * size), "--quiet",
                            "-o", out], check=True)
            with open(out) as file:
                rows = list(csv.DictReader(file))
            value = np.array([float(r["value"]) for r in rows])
            error = np.array([float(r["std_error"]) for r in rows])
            rms = lambda v: math.sqrt(np.mean(v**2))
            z = (value - b) / np.hypot(error, np.maximum(abs(a - b), rms(a - b)))
            print(f"| {name} | {np.ptp(b):.3g} | {rms(a - b):.1e} | {rms(error):.1e} "
                  f"| {rms(value - b):.1e} | {z.mean():.2f} | {rms(z):.2f} |")
            worst = max(worst, rms(z))
    return 0 if worst < 1.5 else 1


if __name__ == "__main__":
    sys.exit(main())
