#!/usr/bin/env bash
# Checks format and style of JavaScript and CSS with Biome (biome.json); `tools/javascript.sh --write` formats the files.
# Biome comes from npm on first use. Without npm or its registry nothing is checked, and one line says so.
set -euo pipefail
cd "$(dirname "$0")/.."

version=2.6.8
folder=build/node/biome-$version
biome=$folder/node_modules/.bin/biome
if [ ! -x "$biome" ]; then
    mkdir -p "$folder"
    if ! npm install --silent --no-audit --no-fund --prefix "$folder" "@biomejs/biome@$version" >/dev/null 2>&1; then
        echo "volprep: JavaScript and CSS are not checked: npm is missing, or cannot install @biomejs/biome@$version" >&2
        exit 0
    fi
fi
if [ "${1:-}" = --write ]; then
    exec "$biome" format --write .
fi
exec "$biome" ci --colors=off --error-on-warnings .
