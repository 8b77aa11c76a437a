"""The cells of tools/extremes: for every axis its scenes, what is measured there, and between which bounds it must lie.

Scenes are dictionaries of keys of dlmfd. A cell that must end with a message instead of a result names it (message: a regular expression).
"""
import functools
import inspect
import math
from dataclasses import dataclass, field

import numpy

PI = math.pi


@dataclass
class Cell:
    axis: str
    value: str
    scene: dict
    measure: str              # a name in MEASURES of tools/extremes
    low: float = -math.inf
    high: float = math.inf
    ranks: int = 1
    against: dict = None      # the scene that the measure compares with
    factors: dict = field(default_factory=dict)  # units of the cell over those of that scene: mu, L, T
    message: str = ""
    may_end: str = ""         # a message that is as good as a result
    below: str = ""           # value of a cell of the same axis that measures more
    above: str = ""           # and of one that measures less
    quick: bool = False


SHEAR = dict(box_size="1,1,1", grid_resolution=16, wall_velocity_lower="-0.5,0,0", wall_velocity_upper="0.5,0,0", sphere_radius=0.2, sphere_centers="0,0,0",
             sphere_inertia=0, ts_split_scheme="strang", ts_dt=0.1, ts_max_time=1)
ROTATE = SHEAR | dict(sphere_motion="rotate")
OLDROYD = dict(fluid_model="oldroyd_b", fluid_relaxation_time=0.5)
SETTLE = dict(box_size="1,1,1", box_periodic="1,1,1", grid_resolution=16, sphere_radius=0.2, sphere_centers="0.01,0.02,0.03", sphere_inertia=0, sphere_density=2,
              gravity="-100,0,0", ts_dt=0.01, ts_max_steps=1)
PAIR = SHEAR | dict(box_size="2,1,1", sphere_radius=0.15, sphere_centers="-0.3,0.02,0.1,0.3,-0.02,-0.1", ts_dt=0.05, ts_max_time=0.25)


def numbers(*values):
    return ",".join(repr(float(x)) for x in values)


def hasimoto(scene):
    """Speed of a simple cubic array of settling spheres (Hasimoto 1959, Sangani and Acrivos 1982), unit cube, viscosity 1."""
    a, weight = scene["sphere_radius"], abs(scene["sphere_density"] - 1) * 100
    phi = 4 / 3 * PI * a**3
    drag = 1 / (1 - 1.7601 * phi**(1 / 3) + phi - 1.5593 * phi**2 + 3.9799 * phi**(8 / 3) - 3.0734 * phi**(10 / 3))
    return weight * phi / (6 * PI * a * drag)


def weissenberg():
    """
    The rate falls with Wi in a steady flow; from 10 on the fluid, a soft solid at first, is still on its way there at t = 20. Steps of 0.1 are too long for its
    stretch then.
    """
    yield Cell("Wi", "0", ROTATE, "omega", 0.45, 0.5, quick=True)
    before = "0"
    for wi, form, end in ((0.01, "factor", 1), (0.1, "factor", 1), (0.5, "factor", 3), (1, "factor", 5), (2, "factor", 10), (5, "factor", 25), (5, "log", 25),
                          (10, "factor", 20), (10, "log", 20), (20, "log", 20), (50, "log", 20), (100, "log", 20)):
        scene = ROTATE | dict(fluid_model="oldroyd_b", fluid_relaxation_time=wi, ts_dt=0.02 if wi < 0.1 else 0.1 if wi < 10 else 0.05, ts_max_time=end, polymer_form=form)
        yield Cell("Wi", f"{wi} {form}", scene, "omega", 0.02, 0.5, below=before, quick=wi == 0.5)
        before = f"{wi} {form}" if wi < 5 else ""
    far = ROTATE | dict(fluid_model="oldroyd_b", fluid_relaxation_time=10, polymer_form="log", ts_max_time=40)
    yield Cell("Wi", "10 log, dt = 0.1, to t = 40", far, "omega", 0.02, 0.5, may_end="lost positivity")
    yield Cell("Wi", "10 log, adapted steps, to t = 40", far | dict(ts_adapt_type="scene"), "omega", 0.02, 0.5, may_end="lost positivity")


