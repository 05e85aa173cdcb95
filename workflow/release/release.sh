#!/usr/bin/env bash
# `release.sh VERSION [URL]`: sets the version everywhere, checks, commits, tags and packs. It uploads nothing.
# URL is the address of the repository at its public host, by default that of the Makefile.
set -euo pipefail
cd "$(dirname "$0")/../.."
version=${1:?the version, such as 0.2.0}
url=${2:-$(sed -n 's/^URL := *//p' Makefile)}
[[ $version =~ ^[0-9]+\.[0-9]+\.[0-9]+$ ]] || { echo "release.sh: $version is no version such as 0.2.0" >&2; exit 2; }
[ -n "$url" ] || { echo "release.sh: URL in the Makefile is empty; links of a package lead to that address" >&2; exit 2; }
[ -z "$(git status --porcelain)" ] || { echo "release.sh: commit your changes first" >&2; exit 2; }
[ -z "$(git tag --list "v$version")" ] || { echo "release.sh: v$version is tagged already" >&2; exit 2; }
grep -q "^## $version" CHANGELOG.md || { echo "release.sh: CHANGELOG.md has no entry ## $version" >&2; exit 2; }
old=$(sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml)
today=$(date +%F)

sed -i "s/^version = \"${old//./\\.}\"/version = \"$version\"/" pyproject.toml
sed -i "s/^__version__ = .*/__version__ = \"$version\"/" squeal/__init__.py
sed -i "s/^\( *version:\) .*/\1 $version/" CITATION.cff workflow/release/recipe.yaml
sed -i "/^date-released:/d; s/^version: .*/&\ndate-released: $today/" CITATION.cff
sed -i "/@software{squeal,/,/^}/{s/version = {.*}/version = {$version}/; s/\(year *=\).*/\1 {${today%%-*}},/}" README.md squeal/article/report/references.bib
sed -i "s/^## $version (unreleased)/## $version ($today)/" CHANGELOG.md
make metadata cite-check lint test dist URL="$url"
git commit -qam "Release $version"
git tag -a "v$version" -m "squeal $version"
echo "v$version is tagged and packed in dist/. To publish it:"
echo "  git push --follow-tags && .venv/apart/bin/twine upload dist/*"
