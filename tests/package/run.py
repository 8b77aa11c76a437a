#!/usr/bin/env python3
"""What is installed, packed and told about itself.

    run.py version BUILD MPIRUN...    dlmfd -version: once on any ranks, without a scene; the same facts in summary.json
    run.py commit BUILD MPIRUN...     the commit in -version follows the source tree: repository, archive, neither
    run.py install BUILD MPIRUN...    cmake --install, moved elsewhere; a program against it by pkg-config
    run.py deb BUILD MPIRUN...        tools/package: fields, files, processor, man page; the unpacked program runs a scene, its tools plot it
"""
import glob
import gzip
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
HERE = pathlib.Path(__file__).resolve().parent
SKIP = 77
FACTS = {"dlmfd": r"\d+\.\d+\.\d+", "commit": r"[0-9a-f]{12}(-modified)?|none", "build": "Release|Debug", "native": "yes|no", "compiler": r".+ \d.*",
         "flags": ".*-O.*", "petsc": r"3\.\d+\.\d+.*", "scalar": "(real|complex), (single|double|extended) precision", "index": "(32|64) bits", "mpi": r".+ v?\d.*",
         "hypre": r"\d+\.\d+\.\d+|none", "hdf5": r"1\.\d+\.\d+", "fftw": r"3\.\d+\.\d+", "metis": r"\d+\.\d+\.\d+", "yaml": r"\d+\.\d+\.\d+"}
SMALL = ["-box_size", "1,1,1", "-grid_resolution", "16", "-sphere_centers", "0,0,0", "-sphere_radius", "0.2", "-ts_max_steps", "1"]
USERS_LACK = ("LD_LIBRARY_PATH", "PKG_CONFIG_PATH", "PYTHONPATH", "OMPI_MCA_ess_singleton_isolated", "OMPI_MCA_pml", "OMPI_MCA_btl")
LIBRARIES = ("libc6", "libpetsc-real3", "libhdf5-openmpi", "libopenmpi3", "libfftw3-double3", "libmetis5", "libyaml-0-2", "liblapack3", "openmpi-bin", "python3")
FAILURES = []


def check(good, message):
    if not good:
        FAILURES.append(message)
        print("FAILED", message)


