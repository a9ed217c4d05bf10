#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Installs what is asked for and is not there yet. The second run does nothing.
#
#   tools/setup.sh program  Debian packages for the program, and uPlot from npm
#   tools/setup.sh          the same and what tests, benchmarks, Python and the independent world need
#   tools/setup.sh --ci     the same and clang-format, clang-tidy and clang, which continuous integration uses, and what
#   some
#                           tests need that are skipped elsewhere: a browser, shells, man, matplotlib, … (half a minute,
#                           nearly all of it Chromium's)
#   tools/setup.sh --fuzz   the same as without and clang with its run-time libraries
#   tools/setup.sh --docs, tools/setup.sh --packages
#                           the same as without and what tools/docs.sh, tools/package.sh and tools/check_package.sh need
#
# tools/setup.sh --list [program | --ci | ...] names these Debian packages, one a line, and installs nothing.
set -eu
cd "$(dirname "$0")/.."

packages="g++ cmake ninja-build pkg-config
  libeigen3-dev libfmt-dev libyaml-cpp-dev nlohmann-json3-dev zlib1g-dev libzstd-dev liblz4-dev libxxhash-dev libboost-dev
  libsqlite3-dev libfastcdr-dev libhdf5-dev libtinyxml2-dev
  libceres-dev libnlopt-cxx-dev libnlopt-dev libtbb-dev
  libcli11-dev"
everything="libopenmpi-dev openmpi-bin
  libgtest-dev libgmock-dev librapidcheck-dev python3-jsonschema
  libbenchmark-dev coinor-libclp-dev libglpk-dev liblapack-dev libqsopt-ex-dev libmujoco-dev
  pybind11-dev python3 python3-dev python3-numpy python3-pandas"
list=''
if [ "${1:-}" = --list ]; then
  list=yes
  shift
fi
case "${1:-}" in
  program) everything= ;;
  '') ;;
  --ci) everything="$everything clang clang-format clang-tidy python3-mypy python3-matplotlib python3-dask
    chromium zsh fish man-db groff-base systemd" ;;
  --fuzz) everything="$everything clang-14 libclang-rt-14-dev" ;;
  --docs) everything="$everything python3-sphinx python3-myst-parser python3-sphinxcontrib.bibtex doxygen graphviz" ;;
  --packages) everything="$everything dpkg-dev file fakeroot lintian debootstrap" ;;
  *) echo "usage: tools/setup.sh [--list] [program | --ci | --fuzz | --docs | --packages]" >&2; exit 2 ;;
esac
packages="$packages $everything"
if [ -n "$list" ]; then
  # shellcheck disable=SC2086
  printf '%s\n' $packages
  exit 0
fi

# install PACKAGE...: the ones that dpkg does not have.
install() {
  missing=''
  for package in "$@"; do
    if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" != installed ]; then
      missing="$missing $package"
    fi
  done
  [ -n "$missing" ] || return 0
  sudo=''
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      echo "setup: these packages are missing, and neither root nor sudo is here to install them:$missing" >&2
      exit 1
    fi
    sudo=sudo
  fi
  echo "setup: installing from Debian:$missing"
  $sudo apt-get update -qq
  # shellcheck disable=SC2086
  $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
}

if ! command -v apt-get >/dev/null; then
  echo "setup: this system has no apt-get; the packages needed are, by their Debian names:" >&2
  # shellcheck disable=SC2086
  echo $packages curl openssl >&2
  exit 1
fi
# shellcheck disable=SC2086
install $packages

# uPlot draws the time series of the report. npm checks it against package-lock.json; where there is no npm, which would
# bring three hundred packages, its registry's archive is fetched and checked the same way.
cd results/report
if ! cmp -s package-lock.json node_modules/.wheelwright-lock; then
  echo "setup: fetching uPlot from npm's registry"
  if command -v npm >/dev/null; then
    npm ci --silent --no-audit --no-fund --ignore-scripts
  else
    install ca-certificates curl openssl
    version=$(sed -n 's/^ *"uplot": "\([^"]*\)".*/\1/p' package-lock.json)
    integrity=$(sed -n 's/^ *"integrity": "sha512-\([^"]*\)".*/\1/p' package-lock.json)
    rm -rf node_modules
    mkdir -p node_modules/uplot
    archive=node_modules/uplot.tgz
    curl -fsSL --retry 3 -o "$archive" \
      "${NPM_CONFIG_REGISTRY:-https://registry.npmjs.org}/uplot/-/uplot-$version.tgz"
    if [ "$(openssl dgst -sha512 -binary "$archive" | openssl base64 -A)" != "$integrity" ]; then
      rm -rf node_modules
      echo "setup: uplot-$version.tgz is not what package-lock.json says" >&2
      exit 1
    fi
    tar -xzf "$archive" -C node_modules/uplot --strip-components=1
    rm "$archive"
  fi
  cp package-lock.json node_modules/.wheelwright-lock
fi
