"""What the tools that draw share: reading a run's folder, style, units, figures of a fixed size, errors in one line.

run = Run("out/pair")      run.paths[0]["x1"], run.radii, run.shear, run.fields.steps, run.bulk
label("$x_1$", "length")   axis text with its unit; --units cm,g,s of every tool names the units
run_tool(main)             calls main; what the user can mend ends in one line and exit status 1
"""
import argparse
import functools
import importlib.machinery
import importlib.util
import itertools
import json
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

COLUMNS = ["step", "time", "sphere", "x1", "x2", "x3", "V1", "V2", "V3", "omega1", "omega2", "omega3"]
PALETTE = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f3c8d", "#444444"]
FORMATS = ("png", "pdf", "svg")
STYLE = {
    "font.size": 9,
    "axes.labelsize": 10,
    "axes.titlesize": 9,
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "mathtext.fontset": "cm",
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.major.pad": 5,
    "ytick.major.pad": 5,
    "lines.linewidth": 1.3,
    "svg.hashsalt": "dlmfd",
    "axes.formatter.useoffset": False,
}
plt.rcParams.update(STYLE)

# Without --units an axis says what is measured: any consistent system fits.
units = {"length": "length", "time": "time", "1/time": "1/time", "velocity": "velocity", "pressure": "pressure", "viscosity": "pressure time"}


class ToolError(Exception):
    """Something the user can mend. Its text is one line."""


class Parser(argparse.ArgumentParser):
    """Takes its description from the docstring of a tool, and reports errors in one line."""

    def __init__(self, doc, output=None):
        super().__init__(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
        self.add_argument("--units", metavar="CM,G,S", help="names of the units of length, mass and time, for the axes")
        self.add_argument("-o", "--output", metavar="FILE", help=output or f"picture to write ({', '.join(FORMATS)})")

    def error(self, message):
        raise ToolError(message)

    def parse_args(self, args=None, namespace=None):
        arguments = super().parse_args(args, namespace)
        if arguments.units:
            name_units(arguments.units)
        return arguments


def name_units(text):
    names = [word.strip() for word in text.split(",")]
    if len(names) != 3 or not all(names):
        raise ToolError(f"--units {text}: allowed: names of the units of length, mass and time, as in cm,g,s")
    length, mass, time = names
    units.update(
        {
            "length": length,
            "time": time,
            "1/time": f"{time}⁻¹",
            "velocity": f"{length}/{time}",
            "pressure": f"{mass} {length}⁻¹ {time}⁻²",
            "viscosity": f"{mass} {length}⁻¹ {time}⁻¹",
        }
    )


def label(symbol, unit=None):
    return f"{symbol} ({units[unit]})" if unit else symbol


def run_tool(main):
    tool = os.path.basename(sys.argv[0])
    try:
        main(sys.argv[1:])
    except ToolError as error:
        sys.exit(f"{tool}: error: {error}")
    except OSError as error:
        sys.exit(f"{tool}: error: {error.filename or 'files'}: {error.strerror or error}")


def load_tool(name):
    """A tool beside this file as a module."""
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), name)
    loader = importlib.machinery.SourceFileLoader(name, path)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


def save(figure, path):
    if os.path.splitext(path)[1][1:].lower() not in FORMATS:
        raise ToolError(f"--output {path}: allowed: a name that ends in .{', .'.join(FORMATS)}")
    figure.savefig(path, dpi=200)
    plt.close(figure)
    print(path)


def read_csv(name, required=()):
    """Columns by name. A last line that the run is still writing is left out."""
    try:
        with open(name, encoding="utf-8") as file:
            header, *lines = file.read().splitlines() or [""]
    except FileNotFoundError:
        raise ToolError(f"no {os.path.basename(name)} in {os.path.dirname(name) or '.'}") from None
    header = [word.strip() for word in header.split(",")]
    missing = [word for word in required if word not in header]
    if missing:
        raise ToolError(f"{name} has no column {missing[0]}")
    if lines and lines[-1].count(",") != len(header) - 1:
        lines.pop()
    if not lines:
        raise ToolError(f"{name} has no rows")
    try:
        rows = np.loadtxt(lines, delimiter=",", ndmin=2)
    except ValueError as error:
        raise ToolError(f"{name}: {str(error).splitlines()[0]}") from None
    return dict(zip(header, rows.T))


