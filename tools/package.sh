#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Makes the Debian packages (wheelwright, libwheelwright-dev, python3-wheelwright) of the release build, and lets
# lintian look at them: an error of its is one here.
#
#   tools/package.sh [--built] [DIRECTORY]
#
# DIRECTORY (build/packages) gets the packages. --built: nothing is installed or built, build/ is packed as it stands.
# Whoever gives packages to others configures with -DWHEELWRIGHT_MAINTAINER="Name <address>" first.
set -eu
cd "$(dirname "$0")/.."
built=''
if [ "${1:-}" = --built ]; then
  built=yes
  shift
fi
out=${1:-build/packages}

# The same sources make the same packages: dates are those of the last commit.
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct 2>/dev/null || date +%s)
export SOURCE_DATE_EPOCH
if [ -z "$built" ]; then
  tools/setup.sh --packages
  tools/build.sh release packaged
  cmake build >/dev/null
fi
mkdir -p "$out"
rm -f "$out"/*.deb
out=$(cd "$out" && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cpack --config build/CPackConfig.cmake -B "$scratch" >"$scratch/log" || { cat "$scratch/log" >&2; exit 1; }
mv "$scratch"/*.deb "$out"

tools/check_elf.py "$out"/*.deb

# The address is whoever's who packs, and this is no upload to Debian.
as_root=''
[ "$(id -u)" -ne 0 ] || as_root=--allow-root
suppressed=bogus-mail-host,bogus-mail-host-in-debian-changelog,initial-upload-closes-no-bugs
lintian $as_root --fail-on error --suppress-tags "$suppressed" "$out"/*.deb
ls -l "$out"
