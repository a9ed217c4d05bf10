#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Whether every C++ file is as clang-format 14 writes it; --fix rewrites those that are not. Files may be named.
set -eu
cd "$(dirname "$0")/.."
fix=''
if [ "${1:-}" = --fix ]; then
  fix=yes
  shift
fi
clang_format=$(command -v clang-format-14 || command -v clang-format) || {
  echo "format: clang-format is missing; tools/setup.sh --ci installs it" >&2
  exit 2
}
if [ $# -eq 0 ]; then
  # shellcheck disable=SC2046
  set -- $(git ls-files -co --exclude-standard '*.hpp' '*.cpp')
fi
if [ -n "$fix" ]; then
  exec "$clang_format" -i "$@"
fi
# A hundred files a call: most of the time of a call for one is its start.
if printf '%s\n' "$@" | xargs -n 100 -P "$(nproc 2>/dev/null || echo 2)" "$clang_format" --dry-run -Werror; then
  echo "format: $# files, nothing to report"
else
  echo "format: tools/check_format.sh --fix rewrites them"
  exit 1
fi
