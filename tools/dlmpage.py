"""Pieces of a page that needs nothing else: tables, pictures inside the page, marks, and the page around them. For tools/report."""
import base64
import html
import io

import numpy as np

from dlmplot import plt

CSS = """
:root { color-scheme: light; --ink: #1d2733; --soft: #5b6b7c; --line: #dde3ea; --accent: #0072b2; --good: #00795c; --look: #b45309; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2.5rem 1.5rem 4rem; max-width: 62rem; color: var(--ink); background: #fff;
  font: 16px/1.55 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
h1 { margin: 0; font-size: 1.9rem; letter-spacing: -0.01em; }
h2 { margin: 2.8rem 0 0.8rem; font-size: 1.25rem; border-bottom: 2px solid var(--accent); padding-bottom: 0.25rem; }
h3 { margin: 1.6rem 0 0.4rem; font-size: 1rem; }
p { margin: 0.5rem 0; }
.soft { color: var(--soft); }
small, figcaption { color: var(--soft); font-size: 0.86rem; }
nav { margin: 1rem 0 0; font-size: 0.9rem; }
nav a { color: var(--accent); text-decoration: none; margin-right: 1.1rem; }
.tiles { display: flex; flex-wrap: wrap; gap: 0.8rem; margin: 1.4rem 0 0; }
.tile { flex: 1 1 8rem; border: 1px solid var(--line); border-radius: 8px; padding: 0.6rem 0.9rem; }
.tile b { display: block; font-size: 1.25rem; font-weight: 600; }
.tile span { color: var(--soft); font-size: 0.82rem; }
table { border-collapse: collapse; width: 100%; font-size: 0.92rem; }
th, td { text-align: left; vertical-align: top; padding: 0.38rem 0.9rem 0.38rem 0; border-bottom: 1px solid var(--line); }
th { font-weight: 600; color: var(--soft); }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
td:first-child, td .none { white-space: nowrap; }
.good { color: var(--good); font-weight: 600; }
.look { color: var(--look); font-weight: 600; }
.none { color: var(--soft); }
.bar { display: inline-block; height: 0.7rem; border-radius: 2px; background: var(--accent); print-color-adjust: exact; }
figure { margin: 1.2rem 0; }
figure img { display: block; max-width: 100%; height: auto; margin: 0 auto; }
figcaption { margin-top: 0.4rem; text-align: center; }
@media print {
  @page { margin: 16mm; }
  body { padding: 0; max-width: none; font-size: 10.5pt; }
  nav { display: none; }
  h2, h3 { break-after: avoid; }
  figure, tr, .tiles { break-inside: avoid; }
}
"""


def text(value):
    return html.escape(f"{value:.6g}" if isinstance(value, (float, np.floating)) else str(value))


def vector(values):
    return ", ".join(f"{value:.6g}" for value in values)


def table(rows, head=None, numeric=()):
    """Rows of cells; a cell that starts with '<' is HTML already."""

    def line(cells, tag):
        shown = [cell if str(cell).startswith("<") else text(cell) for cell in cells]
        return "<tr>" + "".join(f"<{tag}{' class=n' if k in numeric else ''}>{cell}</{tag}>" for k, cell in enumerate(shown)) + "</tr>"

    return "<table>" + (line(head, "th") if head else "") + "".join(line(row, "td") for row in rows) + "</table>"


def picture(figure, caption, kind="svg"):
    """A figure as an image inside the page: svg for lines, png for fields."""
    data = io.BytesIO()
    figure.savefig(data, format=kind, dpi=170, **({"metadata": {"Date": None}} if kind == "svg" else {}))
    width = figure.get_size_inches()[0]
    plt.close(figure)
    source = f"data:image/{'svg+xml' if kind == 'svg' else 'png'};base64,{base64.b64encode(data.getvalue()).decode()}"
    caption = html.escape(caption)
    return f'<figure><img src="{source}" alt="{caption}" style="width:{96 * width:.0f}px"><figcaption>{caption}</figcaption></figure>'


def verdict(good, words):
    return f'<span class="{"good" if good else "look"}">{"✓" if good else "!"} {html.escape(words)}</span>'


def page(title, intro, sections, foot):
    """The HTML of a page: sections is {id: (heading, HTML)}."""
    links = "".join(f'<a href="#{name}">{html.escape(heading)}</a>' for name, (heading, _) in sections.items())
    body = "".join(f'<section id="{name}"><h2>{html.escape(heading)}</h2>{content}</section>' for name, (heading, content) in sections.items())
    head = f'<head><meta charset="utf-8"><title>{html.escape(title)} – dlmfd</title><style>{CSS}</style></head>'
    top = f"<h1>{html.escape(title)}</h1>{intro}<nav>{links}</nav>"
    return f'<!DOCTYPE html>\n<html lang="en">{head}\n<body>{top}{body}<p><small>{html.escape(foot)}</small></p></body></html>\n'
