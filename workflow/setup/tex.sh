#!/usr/bin/env bash
# Installs TeX where it is missing and may be installed. Status 0: TeX is there.
set -euo pipefail
cd "$(dirname "$0")/../.."
. workflow/setup/system.sh

complete() {
    local program
    for program in latexmk pdflatex bibtex kpsewhich; do
        command -v "$program" >/dev/null || return
    done
    kpsewhich lmodern.sty booktabs.sty caption.sty hyperref.sty microtype.sty natbib.sty \
        british.ldf >/dev/null
}

install() {
    if command -v apt-get >/dev/null; then
        apt_install texlive-latex-recommended lmodern latexmk
    elif command -v dnf >/dev/null; then
        as_root dnf install -y -q latexmk texlive-collection-latexrecommended texlive-lm \
            texlive-babel-english
    elif command -v zypper >/dev/null; then
        as_root zypper --non-interactive --quiet install texlive-latexmk \
            texlive-collection-latexrecommended texlive-lm texlive-babel-english
    elif command -v pacman >/dev/null; then
        as_root pacman -S --needed --noconfirm texlive-binextra texlive-latexrecommended \
            texlive-fontsrecommended texlive-langenglish
    fi
}

complete && exit
if may_be_root; then
    echo "squeal: installing TeX (about 60 MB, one minute) ..."
    install || true
fi
complete