def retardation():
    """With no polymer (1) the flow is the Newtonian one; without a solvent (0, ucm) only the both-sides coupling can solve it."""
    for ratio in (1, 0.5, 0.125, 0.01, 1e-4, 0):
        scene = ROTATE | OLDROYD | dict(fluid_retardation_time=ratio * 0.5, ts_max_time=3)
        if ratio == 1:
            yield Cell("lambda2/lambda1", "1 and Newtonian", scene, "difference", 0, 1e-6, against=ROTATE | dict(ts_max_time=3))
        yield Cell("lambda2/lambda1", repr(ratio), scene, "omega", 0.3, 0.505, quick=ratio == 0)
    yield Cell("lambda2/lambda1", "0 ucm, pair", PAIR | OLDROYD | dict(fluid_model="ucm"), "largest_speed", 0, 0.5)
    yield Cell("lambda2/lambda1", "0 explicit", ROTATE | OLDROYD | dict(fluid_retardation_time=0, polymer_coupling="explicit"), "omega", message="no solvent viscosity")


def carreau():
    """A settling sphere thins the fluid around it and is the faster the smaller n; a turning one keeps about half the shear rate."""
    before = ""
    for n in (1, 0.8, 0.5, 0.3, 0.1, 0.01):
        fluid = dict(fluid_model="carreau", fluid_relaxation_time=1, fluid_retardation_time=1, fluid_carreau_n=n)
        yield Cell("Carreau n", f"{n} rotation", ROTATE | fluid | dict(ts_max_time=2), "omega", 0.4, 0.55, quick=n == 0.1)
        yield Cell("Carreau n", f"{n} settling", SETTLE | fluid | dict(ts_max_steps=40), "speed", 0.99 * hasimoto(SETTLE), 40 * hasimoto(SETTLE), above=before)
        before = f"{n} settling"
        yield Cell("Carreau n", f"{n} with polymer", ROTATE | fluid | dict(fluid_retardation_time=0.125, ts_max_time=3), "omega", 0.3, 0.52)


def time_step():
    """
    Steps of 1e-4 to 1 at a shear rate of 1, 100 short ones or up to t = 4: a pair that passes, a sphere that turns, a pair all but touching, a sphere that settles on
    a wall. Friction across the gap keeps Newtonian pairs; in Oldroyd-B the repulsion is all there is, and too long a step may carry a sphere through a wall, which ends
    the run.
    """
    for dt in (1e-4, 1e-3, 1e-2, 0.1, 0.5, 1):
        end = 4 if dt >= 0.1 else 100 * dt
        for name, model in (("", {}), (" Oldroyd-B", OLDROYD)):
            scene = PAIR | model | dict(ts_dt=dt, ts_max_time=end)
            yield Cell("dt", f"{dt}{name}, pair", scene, "largest_speed", 0, 0.5, quick=dt == 1, may_end="left the box")
        yield Cell("dt", f"{dt} Oldroyd-B", ROTATE | OLDROYD | dict(ts_dt=dt, ts_max_time=end), "omega", 0.35, 0.505)
    for dt in (0.01, 0.1, 1):
        for scheme in ("lie", "strang"):
            near = "-0.155,0,0.02,0.155,0,-0.02"
            steps = dict(ts_dt=dt, ts_max_time=max(2, 4 * dt), ts_split_scheme=scheme)
            yield Cell("dt", f"{dt} {scheme}, pair at h/6", PAIR | steps | dict(sphere_centers=near), "last_gap", -0.5, 2)
            settling = SHEAR | steps | dict(sphere_centers="0,0,-0.25", sphere_density=2, gravity="0,0,-10")
            yield Cell("dt", f"{dt} {scheme}, settles on a wall", settling, "smallest_gap_h", -1, 1)


def radius():
    """A settling sphere of a cubic array against Hasimoto's speed: within 10 % below a = 3 h and 2 % from there on; a sphere that turns in shear."""
    for ratio in (1.2, 1.5, 2, 3, 4, 6, 8, 12):
        n = 16 if ratio <= 4 else 32 if ratio <= 8 else 48
        scene = SETTLE | dict(grid_resolution=n, sphere_radius=ratio / n)
        off = 0.1 if ratio < 3 else 0.02
        yield Cell("a/h", f"{ratio} settling", scene, "over_hasimoto", 1 - off, 1 + off, quick=ratio == 1.2)
        yield Cell("a/h", f"{ratio} rotation", ROTATE | dict(grid_resolution=n, sphere_radius=ratio / n, ts_max_time=0.1), "omega", 0.45, 0.52)
    for ratio in (1.2, 3, 6):
        n = 16 if ratio <= 4 else 32
        yield Cell("a/h", f"{ratio} Oldroyd-B", ROTATE | OLDROYD | dict(grid_resolution=n, sphere_radius=ratio / n), "omega", 0.3, 0.5)
    yield Cell("a/h", "1.19", SETTLE | dict(sphere_radius=1.19 / 16), "speed", message="too small for the mesh")


