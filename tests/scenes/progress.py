#!/usr/bin/env python3
"""The line that a run shows while it runs: its numbers against the files of the run, and where it is rewritten.

    progress.py DLMFD MPIRUN...
"""
import csv
import fcntl
import json
import os
import pty
import re
import statistics
import struct
import subprocess
import sys
import tempfile
import termios

H, DT, ETA, LAMBDA = 1 / 16, 0.05, 1.0, 0.5
BOX = f"-box_size 1.5,1,1 -grid_resolution 16 -ts_dt {DT} -ts_max_time 0.3 -wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0 -progress_every 0"
PAIR = BOX + " -sphere_radius 0.15 -sphere_centers -0.3,0.02,0.12,0.3,-0.02,-0.12"
OLDROYD = f"{PAIR} -fluid_model oldroyd_b -fluid_relaxation_time {LAMBDA}"
NUMBER = r"([-+.\de]+)"
PARTS = {"predict", "saddle", "advect", "stretch", "judge", "correct", "trajectory", "bulk stress", "other"}
LINE = re.compile(rf"step (\d+)  t {NUMBER}/0.3(?:  left (\d+):(\d\d):(\d\d))?  {NUMBER} s/step:((?: [a-z ]+ \d+%)+)(.*)")


def run(command, options, folder, out=subprocess.PIPE, **more):
    done = subprocess.run(command + options.split() + ["-output_dir", folder], stdout=out, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True, **more)
    if done.returncode:
        sys.exit(f"{options}\n{done.stdout}")
    return done.stdout


def lines(text):
    """Of each progress line: step, time, seconds left, seconds a step, per cent by part, health by name."""
    found = []
    for line in text.splitlines():
        match = LINE.fullmatch(line)
        if not match:
            continue
        left = match[3] and 3600 * int(match[3]) + 60 * int(match[4]) + int(match[5])
        parts = {name.strip(): int(part) for name, part in re.findall(r"([a-z ]+) (\d+)%", match[7])}
        health = {name: float(value) for name, value in re.findall(rf"  (\w+) {NUMBER}", match[8])}
        found.append((int(match[1]), float(match[2]), left, float(match[6]), parts, health))
    return found


def near(a, b, digits):
    return abs(a - b) <= 0.6 * 10 ** (1 - digits) * max(abs(a), abs(b))


def check(good, what):
    print(("good: " if good else "BAD: ") + what)
    return good


def courant_of(rows, step):
    return max(sum(abs(float(row[f"V{d}"])) for d in (1, 2, 3)) * DT / H for row in rows if int(row["step"]) == step)


def numbers(command, folder):
    """A log has a line for every step here; what they say is what the files say."""
    text = run(command, OLDROYD, folder)
    found = lines(text)
    with open(os.path.join(folder, "summary.json"), encoding="utf-8") as file:
        summary = json.load(file)
    health = [each[5] for each in found]
    solvent = 1 / 8
    good = check([each[0] for each in found] == [1, 2, 3, 4, 5, 6] and "\r" not in text, "a log has one line a step, none rewritten, through mpirun too")
    good &= check(all(sum(each[4].values()) <= 106 for each in found) and statistics.median(sum(each[4].values()) for each in found) >= 85 and
                  all("saddle" in each[4] and set(each[4]) <= PARTS for each in found),
                  f"the parts of a step are all of it: {[each[4] for each in found]}")
    slowest = max(each[3] for each in found[1:])
    good &= check(all(each[2] <= slowest * (6 - each[0]) + 1 for each in found[1:-1]) and found[-1][2] is None, "time left is that of the steps left; the last line has none")
    good &= check(set(health[0]) == {"its", "CFL", "gap", "eig", "tr", "El"}, "iterations, Courant number, gap, eigenvalue, trace, elastic number")
    good &= check(near(min(each["eig"] for each in health), summary["polymer"]["smallest_eigenvalue"], 2), "smallest eigenvalue of the run is the smallest of the lines")
    good &= check(near(max(each["tr"] for each in health), summary["polymer"]["largest_trace"], 3), "largest trace of the run is the largest of the lines")
    good &= check(near(max(each["CFL"] for each in health), summary["polymer"]["courant_number"], 2), "Courant number of the run is the largest of the lines")
    good &= check(all(near(each["El"], DT * ETA * (1 - solvent) * each["tr"] / (LAMBDA * ETA), 2) for each in health), "elastic number follows from the trace")
    good &= check(max(each["its"] for each in health) <= summary["iterations"]["bodies_most"], "iterations are at most the most of the run")
    worst = re.search(rf"^C: smallest eigenvalue {NUMBER} at x = .*, t = {NUMBER}; largest trace {NUMBER};", text, re.MULTILINE)
    good &= check(worst and near(float(worst[1]), summary["polymer"]["smallest_eigenvalue"], 4) and near(float(worst[3]), summary["polymer"]["largest_trace"], 4),
                  "the end has the extremes of the run")
    return good


def newtonian(command, folder):
    found = lines(run(command, PAIR + " -ts_split_scheme lie", folder))
    with open(os.path.join(folder, "trajectory.csv"), newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    good = check(set(found[0][5]) == {"its", "CFL", "gap"}, "Newtonian fluid has neither eigenvalue nor elastic number")
    return good & check(all(near(each[5]["CFL"], courant_of(rows, each[0]), 2) for each in found), "Courant number of spheres is that of their velocities")


def lacking(command, folder):
    found = lines(run(command, BOX, folder + "/flow"))
    good = check(len(found) == 6 and not any(each[5] for each in found), "flow alone has neither iterations nor gap nor Courant number")
    found = lines(run(command, BOX + " -sphere_radius 0.15 -sphere_centers 0,0,0 -sphere_motion rotate", folder + "/held"))
    good &= check(set(found[0][5]) == {"its"}, "a sphere that is held has iterations alone")
    quiet = lines(run(command, PAIR + " -progress_every 1000", folder + "/quiet"))
    return good & check([each[0] for each in quiet] == [6], "-progress_every spaces the lines of a log")


def terminal(command, folder, columns=70):
    """The same through a terminal: one line, rewritten, that fits."""
    mine, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    run(command, OLDROYD, folder, out=theirs)
    os.close(theirs)
    text = b""
    while True:
        try:
            piece = os.read(mine, 65536)
        except OSError:
            break
        if not piece:
            break
        text += piece
    shown = [each for each in text.decode().split("\r") if each.startswith("step ")]
    good = check(shown and shown[-1].startswith("step 6 "), f"a terminal's line is rewritten, {len(shown)} times here")
    good &= check(all("\033[K" in each and len(each.split("\033")[0]) < columns for each in shown), f"it has at most {columns} columns")
    return good & check("took 0:00:" in text.decode(), "and the run ends below it")


def main():
    command, good = sys.argv[2:] + ["-n", "2", sys.argv[1]], True
    with tempfile.TemporaryDirectory() as folder:
        for part in (numbers, newtonian, lacking, terminal):
            good &= part(command, os.path.join(folder, part.__name__))
    sys.exit(not good)


if __name__ == "__main__":
    main()
