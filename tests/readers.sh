#!/usr/bin/env bash
# The official Python and TypeScript readers of MCAP, in a folder of their own, for the tests that read our recordings with them, and a
# validator of OpenAPI (0.9.0) with what it needs, for the test that has the description of the API validated.
set -euo pipefail
cd "$(dirname "$0")/.."
wanted=(mcap==1.6.0 mcap-protobuf-support==0.6.0 protobuf==7.36.2 lz4==4.4.5 zstandard==0.25.0
  openapi-spec-validator==0.9.0 openapi-schema-validator==0.9.0 jsonschema==4.26.0 jsonschema-path==0.5.0 jsonschema-specifications==2025.9.1
  referencing==0.37.0 rpds-py==2026.9.1 attrs==26.1.0 pathable==0.6.0 lazy-object-proxy==1.13.0 PyYAML==6.0.4 rfc3339-validator==0.1.4 six==1.17.0
  pydantic==2.14.4 pydantic_core==2.50.5 pydantic-settings==2.16.3 python-dotenv==1.2.4 annotated-types==0.8.0 typing-inspection==0.4.5
  typing_extensions==4.16.0)
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
