#!/usr/bin/env python3
"""Every command that the docs show is run, made short in a way that a table below states, or has its reason there for not being run.

    commands.py pages ROOT BUILD      commands in indented and fenced blocks of README.md, docs/*.md and docs/gallery/*.md
    commands.py headers ROOT BUILD    commands in the headers of tools/: those for a reader to fill in are held against what --help names
    commands.py long ROOT BUILD       the commands of LONG as they stand
    commands.py gallery ROOT BUILD    tools/gallery makes its quick pages anew: their numbers are those that the pages hold
    commands.py whole ROOT BUILD      all its pages

They run in a scratch copy of what the commands name, so a picture or a table that they write does not touch the source tree. ROOT: the source tree, BUILD: the build's folder.
The commands of a page run in their order, pages side by side.
"""
import concurrent.futures
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

WORKERS = 2
# What a command begins with. Any other indented block must be one of TEXT.
COMMAND = re.compile(r"(?:[A-Z_]+=\S+ )*(?:\./)?(?:tools/\w|build/\w|dlmfd|mpirun |srun |sbatch |apt |cmake |ctest |git |pip |python3? |cd |export |make |sudo |curl |wget )")
TEXT = {
    "docs/theory.md": r"", "docs/developer.md": r" *(predict|saddle) ",  # equations; the parts of a step
    "docs/guide.md": r"# pair\.yaml:|fluid_model:|steps? +\d",
    "docs/output.md": r"fields  +yes|import h5py",
}
# What would reach beyond the scratch folder is never run, so it must be in NOT_RUN.
BEYOND = re.compile(r"(apt|sudo|pip|curl|wget|git|srun|sbatch)\b")
QUICK_PAGES = ("startup_shear", "poiseuille_oldroydb", "stress_mode", "rotation_newtonian")

# command (a regular expression): why it is not run here
NOT_RUN = {
    r"(\./)?tools/check\b": "it runs these tests",
    r"tools/check_clean": "half an hour as root in a chroot; run by hand before a release",
    r"apt install .*tools/package": "test package.deb makes and tries the package",
    r"tools/package": "test package.deb",
    r"tools/setup": "needs root and the network; tools/check runs it before any test",
    r"tools/build": "it has built what runs here",
    r"sbatch ": "test docs.slurm runs the script with a stand-in for Slurm",
    r"tools/extremes( --quick)?$": "an hour; test scenes.extremes runs --quick",
    r"tools/extremes --only": "as tools/extremes",
    r"tools/gallery --again": "twenty minutes; test docs.whole makes every page, docs.gallery the quick ones",
    r"tools/close_pairs --raw": "its input is what dlmfd_close_pairs has printed over ten minutes",
}


def instead(words, *options):
    """The command with these options in place of its own of the same names; a program without a folder is the build's."""
    words, arrow, file = words.partition(" >")
    for option in options:
        words = re.sub(rf" {option.split()[0]} \S+", "", words) + " " + option
    return re.sub(r"^dlmfd_", "build/dlmfd_", words) + arrow + file


# command: what is appended, or a function of the command; the first that fits counts. What is long in itself also stands in LONG.
STEPS = " -ts_max_steps 2 -grid_resolution 16"
SHORTER = {
    r".*-restart ": " -ts_max_steps 3 -grid_resolution 16",
    r".*-checkpoint_every ": STEPS + " -checkpoint_every 1",
    r"mpirun .*dlmfd /usr/share/dlmfd/": lambda words: words.replace("/usr/share/dlmfd/", "") + STEPS,
    r"(\S+=\S+ )*(\./)?tools/run ": STEPS,
    r"(mpirun .*)?build/dlmfd input/": STEPS,
    r"(build/)?dlmfd_calibrate -fit": lambda words: instead(words, "-radii 1.5", "-positions 1"),
    r"(build/)?dlmfd_calibrate( |$)": lambda words: instead(words, "-radii 2", "-positions 1"),
    r"(tools/close_pairs build/)?dlmfd_close_pairs( |$)": lambda words: instead(words, "-radii 1.6", "-gaps 1", "-places 1"),
    r"tools/two_spheres": lambda words: instead(words, "--gaps 1"),
    r"tools/tradeoff \w+ --retime": lambda words: instead(words, "--retime 0.35") + " --draw",
    r"tools/tradeoff \w+": " --draw",
}
LONG = (r"tools/two_spheres", r"build/dlmfd_calibrate -")


