#!/usr/bin/env python3
"""Checkpoints: a run that was stopped and continued must be the run that was not.

    run.py legs DLMFD MPIRUN...       N steps against N/2 + N/2: equal to the last bit; files without gap or double row
    run.py ranks DLMFD MPIRUN...      continued on another number of ranks, to 1e-10
    run.py refused DLMFD MPIRUN...    changed scenes, damaged files, folders that cannot be written: one line, exit code 2, nothing lost
    run.py signals DLMFD MPIRUN...    SIGTERM and SIGUSR1: exit code 3, then continued; a run that gives up
"""
import concurrent.futures
import os
import random
import re
import signal
import subprocess

import numpy

import runs
from runs import BOX, SCENES, THREE, check, checkpoint, children, command, fields, place, refusal, rows, run, same_fields, same_state, text, wait_for_rows


def leg(name):
    scene, folder = SCENES[name], name.replace(" ", "_").replace("'", "").replace(",", "")
    run(scene + " -ts_max_steps 7 -checkpoint_every 100", folder + "0")
    run(scene + " -ts_max_steps 3 -checkpoint_every 2", folder)
    run(scene + f" -ts_max_steps 7 -checkpoint_every 100 -restart {checkpoint(folder)}", folder)
    good = same_state(folder, folder + "0") and text(folder, "bulk.csv") == text(folder + "0", "bulk.csv")
    if "centers" in scene:
        x1 = rows(folder)
        x1 = x1[x1[:, 2] == 0, 3]
        check(good and text(folder) == text(folder + "0"), f"{name}: 7 steps are 3 + 4, to the last bit; x1 of sphere 0 from {x1[0]:.3f} to {x1[-1]:.3f}, face at 0.75; "
              f"{os.path.getsize(checkpoint(folder))} bytes")
    else:
        check(good and same_fields(folder, folder + "0"), f"{name}: 7 steps are 3 + 4, to the last bit")


def legs():
    with concurrent.futures.ThreadPoolExecutor(2) as workers:
        list(workers.map(leg, SCENES))
    check(rows("newtonian_strang")[-3, 3] - 0.5 * 0.7 > 0.75, "the face is crossed, in the frame of the mesh too")
    for name, scene, ranks in (("newtonian", SCENES["newtonian strang"], 2), ("polymer", SCENES["log strang"], 3)):
        run(scene + " -ts_max_steps 6", name + "_ranks0", ranks)
        run(scene + " -ts_max_steps 3 -checkpoint_every 3", name + "_ranks", ranks)
        run(scene + f" -ts_max_steps 6 -restart {checkpoint(name + '_ranks')}", name + "_ranks", ranks)
        check(text(name + "_ranks") == text(name + "_ranks0"), f"{name}, {ranks} ranks: 6 steps are 3 + 3, to the last bit")
    # files that went on past the checkpoint
    scene = SCENES["factor strang"] + " -output_fields_every 2 -output_every 1"
    run(scene + " -ts_max_steps 10", "past0")
    run(scene + " -ts_max_steps 5 -checkpoint_every 4", "past", expected=0)
    run(scene + " -ts_max_steps 4 -checkpoint_every 4", "past_copy")
    run(scene + f" -ts_max_steps 9 -restart {checkpoint('past_copy')}", "past")
    with open(os.path.join(place("past"), "trajectory.csv"), "a", encoding="utf-8") as file:
        file.write("10,0.5,0,0.12")  # a row that was being written
    with open(os.path.join(place("past"), "bulk.csv"), "a", encoding="utf-8") as file:
        file.write("10,0.5,3")
    run(scene + f" -ts_max_steps 10 -restart {checkpoint('past_copy')}", "past")
    for name in ("trajectory.csv", "bulk.csv"):
        check(text("past", name) == text("past0", name), f"{name} written past the checkpoint is cut there and continued")
    check(same_fields("past", "past0"), f"so is fields.h5, {sorted(n for n in fields('past') if n.endswith('velocity') and 'spheres' not in n)}")
    check(text("past", "fields.xmf") == text("past0", "fields.xmf"), "and fields.xmf")
    # what may change
    run(scene + f" -ts_max_steps 6 -ts_dt 0.01 -saddle_rtol 1e-7 -output_every 2 -restart {checkpoint('past_copy')}", "changed")
    found = rows("changed")[::3]
    check(abs(found[-1, 1] - 0.22) < 1e-12 and found[-1, 0] == 6, f"another dt, tolerance and interval go on: t = {found[-1, 1]:g} at step {found[-1, 0]:g}")
    run(scene + f" -ts_max_time 0.25 -restart {checkpoint('past_copy')}", "end")
    run(scene.replace("-ts_max_time 100", "-ts_max_time 0.275") + " -checkpoint_every 1", "end")
    run(scene + f" -ts_max_steps 9 -restart {checkpoint('end')}", "end")
    times = numpy.unique(rows("end")[:, 1])
    check(abs(numpy.diff(times)[-3:] - 0.05).max() < 1e-12, f"a leg that ended in a shorter step goes on with dt: {numpy.round(times, 4)}")


