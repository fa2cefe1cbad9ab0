"""Joins sources into few, which compile in a third of the time: most of it goes into headers that all
of them include.

    joined_sources.py ROOT FOLDER MOST SOURCE...

Writes FOLDER/0.cpp, 1.cpp, ..., each of which includes at most MOST of the sources (names from ROOT), and
prints their names. Sources of one file share one unnamed namespace, so two that define the same name go
into different files. So do a source that defines a name and one that includes a header of its folder with
that name: the first would hide the header's. A file whose text stays the same is not written again.
"""

import re
import sys
from pathlib import Path

TYPE = re.compile(r"(?:struct|class|union|enum(?: class)?|using) (\w+)")
VALUE = re.compile(r"(?<![:\w~.])([A-Za-z_]\w*)\s*(?:\(|\{|=|;|\[)")
MORE = re.compile(r", (\w+) =")
INCLUDE = re.compile(r'#include "([^"]+)"')
NO_DEFINITION = re.compile(r"namespace\b|using namespace\b|template\b|extern\b|static_assert\b|[A-Z_0-9]+\(|//|#|\}")


def names_of(text):
    """What a source defines outside of functions and classes: there our lines begin at the margin."""
    names = set()
    for line in text.splitlines():
        if not line[:1].strip() or NO_DEFINITION.match(line):
            continue
        found = TYPE.match(line) or VALUE.search(line)
        if found:
            names.add(found[1])
            names.update(MORE.findall(line))
    return names


def names_from_headers(text, source, root):
    """The inline functions and constants that headers of the source's folder define for it."""
    names = set()
    for header in INCLUDE.findall(text):
        if Path(header).parent == Path(source).parent and (root / header).is_file():
            lines = (root / header).read_text().splitlines()
            names |= names_of("\n".join(line for line in lines if line.startswith("inline ")))
    return names


def groups_of(sources, root, most):
    """First fit, in the order in which they are given."""
    groups = []
    for source in sources:
        text = (root / source).read_text()
        own = names_of(text)
        used = names_from_headers(text, source, root) - own
        for members, defined, included in groups:
            if len(members) < most and not own & (defined | included) and not used & defined:
                members.append(source)
                defined |= own
                included |= used
                break
        else:
            groups.append(([source], own, used))
    return [members for members, _, _ in groups]


def main():
    root, folder, most, *sources = sys.argv[1:]
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for number, members in enumerate(groups_of(sources, Path(root), int(most))):
        file = folder / f"{number}.cpp"
        text = "".join(f'#include "{member}"\n' for member in members)
        if not file.is_file() or file.read_text() != text:
            file.write_text(text)
        written.append(str(file))
    print(";".join(written), end="")


main()
