"""The scenes of tools/tradeoff: what is run, what is measured in it, the reference it is measured against, and the cases."""
import dataclasses
from typing import Callable

import numpy

X1, X3, V1, OMEGA2 = 1, 3, 4, 8  # columns of a row: time x1 x2 x3 V1 V2 V3 omega1 omega2 omega3
THESIS = "-ts_split_scheme lie -pairing_type collocation -pairing_points volume -pairing_retraction 0"
THESIS_POLYMER = THESIS + " -polymer_coupling explicit -polymer_inside identity -polymer_form factor"
PRESETS = ("draft", "standard", "fine", "reference")
NEWTONIAN_KNOBS = ("-ts_split_scheme lie", "-saddle_rtol 1e-3", "-saddle_rtol 1e-4", "-saddle_rtol 1e-8", "-pairing_type collocation -pairing_degree 0",
                   "-pairing_type collocation -pairing_retraction 0", "-pairing_degree 0", "-pairing_retraction 0", "-pairing_points volume", "-sphere_inertia 0")
POLYMER_KNOBS = ("-ts_split_scheme lie", "-saddle_rtol 1e-4", "-pairing_type collocation -pairing_degree 0", "-pairing_degree 0", "-pairing_retraction 0",
                 "-pairing_points volume", "-polymer_form log", "-polymer_inside extend", "-polymer_inside evolve", "-polymer_inside identity", "-polymer_stress_offset 0", "-sphere_inertia 0")
MIRRORS = tuple(f"-grid_resolution {n} -ts_dt 0.2 -box_mirror {mirror}" for n in (24, 32) for mirror in ("whole", "none"))  # of scenes that are computed on half of the box
STOKES_KNOBS = tuple(knob.replace("extend", "stokes") for knob in POLYMER_KNOBS)  # where extend is the rule that a scene gets


@dataclasses.dataclass
class Scene:
    name: str
    title: str
    options: str
    end: float             # of a run
    unit: float            # the scene's own time: 1/shear rate, or radius over Stokes velocity
    measure: Callable      # rows of the trajectory -> numbers
    exact: list            # of these numbers; None: from the finest runs
    error: Callable        # numbers, reference -> relative error
    meshes: tuple          # the factorial: 1/h ...
    steps: tuple           # ... and dt in units
    base: tuple            # 1/h and dt in units of the star's centre
    knobs: tuple
    more: tuple = ()       # further cases
    thesis_dt: float = 0.001
    thesis_steps: int = 3
    thesis_error_step: float = 0.05   # in units: the step of the run that gives the thesis's error
    thesis_error_scheme: str = "lie"
    thesis_error_mesh: int = 48
    thesis_error_options: str = ""
    thesis_cost_of: str = ""          # the scene whose steps cost as much, where they are too dear to be timed twice
    polymer: bool = False

    def point(self, resolution, step, knob=""):
        return f"-grid_resolution {resolution} -ts_dt {step * self.unit:.6g} {knob}".strip()

    @property
    def thesis(self):
        return f"-grid_resolution 48 -ts_dt {self.thesis_dt} {THESIS_POLYMER if self.polymer else THESIS}"

    @property
    def thesis_error(self):
        return self.point(self.thesis_error_mesh, self.thesis_error_step, (THESIS_POLYMER if self.polymer else THESIS).replace("lie", self.thesis_error_scheme) + self.thesis_error_options)

    def cases(self):
        """As options; strang everywhere but where a case says otherwise."""
        star = [self.point(*self.base, knob) for knob in self.knobs]
        factorial = [self.point(resolution, step) for resolution in self.meshes for step in self.steps]
        return [*(f"-accuracy {name}" for name in PRESETS), *factorial, self.thesis, *star, *self.more]

    def plain(self, rows):
        """{(1/h, dt): values} of the runs in which no other knob is turned."""
        return {(float(row["resolution"]), float(row["dt"])): numpy.array([float(x) for x in row["values"].split()]) for row in rows
                if row["values"] and row["case"] == f"-grid_resolution {row['resolution']} -ts_dt {row['dt']}"}

    def reference(self, rows):
        """The exact values, or Richardson's estimates of second order: in h from the two finest meshes with a step in common, in dt from the finest mesh with two steps."""
        if self.exact is not None:
            return numpy.array(self.exact)
        runs = self.plain(rows)
        steps = sorted({dt for _, dt in runs if sum(dt == other for _, other in runs) > 1})
        if not steps or max(n for n, dt in runs if dt == steps[0]) < max(n for n, _ in runs):
            return None
        coarse, fine = sorted(n for n, dt in runs if dt == steps[0])[-2:]
        best = runs[fine, steps[0]]
        value = best + (best - runs[coarse, steps[0]]) / ((fine / coarse) ** 2 - 1)
        for mesh in sorted({n for n, _ in runs}, reverse=True):
            longer = sorted(dt for n, dt in runs if n == mesh and dt > steps[0])
            if longer and (mesh, steps[0]) in runs:
                return value + (runs[mesh, steps[0]] - runs[mesh, longer[0]]) / ((longer[0] / steps[0]) ** 2 - 1)
        return value


