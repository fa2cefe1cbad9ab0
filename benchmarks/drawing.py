"""What the programs that draw with matplotlib share: its settings, three styles of line, and the command on an array."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

try:
    import matplotlib
except ImportError:
    sys.exit("needs matplotlib; script/setup --bench installs it")
matplotlib.use("svg")
matplotlib.rcParams.update({"svg.hashsalt": "edgewise", "svg.fonttype": "none", "font.family": "sans-serif",
                            "font.size": 10, "axes.grid": True, "grid.alpha": 0.3, "legend.fontsize": 9,
                            "axes.spines.top": False, "axes.spines.right": False})
from matplotlib import pyplot as plt  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/stability"))
from driving import read_nrrd, write_nrrd  # noqa: E402

EDGEWISE = os.environ.get("EDGEWISE", str(ROOT / "build/release/bin/edgewise"))
NAIVE = {"color": "#c44e00", "marker": "x", "linestyle": "--", "markersize": 4}
OURS = {"color": "#00509e", "marker": "o", "linestyle": "-", "markersize": 3.5}
OTHER = {"color": "#5a7d2a", "marker": "^", "linestyle": ":", "markersize": 4}
folder = pathlib.Path(tempfile.mkdtemp())


def edgewise(verb, samples, *words):
    """The result, and the report. `samples`: an array, or what the command takes as FILE."""
    source = samples
    if isinstance(samples, np.ndarray):
        source = folder / "in.nrrd"
        write_nrrd(source, samples)
    done = subprocess.run([EDGEWISE, verb, source, "-o", folder / "out.nrrd", *map(str, words), "--json",
                           "-", "--quiet"], capture_output=True, text=True)
    report = json.loads(done.stdout) if done.stdout else {}
    if done.returncode:
        return None, report
    return read_nrrd(folder / "out.nrrd"), report


def rms(values):
    return float(np.sqrt(np.mean(np.square(values, dtype="f8"))))


def panels(count, width=4.2, height=3.3):
    figure, axes = plt.subplots(1, count, figsize=(width * count, height), layout="constrained")
    return figure, np.atleast_1d(axes)


def save(figure, path):
    figure.savefig(path, metadata={"Date": None})  # the same bytes on every day
    plt.close(figure)