def blocks(text):
    """Lists of lines: indented by four after an empty line, or fenced."""
    for fenced in re.findall(r"^```[^\n]*\n(.*?)^```", text, re.M | re.S):
        yield fenced.rstrip().split("\n")
    text = re.sub(r"^```[^\n]*\n.*?^```", "", text, flags=re.M | re.S)
    for indented in re.findall(r"(?:\A|\n\n)((?:    [^\n]*(?:\n|\Z)|\n(?=    ))+)", text):
        yield [line[4:] for line in indented.rstrip().split("\n") if line.strip()]


def bare(line):
    """The commands of a line, without the words of explanation that follow some spaces."""
    return [part for part in re.split(r"\s{2,}|\s#\s", line.strip()) if COMMAND.match(part)]


def commands_of(page, root):
    """The commands of a page, and what is neither a command nor known text."""
    name, commands, unknown = str(page.relative_to(root)), [], []
    for lines in blocks(page.read_text(encoding="utf-8")):
        if COMMAND.match(lines[0]):
            commands += [command for line in lines for command in bare(line)]
            unknown += [line for line in lines if not COMMAND.match(line)]
        elif name not in TEXT or not re.match(TEXT[name], lines[0]):
            unknown.append(lines[0])
    return commands, unknown


def header_of(tool):
    text = tool.read_text(encoding="utf-8")
    if '"""' in text[:200]:
        return text.split('"""')[1]
    if tool.suffix == ".c":
        return text.partition("*/")[0]
    return "".join(line[1:].lstrip(" ").join(("  ", "\n")) if line.startswith("#  ") else "\n" for line in text.partition("\nset -")[0].split("\n"))


def header_commands(tool):
    """Commands of a header that call the tool stand in lines of their own, indented."""
    lines = re.findall(r"^\s{2,}(\S.*)$", header_of(tool), re.M)
    return [command for line in lines for command in bare(line) if re.search(rf"\b(tools/|dlmfd_){re.escape(tool.stem)}\b", command)]


def to_fill_in(command):
    """Whether a reader must put something in: NAME, [choice], a | b."""
    return bool(re.search(r"\[|\||\s[A-Z]{2,}\b", command))


def shorter(command):
    """The command as it is run here, or None and why not."""
    for pattern, reason in NOT_RUN.items():
        if re.match(pattern, command):
            return None, reason
    for pattern, change in SHORTER.items():
        if re.match(pattern, command):
            return (command + change if isinstance(change, str) else change(command)), ""
    return command, ""


