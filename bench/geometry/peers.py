#!/usr/bin/env python3
"""peers.py MESH.ply ... [--json FILE] [options]

Closest points, winding numbers and inside tests of other libraries, one thread:
fcpw, libigl and open3d from PyPI, and Embree's point query by --embree PROGRAM
(built from embree_point_query.cpp). Leaves out what is not installed, and says so.

Beside each MESH.ply lie MESH.box.f64 and MESH.near.f64 (see make_meshes.py).

  one thread  each measurement is a process of its own, bound to one core by
              sched_setaffinity before it loads its library, so that thread pools
              that ask for the number of cores get 1, and with OMP_NUM_THREADS=1;
              open3d is told nthreads = 1 as well.
  rate        million queries in a second of CPU time (user and system, all
              threads): on a busy machine CPU time is disturbed less than the
              clock. Batches from the start of the points file, as many as take
              about --seconds (or half as long as a build, where each call has one);
              the median of --repeats (of 3 where each call builds for long).
  build       CPU seconds, the median of --repeats. libigl's fast winding number
              and signed distance build their trees in every call: for these a
              call with one point counts as the build, and is taken off the others.
  memory      of one build in a fresh process: `held` is the growth of the
              resident memory after it, `peak` the largest on the way. The mesh as
              the caller's arrays is there before and not counted.
  error       of distances: the largest |d - exact| over the diagonal, exact being
              libigl's AABB tree in double; of winding numbers: the largest
              |w - exact|, exact being igl.winding_number, the sum of all solid
              angles by a hierarchy that loses nothing; of inside tests: how many
              points are on the wrong side (closed meshes, where w is 0 or 1). All over the first
              2000 points of both files. libigl's "signed winding" returns the
              distance times 1 - 2w, w not rounded: that shows in its error.
  left out    the time of igl.winding_number above 300,000 triangles, where its
              hierarchy takes many seconds to build, in every call.

The table goes to the terminal, every number to the JSON file.
"""

import argparse
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
from importlib import metadata

import numpy as np

import meshes
from libraries import PEERS
from measure import SETS, work


def in_process(args, worker, path, reference, *more):
    command = [sys.executable, __file__, str(path), "--worker", worker, "--core", str(args.core),
               "--reference", str(reference), "--seconds", str(args.seconds),
               "--repeats", str(args.repeats), *more]
    done = subprocess.run(command, capture_output=True, text=True,
                          env={**os.environ, "OMP_NUM_THREADS": "1"}, check=False)
    try:
        return json.loads(done.stdout.strip().split("\n")[-1])
    except ValueError:
        last = (done.stderr.strip().split("\n") or [""])[-1]
        return {"failed": f"ended with {done.returncode}: {last}"}


def embree(args, path, reference):
    """embree_point_query prints the same fields; its distances come in files."""
    with tempfile.TemporaryDirectory() as folder:
        out = {name: pathlib.Path(folder) / f"{name}.f64" for name in SETS}
        command = [str(args.embree), str(path), *(str(path.with_suffix(f".{n}.f64")) for n in SETS),
                   "--seconds", str(args.seconds), "--repeats", str(args.repeats),
                   "--distances", *(str(out[name]) for name in SETS)]
        done = subprocess.run(command, capture_output=True, text=True, check=False,
                              preexec_fn=lambda: os.sched_setaffinity(0, {args.core}))
        if done.returncode != 0:
            return {"failed": done.stderr.strip()}
        report = json.loads(done.stdout)
        if reference.exists():
            exact = np.load(reference)
            for record in report["records"]:
                known = exact[f"distance_{record['points']}"]
                mine = np.fromfile(out[record["points"]])[:len(known)]
                record["distance_error"] = float(
                    np.abs(mine - known[:len(mine)]).max() / report["diagonal"])
        return report


