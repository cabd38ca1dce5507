#!/bin/sh
# Checks a Linux system for the packages that building and running Afterlight needs. If all are there, it is
# silent and changes nothing. Otherwise it installs the missing ones if it may (on Debian and derivatives, as
# root or with a sudo that needs no password), or prints the one command to run.
set -u
[ "$(uname -s)" = Linux ] || exit 0
# Every system has ldconfig, but not always on the path.
PATH="$PATH:/usr/sbin:/sbin"
# Seconds to wait for another program that installs packages.
PATIENCE=600
# Where the Vulkan loader finds drivers.
VULKAN_DRIVERS=${VULKAN_DRIVERS:-/usr/share/vulkan/icd.d /etc/vulkan/icd.d /usr/local/share/vulkan/icd.d}

# Checks, by `need` below.
# shellcheck disable=SC2317
library() {
	case $libraries in
	*"$1 ("*) return 0 ;;
	?*) return 1 ;;
	esac
	# Without a table of libraries, look in the folders.
	for folder in /lib /lib64 /usr/lib /usr/lib64 /usr/local/lib; do
		[ -e "$folder/$1" ] && return 0
	done
	return 1
}

# shellcheck disable=SC2317
program() {
	command -v "$1" >/dev/null 2>&1
}

# shellcheck disable=SC2317
vulkan_driver() {
	for folder in $VULKAN_DRIVERS; do
		for file in "$folder"/*.json; do
			[ -e "$file" ] && return 0
		done
	done
	return 1
}

installer=""
for name in apt-get dnf pacman zypper; do
	program "$name" && installer=$name && break
done

missing=""
reasons=""
# need CHECK ARGUMENT WHY DEBIAN FEDORA ARCH OPENSUSE: notes the package if the check fails.
need() {
	"$1" "$2" && return
	case $installer in
	dnf) package=$5 ;;
	pacman) package=$6 ;;
	zypper) package=$7 ;;
	*) package=$4 ;;
	esac
	missing="$missing $package"
	reasons="$reasons  $package: $3
"
}

check() {
	libraries=$(ldconfig -p 2>/dev/null)
	missing=""
	reasons=""
	need library libvulkan.so.1 "finds the graphics card's driver" \
		libvulkan1 vulkan-loader vulkan-icd-loader libvulkan1
	need vulkan_driver any "draws on graphics cards, and on the processor where there is none" \
		mesa-vulkan-drivers mesa-vulkan-drivers vulkan-swrast libvulkan_lvp
	need library libxkbcommon.so.0 "reads the keyboard's layout for the window" \
		libxkbcommon0 libxkbcommon libxkbcommon libxkbcommon0
	need library libxkbcommon-x11.so.0 "the same under X11" \
		libxkbcommon-x11-0 libxkbcommon-x11 libxkbcommon-x11 libxkbcommon-x11-0
	need library libX11-xcb.so.1 "opens a window under X11" \
		libx11-xcb1 libX11-xcb libx11 libX11-xcb1
	need library libXcursor.so.1 "draws the mouse pointer under X11" \
		libxcursor1 libXcursor libxcursor libXcursor1
	need library libXi.so.6 "reads mouse and tablet under X11" \
		libxi6 libXi libxi libXi6
	need program ffmpeg "reads and writes movies" \
		ffmpeg ffmpeg-free ffmpeg ffmpeg
	need program cc "links the program" \
		gcc gcc gcc gcc
	# Debian's gcc only recommends the C library that it links with.
	case $installer:$missing in
	apt-get:*" gcc") missing="$missing libc6-dev" ;;
	esac
}

# apt-get itself waits for only one lock (DPkg::Lock), not for those of its lists and downloads.
apt() {
	waited=0
	until output=$($as env LC_ALL=C DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=10 "$@" 2>&1); do
		case $output in
		*"Could not get lock"* | *"Unable to acquire the dpkg frontend lock"*) ;;
		*)
			echo "$output" >&2
			return 1
			;;
		esac
		if [ "$waited" -ge "$PATIENCE" ]; then
			echo "Another program has been installing packages for $waited seconds:" >&2
			echo "$output" >&2
			return 1
		fi
		[ "$waited" -gt 0 ] || echo "Waiting until another program has installed its packages ..." >&2
		sleep 5
		waited=$((waited + 5))
	done
}

check
[ -n "$missing" ] || exit 0
printf 'Afterlight needs packages that this system lacks:\n%s' "$reasons" >&2

case $installer in
apt-get) line="apt-get update && SUDO apt-get install -y --no-install-recommends$missing" ;;
dnf) line="dnf install -y$missing" ;;
pacman) line="pacman -S --needed$missing" ;;
zypper) line="zypper install -y$missing" ;;
*)
	echo "These are Debian's names; install the same with the tools of this system" >&2
	exit 1
	;;
esac
if [ "$(id -u)" = 0 ]; then
	as=""
	line=$(echo "$line" | sed 's/SUDO //')
else
	as="sudo -n"
	line="sudo $(echo "$line" | sed 's/SUDO/sudo/')"
fi
give_up() {
	printf 'Install them with this line:\n  %s\n' "$line" >&2
	exit 1
}

[ "$installer" = apt-get ] || give_up
[ -z "$as" ] || $as true 2>/dev/null || give_up
echo "Installing them:$missing" >&2
apt update || echo "The lists of packages could not be updated; trying with those that are here" >&2
# shellcheck disable=SC2086 # One word for each package.
apt install -y --no-install-recommends $missing || give_up
check
[ -z "$missing" ] && exit 0
printf 'The packages are installed, and this is still not found:\n%s' "$reasons" >&2
exit 1
