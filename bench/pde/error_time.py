#!/usr/bin/env python3
"""Error against time of sections, for problems with known solutions.

    python3 bench/pde/error_time.py build/release/apps/wisp/wisp [--mesh MESH] [-o SVG]

Solves the same section on one thread with 4 to 256 walks for each point (balls that are
shared make four times as many):
by walks of its own for each cell, without any reduction of variance; with opposite first
directions and control variates; and with walks that are shared. Errors are against the
exact solution, over all cells; seconds are those of the walks (medians of three runs with
different seeds). Prints a table with the slope of log error over log time and the time to
a given error relative to the first way, and draws it (needs Matplotlib).
"""

import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile

WAYS = {
    "independent walks": "independent,random,plain",
    "opposite directions, control variates": "independent,antithetic,control_variates",
    "shared walks": "share",
}
TORI = {"smooth_union": [
    {"torus": {"normal": [0, 1, 0], "major": 1, "minor": 0.38}},
    {"torus": {"normal": [1, 0, 0], "major": 1, "minor": 0.38}}], "blend": 0.3}


def problems(s):
    """In a domain of about the size of 1 / s."""
    harmonic = f"exp(3*{s}*x)*sin(3*{s}*y) + {s}*z"
    product = f"cos(3*{s}*x)*exp({s}*y)"
    wave = f"cos({s}*x + 2*{s}*y + 1)"
    r2 = f"{s * s}*(x^2 + y^2 + z^2)"
    return {
        "Laplace": {"equation": "laplace", "boundary": harmonic, "exact": harmonic},
        "Poisson": {"equation": "poisson", "boundary": product, "exact": product,
                    "source": f"-8*{s * s}*{product}"},
        "screened": {"equation": "screened_poisson", "screening": 30 * s * s, "boundary": wave,
                     "exact": wave, "source": f"-35*{s * s}*{wave}"},
        "biharmonic": {"equation": "biharmonic", "boundary": f"{r2}*{s * s}*(x^2 - y^2)",
                       "boundary_laplacian": f"14*{s ** 4}*(x^2 - y^2)",
                       "exact": f"{r2}*{s * s}*(x^2 - y^2)"},
    }


def scene(mesh, scale, origin):
    solid = {"mesh": "mesh"} if mesh else TORI
    return {
        "asset": {"version": "5.0"},
        "shapes": [{"name": "mesh", "uri": os.path.abspath(mesh)}] if mesh else [],
        "solids": [{"name": "body", "sdf": solid}],
        "problems": [dict(p, name=name, domain="body") for name, p in problems(scale).items()],
        "sections": [{"name": name, "problem": name, "origin": origin, "normal": [0, 0, 1],
                      "resolution": 200} for name in problems(scale)],
    }


def measure(wisp, path, name, way, walks, folder):
    seconds, errors, claimed = [], [], []
    for seed in range(3):
        report = os.path.join(folder, "report.json")
        subprocess.run([wisp, "solve", path, "--section", name, "--problem", name, "--estimator",
                        WAYS[way], "--walks", str(walks), "--threads", "1", "--seed", str(seed),
                        "--quiet", "--report", report, "-o", os.path.join(folder, "out.csv")],
                       check=True)
        with open(report) as file:
            r = json.load(file)
        seconds.append(r["seconds"]["solve"])
        errors.append(r["rmse"])
        claimed.append(r["error"])
    rms = math.sqrt(statistics.fmean(e * e for e in errors))
    return statistics.median(seconds), rms, math.sqrt(statistics.fmean(e * e for e in claimed))


def slope(points):
    xs = [math.log(t) for t, _, _ in points]
    ys = [math.log(e) for _, e, _ in points]
    mx, my = statistics.fmean(xs), statistics.fmean(ys)
    return sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / sum((x - mx) ** 2 for x in xs)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("wisp")
    parser.add_argument("--mesh", help="a closed mesh in place of the tori")
    parser.add_argument("--scale", type=float, default=1, help="one over the size of the mesh")
    parser.add_argument("--origin", type=float, nargs=3, default=[0, 0, 0.05])
    parser.add_argument("--walks", type=int, nargs="+", default=[4, 16, 64, 256])
    parser.add_argument("-o", "--output", help="an .svg or .png")
    args = parser.parse_args()

    found = {}
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "scene.json")
        with open(path, "w") as file:
            json.dump(scene(args.mesh, args.scale, args.origin), file)
        for name in problems(1):
            for way in WAYS:
                found[name, way] = [measure(args.wisp, path, name, way, w, folder)
                                    for w in args.walks]
                print(f"{name}, {way}: done", file=sys.stderr)

    print("| equation | | RMSE at the most walks | said | slope | time to an error, relative |")
    print("| --- | --- | ---: | ---: | ---: | ---: |")
    for name in problems(1):
        base = found[name, "independent walks"][-1]
        for way in WAYS:
            points = found[name, way]
            t, e, said = points[-1]
            ratio = (t * e * e) / (base[0] * base[1] ** 2)
            print(f"| {name} | {way} | {e:.2g} | {said:.2g} | {slope(points):.2f} "
                  f"| 1 / {1 / ratio:.1f} |")

    if args.output:
        import matplotlib
        matplotlib.use("Agg")
        from matplotlib import pyplot
        figure, axes = pyplot.subplots(1, 4, figsize=(13, 3.6), sharey=False)
        for ax, name in zip(axes, problems(1)):
            for way, mark in zip(WAYS, "osD"):
                ax.loglog([t for t, _, _ in found[name, way]],
                          [e for _, e, _ in found[name, way]], marker=mark, ms=4, label=way)
            ax.set_title(name)
            ax.set_xlabel("seconds, one thread")
            ax.grid(True, which="both", alpha=0.25)
        axes[0].set_ylabel("RMSE over the section")
        axes[0].legend(fontsize=7)
        figure.tight_layout()
        figure.savefig(args.output)


if __name__ == "__main__":
    main()
