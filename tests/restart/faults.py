#!/usr/bin/env python3
"""Faults: whatever happens to a run or its folder, one clear line at most, nothing that was written is lost, and the run can be continued to the last bit.

    faults.py disk DLMFD MPIRUN...         a disk that gets full while rows, fields or a checkpoint are written, and at the start
    faults.py folder DLMFD MPIRUN...       an output folder that is moved, deleted, taken by another run, made unwritable, read-only
    faults.py limits DLMFD MPIRUN...       memory that does not suffice, solves that do not converge
    faults.py kills DLMFD COUNT MPIRUN...  kill -9 at random moments, and while a checkpoint or fields are being written

The disk is a small tmpfs where this user may mount one (root), else limits on the size of files. The output says which.
"""
import glob
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import threading
import time
import xml.etree.ElementTree as ElementTree

import h5py

import runs
from runs import check, checkpoint, children, command, fields, place, run, same_fields, same_state, text, wait_for_rows

STEPS = 8
SCENE = ("-box_size 1,1,1 -grid_resolution 12 -sphere_radius 0.15 -sphere_centers 0.3,0.02,0.2,-0.3,0,-0.2 -fluid_model oldroyd_b -ts_dt 0.05 -ts_max_time 1000"
         " -wall_velocity_lower -1,0,0 -wall_velocity_upper 1,0,0 -progress_every 1000")
FLUID = re.sub(r"-sphere_\S+ \S+ ", "", SCENE) + " -polymer_mode_amplitude 0.1"
FOREVER = " -ts_max_time 1e6"  # 2e7 steps: longer than the test waits


def mounted(path, options):
    return subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", path], stderr=subprocess.DEVNULL).returncode == 0


class Disk:
    """A small disk at place("disk") that can be filled under a running process, and freed."""

    def __init__(self, megabytes):
        os.makedirs(place("disk"))
        self.real, self.filler = mounted(place("disk"), f"size={megabytes}m"), None

    def fill(self, process):
        if not self.real:  # no file may grow
            for pid in [process.pid] + children(process.pid):
                resource.prlimit(pid, resource.RLIMIT_FSIZE, (1000, 1000))
            return
        self.fill_once()
        self.filler = threading.Thread(target=self.keep_full, args=(process,), daemon=True)
        self.filler.start()

    def keep_full(self, process):
        """What the run frees, as by renaming a checkpoint, is taken too, until it has ended; ends() sees to that."""
        while process.returncode is None:
            self.fill_once()
            time.sleep(0.002)

    def fill_once(self):
        with open(place("disk/filler"), "ab", buffering=0) as file:
            try:
                while file.write(bytes(4096)):
                    pass
            except OSError:
                pass

    def free(self):
        if self.filler:
            self.filler.join()
        if os.path.exists(place("disk/filler")):
            os.remove(place("disk/filler"))

    def close(self):
        if self.real:
            subprocess.run(["umount", "-l", place("disk")], check=True)
        shutil.rmtree(place("disk"))


