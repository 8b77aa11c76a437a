"""How a run compares with reference.csv, the table of exact and published values.

    comparisons(run)    what the table has for the scene of this run, measured in it
    nearest(run)        the row that comes closest to the scene, and what keeps it from fitting
    rotation_rates()    the table's rates of rotation in Oldroyd-B fluid, for plot_rotation

The columns of conditions are the keys of scene_of(): lengths over the radius a; for a pair half of the difference of its centres, for one sphere the
place of its centre at the start; Wi = lambda1 times the shear rate. phi: volume fraction. `value` is a number, a word, or an expression in Wi, s =
t/lambda1 at the end of the run, b = 1 - lambda2/lambda1, and Carreau's n. A quantity names one of MEASURES.
"""
import collections
import csv
import math
import os
import re

import numpy as np

from dlmplot import ToolError, last_tenth

Comparison = collections.namedtuple("Comparison", "case quantity value reference error uncertainty source note")
NOT_CONDITIONS = ("case", "quantity", "value", "uncertainty", "source")


class NotYet(Exception):
    """The run does not hold the quantity; the text says why."""


def read_table():
    name = os.path.join(os.path.dirname(os.path.abspath(__file__)), "reference.csv")
    with open(name, encoding="utf-8", newline="") as file:
        lines = [line for line in file if not line.startswith("#")]
    return [{key: value.strip() for key, value in row.items()} for row in csv.DictReader(lines, skipinitialspace=True)]


# The scene as the table sees it.


def push_of(scene):
    """Force on each sphere beside the fluid's: prescribed, and buoyancy."""
    return np.array(
        [
            np.array(s["force"]) + (s["density"] - scene["fluid_density"]) * 4 / 3 * math.pi * s["radius"] ** 3 * np.array(scene["gravity"])
            for s in scene["spheres"]
        ]
    )


def drive_of(run):
    """What moves the scene: shear (of walls normal to x3, along x1), settling or pressure (along x1), rest, or other."""
    scene, push = run.scene, push_of(run.scene)
    gradient = np.array(scene["pressure_gradient"])
    still = all(walls is None or not np.ptp(walls, axis=0).any() for walls in map(run.walls, range(3)))
    if any(np.any(sphere["torque"]) for sphere in scene["spheres"]) or sum(map(bool, (push.any(), gradient.any(), not still))) > 1:
        return "other"
    if push.any():
        return "settling" if not push[:, 1:].any() else "other"
    if gradient.any():
        return "pressure" if not gradient[1:].any() else "other"
    if still:
        return "rest"
    return "shear" if run.shear and run.shear[1:3] == (0, 2) else "other"


def scene_of(run):
    """What conditions may ask for. A key is absent where it has no meaning."""
    run.need_summary()
    scene, spheres = run.scene, run.scene["spheres"]
    try:
        mode = scene.get("polymer_mode_amplitude", 0.0)
        found = {
            "fluid": scene["fluid_model"],
            "drive": drive_of(run),
            "periodic": "".join("01"[int(x)] for x in scene["box_periodic"]),
            "spheres": len(spheres),
            "mode": scene["polymer_mode_plane"] if mode else "none",
            "motion": "|".join(sorted({sphere["motion"] for sphere in spheres})) or "none",
        }
    except KeyError as key:
        raise ToolError(f"{run.path('summary.json')} has no {key.args[0]}: it is of an older version") from None
    if found["fluid"] == "carreau" and scene["carreau_n"] == 1:
        found["fluid"] = "oldroyd_b"
    if run.wi:
        found.update({"Wi": run.wi, "lambda2/lambda1": scene["retardation_time"] / scene["relaxation_time"]})
    if spheres:
        found["phi"] = float(np.sum(4 / 3 * np.pi * run.radii**3) / np.prod(run.box))
    if len(set(run.radii)) == 1:
        a, centers = run.radii[0], np.array([sphere["center"] for sphere in spheres])
        found.update({f"L{d + 1}/a": run.box[d] / a for d in range(3)})
        middle = centers.mean(axis=0)
        place = centers[0] if len(centers) == 1 else (centers[0] - centers[1]) / 2 if len(centers) == 2 and abs(middle[2]) < 1e-3 * a else None
        if place is not None:
            found.update({f"x{d + 1}/a": abs(place[d]) / a for d in range(3)})
    return found


