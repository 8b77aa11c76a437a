#!/usr/bin/env python3
"""-dry_run against the run that it foretells: memory, disk, steps and the table of what is built; nothing is written; bad scenes are refused alike.

    dryrun.py DLMFD MPIRUN...

Times are printed and not judged, but for being of the order of what they foretell: they depend on what else the machine does.
"""
import glob
import json
import os
import re
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
OUTPUTS = "-output_fields_every 1 -checkpoint_every 1"
UNITS = {"bytes": 1, "kB": 1e3, "MB": 1e6, "GB": 1e9}
MEMORY = 0.15  # relative errors allowed
DISK = 0.15
TIME = 10  # factor

# Ranks, scene and options: larger than the piece that is tried, so that the extrapolation shows.
SCENES = [
    (1, "pair_two_walls.yaml -grid_resolution 24"),
    (2, "sedimentation.yaml -grid_resolution 28 " + OUTPUTS),
    (1, "rotation_oldroydb.yaml -box_size 1,1,2 -grid_resolution 32"),
    (1, "poiseuille_oldroydb.yaml -box_size 1,1,1 -grid_resolution 36 " + OUTPUTS),
    (1, "startup_shear.yaml -output_fields_every 0 -ts_adapt_type scene"),
]
# Ranks and options that are refused at different moments of the start.
REFUSED = [
    (1, "-grid_resolutio 48"), (1, "-ts_tdt 0.1"), (1, "-restart absent.h5"), (1, "-dry_run maybe"), (1, "-box_size 3,2,0"),
    (1, "-grid_resolution 24 -sphere_centers 0,0,0,0.1,0,0"), (3, "-box_size 1,1,1 -grid_resolution 4"), (2, "-grid_processes 3,1,1"),
]


class Failure(Exception):
    pass


def require(condition, message):
    if not condition:
        raise Failure(message)


def launch(program, mpirun, ranks, words, folder):
    command = (mpirun + ["-n", str(ranks)] if ranks > 1 else []) + [program] + words
    env = dict(os.environ, ASAN_OPTIONS="detect_leaks=0", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", OMPI_MCA_mpi_yield_when_idle="1")
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True)


def sanitized(program):
    """Sanitizers keep what was freed: then the process holds more than its objects need."""
    with open(program, "rb") as file:
        return b"__asan_init" in file.read()


def table(text):
    """object -> (built, MiB, why) of the printed table."""
    rows = re.findall(r"^(\S[\w ]{17})   (yes| no) +([\d.]+)?  (.*)$", text, re.MULTILINE)
    return {name.strip(): (built == "yes", float(mib or 0), why) for name, built, mib, why in rows}


def foretell(program, mpirun, ranks, words):
    with tempfile.TemporaryDirectory() as folder:
        result = launch(program, mpirun, ranks, words + ["-dry_run"], folder)
        require(result.returncode == 0, f"exit code {result.returncode}: {result.stderr[-2000:]}")
        require(not os.listdir(folder), f"files were written: {os.listdir(folder)}")
    require(result.stdout.splitlines()[-1] == "nothing was written: -dry_run", f"unexpected end: {result.stdout[-200:]}")
    return result.stdout


def compare_tables(foretold, modelled):
    rows = table(foretold)
    require([m["object"] for m in modelled] == list(rows), f"other objects: {list(rows)}")
    for m in modelled:
        built, mib, why = rows[m["object"]]
        measured = m["bytes"] / 2**20
        known = not why.endswith("one for each cluster of near ones")  # how many is not known before
        require((built, why if known else m["why"]) == (m["built"], m["why"]), f"{m['object']}: foretold {built}, {why}; is {m['built']}, {m['why']}")
        if m["object"] not in ("fields", "checkpoints"):  # what these keep is foretold as part of an output
            require(abs(mib - measured) <= 0.5 + MEMORY * measured, f"{m['object']}: {mib} MiB foretold, {measured:.1f} measured")


def check_disk(foretold, folder):
    """Bytes of all the run's files of a kind, foretold and found."""
    said = re.search(r"^disk .*", foretold, re.MULTILINE)[0]
    texts = []
    for name, files in (("trajectory.csv", "trajectory.csv"), ("bulk.csv", "bulk.csv"), ("fields.h5", "fields.h5"), ("checkpoint.h5", "checkpoint.h5")):
        match, sizes = re.search(rf"{re.escape(name)} ([\d.e+]+) (\w+)", said), [os.path.getsize(path) for path in glob.glob(os.path.join(folder, files))]
        require(bool(sizes) == bool(match), f"{name}: {len(sizes)} files, {said}")
        if not match:
            continue
        bytes_ = float(match[1]) * UNITS[match[2]]
        slack = 0.6 * sum(sizes) if name.endswith("csv") else 20e3  # rows of the first steps are shorter than others
        require(abs(bytes_ - sum(sizes)) <= slack + DISK * sum(sizes), f"{name}: {bytes_:.0f} bytes foretold, {sum(sizes)} found")
        texts.append(f"{name} {bytes_:.3g} ({sum(sizes):.3g})")
    return ", ".join(texts)


