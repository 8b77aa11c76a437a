#!/usr/bin/env python3
"""Scenes that are their own mirror image in x2 = 0: half of the box against all of it.

    mirror.py flows DLMFD MPIRUN...     the same flow, fields and stresses to rounding, in every kind of scene and form of C
    mirror.py ranks DLMFD MPIRUN...     half of a box on 1, 2, 3, 4 ranks, cut along every axis
    mirror.py solvers DLMFD MPIRUN...   half of a box, and all of it with other solvers
    mirror.py restart DLMFD MPIRUN...   a leg on half of the box, the next on all of it, and the other way round
    mirror.py rules DLMFD MPIRUN...     what -box_mirror auto takes, and the meshes that it does so for
"""
import os

import numpy

import polymer_runs
from polymer_runs import check, launch, run

SHEAR = " -wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0"
BOX = "-box_size 2,1,1 -grid_resolution 16 -sphere_radius 0.15 -saddle_rtol 1e-13 -ts_dt 0.05 -ts_max_steps 6 -output_fields_every 6 "
PAIR = BOX + "-sphere_centers -0.3,0,0.15,0.3,0,-0.15" + SHEAR
ONE = BOX.replace("2,1,1", "1,1,1") + "-sphere_centers 0.02,0,0.01" + SHEAR
OLDROYD = " -fluid_model oldroyd_b -fluid_relaxation_time 0.5"
SCENES = {
    "pair": PAIR,
    "pair that touches": BOX + "-sphere_centers -0.17,0,0.05,0.17,0,-0.05 -sphere_density 3" + SHEAR,
    "pair, an odd number of pressure cells": PAIR.replace("resolution 16", "resolution 20"),
    "three in a row, one fixed, one turned": BOX + "-spheres_file three.csv" + SHEAR,
    "settling, three periodic axes": BOX + "-box_periodic 1,1,1 -gravity 10,0,-3 -sphere_density 2 -sphere_centers 0.1,0,0.2",
    "walls at x1": BOX.replace("2,1,1", "1,1,2") + "-box_periodic 0,1,1 -wall_velocity_x1_upper 0,0,1 -sphere_centers 0.2,0,0.1",
    "pair, Oldroyd-B": PAIR + OLDROYD,
    "pair, log form, adapted steps": PAIR + OLDROYD + " -polymer_form log -ts_adapt_type scene",
    "pair, explicit, lie, C = I inside": PAIR + OLDROYD + " -polymer_coupling explicit -ts_split_scheme lie -polymer_inside identity -ts_dt 0.02",
    "pair, short sub-steps": PAIR + OLDROYD + " -polymer_courant 0.1",
    "one sphere, near flow": ONE + OLDROYD + " -polymer_inside stokes",
    "one sphere, Carreau": ONE + OLDROYD.replace("oldroyd_b", "carreau") + " -fluid_carreau_n 0.5",
    "no sphere, walls at x1, UCM": BOX.replace("2,1,1", "1,1,2") + "-box_periodic 0,1,1 -wall_velocity_x1_upper 0,0,1 -fluid_model ucm",
}
THREE = "x1,x2,x3,motion,omega2\n-0.6,0,0.1,fixed,0.5\n0,0,-0.2,free,0\n0.5,0,0.15,rotate,0\n"


def across(values, sign):
    """How far a field [x1, x2, x3, component] is from its mirror image; sign: of the components in it."""
    image = values[:, (-numpy.arange(values.shape[1])) % values.shape[1]]  # plane 0 is x2 = -L2/2, its own image
    return abs(image * numpy.array(sign) - values).max()


def compare(found, other):
    """Largest differences over the largest values: path and motion; stress of the suspension; fields."""
    error = {}
    if hasattr(found, "rows"):
        error["spheres"] = abs(found.rows[..., 3:] - other.rows[..., 3:]).max() / max(1.0, abs(other.rows[..., 12:]).max())
    if os.path.exists(os.path.join(found.path, "bulk.csv")):
        error["stress"] = max(abs(found.bulk()[name] - other.bulk()[name]).max() for name in found.bulk() if name not in ("step", "time"))
    for name in ("velocity", "pressure") + (("conformation",) if found.polymer else ()):
        a, b = found.field(name), other.field(name)
        error[name] = abs(a - b).max() / max(1e-3, abs(b).max()) if a.shape == b.shape else float("inf")
    return error


def text(error):
    return ", ".join(f"{name} {value:.0e}" for name, value in error.items())


def write_three():
    with open(os.path.join(polymer_runs.folder, "three.csv"), "w", encoding="utf-8") as file:
        file.write(THREE)


def of(options):
    return options.replace("three.csv", os.path.join(polymer_runs.folder, "three.csv"))


def flows():
    write_three()
    for name, options in SCENES.items():
        half, whole = (run(of(options) + f" -box_mirror {which}") for which in ("half", "whole"))
        error, allowed = compare(half, whole), 1e-7 if half.summary["scene"].get("polymer_inside") == "stokes" and "sphere," in name else 1e-9  # the fit's ridge is not symmetric (V8)
        check(max(error.values()) <= allowed, f"{name}: {text(error)} (allowed {allowed})")
        check(half.summary["nodes"] < 0.6 * whole.summary["nodes"], f"  {half.summary['nodes']} of {whole.summary['nodes']} nodes")
        its = [each.summary["iterations"]["bodies_total"] for each in (half, whole)]
        check(its[0] <= 1.05 * its[1], f"  {its[0]} iterations, {its[1]} in the whole box (allowed 5 % more)")
        image = across(whole.field("velocity"), (1, -1, 1)) / abs(whole.field("velocity")).max()
        check(image <= allowed, f"  the whole velocity and its mirror image: {image:.0e} apart (allowed {allowed})")
    usual, half = run(PAIR + " -box_mirror none"), run(PAIR + " -box_mirror half")
    error = abs(half.rows[-1, :, 3:12] - usual.rows[-1, :, 3:12]).max()
    check(error <= 2e-3, f"pair, on the mesh that other scenes have: {error:.1e} apart (allowed 2e-3)")


