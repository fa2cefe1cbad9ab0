"""What the parts of gallery.py share: places, the command, numbers of its reports, and the tables of the page."""
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
EDGEWISE = str(pathlib.Path(os.environ.get("EDGEWISE", ROOT / "build/release/bin/edgewise")).resolve())
DOCS, SCRATCH, PAGE = ROOT / "docs/gallery", ROOT / "build/gallery", ROOT / "docs/gallery.md"


def report(*words):
    """The JSON of a run, from the root of the repository."""
    done = subprocess.run([EDGEWISE, *map(str, words), "--json", "-", "--quiet"], cwd=ROOT, capture_output=True,
                          text=True)
    if done.returncode:
        sys.exit(f"edgewise {' '.join(map(str, words))}\n{done.stderr or done.stdout}")
    return json.loads(done.stdout)


def step_words(step):
    """A step as --via takes it."""
    values = {key: f"{value:g}" if isinstance(value, float) else value for key, value in step["parameters"].items()}
    return step["transition"] + "".join(f"/{key}={value}" for key, value in values.items())


def route(plan):
    return " > ".join(map(step_words, plan["steps"]))


def median(point):
    return statistics.median(point["measured"]["seconds"])


def quartiles(point):
    """Of the measured seconds: what a quarter of them is below, and what a quarter is above."""
    low, _, high = statistics.quantiles(point["measured"]["seconds"], n=4, method="inclusive")
    return low, high


def milliseconds(seconds):
    return f"{seconds * 1e3:.3g} ms"


def rewrite(page, tables):
    """Puts each text between `<!-- NAME -->` and `<!-- end NAME -->`."""
    if not page.exists():
        return
    text = page.read_text()
    for name, table in tables.items():
        found = re.compile(f"(<!-- {re.escape(name)} -->\n).*?(<!-- end {re.escape(name)} -->)", re.S)
        if not found.search(text):
            sys.exit(f"{page}: no place for {name}")
        text = found.sub(lambda match: match[1] + table + "\n" + match[2], text)
    page.write_text(text)
