#!/usr/bin/env python3
"""-accuracy: the rate of a rotating sphere is as right as docs/tradeoff.md says, and a run says what the preset set.

    presets.py short DLMFD MPIRUN...   draft, standard, fine
    presets.py long DLMFD MPIRUN...    reference too (minutes)
    presets.py foretold DLMFD MPIRUN...  what -dry_run says of every preset: errors as in docs/tradeoff, times that agree with one another
"""
import csv
import os
import re

import polymer_runs
from polymer_runs import check, launch, run

# Oldroyd-B, Wi = 0.5, a sphere at no special place of the mesh; 0.4549 is the exact rate of unbounded fluid less what this box takes off. Allowed errors, per cent: docs/tradeoff.md and some.
SCENE = "-box_size 1,1,1 -sphere_centers 0.006,0.014,0 -wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0 -fluid_model oldroyd_b -fluid_relaxation_time 0.5 -ts_max_time 4"
EXACT = 0.4549
ALLOWED = {"draft": 0.5, "standard": 0.5, "fine": 0.4, "reference": 0.4}
MESH = {"draft": 28, "standard": 36, "fine": 48, "reference": 64}


def accurate(names):
    for name in names:
        found = run(f"{SCENE} -accuracy {name}")
        error = 100 * abs(abs(found.rows[-1, 0, 10]) / EXACT - 1)
        check(error <= ALLOWED[name], f"{name}: {error:.2f} % off (allowed {ALLOWED[name]} %)")
        said = found.summary["scene"]["accuracy"]
        check(said["preset"] == name and said["grid_resolution"] == str(MESH[name]) and float(said["ts_dt"]) == found.summary["dt"] and said["ts_split_scheme"] == found.summary["scheme"],
              f"{name}: summary.json says {said}")


def given_keys_win():
    code, output, _ = launch(f"{SCENE} -accuracy fine -grid_resolution 16 -ts_split_scheme lie -ts_max_steps 1")
    line = [line for line in output.splitlines() if line.startswith("accuracy")]
    check(code == 0 and line and "grid_resolution as given, ts_dt 0.05, ts_split_scheme as given, saddle_rtol" in line[0] and "mesh      16 x 16 x 16" in output, f"given keys win: {line}")


ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SHEAR = "-box_size 1,1,1 -grid_resolution 16 -sphere_radius 0.15 -wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0 -ts_max_time 4"
WEISSENBERG = SHEAR + " -sphere_centers 0,0,0 -fluid_model oldroyd_b -fluid_relaxation_time"
# Scenes, and the files of docs/tradeoff that they are like; the worse of two.
LIKE = [
    ("-box_size 1,1,1 -grid_resolution 16 -sphere_radius 0.15 -sphere_centers 0,0,0 -sphere_density 2 -gravity 0,0,-1", ["settling"]),
    (SHEAR + " -sphere_centers 0,0,0", ["rotation"]),
    (WEISSENBERG + " 0.5", ["rotation_wi05", "rotation_wi1"]),
    (SHEAR + " -sphere_centers -0.3,0,0.1,0.3,0,-0.1", ["pair"]),
    (SHEAR + " -sphere_centers -0.3,0,0.1,0.3,0,-0.1 -sphere_density 2 -gravity 0,0,-1", []),
    (SHEAR + " -sphere_centers -0.3,0,0.1,0.3,0,-0.1,0,0,0", []),
    (SHEAR + " -sphere_centers -0.3,0,0.1,0.3,0,-0.1 -fluid_model oldroyd_b", ["pair_wi05"]),
    (SHEAR + " -sphere_centers 0,0,0 -fluid_model carreau", []),
    (SHEAR, []),
]
DOCUMENTED = {"settling between": "settling", "rotation between": "rotation", "rotation, Oldroyd-B, Wi = 0.5": "rotation_wi05", "rotation, Oldroyd-B, Wi = 1": "rotation_wi1", "pair that passes, Newtonian": "pair", "pair that passes, Oldroyd-B": "pair_wi05"}


def measured(name):
    """preset -> error, per cent, to two digits."""
    with open(os.path.join(ROOT, "docs", "tradeoff", name + ".csv"), newline="", encoding="utf-8") as file:
        return {row["case"].split()[1]: float(f"{float(row['error_percent']):.2g}") for row in csv.DictReader(file) if row["case"].startswith("-accuracy") and row["error_percent"]}


def presets(options):
    """What a dry run prints; preset -> (1/h, dt, error or None, steps, seconds)."""
    code, output, _ = launch(options + " -dry_run")
    rows = re.findall(r"^(draft|standard|fine|reference) +(\S+) +(\S+) +\S+ +(?:(\S+) %|\?) +(\d+)  (\d+):(\d+):(\d+)", output, re.MULTILINE)
    check(code == 0 and len(rows) == 4, f"four presets: {options[-60:]}" + ("" if len(rows) == 4 else output))
    return output, {row[0]: (float(row[1]), float(row[2]), float(row[3]) if row[3] else None, int(row[4]), 3600 * int(row[5]) + 60 * int(row[6]) + int(row[7])) for row in rows}


def foretold():
    for scene, names in LIKE:
        output, rows = presets(scene)
        errors = [measured(name) for name in names]
        for name in MESH:
            worst = max((each.get(name) or 0 for each in errors), default=0) or None
            check(rows[name][2] == worst, f"{names}: {name} errs by {rows[name][2]} %, measured {worst}")
        check(("valid for scenes like that" in output) == bool(names), "the range of validity is told")
    with open(os.path.join(ROOT, "docs", "tradeoff.md"), encoding="utf-8") as file:
        page = [[cell.strip() for cell in line.strip("|\n").split("|")] for line in file if line.startswith("|")]
    for start, name in DOCUMENTED.items():
        row = next(row for row in page if row[0].startswith(start))
        said = {preset: float(row[k].split(" %")[0]) for preset, k in (("draft", 2), ("standard", 3), ("fine", 4))}
        check(all(said[preset] == measured(name)[preset] for preset in said), f"docs/tradeoff.md: {name} {said}")
    check("Wi is 3 here" in presets(WEISSENBERG + " 3")[0], "Wi beyond what was measured is told")
    longer = SHEAR.replace("-ts_max_time 4", "-ts_max_time 4000") + " -sphere_centers 0,0,0"
    here, there = presets(longer)[1], presets(longer.replace("-grid_resolution 16", "-accuracy fine"))[1]
    check(here["fine"][:4] == there["fine"][:4] and here["fine"][3] == 80000, f"mesh, step and steps do not depend on this run's: {here['fine']}")
    check(1 / 4 <= here["fine"][4] / there["fine"][4] <= 4, f"nor does the time, much: {here['fine'][4]} s, {there['fine'][4]} s")
    _, output, _ = launch("-box_size 1,1,1 -grid_resolution 16 -dry_run")
    check("finds no time step" in output, "nothing drives a scene")
    _, output, _ = launch("-box_size 1.125,1,1.125 -grid_resolution 16 -sphere_centers 0,0,0 -sphere_radius 0.45 -gravity 1,0,0 -sphere_density 2 -dry_run")
    check("draft      no mesh of 6.22222 to 12.4444 cells per unit length fits the box" in output, "no mesh fits")


if __name__ == "__main__":
    polymer_runs.main({"foretold": foretold, "short": lambda: (given_keys_win(), accurate(list(MESH)[:3])), "long": lambda: accurate(list(MESH))})