def last_tenth(time):
    """Which rows lie in the last tenth of the time that they span; steps need not be equal."""
    return time >= time[-1] - 0.1 * (time[-1] - time[0]) * (1 + 1e-9)


class Run:
    """The output folder of a run. What a run may lack is None or empty; what a tool cannot do without raises ToolError."""

    def __init__(self, folder):
        if not os.path.isdir(folder):
            raise ToolError(f"no folder {folder}")
        self.folder, self.name = folder, os.path.basename(os.path.abspath(folder))
        self.summary = self._read_summary()
        self.scene = self.summary.get("scene", {})
        self.box = self.scene.get("box_size")
        self.periodic = self.scene.get("box_periodic", [True, True, False])
        self.radii = np.array([sphere["radius"] for sphere in self.scene.get("spheres", [])])

    def path(self, name):
        return os.path.join(self.folder, name)

    def _read_summary(self):
        try:
            with open(self.path("summary.json"), encoding="utf-8") as file:
                return json.load(file)
        except FileNotFoundError:
            return {}
        except ValueError:
            raise ToolError(f"{self.path('summary.json')} is not whole") from None

    def need_summary(self):
        if not self.scene:
            raise ToolError(f"no summary.json in {self.folder}: a run writes it when it ends")
        if not self.box:
            raise ToolError(f"{self.path('summary.json')} has no box_size: it is of an older version")

    @functools.cached_property
    def paths(self):
        """One dict of columns a sphere, ascending in step; of a step written twice the later row."""
        rows = read_csv(self.path("trajectory.csv"), COLUMNS)
        finite = np.all([np.isfinite(rows[name]) for name in COLUMNS], axis=0)
        if not finite.any():
            raise ToolError(f"{self.path('trajectory.csv')} has no finite numbers")
        rows, paths = {name: column[finite] for name, column in rows.items()}, []
        for sphere in np.unique(rows["sphere"]):
            mine = np.flatnonzero(rows["sphere"] == sphere)
            _, last = np.unique(rows["step"][mine][::-1], return_index=True)
            paths.append({name: column[mine[::-1][last]] for name, column in rows.items()})
        return paths

    @functools.cached_property
    def bulk(self):
        """Columns of bulk.csv, or None."""
        return read_csv(self.path("bulk.csv"), ["time"]) if os.path.exists(self.path("bulk.csv")) else None

    @functools.cached_property
    def fields(self):
        return Fields(self.path("fields.h5"), rides=any(self.summary.get("frame_velocity", ())))

    def walls(self, axis):
        """Velocities of the lower and the upper wall of an axis (0, 1, 2), or None if it is periodic."""
        name = "wall_velocity" if axis == 2 else f"wall_velocity_x{axis + 1}"
        both = [self.scene.get(f"{name}_{side}") for side in ("lower", "upper")]
        return None if self.periodic[axis] or None in both else np.array(both)

    @functools.cached_property
    def shear(self):
        """(rate, axis of the flow, of the gradient, of the vorticity) of the one pair of walls that shears the box, or None."""
        found = [
            (axis, walls[1] - walls[0]) for axis in range(3) for walls in [self.walls(axis)] if walls is not None and np.any(walls[1] != walls[0])
        ]
        if len(found) != 1 or np.count_nonzero(found[0][1]) != 1:
            return None
        gradient, difference = found[0]
        flow = int(np.flatnonzero(difference)[0])
        return abs(difference[flow]) / self.box[gradient], flow, gradient, 3 - flow - gradient

    @property
    def wi(self):
        """Weissenberg number; 0 in Newtonian fluid, None without one shear rate."""
        return self.scene.get("relaxation_time", 0.0) * self.shear[0] if self.shear else None


