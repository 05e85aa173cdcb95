#!/usr/bin/env bash
# `machines.sh DIRECTORY [MACHINE ...]`: installs, builds and tests on fresh machines, releases of Debian
# below DIRECTORY without compiler, TeX or anything else. For root on Debian or Ubuntu.
#
#   bookworm       Python 3.11.2: the report, some tests
#   bookworm-user  the same in a path with blanks and other letters, by a user who may not become root,
#                  cannot write to his home, has one core and 2 GB; some tests without heyoka too
#   trixie, sid    Python 3.13 and 3.14: some tests
#
# Only what installs has a network. TESTS go to pytest; TESTS="" runs all. Prints a line for each step.
set -euo pipefail
cd "$(dirname "$0")/../.."
. workflow/setup/system.sh
PLACE=$(realpath -m "${1:?the directory to work in}")
shift
TESTS=${TESTS-tests/model tests/linear/test_verdict.py tests/cli/test_cli.py tests/cli/test_streams.py}
case $PLACE/ in "$PWD"/*) echo "machines.sh: $PLACE lies in the repository; take another one" >&2 && exit 2 ;; esac

if ! command -v debootstrap >/dev/null; then may_be_root && apt_install debootstrap; fi

# outside settings: where packages are fetched from, and whose certificates are trusted
settings() {
    local file
    for file in /etc/pip.conf ~/.config/pip ~/.config/uv /etc/uv /etc/resolv.conf /etc/ssl/certs; do
        if [ -e "$file" ]; then cp -rL --parents "$file" "$1" 2>/dev/null || true; fi
    done
    mkdir -p "$1/home/user/.config"
    if [ -d ~/.config/pip ]; then cp -r ~/.config/pip "$1/home/user/.config"; fi
    chmod -R a+rX "$1/home/user" # and nobody but root writes there
}

# the largest memory of this shell and what it starts, where control groups can be had
two_gigabytes() {
    local groups=/sys/fs/cgroup file=memory.max
    if [ -d $groups/memory ]; then groups+=/memory file=memory.limit_in_bytes; fi
    mkdir -p $groups/squeal && echo 2G >$groups/squeal/$file && echo $BASHPID >$groups/squeal/cgroup.procs
}

# step WORDS STATUS COMMAND: a line of the table; what is said goes to a file
step() {
    local status=0 log="$PLACE/$machine ${1//\//-}.log"
    "${before[@]}" chroot "${how[@]}" "$root" env HOME="$home" bash -uc \
        "cd '$folder' && unset PYTHONDONTWRITEBYTECODE && $3" >"$log" 2>&1 </dev/null || status=$?
    local result=passed
    [ "$status" -eq "$2" ] || result="FAILED with status $status"
    printf '%-14s %-28s %s; %s\n' "$machine" "$1" "$result" "$(tail -n 1 "$log" | cut -c 1-200)"
    [ "$result" = passed ]
}

try() {
    local machine=$1 release=${1%-*} folder=/squeal home=/root before=() how=()
    local root=$PLACE/$release packages=make,ca-certificates,python3-venv
    # there a dependency of Snakemake has no wheel yet
    [ "$release" != sid ] || packages+=,gcc,python3-dev
    if [ ! -x "$root/usr/bin/python3" ]; then
        debootstrap --variant=minbase --include=$packages "$release" "$root" >"$PLACE/$machine.log" 2>&1
    fi
    settings "$root"
    if [ "$machine" = bookworm-user ]; then
        folder="/srv/Bremsen quietschen (größer)" home=/home/user how=(--userspec=1000:1000)
        chroot "$root" id user >"$PLACE/id" 2>&1 || chroot "$root" useradd --uid 1000 --no-create-home user
    fi
    rm -rf "${root:?}$folder"
    mkdir -p "$root$folder"
    git ls-files -z --cached --others --exclude-standard | tar --null -T - -c | tar -x -C "$root$folder"
    [ ${#how[@]} -eq 0 ] || chown -R 1000:1000 "$root$folder"
    mount -t proc proc "$root/proc"
    mount -t tmpfs -o mode=1777 shm "$root/dev/shm"
    # shellcheck disable=SC2064 # its value now, since the shell leaves the function before it ends
    trap "umount '$root/proc' '$root/dev/shm'" EXIT
    step installation 0 "PYTHON=python3 make .venv/environment.stamp && .venv/bin/python --version"
    before+=(unshare -n)
    if [ "$machine" = bookworm-user ]; then
        before+=(taskset -c 0)
        two_gigabytes
    fi
    if [ "$release" = bookworm ]; then
        step "make report, without TeX" 2 "make report"
        step "make verify" 0 "make verify"
    fi
    step tests 0 "make test TESTS='-n 0 $TESTS'"
    if [ "$machine" = bookworm-user ]; then
        step "tests without heyoka" 0 "make test-without-heyoka TESTS='-n 0 $TESTS'"
    fi
}

mkdir -p "$PLACE"
failed=()
[ $# -gt 0 ] || set -- bookworm bookworm-user trixie sid
for machine in "$@"; do
    set +e # in a condition a step that fails would not end the machine
    (set -e && try "$machine")
    [ $? -eq 0 ] || failed+=("$machine")
    set -e
done
[ ${#failed[@]} -eq 0 ] || { echo "machines.sh: not passed: ${failed[*]}" >&2 && exit 1; }