def gap():
    """Settling in line a pair is the faster the closer it is; a pair in shear moves no faster than the walls, and repulsion at touching not faster than that."""
    h, a, before = 1 / 24, 0.15, ""
    for gaps in (3, 2, 1, 0.5, 0.25, 0.125, 0.0625, 1e-3, 0):
        x = a + gaps * h / 2
        name = f"{gaps:g} h"
        shear = PAIR | dict(grid_resolution=24, sphere_centers=numbers(-x, 0, 0, x, 0, 0))
        yield Cell("gap", f"{name}, shear", shear, "largest_speed", 0, 1, quick=gaps == 0)
        yield Cell("gap", f"{name}, Oldroyd-B", shear | OLDROYD, "largest_speed", 0, 1)
        settle = SETTLE | dict(box_size="2,1,1", grid_resolution=24, sphere_radius=a, sphere_centers=numbers(-x, 0, 0, x, 0, 0))
        yield Cell("gap", f"{name}, settling", settle, "mean_speed", 0.3, 0.5, above=before)
        before = f"{name}, settling"
    yield Cell("gap", "-h/100", PAIR | dict(grid_resolution=24, sphere_centers=numbers(-a + h / 200, 0, 0, a - h / 200, 0, 0)), "largest_speed", message="overlap")


def blockage():
    """A sphere of diameter K times the distance of the walls between which it turns."""
    for k in (0.2, 0.5, 0.7, 0.8, 0.9, 0.96):
        scene = ROTATE | dict(box_size="1.5,1.5,1", grid_resolution=24, sphere_radius=k / 2, ts_max_time=0.1)
        yield Cell("blockage K", f"{k}", scene, "omega", 0.2, 0.52)
        yield Cell("blockage K", f"{k} Oldroyd-B", scene | OLDROYD | dict(ts_max_time=1), "omega", 0.1, 0.5, quick=k == 0.9)


def wall():
    """Spheres at a wall, free in shear or pressed on it: they stay between the walls, and move no faster than these."""
    for gaps in (1, 0.25, 0.125, 0):
        at = SHEAR | dict(sphere_centers=numbers(0.01, 0, -0.3 + gaps / 16), ts_dt=0.05, ts_max_time=1)
        yield Cell("wall", f"gap {gaps} h, free", at, "largest_speed", 0, 0.5, quick=gaps == 0)
        yield Cell("wall", f"gap {gaps} h, Oldroyd-B", at | OLDROYD, "largest_speed", 0, 0.5)
        yield Cell("wall", f"gap {gaps} h, pressed on it", at | dict(sphere_density=2, gravity="0,0,-10"), "smallest_gap_h", -1, 1.1)
        yield Cell("wall", f"gap {gaps} h, volume points", at | dict(pairing_points="volume", pairing_type="collocation"), "largest_speed", 0, 0.51)
    yield Cell("wall", "both walls touched", SHEAR | dict(sphere_radius=0.5, box_size="2,2,1"), "largest_speed", 0, 0.5, may_end="left the box")
    yield Cell("wall", "a corner of six walls", SHEAR | dict(box_periodic="0,0,0", sphere_centers="-0.3,-0.3,-0.3", ts_dt=0.05), "largest_speed", 0, 0.5)
    yield Cell("wall", "beyond the wall", SHEAR | dict(sphere_centers="0,0,-0.31"), "largest_speed", message="overlaps the lower wall")


def density():
    """Without inertia the terminal speed at once; with it the solution of M dV/dt = W - V W/V_end. At equal density: no motion."""
    for rho in (1e-3, 1e-2, 0.1, 1, 10, 100, 1e3):
        still = SETTLE | dict(sphere_density=rho, gravity="-1,0,0")
        yield Cell("density ratio", f"{rho:g}", still, "over_hasimoto_signed" if rho != 1 else "speed", *((0.98, 1.02) if rho != 1 else (0, 1e-12)))
        moving = still | dict(sphere_inertia=1, ts_dt=0.05, ts_max_steps=10)
        bounds = (0.98, 1.02) if rho != 1 else (0, 1e-12)
        yield Cell("density ratio", f"{rho:g} with inertia", moving, "over_exact" if rho != 1 else "speed", *bounds, quick=rho in (1e-3, 1e3))
        turning = SHEAR | OLDROYD | dict(sphere_density=rho, sphere_inertia=1, sphere_centers="0,0,0.1")
        yield Cell("density ratio", f"{rho:g} with inertia, shear, Oldroyd-B", turning, "omega", 0, 0.55)


