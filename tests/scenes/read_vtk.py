#!/usr/bin/env python3
"""fields.xmf as VTK's own two readers see it, the same that ParaView opens it with.

    read_vtk.py DLMFD MPIRUN...

Runs on one to three ranks and one that was continued from a checkpoint: names, components and points of every array, the order of the axes, times,
every value against fields.h5, known values of a flow, multipliers against the forces in trajectory.csv, the size that the run states. The readers come
with Debian's ParaView (python3-paraview); its python3-vtk9 has none.
"""
import csv
import os
import re
import subprocess
import sys
import tempfile

import h5py
import numpy

try:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
    from vtkmodules.vtkIOXdmf2 import vtkXdmfReader
    from vtkmodules.vtkIOXdmf3 import vtkXdmf3Reader
except ImportError as missing:
    sys.exit(f"VTK's XDMF readers are missing ({missing}): tools/setup --tests installs them, or apt-get install python3-paraview")

READERS = (vtkXdmfReader, vtkXdmf3Reader)
CELLS, BOX = (24, 16, 12), (1.5, 1.0, 0.75)  # unequal, so that no two axes can be taken for each other
SCENE = (f"-box_size {','.join(map(str, BOX))} -grid_resolution 16 -progress_every 1000 -ts_dt 0.05 -ts_split_scheme strang -output_fields_every 2"
         " -wall_velocity_lower -0.5,0,0 -wall_velocity_upper 1,0,0 -fluid_model oldroyd_b -fluid_relaxation_time 0.5")
SPHERES = " -sphere_radius 0.12 -sphere_centers 0.65,0.02,0.2,-0.3,0.1,-0.2 -output_multipliers 1"
MESH_ARRAYS = {"velocity": 3, "conformation": 6, "conformation_trace": 1}
POINT_ARRAYS = {"spheres": {"id": 1, "radius": 1, "velocity": 3, "omega": 3}, "multipliers": {"id": 1, "sphere": 1, "multiplier": 3, "traction": 3}}
POSITIONS = {"spheres": "center", "multipliers": "point"}
failed = 0


def check(good, text):
    global failed
    failed += not good
    print(("ok      " if good else "FAILED  ") + text, flush=True)


def leaves(data, name=""):
    """(name, data set) of the parts of a multi-block; VTK numbers names that come again: spheres[1]."""
    if hasattr(data, "GetNumberOfBlocks"):
        for k in range(data.GetNumberOfBlocks()):
            meta = data.GetMetaData(k)
            if data.GetBlock(k):
                yield from leaves(data.GetBlock(k), meta.Get(data.NAME()) if meta and meta.Has(data.NAME()) else "")
    else:
        yield name.split("[")[0], data


def arrays(data):
    found = data.GetPointData()
    return {found.GetArrayName(k): vtk_to_numpy(found.GetArray(k)) for k in range(found.GetNumberOfArrays())}


def positions(points):
    return vtk_to_numpy(points.GetPoints().GetData())


def read(reader_type, path):
    """[(time, {name: data set})] of a file."""
    reader = reader_type()
    reader.SetFileName(path)
    reader.UpdateInformation()
    steps = []
    for time in reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS()):
        reader.UpdateTimeStep(time)
        steps.append((time, {name: data.NewInstance() for name, data in leaves(reader.GetOutputDataObject(0))}))
        for name, data in leaves(reader.GetOutputDataObject(0)):
            steps[-1][1][name].DeepCopy(data)
    return steps


def differences(name, found, expected, stored):
    """What is wrong with the arrays of a part: names and components, then values; points run along x1 fastest."""
    wrong = []
    if {key: 1 if values.ndim == 1 else values.shape[1] for key, values in found.items()} != expected:
        wrong.append(f"{name} has {[(key, values.shape) for key, values in found.items()]}")
    return wrong + [f"{name}/{key}" for key, values in found.items() if key not in stored or not numpy.array_equal(values.ravel(), stored[key][()].ravel())]


