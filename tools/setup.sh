#!/bin/sh
# Installs what the system lacks, where that is allowed; otherwise prints the one line to run.
set -u
[ "$(uname -s)" = Linux ] || exit 0
missing=""
library() { ldconfig -p 2>/dev/null | grep -q "$1" || missing="$missing $2"; }
library libvulkan.so.1 libvulkan1
library libxkbcommon.so.0 libxkbcommon0
library libxkbcommon-x11.so.0 libxkbcommon-x11-0
library libX11-xcb.so.1 libx11-xcb1
library libXcursor.so.1 libxcursor1
library libXi.so.6 libxi6
library libXrandr.so.2 libxrandr2
ls /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json >/dev/null 2>&1 || missing="$missing mesa-vulkan-drivers"
command -v ffmpeg >/dev/null 2>&1 || missing="$missing ffmpeg"
command -v cc >/dev/null 2>&1 || missing="$missing gcc libc6-dev"
[ -n "$missing" ] || exit 0
if command -v apt-get >/dev/null 2>&1; then
	install="apt-get install -y --no-install-recommends$missing"
	if [ "$(id -u)" = 0 ]; then
		as=""
	elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then
		as="sudo"
	else
		echo "Afterlight needs:$missing. Run: sudo apt-get update && sudo $install" >&2
		exit 1
	fi
	echo "Installing:$missing" >&2
	DEBIAN_FRONTEND=noninteractive
	export DEBIAN_FRONTEND
	$as apt-get update >/dev/null && $as $install >/dev/null && exit 0
fi
echo "Afterlight needs these Debian packages or their like:$missing" >&2
exit 1
