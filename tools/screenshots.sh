#!/bin/sh
# Starts the studio on a project in a virtual display, follows the main path by keys and mouse, and
# writes a picture of each step into docs/guide/. Usage: tools/screenshots.sh AFTERLIGHT PROJECT
set -eu
if [ $# != 2 ]; then
	echo "usage: $0 AFTERLIGHT PROJECT" >&2
	exit 2
fi
for tool in xvfb-run xdotool import convert; do
	command -v "$tool" >/dev/null 2>&1 && continue
	echo "$tool is missing. On Debian: apt-get install xvfb xauth xdotool imagemagick" >&2
	exit 1
done
if [ -z "${INSIDE_SCREENSHOTS:-}" ]; then
	export INSIDE_SCREENSHOTS=yes
	exec xvfb-run -a -s "-screen 0 2560x1440x24" "$0" "$@"
fi
out=docs/guide
mkdir -p "$out"
settings=$(mktemp -d)
# A copy takes the changes; beside the project, so that its relative paths hold.
copy=$(mktemp -d "${2%/}.XXXXXX")
cp -r "${2%/}/." "$copy"
set -- "$1" "$copy"
studio=""
trap 'kill $studio 2>/dev/null; rm -rf "$settings" "$copy"' EXIT
# Opens a project in a window of these columns and rows, at this pixel density.
opened() {
	columns=$3 rows=$4
	# Keeps the user's own window layout untouched and out of the pictures.
	XDG_CONFIG_HOME="$settings" WINIT_X11_SCALE_FACTOR=$5 "$1" studio "$2" &
	studio=$!
	window=""
	for _ in $(seq 60); do
		sleep 1
		window=$(xdotool search --name Afterlight 2>/dev/null | head -n 1) && [ -n "$window" ] && break
	done
	[ -n "$window" ] || { echo "The studio's window did not open" >&2; exit 1; }
	xdotool windowsize "$window" "$columns" "$rows"
	xdotool windowmove "$window" 0 0
	# Without a window manager, the window takes keys while the cursor is in it.
	xdotool mousemove $((columns / 2)) $((rows * 11 / 24)) windowfocus "$window"
}
key() { xdotool key --clearmodifiers "$@"; sleep 1; }
shot() {
	sleep "${2:-3}"
	kill -0 "$studio" 2>/dev/null || { echo "The studio ended before $1" >&2; exit 1; }
	import -window root -crop "${columns}x${rows}+0+0" +repage "$out/$1.png"
	# An undrawn window has a single colour.
	colors=$(convert "$out/$1.png" -format %k info:)
	[ "$colors" -gt 200 ] || { echo "$out/$1.png is nearly empty: $colors colours" >&2; exit 1; }
	echo "$out/$1.png"
}
drag() {
	xdotool mousemove "$1" "$2" mousedown 1
	sleep 0.3
	xdotool mousemove "$3" "$4"
	sleep 0.3
	xdotool mouseup 1
}
opened "$1" "$2" 1280 720 1
shot relight 20
drag 560 300 700 300
shot turned
xdotool mousemove 640 330
key w
shot wipe
key w
key Page_Down
shot lamp
key Page_Up
key l
shot luminance
key c
key ctrl+shift+p
shot palette 2
key Escape
key question
shot keys 2
key Escape
# A turn between two keys: its lane, then its curve with the tangents of the first key.
key k
key End
sleep 3
drag 560 300 660 300
shot lanes
key Home
xdotool mousemove 476 586 click 1
shot curve
xdotool mousemove 640 330
key ctrl+z ctrl+z
# From here on the cursor points at nothing.
xdotool mousemove 640 708
key ctrl+1
shot calibrate 8
key ctrl+2
shot train 5
key ctrl+4
shot review 5
key ctrl+5
shot export
for size in "1366 768 1" "1920 1080 1" "2560 1440 2"; do
	kill "$studio"
	wait "$studio" || true
	# shellcheck disable=SC2086
	opened "$1" "$2" $size
	xdotool mousemove $((columns / 2)) $((rows - 12))
	shot "relight-${columns}x$rows" 20
done