def mesh_differences(name, coarsening, expected, step, grid):
    size = tuple(n // coarsening + 1 for n in CELLS)
    bounds = [side * 0.5 * length for length in BOX for side in (-1, 1)]
    wrong = differences(name, arrays(grid), expected, step)
    if tuple(grid.GetDimensions()) != size or not numpy.allclose(grid.GetBounds(), bounds, atol=1e-12):
        wrong.append(f"{name} of {grid.GetDimensions()} points in {grid.GetBounds()}")
    return wrong


def point_differences(name, expected, stored, points):
    wrong = differences(name, arrays(points), expected, stored)
    if not numpy.array_equal(positions(points), stored[POSITIONS[name]][()]) or points.GetNumberOfCells() != len(stored["id"]):
        wrong.append(f"positions of {name}")
    return wrong


def step_differences(step, parts):
    """What is wrong with the parts of a step, against its group in fields.h5."""
    wrong = mesh_differences("velocity_mesh", 1, MESH_ARRAYS, step, parts["velocity_mesh"])
    wrong += mesh_differences("pressure_mesh", 2, {"pressure": 1}, step, parts["pressure_mesh"])
    sets = [name for name in POINT_ARRAYS if name in step]
    for name in sets:
        wrong += point_differences(name, POINT_ARRAYS[name], step[name], parts[name])
    return wrong + [f"parts {sorted(parts)}"] * (sorted(parts) != sorted(sets + ["velocity_mesh", "pressure_mesh"]))


def check_file(what, folder, steps):
    """Everything of a run's fields, by both readers; returns what the second one found."""
    for reader in READERS:
        found = read(reader, os.path.join(folder, "fields.xmf"))
        seen = [time for time, parts in found]
        with h5py.File(os.path.join(folder, "fields.h5")) as file:
            groups = [file[name] for name in file if name.startswith("step_")]
            times = [float(group.attrs["time"][0]) for group in groups]
            wrong = [f"times {seen}, in the file {times}"] * (seen != times or len(times) != steps)
            for (time, parts), group in zip(found, groups):
                wrong += [f"t = {time}: {text}" for text in step_differences(group, parts)]
        names = sorted({name for parts in found[-1][1].values() for name in arrays(parts)})
        check(not wrong, f"{what}, {reader.__name__}: {len(found)} steps to t = {seen[-1]:.4g}, arrays {', '.join(names)}" + "".join("\n  " + text for text in wrong))
    return found


def value_at(grid, name, x):
    """The value at the mesh point nearest to x."""
    return arrays(grid)[name][grid.FindPoint(x)]


def check_couette(found):
    """Homogeneous shear at t = 0.2 and rate 2, lambda1 = 0.5: u1 = 1/4 + 2 x3, s = 0.4, Wi = 1."""
    time, parts = found[-1]
    s, worst = time / 0.5, 0.0
    sheared, stretched = 1 - numpy.exp(-s), 2 * (1 - (1 + s) * numpy.exp(-s))
    for x in ((-0.75, -0.5, -0.375), (0.0, 0.25, 0.0), (0.5, 0.0, 0.25), (0.75, 0.5, 0.375)):
        worst = max(worst, abs(value_at(parts["velocity_mesh"], "velocity", x) - [0.25 + 2 * x[2], 0, 0]).max())
        worst = max(worst, abs(value_at(parts["velocity_mesh"], "conformation", x) - [1 + stretched, 1, 1, 0, 0, sheared]).max())
        worst = max(worst, abs(value_at(parts["velocity_mesh"], "conformation_trace", x) - 3 - stretched))
        worst = max(worst, abs(value_at(parts["pressure_mesh"], "pressure", x)))
    check(abs(time - 0.2) < 1e-12 and worst <= 1e-11,
          f"Couette flow at four points: u1 = 1/4 + 2 x3, C in the order of ParaView's names, trace, pressure, to {worst:.0e} (allowed 1e-11)")


def sums(r, force):
    return numpy.concatenate([force.sum(axis=0), numpy.cross(r, force).sum(axis=0)])


def check_forces(what, found, folder):
    """Multipliers and tractions of every sphere sum to its force and torque in the row of the same step; they lie on one sphere below its surface."""
    with open(os.path.join(folder, "trajectory.csv"), newline="", encoding="utf-8") as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    parts, worst = found[-1][1], 0.0
    points, values = positions(parts["multipliers"]), arrays(parts["multipliers"])
    for row in rows[-2:]:
        sphere = int(row["sphere"])
        own = values["sphere"] == sphere
        r = points[own] - positions(parts["spheres"])[sphere]
        distance = numpy.linalg.norm(r, axis=1)
        exact = numpy.array([row[name] for name in ("F1", "F2", "F3", "T1", "T2", "T3")])
        for force in (-values["multiplier"][own], values["traction"][own] * 4 * numpy.pi * distance[0] ** 2 / own.sum()):
            worst = max(worst, abs(sums(r, force) - exact).max() / abs(force).sum(), numpy.ptp(distance))
        worst = max(worst, 1.0 * (distance[0] >= arrays(parts["spheres"])["radius"][sphere] or own.sum() < 30))
    check(worst <= 1e-9, f"{what}: {len(points)} multipliers; they and the tractions sum to force and torque, to {worst:.0e} (allowed 1e-9)")


def check_size(told, folder):
    """The line at the start of a run against the files it left."""
    line = next(line for line in told.splitlines() if line.startswith("fields "))
    stated = [float(number) * {"kB": 1e3, "MB": 1e6}[unit] for number, unit in re.findall(r"(\S+) (kB|MB)", line)]
    with h5py.File(os.path.join(folder, "fields.h5")) as file:
        outputs = sum(name.startswith("step_") for name in file)
    size = os.path.getsize(os.path.join(folder, "fields.h5"))
    check(0.9 < stated[1] / size <= 1.005 and abs(stated[1] / (outputs * stated[0]) - 1) < 0.005, f"'{line.split(': ')[1]}': {outputs} outputs in {size} bytes")


def run(command, options, folder):
    done = subprocess.run(command + options.split() + ["-output_dir", folder], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        sys.exit(f"dlmfd {options}: exit code {done.returncode}\n{done.stdout}")
    return done.stdout


def main():
    alone = [os.path.abspath(sys.argv[1])]
    with tempfile.TemporaryDirectory() as place:
        folder = os.path.join(place, "couette")
        run(alone, SCENE + " -ts_max_steps 4", folder)
        check_couette(check_file("Couette flow", folder, 3))
        for ranks in (1, 2, 3):
            folder = os.path.join(place, f"spheres{ranks}")
            told = run(sys.argv[2:] + ["-n", str(ranks)] + alone, SCENE + SPHERES + " -ts_max_steps 4", folder)
            check_forces(f"two spheres, {ranks} ranks", check_file(f"two spheres, {ranks} ranks", folder, 3), folder)
        check_size(told, folder)
        folder = os.path.join(place, "continued")
        run(sys.argv[2:] + ["-n", "2"] + alone, SCENE + SPHERES + " -ts_max_steps 5 -checkpoint_every 3", folder)
        run(alone, SCENE + SPHERES + f" -ts_max_steps 6 -restart {folder}/checkpoint.h5", folder)
        check_forces("continued", check_file("stopped after 5 steps and continued", folder, 5), folder)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
