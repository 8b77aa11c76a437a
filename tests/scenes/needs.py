#!/usr/bin/env python3
"""A scene builds and runs only what it needs: claims of summary.json against what the scene says, and memory against what was claimed.

    needs.py scenes DLMFD     every scene of input/, coarsened, and variations: objects and sub-steps that are there, no bytes for the others, docs/needs.md
    needs.py fields DLMFD     doubles per mesh node, kept and at most, that kinds of scenes take: a field too many fails

Memory is that of the heap (every library's, summary.json) and the high-water mark of PETSc's own allocations (-memory_view).
"""
import glob
import json
import math
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
COARSE = 16
STEPS = 2
UNBUILT = 2048  # bytes that a part may leave that was not built: empty structures

PAIR = "-box_size 1,1,1 -sphere_radius 0.15 -grid_resolution 12 "
SHEAR = PAIR + "-wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0 "
ONE, TWO = "-sphere_centers 0,0,0 ", "-sphere_centers -0.25,0,0,0.25,0,0 "
POLYMER = "-fluid_model oldroyd_b -fluid_relaxation_time 0.5 "
VARIATIONS = [
    SHEAR, SHEAR + ONE, SHEAR + TWO, SHEAR + TWO + "-sphere_inertia 0", SHEAR + TWO + "-sphere_motion rotate", SHEAR + TWO + "-sphere_motion fixed",
    SHEAR + ONE + "-sphere_motion fixed -sphere_velocity 0.1,0,0", SHEAR + TWO + "-contact_range 0", SHEAR + TWO + "-lubrication false",
    PAIR + ONE + "-box_periodic 1,1,1 -gravity 1,0,0", PAIR + TWO + "-box_periodic 1,1,1 -sphere_motion rotate -sphere_torque 0,0,1",
    SHEAR + TWO + "-output_fields_every 1 -checkpoint_every 1", SHEAR + TWO + "-ts_adapt_type scene", SHEAR + TWO + "-ts_split_scheme lie",
    SHEAR + POLYMER, SHEAR + POLYMER + ONE + "-sphere_motion fixed", SHEAR + POLYMER + TWO + "-ts_split_scheme lie -checkpoint_minutes 100",
    PAIR + ONE + "-wall_velocity_upper 1,0,0 -sphere_motion rotate",
    SHEAR + "-sphere_centers 0,0,0.32 -sphere_motion rotate", PAIR + "-box_periodic 1,1,1 -sphere_centers -0.4,0,0,0.27,0,0 -sphere_motion fixed -sphere_omega 0,1,0",
]

# Kinds of scenes: options, doubles per node that stay after the steps, and those that PETSc has at most at a time.
SPHERE = "-sphere_centers 0,0,0 -sphere_radius 0.1 "
KINDS = {
    "newtonian": ("", 29.0, 24.8),
    "sphere": (SPHERE, 58.8, 40.5),
    "fixed sphere, without inertia": (SPHERE + "-sphere_motion fixed -sphere_inertia 0", 58.8, 40.5),
    "oldroyd_b": (POLYMER, 99.4, 101.4),
    "oldroyd_b, explicit, lie": (POLYMER + "-polymer_coupling explicit -ts_split_scheme lie", 99.4, 95.1),
    "sphere, half the box": (SPHERE + "-box_mirror half", 60.3, 41.2), # as many, but for a larger share of ghosts
    "oldroyd_b, half the box": (POLYMER + "-box_mirror half", 102.6, 104.1),
    "carreau": ("-fluid_model carreau -fluid_carreau_n 0.5", 99.3, 101.4),
}
BOX = "-grid_resolution 24 -box_mirror none -wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0 -box_size "
TOLERANCE = 0.5


class Failure(Exception):
    pass


def require(condition, message):
    if not condition:
        raise Failure(message)


def run(program, words):
    """What the program printed, and its summary."""
    env = dict(os.environ, ASAN_OPTIONS="detect_leaks=0", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    with tempfile.TemporaryDirectory() as folder:
        command = [program] + words + ["-ts_max_steps", str(STEPS), "-output_dir", folder]
        result = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True)
        require(result.returncode == 0, f"exit code {result.returncode}: {result.stderr[-2000:]}")
        with open(os.path.join(folder, "summary.json"), encoding="utf-8") as file:
            return result.stdout, json.load(file)


