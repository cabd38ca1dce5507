#!/bin/sh
# Builds and packs a release in target/package: a .deb, a tarball that runs from any folder, and the release
# notes. Run by `make package`.
set -eu
for tool in dpkg-deb dpkg-shlibdeps xz; do
	command -v "$tool" >/dev/null 2>&1 && continue
	echo "$tool is missing. On Debian: apt-get install dpkg-dev xz-utils" >&2
	exit 1
done
CARGO=${CARGO:-cargo}
CARGO_DEB=3.8.0
features=keep-autotune
target=${CARGO_TARGET_DIR:-target}
case $target in /*) ;; *) target=$PWD/$target ;; esac
version=$($CARGO pkgid | sed 's/.*[#@]//')
machine=$(rustc -vV | sed -n 's/^host: \([^-]*\)-.*/\1/p')
name=afterlight-$version-$machine-linux
out=$target/package
release=$target/release

rm -rf "$out"
mkdir -p "$out" "$release/package"
tools/release_notes.sh "$version" >"$out/RELEASE-NOTES.md"
cp "$out/RELEASE-NOTES.md" "$release/package/"
CARGO=$CARGO tools/licenses.sh --features "$features" >"$release/package/THIRD-PARTY.txt"

# Keeps this machine's folder names out of the release.
flags=$(printf -- '--remap-path-prefix=%s=crates\037--remap-path-prefix=%s=afterlight' \
	"${CARGO_HOME:-$HOME/.cargo}/registry/src" "$PWD")
# Merges identical generic functions, if Rust links with its own linker.
if [ "$machine" = x86_64 ]; then
	flags=$(printf '%s\037-Clink-arg=-Wl,--icf=all' "$flags")
fi
CARGO_ENCODED_RUSTFLAGS=$flags $CARGO build --locked --release --features "$features"

if ! [ -x "$target/tools/bin/cargo-deb" ]; then
	$CARGO install cargo-deb --locked --version "$CARGO_DEB" --root "$target/tools"
fi
PATH="$target/tools/bin:$PATH" $CARGO deb --locked --no-build --no-strip --output "$out/"

# The .deb's files, by the same table, under one folder.
deb=$(echo "$out"/afterlight_*.deb)
dpkg-deb -x "$deb" "$out/root"
mv "$out/root/usr" "$out/$name"
rmdir "$out/root"
tar -C "$out" --owner=0 --group=0 --sort=name -cJf "$out/$name.tar.xz" "$name"
rm -r "${out:?}/$name"

echo "Packed, in $out:"
for file in "$release/afterlight" "$deb" "$out/$name.tar.xz"; do
	echo "  $(basename "$file"): $(($(wc -c <"$file") / 1000000)) MB"
done
echo "  RELEASE-NOTES.md: what is new"
