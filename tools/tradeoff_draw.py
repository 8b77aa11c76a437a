"""The figure and the printed table of tools/tradeoff."""
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

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
    knobs = [f"{key.lstrip('-').split('_', 1)[1]} {value}" for key, value in zip(words[4::2], words[5::2])]
    return ", ".join([f"1/{row['resolution']}, {float(row['dt']) / scene.unit:.2g}"] if not knobs else knobs)


def draw(scene, rows, path):
    rows = usable(rows)
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
        axes.annotate(label(scene, row), (row["price"], max(row["error"], FLOOR)), xytext=(5, 3), textcoords="offset points", fontsize=5.5 if kind(row) in ("plain", "knob") else 9)
    axes.set(xscale="log", yscale="log", title=scene.title, xlabel="CPU seconds per unit of the scene's own time", ylabel="error, per cent")
    axes.grid(color="0.92", linewidth=0.6)
    axes.legend(fontsize=7, frameon=False)
    compare(axes, rows)
    figure.savefig(path, dpi=130)
    plt.close(figure)
    table(scene, rows, front)
    print(path)


def compare(axes, rows):
    """Says how small a fraction of the thesis's cost the preset standard takes."""
    thesis = [row for row in rows if kind(row) == "thesis"]
    standard = [row for row in rows if row["case"] == "-accuracy standard"]
    if not thesis or not standard:
        return
    times, better = thesis[0]["price"] / standard[0]["price"], thesis[0]["error"] / max(standard[0]["error"], 1e-9)
    text = f"standard: 1/{times:.0f} of the thesis's cost,\n1/{better:.2g} of its error"
    axes.text(0.98, 0.02, text, transform=axes.transAxes, fontsize=9, ha="right", va="bottom")
    print(f"cost of the thesis over standard {times:.0f}, error {better:.2f}")


def table(scene, rows, front):
    print(f"\n{scene.title}; * on the front")
    for row in sorted(rows, key=lambda row: row["error"]):
        print(f"{'*' if row in front else ' '} {row['error']:9.3f} % {row['price']:10.4g} s {row['memory_MiB']:>6} MiB  {row['case']}")