def scratch(root, build, folder):
    """What commands name: the programs, tools/ with an idle setup and build, input/ and a copy of docs/."""
    for name in ("input", "tools", "docs"):
        shutil.copytree(root / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("setup", "build"):
        (folder / "tools" / name).write_text("#!/bin/sh\n", encoding="utf-8")
    (folder / "build").mkdir()
    for program in build.glob("dlmfd*"):
        if program.is_file() and os.access(program, os.X_OK):
            (folder / "build" / program.name).symlink_to(program)
    lines = next(lines for lines in blocks((root / "docs/guide.md").read_text(encoding="utf-8")) if lines[0].startswith("# pair.yaml:"))
    (folder / "pair.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def environment(folder):
    return {
        **os.environ, "PATH": f"{folder / 'build'}:{os.environ['PATH']}", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "OMPI_MCA_mpi_yield_when_idle": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_hwloc_base_binding_policy": "none", "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "DLM_TERMINAL": "0", "ASAN_OPTIONS": "detect_leaks=0", "PYTHONDONTWRITEBYTECODE": "1", "MPLBACKEND": "Agg",
    }


def call(command, folder):
    """None, or the last line that a command which fails leaves."""
    done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment(folder), stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=1800)
    if done.returncode:
        lines = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()
        return f"exit status {done.returncode}: {next((line for line in lines if 'error:' in line), lines[-1])}"
    return None


class Record:
    def __init__(self):
        self.failed = 0

    def __call__(self, good, where, command, words):
        self.failed += not good
        print(f"{'ok    ' if good else 'FAILED'}  {where}: {command}{f': {words}' if words else ''}", flush=True)


def run_page(page, root, folder, record, only=None):
    name = page.relative_to(root)
    commands, unknown = commands_of(page, root)
    for line in unknown:
        record(False, name, line, "neither a command that is run, nor text that is known: see COMMAND and TEXT of tests/docs/commands.py")
    for command in commands:
        if only:
            if any(re.match(pattern, command) for pattern in only):
                wrong = call(command, folder)
                record(not wrong, name, command, wrong)
            continue
        run, reason = shorter(command)
        if run and BEYOND.match(run):
            record(False, name, run, "reaches beyond the scratch folder: not run, and not in NOT_RUN")
            continue
        wrong = call(run, folder) if run else None
        record(not wrong, name, run or command, wrong or (f"not run: {reason}" if not run else ""))


def all_pages(root):
    return [root / "README.md", *sorted((root / "docs").glob("*.md")), *sorted((root / "docs/gallery").glob("*.md"))]


def pages(root, folder, record, only=None):
    with concurrent.futures.ThreadPoolExecutor(WORKERS) as pool:
        for done in [pool.submit(run_page, page, root, folder, record, only) for page in all_pages(root)]:
            done.result()


def check_usage(tool, command, help_of, folder, record):
    """A command to fill in: its --options are those that --help names."""
    if tool not in help_of:
        done = subprocess.run([f"tools/{tool}", "--help"], cwd=folder, env=environment(folder), capture_output=True, text=True)
        help_of[tool] = done.stdout.partition("options:")[2] if done.returncode == 0 else ""
    absent = [word for word in re.findall(r"(?<![\w-])--?[a-z]\w*", command) if not re.search(rf"{re.escape(word)}\b", help_of[tool])]
    record(help_of[tool] != "" and not absent, f"tools/{tool}", command, f"--help names no {', '.join(absent) or 'options'}" if absent or not help_of[tool] else "")


SHELL_USAGE = {"run": "tools/run without a scene ends with this line", "dlmfd": "test docs.slurm runs the script with a stand-in for Slurm"}


def headers(root, folder, record):
    on_pages = {shorter(command)[0] for page in all_pages(root) for command in commands_of(page, root)[0]}

    def one(tool):
        commands = header_commands(tool)
        record(bool(commands) or tool.suffix in (".py", ".csv") or tool.name == "bench.c", f"tools/{tool.name}", f"{len(commands)} commands in its header", "")
        help_of = {}
        for command in commands:
            run, reason = shorter(command)
            if run in on_pages and run:
                run, reason = None, "test docs.pages"
            if run and to_fill_in(command):
                if tool.stem in SHELL_USAGE:
                    record(True, f"tools/{tool.name}", command, f"not run: {SHELL_USAGE[tool.stem]}")
                else:
                    check_usage(tool.name, command, help_of, folder, record)
                continue
            wrong = call(run, folder) if run else None
            record(not wrong, f"tools/{tool.name}", run or command, wrong or (f"not run: {reason}" if not run else ""))

    with concurrent.futures.ThreadPoolExecutor(WORKERS) as pool:
        for done in [pool.submit(one, tool) for tool in sorted((root / "tools").iterdir()) if tool.is_file()]:
            done.result()


def numbers_of(page):
    """The rows of a page's numbers; rounding is no number."""
    rows = page.read_text(encoding="utf-8").partition("<!-- numbers -->\n")[2].partition("\n\n")[0].splitlines()
    return [re.sub(r"[-+]0\.000 %", "0.000 %", row) for row in rows if row.startswith("| ") and "| cells |" not in row]


def gallery(root, folder, record, names):
    for name in names:
        wrong = call(f"tools/gallery {name}", folder)
        before, after = (numbers_of(tree / f"docs/gallery/{name}.md") for tree in (root, folder))
        record(not wrong, f"docs/gallery/{name}.md", "tools/gallery", wrong)
        for old, new in zip(before, after):
            record(old == new, f"docs/gallery/{name}.md", old, "" if old == new else f"now: {new}")
        record(len(before) == len(after) > 2, f"docs/gallery/{name}.md", f"{len(after)} lines of numbers", "")
        for picture in re.findall(r"!\[.*?\]\((\S+?\.png)\)", (root / f"docs/gallery/{name}.md").read_text(encoding="utf-8")):
            size = (folder / "docs/gallery" / picture).stat().st_size
            record(size < 120e3, f"docs/gallery/{name}.md", picture, f"{size / 1e3:.0f} kB of at most 120")


def main():
    part, root, build = sys.argv[1], pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3]).resolve()
    record = Record()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        scratch(root, build, folder)
        if part in ("pages", "long"):
            pages(root, folder, record, LONG if part == "long" else None)
        elif part == "headers":
            headers(root, folder, record)
        else:
            gallery(root, folder, record, QUICK_PAGES if part == "gallery" else sorted(page.stem for page in (root / "docs/gallery").glob("[a-z]*.md")))
    print(f"{record.failed} failed")
    sys.exit(1 if record.failed else 0)


if __name__ == "__main__":
    main()
