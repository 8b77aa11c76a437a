#!/usr/bin/env python3
"""Pictures of short runs: plot_trajectories, plot_rotation, plot_fields, movie and report.

run.py tools DLMFD      three short runs; every tool from the command line; what the pictures and the page hold; slices and circles exact
run.py errors DLMFD     every error of the tools: one line that says what, exit status 1, no file
run.py browser DLMFD    the page in headless Chromium: all sections, no missing picture, not blank
run.py reference        measures of dlmreference on paths that are known, and that every row of reference.csv can be measured
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOOLS = os.path.join(ROOT, "tools")
sys.path.insert(0, TOOLS)
sys.dont_write_bytecode = True

import h5py  # noqa: E402
import numpy  # noqa: E402
from PIL import Image  # noqa: E402

import dlmplot  # noqa: E402

plot_bulk, plot_fields, plot_profile, plot_trajectories, plot_rotation, movie, report = map(
    dlmplot.load_tool, ("plot_bulk", "plot_fields", "plot_profile", "plot_trajectories", "plot_rotation", "movie", "report")
)
RUNS = {
    "pair": "input/pair_one_wall.yaml -grid_resolution 16 -ts_dt 0.1 -ts_max_time 0.6 -output_fields_every 2"
    " -sphere_centers -0.5,0,0.1,0.5,0.02,-0.1",
    "elastic": "-box_size 1,1,1 -grid_resolution 16 -wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0"
    " -fluid_model oldroyd_b -fluid_relaxation_time 0.5 -sphere_radius 0.1 -sphere_centers 0.45,0.02,0"
    " -ts_split_scheme strang -ts_dt 0.1 -ts_max_time 0.4 -output_fields_every 4",
    "shear": "input/startup_shear.yaml -ts_max_time 1 -ts_dt 0.1 -output_fields_every 10",
}
program, folder, failed = "", "", 0


def check(good, text):
    global failed
    failed += not good
    print(("ok      " if good else "FAILED  ") + text, flush=True)


def make(*names):
    for name in names:
        command = [program, *RUNS[name].split(), "-output_dir", os.path.join(folder, name), "-progress_every", "1000"]
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if done.returncode:
            sys.exit(f"{' '.join(command)}\n{done.stdout[-2000:]}")


def call(tool, *words):
    """The one line that a tool prints last, run as users run it."""
    done = subprocess.run([os.path.join(TOOLS, tool), *words], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    lines = done.stdout.splitlines()
    check(
        done.returncode == 0 and lines and os.path.exists(os.path.join(folder, lines[-1])),
        f"{tool} {' '.join(words)}: {lines[-1] if lines else 'no output'}",
    )
    return os.path.join(folder, lines[-1])


def check_image(image, what, size=None):
    """Of the expected size in pixels, and neither blank nor one colour."""
    pixels = numpy.asarray(image.convert("RGB")).reshape(-1, 3)
    ink = float((pixels.min(axis=1) < 250).mean())
    colors = numpy.count_nonzero(numpy.bincount((pixels // 16).astype(int) @ (256, 16, 1)))
    check(
        ink > 0.01 and colors > 10 and (size is None or abs(numpy.array(image.size) - size).max() <= 1),
        f"{what}: {image.size[0]} x {image.size[1]}, {100 * ink:.0f} % ink, {colors} colours",
    )


def overlap(a, b):
    return min(a.x1, b.x1) - max(a.x0, b.x0) > 1 and min(a.y1, b.y1) - max(a.y0, b.y0) > 1


def shown_texts(figure):
    """(text, its box) of all that the figure shows."""
    out_of_view = {
        id(text)
        for axes in figure.axes
        for axis in (axes.xaxis, axes.yaxis)
        for tick in axis.get_major_ticks() + axis.get_minor_ticks()
        if not min(axis.get_view_interval()) <= tick.get_loc() <= max(axis.get_view_interval())
        for text in (tick.label1, tick.label2)
    }
    texts = [
        text
        for text in figure.findobj(dlmplot.plt.Text)
        if text.get_visible() and text.get_text().strip() and id(text) not in out_of_view and (text.axes is None or text.axes.get_visible())
    ]
    return [(text, text.get_window_extent()) for text in texts]


def check_figure(figure, what):
    """An axis with numbers has a label, every text lies within the figure, no two overlap, none is tiny."""
    figure.canvas.draw()
    page, shown = figure.bbox, shown_texts(figure)
    visible = {id(text) for text, _ in shown}
    unnamed = [
        (axes.get_xlabel(), axes.get_ylabel())
        for axes in figure.axes
        for axis in (axes.xaxis, axes.yaxis)
        if not axis.get_label().get_text() and any(id(label) in visible for label in axis.get_ticklabels())
    ]
    outside = [text.get_text() for text, box in shown if box.x0 < page.x0 - 1 or box.x1 > page.x1 + 1 or box.y0 < page.y0 - 1 or box.y1 > page.y1 + 1]
    crossing = [(a.get_text(), b.get_text()) for k, (a, box_a) in enumerate(shown) for b, box_b in shown[:k] if overlap(box_a, box_b)]
    small = [text.get_text() for text, _ in shown if text.get_fontsize() < 7]
    check(
        len(shown) > 5 and not (unnamed or outside or crossing or small),
        f"{what}: {len(shown)} texts; axes without label {unnamed}, clipped {outside}, overlapping {crossing}, under 7 pt {small}",
    )
    dlmplot.plt.close(figure)


def figures():
    """All figures of the three runs, looked at from inside."""
    pair, elastic, shear = (dlmplot.Run(os.path.join(folder, name)) for name in ("pair", "elastic", "shear"))
    check_figure(plot_trajectories.trajectory_figure([pair]), "trajectories, pair")
    check_figure(plot_trajectories.trajectory_figure([pair, elastic]), "trajectories, two runs")
    check_figure(plot_rotation.rotation_figure([plot_rotation.Rotation(elastic)]), "rotation, elastic")
    for run, what, axis in ((pair, "velocity", 1), (pair, "pressure", 2), (elastic, "trace", 1), (elastic, "C13", 0), (shear, "u1", 1)):
        parts = [plot_fields.take(run.fields, run.fields.steps[-1], what, axis, 0.01)]
        check_figure(plot_fields.slice_figure(run.fields, parts), f"fields, {run.name}, {what}, normal x{axis + 1}")
    check_figure(plot_bulk.bulk_figure(elastic.bulk), "stress, elastic")
    for run, names, along in ((elastic, ("u1", "C13", "trace"), 2), (shear, ("u1",), 2), (pair, ("pressure",), 0)):
        check_figure(plot_profile.profile_figure(run.fields, names, along), f"profile along x{along + 1}, {run.name}")
    scenery = movie.Scenery(pair, 1)
    figure = scenery.figure()
    scenery.draw(figure.axes[0], 0)
    check_figure(figure, "scene, pair")
    check((scenery.angles[:, -1] < -0.1).all(), f"omega2 > 0 turns the marks clockwise: {scenery.angles[:, -1]}")


def exactness():
    """Slices against the arrays, circles against the spheres, the trace by name or from its parts."""
    run = dlmplot.Run(os.path.join(folder, "elastic"))
    fields, step = run.fields, run.fields.steps[-1]
    c, h = fields.file[step]["conformation"][()], 1 / 16
    for axis, index in ((0, (slice(None), slice(None), 8)), (1, (slice(None), 8)), (2, (8,))):
        _, _, plane = fields.plane(step, "conformation", axis, 0.0)
        check(numpy.array_equal(plane, c[index]), f"slice x{axis + 1} = 0 is the array's")
    _, _, plane = fields.plane(step, "conformation", 1, 0.25 * h)
    check(abs(plane - (0.75 * c[:, 8] + 0.25 * c[:, 9])).max() < 1e-14, "slice between two planes is linear")
    edges = [fields.plane(step, "conformation", 1, x)[2] for x in (-0.5, 0.5)]
    check(max(abs(edges[0] - c[:, 0]).max(), abs(edges[1] - c[:, -1]).max()) < 1e-14, "slices at both ends of the box")
    part = plot_fields.take(fields, step, "trace", 1, 0.05)
    check(
        numpy.allclose(
            sorted(part.circles),
            sorted((x + image, z, numpy.sqrt(0.01 - (0.05 - y) ** 2)) for (x, y, z) in fields.spheres(step)[0] for image in (0, -1)),
            atol=1e-14,
        ),
        f"the sphere at the periodic face is two exact circles: {part.circles}",
    )
    disks = plot_fields.slice_figure(fields, [part]).axes[0].collections[-1].get_paths()
    check(
        len(disks) == 2
        and numpy.allclose(sorted(path.get_extents().width / 2 for path in disks), sorted(circle[2] for circle in part.circles), rtol=1e-3),
        "which are drawn so",
    )
    shear = dlmplot.Run(os.path.join(folder, "shear")).fields
    for what, exact in (("C11", 1.528482), ("C13", 0.632121), ("C22", 1), ("C33", 1), ("C12", 0), ("C23", 0), ("trace", 3.528482)):
        values = plot_fields.take(shear, shear.steps[-1], what, 0, 0.1).values
        check(abs(values - exact).max() < 1e-6, f"{what} in the start-up of shear: {values.mean():.6f}, exact {exact}")
    heights, values = plot_profile.profile(shear, shear.steps[-1], "u1", 2)
    check(len(heights) > 4 and abs(values - heights).max() < 1e-6, f"u1 along x3 in shear of rate 1: {values}, at {heights}")
    traced = shutil.copytree(run.folder, os.path.join(folder, "traced"))
    with h5py.File(os.path.join(traced, "fields.h5"), "r+") as file:
        trace = file[step].require_dataset("conformation_trace", c.shape[:3], float)
        trace[...] = 7.0
        trace.attrs["mesh"] = file[step]["conformation"].attrs["mesh"]
    part = plot_fields.take(dlmplot.Run(traced).fields, step, "trace", 1, 0.05)
    check((part.values == 7.0).all(), "trace from its own dataset, if there is one")


def movies():
    """GIFs, with and without fields; mp4 only with ffmpeg."""
    for what, frames in (("velocity", 4), ("spheres", 5)):
        path = os.path.join(folder, f"{what}.gif")
        movie.main([os.path.join(folder, "pair"), "--what", what, "--frames", "5", "--lines", "arrows", "-o", path])
        with Image.open(path) as image:
            images = []
            for k in range(image.n_frames):
                image.seek(k)
                images.append(numpy.asarray(image.convert("RGB")).astype(int))
            check(image.n_frames == frames, f"{what}.gif: {image.n_frames} frames, expected {frames}")
            check_image(image, f"{what}.gif, the last")
        apart = [abs(a - b).max() for a, b in zip(images, images[1:])]
        check(min(apart) > 50, f"{what}.gif: every frame differs from the one before: {apart}")
    os.rename(os.path.join(folder, "pair/fields.h5"), os.path.join(folder, "kept.h5"))
    which, shutil.which = shutil.which, lambda name: None
    try:
        movie.main([os.path.join(folder, "pair"), "--frames", "2"])
        check(os.path.exists(os.path.join(folder, "pair/movie.gif")), "without ffmpeg and without fields: movie.gif of the spheres")
    finally:
        shutil.which = which
        os.rename(os.path.join(folder, "kept.h5"), os.path.join(folder, "pair/fields.h5"))
    if shutil.which("ffmpeg"):
        movie.main([os.path.join(folder, "pair"), "--frames", "3", "-o", os.path.join(folder, "a.mp4")])
        check(os.path.getsize(os.path.join(folder, "a.mp4")) > 2000, "with ffmpeg: a.mp4")


def page_of(name):
    path = os.path.join(folder, name, "report.html")
    report.main([os.path.join(folder, name), "-o", path])
    with open(path, encoding="utf-8") as file:
        return file.read()


def check_pages():
    """What the page of each run holds, and that it needs nothing else."""
    with open(os.path.join(folder, "elastic/bulk.csv"), "w", encoding="utf-8") as file:
        file.write("step,time,shear_rate,stress12,N1,polymer12,polymerN1,contact12\n1,0.1,1,1.1,0.5,0.7,0.5,0\n2,0.2,1,1.2,0.7,0.8,0.7,0\n3,0.3,")
    wanted = {
        "pair": (
            "scene modelled motion fields bulk work health reference",
            ("Two spheres in Newtonian fluid", "rides with the walls", "-fluid_model newtonian"),
        ),
        "elastic": (
            "scene modelled motion fields bulk work health reference",
            ("Oldroyd-B", "Wi = 0.5", "smallest eigenvalue of C", "0\\.4555", "omega/rate"),
        ),
        "shear": ("scene modelled fields bulk work health reference", ("start-up of homogeneous shear", "0\\.632121", "0\\.000 %")),
    }
    for name, (sections, phrases) in wanted.items():
        page = page_of(name)
        check(re.findall(r'<section id="(\w+)"', page) == sections.split(), f"{name}: sections {sections}")
        absent = [phrase for phrase in phrases if not re.search(phrase, page)]
        check(not absent, f"{name}: the page says {', '.join(phrases)}; absent: {absent}")
        outside = [link for link in re.findall(r'(?:src|href)\s*=\s*"([^"]{0,40})', page) if not link.startswith(("data:image/", "#"))]
        check(not outside and not re.search(r"https?:|<script|<link|@import|url\(", page), f"{name}: self-contained; links elsewhere: {outside}")
        built = [row["object"] for row in dlmplot.Run(os.path.join(folder, name)).summary["modelled"]]
        table = page[page.index('<section id="modelled">') :].split("</section>")[0]
        check(
            len(built) > 5 and all(f"<td>{thing}</td>" in table for thing in built),
            f"{name}: the table of what was modelled has all {len(built)} rows",
        )
    run = dlmplot.Run(os.path.join(folder, "pair"))
    run.scene["pressure_gradient"] = [-1, 0, 0]
    said = report.reference_section(run)[1]
    check(
        "No exact or published value" in said and "drive is other, not shear" in said,
        "a scene that is not in the table: the page says so, and what is nearest",
    )


def tools():
    make(*RUNS)
    check_image(Image.open(call("plot_trajectories", "pair")), "trajectories.png")
    check_image(Image.open(call("plot_rotation", "elastic", "pair", "-o", "r.png")), "r.png", (1640, 720))
    check_image(
        Image.open(call("plot_fields", "pair", "--time", "0.35", "--lines", "arrows", "--units", "cm,g,s")), "fields_velocity.png", (1500, 553)
    )
    call("movie", "pair", "--frames", "2", "-o", "pair/m.gif")
    call("report", "shear")
    figures()
    exactness()
    movies()
    check_pages()


# tool, arguments, the message
ERRORS = (
    *((tool, "nowhere", "no folder .*nowhere$") for tool in ("plot_bulk", "plot_trajectories", "plot_rotation", "plot_fields", "plot_profile", "movie", "report")),
    *((tool, "bare", "no trajectory.csv in .*bare$") for tool in ("plot_trajectories", "plot_rotation")),
    ("movie", "bare", "no summary.json in .*bare: a run writes it when it ends$"),
    ("report", "bare", "no summary.json in .*bare: a run writes it when it ends$"),
    ("plot_fields", "bare", "no fields.h5 in .*bare: run with -output_fields_every N$"),
    *((tool, "empty", "trajectory.csv has no (column step|rows)$") for tool in ("plot_trajectories", "plot_rotation")),
    ("plot_fields", "empty", "fields.h5 is not a whole HDF5 file, or the run is writing it just now$"),
    *((tool, "spoilt", "summary.json is not whole$") for tool in ("plot_trajectories", "report")),
    ("plot_trajectories", "headed", "trajectory.csv has no rows$"),
    ("plot_trajectories", "nan", "trajectory.csv has no finite numbers$"),
    ("plot_fields", "other", "fields.h5 has no steps$"),
    ("plot_trajectories", "worded", "trajectory.csv: could not convert string .*$"),
    ("plot_profile", "shear --what u1,heat", "--what heat: allowed: velocity, pressure, trace, .*$"),
    ("plot_bulk", "bare", "no stress in .*bulk.csv: .*$"),
    ("plot_fields", "shear --what heat", "--what heat: allowed: velocity, pressure, trace, .*$"),
    ("movie", "shear --what heat", "--what heat: allowed: .*$"),
    ("plot_fields", "plain --what trace", "--what trace: .* has no conformation; a Newtonian fluid has none$"),
    ("plot_fields", "shear --at 2", "--at 2 is outside the box; allowed: -0.5 to 0.5$"),
    ("plot_fields", "shear --step 3", "--step 3: .* has no such step; allowed: 0, 10$"),
    ("plot_fields", "shear --axis 4", "argument --axis: invalid choice: 4 .*$"),
    ("plot_fields", "shear -o x.doc", "--output x.doc: allowed: a name that ends in .png, .pdf, .svg$"),
    ("plot_fields", "shear -o nowhere/x.png", "nowhere/x.png: No such file or directory$"),
    ("plot_fields", "shear --units cm", "--units cm: allowed: names of the units of length, mass and time, as in cm,g,s$"),
    ("plot_rotation", "plain --sphere 3", "--sphere 3: .* has no such sphere; allowed: 0 to 0$"),
    ("plot_rotation", "plain", "plain: no shear rate, .*; give --rate$"),
    ("plot_rotation", "shear", "no trajectory.csv in .*shear$"),
    ("movie", "shear --frames 0", "--frames 0: allowed: 1 or more$"),
    ("movie", "shear --fps 0", "--fps 0: allowed: more than 0$"),
    ("movie", "shear -o x.avi", "--output x.avi: allowed: a name that ends in .mp4 or .gif$"),
    ("movie", "shear -o nowhere/x.gif", "--output nowhere/x.gif: no folder nowhere$"),
    ("movie", "shear -o x.mp4", "--output x.mp4 needs ffmpeg, which is not installed; .*$"),
    ("report", "old", "summary.json has no box_size: it is of an older version$"),
    ("report", "", "the following arguments are required: RUN$"),
)


def broken_runs():
    """Folders with something missing or spoilt."""
    make("shear")
    RUNS["plain"] = (
        "-box_size 1,1,1 -grid_resolution 12 -sphere_centers 0,0,0 -sphere_radius 0.15 -gravity -1,0,0 -sphere_density 2"
        " -ts_max_steps 1 -output_fields_every 1"
    )
    make("plain")
    header = "step,time,sphere,x1,x2,x3,V1,V2,V3,omega1,omega2,omega3\n"
    for name, files in (
        ("bare", {}),
        ("empty", {"trajectory.csv": "", "fields.h5": ""}),
        ("spoilt", {"summary.json": '{"scene"'}),
        ("headed", {"trajectory.csv": header}),
        ("worded", {"trajectory.csv": header + "0,0,0" + ",x" * 9 + "\n"}),
        ("nan", {"trajectory.csv": header + "0,0,0" + ",nan" * 9 + "\n"}),
        ("other", {}),
        ("old", {"summary.json": '{"scene": {"fluid_model": "newtonian", "n_spheres": 0, "spheres": []}}'}),
    ):
        os.mkdir(os.path.join(folder, name))
        for file, text in files.items():
            with open(os.path.join(folder, name, file), "w", encoding="utf-8") as out:
                out.write(text)
    h5py.File(os.path.join(folder, "other/fields.h5"), "w").close()


def error_of(tool, words):
    """What the tool would print and its exit status, in this process."""
    argv, which = sys.argv, shutil.which
    sys.argv, shutil.which = [tool], lambda name: None
    try:
        dlmplot.run_tool(lambda _: globals()[tool].main(words))
    except SystemExit as stop:
        return str(stop.code)
    finally:
        sys.argv, shutil.which = argv, which
    return "no error"


def errors():
    broken_runs()
    os.chdir(folder)
    for tool, words, message in ERRORS:
        said = error_of(tool, words.split())
        check(re.fullmatch(f"{tool}: error: .*{message}", said) is not None and "\n" not in said, f"{tool} {words}: {said}")
    check(not [name for name in os.listdir(folder) if name.startswith("x.")], "and no file is left")
    done = subprocess.run([os.path.join(TOOLS, "plot_fields"), "nowhere"], capture_output=True, text=True)
    check(
        done.returncode == 1 and done.stdout == "" and done.stderr == "plot_fields: error: no folder nowhere\n",
        f"from the command line: {done.stderr.strip()}, exit status {done.returncode}",
    )


BROWSERS = ("chromium", "chromium-browser", "google-chrome")
QUIET = "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-component-update --disable-sync"
COUNT = """<script>addEventListener("load", () => { const all = [...document.images];
document.body.dataset.pictures = all.length + " pictures, " + all.filter(x => !x.naturalWidth).length + " missing"; });</script>"""


def browser():
    make("elastic")
    page = page_of("elastic")
    program_found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if not program_found:
        return check(False, "no Chromium on this machine: tools/setup installs it")
    with open(os.path.join(folder, "page.html"), "w", encoding="utf-8") as file:
        file.write(page.replace("</body>", COUNT + "</body>"))
    shot = os.path.join(folder, "shot.png")
    given = ["--hide-scrollbars", f"--user-data-dir={folder}/profile", "--window-size=1100,3600", f"--screenshot={shot}", "--dump-dom"]
    command = [program_found, *QUIET.split(), *given, f"file://{folder}/page.html"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    dom = done.stdout
    check(done.returncode == 0 and os.path.exists(shot), f"{os.path.basename(program_found)}: exit status {done.returncode}")
    sections = re.findall(r'<section id="(\w+)"><h2>', dom)
    check(sections == "scene modelled motion fields bulk work health reference".split(), f"sections in the DOM: {' '.join(sections)}")
    told = re.search(r'data-pictures="([^"]*)"', dom)
    check(
        told is not None and told[1] == f"{page.count('<img ')} pictures, 0 missing" and page.count("<img ") >= 6,
        f"the browser counts {told[1] if told else 'nothing'}",
    )
    image = Image.open(shot)
    check_image(image, "screenshot", (1100, 3600))
    rows = (numpy.asarray(image.convert("L")) < 250).any(axis=1)
    check(rows[:3000].mean() > 0.4 and rows[2500:].any(), f"{100 * rows.mean():.0f} % of the screenshot's rows have ink")


if __name__ == "__main__":
    group, program = sys.argv[1], os.path.abspath(sys.argv[2])
    with tempfile.TemporaryDirectory() as folder:
        {"tools": tools, "errors": errors, "browser": browser}[group]()
        os.chdir(ROOT)
    sys.exit(1 if failed else 0)
