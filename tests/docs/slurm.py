#!/usr/bin/env python3
"""tools/dlmfd.slurm with a stand-in for Slurm: a run that outlives its limits is queued again, goes on, and ends as an unbroken one does.

    slurm.py ROOT DLMFD MPIRUN...

The stand-in has sbatch (reads the script's #SBATCH lines, runs a copy of it, its jobs one after the other), srun (mpirun; as Slurm as it is installed, it ties Open MPI's ranks
together only where the script asks for PMIx) and scontrol (queues the job again). As Slurm does at --signal=USR1@120, it sends SIGUSR1 to the ranks, and not to the script (nor to
mpirun); here after some steps of dlmfd instead of two minutes before the limit. As scancel does, it sends SIGTERM to both. Slurm 22.05 with Open MPI 4.1 did the same.
"""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT, PROGRAM, MPIRUN = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3:]
SCENE = "input/pair_two_walls.yaml"
STEPS = 100  # so many that the run is still on its way, on a busy machine too, when the second signal arrives
SHORT = ["-grid_resolution", "16", "-ts_dt", "0.01", "-ts_max_steps", str(STEPS), "-checkpoint_every", "1000000"]
# the file step: the id of the job's step for whoever sends signals, as long as it runs; the step outlives the script
SRUN = """#!/bin/bash
[[ "${{SLURM_MPI_TYPE:-none}}" == pmix ]] || {{ echo "OMPI was not built with SLURM's PMI support and therefore cannot execute" >&2; exit 1; }}
{mpirun} -n "$SLURM_NTASKS" "$@" >> "$STAND_IN/output" 2>&1 &
echo $! > "$STAND_IN/step"
wait $!
status=$?
rm "$STAND_IN/step"
exit "$status"
"""
SCONTROL = """#!/bin/bash
echo "$@" >> "$STAND_IN/requeued"
[[ "$1" == requeue && "$2" == "$SLURM_JOB_ID" ]]
"""
failed = 0


def check(good, text):
    global failed
    failed += not good
    print(("ok      " if good else "FAILED  ") + text, flush=True)


def directives(script):
    """The #SBATCH lines, which Slurm reads up to the first command."""
    head = script.read_text(encoding="utf-8").partition("\nset ")[0]
    return dict(re.findall(r"^#SBATCH --([a-z-]+)(?:=(\S+))?$", head, re.M))


def stand_in(folder):
    (folder / "bin").mkdir()
    for name, text in (("srun", SRUN.format(mpirun=" ".join(MPIRUN))), ("scontrol", SCONTROL)):
        (folder / "bin" / name).write_text(text, encoding="utf-8")
        (folder / "bin" / name).chmod(0o755)
    shutil.copy(ROOT / "tools/dlmfd.slurm", folder / "slurm_script")  # what Slurm runs: $0 is not in tools/
    return {
        **os.environ, "SLURM_MPI_TYPE": "", "PATH": f"{folder / 'bin'}:{os.environ['PATH']}", "STAND_IN": str(folder), "DLMFD": PROGRAM, "SLURM_JOB_ID": "17", "SLURM_NTASKS": "2",
        "OMPI_MCA_mpi_yield_when_idle": "1", "DLM_TERMINAL": "0",
    }


def rows_of(output):
    path = output / "trajectory.csv"
    return path.read_text(encoding="utf-8").splitlines() if path.exists() else []


def checkpoint_of(output):
    path = output / "checkpoint.h5"
    return path.read_bytes() if path.exists() else None


def ranks_of(step):
    return [int(word) for word in pathlib.Path(f"/proc/{step}/task/{step}/children").read_text(encoding="utf-8").split()]


def job(folder, environment, output, rows=None, cancel=False):
    """One job, from its start to its exit status; when trajectory.csv has so many rows SIGUSR1 goes to the ranks, or scancel's SIGTERM to ranks and script."""
    step = folder / "step"
    script = subprocess.Popen(["bash", str(folder / "slurm_script"), SCENE, str(output), *SHORT], cwd=ROOT, env=environment)
    until = time.monotonic() + 120
    while rows and script.poll() is None and time.monotonic() < until:
        if len(rows_of(output)) >= rows and step.exists():
            for rank in ranks_of(int(step.read_text())):
                os.kill(rank, signal.SIGTERM if cancel else signal.SIGUSR1)
            if cancel:
                script.terminate()
            break
        time.sleep(0.02)
    try:
        status = script.wait(120)
    except subprocess.TimeoutExpired:
        script.kill()
        return None
    while step.exists() and time.monotonic() < until:
        time.sleep(0.02)
    return status


def queued(folder):
    path = folder / "requeued"
    return path.read_text(encoding="utf-8").splitlines() if path.exists() else []


def usage(folder, environment):
    done = subprocess.run(["bash", str(folder / "slurm_script"), SCENE], cwd=ROOT, env=environment, capture_output=True, text=True)
    check(done.returncode == 1 and done.stderr.startswith("usage: sbatch tools/dlmfd.slurm SCENE.yaml"), f"without a folder: {done.stderr.strip()}")


def main():
    asked = directives(ROOT / "tools/dlmfd.slurm")
    check(asked.get("signal") == "USR1@120" and "requeue" in asked and asked.get("open-mode") == "append",
          f"what it asks Slurm for: {asked}")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        environment = stand_in(folder)
        usage(folder, environment)
        output, whole = folder / "out", folder / "whole"
        for k, rows in enumerate((12, 42)):
            status = job(folder, environment, output, rows)
            check(status == 0 and len(queued(folder)) == k + 1 and queued(folder)[-1] == "requeue 17" and checkpoint_of(output),
                  f"job {k + 1}: a signal after {rows} rows; status {status}, queued again {len(queued(folder))} times, {len(rows_of(output))} rows")
        checkpoint = checkpoint_of(output)
        status = job(folder, environment, output, 72, cancel=True)
        check(status == -signal.SIGTERM and len(queued(folder)) == 2 and checkpoint_of(output) != checkpoint,
              f"job 3: cancelled after 72 rows; status {status}, a new checkpoint, not queued again, {len(rows_of(output))} rows")
        check(len(rows_of(output)) < 2 * STEPS, "the scene has not ended yet")
        status = job(folder, environment, output)
        check(status == 0 and len(queued(folder)) == 2, f"job 4: no signal; status {status}, not queued again: {len(queued(folder)) == 2}")
        before = rows_of(output)
        status = job(folder, environment, output)
        check(status == 0 and len(queued(folder)) == 2 and rows_of(output) == before, f"job 5, by mistake: status {status}, the same {len(before)} rows, not queued again")
        status = job(folder, environment, whole)
        check(status == 0 and rows_of(output) == rows_of(whole) and len(rows_of(whole)) == 2 * STEPS + 3,
              f"trajectory.csv of the four jobs is that of one unbroken job: {len(rows_of(output))} and {len(rows_of(whole))} rows")
        broken = subprocess.run(["bash", str(folder / "slurm_script"), "input/none.yaml", str(folder / "no")], cwd=ROOT, env=environment).returncode
        check(broken == 2 and len(queued(folder)) == 2, f"a scene that is not there: status {broken}, not queued again")
        if failed and (folder / "output").exists():
            print((folder / "output").read_text(encoding="utf-8")[-3000:])
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
