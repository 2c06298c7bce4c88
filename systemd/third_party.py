"""Writes the licences of all libraries that the program has in it, with their texts, as these ask for.

python3 systemd/third_party.py FILE, from the root of the project; needs cargo and the sources of the libraries, which a build
has fetched. A library without a licence, or under one that is not known here, ends it with 1: look at it, then add it.
"""

import json
import pathlib
import platform
import re
import subprocess
import sys

# A library may be under any one of several; of these each one asks for no more than to be named.
FINE = {"MIT", "Apache-2.0", "BSD-3-Clause", "BSD-2-Clause", "Zlib", "0BSD", "Unlicense", "Unicode-3.0", "BSL-1.0", "ISC"}


def linked():
    """The packages that the program is linked from, ours left out, by name."""
    target = f"{platform.machine()}-unknown-linux-gnu"
    command = ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", target]
    data = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    packages = {package["id"]: package for package in data["packages"]}
    nodes = {node["id"]: node for node in data["resolve"]["nodes"]}
    root = data["resolve"]["root"]
    found, waiting = set(), [root]
    while waiting:
        node = waiting.pop()
        if node in found:
            continue
        found.add(node)
        for dependency in nodes[node]["deps"]:
            if any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                waiting.append(dependency["pkg"])
    # The metadata count what tests ask of a library; the tree does not.
    command = ["cargo", "tree", "--locked", "--edges", "normal", "--target", target, "--prefix", "none", "--format", "{p}"]
    tree = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    built = {tuple(line.split()[:2]) for line in tree if line}
    linked = (packages[one] for one in found - {root})
    linked = (package for package in linked if (package["name"], "v" + package["version"]) in built)
    return sorted(linked, key=lambda package: (package["name"], package["version"]))


def is_fine(licence):
    """Whether every part of an expression as `(MIT OR Apache-2.0) AND Unicode-3.0` leaves a choice that is fine."""
    parts = re.split(r"\s+AND\s+", (licence or "").replace("/", " OR "))
    names = (re.split(r"\s+OR\s+|\s+WITH\s+\S+", part.strip("() ")) for part in parts)
    return all(any(name.strip("() ") in FINE for name in choices) for choices in names)


def texts(package):
    folder = pathlib.Path(package["manifest_path"]).parent
    files = (file for file in sorted(folder.iterdir()) if re.match(r"(?i)(licen[cs]e|copying|notice)", file.name))
    return [file.read_text(errors="replace").strip() for file in files if file.is_file()]


def main():
    packages = linked()
    wrong = [f"{one['name']}: {one['license']}" for one in packages if not is_fine(one["license"])]
    if wrong:
        sys.exit("third_party.py: not known to be fine: " + ", ".join(wrong))
    known = {}
    with open(sys.argv[1], "w", encoding="utf-8") as out:
        out.write("kinocue has these libraries in it. A text that stands here already is not repeated.\n")
        for package in packages:
            name = f"{package['name']} {package['version']}"
            out.write(f"\n{'=' * 100}\n{name}, {package['license']}, {package['repository'] or 'crates.io'}\n")
            for text in texts(package):
                first = known.setdefault(" ".join(text.split()), name)
                out.write(f"\n{text}\n" if first == name else f"\nThe same text as of {first}.\n")


main()
