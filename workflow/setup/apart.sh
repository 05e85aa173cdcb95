#!/usr/bin/env bash
# `apart.sh NAME` makes .venv/NAME hold exactly requirements/NAME.txt: programs whose requirements
# exclude those of the project.
set -euo pipefail
cd "$(dirname "$0")/../.."
place=.venv/$1

echo "squeal: installing requirements/$1.txt apart, in $place ..."
.venv/bin/python -m venv --clear "$place"
pip() {
    "$place/bin/python" -m pip --quiet --disable-pip-version-check "$@"
}

.venv/bin/uv --quiet pip install --python "$place" --require-hashes -r "requirements/$1.txt" ||
    pip install --require-hashes -r "requirements/$1.txt"
