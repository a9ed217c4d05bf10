#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Installs the Debian packages with apt in a Debian that has nothing of them, so that what they do not declare is
# missing, and uses them as a stranger would. Run as root, with debootstrap installed.
#
#   tools/check_package.sh ROOT [PACKAGES]
#
# ROOT gets the Debian (tools/fresh_root.sh makes it); PACKAGES (build/packages) is where tools/package.sh put the
# packages.
set -eu
root=${1:?usage: tools/check_package.sh ROOT [PACKAGES]}
cd "$(dirname "$0")/.."
packages=${2:-build/packages}
ls "$packages"/wheelwright_*.deb "$packages"/libwheelwright-dev_*.deb >/dev/null

mkdir -p "$root"
rm -rf "$root/packages"
mkdir "$root/packages"
cp "$packages"/*.deb "$root/packages/"
cat > "$root/packages/CMakeLists.txt" <<'END'
cmake_minimum_required(VERSION 3.25)
project(Stranger LANGUAGES CXX)
find_package(Wheelwright 0.1 REQUIRED COMPONENTS results)
add_executable(stranger stranger.cpp)
target_link_libraries(stranger PRIVATE Wheelwright::results)
END
cat > "$root/packages/stranger.cpp" <<'END'
#include <wheelwright/results/model_file.hpp>
int main(int, char** words) { return wheelwright::read_model(words[1]).model.n() == 2 ? 0 : 1; }
END
cat > "$root/packages/check.sh" <<'END'
set -eu
export DEBIAN_FRONTEND=noninteractive
cd /packages
step() { echo "package: $*"; }
install() { apt-get install -y -qq --no-install-recommends "$@" >/dev/null; }
apt-get purge -y -qq wheelwright libwheelwright-dev python3-wheelwright >/dev/null 2>&1 || true
apt-get update -qq

step "the program, from a directory of the user's own"
install ./wheelwright_*.deb
wheelwright --version
examples=/usr/share/doc/wheelwright/examples
wheelwright commission $examples/healthy.csv.gz --robot $examples/robot.yaml --out first
[ -s first/model.json ] && [ -s first/report.html ]
grep -q "The MIT License" first/report.html
wheelwright simulate $examples/scenarios/fault.yaml --out fault.csv
status=0
wheelwright detect fault.csv --model first/model.json --out second --quiet >/dev/null || status=$?
[ $status -eq 1 ] || { echo "package: the fault was not found (exit code $status)" >&2; exit 1; }
[ -e /usr/share/man/man1/wheelwright.1.gz ]
[ -s /usr/share/doc/wheelwright/copyright ]

if ls python3-wheelwright_*.deb >/dev/null 2>&1; then
  step "the Python module"
  install ./python3-wheelwright_*.deb
  python3 -c "
import wheelwright as ww
assert ww.__file__.startswith('/usr/lib/python3/dist-packages/')
log = ww.read_log('fault.csv', ww.read_robot('$examples/robot.yaml'))
run = ww.Detector(ww.read_model('first/model.json')).run(log)
assert run.events
print(len(run.events), 'events')"
fi

step "a project that uses the library"
install ./libwheelwright-dev_*.deb g++ cmake make
cmake -S . -B consumer >/dev/null
cmake --build consumer >/dev/null
consumer/stranger first/model.json

step "nothing is left when they go"
apt-get purge -y -qq wheelwright libwheelwright-dev >/dev/null
if dpkg -s python3-wheelwright >/dev/null 2>&1; then apt-get purge -y -qq python3-wheelwright >/dev/null; fi
left=$(find /usr /etc /var/lib/python -name '*wheelwright*' 2>/dev/null || true)
[ -z "$left" ] || { echo "package: left behind: $left" >&2; exit 1; }
step "all well"
END
tools/fresh_root.sh "$root" 'sh /packages/check.sh'
