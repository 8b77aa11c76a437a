#!/usr/bin/env python3
"""tools/tradeoff: its arithmetic on made-up numbers, and a short sweep that is interrupted and goes on.

    tradeoff.py DLMFD
"""
import csv
import dataclasses
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy

TOOLS = pathlib.Path(__file__).resolve().parent.parent.parent / "tools"
sys.path.insert(0, str(TOOLS))
import tradeoff_draw  # noqa: E402
import tradeoff_scenes  # noqa: E402

failed = 0


def check(good, text):
    global failed
    failed += not good
    print(("ok      " if good else "FAILED  ") + text, flush=True)


def arithmetic():
    rows = [{"price": price, "error": error} for price, error in ((1, 5), (2, 6), (3, 2), (3, 3), (4, 2), (9, 1))]
    check([(row["price"], row["error"]) for row in tradeoff_draw.pareto(rows)] == [(1, 5), (3, 2), (9, 1)], "the front holds what nothing beats in both")
    check(abs(tradeoff_draw.digit([{"price": price, "error": 3 * price**-0.5} for price in (1, 4, 49)]) - 100) < 1e-9, "error as one over the root of the cost: a digit costs 100 times")
    scene = dataclasses.replace(tradeoff_scenes.SCENES["pair"], exact=None)
    rows = [{"case": f"-grid_resolution {n} -ts_dt {dt}", "resolution": str(n), "dt": str(dt), "values": f"{1 + 64 / n**2 + dt**2} {2 - 64 / n**2}"}
            for n, dt in ((8, 0.2), (16, 0.2), (16, 0.1), (24, 0.1))]
    check(numpy.allclose(scene.reference(rows), (1, 2)), f"Richardson's estimate from the finest runs: {scene.reference(rows)}")
    check(scene.reference(rows[:3] + [dict(rows[3], case="-grid_resolution 24 -ts_dt 0.05", dt="0.05")]) is None, "no reference while the finest mesh has no step in common")
    check(abs(tradeoff_scenes.apart((0, 0, 0.03, 0.04), numpy.zeros(4)) - 0.5) < 1e-12, "paths apart by half a radius")
    path = numpy.zeros((5, 2, 10))
    path[:, :, 0] = numpy.arange(5)[:, None]
    path[:, 0, 1] = (-0.5, -0.1, 0.3, 0.4, 0.6)
    path[:, 1, 1] = -path[:, 0, 1]
    check(numpy.allclose(tradeoff_scenes.passing(path), (1.25, 3.5)), "a pair crosses at 1.25 and is back at 3.5")
    check(tradeoff_scenes.passing(path[:2])[0] == 1, "a pair that does not cross: the end of the run")


def sweep(program):
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, str(TOOLS / "tradeoff"), "rotation", "--skip", r"accuracy|_resolution (24|32|48)|dt 0\.05", "--folder", folder]
        texts = []
        for _ in range(2):
            done = subprocess.run(command, env=dict(os.environ, DLM_PROGRAM=program), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            if done.returncode:
                return check(False, done.stdout)
            texts.append((pathlib.Path(folder) / "rotation.csv").read_text())
        row = list(csv.DictReader(texts[0].splitlines()))
        check(len(row) == 1 and float(row[0]["error_percent"]) < 0.3 and float(row[0]["cost"]) > 0, f"one case: {row}")
        check(texts[0] == texts[1] and "-grid_resolution 16" not in done.stdout.split("on the front")[0], "the second call runs nothing and changes nothing")
        check((pathlib.Path(folder) / "rotation.png").stat().st_size > 10000, "a figure")


if __name__ == "__main__":
    arithmetic()
    sweep(os.path.abspath(sys.argv[1]))
    sys.exit(1 if failed else 0)
