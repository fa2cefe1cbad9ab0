"""Runs docs/first_hour.md as its reader does: each block of commands in one shell, in one folder, from the top. Needs numpy.

A block `sh` holds commands, the block `text` behind it what they print. There `…` stands for anything within a line, and a line
of it alone for any number of lines.
"""
import os
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "first_hour.md"
PICTURES = PAGE.parent / "first_hour"


def blocks(text):
    """(commands, what they print) in order."""
    return re.findall(r"^```sh\n(.*?)^```\n```text\n(.*?)^```$", text, re.M | re.S)


def pictures(text):
    return re.findall(r"!\[[^]]+\]\(first_hour/([^)]+)\)", text)


def pattern_of(expected):
    lines = []
    for line in expected.splitlines():
        lines.append(r"(?:.*\n)*?" if line.strip() == "…" else ".*".join(map(re.escape, line.rstrip().split("…"))) + r" *\n")
    return "".join(lines)


def fits(expected, said):
    """Progress that slow machines show is left out."""
    said = "".join(line + "\n" for line in said.splitlines() if not re.fullmatch(r"edgewise: .*\.\.\.", line))
    return re.fullmatch(pattern_of(expected), said) is not None


def clone(folder, command):
    """What of a built clone the page uses: links to it, so that all that is written stays in `folder`."""
    (folder / "build/release/bin").mkdir(parents=True)
    for name in ("script", "data"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "build/release/bin/edgewise").symlink_to(pathlib.Path(command).resolve())


def run(folder, command):
    """[(commands, expected, said, exit code)], and the folder that the files are in. A shell reads the blocks one by one."""
    clone(folder, command)
    home = {"XDG_CONFIG_HOME": str(folder / "config"), "XDG_CACHE_HOME": str(folder / "cache")}
    end = "=== end of a block "
    found = blocks(PAGE.read_text(encoding="utf8"))
    script = "".join(f"{commands}echo '{end}'$?\n" for commands, _ in found) + "pwd\n"
    done = subprocess.run(["bash"], input=script, cwd=folder, env={**os.environ, **home}, text=True, encoding="utf8",
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=600, check=False)
    *said, last = re.split(rf"^{end}", done.stdout, flags=re.M)
    codes = [int(part.partition("\n")[0]) for part in [*said[1:], last]]
    said = [said[0], *(part.partition("\n")[2] for part in said[1:])]
    place = pathlib.Path(last.splitlines()[-1])
    return [(*block, text, code) for block, text, code in zip(found, said, codes, strict=True)], place
