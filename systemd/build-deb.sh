#!/usr/bin/env bash
# Builds the Debian package into target/debian: the program, its manual pages and completions, and what Cargo.toml names under
# [package.metadata.deb]. Needs python3 (3.11 or later), and no network; packs with cargo-deb where that is installed
# (`cargo install cargo-deb`), else with dpkg-deb. Debian or what comes from it; the build (profile `dist`) takes some minutes.
#
#   systemd/build-deb.sh [--no-build]      --no-build takes target/dist/kinocue as it is
set -euo pipefail
cd "$(dirname "$0")/.."

[ "${1:-}" = --no-build ] || cargo build --profile dist --locked --bin kinocue
kinocue=target/dist/kinocue
rm -rf target/package
mkdir -p target/package/man target/debian
"$kinocue" man target/package/man
"$kinocue" completions bash > target/package/kinocue.bash
"$kinocue" completions zsh > target/package/_kinocue
"$kinocue" completions fish > target/package/kinocue.fish
python3 systemd/third_party.py target/package/third-party.txt

if cargo deb --version > /dev/null 2>&1; then
  exec cargo deb --no-build --profile dist --locked --output target/debian
fi
exec python3 systemd/deb.py target/debian