def check_scene(program, mpirun, ranks, line):
    words = [os.path.join(ROOT, "input", line.split()[0])] + line.split()[1:] + ["-ts_max_steps", "4"]
    foretold = foretell(program, mpirun, ranks, words)
    require(re.search(r"^steps +(4|about \d, adapted: .*)$", foretold, re.MULTILINE), "four steps are not foretold")
    with tempfile.TemporaryDirectory() as folder:
        result = launch(program, mpirun, ranks, words + ["-progress_every", "0"], folder)
        require(result.returncode == 0, f"exit code {result.returncode}: {result.stderr[-2000:]}")
        with open(os.path.join(folder, "out", "summary.json"), encoding="utf-8") as file:
            summary = json.load(file)
        disk = check_disk(foretold, os.path.join(folder, "out"))
    compare_tables(foretold, summary["modelled"])
    memory, peak = float(re.search(r"^memory +(\d+) MiB", foretold, re.MULTILINE)[1]), summary["peak_memory_MiB"]
    require(sanitized(program) or abs(memory / peak - 1) <= MEMORY, f"{memory} MiB foretold, {peak:.0f} measured")
    step = float(re.search(r"then (\S+) s/step", foretold)[1])
    taken = min(float(s) * sum(int(p) for p in re.findall(r" (?:predict|saddle|advect|stretch|judge|correct) (\d+)%", rest)) / 100
                for s, rest in re.findall(r"^step [2-9]  t .*?  (\S+) s/step:(.*)", result.stdout, re.MULTILINE))
    require(step / TIME <= taken <= step * TIME, f"{step} s/step foretold, {taken:.3g} taken")
    print(f"ok      {ranks} {line}: memory {memory:.0f} MiB ({peak:.0f}), {disk}; {step} s a step ({taken:.3g})", flush=True)


def check_restart(program, mpirun):
    """The steps that a checkpoint leaves, and a checkpoint that does not fit."""
    words = [os.path.join(ROOT, "input", "startup_shear.yaml"), "-checkpoint_every", "3", "-ts_max_steps", "3"]
    with tempfile.TemporaryDirectory() as folder:
        require(launch(program, mpirun, 1, words, folder).returncode == 0, "the run failed")
        again = words[:1] + ["-restart", "out/checkpoint.h5", "-dry_run"]
        result = launch(program, mpirun, 1, again, folder)
        steps = re.search(r"^steps +(\d+)$", result.stdout, re.MULTILINE)
        require(result.returncode == 0 and steps and int(steps[1]) == 77, f"77 steps are left: {result.stdout[-1500:]}{result.stderr}")
        result = launch(program, mpirun, 1, again + ["-grid_resolution", "16"], folder)
        require(result.returncode == 2 and "-grid_resolution 16 cannot go on from" in result.stderr, f"another mesh: {result.stderr}")
    print("ok      restart: the steps left; a checkpoint of another mesh is refused", flush=True)


def check_refused(program, mpirun):
    def refusal(ranks, words):
        with tempfile.TemporaryDirectory() as folder:
            result = launch(program, mpirun, ranks, words, folder)
            require(not os.listdir(folder), f"{words}: files were written")
        return result.returncode, [line for line in result.stderr.splitlines() if line.startswith("dlmfd:")]
    for ranks, line in REFUSED:
        words = line.split()
        dry, real = refusal(ranks, words + ["-dry_run"] * ("-dry_run" not in words)), refusal(ranks, words)
        require(dry == real and real[0] == 2 and len(real[1]) == 1, f"{line}: {dry} with -dry_run, {real} without")
    print(f"ok      {len(REFUSED)} bad scenes are refused as in a run", flush=True)


def main():
    program, mpirun = os.path.abspath(sys.argv[1]), sys.argv[2:]
    checks = [lambda scene=scene: check_scene(program, mpirun, *scene) for scene in SCENES]
    checks += [lambda: check_restart(program, mpirun), lambda: check_refused(program, mpirun)]
    failed = 0
    for check, name in zip(checks, [line for _, line in SCENES] + ["restart", "refused"]):
        try:
            check()
        except Failure as failure:
            failed += 1
            print(f"FAILED  {name}: {failure}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
