#!/usr/bin/env bash
# Builds the Debian package into target/debian: the program, its manual pages and completions, and what Cargo.toml names under
# [package.metadata.deb]. Needs python3 (3.11 or later), and no network; packs with cargo-deb where that is installed
# (`cargo install cargo-deb`), else with dpkg-deb. Debian or what comes from it; the build (profile `dist`) takes some minutes.
#
#   systemd/build-deb.sh [--no-build]      --no-build takes target/dist/kinocue as it is
#
# The same sources, compiler and tools give the same package to the bit, in whatever folder and at whatever time:
# systemd/reproduce.sh holds that.
set -euo pipefail
cd "$(dirname "$0")/.."

# The time of everything in the package is that of the newest entry of its changelog.
entry=$(sed -n 's/^ -- .*>  //p' systemd/changelog | head -n 1)
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(date --date "${entry:?systemd/changelog has no date}" +%s)}
# Places in the sources, which a panic names, begin with no path of this machine. Of two that fit the compiler takes the last.
read -ra flags <<< "${RUSTFLAGS:-}"
crates=$(realpath --canonicalize-missing --no-symlinks "${CARGO_HOME:-$HOME/.cargo}/registry/src")
flags+=(--remap-path-prefix="$(pwd -P)=/kinocue" --remap-path-prefix="$crates=/crates")
CARGO_ENCODED_RUSTFLAGS=$(IFS=$'\x1f' && printf %s "${flags[*]}")
export SOURCE_DATE_EPOCH CARGO_ENCODED_RUSTFLAGS

[ "${1:-}" = --no-build ] || cargo build --profile dist --locked --bin kinocue
kinocue=target/dist/kinocue
rm -rf target/package
mkdir -p target/package/man target/debian
"$kinocue" man target/package/man
"$kinocue" completions bash > target/package/kinocue.bash
"$kinocue" completions zsh > target/package/_kinocue
"$kinocue" completions fish > target/package/kinocue.fish
python3 -B systemd/third_party.py target/package/third-party.txt target/package/kinocue.cdx.json

if cargo deb --version > /dev/null 2>&1; then
  exec cargo deb --no-build --profile dist --locked --output target/debian
fi
exec python3 systemd/deb.py target/debian
