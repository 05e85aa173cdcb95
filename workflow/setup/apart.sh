#!/usr/bin/env bash
# Makes .venv/apart hold exactly requirements/apart.txt: programs whose requirements exclude those of
# the project.
set -euo pipefail
cd "$(dirname "$0")/../.."
place=.venv/apart
. workflow/setup/locked.sh

echo "squeal: installing requirements/apart.txt apart, in $place ..."
.venv/bin/python -m venv --clear "$place"
pip() {
    "$place/bin/python" -m pip --quiet --disable-pip-version-check "$@"
}

locked setuptools > "$place/first.txt"
pip install --require-hashes --only-binary :all: -r "$place/first.txt"
how=(--require-hashes --no-build-isolation -r "requirements/apart.txt")
.venv/bin/uv --quiet pip install --python "$place" "${how[@]}" || pip install --use-pep517 "${how[@]}"