class Fields:
    """fields.h5. Positions are those of the mesh, which rides with the mean velocity of the walls if they have one."""

    def __init__(self, path, rides=False):
        import h5py  # only where fields are read

        if not os.path.exists(path):
            raise ToolError(f"no {os.path.basename(path)} in {os.path.dirname(path) or '.'}: run with -output_fields_every N")
        try:
            self.file = h5py.File(path, "r")
        except OSError:
            raise ToolError(f"{path} is not a whole HDF5 file, or the run is writing it just now") from None
        self.path, self.rides = path, rides
        steps = sorted(name for name in self.file if name.startswith("step_") and name in self.file)  # not links to nothing
        self.steps = [name for name in steps if set(self.file[name]) >= set(self.file[steps[0]])]  # whole ones
        if not self.steps or "meshes/velocity_mesh" not in self.file:
            raise ToolError(f"{path} has no steps")
        self.times = np.array([self.file[name].attrs["time"][0] for name in self.steps])
        mesh = self.file["meshes/velocity_mesh"].attrs
        self.periodic = mesh["periodic"].astype(bool)
        self.lower = mesh["origin"]
        self.size = mesh["spacing"] * (mesh["nodes"] - ~self.periodic)

    def numbers(self):
        return [int(name.split("_")[1]) for name in self.steps]

    def has(self, step, name):
        return name in self.file[step]

    def component(self, step, pair):
        """Place of C11, ... in the last axis of the conformation tensor: VTK's order where its trace is there too, as older files have not."""
        order = ("11", "22", "33", "12", "23", "13") if self.has(step, "conformation_trace") else ("11", "12", "13", "22", "23", "33")
        return order.index(pair)

    def spheres(self, step):
        """Centres [n, 3] and radii [n]."""
        group = self.file[step].get("spheres")
        return (group["center"][()], group["radius"][()]) if group else (np.zeros((0, 3)), np.zeros(0))

    def plane(self, step, name, axis, at):
        """
        Where x_axis = at, linear between the mesh planes: coordinates along the first and the second of the two other axes, and
        values [second, first] or [second, first, component].
        """
        data = self.file[step][name]
        mesh = self.file["meshes"][data.attrs["mesh"][0].decode()].attrs
        lower, h, last = mesh["origin"], mesh["spacing"], data.shape[2 - axis] - 1
        place = (at - lower[axis]) / h[axis]
        k = int(min(max(np.floor(place), 0), last - 1))
        low, high = (data[(slice(None),) * (2 - axis) + (plane,)] for plane in (k, k + 1))
        along = [lower[d] + h[d] * np.arange(data.shape[2 - d]) for d in range(3) if d != axis]
        return *along, low + (place - k) * (high - low)


def cut_spheres(centers, radii, axis, at, lower, size, periodic):
    """Circles (first, second coordinate, radius) that the plane x_axis = at cuts out of spheres and their periodic images, where the box shows them."""
    a, b = (d for d in range(3) if d != axis)
    circles = []
    for shift in itertools.product(*[(-length, 0.0, length) if wraps else (0.0,) for length, wraps in zip(size, periodic)]):
        for center, radius in zip(np.asarray(centers) + shift, radii):
            square = radius**2 - (center[axis] - at) ** 2
            if square > 0 and all(lower[d] - np.sqrt(square) < center[d] < lower[d] + size[d] + np.sqrt(square) for d in (a, b)):
                circles.append((center[a], center[b], np.sqrt(square)))
    return circles


def panel_figure(width, height, right=1.15, widest=5.6, highest=5.6):
    """Figure and axes whose panel has the shape width : height to scale, with room for labels, title and, at the right, a colour bar."""
    scale = min(widest / width, highest / height)
    w, h = max(width * scale, 0.8), max(height * scale, 0.6)
    left, bottom, top = 0.75, 0.55, 0.35
    total = (left + w + right, bottom + h + top)
    figure = plt.figure(figsize=total)
    return figure, figure.add_axes([left / total[0], bottom / total[1], w / total[0], h / total[1]])
