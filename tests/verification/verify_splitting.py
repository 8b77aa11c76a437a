#!/usr/bin/env python3
"""Orders of the splitting schemes on a pair of spheres between two walls.

    verify_splitting.py DLMFD

Without inertia, lie and strang at three time steps against strang at a fine one; with inertia, the same. The error is the largest
distance of a sphere from where the fine run has it, over the times that all runs share. Fails where an order falls short.
"""
import csv
import math
import os
import subprocess
import sys
import tempfile

STEPS = (0.2, 0.1, 0.05)
FINE = 0.0125
END = 2.0
# Spheres at a/h = 2.4 that climb over each other meanwhile. They start at rest: under inertia their relaxation time (2/9) rho a^2/mu is
# 0.5, which every step resolves (that of neutral spheres, 0.005, none would).
SCENE = {
    "box_size": "3,2,1", "grid_resolution": "16", "wall_velocity_lower": "-0.5,0,0", "wall_velocity_upper": "0.5,0,0",
    "sphere_radius": "0.15", "sphere_centers": "-0.3,0.02,0.15,0.3,-0.02,-0.15", "sphere_density": "100", "contact_range": "0", "progress_every": "1000",
    "saddle_rtol": "1e-8", "ts_max_time": str(END),
}
LEAST = {("0", "lie"): 0.9, ("0", "strang"): 1.8, ("1", "lie"): 0.9, ("1", "strang"): 1.7}


def run(program, folder, scheme, dt, inertia):
    """Positions of all spheres, in a row, by time."""
    options = dict(SCENE, ts_split_scheme=scheme, ts_dt=repr(dt), sphere_inertia=inertia, output_dir=os.path.join(folder, f"{scheme}_{dt}_{inertia}"))
    command = [program] + [word for key, value in options.items() for word in ("-" + key, value)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stdout}")
    at = {}
    with open(os.path.join(options["output_dir"], "trajectory.csv"), newline="") as file:
        for row in csv.DictReader(file):
            at.setdefault(round(float(row["time"]), 9), []).append([float(row[x]) for x in ("x1", "x2", "x3")])
    return at


def error(at, fine):
    times = [round(STEPS[0] * k, 9) for k in range(1, round(END / STEPS[0]) + 1)]
    return max(math.dist(a, b) for t in times for a, b in zip(at[t], fine[t]))


def main():
    program, failed = sys.argv[1], []
    print("inertia  scheme " + "".join(f"  dt = {dt:<6g}" for dt in STEPS) + "  orders")
    with tempfile.TemporaryDirectory() as folder:
        for inertia in ("0", "1"):
            fine = run(program, folder, "strang", FINE, inertia)
            for scheme in ("lie", "strang"):
                errors = [error(run(program, folder, scheme, dt, inertia), fine) for dt in STEPS]
                orders = [math.log2(a / b) for a, b in zip(errors, errors[1:])]
                least = LEAST[inertia, scheme]
                print(f"{inertia:>7}  {scheme:6} " + "".join(f"  {e:<11.3e}" for e in errors) + "  " + ", ".join(f"{o:.2f}" for o in orders)
                      + f"  (at least {least})", flush=True)
                if not min(orders) >= least:
                    failed.append(f"{scheme} {'with' if inertia == '1' else 'without'} inertia: order {min(orders):.2f}, at least {least} expected")
    if failed:
        sys.exit("\n".join(failed))


if __name__ == "__main__":
    main()
