#!/usr/bin/env python3
"""Short scenes that must not depend on what has no meaning: ranks, the place of the periodic face, the frame of the walls.

    run_scenes.py ranks DLMFD MPIRUN...      a pair and a settling sphere on 1, 2, 3, 4 ranks
    run_scenes.py crossing DLMFD MPIRUN...   a sphere that crosses the periodic face, against the same scene shifted by half a box
    run_scenes.py walls DLMFD MPIRUN...      walls (U/2, -U/2), (U, 0) and (0, -U): the same relative path
    run_scenes.py outputs DLMFD MPIRUN...    the files a run leaves, with and without fields
    run_scenes.py adapt DLMFD MPIRUN...      steps that suit the scene: the path of small equal steps in fewer of them

Differences of positions are counted in radii, others against the largest value of their kind.
"""
import csv
import json
import math
import os
import subprocess
import sys
import tempfile

import numpy

HERE = os.path.dirname(os.path.abspath(__file__))
GROUPS = {"x": slice(3, 6), "V": slice(6, 9), "omega": slice(9, 12), "F": slice(12, 15), "T": slice(15, 18), "S": slice(18, 24)}
TIGHT = " -saddle_rtol 1e-11 -progress_every 1000"
RADIUS = 0.15
SHEAR = " -wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0"
PAIR = f"-box_size 2,1,1 -grid_resolution 16 -sphere_radius {RADIUS} -ts_dt 0.1 -ts_max_time 1 -ts_split_scheme strang" + TIGHT
MEETING = " -sphere_centers -0.3,0.02,0.15,0.3,-0.02,-0.15"
SETTLING = (f"-box_size 1.5,1.5,1.5 -grid_resolution 16 -sphere_radius {RADIUS} -sphere_density 2 -gravity 300,100,-50 -sphere_centers 0.6,0.7,0.5"
            " -ts_dt 0.02 -ts_max_time 0.3" + TIGHT)
PROGRAM, MPIRUN, FOLDER = "", [], ""


def run(name, options, ranks=1):
    """The columns of trajectory.csv by step and sphere; the folder of the run is FOLDER/name."""
    command = MPIRUN + ["-n", str(ranks), PROGRAM] + options.split() + ["-output_dir", os.path.join(FOLDER, name)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stdout}")
    with open(os.path.join(FOLDER, name, "trajectory.csv"), newline="") as file:
        rows = [[float(x) for x in row] for row in list(csv.reader(file))[1:]]
    spheres = 1 + int(max(row[2] for row in rows))
    return numpy.array(rows).reshape(-1, spheres, 24)


def difference(a, b, groups):
    """Largest difference of each group of columns."""
    result = {}
    for group in groups:
        part = GROUPS[group]
        size = RADIUS if group == "x" else max(abs(b[..., part]).max(), 1e-3)
        result[group] = abs(a[..., part] - b[..., part]).max() / size
    return result


def report(what, found, limit):
    print(f"{what}: " + ", ".join(f"{group} {value:.1e}" for group, value in found.items()), flush=True)
    return max(found.values()) <= limit


def ranks():
    good = True
    for name, scene in (("pair", PAIR + SHEAR + MEETING), ("pair without inertia", PAIR + SHEAR + MEETING + " -sphere_inertia 0"), ("settling", SETTLING)):
        one = run(name.replace(" ", "_") + "1", scene)
        if name == "settling":
            path = numpy.ptp(one[:, 0, 3:6], axis=0)
            print(f"settling: the sphere moves by {path} in a box of 1.5, from 0.6, 0.7, 0.5")
            good &= one[-1, 0, 3] > 0.75 and one[-1, 0, 4] > 0.75  # both periodic faces are crossed
        for n in (2, 3, 4):
            good &= report(f"{name}, {n} ranks", difference(run(f"{name.replace(' ', '_')}{n}", scene, n), one, GROUPS), 1e-8)
    return good


def crossing():
    good = True
    for name, inertia in (("inertia", 1), ("no inertia", 0)):
        scene = PAIR.replace("-ts_max_time 1", "-ts_max_time 3") + SHEAR + f" -sphere_inertia {inertia}"
        here = run(f"here{inertia}", scene + " -sphere_centers 0.77,0.4,0.22,-0.63,0.43,0.15", 2)
        # half a box in x1 and x2: 8 and 4 times 2h; the first sphere is then inside, the second one's image is
        there = run(f"there{inertia}", scene + " -sphere_centers -0.23,-0.1,0.22,0.37,-0.07,0.15", 2)
        x1 = here[:, 0, 3]
        print(f"{name}: x1 runs from {x1[0]:.3f} to {x1[-1]:.3f}, face at 1")
        good &= bool((numpy.diff(x1)[inertia:] > 0).all() and x1[-1] > 1)
        shifted = there.copy()
        shifted[:, 0, 3:6] += (1.0, 0.5, 0.0)
        shifted[:, 1, 3:6] += (-1.0, 0.5, 0.0)
        good &= report(f"shifted by half a box, {name}", difference(here, shifted, GROUPS), 1e-8)
    return good


def walls():
    good = True
    scene = PAIR + MEETING + " -sphere_inertia 0"
    middle = run("middle", scene + SHEAR)
    for name, lower, upper in (("upper", 0.0, 1.0), ("lower", -1.0, 0.0)):
        moving = run(name, scene + f" -wall_velocity_lower {lower},0,0 -wall_velocity_upper {upper},0,0")
        drift = (lower + upper) / 2
        moving[..., 3] -= drift * moving[..., 1]
        moving[..., 6] -= drift
        good &= report(f"only the {name} wall moves, drift taken away", difference(moving, middle, GROUPS), 1e-6)
        relative = (moving[:, 0] - moving[:, 1]) - (middle[:, 0] - middle[:, 1])
        good &= report("  relative path", {"x": abs(relative[:, 3:6]).max() / RADIUS}, 1e-6)
    return good & turning()


