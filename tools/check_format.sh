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
status=0
for file in "$@"; do
  if ! "$clang_format" "$file" | cmp -s - "$file"; then
    echo "format: $file is not as clang-format writes it"
    status=1
  fi
done
if [ $status -eq 0 ]; then
  echo "format: $# files, nothing to report"
else
  echo "format: tools/check_format.sh --fix rewrites them"
fi
exit $status
