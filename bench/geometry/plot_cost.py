#!/usr/bin/env python3
"""plot_cost.py OUT.svg < TABLES: time of a query against the number of triangles.

TABLES is what bench_geometry prints when it is run without arguments. Needs
matplotlib.
"""

import re
import sys

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot  # noqa: E402

ROWS = {
    "closest point, batch": "closest point, batch",
    "bounds, tolerance 0.2, batch": "bounds within 0.2, batch",
    "exact winding number": "exact winding number",
    "fast winding number": "fast winding number",
}


def read(lines):
    sizes, rates = [], {name: {"box": [], "near": []} for name in ROWS}
    for line in lines:
        if found := re.match(r".*, (\d+) triangles", line):
            sizes.append(int(found[1]))
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) == 5 and cells[1] in ROWS:
            rates[cells[1]]["box"].append(float(cells[2]))
            rates[cells[1]]["near"].append(float(cells[3]))
    return sizes, rates


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sizes, rates = read(sys.stdin)
    figure, axes = pyplot.subplots(1, 2, figsize=(9, 3.6), sharey=True)
    for axis, points in zip(axes, ("box", "near")):
        for name, label in ROWS.items():
            axis.loglog(sizes, [1 / rate for rate in rates[name][points]], marker="o", label=label)
        axis.set_title(f"points {'in the box' if points == 'box' else 'near the surface'}")
        axis.set_xlabel("triangles")
        axis.grid(True, which="both", alpha=0.3)
    axes[0].set_ylabel("microseconds a query, one thread")
    axes[1].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(sys.argv[1], metadata={"Date": None})


if __name__ == "__main__":
    main()
