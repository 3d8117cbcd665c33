"""Measures one peer on one mesh; peers.py runs it in a process of its own."""

import ctypes
import gc
import os
import statistics
import time

import numpy as np

import meshes
from libraries import PEERS, Peer

SETS = ("box", "near")
REFERENCE_POINTS = 2000  # of each set


def memory(field):
    with open("/proc/self/status", encoding="ascii") as status:
        for line in status:
            if line.startswith(field + ":"):
                return int(line.split()[1]) * 1024
    return 0


class Memory:
    """Growth of this process from one place to another, without what malloc only keeps."""

    def __init__(self):
        gc.collect()
        ctypes.CDLL(None).malloc_trim(0)
        with open("/proc/self/clear_refs", "w", encoding="ascii") as clear:
            clear.write("5")  # the peak starts again from here
        self.before = memory("VmRSS")

    def report(self):
        peak = memory("VmHWM")
        ctypes.CDLL(None).malloc_trim(0)
        return {"held_bytes": memory("VmRSS") - self.before, "peak_bytes": peak - self.before}


def cpu(function, *arguments):
    start = time.process_time()
    result = function(*arguments)
    return time.process_time() - start, result


def rate(run, points, convert, seconds, repeats, fixed):
    """Queries a CPU second, and how many a batch had; `fixed` seconds of each call do not count."""
    seconds = max(seconds, 0.5 * fixed)  # or the noise of the fixed part would be all one sees
    count = min(len(points), 1000 if fixed > 0 else 64)
    taken = max(cpu(run, convert(points[:count]))[0] - fixed, 1e-5)
    while taken < 0.2 * seconds and count < len(points):
        count = min(len(points), int(count * min(8.0, 0.3 * seconds / taken)) + 1)
        taken = max(cpu(run, convert(points[:count]))[0] - fixed, 1e-5)
    count = max(1, min(len(points), int(count * seconds / taken)))
    batch = convert(points[:count])
    one = convert(points[:1])
    times = []
    for _ in range(repeats):
        # The fixed part right before the whole: other work on the machine slows both.
        fixed = cpu(run, one)[0] if fixed > 0 else 0.0
        times.append(cpu(run, batch)[0] - fixed)
    return count / max(statistics.median(times), 1e-9), count


def errors(peer, task, name, points, exact, diagonal):
    """Against the reference of this mesh: see the top of the file."""
    found = {}
    winding = exact[f"winding_{name}"]
    result = peer.tasks[task](peer, peer.convert(points[:len(winding)]))
    if task in ("closest", "signed"):
        difference = np.abs(peer.distances(result) - exact[f"distance_{name}"])
        found["distance_error"] = float(difference.max() / diagonal)
    if task == "winding":
        found["winding_error"] = float(np.abs(result - winding).max())
    if task in ("inside", "signed") and exact["closed"]:
        inside = peer.inside(result) if task == "signed" else np.array(list(result)) != 0
        # In a fold w may be -1 or 2: what is inside there depends on the definition.
        clear = (np.round(winding) == 0) | (np.round(winding) == 1)
        found["wrong_side"] = int((inside != (winding > 0.5))[clear].sum())
        found["sided_points"] = int(clear.sum())
    return found


def make_reference(args, vertices, triangles, points, path):
    """Exact distances and winding numbers of the first points, and whether it is closed."""
    import igl
    V, F = np.asfortranarray(vertices), np.asfortranarray(triangles, np.int64)
    tree = igl.AABB()
    tree.init(V, F)
    edges = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    forward = np.sort(edges[:, 0] * len(V) + edges[:, 1])
    backward = np.sort(edges[:, 1] * len(V) + edges[:, 0])
    out = {"closed": bool(np.array_equal(forward, backward))}
    for name in SETS:
        P = np.asfortranarray(points[name][:REFERENCE_POINTS])
        out[f"distance_{name}"] = np.sqrt(tree.squared_distance(V, F, P)[0])
        out[f"winding_{name}"] = igl.winding_number(V, F, P)
    np.savez(path, **out)
    return {"closed": out["closed"]}


def build_memory(peer, small, point):
    """The small one goes first: libraries load code and start pools at their first use."""
    point = peer.convert(point)
    for each in (small, peer):
        mark = Memory()
        each.build()
        if each.builds_always:
            next(iter(each.tasks.values()))(each, point)
    return mark.report()


def work(args):
    """One peer on one mesh, or its memory: runs in a process of its own."""
    os.sched_setaffinity(0, {args.core})
    path = args.meshes[0]
    vertices, triangles = meshes.read_mesh(path)
    points = {name: meshes.read_points(path.with_suffix(f".{name}.f64")) for name in SETS}
    if args.worker == "reference":
        return make_reference(args, vertices, triangles, points, args.reference)
    peer = PEERS[args.worker](vertices, triangles)
    if args.memory:
        return build_memory(peer, PEERS[args.worker](vertices, triangles[:64]), points["box"][:1])
    report = {"records": []}
    fixed = 0.0
    repeats = args.repeats
    if peer.builds_always:
        task = next(iter(peer.tasks.values()))
        one = peer.convert(points["box"][:1])
        first = cpu(task, peer, one)[0]
        if first > 3 * args.seconds:
            repeats = min(repeats, 3)
        fixed = statistics.median([first] + [cpu(task, peer, one)[0] for _ in range(repeats - 1)])
        report["build_seconds"] = fixed
    elif type(peer).build is not Peer.build:
        times = [cpu(peer.build)[0] for _ in range(args.repeats)]
        report["build_seconds"] = statistics.median(times)
    exact = np.load(args.reference) if args.reference.exists() else None
    diagonal = float(np.linalg.norm(vertices.max(axis=0) - vertices.min(axis=0)))
    for task, function in peer.tasks.items():
        for name in SETS:
            per_second, count = rate(lambda p, f=function: f(peer, p), points[name], peer.convert,
                                     args.seconds, repeats, fixed)
            record = {"task": task, "points": name, "rate": per_second, "batch": count}
            if exact is not None:
                record.update(errors(peer, task, name, points[name], exact, diagonal))
            report["records"].append(record)
    return report
