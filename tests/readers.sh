#!/usr/bin/env bash
# The official Python and TypeScript readers of MCAP, in a folder of their own, for the tests that read our recordings with them.
set -euo pipefail
cd "$(dirname "$0")/.."
wanted=(mcap==1.6.0 mcap-protobuf-support==0.6.0 protobuf==7.36.2 lz4==4.4.5 zstandard==0.25.0)
python=target/readers/bin/python
if [ "$("$python" -m pip freeze 2>/dev/null | sort)" != "$(printf '%s\n' "${wanted[@]}" | sort)" ]; then
  rm -rf target/readers
  python3 -m venv target/readers
  "$python" -m pip install --quiet --disable-pip-version-check --no-deps "${wanted[@]}"
fi

if ! { command -v node && command -v npm; } >/dev/null; then
  echo "no node or no npm: the TypeScript reader is not installed; its test fails, or is skipped with KINOCUE_TESTS_WITHOUT=node-mcap" >&2
  exit
fi
# npm notes what it installed last, so an installation that was broken off has no note.
if [ target/readers/node_modules/.package-lock.json -nt tests/readers/package-lock.json ]; then exit; fi
cp tests/readers/package.json tests/readers/package-lock.json target/readers/
(cd target/readers && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error)
