#!/usr/bin/env bash
# Gives PNG files a palette of 128 colours, in place: snapshots of tests/studio after UPDATE_SNAPSHOTS=1, a third of their size.
# Usage: tools/palette.sh tests/snapshots/*.png
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for file in "$@"; do
	ffmpeg -v error -y -i "$file" -filter_complex \
		"split[a][b];[a]palettegen=max_colors=128:reserve_transparent=0[p];[b][p]paletteuse=dither=none" \
		-pred mixed -compression_level 100 "$work/small.png"
	if [ "$(stat -c %s "$work/small.png")" -lt "$(stat -c %s "$file")" ]; then cp "$work/small.png" "$file"; fi
done
