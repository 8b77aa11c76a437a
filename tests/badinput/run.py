#!/usr/bin/env python3
"""Runs dlmfd on every scene of cases.py: one line on stderr that matches, exit code 2, no output folder.

usage: run.py DLMFD DOCS_OPTIONS_MD MPIRUN...
"""
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

from cases import CASES

USER_ERROR = 2


def run(command, folder):
    env = dict(os.environ, ASAN_OPTIONS="detect_leaks=0", OMP_NUM_THREADS="1")
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, errors="replace", timeout=120)


def failures_of(program, mpirun, arguments, files, pattern, ranks=1):
    """What is wrong with the way the program refuses one scene."""
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            with open(os.path.join(folder, name), "w", encoding="utf-8", errors="surrogateescape") as file:
                file.write(text)
        output = [] if "output_dir" in arguments + "".join(files.values()) else ["-output_dir", "results"]
        launch = [] if ranks == 1 else mpirun + ["-n", str(ranks)]
        result = run(launch + [program] + arguments.split() + output, folder)
        left = sorted(set(os.listdir(folder)) - set(files))
    errors = result.stderr.splitlines()
    if ranks > 1:  # mpirun adds its own account of the exit code
        errors = [line for line in errors if line.startswith("dlmfd:") or "PETSC ERROR" in line]
    if len(errors) != 1 or not errors[0].startswith("dlmfd: error: "):
        yield "expected one line 'dlmfd: error: ...', got: " + repr(result.stderr[:2000])
    elif not re.search(pattern, errors[0]):
        yield f"message does not match {pattern!r}: {errors[0]}"
    if result.returncode != USER_ERROR:
        yield f"exit code {result.returncode}, expected {USER_ERROR}"
    if left:
        yield f"files were written: {left}"


def table_differs(program, documented):
    """docs/options.md has to be what the program writes."""
    result = run([program, "-options_table"], None)
    if result.returncode:
        return "-options_table failed: " + result.stderr
    with open(documented, encoding="utf-8") as file:
        return None if file.read() == result.stdout else f"{documented} is old: write it again with dlmfd -options_table"


def main():
    program, documented, mpirun = os.path.abspath(sys.argv[1]), sys.argv[2], sys.argv[3:]
    wrong = 0
    with ThreadPoolExecutor(max_workers=2) as workers:
        results = list(workers.map(lambda case: list(failures_of(program, mpirun, *case)), CASES))
    for case, failures in zip(CASES, results):
        for failure in failures:
            wrong += 1
            print(f"FAILED {case[0]}\n       {failure}")
    failure = table_differs(program, documented)
    if failure:
        wrong += 1
        print("FAILED", failure)
    print(f"{len(CASES)} scenes refused, options table compared: {wrong} failures")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
