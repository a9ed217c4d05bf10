// SPDX-License-Identifier: Apache-2.0
#include "commission/watch/blind_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.hpp"

namespace wheelwright::commission {
namespace {

constexpr double kOfSettling = 1.5;
constexpr double kFewestRows = 20.0;
constexpr double kShareOfAStep = 0.01;

}  // namespace

bool hardly_goes_on(double step, double nominal) { return step < kShareOfAStep * nominal; }

BlindWatch::BlindWatch(double step, double settling)
    : step_(step), longest_(std::max(kOfSettling * settling, kFewestRows * step)) {
  check::non_negative(step, "step");
  check::non_negative(settling, "settling");
}

bool BlindWatch::crawls(double t) const { return last_ && t >= *last_ && hardly_goes_on(t - *last_, step_); }

std::optional<BlindSpell> BlindWatch::decided(double t) {
  last_ = t;
  const BlindSpell ended = std::exchange(spell_, {.since = t});
  first_.reset();
  return std::exchange(told_, false) ? std::optional(ended) : std::nullopt;
}

std::optional<BlindSpell> BlindWatch::undecided(std::optional<double> t) {
  ++spell_.rows;
  first_ = first_ ? first_ : t;
  spell_.seconds = std::max(spell_.seconds, step_ * static_cast<double>(spell_.rows));
  if (t) {
    last_ = t;
    spell_.seconds = std::max(spell_.seconds, std::abs(*t - *first_));
  }
  if (told_ || !(spell_.seconds > longest_)) {
    return std::nullopt;
  }
  told_ = true;
  return spell_;
}

}  // namespace wheelwright::commission