def relative(values, reference):
    """The largest relative error."""
    return float(numpy.max(numpy.abs(numpy.asarray(values) / reference - 1)))


def apart(values, reference):
    """The largest distance of two paths (x1, x3 at the same times) over the radius."""
    return float(numpy.linalg.norm((numpy.asarray(values) - reference).reshape(-1, 2), axis=1).max() / 0.1)


def at(rows, times, sphere=0):
    """x1 and x3 of a sphere at the given times, one after the other."""
    t = rows[:, 0, 0]
    return [float(numpy.interp(time, t, rows[:, sphere, column])) for time in times for column in (X1, X3)]


def falling(rows):
    """Mean speed over the second half of the run, and the distance fallen."""
    half = float(numpy.interp(rows[-1, 0, 0] / 2, rows[:, 0, 0], rows[:, 0, X1]))
    return [-(rows[-1, 0, X1] - half) / (rows[-1, 0, 0] / 2), rows[0, 0, X1] - rows[-1, 0, X1]]


def turning(rows):
    return [abs(rows[-1, 0, OMEGA2])]


def passing(rows):
    """Times at which the spheres cross x1 = 0 and at which they are back at abs(x1) = 0.5, or the end of the run."""
    t, x = rows[:, 0, 0], rows[:, 0, X1] - rows[:, 1, X1]
    times = []
    for place in (0.0, 1.0):
        beyond = numpy.nonzero(x > place)[0]
        k = beyond[0] if len(beyond) else 0
        times.append(float(t[k - 1] + (t[k] - t[k - 1]) * (place - x[k - 1]) / (x[k] - x[k - 1])) if k else float(t[-1]))
    return times


SETTLE_V, SETTLE_TAU = 1.010834 * 1.0896278, 1.5 * 1.010834 * 1.0896278 / (0.5 * 980.665)
SETTLE_END = 0.1
SETTLE = "-box_size 2,2,2 -gravity -980.665,0,0 -sphere_radius 0.1 -sphere_density 1.5 -sphere_centers 0.005,0.01,0 -ts_split_scheme strang"
SHEAR = "-wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0 -ts_split_scheme strang"
TURN = "-box_size 1,1,1 -sphere_radius 0.1 -sphere_centers 0.006,0.014,0 -fluid_model oldroyd_b " + SHEAR
PAIR = "-box_size 3,2,1 -sphere_radius 0.1 " + SHEAR
MEETING = " -sphere_centers -0.5,0,{0},0.5,0,-{0}"
PATH = [-0.300640, 0.098920, -0.109746, 0.101935, 0.091473, 0.103810, 0.281375, 0.098784]