def fits(condition, value):
    if not condition:
        return True
    if value is None:
        return False
    if isinstance(value, str):
        return value in condition.split("|")
    low, colon, high = condition.partition(":")
    if colon:
        return float(low or -math.inf) <= value <= float(high or math.inf)
    return any(abs(value - float(word)) <= 1e-3 * max(abs(float(word)), 0.01) for word in condition.split("|"))


def mismatches(row, scene):
    return [key for key in row if key not in NOT_CONDITIONS and not fits(row[key], scene.get(key))]


# What is measured. Each returns (value, note); times are multiplied by the shear rate.


def settled(time, values):
    """Mean of the last tenth of a run; says so if it still changes."""
    tail = values[last_tenth(time)]
    change = abs(np.ptp(tail) / np.mean(tail)) if np.mean(tail) else 0.0
    return float(np.mean(tail)), f"still changing: by {100 * change:.2g} % over the last tenth of the run" if change > 1e-3 else ""


def settling_speed(run):
    stokes = push_of(run.scene)[0, 0] / (6 * math.pi * run.scene["fluid_viscosity"] * run.radii[0])
    return settled(run.paths[0]["time"], run.paths[0]["V1"] / stokes)


def rotation(run):
    rate, _, _, vorticity = run.shear
    return settled(run.paths[0]["time"], abs(run.paths[0][f"omega{vorticity + 1}"]) / rate)


def speed_beyond_walls(run):
    rate, flow, gradient, _ = run.shear
    beyond = run.paths[0][f"V{flow + 1}"] - run.walls(gradient).mean(axis=0)[flow]
    return settled(run.paths[0]["time"], abs(beyond) / (rate * run.box[gradient]))


def at_start(run, measure):
    """A measure in the first row, which balances the forces of C = I if the sphere has no inertia."""
    if run.scene["sphere_inertia"] or run.paths[0]["time"][0] > 0:
        raise NotYet("only runs from t = 0 without inertia (-sphere_inertia 0) begin with it")
    whole, run.paths = run.paths, [{name: column[:1] for name, column in path.items()} for path in run.paths]
    try:
        return measure(run)
    finally:
        run.paths = whole


def pair(run):
    """Time by the shear rate, and half of the difference of the two centres over a: x1 (negative at first), x3 (positive at first)."""
    first, second = run.paths
    if first["time"][0] > 0:
        raise NotYet(f"trajectory.csv starts at t = {first['time'][0]:.4g}")
    t = first["time"] * run.shear[0]
    x1, x3 = ((first[x] - second[x]) / (2 * run.radii[0]) for x in ("x1", "x3"))
    return t, x1 * -np.sign(x1[0] or 1), x3 * np.sign(x3[0] or 1)


def crossing(t, x, from_below=True):
    """First time at which x reaches 0 from its start, linear between rows, or None."""
    y = x if from_below else -x
    beyond = np.flatnonzero((y[1:] >= 0) & (y[:-1] < 0))
    if not len(beyond):
        return None
    k = beyond[0]
    return float(t[k] - y[k] * (t[k + 1] - t[k]) / (y[k + 1] - y[k]))


def crossings(run):
    """Word for what the pair does, and the time at which it crosses."""
    t, x1, x3 = pair(run)
    turns = np.count_nonzero(np.diff(np.sign(x1[x1 != 0])))
    over, under = crossing(t, x1), crossing(t, x3, from_below=False)
    if turns > 1:
        return "chain", over
    if over is None and under is None:
        raise NotYet(f"neither passed nor turned round until rate times t = {t[-1]:.4g}, the end of the run")
    return ("pass", over) if under is None or (over is not None and over < under) else ("return", under)