def start(options, folder, ranks=1, before=()):
    return subprocess.Popen(list(before) + command(options, folder, ranks), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def ends(process, what, pattern):
    """The run ends by itself with exit code 2 and one line that matches."""
    try:
        error = process.communicate(timeout=60)[1]
    except subprocess.TimeoutExpired:
        process.kill()
        check(False, f"{what}: goes on as if nothing had happened {process.communicate()[1]}")
        return
    lines = [line for line in error.splitlines() if line.startswith("dlmfd") or "ERROR" in line or "HDF5" in line]
    good = process.returncode == 2 and len(lines) == 1 and re.search("^dlmfd: error: -output_dir " + pattern + "$", lines[0])
    check(bool(good), f"{what}: exit code {process.returncode}, {lines}")


def whole_rows(folder, reference):
    """The rows there are those of the reference as far as they go."""
    found, expected = text(folder), text(reference)
    n = min(len(found), len(expected))
    check(found.endswith(b"\n") and found[:n] == expected[:n], f"  {found.count(b'%c' % 10) - 1} rows, all whole")


def whole_outputs(folder, reference):
    """Every output in fields.h5 is that of the reference, and fields.xmf names them, but for the last perhaps."""
    steps = {}
    with h5py.File(os.path.join(place(folder), "fields.h5"), "r") as file:
        names = [name for name in file if name.startswith("step_")]
    found, expected = fields(folder), fields(reference)
    for name, values in found.items():
        step = name.split("/")[1]
        steps[step] = steps.get(step, True) and (name not in expected or values.tobytes() == expected[name].tobytes())
    root = ElementTree.fromstring(text(folder, "fields.xmf"))
    listed = [grid.get("Name") for grid in root.find("Domain/Grid").findall("Grid")]
    good = all(steps.values()) and set(steps) == set(names) and listed == names[:len(listed)] and len(names) - len(listed) <= 1
    if not good:
        check(False, f"  outputs {names}, equal to the reference {steps}, in fields.xmf {listed}")
    return good


def first_leg(folder, scene=SCENE, ranks=1, before=()):
    """Three steps and their checkpoint, which is returned; and the run of all steps, in place("whole...")."""
    whole = f"whole{ranks}" + "f" * (scene is FLUID)
    if not os.path.exists(place(whole)):
        run(scene + f" -ts_max_steps {STEPS} -checkpoint_every {STEPS} -output_fields_every 1", whole, ranks)
    process = start(scene + " -ts_max_steps 3 -checkpoint_every 3 -output_fields_every 1", folder, ranks, before)
    error = process.communicate()[1]
    if process.returncode:
        check(False, f"{folder}: {error}")
    return text(folder, "checkpoint.h5")


def continues(folder, saved, scene=SCENE, ranks=1):
    """The checkpoint is as it was, unless the run has written others; from it the run ends as the whole one."""
    if saved is not None:
        check(text(folder, "checkpoint.h5") == saved, "  the checkpoint before is untouched")
    whole = f"whole{ranks}" + "f" * (scene is FLUID)
    run(scene + f" -ts_max_steps {STEPS} -checkpoint_every {STEPS} -output_fields_every 1 -restart {checkpoint(folder)}", folder, ranks)
    good = same_fields(folder, whole) and same_state(folder, whole) and (scene is FLUID or text(folder) == text(whole))
    left = glob.glob(os.path.join(place(folder), "**", "*.new"), recursive=True)
    check(good and not left, f"  and the run goes on to the last bit {left or ''}")


def disk():
    """Each case: a leg of three steps; then one that is caught by the full disk; then, with space again, the rest."""
    print("disk:", "a small tmpfs" if mounted_here() else "limits on the size of files, since nothing can be mounted here")
    # what the second leg writes, a pattern for the file that fails, ranks
    cases = (("rows", " -output_every 1", r"(trajectory|bulk)\.csv", 1), ("rows", " -output_every 1", r"(trajectory|bulk)\.csv", 2),
             ("fields", " -output_every 1000000 -output_fields_every 1", r"fields\S*", 1), ("fields", " -output_every 1000000 -output_fields_every 1", r"fields\S*", 2),
             ("a checkpoint", " -output_every 1000000 -checkpoint_every 1", r"checkpoint\.h5", 1))
    for what, options, name, ranks in cases:
        small = Disk(8)
        saved = first_leg("disk/out", ranks=ranks)
        process = start(SCENE + FOREVER + options + f" -restart {checkpoint('disk/out')}", "disk/out", ranks)
        wait_for_change("disk/out", "fields.h5" if "fields" in options else "checkpoint.h5" if "checkpoint" in options else "trajectory.csv")
        small.fill(process)
        step = r"\d+" if "checkpoint" in options else "3"
        ends(process, f"disk full, {what}, ranks: {ranks}",
             rf"\S+: cannot write \S+/{name} \((No space left on device|File too large)\); allowed: a folder that can be written, with space; -restart \S+checkpoint\.h5 goes on from step {step}")
        if "checkpoint" not in options:
            whole_rows("disk/out", f"whole{ranks}")
            whole_outputs("disk/out", f"whole{ranks}")
        small.free()
        if "checkpoint" in options:
            run(SCENE + f" -ts_max_steps 3 -restart {checkpoint('disk/out')}", "disk/out", ranks)
            check(text("disk/out", "checkpoint.h5") != saved, "  the last checkpoint can be read")
        else:
            continues("disk/out", saved, ranks=ranks)
        small.close()
    small = Disk(1)
    if small.real:
        with open(place("disk/filler"), "wb") as file:
            file.write(bytes(1024 * 1024))
        for what, scene in (("rows", SCENE), ("fields", FLUID + " -output_fields_every 1")):
            ends(start(scene + FOREVER, "disk/out"), f"disk full at the start, {what}", r"\S+: cannot write \S+ \(No space left on device\); allowed: a folder that can be written, with space")
        small.close()


def mounted_here():
    small = Disk(1)
    small.close()
    return small.real


def wait_for_change(folder, name):
    """Until a file of the folder appears, is another one or longer."""
    def state():
        try:
            found = os.stat(os.path.join(place(folder), name))
            return found.st_ino, found.st_size
        except FileNotFoundError:
            return None

    before, deadline = state(), time.time() + 30
    while time.time() < deadline and state() in (before, None):
        time.sleep(0.002)


def folder():
    """Each case: a leg of three steps, then one whose folder something happens to; then the rest."""
    saved = first_leg("moved")
    process = start(SCENE + FOREVER + f" -restart {checkpoint('moved')}", "moved")
    wait_for_rows(process, "moved", 20)
    os.rename(place("moved"), place("elsewhere"))
    ends(process, "folder moved", r"\S+/moved: cannot write \S+/(trajectory|bulk)\.csv \(No such file or directory\); allowed: .*, with space")
    whole_rows("elsewhere", "whole1")
    continues("elsewhere", saved)

    first_leg("deleted")
    process = start(SCENE + FOREVER + " -output_fields_every 1 -checkpoint_every 1", "deleted")
    wait_for_rows(process, "deleted", 20)
    os.rename(place("deleted"), place("doomed"))  # at one moment
    shutil.rmtree(place("doomed"))
    ends(process, "folder deleted", r"\S+/deleted: cannot write \S+ \(No such file or directory\); allowed: .*, with space")
    check(not os.path.exists(place("deleted")), "  and not made again")

    process = start(SCENE + FOREVER, "shared")
    wait_for_rows(process, "shared", 20)
    run(SCENE + f" -ts_max_steps {STEPS} -checkpoint_every {STEPS} -output_fields_every 1", "shared")
    ends(process, "folder taken by another run", r"\S+/shared: \S+/(trajectory|bulk)\.csv is not as this run left it; allowed: a folder of its own for each run")
    check(text("shared") == text("whole1"), "  which is not disturbed")

    unwritable()
    read_only()


def unwritable():
    """Root may write everywhere: the run is then that of nobody."""
    nobody = ["setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups"] if os.geteuid() == 0 else []
    os.chmod(runs.FOLDER, 0o755)
    os.makedirs(place("closed"))
    if nobody:
        os.chown(place("closed"), 65534, 65534)
        if subprocess.run(nobody + [runs.PROGRAM, "-options_table"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode:
            print("  unwritable folder: left out, since nobody cannot run the program here")
            return
    saved = first_leg("closed", before=nobody)
    process = start(SCENE + FOREVER + f" -output_fields_every 1 -restart {checkpoint('closed')}", "closed", before=nobody)
    wait_for_rows(process, "closed", 12)
    os.chmod(place("closed"), 0o555)
    ends(process, "folder made unwritable" + (", as nobody" if nobody else ""),
         r"\S+/closed: cannot write \S+ \(Permission denied\); allowed: a folder that can be written, with space; -restart \S+ goes on from step 3")
    whole_outputs("closed", "whole1")
    ends(start(SCENE + FOREVER, "closed/below", before=nobody), "a folder that cannot be made", r"\S+/below: cannot write \S+/below \(Permission denied\); allowed: .*, with space")
    os.chmod(place("closed"), 0o755)
    continues("closed", saved)


def read_only():
    small = Disk(20)
    if not small.real:
        print("  read-only disk: left out, since nothing can be mounted here")
        small.close()
        return
    first_leg("disk/out", FLUID)
    process = start(FLUID + FOREVER + f" -output_every 50 -output_fields_every 100000 -checkpoint_every 100 -restart {checkpoint('disk/out')}", "disk/out")
    wait_for_change("disk/out", "fields.h5")
    deadline = time.time() + 30
    while time.time() < deadline and subprocess.run(["mount", "-o", "remount,ro", place("disk")], stderr=subprocess.DEVNULL).returncode:
        pass  # refused while a file is open for writing, which rows of every step would keep it nearly always
    ends(process, "disk read-only", r"\S+: cannot write \S+ \(Read-only file system\); allowed: a folder that can be written, with space; -restart \S+ goes on from step \d+")
    whole_outputs("disk/out", "whole1f")
    subprocess.run(["mount", "-o", "remount,rw", place("disk")], check=True)
    run(FLUID + f" -ts_max_steps 3 -restart {checkpoint('disk/out')}", "disk/out")
    small.close()


def limits():
    coarse = "-box_size 1,1,1 -grid_resolution 8 -sphere_radius 0.2 -sphere_centers 0.1,0,0 -wall_velocity_upper 1,0,0"
    cases = (("bodies", coarse + " -saddle_fieldsplit_bodies_ksp_max_it 1",
              r"-saddle_rtol 1e-06: the bodies' solve did not reach it in 1 iterations \(DIVERGED_ITS\); allowed: a larger one, a smaller -ts_dt, or a larger -saddle_fieldsplit_bodies_ksp_max_it"),
             ("fluid", coarse + " -stokes_block_limit 0 -stokes_fieldsplit_pressure_ksp_max_it 1",
              r"-stokes_fieldsplit_pressure_ksp_rtol 0\.0001: the solve for the pressure did not reach it \(DIVERGED_ITS, at most 1 iterations\); allowed: a larger one, a larger -stokes_"))
    for ranks in (1, 2):
        for what, options, pattern in cases:
            done = run(options, what, ranks, 2)
            lines = [line for line in done.stderr.splitlines() if line.startswith("dlmfd") or "ERROR" in line]
            check(len(lines) == 1 and bool(re.match("dlmfd: error: " + pattern, lines[0])), f"{what} do not converge on {ranks} ranks: {lines}")

    def small():
        resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))

    if subprocess.run([runs.PROGRAM, "-options_table"], preexec_fn=small, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False).returncode:
        print("  too little memory: left out, since this build does not start in 2 GiB")
        return
    done = subprocess.run(command("-box_size 1,1,1 -grid_resolution 400", "large"), preexec_fn=small, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, timeout=120, check=False)
    lines = [line for line in done.stderr.splitlines() if line.startswith("dlmfd") or "PETSC ERROR" in line]
    good = len(lines) == 1 and re.match(r"dlmfd: error: the memory of rank 0 is too small \(in .*\); allowed: a smaller -grid_resolution, or more machines", lines[0])
    check(bool(good) and done.returncode == 2 and not os.path.exists(place("large")), f"too little memory: exit code {done.returncode}, {lines}")


def begun(pattern):
    """Whether a file that is there while another is written is in the folder."""
    return lambda where: bool(glob.glob(os.path.join(where, pattern)))


def growing(where):
    """Whether fields.h5 is longer than HDF5 knows: an output is being written."""
    try:
        with open(os.path.join(where, "fields.h5"), "rb") as file:
            head = file.read(36)
            return len(head) == 36 and os.fstat(file.fileno()).st_size > int.from_bytes(head[28:], "little")
    except FileNotFoundError:
        return False


# what is seen at the moment; None: any moment
AIMS = {"while a checkpoint is written": begun("checkpoint*.new"), "while fields are written": growing, "while they are put into the table of fields.h5": begun("fields.h5.redo*"), "at any moment": None}


def strike(process, where, aim, delay, ranks):
    """Kills one rank after the delay, or else when an unfinished file of the aim is seen for a random time. False if the run ended before."""
    deadline = time.time() + (delay if aim is None else 60)
    targets, skip = [process.pid] if ranks == 1 else [], random.randrange(4)
    while time.time() < deadline:
        if process.poll() is not None:
            return False
        targets = targets or children(process.pid)
        if aim is None:
            time.sleep(0.001)
        elif targets and aim(where):
            if skip == 0:
                break
            skip -= 1
            while aim(where):
                pass
    os.kill(random.choice(targets or [process.pid]), signal.SIGKILL)
    process.communicate()
    return True


def kills(count):
    """Runs of 12 steps that write everything every step, each killed, continued, killed again; the last leg ends as the run that was not killed."""
    options, chosen = " -ts_max_steps 12 -checkpoint_every 1 -output_fields_every 1", list(AIMS)
    struck, caught, leg = dict.fromkeys(AIMS, 0), dict.fromkeys(AIMS, 0), 0
    while sum(struck.values()) < count and leg < count:
        ranks = 2 if leg % 4 == 3 else 1
        whole, here, begun = f"never{ranks}", f"killed{leg}", time.time()
        if not os.path.exists(place(whole)):
            run(SCENE + options, whole, ranks)
            span = time.time() - begun
        for k in range(7):
            name = chosen[0]
            chosen.append(chosen.pop(0))
            restart = f" -restart {checkpoint(here)}" if os.path.exists(checkpoint(here)) else ""
            process = start(SCENE + options + restart, here, ranks)
            last = k == 6 or sum(struck.values()) >= count
            if last or not strike(process, place(here), AIMS[name], random.uniform(0.02, span), ranks):
                error = process.communicate(timeout=300)[1]
                if process.returncode:
                    check(False, f"{here}: exit code {process.returncode} {error.strip()}")
                break
            struck[name] += 1
            caught[name] += bool(AIMS[name] and AIMS[name](place(here)))
            if os.path.exists(os.path.join(place(here), "fields.xmf")) and not os.path.exists(os.path.join(place(here), "fields.h5.redo")):
                whole_outputs(here, whole)
        if not (text(here) == text(whole) and same_fields(here, whole) and same_state(here, whole)):
            check(False, f"{here}: not the run that was not killed")
        shutil.rmtree(place(here))
        leg += 1
    for name in AIMS:
        print(f"  {struck[name]} kills {name}" + (f", {caught[name]} of them left it unfinished" if AIMS[name] else ""))
    check(sum(caught.values()) > 0 and sum(struck.values()) >= count, f"{sum(struck.values())} kills in {leg} runs; every output was whole and every run ended as the one that was not killed")


if __name__ == "__main__":
    runs.main({"disk": disk, "folder": folder, "limits": limits, "kills": kills})
