#!/usr/bin/env python3
"""How tools/dlmreference.py measures and compares: paths and scenes that are known, and every row of tools/reference.csv.

    reference.py
"""
import os
import sys

import numpy

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools"))
sys.dont_write_bytecode = True

import dlmplot  # noqa: E402
import dlmreference  # noqa: E402

failed = 0


def check(good, text):
    global failed
    failed += not good
    print(("ok      " if good else "FAILED  ") + text, flush=True)


class Pair:
    """A run with two spheres of radius 0.1, shear rate 2; half differences of the centres over the radius are given, times times the rate."""

    def __init__(self, x1, x3):
        self.radii, self.shear = numpy.array([0.1, 0.1]), (2.0, 0, 2, 1)
        t, x1, x3 = numpy.arange(len(x1)), numpy.array(x1, float), numpy.array(x3, float)
        self.paths = [{"time": t / 2, "x1": 0.7 + 0.1 * sign * x1, "x3": 0.1 * sign * x3} for sign in (1, -1)]


def outcome(run):
    """Word, crossing time, time back; or why not."""
    try:
        word, crossed = dlmreference.crossings(run)
        return f"{word} {crossed:.4f} {dlmreference.time_back(run)[0]:.4f}"
    except dlmreference.NotYet as why:
        return str(why)


PAIRS = (
    ("pass 2.5000 4.6667", [-5, -3, -1, 1, 3, 6], [1, 1, 1, 1, 1, 1]),
    ("pass 2.5000 4.6667", [5, 3, 1, -1, -3, -6], [-1, -1, -1, -1, -1, -1]),  # the other order
    ("return 2.2500 4.5000", [-5, -3, -2, -2, -4, -6], [1, 0.5, 0.25, -0.75, -1, -1]),
    ("neither passed nor turned round until rate times t = 2, the end of the run", [-5, -3, -1], [1, 1, 1]),
    ("not back until rate times t = 4, the end of the run", [-5, -3, -1, 1, 3], [1, 1, 1, 1, 1]),
    ("not back until rate times t = 5, the end of the run", [-5, -1, 1, -1, 1, -1], [1, 1, -1, -1, 1, 1]),  # a chain
)


def pairs():
    for expected, x1, x3 in PAIRS:
        found = outcome(Pair(x1, x3))
        check(found == expected, f"x1 {x1}, x3 {x3}: {found}; expected {expected}")
    word = dlmreference.crossings(Pair([-5, -1, 1, -1, 1, -1], [1, 1, -1, -1, 1, 1]))[0]
    check(word == "chain", f"a pair that crosses again and again: {word}")
    check(dlmreference.place_at(Pair([-5, -3, -1, 1], [1, 1, 2, 1]), "3", 1.5)[0] == 1.5, "a place between two rows")
    for x3, expected in ((0.4, "closer"), (1.1, "farther")):
        word = dlmreference.leaving(Pair([-5, -3, -1, 1, 3, 7], [1, 1, 1, 1, x3, x3]))[0]
        check(word == expected, f"a pair that leaves at {x3} of its height: {word}")


ALONG, ACROSS, SHEARED = (1, 0, 0), (0, 1, 0), ((-1, 0, 0), (1, 0, 0))
DRIVES = (
    ("rest", {}),
    ("rest", {"walls": (ALONG, ALONG)}),
    ("shear", {"walls": SHEARED}),
    ("other", {"walls": (ALONG, ACROSS)}),
    ("settling", {"gravity": ALONG}),
    ("settling", {"force": ALONG}),
    ("rest", {"gravity": ALONG, "force": (-4e-3 * numpy.pi / 3, 0, 0)}),
    ("other", {"gravity": ACROSS}),
    ("other", {"torque": ALONG}),
    ("pressure", {"gradient": ALONG}),
    ("other", {"gradient": ALONG, "gravity": ALONG}),
    ("other", {"walls": SHEARED, "gradient": ALONG}),
    ("other", {"walls": SHEARED, "gravity": ALONG}),
)


def drive(walls=((0, 0, 0), (0, 0, 0)), gravity=(0, 0, 0), gradient=(0, 0, 0), force=(0, 0, 0), torque=(0, 0, 0)):
    """What drives a sphere of density 2 between walls of x3 at distance 1."""
    run = object.__new__(dlmplot.Run)
    spheres = [{"radius": 0.1, "density": 2, "force": force, "torque": torque}]
    run.scene = {"fluid_density": 1, "gravity": gravity, "pressure_gradient": gradient, "spheres": spheres}
    run.scene |= {"wall_velocity_lower": walls[0], "wall_velocity_upper": walls[1]}
    run.box, run.periodic = [1, 1, 1], [True, True, False]
    return dlmreference.drive_of(run)


CONDITIONS = (
    ("", None, True),
    ("20", 20.01, True),
    ("20", 20.1, False),
    ("10:", 12, True),
    ("10:", 9, False),
    ("0:0.25", 0.25, True),
    ("free|rotate", "rotate", True),
    ("free", "fixed", False),
    ("0.1|0.5", 0.5, True),
    ("1", None, False),
    ("0", 0.0, True),
    ("0", 0.01, False),
)


def rows():
    """Every row of the table has a measure, a value and a source; the rates of rotation are those of the literature."""
    for row in dlmreference.read_table():
        known = row["quantity"] in dlmreference.MEASURES or dlmreference.PLACE.match(row["quantity"])
        value = row["value"] if row["value"].isalpha() else eval(row["value"], {"Wi": 0.2, "s": 1.0, "b": 0.875, "n": 0.5, "exp": numpy.exp})
        check(None not in row.values() and bool(known) and row["source"] != "", f"{row['case']}: {row['quantity']} = {value}")
    points, (wi, series) = dlmreference.rotation_rates()
    check(points == [(0.0, 0.5, 0.0), (0.1, 0.49783, 1e-5), (0.5, 0.4555, 2e-4), (1.0, 0.3788, 3e-4)], f"rates of rotation {points}")
    check(abs(numpy.interp(0.1, wi, series) - 0.49783) < 1e-5, "their series for small Wi")


def main():
    pairs()
    for expected, scene in DRIVES:
        check(drive(**scene) == expected, f"what drives {scene or 'nothing'}: {drive(**scene)}, expected {expected}")
    for condition, value, fits in CONDITIONS:
        check(dlmreference.fits(condition, value) == fits, f"'{condition}' {'fits' if fits else 'does not fit'} {value}")
    rows()
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
