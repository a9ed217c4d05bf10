#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Builds the documentation site in build/docs/html: pages by Sphinx, the C++ reference by Doxygen, the commands from
# the program's own help. Warnings and links that lead nowhere are errors; nothing is fetched from the network.
#
#   tools/docs.sh [--built]      --built: nothing is installed or built, build/bin/wheelwright is taken as it stands
set -eu
cd "$(dirname "$0")/.."
if [ "${1:-}" != --built ]; then
  tools/setup.sh --docs
  tools/build.sh release wheelwright
fi
program=${WHEELWRIGHT_PROGRAM:-$PWD/build/bin/wheelwright}
site=$PWD/build/docs
rm -rf "$site"
mkdir -p "$site/source/made" "$site/source/extra"
WHEELWRIGHT_VERSION=$(sed -n 's/^project(Wheelwright VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
WHEELWRIGHT_EXTRA=$site/source/extra
export WHEELWRIGHT_VERSION WHEELWRIGHT_EXTRA

folders='core model bounds identify detector commission gap study formats results'
{
  cat docs/site/Doxyfile
  echo "PROJECT_NUMBER = $WHEELWRIGHT_VERSION"
  echo "INPUT = $folders"
  echo "OUTPUT_DIRECTORY = $site/source/extra"
  echo "GENERATE_TAGFILE = $site/tags.xml"
} > "$site/Doxyfile"
doxygen "$site/Doxyfile"

# The pages see the repository as it is, so that their links work here and there.
ln -s "$PWD/docs" "$site/source/docs"
ln -s "$PWD/examples" "$site/source/examples"
cp docs/site/index.md "$site/source/"
python3 tools/docs_pages.py "$program" "$site/tags.xml" "$site/source/made"
sphinx-build -W --keep-going -q -b html -d "$site/doctrees" -c docs/site "$site/source" "$site/html"
python3 tools/docs_pages.py --check "$site/html"
echo "docs: build/docs/html/index.html"
