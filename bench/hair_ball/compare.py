#!/usr/bin/env python3
"""compare.py FOLDER [options]

CPU seconds to a given error on the hair ball: wisp, Mitsuba 3 and Cycles.

Runs the renderers in turn, several times with differing seeds, each for two
numbers of samples; then measures each renderer against its own long run, as
they differ from each other by some percent in the mean (geometry of curves,
sampling of the width, Russian roulette, the hair model's details).

  error     RMSE over the pixels that see hair or head, and the three channels.
            The reference is the mean of independent runs of M samples in all,
            so that a run of N has MSE = mean((run - reference)^2) M / (N + M).
  target    the RMSE that the CPU seconds are extrapolated to, from the larger
            number of samples with MSE ~ 1 / N. The slope of log MSE over log N
            between the two numbers is printed: it should be near -1.
  CPU       user and system seconds of the rendering phase over all threads, as
            a fixed part (building, compiling kernels) and one for each sample.
  fireflies pixels with a channel above 1 in a run of the smaller number of
            samples of the blond ball (nothing converged comes near 1).

Finished runs in FOLDER are kept: a second call goes on where the first stopped.
Run it with a Python that has mitsuba and numpy (it reads the EXR files with
Mitsuba); --cycles-python is one that has bpy.
"""

import argparse
import json
import os
import pathlib
import platform
import subprocess
import sys

import numpy as np

import ball
import make_scene

HERE = pathlib.Path(__file__).resolve().parent
REFERENCE_SEED = 101  # and up; the measured runs have seeds 1 and up


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[1],
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path, help="for the scene, the runs and the results")
    parser.add_argument("--strands", type=int, default=10000)
    parser.add_argument("--resolution", type=int, default=256)
    parser.add_argument("--samples", default="16,64", help="two numbers, the smaller first")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--reference-samples", type=int, default=1024)
    parser.add_argument("--reference-runs", type=int, default=2)
    parser.add_argument("--target", type=float, default=0.01, help="RMSE")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--colors", default=",".join(ball.COLORS))
    parser.add_argument("--renderers", default="wisp,mitsuba,cycles")
    parser.add_argument("--wisp", default=str(HERE.parents[1] / "build/release/apps/wisp/wisp"))
    parser.add_argument("--mitsuba-python", default=sys.executable)
    parser.add_argument("--cycles-python", default=sys.executable)
    args = parser.parse_args()
    args.samples = [int(n) for n in args.samples.split(",")]
    args.colors = args.colors.split(",")
    args.renderers = args.renderers.split(",")
    if len(args.samples) != 2 or args.samples[0] >= args.samples[1]:
        parser.error("--samples wants two numbers, the smaller first")
    return args


def command(args, renderer, color, samples, seed, out, report):
    if renderer == "wisp":
        return [args.wisp, "render", str(args.folder / f"{color}.json"), "-o", out,
                "--samples", str(samples), "--seed", str(seed),
                "--bounces", str(ball.BOUNCES), "--filter", "box",
                "--resolution", f"{args.resolution}x{args.resolution}",
                "--threads", str(args.threads), "--report", report, "--quiet"]
    python = {"mitsuba": args.mitsuba_python, "cycles": args.cycles_python}[renderer]
    return [python, str(HERE / f"{renderer}_render.py"), str(args.folder), color, str(samples),
            str(seed), out, report, str(args.resolution), str(args.threads)]


def run(args, renderer, color, samples, seed):
    """Renders unless that is done; returns the paths of the picture and its report."""
    name = f"{renderer}_{color}_{args.resolution}px_{samples}spp_seed{seed}"
    out = args.folder / "runs" / f"{name}.exr"
    report = out.with_suffix(".json")
    if not (out.exists() and report.exists()):
        print(f"  {name}", file=sys.stderr, flush=True)
        report.unlink(missing_ok=True)
        words = command(args, renderer, color, samples, seed, str(out), str(report))
        # The shell between keeps this program's memory out of the child's peak.
        done = subprocess.run(["sh", "-c", '"$@"; exit $?', "sh", *words],
                              capture_output=True, text=True)
        if done.returncode != 0 or not out.exists() or not report.exists():
            sys.exit(f"compare.py: this failed: {' '.join(words)}\n{done.stdout}{done.stderr}")
    return out, report


def run_all(args):
    (args.folder / "runs").mkdir(parents=True, exist_ok=True)
    if not (args.folder / "hair.npy").exists():
        make_scene.make_scene(args.strands, args.folder)
    elif len(np.load(args.folder / "hair.npy", mmap_mode="r")) != args.strands:
        sys.exit(f"compare.py: {args.folder} has a ball of another number of strands")
    for renderer in args.renderers:  # compiles kernels, warms the disk's cache
        run(args, renderer, args.colors[0], 1, 0)
    measured = {}
    for repeat in range(args.repeats):
        for samples in args.samples:
            for color in args.colors:
                for renderer in args.renderers:
                    measured.setdefault((renderer, color, samples), []).append(
                        run(args, renderer, color, samples, 1 + repeat))
    references = {}
    for color in args.colors:
        for renderer in args.renderers:
            references[renderer, color] = [
                run(args, renderer, color, args.reference_samples, REFERENCE_SEED + i)[0]
                for i in range(args.reference_runs)]
    return measured, references