def ranks():
    for name in ("pair that touches", "one sphere, near flow", "walls at x1"):
        one = run(SCENES[name] + " -box_mirror half")
        for n, processes in ((2, "0,0,0"), (2, "1,2,1"), (3, "0,0,0"), (4, "1,2,2")):
            error = compare(run(SCENES[name] + f" -box_mirror half -grid_processes {processes}", n), one)
            check(max(error.values()) <= 1e-8, f"{name}, {n} ranks, processes {processes}: {text(error)} (allowed 1e-8)")


def solvers():
    half, tight = run(PAIR + " -ts_max_steps 1 -output_fields_every 1"), " -ts_max_steps 1 -output_fields_every 1 -saddle_rtol 1e-8 "
    for name in ("exact", "hypre", "multigrid", "uzawa"):
        other = run(PAIR + tight + "-options_file " + os.path.join(os.path.dirname(os.path.abspath(__file__)), f"../../input/solvers/{name}.opts"))
        error = abs(other.rows[..., 3:12] - half.rows[..., 3:12]).max()
        check(error <= 1e-6, f"{name}, {other.summary['scene']['box_mirror']} of the box: {error:.0e} from half of it (allowed 1e-6)")


def restart():
    for name in ("pair that touches", "pair, Oldroyd-B", "one sphere, near flow"):
        options = SCENES[name].replace("-ts_max_steps 6", "-ts_max_time 0.3").replace("-output_fields_every 6", "-output_fields_every 1000000")
        unstopped = run(options + " -box_mirror half -checkpoint_every 6")
        for first, second, n in (("half", "whole", 1), ("whole", "half", 2), ("half", "half", 3)):
            leg = run(options + f" -box_mirror {first} -ts_max_steps 3 -checkpoint_every 3")
            code, output, path = launch(options + f" -box_mirror {second} -restart {leg.path}/checkpoint.h5 -checkpoint_every 3", n)
            check(code == 0, f"{name}, {first}, then {second} on {n} ranks: exit code {code}" + (output[-300:] if code else ""))
            found = polymer_runs.Run(path)
            error = abs(found.rows[-1, :, 3:12] - unstopped.rows[-1, :, 3:12]).max()
            check(error <= 1e-9, f"  end of the run: {error:.0e} from that of one leg on half of the box (allowed 1e-9)")
    code, output, _ = launch(options + f" -box_mirror none -restart {leg.path}/checkpoint.h5")
    check(code == 2 and "-box_mirror none cannot go on from" in output, "a leg on another mesh is refused")


def rules():
    small = "-box_size 1,1,1 -grid_resolution 12 -sphere_radius 0.15 -ts_max_steps 1 "
    one = small + "-sphere_centers 0.1,0,0" + SHEAR
    for options, n, expected in (
        (one, 1, "half"), (one, 2, "half"), (small + SHEAR, 1, "half"), (small + "-sphere_centers 0.1,1e-14,0" + SHEAR, 1, "half"), (one + " -box_mirror none", 1, "none"),
        (one + " -box_mirror whole", 1, "whole"), (one + " -pairing_degree 3 -pairing_retraction 0.5", 1, "half"), (one + " -stokes_pc_type dlmstokes", 1, "half"),
        (small + "-sphere_centers 0.1,1e-6,0" + SHEAR, 1, "none"), (small + "-sphere_centers 0.1,0.5,0" + SHEAR, 1, "none"), (one + " -gravity 0,1e-9,0", 1, "none"),
        (one + " -pressure_gradient 0,1,0", 1, "none"), (one + " -wall_velocity_upper 0.5,0.1,0", 1, "none"), (one + " -sphere_omega 0,0,1", 1, "none"),
        (one + " -sphere_torque 1,0,0", 1, "none"), (one + " -sphere_force 0,1,0", 1, "none"), (one + " -sphere_velocity 0,1,0", 1, "none"),
        (one + " -box_periodic 1,0,0", 1, "none"), (small + "-box_periodic 0,1,0", 1, "none"), (one + " -pairing_type collocation", 1, "none"), (one + " -pairing_points volume", 1, "none"),
        (one + " -pairing_degree 0", 1, "none"), (one + " -pairing_retraction 0.5", 1, "none"), (small + SHEAR + OLDROYD + " -polymer_mode_amplitude 0.1 -polymer_mode_plane 12", 1, "none"),
        (one + " -box_size 1,1.1666666666666667,1", 1, "whole"), (one + " -saddle_split velocity", 1, "whole"), (one + " -stokes_pc_type fieldsplit", 1, "whole"),
        (one + " -stokes_block_limit 0", 1, "whole"), (one + " -grid_processes 1,3,1", 3, "whole"),
    ):
        found = run(options, n).summary
        cells = found["scene"]["cells"]
        nodes = (cells[1] // 2 + 1 if expected == "half" else cells[1] + (not found["scene"]["box_periodic"][1]))
        check(found["scene"]["box_mirror"] == expected and found["nodes"] % nodes == 0, f"{options[len(small):]}, {n} ranks: {found['scene']['box_mirror']}, expected {expected}")


if __name__ == "__main__":
    polymer_runs.main({"flows": flows, "ranks": ranks, "solvers": solvers, "restart": restart, "rules": rules})