@functools.lru_cache(None)
def packing(count, volume, seed=1):
    """Radius and centres of spheres that fill that part of the unit box between walls at x3 = -0.5 and 0.5, placed one by one at random without overlap."""
    a = (3 * volume / (4 * PI * count))**(1 / 3)
    draw, centers = numpy.random.default_rng(seed), numpy.empty((0, 3))
    while len(centers) < count:
        x = draw.uniform([-0.5, -0.5, a - 0.5], [0.5, 0.5, 0.5 - a])
        apart = abs(centers - x)
        apart[:, :2] = numpy.minimum(apart[:, :2], 1 - apart[:, :2])
        if (numpy.linalg.norm(apart, axis=1) > 2.02 * a).all():
            centers = numpy.vstack([centers, x])
    return a, numbers(*centers.ravel())


def many():
    """At random; dense blocks of at most 1000 unknowns (-saddle_cluster_limit) keep 200 spheres at 30 % to minutes."""
    for count, volume, n in ((1, 0.03, 16), (8, 0.1, 16), (27, 0.2, 24), (64, 0.3, 24), (200, 0.05, 32), (200, 0.3, 32)):
        a, centers = packing(count, volume)
        scene = SHEAR | dict(grid_resolution=n, sphere_radius=a, sphere_centers=centers, ts_dt=0.02, ts_max_steps=2, saddle_cluster_limit=1000)
        name = f"{count} spheres, {100 * volume:g} %"
        yield Cell("many spheres", name, scene, "mean_omega", 0.35, 0.75, quick=count == 8)
        if count < 200:
            yield Cell("many spheres", f"{name}, Oldroyd-B", scene | OLDROYD | dict(ts_dt=0.1), "mean_omega", 0.25, 0.75)
    heap = scene | dict(ts_max_steps=1)
    yield Cell("many spheres", "200 spheres, 30 %, Oldroyd-B", heap | OLDROYD | dict(ts_dt=0.1), "mean_omega", 0.3, 0.75)
    yield Cell("many spheres", "200 spheres, 30 %, settling", heap | dict(sphere_density=2, gravity="-100,0,0", sphere_inertia=1), "largest_speed", 0, 2)
    a, centers = packing(27, 0.2)
    long = SHEAR | dict(grid_resolution=24, sphere_radius=a, sphere_centers=centers, ts_dt=1, ts_max_time=3)
    yield Cell("many spheres", "27 spheres, 20 %, dt = 1", long, "largest_speed", 0, 2, may_end="left the box")


def aspect():
    """Boxes of 1:20 in every direction, with two and with one periodic axis; the exact pressure solve and, beyond its memory limit, the iterative one; the thinnest mesh."""
    for size in ("1,1,20", "1,20,1", "20,1,1", "20,20,1"):
        x = [float(s) for s in size.split(",")]
        walls = dict(wall_velocity_lower=numbers(-x[2] / 2, 0, 0), wall_velocity_upper=numbers(x[2] / 2, 0, 0))
        yield Cell("box aspect", size, ROTATE | walls | dict(box_size=size, grid_resolution=8, ts_max_time=0.1), "omega", 0.4, 0.52, quick=size == "1,1,20")
        if size != "20,20,1":
            yield Cell("box aspect", f"{size} Oldroyd-B", ROTATE | OLDROYD | walls | dict(box_size=size, grid_resolution=8, ts_max_time=0.5), "omega", 0.3, 0.52)
            closed = walls | dict(box_size=size, grid_resolution=8, ts_max_time=0.1, box_periodic="1,0,0" if size != "1,20,1" else "0,1,0")
            yield Cell("box aspect", f"{size}, one periodic axis", ROTATE | closed, "omega", 0.0, 0.55)
    tall = ROTATE | dict(box_size="1,1,20", grid_resolution=8, ts_max_time=0.1, wall_velocity_lower="-10,0,0", wall_velocity_upper="10,0,0")
    yield Cell("box aspect", "1,1,20 beyond -stokes_block_limit", tall | dict(stokes_block_limit=0.1), "difference", 0, 1e-8, against=tall, quick=True)
    yield Cell("box aspect", "1,1,0.25, 4 cells", dict(ROTATE, box_size="1,1,0.25", sphere_radius=0.1, ts_max_time=0.2), "omega", 0, 2)


