#!/usr/bin/env python3
"""Time and memory of scenes with and without each part of wisp.

    python3 bench/parts/parts.py build/release/apps/wisp/wisp [-o table.md] [--threads 2]

Writes pairs of scenes that differ in one part into a temporary folder, runs `wisp render`
and `wisp solve` on them with --report, the two of a pair in turns, and prints medians of
RUNS runs as a Markdown table. Exit status 1 where a report says that a part is built
which the scene does not need, or does not say that it is built where it is needed.
"""

import argparse
import json
import math
import os
import statistics
import struct
import subprocess
import sys
import tempfile
import zlib

RUNS = 3


def ball(columns, rows, open_top=False):
    """Vertices (position, uv) and triangles of a ball of radius 1 about the origin."""
    vertices, faces = [(0, 0, 1, 0.5, 0)], []
    for i in range(1, rows):
        up = math.pi * i / rows
        for j in range(columns):
            turn = 2 * math.pi * j / columns
            vertices.append((math.sin(up) * math.cos(turn), math.sin(up) * math.sin(turn),
                             math.cos(up), j / columns, i / rows))
    vertices.append((0, 0, -1, 0.5, 1))
    last = len(vertices) - 1
    for j in range(columns):
        k = (j + 1) % columns
        if not open_top:
            faces.append((0, 1 + j, 1 + k))
        for i in range(rows - 2):
            a, b = 1 + i * columns + j, 1 + i * columns + k
            faces += [(a, a + columns, b + columns), (a, b + columns, b)]
        faces.append((1 + (rows - 2) * columns + j, last, 1 + (rows - 2) * columns + k))
    return vertices, faces


def write_ply(path, vertices, faces):
    head = "ply\nformat binary_little_endian 1.0\n"
    head += f"element vertex {len(vertices)}\n"
    head += "".join(f"property float {name}\n" for name in ("x", "y", "z", "u", "v"))
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    with open(path, "wb") as f:
        f.write(head.encode())
        f.write(b"".join(struct.pack("<5f", *v) for v in vertices))
        f.write(b"".join(struct.pack("<B3i", 3, *t) for t in faces))