SCENES = {scene.name: scene for scene in (
    Scene("settling", "settling between two walls, Newtonian", SETTLE, SETTLE_END, 0.1 / 1.0896278, falling,
          [SETTLE_V, SETTLE_V * (SETTLE_END - SETTLE_TAU)], relative, (16, 24, 32, 48), (0.1, 0.05, 0.02), (32, 0.05), NEWTONIAN_KNOBS,
          thesis_error_step=0.1, thesis_error_scheme="strang"),
    Scene("rotation", "rotation between two walls, Newtonian, K = 0.3", "-box_size 2,2,1 -sphere_radius 0.15 -sphere_centers 0.006,0.014,0 " + SHEAR, 1.0, 1.0, turning,
          [0.494559], relative, (16, 24, 32, 48), (0.1, 0.05), (32, 0.1), NEWTONIAN_KNOBS, thesis_error_step=0.1, thesis_error_options=" -sphere_inertia 0 -ts_max_steps 0"),
    Scene("rotation_wi05", "rotation, Oldroyd-B, Wi = 0.5", TURN + " -fluid_relaxation_time 0.5", 4.0, 1.0, turning, [0.4549], relative, (16, 24, 32, 48),
          (0.2, 0.1, 0.05), (32, 0.1), (*POLYMER_KNOBS, "-polymer_coupling explicit -ts_dt 0.025"), thesis_error_step=0.025, polymer=True),
    Scene("rotation_wi1", "rotation, Oldroyd-B, Wi = 1", TURN + " -fluid_relaxation_time 1", 10.0, 1.0, turning, [0.3780], relative, (16, 24, 32, 48),
          (0.2,), (24, 0.2), STOKES_KNOBS, more=("-grid_resolution 24 -ts_dt 0.1", "-grid_resolution 24 -ts_dt 0.05"), thesis_error_step=0.025, thesis_cost_of="rotation_wi05", polymer=True),
    Scene("pair", "pair that passes, Newtonian, D = 1", PAIR + MEETING.format(0.1), 8.0, 1.0, lambda rows: at(rows, (2, 4, 6, 8)), PATH, apart, (16, 24, 32, 48),
          (0.2,), (24, 0.2), NEWTONIAN_KNOBS, more=("-grid_resolution 24 -ts_dt 0.1", "-grid_resolution 24 -ts_dt 0.05", "-grid_resolution 24 -ts_dt 0.2 -lubrication false", "-grid_resolution 32 -ts_dt 0.2 -lubrication false", "-grid_resolution 26 -ts_dt 0.2", *MIRRORS),
          thesis_steps=2, thesis_error_step=0.2, thesis_error_scheme="strang"),
    Scene("pair_wi05", "pair that passes, Oldroyd-B, D = 1, Wi = 0.5", PAIR + MEETING.format(0.1) + " -fluid_model oldroyd_b -fluid_relaxation_time 0.5", 6.0, 1.0,
          lambda rows: at(rows, (2, 4, 6)), None, apart, (16, 24, 32), (0.2,), (24, 0.2), STOKES_KNOBS,
          more=("-grid_resolution 24 -ts_dt 0.1", "-grid_resolution 24 -ts_dt 0.05", "-grid_resolution 32 -ts_dt 0.1", "-grid_resolution 48 -ts_dt 0.1", "-grid_resolution 32 -ts_dt 0.025", "-grid_resolution 48 -ts_dt 0.025", *MIRRORS), thesis_error_step=0.01, thesis_cost_of="pair", polymer=True),
    Scene("pair_close", "pair that passes closely, Newtonian, D = 0.5", PAIR + MEETING.format(0.05), 24.0, 1.0, passing, [10.937, 21.874], relative, (16, 24, 32),
          (0.2,), (24, 0.2), NEWTONIAN_KNOBS[:1], more=("-grid_resolution 24 -ts_dt 0.1", "-grid_resolution 32 -ts_dt 0.2 -lubrication false", *MIRRORS), thesis_error_step=0.2, thesis_error_scheme="strang", thesis_error_mesh=32, thesis_cost_of="pair"),
)}
