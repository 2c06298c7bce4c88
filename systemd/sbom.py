"""Lists the parts of the program for machines: CycloneDX 1.5 in JSON, which is the same for the same sources and compiler.

In it (scope `required`) are the libraries that the program is linked from, the standard library of Rust, the C library that one of them carries,
and what the page of the console brings; else (`excluded`) what runs only while it is built, such as macros.
"""

import datetime
import json
import os
import pathlib
import re
import subprocess
import sys
import tomllib

# Sources in C that a library compiles in, by what it says it links; where in its version theirs stands. Those of ring are its own.
CARRIED = {
    "lz4": {"name": "lz4", "version": r"\+lz4-(.+)", "licence": "BSD-2-Clause", "purl": "pkg:github/lz4/lz4@v{}"},
}
OWN = ("ring_core_",)


def component(name, version, licence, purl, scope="required", **more):
    expression = licence.replace(" / ", "/").replace("/", " OR ")
    licences = [{"expression": expression}]
    return {"type": "library", "bom-ref": purl, "name": name, "version": version, "scope": scope, "licenses": licences, "purl": purl, **more}


def purl_of(package):
    # A plus would be read as a space.
    return f"pkg:cargo/{package['name']}@{package['version'].replace('+', '%2B')}"


def crate(package, sums, scope):
    more = {"hashes": [{"alg": "SHA-256", "content": sums[package["name"], package["version"]]}]}
    if package["repository"]:
        more["externalReferences"] = [{"type": "vcs", "url": package["repository"]}]
    return component(package["name"], package["version"], package["license"], purl_of(package), scope, **more)


def carried(package):
    """The sources of another project that a library of the program compiles in."""
    links = package["links"]
    if not links or links.startswith(OWN):
        return []
    if links not in CARRIED:
        sys.exit(f"sbom.py: {package['name']} links {links}, which is not known here: look at what it compiles, then add it")
    known = CARRIED[links]
    version = re.search(known["version"], package["version"])
    if not version:
        sys.exit(f"sbom.py: {package['name']} {package['version']}: the version of {links} does not stand in it any more")
    return [component(known["name"], version[1], known["licence"], known["purl"].format(version[1]))]


def page():
    """What the page of the console has of others; its version stands in its first line."""
    first = pathlib.Path("src/console/vendor/uPlot.iife.min.js").read_text(encoding="utf-8").splitlines()[0]
    version = re.search(r"\(v([0-9.]+)\)", first)[1]
    return component("uplot", version, "MIT", f"pkg:npm/uplot@{version}")


def standard():
    """The standard library, which comes with the compiler."""
    said = subprocess.run(["rustc", "--version", "--verbose"], check=True, capture_output=True, text=True).stdout
    release, commit = (re.search(f"{word}: (.+)", said)[1] for word in ("release", "commit-hash"))
    text = f"The standard library of Rust {release}, whose compiler made the program (commit {commit})."
    purl = f"pkg:github/rust-lang/rust@{release}"
    return component("std", release, "MIT OR Apache-2.0", purl, description=text)


def edges(data, refs, more):
    """What needs what, among the parts; `more` adds to what a package needs."""
    for node in data["resolve"]["nodes"]:
        if node["id"] in refs:
            needed = (dependency["pkg"] for dependency in node["deps"])
            on = {refs[one] for one in needed if one in refs} | set(more.get(node["id"], []))
            yield {"ref": refs[node["id"]], "dependsOn": sorted(on - {refs[node["id"]]})}


def made():
    """The time of the sources, where it is given: that of the build would be another each time."""
    seconds = os.environ.get("SOURCE_DATE_EPOCH")
    if seconds is None:
        return {}
    at = datetime.datetime.fromtimestamp(int(seconds), datetime.timezone.utc)
    return {"timestamp": at.strftime("%Y-%m-%dT%H:%M:%SZ")}


def write(path, data, inside, packages):
    """`inside` are the ids of the packages that are in the program; `packages` all that it is built of or by, ours left out."""
    root = next(one for one in data["packages"] if one["id"] == data["resolve"]["root"])
    lock = tomllib.loads(pathlib.Path("Cargo.lock").read_text(encoding="utf-8"))
    sums = {(one["name"], one["version"]): one.get("checksum") for one in lock["package"]}
    parts = [crate(one, sums, "required" if one["id"] in inside else "excluded") for one in packages]
    within = {one["id"]: carried(one) for one in packages if one["id"] in inside}
    others = [standard(), page()]
    refs = {root["id"]: purl_of(root)} | {one["id"]: purl_of(one) for one in packages}
    more = {one: [part["bom-ref"] for part in found] for one, found in within.items()}
    more[root["id"]] = [part["bom-ref"] for part in others]
    program = component(root["name"], root["version"], root["license"], purl_of(root)) | {"type": "application"}
    bom = {
        "$schema": "http://cyclonedx.org/schema/bom-1.5.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": made() | {"lifecycles": [{"phase": "build"}], "component": program},
        "components": parts + [part for found in within.values() for part in found] + others,
        "dependencies": sorted(edges(data, refs, more), key=lambda one: one["ref"]),
    }
    pathlib.Path(path).write_text(json.dumps(bom, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