def ranks():
    """The same pair on 1 to 8 ranks, compared with one rank; meshes too thin for so many."""
    pair = PAIR | dict(saddle_rtol=1e-12)
    for n in range(1, 9):
        for name, model in (("", {}), (" Oldroyd-B", OLDROYD)):
            yield Cell("ranks", f"{n}{name}", pair | model, "difference", 0, 1e-8, ranks=n, against=pair | model, quick=n == 3 and not model)
        thin = pair | dict(box_size="1,1,0.25", sphere_radius=0.09, sphere_centers="0.3,0,0,-0.3,0.1,0")
        yield Cell("ranks", f"{n}, 16 x 16 x 4 cells", thin, "difference", 0, 1e-8, ranks=n, against=thin, message="" if n not in (5, 7) else "ranks cannot share a mesh")
    yield Cell("ranks", "8, 4 x 4 x 4 cells", dict(box_size="1,1,1", grid_resolution=4), "time", ranks=8, message="ranks cannot share a mesh")


def tolerance():
    """The pair at -saddle_rtol 1e-2 to 1e-14, compared with 1e-13."""
    for name, model in (("", {}), (" Oldroyd-B", OLDROYD)):
        exact = PAIR | model | dict(saddle_rtol=1e-13)
        for rtol in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14):
            yield Cell("tolerance", f"{rtol:g}{name}", exact | dict(saddle_rtol=rtol), "difference", 0, max(20 * rtol, 1e-10), against=exact, quick=rtol == 1e-12)
    yield Cell("tolerance", "1e-15", PAIR | dict(saddle_rtol=1e-15), "difference", message="allowed")


UNITS = dict(box_size="L", grid_resolution="1/L", wall_velocity_lower="L/T", wall_velocity_upper="L/T", gravity="L/T/T", fluid_viscosity="mu", fluid_density="mu*T/L/L",
             sphere_density="mu*T/L/L", fluid_relaxation_time="T", fluid_retardation_time="T", sphere_radius="L", sphere_centers="L", ts_dt="T", ts_max_time="T")


def scaled(scene, **units):
    """The same scene in other units of viscosity, length and time."""
    unit = {"mu": 1.0, "L": 1.0, "T": 1.0} | units
    scale = {key: eval(text, {}, unit) for key, text in UNITS.items()}  # the texts above
    return {key: numbers(*(float(x) * scale[key] for x in str(value).split(","))) if key in scale else value for key, value in scene.items()}


def units():
    """
    The same scene in other units of viscosity, length and time gives the same numbers: contact, gravity, inertia and polymer at once; a thinning fluid; one periodic
    axis; the thesis's splitting, points and solver.
    """
    heavy = PAIR | dict(fluid_viscosity=1, fluid_density=1, sphere_density=3, sphere_inertia=1, gravity="1,0,-2", sphere_centers="-0.155,0,0.03,0.155,0,-0.03")
    carreau = heavy | dict(fluid_model="carreau", fluid_relaxation_time=1, fluid_retardation_time=0.125, fluid_carreau_n=0.5)
    explicit = heavy | OLDROYD | dict(ts_split_scheme="lie", polymer_form="log", polymer_coupling="explicit", ts_dt=0.01, ts_max_time=0.05)
    volume = heavy | dict(pairing_points="volume", pairing_type="collocation", ts_max_time=0.1, saddle_rtol=1e-12)
    bases = {"pair": heavy, "pair, Oldroyd-B": heavy | OLDROYD, "Carreau": carreau, "lie, log, explicit": explicit, "volume points": volume,
             "one periodic axis": heavy | dict(box_periodic="1,0,0", ts_max_time=0.1), "Uzawa": heavy | dict(saddle_split="velocity", ts_max_time=0.05, saddle_rtol=1e-10)}
    for name, base in bases.items():
        for factor in (dict(mu=1e-6), dict(mu=1e6), dict(L=1e-6), dict(L=1e3), dict(T=1e-6), dict(T=1e6), dict(mu=1e-6, L=1e-6, T=1e3)):
            text = ", ".join(f"{key} x {value:g}" for key, value in factor.items())
            yield Cell("units", f"{name}: {text}", scaled(base, **factor), "difference", 0, 1e-10, against=base, factors=factor,
                       quick=name in ("pair, Oldroyd-B", "Uzawa") and len(factor) == 3)


AXES = (weissenberg, retardation, carreau, time_step, radius, gap, blockage, wall, density, many, aspect, ranks, tolerance, units)


@functools.lru_cache(None)
def all_cells():
    return [cell for axis in AXES for cell in axis()]


def about():
    """What the tool's page says of every axis."""
    return {next(axis()).axis: inspect.cleandoc(axis.__doc__) for axis in AXES}
