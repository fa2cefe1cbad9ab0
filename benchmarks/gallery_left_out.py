"""The table of gallery.py about what plans leave out: each plan against the same path with one thing, or all, put back."""
import json
import statistics

from gallery_runs import SCRATCH, report, step_words

ROUNDS, REPEATS = 5, 3
PREPARATIONS = ["store.crop", "store.precision", "filter.prefilter", "warp.axis_permutation"]
FINEST = {"step": "0.25", "filter": "bspline3", "band": "volume"}
FINEST_RAYS = ["filter.prefilter", "project.ray_cast/filter=bspline3/step=0.25"]

# What someone asks for, and the request. `{grey}` and `{tinted}`: see ramps().
REQUESTS = [
    ("neuron, MIP by slices", "render data/neuron/neuron.tif --mode mip --rotate 0,20,0 --size 256x256 "
     "--without project.ray_cast --without project.combine"),
    ("neuron, MIP by rays", "render data/neuron/neuron.tif --mode mip --rotate 0,20,0 --size 256x256 "
     "--without project.shear_warp --without project.combine"),
    ("CT head, skin and bone", "render data/ct_head/quarter.nhdr --orient RPI --mode composite "
     "--transfer data/ct_head/skin_and_bone.json --rotate 0,30,0 --size 256x256"),
    ("MR head, X-ray", "render data/mr_brain/MR.nii.gz --mode xray --view left --rotate 0,20,0 --max-error 0.005"),
    ("MR angiography, MIP", "render data/carotid/carotid.vtk --mode mip --rotate 30,40,0 --size 192x192 "
     "--max-error 0.02"),
    ("hydrogen, X-ray", "render data/hydrogen/hydrogen.vti --mode xray --rotate 20,30,0 --size 192x192 "
     "--max-error 0.002"),
    ("hydrogen, 60 small X-rays by spectrum", "render data/hydrogen/hydrogen.vti --mode xray --size 32x32 "
     "--turntable 60 --without project"),
    ("MR head, composite of a grey ramp", "render data/mr_brain/MR.nii.gz --mode composite --rotate 0,30,0 "
     "--size 256x256 --transfer {grey}"),
]


def ramps():
    """One ramp twice: in grey, which needs one colour, and with a blue that differs by a millionth, which needs three."""
    files = {}
    for name, blue in (("grey", 1.0), ("tinted", 0.999999)):
        points = [{"value": value, "opacity": opacity, "color": [shade, shade, shade * blue]}
                  for value, opacity, shade in ((0, 0, 0), (512, 0.05, 1))]
        files[name] = SCRATCH / f"{name}_ramp.json"
        files[name].write_text(json.dumps({"points": points}))
    return files


def forced(steps):
    """Options that leave only the path of these steps."""
    words = []
    for step in steps:
        words += ["--via", step]
    taken = {step.split("/")[0] for step in steps}
    return words + [word for edge in PREPARATIONS if edge not in taken for word in ("--without", edge)]


def with_values(step, values):
    """A step with other values of the keys that it has."""
    name, *pairs = step.split("/")
    pairs = [pair.split("=") for pair in pairs]
    return "/".join([name, *(f"{key}={values.get(key, value)}" for key, value in pairs)])


def put_back(steps, stored):
    """What the path leaves out of samples that are `stored` as a type, and the path with it: [(words, steps)]; the last
    has everything on."""
    ways, full = [], steps
    for edge, words in (("store.crop", "samples outside the occupied box"),
                        ("store.precision", f"type of the samples (u8 for {stored})")):
        mine = [step for step in steps if step.startswith(edge)]
        if mine and not mine[0].endswith("f32"):
            ways.append((words, [step for step in steps if step not in mine]))
            full = [step for step in full if step not in mine]
    finest = dict(FINEST)
    if any(step.startswith("project.shear_warp") for step in steps):
        finest["filter"] = "foh"  # its best
    names = {"step": "samples along the ray", "filter": "order of the filter",
             "band": "frequencies beyond the picture's own"}
    for key, value in finest.items():
        found = [step for step in steps if f"/{key}=" in step]
        if found and found[0] != with_values(found[0], {key: value}):
            now = dict(pair.split("=") for pair in found[0].split("/")[1:])[key]
            exchange = lambda path: prefiltered([with_values(step, {key: value}) if key in step else step for step in path])
            ways.append((f"{names[key]} ({now} for {value})", exchange(steps)))
            full = exchange(full)
    if len(ways) > 1:
        ways.append(("all of these", full))
    if steps[-1].startswith("project.shear_warp"):
        ways.append(("rays of their own through a spline, 4 samples a voxel", FINEST_RAYS))
    return ways


def prefiltered(steps):
    """Splines want coefficients, which are made of the samples as they came."""
    if not any("bspline3" in step for step in steps) or "filter.prefilter" in steps:
        return steps
    steps = [step for step in steps if not step.startswith("store.precision")]
    place = next(i for i, step in enumerate(steps) if "bspline3" in step)
    return [*steps[:place], "filter.prefilter", *steps[place:]]


def measured(variants):
    """[(median of seconds, error)] of requests with their forced paths, one after the other in rounds."""
    seconds, errors = [[] for _ in variants], [None] * len(variants)
    for turn in range(ROUNDS):
        for i, words in enumerate(variants):
            verify = ["--verify"] if turn == 0 else []
            run = report(*words, "-o", "null:", "--repeat", REPEATS, *verify)["measured"]
            seconds[i] += run["seconds"][1:]  # the first of a process touches its memory for the first time
            if verify:
                errors[i] = run["error"]["nrmse"]
    return [(statistics.median(times), error) for times, error in zip(seconds, errors)]


def cases():
    """(what, request, path, budget, [(what is put back, words of the run)])"""
    files = ramps()
    for name, text in REQUESTS:
        words = text.format(**files).split()
        if "--max-error" not in words:
            words += ["--max-error", "0.03"]
        planned = report("plan", *words)
        steps = [step_words(step) for step in planned["plan"]["steps"]]
        stored = planned["plan"]["steps"][0]["from"].split("/")[2]
        ways = [(what, [*words, *forced(path)]) for what, path in put_back(steps, stored)
                if not any(step.split("/")[0] in words for step in path)]  # an edge that the request forbids
        if "{grey}" in text:
            ways = [("two of three colours", [*text.format(grey=files["tinted"]).split(), *forced(steps)])]
        yield name, words, steps, planned["request"]["budget"]["error"], ways


def factor(ratio):
    return f"{ratio:.0f} x" if ratio >= 10 else f"{ratio:.2g} x"


def left_out_table():
    lines = ["| request | plan | budget | put back | ms: plan | with it | saved | error: plan | with it |",
             "|---|---|---:|---|---:|---:|---:|---:|---:|"]
    for name, words, steps, budget, ways in cases():
        lean, *rest = measured([[*words, *forced(steps)], *(way for _, way in ways)])
        for i, ((what, _), (seconds, error)) in enumerate(zip(ways, rest)):
            start = f"| {name} | `{' > '.join(steps)}` | {budget:g} " if i == 0 else "| | | "
            lines.append(f"{start}| {what} | {lean[0] * 1e3:.3g} | {seconds * 1e3:.3g} | {factor(seconds / lean[0])} | "
                         f"{lean[1]:.2g} | {error:.2g} |")
    return "\n".join(lines)
