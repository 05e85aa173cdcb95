#!/usr/bin/env bash
# `pythons.sh DIRECTORY [TESTS]`: installs and tries the project with Python 3.13 and 3.14, those of two
# other releases of Debian, each in a folder of its own below DIRECTORY. For root on Debian or Ubuntu.
# TESTS go to pytest; left out, a few that take a minute. "" runs all.
set -euo pipefail
cd "$(dirname "$0")/../.."
. workflow/setup/system.sh
PLACE=$(realpath -m "${1:?the directory to work in}")
TESTS=${2-tests/model tests/linear/test_judgement.py tests/cli/test_cli.py tests/cli/test_streams.py}
case $PLACE/ in "$PWD"/*) echo "pythons.sh: $PLACE lies in the repository; take another one" >&2 && exit 2 ;; esac

if ! command -v debootstrap >/dev/null; then may_be_root && apt_install debootstrap; fi

# outside settings: where packages are fetched from, and whose certificates are trusted
settings() {
    local file
    for file in /etc/pip.conf ~/.config/pip ~/.config/uv /etc/uv /etc/resolv.conf /etc/ssl/certs; do
        if [ -e "$file" ]; then cp -rL --parents "$file" "$1" 2>/dev/null || true; fi
    done
}

try() {
    local release=$1 root=$PLACE/$1
    shift
    if [ ! -x "$root/usr/bin/python3" ]; then
        echo "pythons.sh: $release ..."
        debootstrap --variant=minbase --include="make,ca-certificates,python3-venv,$*" \
            "$release" "$root" >"$PLACE/$release.log" 2>&1 || return
    fi
    settings "$root"
    rm -rf "$root/squeal"
    mkdir "$root/squeal"
    git ls-files -z | tar --null -T - -c | tar -x -C "$root/squeal" || return
    mount -t proc proc "$root/proc"
    trap "umount '$root/proc'" EXIT
    chroot "$root" env HOME=/root bash -eu -c "
        cd /squeal
        PYTHON=python3 make --no-print-directory .venv/environment.stamp
        .venv/bin/python --version
        .venv/bin/squeal simulate workflow/scenes/b2-c.yaml | head -3
        .venv/bin/squeal critical-friction workflow/scenes/b2-c.yaml | head -3
        .venv/bin/pytest -n 0 $TESTS"
}

mkdir -p "$PLACE"
failed=()
(try trixie) || failed+=(trixie)
# there a dependency of Snakemake has no wheel yet
(try sid gcc,python3-dev) || failed+=(sid)
[ ${#failed[@]} -eq 0 ] || { echo "pythons.sh: not passed in ${failed[*]}" >&2 && exit 1; }
