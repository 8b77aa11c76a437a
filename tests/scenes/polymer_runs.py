"""What the viscoelastic tests share: runs of dlmfd, C and velocity by node, orders, and a report that counts what failed."""
import csv
import json
import math
import os
import subprocess
import sys
import tempfile

import h5py
import numpy

XX, YY, ZZ, XY, YZ, XZ = range(6)  # components of C in fields.h5
ENTRY = {(0, 0): XX, (0, 1): XY, (0, 2): XZ, (1, 1): YY, (1, 2): YZ, (2, 2): ZZ}
QUIET = " -progress_every 1000"
program, mpirun, folder, runs, failed = "", [], "", 0, 0


class Run:
    """A finished run: summary, rows[step, sphere, column] of the trajectory, the last fields without repeated planes, indexed [x1, x2, x3]."""

    def __init__(self, path):
        self.path = path
        with open(os.path.join(path, "summary.json"), encoding="utf-8") as file:
            self.summary = json.load(file)
        self.time, self.polymer = self.summary["time"], self.summary.get("polymer")
        spheres = self.summary["scene"]["n_spheres"]
        if spheres:
            with open(os.path.join(path, "trajectory.csv"), newline="", encoding="utf-8") as file:
                self.rows = numpy.array([[float(x) for x in row] for row in list(csv.reader(file))[1:]]).reshape(-1, spheres, 24)

    def bulk(self):
        """The columns of bulk.csv by name."""
        with open(os.path.join(self.path, "bulk.csv"), newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        return {name: numpy.array([float(row[name]) for row in rows]) for name in rows[0]}

    def steps(self):
        with h5py.File(os.path.join(self.path, "fields.h5"), "r") as file:
            return [name for name in file if name.startswith("step_")]

    def field(self, name, step=None):
        with h5py.File(os.path.join(self.path, "fields.h5"), "r") as file:
            group = file[step or self.steps()[-1]]
            values = group[name][()]
            mesh = file["meshes"][group[name].attrs["mesh"][0].decode()]
            axes = values.transpose([2, 1, 0] + list(range(3, values.ndim)))
            return axes[tuple(slice(0, n) for n in mesh.attrs["nodes"])]

    def times(self):
        with h5py.File(os.path.join(self.path, "fields.h5"), "r") as file:
            return [float(file[name].attrs["time"][0]) for name in file if name.startswith("step_")]


def launch(options, ranks=1):
    """(exit code, output, folder) of a run."""
    global runs
    runs += 1
    path = os.path.join(folder, f"run{runs}")
    command = (mpirun + ["-n", str(ranks)] if ranks > 1 else []) + [program] + (options + QUIET).split() + ["-output_dir", path]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return done.returncode, done.stdout, path


def run(options, ranks=1):
    code, output, path = launch(options, ranks)
    if code:
        sys.exit(f"dlmfd {options} on {ranks} ranks: exit code {code}\n" + "\n".join(line for line in output.splitlines() if "error:" in line or "ERROR" in line)[:1000])
    return Run(path)


def check(good, text):
    global failed
    failed += not good
    print(("ok      " if good else "FAILED  ") + text, flush=True)


def order(errors, ratio=2.0):
    return [math.log(a / b) / math.log(ratio) for a, b in zip(errors, errors[1:])]


def figures(values):
    return ", ".join(f"{value:.2e}" for value in values)


def main(groups):
    """GROUP DLMFD MPIRUN..."""
    global program, mpirun, folder
    program, mpirun = os.path.abspath(sys.argv[2]), sys.argv[3:]
    with tempfile.TemporaryDirectory() as folder:
        groups[sys.argv[1]]()
    sys.exit(1 if failed else 0)
