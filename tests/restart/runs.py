"""What the tests of checkpoints and faults share: scenes, runs of dlmfd in a folder of the test, comparisons to the last bit, and a count of what failed."""
import os
import re
import subprocess
import sys
import tempfile
import time

import h5py
import numpy

BOX = ("-box_size 1.5,1,1 -grid_resolution 16 -sphere_radius 0.15 -saddle_rtol 1e-11 -progress_every 1000 -ts_max_time 100"
       " -wall_velocity_lower -1,0,0 -wall_velocity_upper 2,0,0 ")
THREE = BOX + "-sphere_centers 0.6,0.02,0.2,0.25,-0.02,0.15,-0.3,0,-0.2 -ts_dt 0.1"  # the first two are near each other, the first one crosses a face
POLYMER = " -fluid_model oldroyd_b -ts_dt 0.05"
SCENES = {
    "newtonian lie": THREE + " -ts_split_scheme lie",
    "newtonian strang": THREE,
    "twins": BOX + "-sphere_centers -0.1,0,0.2,-0.6,0.01,-0.25,0.32,0.01,0.05 -ts_dt 0.1",  # the second has the first one's factors, which joins the third
    "no inertia": THREE + " -sphere_inertia 0",
    "points without harmonics": THREE + " -pairing_degree 0",
    "volume points": THREE + " -pairing_points volume -saddle_rtol 1e-8",
    "thesis's solver": THREE + " -saddle_split velocity -saddle_rtol 1e-6",
    "factor lie": THREE + POLYMER + " -ts_split_scheme lie",
    "factor strang": THREE + POLYMER,
    "log lie": THREE + POLYMER + " -polymer_form log -ts_split_scheme lie",
    "log strang": THREE + POLYMER + " -polymer_form log",
    "explicit, extend": THREE + POLYMER + " -polymer_coupling explicit -polymer_inside extend -ts_dt 0.02",
    "adapted steps": THREE + " -ts_adapt_type scene -ts_dt 0.02",
    "near flow": THREE + POLYMER + " -fluid_relaxation_time 0.3 -polymer_inside stokes",
    "near flow, adapted steps": THREE + POLYMER + " -fluid_relaxation_time 0.3 -polymer_inside stokes -polymer_form log -ts_adapt_type scene",
    "fluid alone": BOX + POLYMER + " -polymer_mode_amplitude 0.1 -output_fields_every 3",
}
PROGRAM, MPIRUN, FOLDER, FAILED = "", [], "", 0  # set by main


def check(good, text):
    global FAILED
    FAILED += not good
    print(("  " if good else "FAILED ") + text, flush=True)


def place(name):
    return os.path.join(FOLDER, name)


def command(options, folder, ranks=1):
    launch = MPIRUN + ["-n", str(ranks)] if ranks > 1 else []
    return launch + [PROGRAM] + options.split() + ["-output_dir", place(folder)]


def run(options, folder, ranks=1, expected=0):
    done = subprocess.run(command(options, folder, ranks), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=300)
    if done.returncode != expected:
        print(" ".join(command(options, folder, ranks)), done.stdout[-2000:], done.stderr[-2000:], sep="\n")
        check(False, f"exit code {done.returncode}, expected {expected}")
    return done


def checkpoint(folder):
    return os.path.join(place(folder), "checkpoint.h5")


def text(folder, name="trajectory.csv"):
    with open(os.path.join(place(folder), name), "rb") as file:
        return file.read()


def rows(folder):
    return numpy.loadtxt(os.path.join(place(folder), "trajectory.csv"), delimiter=",", skiprows=1)


def fields(folder, name="fields.h5"):
    """All numbers of an HDF5 file by name."""
    found = {}

    def visit(item, path):
        if isinstance(item, h5py.Dataset):
            found[path] = item[()]
        else:
            for key in item:
                visit(item[key], f"{path}/{key}")

    with h5py.File(os.path.join(place(folder), name), "r") as file:
        visit(file, "")
    return found


def same_fields(a, b, file="fields.h5"):
    a, b = fields(a, file), fields(b, file)
    different = sorted(set(a) ^ set(b)) + [name for name in a if name in b and a[name].tobytes() != b[name].tobytes()]
    if different:
        print(f"  different: {different}")
    return not different


def same_state(a, b):
    """The last checkpoints of two runs, byte by byte."""
    return same_fields(a, b, "checkpoint.h5")


def refusal(what, pattern, options, folder, ranks=1):
    """One line that matches, exit code 2, and the folder as it was."""
    before = {name: text(folder, name) for name in os.listdir(place(folder))} if os.path.isdir(place(folder)) else None
    done = run(options, folder, ranks, 2)
    lines = [line for line in done.stderr.splitlines() if line.startswith("dlmfd:") or "PETSC ERROR" in line]
    after = {name: text(folder, name) for name in os.listdir(place(folder))} if os.path.isdir(place(folder)) else None
    good = len(lines) == 1 and re.search("^dlmfd: error: .*" + pattern, lines[0])
    check(bool(good), f"{what}: {lines}")
    if before != after:
        check(False, f"{what}: the folder has changed")


def wait_for_rows(process, folder, count):
    path, deadline = os.path.join(place(folder), "trajectory.csv"), time.time() + 120
    while time.time() < deadline and process.poll() is None:
        if os.path.exists(path):
            with open(path, "rb") as file:
                if file.read().count(b"\n") > count:
                    return
        time.sleep(0.01)


def children(pid):
    with open(f"/proc/{pid}/task/{pid}/children", encoding="ascii") as file:
        return [int(child) for child in file.read().split()]


def main(groups):
    """PROG GROUP DLMFD [NUMBER] MPIRUN...: runs a group in a fresh folder; a number goes to it."""
    global PROGRAM, MPIRUN, FOLDER
    group, PROGRAM, rest = sys.argv[1], os.path.abspath(sys.argv[2]), sys.argv[3:]
    numbers = [int(rest.pop(0))] if rest[0].isdigit() else []
    MPIRUN = rest
    with tempfile.TemporaryDirectory() as FOLDER:
        groups[group](*numbers)
    sys.exit(1 if FAILED else 0)