def rows(report):
    """Table rows of one peer on one mesh: a task each."""
    megabytes = [f"{report[key] / 1e6:.1f}" if key in report else ""
                 for key in ("held_bytes", "peak_bytes")]
    build = f"{report['build_seconds']:.3f}" if "build_seconds" in report else ""
    for task in dict.fromkeys(record["task"] for record in report["records"]):
        records = {r["points"]: r for r in report["records"] if r["task"] == task}
        cells = [f"{records[name]['rate'] / 1e6:.3g}" for name in SETS]
        said = []
        for key in ("distance_error", "winding_error"):
            if any(key in r for r in records.values()):
                said.append(f"{max(r[key] for r in records.values()):.1e}")
        wrong = [r for r in records.values() if "wrong_side" in r]
        if wrong:
            said.append(f"{sum(r['wrong_side'] for r in wrong)} of "
                        f"{sum(r['sided_points'] for r in wrong)} wrong")
        yield [report["peer"], task, *cells, build, "; ".join(said), *megabytes]
        build, megabytes = "", ["", ""]


def print_table(title, lines):
    head = ["peer", "task", "box M/s", "near M/s", "build s", "error", "held MB", "peak MB"]
    lines = [head, ["---"] * len(head), *lines]
    width = [max(len(line[i]) for line in lines) for i in range(len(head))]
    print(f"\n{title}\n")
    for line in lines:
        print("| " + " | ".join(cell.ljust(w) for cell, w in zip(line, width)) + " |")
    sys.stdout.flush()


def processor():
    with open("/proc/cpuinfo", encoding="utf-8") as lines:
        names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def installed(module):
    try:
        return metadata.version({"igl": "libigl"}.get(module, module))
    except metadata.PackageNotFoundError:
        return None


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 2)[2],
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="+", type=pathlib.Path, metavar="MESH.ply")
    parser.add_argument("--json", type=pathlib.Path, default=None)
    parser.add_argument("--seconds", type=float, default=0.3, help="CPU time of one batch")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--core", type=int, default=max(os.sched_getaffinity(0)))
    parser.add_argument("--peers", default=",".join([*PEERS, "embree"]),
                        help="names as in the table, with commas between them")
    parser.add_argument("--embree", type=pathlib.Path, help="the program embree_point_query")
    parser.add_argument("--memory", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--worker", help=argparse.SUPPRESS)
    parser.add_argument("--reference", type=pathlib.Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    for path in args.meshes:
        for file in (path, *(path.with_suffix(f".{name}.f64") for name in SETS)):
            if not file.exists():
                parser.error(f"{file} is missing; make_meshes.py writes meshes with their points")
    args.peers = args.peers.split(",")
    unknown = [name for name in args.peers if name not in PEERS and name != "embree"]
    if unknown:
        parser.error(f"no peer '{unknown[0]}'; there are {', '.join([*PEERS, 'embree'])}")
    if args.seconds <= 0 or args.repeats < 1:
        parser.error("--seconds and --repeats want to be positive")
    return args


def main():
    args = parse_arguments()
    if args.worker:
        print(json.dumps(work(args)))
        return
    versions = {module: installed(module) for module in ("fcpw", "igl", "open3d")}
    for module, version in versions.items():
        print(f"{module}: {version or 'not installed, left out'}")
    result = {"machine": processor(), "core": args.core,
              "versions": versions, "seconds": args.seconds, "repeats": args.repeats, "meshes": []}
    for path in args.meshes:
        with tempfile.TemporaryDirectory() as folder:
            reference = pathlib.Path(folder) / "reference.npz"
            triangles = len(meshes.read_mesh(path)[1])
            entry = {"mesh": path.stem, "triangles": triangles, "peers": [],
                     "load_average": os.getloadavg()[0]}
            if versions["igl"]:
                entry.update(in_process(args, "reference", path, reference))
            for name in args.peers:
                if name == "embree":
                    if not args.embree:
                        continue
                    report = embree(args, path, reference)
                elif not versions[PEERS[name].module] or (
                        name == "libigl exact winding" and triangles > 300000):
                    continue
                else:
                    report = in_process(args, name, path, reference)
                    report.update(in_process(args, name, path, reference, "--memory"))
                entry["peers"].append({"peer": name, **report})
            lines = [row for report in entry["peers"] if "failed" not in report
                     for row in rows(report)]
            closed = {True: ", closed", False: ", open"}.get(entry.get("closed"), "")
            print_table(f"{path.stem}: {triangles} triangles{closed}", lines)
            for report in entry["peers"]:
                if "failed" in report:
                    print(f"{report['peer']} {report['failed']}")
        result["meshes"].append(entry)
        if args.json:
            args.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
