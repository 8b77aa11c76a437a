#!/usr/bin/env python3
"""Feeds mutated scenes to dlmfd: each is accepted, or refused with one line that says what, where, which value and what to do. No crash, no hang, no file left behind.

    run.py FUZZ_SCENE DLMFD OPTIONS_MD COUNT PROGRAM_COUNT SEED MPIRUN...

COUNT inputs go through FUZZ_SCENE (fuzz_scene.c), many in one process, on one rank and a tenth of them on two; PROGRAM_COUNT of them through DLMFD itself, every fifth on two
ranks. SEED 0: another one each time; it is printed.
"""
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

from mutate import HOLES, inputs

USER_ERROR = 2         # exit code of dlmfd
PETSC_USER_INPUT = 95  # PETSc's code of a user error
LIMIT = 90             # seconds a process may take for one input, on a busy machine
ENV = dict(os.environ, ASAN_OPTIONS="detect_leaks=0:allocator_may_return_null=1", UBSAN_OPTIONS="print_stacktrace=1", OMP_NUM_THREADS="1")
SUBJECT = re.compile(r"^dlmfd: error: (-|options file |argument |sphere |the )")
REMEDY = re.compile(r"allowed|did you mean|all keys|Available options")


def keys_of(table):
    """{key: what is allowed} from docs/options.md."""
    with open(table, encoding="utf-8") as file:
        rows = [line.split("|") for line in file if line.startswith("| `-")]
    return {row[1].strip(" `-"): row[3].strip() for row in rows}


def fault(input_, refused, lines):
    """What is wrong with the answer to an input, or None."""
    if not refused:
        return f"accepted, but: {lines}" if lines else None
    if len(lines) != 1:
        return f"{len(lines)} lines: {lines[:12]}"
    line = lines[0]
    if not SUBJECT.match(line) or not REMEDY.search(line) or len(line) > 1500:
        return f"does not say what and what to do: {line[:1600]}"
    if any(ord(c) < 32 or ord(c) == 127 for c in line):
        return f"control characters: {line!r}"
    given = b" ".join([*input_.files.values(), *(word.encode("utf-8", "surrogateescape") for word in input_.arguments)]).lower()
    if any(hole in line.lower() and hole.strip().encode() not in given for hole in HOLES):
        return f"a hole in: {line}"
    if any(word not in line for word in input_.expected):
        return f"does not name {input_.expected}: {line}"
    return None


def lines_of(text):
    return text.rstrip("\n").split("\n") if text else []


def place(folder, number, input_):
    """Writes the files of an input; returns its arguments with their paths."""
    names = {}
    for name, content in input_.files.items():
        names[name] = os.path.join(folder, f"{number}_{name}")
        with open(names[name], "wb") as file:
            file.write(content)
    return [names.get(word, word) for word in input_.arguments]


def read_many(launch, folder, batch):
    """Feeds (number, input) pairs to fuzz_scene: {number: (code, cells, lines)}; code None if the process died of it."""
    found, todo = {}, [(number, place(folder, number, input_)) for number, input_ in batch]
    path = os.path.join(folder, f"list{batch[0][0]}")
    while todo:
        with open(path, "w", encoding="utf-8", errors="surrogateescape") as file:
            file.writelines("\t".join(words) + "\n" for _, words in todo)
        done = subprocess.run(launch + [path], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=ENV, cwd=folder, check=False)
        blocks = re.split(r"^== begin \d+ 0 0\n", done.stderr.decode("utf-8", "replace"), flags=re.M)[1:]
        for block in blocks:
            number = todo.pop(0)[0]
            text, mark, code, cells = re.fullmatch(r"(.*?)(?:== (end) \d+ (\d+) (\d+)\n.*)?", block, re.S).groups()
            found[number] = (int(code), int(cells), lines_of(text)) if mark else (None, 0, lines_of(text))
        if not blocks:
            raise RuntimeError(f"{launch} does not start: {done.stderr[:2000]!r}")
    for number, input_ in batch:
        for name in input_.files:
            os.remove(os.path.join(folder, f"{number}_{name}"))
    return found