def given(words, key):
    """The text of a key on the command line or in the scene's file, or None."""
    if "-" + key in words:
        return words[words.index("-" + key) + 1]
    if words[0].startswith("-"):
        return None
    with open(os.path.join(ROOT, words[0]), encoding="utf-8") as file:
        match = re.search(rf"^{key}: *([^ #\n]+)", file.read(), re.MULTILINE)
    return match and match[1]


def sheared(scene):
    """Whether two walls, and nothing else that is closed, slide past each other."""
    closed = [d for d in range(3) if not scene["box_periodic"][d]]
    if len(closed) != 1:
        return False
    axis = closed[0]
    names = [f"wall_velocity_x{axis + 1}_{side}" if axis < 2 else f"wall_velocity_{side}" for side in ("lower", "upper")]
    return any(a != b for d, (a, b) in enumerate(zip(*(scene[name] for name in names))) if d != axis)


def close(scene):
    """Whether two bodies are closer at the start than friction reaches."""
    spheres, box, periodic = scene["spheres"], scene["box_size"], scene["box_periodic"]
    reach = 0.75  # mean radii, the default
    for i, a in enumerate(spheres):
        for d in range(3):
            if not periodic[d] and box[d] / 2 - abs(a["center"][d]) - a["radius"] < reach * a["radius"] / 2:
                return True
        for b in spheres[:i]:
            apart = [b["center"][d] - a["center"][d] for d in range(3)]
            apart = [x - box[d] * round(x / box[d]) if periodic[d] else x for d, x in enumerate(apart)]
            if math.hypot(*apart) - a["radius"] - b["radius"] < reach * (a["radius"] + b["radius"]) / 2:
                return True
    return False


def mirrored(scene, words):
    """What of the box is computed: half, where the scene is its own mirror image in x2 = 0 and the mesh can be halved."""
    def parts(keys, components):
        return [float((given(words, key) or "0,0,0").split(",")[k]) for key in keys for k in components]

    across = parts(("gravity", "pressure_gradient", "sphere_force", "sphere_velocity", "wall_velocity_lower", "wall_velocity_upper"), (1,))
    across += parts(("sphere_omega", "sphere_torque"), (0, 2)) + [sphere["center"][1] for sphere in scene["spheres"]]
    if not scene["box_periodic"][1] or sum(scene["box_periodic"]) < 2 or any(across):
        return "none"
    return "half" if scene["cells"][1] % 4 == 0 and scene["cells"][1] >= 8 else "whole"


def needed(summary, words):
    """object -> whether the scene needs it."""
    scene, frame = summary["scene"], summary["frame_velocity"]
    spheres, walls = scene["spheres"], not all(scene["box_periodic"])
    start = [float(v) for v in (given(words, "sphere_velocity") or "0,0,0").split(",")]
    some, free = bool(spheres), any(s["motion"] == "free" for s in spheres)
    polymer = scene["fluid_model"] != "newtonian"
    led = any(s["motion"] == "fixed" for s in spheres) and any(start)
    meet = (free or led) and (walls or len(spheres) > 1)
    adapted = given(words, "ts_adapt_type") == "scene"
    return {
        "grid": True, "Stokes solver": True, "flow": True, "time stepping": True, "work of the steps": True,
        "pressure blocks": sum(scene["box_periodic"]) >= 2,
        "spheres": some, "impulse responses": some, "dense blocks": some, "trajectory": some,
        "lubrication": (meet or close(scene)) and given(words, "lubrication") != "false" and (not polymer or given(words, "lubrication") == "true"),
        "contact": meet and free and scene["contact_range"] > 0 and scene["contact_stiffness"] > 0,
        "motion": any(s["motion"] == "free" or start != frame for s in spheres),
        "inertia": scene["sphere_inertia"] and any(s["motion"] != "fixed" for s in spheres),
        "polymer": polymer, "adapted steps": adapted, "copy of the step": polymer or adapted,
        "bulk stress": sheared(scene), "fields": given(words, "output_fields_every") not in (None, "0"),
        "checkpoints": bool(given(words, "checkpoint_every") or given(words, "checkpoint_minutes")),
    }


def expected_substeps(summary, need):
    """Sub-steps that run, and outputs that are written in the first steps."""
    steps = {"set_up", "saddle"}
    if need["polymer"]:
        steps |= {"advect", "stretch", "judge"}
    if need["motion"]:
        steps |= {"predict"} | ({"correct"} if summary["scheme"] == "strang" else set())
    return steps, {name for name in ("trajectory", "bulk stress", "fields", "checkpoints") if need[name]}


