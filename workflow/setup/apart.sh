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

pip install --require-hashes --only-binary :all: -r requirements/build.txt
how=(--require-hashes --no-build-isolation -r "requirements/$1.txt")
.venv/bin/uv --quiet pip install --python "$place" "${how[@]}" || pip install --use-pep517 "${how[@]}"