def run_program(program, mpirun, folder, number, input_, ranks):
    """An input as a user gives it: (exit code or None, lines, files left)."""
    here = os.path.join(folder, f"run{number}")
    os.makedirs(here)
    for name, content in input_.files.items():
        with open(os.path.join(here, name), "wb") as file:
            file.write(content)
    command = (mpirun + ["-n", str(ranks)] if ranks > 1 else []) + [program] + input_.arguments + ["-ts_max_steps", "0", "-output_dir", "results"]
    try:
        done = subprocess.run([word.encode("utf-8", "surrogateescape") for word in command], cwd=here, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=ENV, timeout=LIMIT, check=False)
    except subprocess.TimeoutExpired:
        return None, ["hangs"], []
    lines = lines_of(done.stderr.decode("utf-8", "replace"))
    if ranks > 1:  # mpirun adds its own account of the exit code
        lines = [line for line in lines if re.search("dlmfd:|PETSC ERROR|HDF5|Sanitizer|runtime error", line)]
    return done.returncode, lines, sorted(set(os.listdir(here)) - set(input_.files))


def through_library(driver, mpirun, folder, fed):
    """Every input on one rank, in two processes at a time; a tenth on two. Yields (number, what is wrong); returns all answers and the number of those on two ranks."""
    half = [list(enumerate(fed))[k::2] for k in range(2)]
    with ThreadPoolExecutor(max_workers=2) as workers:
        found = {number: answer for part in workers.map(lambda batch: read_many([driver], folder, batch), half) for number, answer in part.items()}
    two = read_many(mpirun + ["-n", "2", driver], folder, [(number, input_) for number, input_ in enumerate(fed) if number % 10 == 3])
    for number, answer in two.items():
        if answer != found[number]:
            yield number, f"on two ranks {answer}, on one {found[number]}"
    for number, input_ in enumerate(fed):
        code, _, lines = found[number]
        if code not in (0, PETSC_USER_INPUT):
            yield number, f"crash, hang or error {code}: {lines[:30]}"
        else:
            wrong = fault(input_, code != 0, lines)
            if wrong:
                yield number, wrong
    return found, len(two)


def through_program(program, mpirun, folder, fed, chosen):
    def one(place_in_list):
        number = chosen[place_in_list]
        several = place_in_list % 5 == 0 and ":" not in fed[number].arguments  # which mpirun takes for itself
        return number, run_program(program, mpirun, folder, number, fed[number], 2 if several else 1)

    with ThreadPoolExecutor(max_workers=2) as workers:
        for number, (code, lines, left) in workers.map(one, range(len(chosen))):
            wrong = fault(fed[number], code != 0, lines) if code in (0, USER_ERROR) else f"exit code {code}: {lines[:30]}"
            wrong = wrong or (code and left and f"files were written: {left}") or (code == 0 and left not in (["results"], []) and f"left: {left}")
            if wrong:
                yield number, "dlmfd: " + wrong


def main():
    driver, program, table = (os.path.abspath(path) for path in sys.argv[1:4])
    count, program_count, seed = (int(word) for word in sys.argv[4:7])
    mpirun, seed = sys.argv[7:], seed or random.randrange(1, 10 ** 9)
    keys, failures, begun = keys_of(table), 0, time.time()
    fed = list(inputs(seed, count, keys))

    def report(wrong):
        nonlocal failures
        while True:
            try:
                number, text = next(wrong)
            except StopIteration as end:
                return end.value
            failures += 1
            input_ = fed[number]
            print(f"FAILED input {number} of seed {seed}, {input_.kind}: {text}\n       {input_.arguments} { {name: content[:300] for name, content in input_.files.items()} }")

    with tempfile.TemporaryDirectory() as folder:
        found, two = report(through_library(driver, mpirun, folder, fed))
        kinds, refused = Counter(input_.kind for input_ in fed), [number for number, answer in found.items() if answer[0]]
        print(f"seed {seed}: {len(fed)} inputs ({', '.join(f'{n} {kind}' for kind, n in sorted(kinds.items()))}), {len(refused)} refused, {two} on two ranks too: {time.time() - begun:.0f} s")
        chance = random.Random(seed)
        good = [number for number, (code, cells, _) in found.items() if code == 0 and cells < 10000]
        bad = [number for number in refused if sum(map(len, fed[number].files.values())) < 100000]
        chosen = chance.sample(good, min(program_count // 5, len(good))) + chance.sample(bad, min(program_count * 4 // 5, len(bad)))
        report(through_program(program, mpirun, folder, fed, chosen))
    print(f"{len(chosen)} of them through the program: {time.time() - begun:.0f} s; {failures} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
