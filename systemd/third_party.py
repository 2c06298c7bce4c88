"""Writes the licences of all libraries that the program has in it, with their texts, as these ask for; and, for machines, a list of
all its parts (`sbom.py`).

python3 systemd/third_party.py LICENCES [LIST], from the root of the project; needs cargo and the sources of the libraries, which
a build has fetched. A library without a licence, or under one that is not known here, ends it with 1: look at it, then add it.
"""

import json
import pathlib
import platform
import re
import subprocess
import sys

import sbom

# A library may be under any one of several; of these each one asks for no more than to be named.
FINE = {"MIT", "Apache-2.0", "BSD-3-Clause", "BSD-2-Clause", "Zlib", "0BSD", "Unlicense", "Unicode-3.0", "BSL-1.0", "ISC"}
TARGET = f"{platform.machine()}-unknown-linux-gnu"
# What a library brings along, but is not built into a program: tools and examples of the C library LZ4 are under the GPL.
ASIDE = {"benches", "build", "contrib", "doc", "examples", "fuzz", "ossfuzz", "programs", "tests"}


def cargo(*command):
    return subprocess.run(["cargo", *command, "--locked"], check=True, capture_output=True, text=True).stdout


def resolved():
    """What cargo knows of the packages of every target of ours."""
    return json.loads(cargo("metadata", "--format-version", "1", "--filter-platform", TARGET))


def tree(edges):
    """Name and version of whatever the program needs by such edges. The metadata count what tests ask of a library; this does not."""
    lines = cargo("tree", "--edges", edges, "--target", TARGET, "--prefix", "none", "--format", "{p}").splitlines()
    return {tuple(line.split()[:2]) for line in lines if line}


def of(data, names):
    """The packages of such names and versions, ours left out."""
    others = (one for one in data["packages"] if one["id"] != data["resolve"]["root"])
    found = (one for one in others if (one["name"], "v" + one["version"]) in names)
    return sorted(found, key=lambda one: (one["name"], one["version"]))


def is_fine(licence):
    """Whether every part of an expression as `(MIT OR Apache-2.0) AND Unicode-3.0` leaves a choice that is fine."""
    parts = re.split(r"\s+AND\s+", (licence or "").replace("/", " OR "))
    names = (re.split(r"\s+OR\s+|\s+WITH\s+\S+", part.strip("() ")) for part in parts)
    return all(any(name.strip("() ") in FINE for name in choices) for choices in names)


def texts(package):
    """The texts of its licences, and of those of what it carries in folders of its own."""
    folder = pathlib.Path(package["manifest_path"]).parent
    named = (file for file in folder.rglob("*") if re.match(r"(?i)(licen[cs]e|copying|notice)", file.name))
    kept = (file for file in named if file.is_file() and ASIDE.isdisjoint(file.relative_to(folder).parts))
    inner_last = sorted(kept, key=lambda file: (len(file.parts), file))
    return [file.read_text(errors="replace").strip() for file in inner_last]


def write_licences(path, packages):
    known = {}
    with open(path, "w", encoding="utf-8") as out:
        out.write("kinocue has these libraries in it. A text that stands here already is not repeated.\n")
        for package in packages:
            name = f"{package['name']} {package['version']}"
            out.write(f"\n{'=' * 100}\n{name}, {package['license']}, {package['repository'] or 'crates.io'}\n")
            for text in texts(package):
                first = known.setdefault(" ".join(text.split()), name)
                out.write(f"\n{text}\n" if first == name else f"\nThe same text as of {first}.\n")


def main():
    data = resolved()
    packages = of(data, tree("normal"))
    wrong = [f"{one['name']}: {one['license']}" for one in packages if not is_fine(one["license"])]
    if wrong:
        sys.exit("third_party.py: not known to be fine: " + ", ".join(wrong))
    write_licences(sys.argv[1], packages)
    if len(sys.argv) > 2:
        inside = {one["id"] for one in of(data, tree("normal,no-proc-macro"))}
        sbom.write(sys.argv[2], data, inside, of(data, tree("normal,build")))


main()
