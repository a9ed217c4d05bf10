#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Runs commands of this repository in a Debian 12 that has nothing installed but git and a shell. Run as root, with
# debootstrap installed.
#
#   tools/fresh_root.sh DIRECTORY [COMMAND...]
#
# DIRECTORY gets the Debian (made when it is not there) and, in it, a fresh clone of the last commit at /wheelwright.
# COMMAND is run there by sh; without one: ./examples/commission.sh && ./tests/run.sh. What this machine needs to reach
# its package registries (apt's and npm's configuration, certificates, proxy and certificate variables) is copied.
# Further environment: SUITE (bookworm), MIRROR (http://deb.debian.org/debian).
set -eu
# What is mounted into DIRECTORY is gone with this process, however it ends: who removes DIRECTORY then removes nothing
# of this machine.
if [ "${FRESH_ROOT_ALONE:-}" != yes ]; then
  exec unshare --mount --propagation private env FRESH_ROOT_ALONE=yes "$0" "$@"
fi
root=${1:?usage: tools/fresh_root.sh DIRECTORY [COMMAND...]}
shift
command=${*:-'./examples/commission.sh && ./tests/run.sh'}
source=$(cd "$(dirname "$0")/.." && pwd)
suite=${SUITE:-bookworm}
mirror=${MIRROR:-http://deb.debian.org/debian}

if [ ! -e "$root/etc/debian_version" ]; then
  echo "fresh root: Debian $suite into $root"
  debootstrap --variant=minbase "$suite" "$root" "$mirror" >/dev/null
fi
root=$(cd "$root" && pwd)

# How this machine reaches its registries, in place of what debootstrap wrote.
rm -f "$root/etc/apt/sources.list"
cp -a /etc/resolv.conf /etc/hosts "$root/etc/" 2>/dev/null || true
for path in /etc/apt/sources.list /etc/apt/sources.list.d /etc/apt/apt.conf /etc/apt/apt.conf.d /etc/apt/trusted.gpg.d \
    /etc/apt/keyrings /usr/share/keyrings /usr/local/share/ca-certificates /etc/ssl/certs /usr/share/ca-certificates; do
  if [ -e "$path" ]; then
    mkdir -p "$root$path" 2>/dev/null || true
    if [ -d "$path" ]; then cp -a "$path/." "$root$path/"; else rmdir "$root$path"; cp -a "$path" "$root$path"; fi
  fi
done
rm -f "$root"/etc/apt/apt.conf.d/docker-gzip-indexes

for what in proc dev dev/pts; do
  if ! mountpoint -q "$root/$what"; then
    case $what in
      proc) mount -t proc proc "$root/proc" ;;
      *) mount --bind "/$what" "$root/$what" ;;
    esac
  fi
done

# The variables that say how to reach the network, and none other.
passed='https?_proxy|no_proxy|all_proxy|NODE_EXTRA_CA_CERTS|SSL_CERT_FILE|SSL_CERT_DIR|npm_config_[a-z_]+'
variables=$(env | grep -iE "^($passed)=" || true)
inside() {
  # shellcheck disable=SC2086
  env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 $variables \
    chroot "$root" /bin/sh -c "$1"
}

inside 'command -v git >/dev/null || { apt-get update -qq &&
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends git >/dev/null; }'
echo "fresh root: cloning $(git -C "$source" rev-parse --short HEAD)"
rm -rf "$root/wheelwright" "$root/source.git"
git clone -q --bare "$source" "$root/source.git"
inside 'git clone -q /source.git /wheelwright'
echo "fresh root: $command"
inside "cd /wheelwright && $command"
