# shellcheck shell=bash
# Sourced by the other scripts: installs system packages where root rights can be had.

may_be_root() {
    [ "$(id -u)" -eq 0 ] && return
    command -v sudo >/dev/null || return
    # Ask for a password only where somebody can type it.
    sudo -n true 2>/dev/null || { [ -t 0 ] && [ -t 2 ] && sudo -v; }
}

as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo "$@"; fi
}

# apt_install PACKAGE...: a failed update (one broken source) need not spoil the install.
apt_install() {
    as_root apt-get update -qq || true
    as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get install -qq --no-install-recommends "$@" >/dev/null
}

# Where the home cannot be written, what Snakemake and Matplotlib store goes here.
store_here() {
    if ! { mkdir -p "${XDG_CACHE_HOME:-$HOME/.cache}" && [ -w "${XDG_CACHE_HOME:-$HOME/.cache}" ]; } 2>/dev/null; then
        export XDG_CACHE_HOME="$PWD/.snakemake/cache" MPLCONFIGDIR="$PWD/.snakemake/matplotlib"
    fi
}
