"""Makes the Debian package of Cargo.toml's [package.metadata.deb] with dpkg-deb alone; see build-deb.sh.

python3 systemd/deb.py FOLDER, from the root of the project, after everything that the metadata names was built.
"""

import glob
import gzip
import hashlib
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import textwrap
import tomllib


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def place(root, pattern, target, mode):
    """Copies what a pattern finds: into a folder where the target ends with a slash, else under that name."""
    pattern = pattern.replace("target/release/", "target/dist/")  # cargo-deb means the built profile by the former
    sources = sorted(glob.glob(pattern))
    if not sources:
        sys.exit(f"deb.py: {pattern}: no such file; build it first (systemd/build-deb.sh)")
    for source in sources:
        path = root / (target + os.path.basename(source) if target.endswith("/") else target)
        path.parent.mkdir(parents=True, exist_ok=True)
        if target.startswith("usr/share/man/") or path.name.startswith("changelog"):
            path = path.with_name(path.name + ".gz")
            path.write_bytes(gzip.compress(pathlib.Path(source).read_bytes(), mtime=0))
        else:
            shutil.copyfile(source, path)
        path.chmod(int(mode, 8))


def control(package, deb, root):
    # What cargo-deb finds out by dpkg-shlibdeps: the program links the C library and its unwinder only.
    libc = output("dpkg-query", "--show", "--showformat=${Version}", "libc6").split("-")[0]
    depends = deb["depends"].replace("$auto", f"libc6 (>= {libc}), libgcc-s1")
    size = sum(file.stat().st_size for file in root.rglob("*") if file.is_file()) // 1024
    description = textwrap.indent(deb["extended-description"].strip(), " ")
    return f"""\
Package: {package["name"]}
Version: {package["version"]}-1
Architecture: {output("dpkg", "--print-architecture")}
Maintainer: {deb["maintainer"]}
Installed-Size: {size}
Depends: {depends}
Section: {deb["section"]}
Priority: {deb["priority"]}
Description: {package["description"]}
{description}
"""


def sums(root):
    """The checksum of every file, by which `dpkg --verify` finds what was changed since."""
    files = sorted(file for file in root.rglob("*") if file.is_file())
    return "".join(f"{hashlib.md5(file.read_bytes()).hexdigest()}  {file.relative_to(root)}\n" for file in files)


def main():
    package = tomllib.loads(pathlib.Path("Cargo.toml").read_text())["package"]
    deb = package["metadata"]["deb"]
    os.umask(0o022)  # folders take it from whoever builds
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        root.chmod(0o755)
        for asset in deb["assets"]:
            place(root, *asset)
        docs = f"usr/share/doc/{package['name']}"
        place(root, deb["license-file"][0], f"{docs}/copyright", "644")
        place(root, deb["changelog"], f"{docs}/changelog.Debian", "644")
        text, checksums = control(package, deb, root), sums(root)
        (root / "DEBIAN").mkdir()
        (root / "DEBIAN/control").write_text(text)
        (root / "DEBIAN/md5sums").write_text(checksums)
        for script in pathlib.Path(deb["maintainer-scripts"]).iterdir():
            shutil.copyfile(script, root / "DEBIAN" / script.name)
            (root / "DEBIAN" / script.name).chmod(0o755)
        subprocess.run(["dpkg-deb", "--root-owner-group", "--build", folder, sys.argv[1]], check=True)


main()
