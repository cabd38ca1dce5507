#!/bin/sh
# Prints a version's section of CHANGELOG.md, or the unreleased one if it has none yet.
# Usage: tools/release_notes.sh VERSION [CHANGELOG]
set -eu
if [ $# = 0 ]; then
	echo "usage: $0 VERSION [CHANGELOG]" >&2
	exit 2
fi
changelog=${2:-CHANGELOG.md}
awk -v version="$1" -v file="$changelog" '
	/^## / {
		part = ""
		if (index($0, "## [" version "]") == 1) part = "released"
		else if (index($0, "## [Unreleased]") == 1) part = "unreleased"
		if (part == "released" && match($0, /[0-9]+-[0-9]+-[0-9]+$/)) date = ", " substr($0, RSTART)
		next
	}
	# Links at the end of the file do not belong to a section.
	/^\[[^]]*\]: / { part = "" }
	part != "" { text[part] = text[part] $0 "\n" }
	END {
		notes = ("released" in text) ? text["released"] : text["unreleased"]
		if (notes !~ /[^ \n]/) {
			printf "%s: expected a section [%s] or [Unreleased] with text, found none\n", file, version > "/dev/stderr"
			exit 1
		}
		gsub(/^\n+|\n+$/, "", notes)
		printf "# Afterlight %s%s\n\n%s\n", version, date, notes
	}
' "$changelog"
