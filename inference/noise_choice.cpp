// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/noise_choice.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/statistics.hpp>

namespace wheelwright::inference {

ErrorBound bound_of_sd(double sd, double relative_sd, const ErrorBoundOptions& options) {
  check::non_negative(sd, "standard deviation");
  check::non_negative(relative_sd, "relative standard error");
  check::that(options.risk > 0.0 && options.risk < 1.0, "risk", "a number inside (0, 1)");
  check::that(options.horizon >= 1.0 && std::isfinite(options.horizon), "horizon", "a number >= 1");
  ErrorBound result;
  result.sd_limit = sd;
  if (relative_sd > 0.0) {
    const double freedom = 2.0 / (relative_sd * relative_sd);
    const double risk = options.law == NoiseLaw::uniform ? options.risk : 0.5 * options.risk;
    result.sd_limit = sd * std::sqrt(freedom / core::chi_squared_quantile(freedom, risk));
  }
  switch (options.law) {
    case NoiseLaw::uniform: result.factor = std::numbers::sqrt3; break;
    case NoiseLaw::gaussian: result.factor = core::normal_upper_quantile(0.25 * options.risk / options.horizon); break;
    case NoiseLaw::any_variance: result.factor = std::sqrt(2.0 * options.horizon / options.risk); break;
  }
  result.bound = result.factor * result.sd_limit;
  return result;
}

namespace {

constexpr double kClearlyLarger = 3.0;

struct Level {
  NoiseMethod method;
  double sd, relative_sd;
};

// Whether a is the larger by more than chance.
bool exceeds(const Level& a, const Level& b) {
  return 2.0 * std::log(a.sd / b.sd) > kClearlyLarger * std::hypot(a.relative_sd, b.relative_sd);
}

std::string_view assumption_of(NoiseMethod method) {
  switch (method) {
    case NoiseMethod::none: break;
    case NoiseMethod::standstill: return "the noise in motion is that at rest";
    case NoiseMethod::differences: return "noise independent from sample to sample";
  }
  return "";
}

NoiseChoice chosen(const Level& level, NoiseMeaning meaning, std::string reason, const ErrorBoundOptions& options) {
  NoiseChoice choice;
  choice.method = level.method;
  choice.meaning = meaning;
  choice.sd = level.sd;
  choice.relative_sd = level.relative_sd;
  choice.bound = bound_of_sd(level.sd, level.relative_sd, options);
  choice.assumption = assumption_of(level.method);
  choice.reason = std::move(reason);
  return choice;
}

}  // namespace

std::string_view to_string(NoiseMethod method) {
  switch (method) {
    case NoiseMethod::none: return "none";
    case NoiseMethod::standstill: return "standstill";
    case NoiseMethod::differences: return "differences";
  }
  return "";
}

NoiseChoice choose_noise(const NoiseEvidence& evidence, const ErrorBoundOptions& options) {
  using Kind = identify::DifferenceNoise::Kind;
  std::optional<Level> rest, differences;
  if (evidence.standstill && evidence.standstill->kind == StandstillNoise::Kind::noisy) {
    rest = Level{NoiseMethod::standstill, evidence.standstill->sd, evidence.standstill->relative_sd};
  }
  const Kind kind = evidence.differences ? evidence.differences->kind : Kind::too_short;
  if (kind == Kind::white || kind == Kind::rough) {
    differences = Level{NoiseMethod::differences, evidence.differences->sd, evidence.differences->relative_sd};
  }
  const auto at_rest = [&](std::string reason, NoiseMeaning meaning) {
    NoiseChoice choice = chosen(*rest, meaning, std::move(reason), options);
    choice.bound.bound = std::max(choice.bound.bound, evidence.standstill->bound.bound);
    return choice;
  };
  if (kind == Kind::white) {
    if (rest && exceeds(*rest, *differences)) {
      return at_rest("standstill shows more than differences do: slow noise, which differences do not see",
                     NoiseMeaning::estimate);
    }
    return chosen(*differences, NoiseMeaning::estimate,
                  fmt::format("differences of orders {} to {} agree, as white noise in motion makes them",
                              evidence.differences->level_from, identify::DifferenceNoise::kOrders),
                  options);
  }
  const std::string_view not_white = kind == Kind::smooth  ? "differences do not settle (fast motion or slow noise)"
                                     : kind == Kind::rough ? "differences grow (differenced angles)"
                                     : kind == Kind::none  ? "differences show nothing"
                                                           : "too few even steps for differences";
  if (rest) {
    return at_rest(fmt::format("{}; there is no second run", not_white), NoiseMeaning::lower_limit);
  }
  if (differences) {
    return chosen(*differences, NoiseMeaning::upper_limit,
                  "differences grow (differenced angles), and there is nothing to compare with", options);
  }
  NoiseChoice nothing;
  const bool constant = evidence.standstill && evidence.standstill->kind == StandstillNoise::Kind::constant;
  nothing.reason = fmt::format("{}{}", not_white, constant ? "; constant at rest, as an encoder is" : "");
  return nothing;
}

}  // namespace wheelwright::inference
