#!/usr/bin/env python3
"""The same scene with every options file of input/solvers gives the same trajectory.

    solvers.py DLMFD MPIRUN...

Two spheres in shear on 24 x 16 x 16 cells, at the start and after one step. Positions must agree to 1e-6 of the radius, velocities
(rotations) to 1e-6 of the largest. The same with one periodic axis, where the program's own solver is another.
"""
import csv
import os
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
RADIUS = 0.15
SCENE = ("-box_size 1.5,1,1 -grid_resolution 16 -wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0 "
         f"-sphere_radius {RADIUS} -sphere_centers -0.3,0.02,0.12,0.3,-0.02,-0.12 -sphere_inertia 0 "
         "-ts_dt 0.05 -ts_max_steps 1 -progress_every 1000 -saddle_rtol 1e-8").split()
RUNS = (("exact", "2"), ("hypre", "2"), ("multigrid", "1"), ("multigrid", "2"), ("uzawa", "1"), ("uzawa", "2"))
GROUPS = {"x": RADIUS, "V": None, "omega": None}
TOLERANCE = 1e-6


def run(command, options, folder):
    file = ["-options_file", os.path.join(ROOT, "input", "solvers", options + ".opts")] if options else []
    command = command + SCENE + file + ["-output_dir", folder]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stdout}")
    with open(os.path.join(folder, "trajectory.csv"), newline="") as file:
        return list(csv.DictReader(file))


def differences(rows, exact):
    for group, scale in GROUPS.items():
        columns = [f"{group}{d}" for d in (1, 2, 3)]
        size = scale or max(abs(float(row[c])) for row in exact for c in columns)
        yield max(abs(float(a[c]) - float(b[c])) for a, b in zip(rows, exact) for c in columns) / size


def main():
    program, mpirun = sys.argv[1], sys.argv[2:]
    failed = False
    print("solver      ranks  " + "".join(f"{group:>10}" for group in GROUPS))
    with tempfile.TemporaryDirectory() as folder:
        exact = run([program], "exact", os.path.join(folder, "exact"))
        for solver, ranks in RUNS:
            rows = run(mpirun + ["-n", ranks, program], solver, os.path.join(folder, solver + ranks))
            worst = list(differences(rows, exact))
            print(f"{solver:10}  {ranks:>5}  " + "".join(f"{x:10.1e}" for x in worst), flush=True)
            failed |= len(rows) != len(exact) or not max(worst) <= TOLERANCE
        one_axis = [program, "-box_periodic", "1,0,0"]
        worst = list(differences(run(one_axis, "hypre", os.path.join(folder, "one_hypre")), run(one_axis, None, os.path.join(folder, "one"))))
        print("hypre, one periodic axis" + "".join(f"{x:10.1e}" for x in worst))
        failed |= not max(worst) <= TOLERANCE
    sys.exit(f"more than {TOLERANCE}" if failed else 0)


if __name__ == "__main__":
    main()