def turning():
    """A sphere that stays where it is and turns beside a wall has the friction of the gap; torque against 8 pi mu a^3 (0.3817 - (2/5) ln gap) of Goldman, Cox and Brenner (1967)."""
    gap, torque = 0.02, {}
    scene = f"-box_size 1,1,1 -grid_resolution 32 -sphere_radius 0.1 -sphere_centers 0,0,{-0.4 + 0.1 * gap} -sphere_motion fixed -sphere_omega 0,1,0 -ts_max_steps 0 -sphere_inertia 0 -lubrication "
    for lubrication in ("auto", "false"):
        torque[lubrication] = -run("turning_" + lubrication, scene + lubrication)[-1, 0, 16] / (8 * math.pi * 0.1**3)
    exact = 0.3817 - 0.4 * math.log(gap)
    print(f"sphere that turns at a gap of {gap} a: torque {torque['auto'] / exact - 1:+.1%} off (allowed 3 %), {torque['false'] / exact - 1:+.1%} without friction")
    return abs(torque["auto"] / exact - 1) <= 0.03 and torque["false"] / exact < 0.85


def outputs():
    scene = PAIR + SHEAR + MEETING + " -ts_max_steps 4"
    run("fields", scene + " -output_fields_every 2", 2)
    run("none", scene + " -output_fields_every 0", 2)
    subprocess.run([sys.executable, os.path.join(HERE, "check_xdmf.py"), os.path.join(FOLDER, "fields", "fields.xmf"), "--steps", "3"], check=True)
    kept = sorted(os.listdir(os.path.join(FOLDER, "none")))
    print(f"without fields: {kept}")
    good = kept == ["bulk.csv", "summary.json", "trajectory.csv"]
    for name in ("fields", "none"):
        with open(os.path.join(FOLDER, name, "summary.json")) as file:
            summary = json.load(file)
        print(f"{name}: {summary['steps']} steps to t = {summary['time']} on {summary['ranks']} ranks, slip {summary['largest_slip']:.1e}")
        good &= summary["steps"] == 4 and abs(summary["time"] - 0.4) < 1e-12 and summary["ranks"] == 2 and summary["scheme"] == "strang"
        good &= summary["scene"]["n_spheres"] == 2 and summary["largest_slip"] < 1e-9 and abs(summary["largest_divergence"]) < 1e-9
    # every second step, and the last one
    sparse = run("sparse", scene + " -output_every 3", 2)
    every = run("every", scene, 2)
    good &= [int(step) for step in every[:, 0, 0]] == [0, 1, 2, 3, 4] and bool((abs(numpy.diff(every[:, 0, 1]) - 0.1) < 1e-12).all())
    steps = [int(step) for step in sparse[:, 0, 0]]
    print(f"-output_every 3 of 4 steps: rows of steps {steps}")
    good &= steps[:2] == [0, 3] and bool((sparse[1] == every[3]).all())
    return good


def adapt():
    """Two spheres pass each other. The default tolerance, a tighter one, a first step that must be rejected, two ranks, Oldroyd-B fluid."""
    base = PAIR.replace(TIGHT, " -progress_every 1000") + SHEAR + MEETING + " -sphere_inertia 0 -ts_max_time 3"
    scene = base + " -ts_adapt_type scene -ts_dt 0.05"
    fine = run("equal", base + " -ts_dt 0.05 -saddle_rtol 1e-9")[-1]
    good = True

    def path(name, options, allowed, most_steps, ranks=1, reference=fine):
        found = run(name, options, ranks)
        steps, apart = len(found) - 1, abs(found[-1, :, 3:6] - reference[:, 3:6]).max() / RADIUS
        print(f"{name}: {steps} steps (at most {most_steps}), {apart:.1e} radii from {reference[0, 0]:.0f} equal ones (allowed {allowed:g})", flush=True)
        return bool(steps <= most_steps and apart <= allowed and abs(found[-1, 0, 1] - 3) < 1e-12)

    good &= path("adapted", scene, 5e-3, 35)
    good &= path("tighter", scene + " -ts_rtol 1e-4", 1e-3, 80)
    good &= path("first_step_too_long", scene + " -ts_dt 1", 5e-3, 35)
    with open(os.path.join(FOLDER, "first_step_too_long", "summary.json")) as file:
        rejected = json.load(file)["steps_rejected"]
    print(f"  {rejected} steps rejected (at least 1)")
    good &= rejected >= 1
    one, two = (run(f"ranks{n}", scene + " -saddle_rtol 1e-11", n) for n in (1, 2))
    good &= len(one) == len(two) and report("1 and 2 ranks", difference(two, one, GROUPS), 1e-7)
    polymer = base + " -fluid_model oldroyd_b -fluid_relaxation_time 0.5"
    fine = run("polymer_equal", polymer + " -ts_dt 0.02 -saddle_rtol 1e-8")[-1]
    good &= path("polymer_adapted", polymer + " -ts_adapt_type scene -ts_dt 0.02", 1.5e-2, 75, reference=fine)
    good &= path("polymer_tighter", polymer + " -ts_adapt_type scene -ts_dt 0.02 -ts_rtol 3e-4", 1e-2, 85, reference=fine)
    return good


if __name__ == "__main__":
    PROGRAM, MPIRUN = sys.argv[2], sys.argv[3:]
    with tempfile.TemporaryDirectory() as FOLDER:
        sys.exit(0 if {"ranks": ranks, "crossing": crossing, "walls": walls, "outputs": outputs, "adapt": adapt}[sys.argv[1]]() else 1)