def ranks():
    for name in ("newtonian strang", "newtonian lie", "factor strang", "log lie"):
        folder = name.replace(" ", "_")
        scene = SCENES[name].replace("1e-11", "1e-13")
        run(scene + " -ts_max_steps 6", folder + "0")
        whole = rows(folder + "0")
        for first, second in ((1, 3), (4, 2)):
            part = f"{folder}{first}{second}"
            run(scene + " -ts_max_steps 3 -checkpoint_every 3", part, first)
            run(scene + f" -ts_max_steps 6 -restart {checkpoint(part)}", part, second)
            found = rows(part)
            same = found.shape == whole.shape and (found[:, :3] == whole[:, :3]).all()
            difference = abs(found[:, 3:] - whole[:, 3:]).max() if same else numpy.inf
            check(difference <= 1e-10, f"{name}, {first} ranks then {second}: difference {difference:.1e}")


def refused():
    scene = SCENES["factor strang"]
    run(scene + " -ts_max_steps 2 -checkpoint_every 1", "good")
    good = checkpoint("good")
    again = scene + f" -ts_max_steps 3 -restart {good}"
    changes = (("-box_size 1.5,1,2", r"-box_size 1\.5,1,2 cannot go on from -restart \S+, which has 1\.5,1,1; allowed: the same"),
               ("-box_periodic 1,0,0", r"-box_periodic 1,0,0 .* which has 1,1,0"), ("-grid_resolution 20", r"-grid_resolution 20 .* which has 16"),
               ("-fluid_model newtonian", r"-fluid_model newtonian .* which has oldroyd_b"), ("-polymer_form log", r"-polymer_form log .* which has factor"), ("-polymer_inside evolve", r"-polymer_inside evolve .* which has extend"),
               ("-sphere_radius 0.14", r"radius 0\.14 of sphere 0 .* which has 0\.15"), ("-sphere_centers 0,0,0", r"number of spheres 1 .* which has 3"),
               ("-pairing_degree 2", r"-pairing_degree 2 .* which has auto"), ("-pairing_points volume", r"-pairing_points volume .* which has surface"),
               ("-wall_velocity_upper 1,0,0", r"mean wall velocity 0,0,0 .* which has 0\.5,0,0"))
    for option, pattern in changes:
        refusal(option, pattern, again + " " + option, "none")
    refusal("on two ranks", changes[0][1], again + " " + changes[0][0], "none", ranks=2)
    refusal("missing", r"-restart \S+ cannot be read \(No such file", scene + " -restart " + place("absent.h5"), "none")
    whole = text("good", "checkpoint.h5")
    bad = place("bad.h5")
    chance = random.Random(1)

    def damaged(what, content, pattern):
        with open(bad, "wb") as file:
            file.write(content)
        refusal(what, pattern, scene + f" -restart {bad}", "none")

    damaged("empty", b"", "is not a checkpoint")
    damaged("a CSV", text("good"), "is not a checkpoint")
    for length in (100, 600, len(whole) // 2, len(whole) - 1):
        damaged(f"cut to {length} bytes", whole[:length], "is damaged: it has|is not a checkpoint")
    damaged("a byte too long", whole + b"x", "is damaged: it has")
    for k in range(12):
        at = chance.randrange(512 if k < 6 else len(whole)) if k < 11 else len(whole) - 1
        flipped = bytearray(whole)
        flipped[at] ^= 1 << chance.randrange(8)
        damaged(f"a flipped bit in byte {at}", bytes(flipped), r"-restart \S+ (is damaged|is not a checkpoint|has format)")
    damaged("another version", re.sub(rb"format \d+\n", b"format 7\n", whole, count=1), r"has format 7, written by dlmfd \S+; allowed: format \d+, that of this dlmfd")
    refusal("-checkpoint_every -1", "-checkpoint_every -1: '-1' is out of range", scene + " -checkpoint_every -1", "none")
    check(not os.path.exists(place("none")), "nothing was written")

    # rows of another version
    kept = text("good")
    with open(os.path.join(place("good"), "trajectory.csv"), "wb") as file:
        file.write(kept.replace(b",S11,S12,S13,S22,S23,S33", b"", 1))
    refusal("other columns", r"-output_dir \S+: \S+trajectory\.csv has other columns than this version writes; allowed: files of this version, or none: move this one away",
            again, "good", ranks=2)
    with open(os.path.join(place("good"), "trajectory.csv"), "wb") as file:
        file.write(kept)

    # the checkpoint cannot be written: the full device, and a folder in its way
    kept = text("good", "checkpoint.h5")
    fresh = checkpoint("good") + ".new"
    for what, prepare in (("no space", lambda: os.symlink("/dev/full", fresh)), ("a folder in the way", lambda: os.mkdir(fresh))):
        prepare()
        done = run(again.replace("max_steps 3", "max_steps 5") + " -checkpoint_every 2", "good", expected=2)
        lines = [line for line in done.stderr.splitlines() if line]
        check(len(lines) == 1 and bool(re.search(r"^dlmfd: error: -output_dir \S+: cannot write \S+checkpoint.h5 \(.*\); allowed: .*; -restart \S+checkpoint.h5 goes on from step 2$", lines[0])),
              f"{what}: {lines}")
        check(text("good", "checkpoint.h5") == kept, "  the one before is untouched")
    os.rmdir(fresh)
    run(scene + " -ts_max_steps 5", "whole")
    run(again.replace("max_steps 3", "max_steps 5"), "good")
    check(text("good") == text("whole"), "and continues the run")
    run(scene + " -ts_max_steps 1", "good")
    check(text("good", "checkpoint_before.h5") == kept and not os.path.exists(checkpoint("good")), "a new run in the folder puts it aside")


def signals():
    scene = SCENES["factor strang"]
    for name, number, ranks in (("SIGTERM", signal.SIGTERM, 1), ("SIGUSR1", signal.SIGUSR1, 1), ("SIGUSR1", signal.SIGUSR1, 2)):
        folder = f"{name}{ranks}"
        process = subprocess.Popen(command(scene + " -ts_max_steps 100000", folder, ranks), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        wait_for_rows(process, folder, 9)
        target = process.pid if ranks == 1 else children(process.pid)[-1]  # one rank only: the others must hear of it
        os.kill(target, number)
        output = process.communicate(timeout=60)[0]
        line = re.search(rf"^stopped by {name} at t = \S+, step (\d+): -restart \S+checkpoint.h5 goes on$", output, re.M)
        check(process.returncode == 3 and bool(line), f"{name}, {ranks} ranks: exit code {process.returncode}, {line and line.group()}")
        if not line:
            continue
        steps = int(line.group(1)) + 3
        run(scene + f" -ts_max_steps {steps}", folder + "0", ranks)
        run(scene + f" -ts_max_steps {steps} -restart {checkpoint(folder)}", folder, ranks)
        check(text(folder) == text(folder + "0"), f"  {steps} steps after that, to the last bit")
    run(THREE + " -ts_max_steps 3 -checkpoint_minutes 1e-6", "minutes")
    run(THREE + f" -ts_max_steps 3 -restart {checkpoint('minutes')}", "minutes")
    check(rows("minutes")[-1, 0] == 3, "-checkpoint_minutes")

    unstable = (BOX.replace("1.5,1,1", "1,1,1").replace("-1,0,0", "-0.5,0,0").replace("2,0,0", "0.5,0,0").replace("1e-11", "1e-6") +
                "-sphere_centers 0.02,0.01,0.1 -sphere_motion rotate -fluid_model oldroyd_b -fluid_relaxation_time 0.1 -ts_dt 0.1 -polymer_coupling explicit -ts_split_scheme lie")
    done = run(unstable + " -checkpoint_every 5", "gave_up", expected=2)
    line = re.search(r"^dlmfd: error: .* at t = (\S+) near .*; -restart (\S+checkpoint_last.h5) goes on from the step before$", done.stderr, re.M)
    check(bool(line), f"a run that gives up: {done.stderr.strip()[-120:]}")
    if line:
        again = run(unstable + f" -restart {line.group(2)}", "gave_up_again", expected=2)  # its last step is the first one there
        check(f"at t = {line.group(1)} near" in again.stderr, f"  and again at t = {line.group(1)}, from the step before")
    run(unstable + f" -ts_dt 0.01 -ts_max_steps 10 -restart {checkpoint('gave_up')}", "gave_up")
    check(rows("gave_up")[-1, 0] == 10, "  and from the checkpoint.h5 before that")


if __name__ == "__main__":
    runs.main({"legs": legs, "ranks": ranks, "refused": refused, "signals": signals})
