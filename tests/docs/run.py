#!/usr/bin/env python3
"""What the docs name must be there: links, files of the source tree, option keys.

    run.py ROOT
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(sys.argv[1])
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs/gallery").glob("*.md"))]
KEYS = set(re.findall(r"^\| `-?([a-z0-9_]+)`", (ROOT / "docs/options.md").read_text(), re.M))
PETSC = re.compile(r"(ts|ksp|pc|log|options|help|version|stokes|saddle|velocity|pressure|prefix|mat|vec|malloc|split)(_|$)")


def missing(page):
    text = page.read_text()
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
        if not target.startswith("http") and not (page.parent / target).exists():
            yield f"link to {target}"
    for path in re.findall(r"(?<![\w/.-])(?:\./)?((?:tools|input|docs|src|tests|include)/[\w./-]*\w)", text):
        named = re.search(r"[A-Z]{4}", path)  # capitals stand for a name to fill in
        if not named and not list(ROOT.glob(path + "*")):
            yield f"path {path}"
    for key in re.findall(r"`-([a-z][a-z0-9]*(?:_[a-z0-9]+)+)[ `]", text):
        if key not in KEYS and not PETSC.match(key):
            yield f"key -{key}"


wrong = [f"{page.relative_to(ROOT)}: {what}" for page in PAGES for what in sorted(set(missing(page)))]
print("\n".join(wrong) or f"{len(PAGES)} pages: every link, path and key is there")
sys.exit(1 if wrong or len(KEYS) < 50 else 0)
