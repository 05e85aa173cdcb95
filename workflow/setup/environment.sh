#!/usr/bin/env bash
# Makes .venv hold exactly the locked requirements, of groups that it has too, and this project
# (editable).
# `environment.sh develop` adds documentation, peers of the benchmarks, cluster and fuzz.
set -euo pipefail
cd "$(dirname "$0")/../.."
. workflow/setup/system.sh
. workflow/setup/locked.sh

suits() {
    "$1" -c 'import ensurepip, sys, venv
sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' 2>/dev/null
}

find_python() {
    local candidate
    for candidate in ${PYTHON:-python3.14 python3.13 python3.12 python3.11 python3}; do
        if suits "$candidate"; then
            echo "$candidate"
            return
        fi
    done
    return 1
}

create() {
    if ! find_python >/dev/null && command -v apt-get >/dev/null && may_be_root; then
        echo "squeal: installing python3-venv ..."
        apt_install python3-venv || true
    fi
    local python
    if ! python=$(find_python); then
        echo "squeal: Python 3.11 to 3.14 with the venv module is needed" \
            "(Debian, Ubuntu: apt-get install python3-venv); PYTHON=... names another." >&2
        exit 1
    fi
    "$python" -m venv --clear .venv
}

pip() {
    .venv/bin/python -m pip --quiet --disable-pip-version-check "$@"
}

# uv is five times faster; pip does where uv is not to be had.
uv() {
    [ -x .venv/bin/uv ] && VIRTUAL_ENV=$PWD/.venv .venv/bin/uv --quiet "$@"
}

# the lock of the environment, and the one that was added to it
locks() {
    echo requirements/environment.txt
    [ ! -e .venv/develop.stamp ] || echo requirements/develop.txt
}

if [ -n "${1-}" ]; then
    echo "squeal: installing requirements/$1.txt ..."
    uv pip install --require-hashes --no-build-isolation -r "requirements/$1.txt" ||
        pip install --require-hashes --no-build-isolation --use-pep517 -r "requirements/$1.txt"
    exit
fi

.venv/bin/python -c '' 2>/dev/null || create
echo "squeal: installing the Python environment ..."
# what has no wheel is built with these, not with what the registry holds today
locked setuptools > .venv/first.txt
pip install --require-hashes --only-binary :all: -r .venv/first.txt
locked uv > .venv/first.txt
pip install --require-hashes -r .venv/first.txt || true
# shellcheck disable=SC2046
uv pip sync --require-hashes --no-build-isolation --compile-bytecode $(locks) ||
    pip install --require-hashes --no-build-isolation --use-pep517 -r requirements/environment.txt
uv pip install --no-deps --no-build-isolation -e . ||
    pip install --no-deps --no-build-isolation -e .