def run(*command, cwd=None, env=None, good=True):
    """What the command prints; it works under a strict umask. Ends the test if it fails."""
    plain = {key: value for key, value in os.environ.items() if key not in USERS_LACK}
    plain.update(ASAN_OPTIONS="detect_leaks=0", OMP_NUM_THREADS="1", DLM_SETUP="skip", DLM_JOBS="2", **(env or {}))
    result = subprocess.run([str(part) for part in command], cwd=cwd, env=plain, capture_output=True, text=True, timeout=600, check=False, umask=0o077)
    if (result.returncode == 0) != good:
        sys.exit(f"FAILED {' '.join(map(str, command))}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    return result.stdout if good else result.stdout + result.stderr


def facts_of(text):
    """The lines of -version as {name: value}; twice the same name is a failure."""
    lines = [line.split(maxsplit=1) for line in text.splitlines()]
    check(len(lines) == len(FACTS), f"-version prints {len(lines)} lines, not {len(FACTS)}:\n{text}")
    return {line[0]: line[1].strip() for line in lines if len(line) == 2}


def version(build, mpirun, folder):
    program = build / "dlmfd"
    first = run(program, "-version", cwd=folder)
    told = facts_of(first)
    for name, pattern in FACTS.items():
        check(re.fullmatch(pattern, told.get(name, "")), f"-version: {name} is {told.get(name)!r}, not like {pattern}")
    check(told["dlmfd"] == released(), f"-version says {told['dlmfd']}, CHANGELOG {released()}")
    check("Copyright" not in first and "PETSc Team" not in first, "-version lets PETSc speak")
    for ranks in (1, 2, 3):
        check(run(*mpirun, "-n", ranks, program, "no_such_scene.yaml", "--version", cwd=folder) == first, f"-version differs on {ranks} ranks")
    check(not os.listdir(folder), f"-version leaves {os.listdir(folder)}")
    run(program, *SMALL, cwd=folder)
    summary = json.loads((folder / "out/summary.json").read_text())
    check(summary["version"] == told, f"summary.json says {summary['version']}, -version {told}")


def released():
    return re.match(r"dlmfd \((\S+)\) ", (ROOT / "CHANGELOG").read_text()).group(1)


def commit(build, mpirun, folder):
    """cmake/commit.cmake in a repository of its own."""
    if not shutil.which("git"):
        print("skipped: no git here")
        sys.exit(SKIP)
    source, header = folder / "source", folder / "commit.h"
    shutil.copytree(ROOT / "cmake", source / "cmake")
    shutil.copy(ROOT / ".gitattributes", source)
    if not (ROOT / ".git").exists():  # in a release's tree the commit is there already
        (source / "cmake/commit.txt").write_text("$Format:%H$\n")

    def git(*arguments):
        return run("git", "-C", source, "-c", "user.name=a", "-c", "user.email=a@a.invalid", *arguments).strip()

    def found(where=source):
        run("cmake", "-D", f"SOURCE={where}", "-D", f"OUTPUT={header}", "-P", where / "cmake/commit.cmake", env={"GIT_DIR": "/nowhere"})
        return re.fullmatch(r'#define DLM_COMMIT "(.*)"\n', header.read_text()).group(1)

    check(found() == "none", f"no repository: {found()}")
    run("git", "init", "-q", source)
    for number in (1, 2):
        (source / "file").write_text(str(number))
        git("add", "-A")
        git("commit", "-q", "-m", str(number))
        head = git("rev-parse", "HEAD")[:12]
        check(found() == head, f"commit {number}: {found()}, not {head}")
    before = header.stat().st_mtime_ns
    check(found() == head and header.stat().st_mtime_ns == before, "a header that says the same is written again")
    (source / "file").write_text("3")
    check(found() == head + "-modified", f"changed file: {found()}")
    git("archive", "-o", folder / "release.tar", "HEAD")
    (folder / "release").mkdir()
    run("tar", "xf", folder / "release.tar", "-C", folder / "release")
    check(found(folder / "release") == head, f"archive: {found(folder / 'release')}, not {head}")


def install(build, mpirun, folder):
    run("cmake", "--install", build, "--prefix", folder / "first")
    prefix = folder / "moved"
    os.rename(folder / "first", prefix)
    for name in ("bin/dlmfd", "share/dlmfd/input/pair_two_walls.yaml", "share/doc/dlmfd/README.md", "share/man/man1/dlmfd.1.gz"):
        check((prefix / name).exists(), f"{name} is not installed")
    check(run(prefix / "bin/dlmfd", "-version") == run(build / "dlmfd", "-version"), "the installed program is another one")
    headers = {path.name for path in (prefix / "include/dlmfd").rglob("*")}
    check(headers == {path.name for path in (ROOT / "include").glob("*.h")}, f"installed headers: {sorted(headers)}")
    found = subprocess.run(["find", prefix, "-name", "dlmfd.pc"], capture_output=True, text=True, check=True).stdout.strip()
    env = {"PKG_CONFIG_PATH": os.path.dirname(found)}
    check(run("pkg-config", "--modversion", "dlmfd", env=env).strip() == released(), "dlmfd.pc has another version")
    flags = run("pkg-config", "--cflags", "--libs", "dlmfd", env=env)
    check(str(ROOT) not in flags and str(build) not in flags, f"dlmfd.pc points into the source tree: {flags}")
    shutil.copy(HERE / "grid.c", folder)
    every = " ".join(f"-include {name}" for name in sorted(headers))
    run("sh", "-c", f"${{CC:-cc}} -Werror {every} grid.c -o grid $(pkg-config --cflags --libs dlmfd)", cwd=folder, env=env)
    path = ":".join(re.findall(r"-L(/\S+)", flags))  # libraries that lie where the loader does not look
    check(run(*mpirun, "-n", 2, "./grid", "-grid_resolution", "8", cwd=folder, env={"LD_LIBRARY_PATH": path}) == "8 x 5 x 9 nodes\n", "grid.c counts other nodes than those of half the box")


def fields_of(package):
    return dict(re.findall(r"^(\S+): (.*)$", run("dpkg-deb", "-f", package), re.M))


def check_fields(package):
    fields = fields_of(package)
    wanted = {"Package": "dlmfd", "Version": released(), "Section": "science", "Architecture": run("dpkg", "--print-architecture").strip()}
    for name, value in wanted.items():
        check(fields.get(name) == value, f"{name}: {fields.get(name)}, not {value}")
    check(fields["Maintainer"].startswith("The dlmfd authors <"), f"Maintainer: {fields['Maintainer']}")
    depends = fields["Depends"].split(", ")
    for name in LIBRARIES:
        check(any(entry.startswith(name) for entry in depends), f"Depends lacks {name}: {fields['Depends']}")
    check(not re.search(r"-dev\b", fields["Depends"]), f"Depends on a development package: {fields['Depends']}")


def check_files(package, tree):
    for line in run("dpkg-deb", "-c", package).splitlines():
        check(re.match(r"(l.{9}|[-d]rw.r-.r-.) root/root .* \./usr/", line), f"mode, owner or place: {line}")
    scenes = {path.relative_to(ROOT).as_posix() for path in (ROOT / "input").rglob("*.*")}
    packed = {path.relative_to(tree / "usr/share/dlmfd").as_posix() for path in (tree / "usr/share/dlmfd/input").rglob("*.*")}
    check(scenes == packed, f"scenes that are not the same: {scenes ^ packed}")
    for name in ("copyright", "changelog.gz", "README.md", "docs/theory.md", "docs/pictures/pair_two_walls.png", "examples/pair_two_walls.yaml"):
        check((tree / "usr/share/doc/dlmfd" / name).is_file(), f"no {name} in usr/share/doc/dlmfd")
    for path in tree.rglob("*"):
        check(path.exists(), f"{path} leads nowhere")
    check(not list(tree.rglob("private")), "private headers are packed")


def special(program):
    """Functions with AVX instructions, but for the clones that are chosen at run time (DLM_KERNEL)."""
    for function in run("objdump", "-d", "--no-show-raw-insn", program).split("\n\n"):
        name = re.match(r"[0-9a-f]+ <(.*)>:", function)
        if name and ".arch_" not in name.group(1) and re.search(r"\tv[a-z0-9]+ .*%[xyz]mm", function):
            yield name.group(1)


def check_program(tree, built):
    """No path of its own to libraries, no instruction beyond the architecture's baseline, the newest commit. built: before it was stripped."""
    program = tree / "usr/bin/dlmfd"
    check("PATH" not in run("readelf", "-d", program), "the program looks for libraries in places of this machine")
    found = list(special(built))
    check(not found, f"functions for this processor only: {found}")
    for file in (program, *tree.rglob("libdlmfd.a")):
        check("debug_info" not in run("readelf", "-S", file), f"{file.name} is not stripped")
    told = facts_of(run(program, "-version"))
    check(told["native"] == "no" and told["build"] == "Release", f"the package holds {told}")
    if (ROOT / ".git").exists():
        now = run("git", "-c", "safe.directory=*", "-C", ROOT, "describe", "--always", "--exclude=*", "--abbrev=12", "--dirty=-modified").strip()
        check(told["commit"] == now, f"built from {now}, says {told['commit']}")
    (built.parent / "version/dlmcommit.h").write_text('#define DLM_COMMIT "of another time"\n')
    run("cmake", "--build", built.parent, "--target", "dlmfd")
    check(run(built, "-version") == run(program, "-version"), "a build without a configuration keeps an old commit")


def check_manual(tree, commands):
    page = gzip.open(tree / "usr/share/man/man1/dlmfd.1.gz", "rt", encoding="utf-8").read().replace("\\-", "-")
    keys = re.findall(r"^\| `(-\w+)` \| (.*?) \|", (ROOT / "docs/options.md").read_text(), re.M)
    for key, default in keys:
        check(f'.BR {key} " ({default})"' in page, f"the man page lacks {key} ({default})")
    listed = page.split(".SH OPTIONS\n")[1]
    check(len(keys) > 50 and listed.count("\n.TP\n.BR -") == len(keys), "the man page has other keys than docs/options.md")
    check(not re.search(r"[|@`]|\n\n", listed), "the man page has remains of its sources")
    for command in commands:
        check(f".B {command}\n" in page and (tree / f"usr/share/man/man1/{command}.1.gz").exists(), f"no manual of {command}")


def check_scene(tree, mpirun, folder):
    """A packed scene, and each tool: all of them tell how to call them."""
    bin_folder = tree / "usr/bin"
    scene = tree / "usr/share/dlmfd/input/pair_two_walls.yaml"
    run(*mpirun, "-n", 2, bin_folder / "dlmfd", scene, "-grid_resolution", "16", "-ts_max_steps", "2", cwd=folder)
    run(bin_folder / "dlmfd-plot-trajectories", "out", cwd=folder)
    check((folder / "out/trajectories.png").exists(), "dlmfd-plot-trajectories made no plot")
    run(bin_folder / "dlmfd-report", "out", cwd=folder)
    check("pair that passes" in (folder / "out/report.html").read_text(), "dlmfd-report does not find the reference")
    for command in bin_folder.glob("dlmfd-*"):
        check(f"usage: {command.name}" in run(command, "--help", cwd=folder), f"{command.name} --help does not tell how to call it")


def deb(build, mpirun, folder):
    if not shutil.which("dpkg-shlibdeps"):
        print("skipped: this is not Debian")
        sys.exit(SKIP)
    package = run(ROOT / "tools/package", build / "package").splitlines()[-1]
    tree = folder / "unpacked"
    run("dpkg-deb", "-x", package, tree)
    commands = sorted(path.name for path in (tree / "usr/bin").glob("dlmfd-*"))
    check("dlmfd-plot-trajectories" in commands, f"the tools are {commands}")
    check_fields(package)
    check_files(package, tree)
    check_program(tree, build / "package/dlmfd")
    check_manual(tree, commands)
    check_scene(tree, mpirun, folder)
    if "DLM_NATIVE:BOOL=ON" in (build / "CMakeCache.txt").read_text():
        refused = run("cpack", "-G", "DEB", "-B", folder, "--config", build / "CPackConfig.cmake", good=False)
        check("every processor" in refused, f"cpack packs code of this processor: {refused}")
    if shutil.which("lintian"):
        run("lintian", "--allow-root", "--fail-on", "error", package)


def main():
    build, mpirun = pathlib.Path(sys.argv[2]).resolve(), sys.argv[3:]
    with tempfile.TemporaryDirectory() as folder:
        {"version": version, "commit": commit, "install": install, "deb": deb}[sys.argv[1]](build, mpirun, pathlib.Path(folder))
    print(f"{sys.argv[1]}: {len(FAILURES)} failures")
    return 1 if FAILURES else 0


if __name__ == "__main__":
    sys.exit(main())