def time_back(run):
    t, x1, _ = pair(run)
    outcome, _ = crossings(run)
    sign = 1 if outcome == "pass" else -1
    met = int(np.argmax(x1 >= 0)) if outcome == "pass" else int(np.argmax(x1))
    back = crossing(t[met:], sign * x1[met:] - abs(x1[0]))
    if outcome == "chain" or back is None:
        raise NotYet(f"not back until rate times t = {t[-1]:.4g}, the end of the run")
    return back, ""


def leaving(run):
    """Whether a pair that has passed is closer to its mid-plane than it came, when it is as far apart again."""
    t, x1, x3 = pair(run)
    if crossings(run)[0] != "pass":
        raise NotYet("the pair does not pass")
    return "closer" if np.interp(time_back(run)[0], t, x3) < x3[0] else "farther", ""


def place_at(run, axis, time):
    t, *x = pair(run)
    if t[-1] < time * (1 - 1e-9):
        raise NotYet(f"the run ends at rate times t = {t[-1]:.4g}")
    return float(np.interp(time, t, x[axis == "3"])), ""


def field(run, name, step=-1):
    """Values [x3, x1] of a field in the plane x2 = 0 of a step; name C11, ... is a component of the conformation tensor."""
    try:
        fields = run.fields
    except ToolError as error:
        raise NotYet(str(error)) from None
    group = fields.steps[step]
    if name.startswith("C"):
        return fields.plane(group, "conformation", 1, 0.0)[2][..., fields.component(group, name[1:])]
    return fields.plane(group, name, 1, 0.0)[2]


def excess(run, column):
    """By how much the spheres raise a stress of bulk.csv over that of the fluid alone, over it and over the volume fraction."""
    if run.bulk is None or column not in run.bulk:
        raise NotYet(f"bulk.csv has no column {column}" if run.bulk else "the run has no bulk.csv")
    scene = scene_of(run)
    alone = run.scene["fluid_viscosity"] * run.shear[0] * (1 if column == "stress12" else 2 * (1 - scene["lambda2/lambda1"]) * scene["Wi"])
    return settled(run.bulk["time"], (run.bulk[column] / alone - 1) / scene["phi"])


def conformation(run, component):
    c = field(run, f"C{component}")
    return float(abs(c).max()), f"differs by {np.ptp(c):.1e} from place to place" if np.ptp(c) > 1e-6 else ""


def steady(run):
    if run.summary["time"] < 10 * run.scene.get("relaxation_time", 0.0):
        raise NotYet(f"not steady: the run ends at t = {run.summary['time']:.4g}, before ten relaxation times")


def poiseuille(run):
    steady(run)
    u = abs(field(run, "velocity")[..., 0]).max()
    return float(u * 8 * run.scene["fluid_viscosity"] / (abs(run.scene["pressure_gradient"][0]) * run.box[2] ** 2)), ""


def poiseuille_stress(run, component, power):
    """C13 over lambda1 u1', or C11 - 1 over 2 (lambda1 u1')^2, at x3 = -L3/4, where u1' = G L3/(4 eta1)."""
    steady(run)
    slope = abs(run.scene["pressure_gradient"][0]) * run.box[2] / (4 * run.scene["fluid_viscosity"])
    field(run, f"C{component}")
    _, heights, c = run.fields.plane(run.fields.steps[-1], "conformation", 1, 0.0)
    c = np.interp(-run.box[2] / 4, heights, c[:, 0, run.fields.component(run.fields.steps[-1], component)])
    return float((abs(c) - (power == 2)) / (power * (run.scene["relaxation_time"] * slope) ** power)), ""


def shear_stress(run):
    if run.bulk is None:
        raise NotYet("the run has no bulk.csv")
    return settled(run.bulk["time"], run.bulk["stress12"] / (run.scene["fluid_viscosity"] * run.shear[0]))


def decay(run, time):
    start, end = (abs(field(run, f"C{run.scene['polymer_mode_plane']}", step)).max() for step in (0, -1))
    span = run.fields.times[-1] - run.fields.times[0]
    if span <= 0:
        raise NotYet("fields.h5 has one step only")
    return float(-math.log(end / start) / span * run.scene[time]), ""


