#!/bin/sh
# Installs the packages of `make package` on a fresh Debian without Rust or a source tree, as a user would, and
# runs the program there: commands, a movie, the window. Usage, as root: tools/test_package.sh [FOLDER]
# FOLDER holds the .deb and the tarball. SUITE chooses the Debian release, else it is this system's.
# Nothing outside $TMPDIR and the cache of the fresh system beside FOLDER is written.
set -eu
packages=$(cd "${1:-${CARGO_TARGET_DIR:-target}/package}" && pwd)
# shellcheck source=/dev/null
suite=${SUITE:-$(. /etc/os-release && echo "$VERSION_CODENAME")}

fail() {
	echo "test_package: $*" >&2
	exit 1
}
[ "$(id -u)" = 0 ] || fail "a fresh system needs root; run it with sudo"
for tool in debootstrap Xvfb import identify unshare; do
	command -v "$tool" >/dev/null 2>&1 ||
		fail "$tool is missing. On Debian: apt-get install debootstrap xvfb imagemagick util-linux"
done
deb=$(echo "$packages"/afterlight_*.deb)
tarball=$(echo "$packages"/afterlight-*.tar.xz)
[ -f "$deb" ] || fail "$packages has no afterlight_*.deb; run make package"
[ -f "$tarball" ] || fail "$packages has no afterlight-*.tar.xz; run make package"
# The mounts below end with this process.
if [ -z "${INSIDE_TEST_PACKAGE:-}" ]; then
	export INSIDE_TEST_PACKAGE=yes
	exec unshare --mount --propagation private "$0" "$@"
fi

work=$(mktemp -d)
shots=$packages/tested
rm -rf "$shots"
mkdir -p "$shots"
server=""
studio=""
end() {
	[ -z "$studio" ] || kill "$studio" 2>/dev/null || true
	[ -z "$server" ] || kill "$server" 2>/dev/null || true
	umount "$work"/*/proc "$work"/*/tmp/.X11-unix 2>/dev/null || true
	rm -rf --one-file-system "$work"
}
trap end EXIT
trap 'exit 1' INT TERM

# The mirror and the proxy that this system's apt uses.
# shellcheck disable=SC2016 # apt's own variables.
mirror=$(apt-get indextargets --format '$(SITE) $(ORIGIN) $(LABEL)' 'Created-By: Packages' |
	sed -n 's/ Debian Debian$//p' | head -n 1)
[ -n "$mirror" ] || fail "apt's sources name no mirror of Debian"
base=$(dirname "$packages")/fresh-$suite.tar
if ! [ -f "$base" ]; then
	echo "Making a fresh Debian $suite"
	debootstrap --variant=minbase "$suite" "$work/base" "$mirror" >"$work/log" 2>&1 || {
		tail -n 20 "$work/log" >&2
		fail "debootstrap could not make a fresh Debian $suite of $mirror"
	}
	tar -C "$work/base" -cf "$base.part" .
	mv "$base.part" "$base"
	rm -rf "$work/base"
fi

# A fresh system in $root, with its own user.
fresh() {
	root=$work/$1
	mkdir "$root"
	tar -C "$root" -xf "$base"
	cp /etc/resolv.conf /etc/hosts "$root/etc/"
	echo "deb $mirror $suite main" >"$root/etc/apt/sources.list"
	apt-config dump | grep -i '^Acquire::.*::Proxy' >"$root/etc/apt/apt.conf.d/90proxy" || true
	mount -t proc proc "$root/proc"
	mkdir -p "$root/tmp/.X11-unix" "$root/packages"
	mount --bind /tmp/.X11-unix "$root/tmp/.X11-unix"
	chroot "$root" useradd --create-home person
	for tool in cargo rustc gcc; do
		! chroot "$root" sh -c "command -v $tool" || fail "the fresh system has $tool"
	done
	in_root apt-get update -qq
}
in_root() {
	chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@" \
		>"$work/log" 2>&1 || {
		tail -n 30 "$work/log" >&2
		fail "$* failed"
	}
}
install() {
	in_root apt-get install -y -qq --no-install-recommends "$@"
}
# Runs a command as that user, in the home folder.
become() {
	exec chroot --userspec=person:person "$root" env -i PATH=/usr/bin:/bin HOME=/home/person LC_ALL=C.UTF-8 \
		DISPLAY="$display" sh -c 'cd && exec "$@"' sh "$@"
}
as_person() {
	(become "$@")
}
# Runs it; what it printed is in $work/printed.
run() {
	as_person "$@" >"$work/printed" 2>&1 || {
		tail -n 30 "$work/printed" >&2
		fail "$* failed"
	}
	! grep -E 'panicked|XDG_RUNTIME_DIR|error while loading' "$work/printed" || fail "$* printed that"
	echo "  $*"
}

