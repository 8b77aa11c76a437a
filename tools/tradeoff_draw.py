"""The figure and the printed table of tools/tradeoff."""
import math
import statistics

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.ticker import FuncFormatter, LogLocator  # noqa: E402

FLOOR = 0.01  # per cent: errors below are drawn there
COLOURS = {"16": "#e69f00", "24": "#009e73", "32": "#0072b2", "48": "#cc79a7", "64": "#7f3c8d"}


def usable(rows):
    return [dict(row, error=float(row["error_percent"]), price=float(row["cost"])) for row in rows if row["error_percent"] and row["cost"]]


def pareto(rows):
    """The rows that no other row beats in both, by cost."""
    front = []
    for row in sorted(rows, key=lambda row: (row["price"], row["error"])):
        if not front or row["error"] < front[-1]["error"]:
            front.append(row)
    return front


def digit(front):
    """How many times dearer a tenth of the error is: the slope of the front, by least squares in the logarithms; nan where the errors are within a factor 5."""
    if len(front) < 2 or front[0]["error"] < 5 * front[-1]["error"]:
        return math.nan
    errors, prices = ([math.log10(row[name]) for row in front] for name in ("error", "price"))
    return 10 ** -statistics.linear_regression(errors, prices).slope


def kind(row):
    if row["note"].startswith("thesis"):
        return "thesis"
    if row["case"].startswith("-accuracy"):
        return "preset"
    return "plain" if len(row["case"].split()) == 4 else "knob"


def label(scene, row):
    """A case in few words; dt in units of the scene's own time."""
    if kind(row) == "thesis":
        return "the thesis"
    if kind(row) == "preset":
        return row["case"].split()[1]
    words = row["case"].split()
    knobs = [f"{key.lstrip('-').split('_', 1)[-1]} {value}" for key, value in zip(words[4::2], words[5::2])]
    return ", ".join([f"1/{row['resolution']}, {float(row['dt']) / scene.unit:.2g}"] if not knobs else knobs)


def draw(scene, rows, path):
    rows = usable(rows)
    if not rows:
        return print(f"{scene.title}: nothing to draw yet")
    front = pareto([row for row in rows if kind(row) != "thesis"])
    figure, axes = plt.subplots(figsize=(8, 5.2), constrained_layout=True)
    axes.step([row["price"] for row in front], [max(row["error"], FLOOR) for row in front], where="post", color="0.6", linewidth=1, label="Pareto front", zorder=1)
    seen = set()
    for row in rows:
        name, size = {"plain": ("o", 36), "knob": ("x", 26), "preset": ("D", 60), "thesis": ("*", 220)}[kind(row)]
        colour = {"preset": "black", "thesis": "#d55e00"}.get(kind(row), COLOURS.get(row["resolution"], "0.4"))
        group = {"preset": "-accuracy", "thesis": "the thesis's choice"}.get(kind(row), f"1/h = {row['resolution']}" + (", one knob turned" if kind(row) == "knob" else ""))
        axes.scatter(row["price"], max(row["error"], FLOOR), marker=name, s=size, color=colour, label=None if group in seen else group, zorder=3)
        seen.add(group)
    axes.set(xscale="log", yscale="log", title=scene.title, xlabel="CPU seconds per unit of the scene's own time", ylabel="error, per cent")
    axes.yaxis.set_minor_locator(LogLocator(subs=(2, 5)))
    for set_formatter in (axes.xaxis.set_major_formatter, axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
        set_formatter(FuncFormatter(lambda x, place: f"{x:g}"))
    axes.grid(color="0.92", linewidth=0.6)
    axes.legend(fontsize=7, frameon=False)
    compare(axes, rows)
    write_labels(figure, axes, scene, rows)
    figure.savefig(path, dpi=130)
    plt.close(figure)
    table(scene, rows, front)
    print(path)


def write_labels(figure, axes, scene, rows):
    """Beside the points, right or left; presets and the thesis first. A label that would cover another one is left out: the table has it."""
    figure.canvas.draw()
    renderer, taken = figure.canvas.get_renderer(), []
    inside = axes.get_window_extent(renderer)
    for row in sorted(rows, key=lambda row: kind(row) in ("plain", "knob")):
        for shift, side in (((5, 3), "left"), ((-5, 3), "right"), ((5, -8), "left")):
            text = axes.annotate(label(scene, row), (row["price"], max(row["error"], FLOOR)), xytext=shift, textcoords="offset points", ha=side,
                                 fontsize=5.5 if kind(row) in ("plain", "knob") else 9)
            box = text.get_window_extent(renderer)
            if inside.x0 < box.x0 and box.x1 < inside.x1 and not any(box.overlaps(other) for other in taken):
                taken.append(box)
                break
            text.remove()


def compare(axes, rows):
    """Says how small a fraction of the thesis's cost the preset standard takes."""
    thesis = [row for row in rows if kind(row) == "thesis"]
    standard = [row for row in rows if row["case"] == "-accuracy standard"]
    if not thesis or not standard:
        return
    times, better = thesis[0]["price"] / standard[0]["price"], thesis[0]["error"] / max(standard[0]["error"], 1e-9)
    text = f"standard: 1/{float(f'{times:.2g}'):.0f} of the thesis's cost,\n1/{better:.2g} of its error"
    axes.text(0.98, 0.02, text, transform=axes.transAxes, fontsize=9, ha="right", va="bottom")
    print(f"cost of the thesis over standard {times:.0f}, error {better:.2f}")


def table(scene, rows, front):
    print(f"\n{scene.title}; * on the front")
    print(f"one digit more costs {digit(front):.0f} times as much (slope of the front; nan: hardly any slope)")
    for row in sorted(rows, key=lambda row: row["error"]):
        print(f"{'*' if row in front else ' '} {row['error']:9.3f} % {row['price']:10.4g} s {row['memory_MiB']:>6} MiB  {row['case']}")


def summary(scene, rows):
    """A row of Markdown: error and cost of the thesis's choice and of the presets, the thesis's over those of standard, and the cost of a digit."""
    rows = usable(rows)
    found = {label(scene, row): row for row in rows if kind(row) in ("thesis", "preset")}
    cells = [f"{row['error']:.2g} %, {row['price']:.2g} s" if row else "" for row in (found.get(name) for name in ("the thesis", "draft", "standard", "fine"))]
    ratio = ""
    if "the thesis" in found and "standard" in found:
        ratio = f"{found['the thesis']['error'] / found['standard']['error']:.2g}, {float(format(found['the thesis']['price'] / found['standard']['price'], '.2g')):.0f}"
    front = pareto([row for row in rows if kind(row) != "thesis"])
    return "| " + " | ".join([scene.title, *cells, ratio, "" if math.isnan(digit(front)) else f"{digit(front):.0f} times"]) + " |"