def write_png(path, size):
    """A colourful image, size by size pixels."""
    rows = []
    for y in range(size):
        row = bytearray(3 * size)
        row[0::3] = bytes((x * 256 // size) for x in range(size))
        row[1::3] = bytes([y * 256 // size]) * size
        row[2::3] = bytes(((x ^ y) & 255) for x in range(size))
        rows.append(b"\0" + bytes(row))

    def chunk(kind, data):
        check = struct.pack(">I", zlib.crc32(kind + data))
        return struct.pack(">I", len(data)) + kind + data + check

    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n")
        f.write(chunk(b"IHDR", struct.pack(">IIBBBBB", size, size, 8, 2, 0, 0, 0)))
        f.write(chunk(b"IDAT", zlib.compress(b"".join(rows), 1)))
        f.write(chunk(b"IEND", b""))


def write_hdr(path, width, height):
    """A sky with a bright spot."""
    with open(path, "wb") as f:
        f.write(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode())
        for y in range(height):
            row = bytearray(bytes((100, 120, 160, 128)) * width)
            if height // 4 < y < height // 4 + height // 50:
                row[0:4 * (width // 50)] = bytes((200, 190, 170, 134)) * (width // 50)
            f.write(bytes(row))


def scene(**more):
    base = {
        "asset": {"version": "5.0"},
        "cameras": [{"name": "default", "lookat": [0, 0.5, 4, 0, 0, 0, 0, 1, 0], "lens": 0.05,
                     "aspect": 1, "film": 0.036}],
        "environments": [{"name": "sky", "emission": [1, 1, 1]}],
        "shapes": [{"name": "ball", "uri": "ball.ply"}],
        "materials": [{"name": "clay", "type": "matte", "color": [0.5, 0.5, 0.5]}],
        "instances": [{"shape": "ball", "material": "clay"}],
    }
    base.update(more)
    return base


def problem(domain, **more):
    return scene(
        solids=[{"name": "round", "sdf": {"sphere": {"radius": 1}}}],
        problems=[{"name": "heat", "domain": domain, "equation": "laplace",
                   "boundary": "x*y + z", "walks": 32}],
        sections=[{"name": "cut", "problem": "heat", "resolution": 64, "range": [-1, 1]}], **more)


HAIR = {"name": "hair", "groom": {"on": "ball", "strands": 20000, "points": 16,
                                  "length": [0.4, 0.6], "radius": [0.003, 0.001], "seed": 1}}
HAIR_MATERIAL = {"name": "brown", "type": "hair"}
LAMP = {"name": "lamp", "type": "matte", "color": [0, 0, 0], "emission": [20, 20, 20]}
RENDER = ["render", "--samples", "4", "--resolution", "256x256"]
SOLVE = ["solve", "--section", "cut"]


def pairs():
    """(part as reports name it, what differs, command, with, without, further arguments)"""
    clay = scene()["materials"]
    hair_shapes = scene()["shapes"] + [HAIR]
    shown_hair = {"shape": "hair", "material": "brown"}
    shown_ball = {"shape": "ball", "material": "clay"}
    both = scene(shapes=hair_shapes, materials=clay + [HAIR_MATERIAL],
                 instances=[shown_ball, shown_hair])
    hair = scene(shapes=hair_shapes, materials=clay + [HAIR_MATERIAL], instances=[shown_hair])
    lamp = scene(materials=clay + [LAMP],
                 instances=[shown_ball, {"shape": "ball", "material": "lamp",
                                         "frame": [.3, 0, 0, 0, .3, 0, 0, 0, .3, 1.5, 1.5, 1.5]}])
    unlit = json.loads(json.dumps(lamp))
    unlit["materials"][1]["emission"] = [0, 0, 0]
    sky = scene(textures=[{"name": "sky", "uri": "sky.hdr"}],
                environments=[{"emission": [1, 1, 1], "emission_tex": 0}])
    textured = scene(textures=[{"name": "wood", "uri": "wood.png"}],
                     materials=[dict(clay[0], color_tex=0)])
    cut = problem("round", instances=[{"section": "cut"}])
    whole = problem("round", instances=[{"solid": "round", "material": "clay"}])
    solid = scene(solids=[{"name": "s", "sdf": {"sphere": {"radius": 1}}}],
                  instances=[{"solid": "s", "material": "clay"}])
    gap = problem("gap")
    gap["shapes"] = [{"name": "gap", "uri": "open.ply"}]
    gap["instances"] = []
    aovs = ["--aovs", "albedo,normal,tangent,depth"]
    return [
        ("curve rays", "20,000 strands on a ball, or the ball alone", RENDER, both, scene(), []),
        ("triangle rays", "the ball under the strands, or these alone", RENDER, both, hair, []),
        ("environment sampler", "a sky of 2048 × 1024 pixels, or one colour", RENDER, sky, scene(),
         []),
        ("light sampler", "a small ball that shines, or does not", RENDER, lamp, unlit, []),
        ("textures", "a colour of 2048² pixels, or one colour", RENDER, textured, scene(), []),
        ("solid meshes", "an implicit ball meshed, or a mesh from a file", RENDER, solid, scene(),
         []),
        ("section textures", "a ball cut open, or whole", RENDER, cut, whole, []),
        ("auxiliary images", "albedo, normal, tangent and depth, or none", RENDER, scene(),
         scene(), aovs),
        ("distance tree", "the inside of a mesh, or of an implicit ball", SOLVE, problem("ball"),
         problem("round"), []),
        ("distance grid", "the same", SOLVE, problem("ball"), problem("round"), []),
        ("winding numbers", "an open mesh, or a closed one", SOLVE, gap, problem("ball"), []),
        ("gradients", "u and its gradient, or u alone", SOLVE, problem("round"), problem("round"),
         ["--gradient"]),
    ]


def run(wisp, folder, command, data, arguments, threads):
    """The report of one run."""
    with open(os.path.join(folder, "scene.json"), "w") as f:
        json.dump(data, f)
    out = "out.exr" if command[0] == "render" else "out.csv"
    line = [wisp, command[0], "scene.json", *command[1:], "-o", out, "--report", "report.json",
            "--quiet", "--threads", str(threads), *arguments]
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(line)}: {done.stderr.strip()}")
    with open(os.path.join(folder, "report.json")) as f:
        return json.load(f)


def find_part(report, name):
    found = [p for p in report["parts"] if p["name"] == name]
    return found[0] if found else None


def total_seconds(report):
    seconds = report["seconds"]
    return seconds if isinstance(seconds, (int, float)) else sum(seconds.values())


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("wisp")
    parser.add_argument("-o", "--out", help="write the table to this file too")
    parser.add_argument("--threads", type=int, default=0)
    args = parser.parse_args()
    wisp, wrong = os.path.abspath(args.wisp), []
    lines = ["| part | with, or without | built in | its bytes | seconds | peak memory, MB |",
             "| --- | --- | ---: | ---: | ---: | ---: |"]
    with tempfile.TemporaryDirectory() as folder:
        write_ply(os.path.join(folder, "ball.ply"), *ball(320, 160))
        write_ply(os.path.join(folder, "open.ply"), *ball(320, 160, True))
        write_png(os.path.join(folder, "wood.png"), 2048)
        write_hdr(os.path.join(folder, "sky.hdr"), 2048, 1024)
        for name, what, command, data, without, more in pairs():
            reports = ([], [])
            for _ in range(RUNS):
                reports[0].append(run(wisp, folder, command, data, more, args.threads))
                reports[1].append(run(wisp, folder, command, without, [], args.threads))
            parts = [find_part(r[0], name) for r in reports]
            for part, expected in zip(parts, (True, False)):
                if part is None:
                    wrong.append(f"{name} ({what}): not in a report")
                elif part["built"] != expected:
                    says = "built" if part["built"] else "left out"
                    wrong.append(f"{name} ({what}): {says}, as '{part['why']}'")
            cells = ["not told", "not told"]
            if parts[0] is not None:
                times = [find_part(r, name)["seconds"] for r in reports[0]]
                cells = [f"{1000 * statistics.median(times):.1f} ms", f"{parts[0]['bytes']:,}"]
            seconds = [statistics.median(map(total_seconds, r)) for r in reports]
            memory = [statistics.median(x["peak_memory_bytes"] for x in r) / 1e6 for r in reports]
            lines.append(f"| {name} | {what} | {cells[0]} | {cells[1]} | "
                         f"{seconds[0]:.2f} / {seconds[1]:.2f} | "
                         f"{memory[0]:.1f} / {memory[1]:.1f} |")
            print(f"{name} done", file=sys.stderr)
    text = "\n".join(lines) + "\n"
    print(text, end="")
    if args.out:
        with open(args.out, "w") as f:
            f.write(text)
    for line in wrong:
        print(f"wrong: {line}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
