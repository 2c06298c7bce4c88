#!/usr/bin/env bash
# The official Python reader of MCAP, in a folder of its own, for the tests that read our recordings with it.
set -euo pipefail
cd "$(dirname "$0")/.."
wanted=(mcap==1.6.0 mcap-protobuf-support==0.6.0 protobuf==7.36.2 lz4==4.4.5 zstandard==0.25.0)
python=target/readers/bin/python
if [ "$("$python" -m pip freeze 2>/dev/null | sort)" = "$(printf '%s\n' "${wanted[@]}" | sort)" ]; then exit; fi
rm -rf target/readers
python3 -m venv target/readers
"$python" -m pip install --quiet --disable-pip-version-check --no-deps "${wanted[@]}"
