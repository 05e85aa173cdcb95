#!/usr/bin/env bash
# Builds the report in .venv; options go to Snakemake. Status 3: TeX is missing, all but the PDF is built.
set -euo pipefail
cd "$(dirname "$0")/../.."
PATH=$PWD/.venv/bin:$PATH
export SQUEAL_BUILD=$PPID  # the build ends with make
. workflow/setup/system.sh
store_here

if workflow/setup/tex.sh; then
    exec snakemake "$@"
fi
snakemake everything_but_pdf "$@"
echo "squeal: all but the PDF is built; for that, install TeX (Debian, Ubuntu: apt-get install" \
    "--no-install-recommends texlive-latex-recommended lmodern latexmk) and run make report again." >&2
exit 3
