#!/usr/bin/env python3
"""Runs the scenes of input/ and compares single solves with reference values.

    inputs.py run DLMFD MPIRUN...       every input/*.yaml, coarsened, for a few steps on two ranks; every command line in its header on one
    inputs.py frames DLMFD MPIRUN...    pairs between walls (-1/2, 1/2) and (0, 1) move alike
    inputs.py NUMBERS DLMFD MPIRUN...   a group of NUMBERS below, on one rank: the motion of one sphere against its exact value
"""
import concurrent.futures
import csv
import glob
import json
import math
import os
import re
import shlex
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
RANKS = "2"
STEPS = 2
# Coarse enough to take seconds: cells per unit length, where the scene's spheres allow it.
COARSE = 16
COARSE_OF = {}
HEADER = "step,time,sphere,x1,x2,x3,V1,V2,V3,omega1,omega2,omega3,F1,F2,F3,T1,T2,T3,S11,S12,S13,S22,S23,S33"
COMMAND = re.compile(r"^#\s+dlmfd (input/\S+\.yaml.*)$")

# One solve without inertia gives the velocities of spheres that balance their forces at the start.
SOLVE = "-sphere_inertia 0 -ts_max_steps 0 "
ROTATION = "input/rotation_newtonian.yaml "
SETTLING = "input/sedimentation.yaml -grid_resolution "
STOKES = 2 / 9 * 0.5 * 980.665 * 0.1**2
SPIN = "-box_size 2,2,2 -sphere_centers 0,0,0 -sphere_motion fixed -sphere_omega 0,1,0 -grid_resolution "
TORQUE = -8 * math.pi * 0.1**3
SHEARED = "-box_size 2,2,2 -sphere_motion rotate -wall_velocity_lower -1,0,0 -wall_velocity_upper 1,0,0 -grid_resolution "
STRESSLET = 10 / 3 * math.pi * 0.1**3 * 1.0009  # walls and images: 0.9 a^3
BESIDE_A_NODE = " -sphere_centers 0.0125,0.029,0.004"
OFF_CENTRE = ("-box_size 3,2,1 -sphere_centers 0,0,0.2 -wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0 "
              "-grid_resolution ")


def walls(height):
    return f"-box_size 2,2,{height} -wall_velocity_lower {-height / 2},0,0 -wall_velocity_upper {height / 2},0,0"


# group: (command line, {column: (exact value, relative tolerance)}, {column: most of its absolute value})
STILL = {"omega1": 1e-3, "omega3": 1e-3}
NUMBERS = {
    "rotation": [
        (ROTATION + walls(1), {"omega2": (0.494559, 0.002)}, STILL),
        (ROTATION + walls(2), {"omega2": (0.499266, 0.002)}, STILL),
    ],
    "rotation_tall": [
        (ROTATION + walls(6), {"omega2": (0.498360, 0.005)}, STILL),
    ],
    "off_centre": [
        (OFF_CENTRE + "24", {"V1": (0.202636, 0.005), "omega2": (0.494973, 0.005)}, {}),
        (OFF_CENTRE + "32", {"V1": (0.202636, 0.005), "omega2": (0.494973, 0.005)}, {}),
    ],
    "settling": [
        (SETTLING + "24", {"V1": (-1.010834 * STOKES, 0.003)}, {}),
        (SETTLING + "24" + BESIDE_A_NODE, {"V1": (-1.010834 * STOKES, 0.003)}, {}),
        (SETTLING + "48", {"V1": (-1.010834 * STOKES, 0.001)}, {}),
        (SPIN + "24", {"T2": (TORQUE, 0.005)}, {}),
        (SPIN + "48", {"T2": (TORQUE, 0.003)}, {}),
        (SHEARED + "24" + BESIDE_A_NODE, {"S13": (STRESSLET, 0.015)}, {}),
        (SHEARED + "48" + BESIDE_A_NODE, {"S13": (STRESSLET, 0.003)}, {}),
    ],
    # other solvers: conjugate gradients on the pressure, and a mean velocity that is set to zero
    "settling_cells": [
        (SETTLING + "24 -box_periodic 1,0,0", {"V1": (-0.95580 * STOKES, 0.003)}, {}),
        (SETTLING + "24 -box_periodic 1,1,1", {"V1": (-0.858658 * STOKES, 0.003)}, {}),
    ],
}


class Failure(Exception):
    pass


def require(condition, message):
    if not condition:
        raise Failure(message)


def run(launch, words, folder):
    """Runs dlmfd in the source tree, where scenes name each other's files; returns the rows of its trajectory."""
    command = launch + words + ["-output_dir", folder]
    env = dict(os.environ, ASAN_OPTIONS="detect_leaks=0", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1",
               OMPI_MCA_mpi_yield_when_idle="1")
    result = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True)
    require(result.returncode == 0, f"exit code {result.returncode}: {result.stderr[-2000:]}")
    if not os.path.exists(os.path.join(folder, "trajectory.csv")):
        return []  # no spheres
    with open(os.path.join(folder, "trajectory.csv"), encoding="utf-8", newline="") as file:
        require(file.readline().rstrip("\r\n") == HEADER, "trajectory.csv: unexpected header")
        file.seek(0)
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    for row in rows:
        require(all(math.isfinite(value) for value in row.values()), f"trajectory.csv: not finite: {row}")
    return rows


