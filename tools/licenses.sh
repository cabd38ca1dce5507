#!/bin/sh
# Lists the software in the program: every crate with its licence, and each licence text once.
# Usage: tools/licenses.sh [ARGUMENTS FOR cargo tree, such as --features F]
set -eu
sources="${CARGO_HOME:-$HOME/.cargo}/registry/src"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Our own crates are in this repository; the others come from the registry.
${CARGO:-cargo} tree --locked -e normal --prefix none --format '{p}|{l}' "$@" |
	sed 's/ (\*)//; s/ (proc-macro)//' | grep -v -e '(/' -e '^|' -e '^$' | sort -u >"$work/crates"
mkdir "$work/texts"
: >"$work/list"
# text FILE: numbers a licence text; texts that differ only in spacing share a number.
text() {
	sum=$(tr -s '[:space:]' ' ' <"$1" | cksum | tr ' ' -)
	known=$(grep "^$sum " "$work/sums" 2>/dev/null | cut -d ' ' -f 2) || true
	if [ -z "$known" ]; then
		count=$((count + 1))
		known=$count
		echo "$sum $known" >>"$work/sums"
		cp "$1" "$work/texts/$known"
	fi
	numbers="$numbers${numbers:+, }$known"
}
count=0
note() {
	numbers=""
	find "$2" -maxdepth 2 -type f \( -iname 'licen[cs]e*' -o -iname 'copying*' -o -iname 'notice*' -o \
		-iname 'unlicense*' -o -iname 'ofl*' -o -iname 'ufl*' \) ! -name '*.rs' ! -name '*.toml' 2>/dev/null |
		sort >"$work/files"
	while read -r file; do
		text "$file"
	done <"$work/files"
	echo "$1; ${numbers:-without a text of its own}" >>"$work/list"
}
while IFS='|' read -r package license; do
	name=${package%% v*}
	version=${package#* v}
	for folder in "$sources"/*/"$name-$version"; do
		note "$name $version: ${license:-no licence named}" "$folder"
		break
	done
done <"$work/crates"
note "Phosphor icons: MIT" assets/phosphor
note "Weights of MediaPipe's selfie segmentation: Apache-2.0" assets/person
printf 'Afterlight is built of the following software. The numbers are those of the texts below.\n\n'
cat "$work/list"
for number in $(seq "$count"); do
	printf '\n======== %s ========\n\n' "$number"
	tr -d '\r\f' <"$work/texts/$number"
done