def documented(name):
    """object -> whether docs/needs.md says that a scene of input/ has it."""
    with open(os.path.join(ROOT, "docs", "needs.md"), encoding="utf-8") as file:
        text = file.read()
    column = re.search(rf"\b([A-Z]+) {name}\b", text)
    require(column, f"docs/needs.md does not know {name}: tools/needs > docs/needs.md")
    rows = [[cell.strip() for cell in line.strip("|\n").split("|")] for line in text[text.index("| object |") :].splitlines() if line.startswith("|")]
    return {row[0]: row[rows[0].index(column[1])] != "-" for row in rows[2:]}


def check_scene(program, words):
    _, summary = run(program, words)
    need, parts = needed(summary, words), {part["object"]: part for part in summary["modelled"]}
    require(set(need) == set(parts), f"objects that this test does not know, or that are gone: {set(need) ^ set(parts)}")
    for name, part in parts.items():
        require(need[name] == part["built"], f"{name}: built {part['built']} ({part['why']}), needed {need[name]}")
        require(part["built"] or abs(part["bytes"]) <= UNBUILT, f"{name}: not built, but takes {part['bytes']} bytes")
        require(part["why"], f"{name}: no reason")
    mirror = mirrored(summary["scene"], words)
    require(summary["scene"]["box_mirror"] == mirror, f"-box_mirror {summary['scene']['box_mirror']}, needed {mirror}")
    steps, outputs = expected_substeps(summary, need)
    require(set(summary["seconds_by_substep"]) == steps, f"sub-steps {sorted(summary['seconds_by_substep'])}, needed {sorted(steps)}")
    require(set(summary["seconds_by_output"]) == outputs, f"outputs {sorted(summary['seconds_by_output'])}, needed {sorted(outputs)}")
    require(("polymer" in summary) == need["polymer"], "health of a polymer")
    if words[0].startswith("input"):
        found = documented(os.path.basename(words[0])[:-5])
        require(found == need, f"docs/needs.md says otherwise of {[name for name in need if found.get(name) != need[name]]}: tools/needs > docs/needs.md")
    return "without " + ", ".join(name for name in parts if not parts[name]["built"])


def scenes():
    for path in sorted(glob.glob(os.path.join(ROOT, "input", "*.yaml"))):
        yield [os.path.relpath(path, ROOT), "-grid_resolution", str(COARSE)]
    for line in VARIATIONS:
        yield line.split()


def doubles(program, options):
    """Doubles per node that a longer box takes more: kept on the heap, and PETSc's most."""
    kept, most, nodes = [], [], []
    for box in ("1,0.5,1", "2,0.5,1"):
        text, summary = run(program, (BOX + box + " " + options + " -malloc_debug -memory_view").split())
        kept.append(sum(part["bytes"] for part in summary["modelled"]) / 8)
        most.append(float(re.search(r"Maximum \(over computational time\) space PetscMalloc\(\)ed: +total (\S+)", text).group(1)) / 8)
        nodes.append(summary["nodes"])
    return [(figures[1] - figures[0]) / (nodes[1] - nodes[0]) for figures in (kept, most)]


def check_kind(program, kind):
    options, *expected = KINDS[kind]
    found = doubles(program, options)
    text = "kept {:.2f} ({:.1f}), at most {:.2f} ({:.1f})".format(found[0], expected[0], found[1], expected[1])
    require(all(abs(a - b) <= TOLERANCE for a, b in zip(found, expected)), f"doubles per node, allowed within {TOLERANCE}: {text}")
    return text


def main():
    group, program = sys.argv[1], os.path.abspath(sys.argv[2])
    items, check = {"scenes": (list(scenes()), check_scene), "fields": (list(KINDS), check_kind)}[group]

    def outcome(item):
        name = item if isinstance(item, str) else " ".join(item)
        try:
            return f"ok      {name}: {check(program, item)}"
        except Failure as failure:
            return f"FAILED  {name}: {failure}"

    with ThreadPoolExecutor(max_workers=2) as workers:
        lines = list(workers.map(outcome, items))
    print("\n".join(lines))
    return 1 if any(line.startswith("FAILED") for line in lines) else 0


if __name__ == "__main__":
    sys.exit(main())
