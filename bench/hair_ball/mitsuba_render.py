#!/usr/bin/env python3
"""mitsuba_render.py FOLDER COLOR SAMPLES SEED OUT.exr REPORT.json RESOLUTION THREADS

The hair ball by Mitsuba 3, variant llvm_ad_rgb: its fastest on a CPU. Needs
LLVM 19 or newer; DRJIT_LIBLLVM_PATH names its library where it is not found.
"""

import glob
import os
import sys
import time

import ball
import usage

SAMPLES_AT_ONCE = 16  # all pixels of a pass are in memory together


def find_llvm():
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        return
    found = [(int(path.rsplit("-", 1)[1].split(".")[0]), path)
             for path in glob.glob("/usr/lib/*/libLLVM-[0-9][0-9].so")]
    if found and max(found)[0] >= 19:
        os.environ["DRJIT_LIBLLVM_PATH"] = max(found)[1]


def make_scene(mi, folder, color, resolution):
    transform = mi.ScalarTransform4f
    look = transform().look_at(origin=ball.CAMERA["eye"], target=ball.CAMERA["at"],
                               up=ball.CAMERA["up"])
    light = transform().look_at(origin=ball.LIGHT["center"], target=ball.LIGHT["at"],
                                up=[0, 1, 0]) @ transform().scale(ball.LIGHT["half"])

    def rgb(value):
        return {"type": "rgb", "value": list(value)}

    return mi.load_dict({
        "type": "scene",
        "integrator": {"type": "path", "max_depth": ball.BOUNCES + 1, "rr_depth": 5},
        "sensor": {"type": "perspective", "fov": ball.CAMERA["fov"], "to_world": look,
                   "film": {"type": "hdrfilm", "width": resolution, "height": resolution,
                            "rfilter": {"type": "box"}, "pixel_format": "rgb"},
                   "sampler": {"type": "independent"}},
        "sky": {"type": "constant", "radiance": rgb([ball.SKY] * 3)},
        "light": {"type": "rectangle", "to_world": light,
                  "emitter": {"type": "area", "radiance": rgb([ball.LIGHT["radiance"]] * 3)}},
        "head": {"type": "sphere", "radius": ball.HEAD["radius"],
                 "bsdf": {"type": "diffuse", "reflectance": rgb(ball.HEAD["albedo"])}},
        "hair": {"type": "bsplinecurve", "filename": os.path.join(folder, "hair.txt"),
                 "bsdf": {"type": "hair", "longitudinal_roughness": ball.HAIR["beta_m"],
                          "azimuthal_roughness": ball.HAIR["beta_n"],
                          "scale_tilt": ball.HAIR["alpha"], "int_ior": ball.HAIR["eta"],
                          "ext_ior": 1.0, "sigma_a": rgb(ball.COLORS[color])}},
    })


def main(folder, color, samples, seed, out, report, resolution, threads):
    find_llvm()
    import drjit as dr
    import mitsuba as mi
    import numpy as np
    dr.set_thread_count(int(threads))
    mi.set_variant("llvm_ad_rgb")
    samples, seed = int(samples), int(seed)
    scene = make_scene(mi, folder, color, int(resolution))
    before = (time.time(), usage.cpu_seconds())
    total, done = 0.0, 0
    while done < samples:
        count = min(SAMPLES_AT_ONCE, samples - done)
        picture = mi.render(scene, spp=count, seed=seed * 100003 + done)
        total = total + np.array(picture, dtype=np.float64) * count
        done += count
    after = (time.time(), usage.cpu_seconds())
    mi.Bitmap((total / samples).astype(np.float32)).write(out)
    usage.write_report(report, before, after, {"version": mi.__version__})


if __name__ == "__main__":
    if len(sys.argv) != 9:
        sys.exit(__doc__)
    main(*sys.argv[1:])