def coarse(name, steps):
    return ["-grid_resolution", str(COARSE_OF.get(name, COARSE)), "-ts_max_steps", str(steps)]


def check_files(launch, path, folder):
    """The scene itself, on two ranks, with everything it can leave."""
    rows = run(launch, [path] + coarse(os.path.basename(path), STEPS) + ["-output_fields_every", "1"], folder)
    with open(os.path.join(folder, "summary.json"), encoding="utf-8") as file:
        summary = json.load(file)
    spheres = summary["scene"]["n_spheres"]
    require(summary["steps"] == STEPS, f"summary.json: {summary['steps']} steps, {STEPS} asked for")
    require(summary["ranks"] == int(RANKS), f"summary.json: {summary['ranks']} ranks, {RANKS} asked for")
    require(len(rows) == spheres * (STEPS + 1), f"trajectory.csv: {len(rows)} rows for {spheres} spheres, {STEPS} steps")
    scene = summary["scene"]
    sheared = scene["box_periodic"] == [True, True, False] and scene["wall_velocity_lower"] != scene["wall_velocity_upper"]
    expected = ["bulk.csv"] * sheared + ["fields.h5", "fields.xmf", "summary.json"] + ["trajectory.csv"] * (spheres > 0)
    require(sorted(os.listdir(folder)) == expected,
            f"unexpected files: {sorted(os.listdir(folder))}")


def header_commands(path):
    with open(path, encoding="utf-8") as file:
        header = [line for line in file if line.startswith("#")]
    return [match.group(1) for match in map(COMMAND.match, header) if match]


def check_command(launch, line, name):
    require(line.split()[0] == "input/" + name, f"the header runs another scene: {line}")
    with tempfile.TemporaryDirectory() as folder:
        run(launch, shlex.split(line) + coarse(name, 0), folder)


def run_inputs(launch):
    failed, workers = 0, concurrent.futures.ThreadPoolExecutor(2)
    scenes = sorted(glob.glob(os.path.join(ROOT, "input", "*.yaml")))
    require(scenes, "no scenes in input/")
    for scene in scenes:
        name = os.path.basename(scene)
        commands = header_commands(scene)
        try:
            require(commands, "the header has no line '#   dlmfd input/...'")
            with tempfile.TemporaryDirectory() as folder:
                check_files(launch, os.path.join("input", name), folder)
            list(workers.map(lambda line: check_command(launch[-1:], line, name), commands))
            print(f"ok      {name}: {STEPS} steps, {len(commands)} command lines of its header")
        except Failure as failure:
            failed += 1
            print(f"FAILED  {name}: {failure}")
    return failed


def check_numbers(launch, group):
    failed = 0
    for line, exact, bounds in NUMBERS[group]:
        print(line)
        with tempfile.TemporaryDirectory() as folder:
            row = run(launch[-1:], shlex.split(line + " " + SOLVE), folder)[-1]
        for column, (value, tolerance) in exact.items():
            error = row[column] / value - 1
            good = abs(error) <= tolerance
            failed += not good
            print(f"  {'ok    ' if good else 'FAILED'} {column} = {row[column]:.6f}, exact {value:.6f}, error {100 * error:+.3f} % (allowed {100 * tolerance:g} %)")
        for column, most in bounds.items():
            good = abs(row[column]) <= most
            failed += not good
            print(f"  {'ok    ' if good else 'FAILED'} {column} = {row[column]:.1e} (allowed {most:g})")
    return failed


def separations(launch, scene):
    """Centre of sphere 0 minus centre of sphere 1, step by step."""
    with tempfile.TemporaryDirectory() as folder:
        rows = run(launch, [f"input/{scene}.yaml"] + coarse(scene, 30) + ["-ts_dt", "0.1"], folder)
    return [[first[x] - second[x] for x in ("x1", "x2", "x3")] for first, second in zip(rows[0::2], rows[1::2])]


def check_frames(launch):
    two, one = (separations(launch, scene) for scene in ("pair_two_walls", "pair_one_wall"))
    apart = max(abs(a - b) for first, second in zip(two, one) for a, b in zip(first, second))
    good = len(two) == len(one) == 31 and apart <= 1e-6
    print(f"{'ok    ' if good else 'FAILED'} relative paths differ by {apart:.1e} (allowed 1e-6), {len(two)} and {len(one)} steps")
    return 0 if good else 1


def main():
    group, program, mpirun = sys.argv[1], os.path.abspath(sys.argv[2]), sys.argv[3:]
    launch = mpirun + ["-n", RANKS, program]
    checks = {"run": run_inputs, "frames": check_frames}
    failed = checks[group](launch) if group in checks else check_numbers(launch, group)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
