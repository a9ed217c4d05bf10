#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Takes away the steps that round outward, one after the other, in a copy of the sources, and expects a test to fail for
# each. Prints a table; exit code 0 where every test passes without a mutation and every mutation is noticed.
#
#   tests/campaigns/mutate_rounding.sh [WORD]      only the mutations whose line has WORD
#
# Left out, since other terms cover the same rounding: γ in the doubt of a vertex (support_walk.cpp, enclose) and in the
# margin of listed ones (polytope.cpp), where the residual or the radius is larger; the last round_up over blocks
# (support_walk.cpp), each of which has 2ε of its value already.
set -eu
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT
cp -r core bounds detector tests "$work"
mkdir "$work/o"
compiler=${CXX:-g++}
command -v ccache >/dev/null && compiler="ccache $compiler"

# compile SOURCE: into o/SOURCE.o, with the flags of the build that matter for rounding.
cat >"$work/compile" <<'END'
case $1 in *avx2*) more=-mavx2 ;; *avx512*) more="-mavx512f -mavx512dq" ;; *) more= ;; esac
$COMPILER -std=c++20 -O1 -DNDEBUG -ffp-contract=off $more -iquote . -isystem /usr/include/eigen3 -c "$1" \
  -o "o/$(echo "$1" | tr / _).o" 2>"o/$(echo "$1" | tr / _).log"
END
# run PROGRAM: builds and runs one of the test programs; 0 passed, 1 failed, 2 does not compile.
run() {
  case $1 in
    interval) sources="tests/core/interval_test.cpp" ;;
    box) sources="tests/bounds/box_rounding_test.cpp" ;;
    bounds) sources="tests/bounds/rounding_test.cpp $library" ;;
    threshold) sources="tests/detector/threshold_test.cpp detector/threshold.cpp $library" ;;
  esac
  objects=
  for source in $sources; do
    [ "o/$(echo "$source" | tr / _).o" -nt "$source" ] || echo "$source"
  done | COMPILER=$compiler xargs -r -n1 -P"$(nproc)" sh ./compile || return 2
  for source in $sources; do objects="$objects o/$(echo "$source" | tr / _).o"; done
  # shellcheck disable=SC2086
  g++ $objects -o program -lgtest_main -lgtest -lfmt -lpthread || return 2
  ./program --gtest_brief=1 >output 2>&1 || return 1
}
cd "$work"
library=$(ls core/*.cpp bounds/*.cpp)
for program in interval box bounds threshold; do
  run "$program" || { echo "without a mutation: $program fails"; cat output o/*.log 2>/dev/null | tail; exit 1; }
done

wrong=0
# A line: test program, file, sed command.
while IFS='|' read -r program file mutation; do
  case "$program|$file|$mutation" in *"${1:-}"*) ;; *) continue ;; esac
  cp "$file" original
  sed -i "$mutation" "$file"
  if cmp -s "$file" original; then
    seen="NOTHING CHANGES"
    wrong=1
  else
    # A header is compiled into the test alone.
    case $file in *.hpp) rm -f o/tests_* ;; esac
    run "$program" && status=0 || status=$?
    case $status in
      0) seen="NOT NOTICED" wrong=1 ;;
      1) seen=$(sed -n 's/^\[  FAILED  \] \([A-Za-z0-9_.\/]*\).*/\1/p' output | sort -u | tr '\n' ' ') ;;
      *) seen="DOES NOT COMPILE" wrong=1 ;;
    esac
  fi
  printf '%s: %s\n    %s\n' "$file" "$mutation" "$seen"
  cp original "$file"
  case $file in *.hpp) rm -f o/tests_* ;; esac
done <<'END'
interval|core/interval.hpp|s/round_down(x.lower + y.lower)/x.lower + y.lower/
interval|core/interval.hpp|s/round_up(x.upper + y.upper)/x.upper + y.upper/
interval|core/interval.hpp|s/round_down(x.lower - y.upper)/x.lower - y.upper/
interval|core/interval.hpp|s/round_up(x.upper - y.lower)/x.upper - y.lower/
interval|core/interval.hpp|s/round_down(std::min({a, b, c, d}))/std::min({a, b, c, d})/
interval|core/interval.hpp|s/round_up(std::max({a, b, c, d}))/std::max({a, b, c, d})/
interval|core/interval.hpp|s/return round_up(upper - lower)/return upper - lower/
interval|core/interval.hpp|s/\(round_up(double x) { return \)std::nextafter(x, std/\10.0 * x + x; std/;s/x; std.*/x; }/
box|bounds/box.hpp|s/4.0 \* (p + 1.0) \* epsilon \* magnitude/0.0/
box|bounds/box.hpp|s/2.0 \* p \* std::numeric_limits<double>::min()/0.0/
bounds|bounds/certificate.cpp|s/return Quad(nearest) < x ? round_up(nearest) : nearest/return nearest/
bounds|bounds/certificate.cpp|s/low = rest.lower(), high = rest.upper()/low = rest.upper() - rest.error(), high = low/
bounds|bounds/certificate.cpp|s/if (low != 0 || high != 0)/if (false)/
bounds|bounds/slab_rows.cpp|s/> 0.0 ? round_up(sum) : sum/> 0.0 ? sum : sum/
bounds|bounds/slab_rows.cpp|s/add_up(half_space.b, round_up(coefficient.width() \* magnitude_\[k\]))/half_space.b/
bounds|bounds/slab_rows.cpp|s/sign_\[k\] > 0.0 ? add_down(Y\[k\], -dY\[k\])/sign_[k] > 0.0 ? Y[k] - dY[k]/
bounds|bounds/slab_rows.cpp|s/: add_up(Y\[k\], dY\[k\])/: Y[k] + dY[k]/
bounds|bounds/polytope.cpp|s/total = bound == 0.0 ? total : round_up(total + bound)/total += bound/
bounds|bounds/polytope.cpp|s/round_up(best + round_up(margin \* (1.0 + 64.0 \* kEpsilon)))/best/
bounds|bounds/polytope.cpp|s/sum = round_up(sum + round_up(\(a.*\)));/sum += \1;/
bounds|bounds/support_table.cpp|s/slack += std::abs(a_\[k\]) \* doubt\[k\]/slack += 0.0/
bounds|bounds/support_table.cpp|s/slack += cost/slack += 0.0/
bounds|bounds/support_table.cpp|s/(p + 2.0) \* kEpsilon \* magnitude/0.0/
bounds|bounds/support_table.cpp|s/ + kTiny));/));/
bounds|bounds/support_walk.cpp|s/doubt += std::abs(a\[k\]) \* v.doubt\[k\]/doubt += 0.0/
bounds|bounds/support_walk.cpp|s/(cost + doubt) \*/doubt */
bounds|bounds/support_walk.cpp|s/2.0 \* kEpsilon \* std::abs(value) + kTiny/0.0/
threshold|detector/threshold.cpp|s/const double rounding = .*/const double rounding = 0.0;/
threshold|detector/threshold.cpp|s/magnitude += std::abs(term)/magnitude += 0.0/
threshold|detector/threshold.cpp|s/magnitude += extra + 2.0 \* reach/magnitude += 0.0/
threshold|detector/threshold.cpp|s/extra - rounding, above/extra, above/
threshold|detector/threshold.cpp|s/extra + rounding}/extra}/
END
exit "$wrong"