MEASURES = {
    "V1/V_Stokes": settling_speed,
    "omega/rate": rotation,
    "V1/(rate L3)": speed_beyond_walls,
    "V1/(rate L3) at the start": lambda run: at_start(run, speed_beyond_walls),
    "omega/rate at the start": lambda run: at_start(run, rotation),
    "outcome": lambda run: (crossings(run)[0], ""),
    "crossing time": lambda run: (crossings(run)[1], ""),
    "time back": time_back,
    "leaves the mid-plane": leaving,
    "smallest gap/a": lambda run: (run.summary["smallest_gap"] / run.radii[0], ""),
    "C11": lambda run: conformation(run, "11"),
    "C13": lambda run: conformation(run, "13"),
    "largest u1 / (G L3^2/(8 eta1))": poiseuille,
    "C13/(lambda1 u1') halfway to a wall": lambda run: poiseuille_stress(run, "13", 1),
    "(C11 - 1)/(2 (lambda1 u1')^2) halfway to a wall": lambda run: poiseuille_stress(run, "11", 2),
    "shear stress/(eta1 rate)": shear_stress,
    "excess of shear stress over phi": lambda run: excess(run, "stress12"),
    "excess of N1 over phi": lambda run: excess(run, "N1"),
    "decay rate times lambda1": lambda run: decay(run, "relaxation_time"),
    "decay rate times lambda2": lambda run: decay(run, "retardation_time"),
}
PLACE = re.compile(r"x([13])/a at (\S+)$")


def measure(run, quantity):
    place = PLACE.match(quantity)
    return place_at(run, place[1], float(place[2])) if place else MEASURES[quantity](run)


def reference_value(row, scene, run):
    """The value of a row: a word, or a number."""
    if re.fullmatch(r"[a-z]+", row["value"]):
        return row["value"]
    names = {
        "exp": math.exp,
        "Wi": scene.get("Wi"),
        "s": run.summary["time"] / run.scene.get("relaxation_time", 1.0),
        "b": 1 - scene.get("lambda2/lambda1", 1.0),
        "n": run.scene.get("carreau_n"),
    }
    return float(eval(row["value"], {"__builtins__": {}}, names))  # of our own table


def error_text(quantity, value, reference):
    if isinstance(reference, str):
        return "the same" if value == reference else "another"
    if PLACE.match(quantity):
        return f"{value - reference:+.4f} a"
    return f"{100 * (value / reference - 1):+.3f} %"


def comparisons(run):
    scene, found = scene_of(run), {}
    for row in read_table():
        quantity = row["quantity"]
        if quantity in found or mismatches(row, scene):
            continue
        reference, value, error = reference_value(row, scene, run), None, ""
        try:
            value, note = measure(run, quantity)
            error = error_text(quantity, value, reference)
        except NotYet as why:
            note = str(why)
        found[quantity] = Comparison(row["case"], quantity, value, reference, error, float(row["uncertainty"] or 0), row["source"], note)
    return list(found.values())


def nearest(run):
    """(case, [(condition, this scene's value, the table's)]) of the row with the fewest conditions that fail."""
    scene = scene_of(run)
    row = min(read_table(), key=lambda row: len(mismatches(row, scene)))
    return row["case"], [(key, scene.get(key, "none"), row[key]) for key in mismatches(row, scene)]


def rotation_rates():
    """Rows (Wi, rate, uncertainty) of single values, and the series with the range of Wi it holds for."""
    rows = [row for row in read_table() if row["quantity"] == "omega/rate" and row["fluid"] == "oldroyd_b"]
    points = [(float(row["Wi"]), float(row["value"]), float(row["uncertainty"])) for row in rows if ":" not in row["Wi"]]
    series = next(row for row in rows if ":" in row["Wi"])
    wi = np.linspace(*map(float, series["Wi"].split(":")), 50)
    return [(0.0, 0.5, 0.0), *points], (wi, eval(series["value"], {"__builtins__": {}}, {"Wi": wi}))