# Opens the studio with $1 on a project and looks at it. $2 names the picture.
window() {
	become "$1" studio demo/project >"$work/studio" 2>&1 &
	studio=$!
	picture=$shots/$2.png
	for _ in $(seq 60); do
		sleep 1
		kill -0 "$studio" 2>/dev/null || {
			cat "$work/studio" >&2
			fail "the studio ended by itself"
		}
		import -display "$display" -window root "$picture"
		# An undrawn window has a single colour.
		[ "$(identify -format %k "$picture")" -le 200 ] || break
	done
	[ "$(identify -format %k "$picture")" -gt 200 ] || fail "$picture shows no window after a minute"
	# Until the first picture is lit, and a little longer.
	sleep 10
	kill -0 "$studio" || fail "the studio ended by itself"
	import -display "$display" -window root "$picture"
	kill "$studio"
	wait "$studio" 2>/dev/null || true
	studio=""
	! grep -E 'panicked|XDG_RUNTIME_DIR' "$work/studio" || fail "the studio printed that"
	echo "  $1 studio demo/project: $picture"
}

Xvfb -displayfd 3 -screen 0 1280x800x24 -nolisten tcp -ac 3>"$work/display" 2>/dev/null &
server=$!
for _ in $(seq 50); do
	[ -s "$work/display" ] && break
	sleep 0.2
done
[ -s "$work/display" ] || fail "Xvfb did not start"
display=:$(cat "$work/display")

echo "The .deb on Debian $suite, with nothing but what it depends on:"
fresh deb
cp "$deb" "$root/packages/"
install "/packages/$(basename "$deb")"
run afterlight --version
run afterlight stage shoot --size 64 --frames 4 --lamps 16
run afterlight import film --shoot shoot --size 64
run afterlight calibrate film
echo "With a driver and ffmpeg, as it recommends:"
install mesa-vulkan-drivers ffmpeg
run afterlight demo --prepare
run afterlight relight demo/project --environment nave --frames 1-3 --to clip.mp4
[ "$(wc -c <"$root/home/person/clip.mp4")" -gt 1000 ] || fail "clip.mp4 is empty"
run afterlight relight demo/project --environment nave --frames 1-1 --device gpu --to still.%04d.png
window afterlight deb
echo "How the desktop sees it:"
install desktop-file-utils shared-mime-info libglib2.0-bin
in_root desktop-file-validate /usr/share/applications/afterlight.desktop
kind() {
	as_person gio info -a standard::content-type "$1" | sed -n 's/.*content-type: //p'
}
[ "$(kind demo/project/project.toml)" = application/x-afterlight-project ] || fail "a project is a $(kind demo/project/project.toml)"
mkdir "$root/home/person/other"
printf '[project]\nname = "other"\n' >"$root/home/person/other/project.toml"
[ "$(kind other/project.toml)" = application/toml ] || fail "another program's project.toml is a $(kind other/project.toml)"
echo "  a project is known by its project.toml, and other files of that name are not taken for one"
in_root apt-get purge -y -qq afterlight
[ -z "$(cd "$root" && find usr etc -path '*afterlight*')" ] || fail "what was installed stays after it was removed"
echo "  removed without a trace"

echo "The tarball on Debian $suite, in a folder of any name:"
fresh tarball
install libvulkan1 mesa-vulkan-drivers libx11-6 libx11-xcb1 libxcb1 libxcursor1 libxi6 libxkbcommon0 libxkbcommon-x11-0 ffmpeg
mkdir "$root/home/person/any where"
tar -C "$root/home/person/any where" -xf "$tarball"
program=$(cd "$root/home/person" && echo "any where"/afterlight-*/bin/afterlight)
run "$program" --version
run "$program" stage shoot --size 64 --frames 4 --lamps 16
run "$program" import film --shoot shoot --size 64
run "$program" calibrate film
run "$program" demo --prepare
window "$program" tarball
echo "Both packages work"