def read_picture(mi, path):
    picture = np.array(mi.Bitmap(str(path)), dtype=np.float64)[..., :3]
    if not np.isfinite(picture).all():
        sys.exit(f"compare.py: {path} has pixels that are not finite")
    return picture


def sees_ball(pictures):
    """The sky is constant and the filter a box: all else shows in a long run."""
    return np.any([np.abs(p - ball.SKY).max(axis=-1) > 1e-4 for p in pictures], axis=0)


def measure(args, mi, measured, references):
    results = []
    for color in args.colors:
        means = {r: np.mean([read_picture(mi, p) for p in references[r, color]], axis=0)
                 for r in args.renderers}
        mask = sees_ball(means.values())
        total = args.reference_samples * args.reference_runs
        for renderer in args.renderers:
            row = {"renderer": renderer, "color": color, "pixels": int(mask.sum()),
                   "mean": means[renderer][mask].mean(axis=0).tolist(), "runs": []}
            for samples in args.samples:
                for picture_path, report_path in measured[renderer, color, samples]:
                    picture = read_picture(mi, picture_path)
                    report = json.loads(report_path.read_text())
                    difference = (picture - means[renderer])[mask]
                    row["runs"].append({
                        "samples": samples,
                        "mse": float((difference ** 2).mean() * total / (samples + total)),
                        "cpu_seconds": report["cpu_seconds"]["render"],
                        "peak_memory_bytes": report["peak_memory_bytes"],
                        "bright_pixels": int((picture.max(axis=-1) > 1).sum()),
                    })
            results.append(summarise(args, row))
    return results


def summarise(args, row):
    few, many = args.samples
    at = {n: [r for r in row["runs"] if r["samples"] == n] for n in args.samples}
    mse = {n: np.mean([r["mse"] for r in at[n]]) for n in args.samples}
    cpu = {n: np.median([r["cpu_seconds"] for r in at[n]]) for n in args.samples}
    each = (cpu[many] - cpu[few]) / (many - few)
    fixed = max(0.0, cpu[few] - each * few)
    needed = many * mse[many] / args.target ** 2
    row.update({
        "rmse": {str(n): float(np.sqrt(mse[n])) for n in args.samples},
        "slope": float(np.log(mse[many] / mse[few]) / np.log(many / few)),
        "cpu_seconds_each_sample": float(each), "cpu_seconds_fixed": float(fixed),
        "samples_to_target": float(needed),
        "cpu_seconds_to_target": float(fixed + each * needed),
        "peak_memory_bytes": max(r["peak_memory_bytes"] for r in at[many]),
        "fireflies": float(np.mean([r["bright_pixels"] for r in at[few]])),
    })
    return row


def table(args, results):
    few, many = args.samples
    lines = [f"| ball | renderer | mean | RMSE {few} spp | RMSE {many} spp | slope "
             f"| CPU ms/sample | fixed s | spp to {args.target:g} | CPU s to {args.target:g} "
             "| against wisp | MB | pixels > 1 |",
             "|---|---|" + "---:|" * 11]
    ours = {r["color"]: r["cpu_seconds_to_target"] for r in results if r["renderer"] == "wisp"}
    for r in results:
        ratio = f"{r['cpu_seconds_to_target'] / ours[r['color']]:.2f}" if r["color"] in ours else ""
        lines.append(
            f"| {r['color']} | {r['renderer']} | {np.mean(r['mean']):.4f} "
            f"| {r['rmse'][str(few)]:.4f} | {r['rmse'][str(many)]:.4f} | {r['slope']:.2f} "
            f"| {1000 * r['cpu_seconds_each_sample']:.1f} | {r['cpu_seconds_fixed']:.2f} "
            f"| {r['samples_to_target']:.1f} | {r['cpu_seconds_to_target']:.2f} | {ratio} "
            f"| {r['peak_memory_bytes'] / 1e6:.0f} | {r['fireflies']:.1f} |")
    return "\n".join(lines)


def machine():
    try:
        for line in open("/proc/cpuinfo"):
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.machine()


def main():
    args = parse_arguments()
    import mitsuba as mi
    mi.set_variant("scalar_rgb")
    measured, references = run_all(args)
    results = measure(args, mi, measured, references)
    text = (f"{args.strands} strands, {args.resolution} x {args.resolution} pixels, "
            f"{args.threads} threads, {machine()}; {args.repeats} runs each, references of "
            f"{args.reference_runs} x {args.reference_samples} samples.\n\n"
            + table(args, results) + "\n")
    (args.folder / "results.json").write_text(json.dumps(results, indent=1) + "\n")
    (args.folder / "results.md").write_text(text)
    print(text, end="")


if __name__ == "__main__":
    main()
