// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/noise_levels.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "core/check.hpp"
#include "core/log.hpp"
#include "core/statistics.hpp"
#include "identify/least_squares.hpp"

namespace wheelwright::inference {
namespace {

constexpr double kZero = 1e-9;  // of a command's largest value

// Rows of a stretch that may be a standstill: time, the motion's columns, the measured columns.
struct Stretch {
  std::vector<double> t;
  std::vector<std::vector<double>> motion, values;

  void clear() {
    t.clear();
    for (auto* columns : {&motion, &values}) {
      for (auto& c : *columns) {
        c.clear();
      }
    }
  }
};

double mean(const std::vector<double>& x, std::size_t first, std::size_t last) {
  double sum = 0.0;
  for (std::size_t k = first; k < last; ++k) {
    sum += x[k];
  }
  return sum / static_cast<double>(last - first);
}

class StandstillGathering {
 public:
  StandstillGathering(LogSource& log, const StandstillSigns& signs, const std::vector<std::string>& columns,
                      const StandstillOptions& options)
      : options_(options),
        commands_(core::positions_of(log, signs.commands)),
        by_angle_(signs.speeds.empty() && !signs.angles.empty()),
        motion_(core::positions_of(log, by_angle_ ? signs.angles : signs.speeds)),
        picked_(core::positions_of(log, columns)),
        zero_(commands_.size(), 0.0),
        largest_(motion_.size(), 0.0),
        statistics_(Eigen::VectorXd::Zero(1), Eigen::VectorXd::Ones(static_cast<Eigen::Index>(columns.size()))),
        means_(columns.size()),
        neighbours_(columns.size(), 0.0),
        squares_(columns.size(), 0.0) {
    check::that(!commands_.empty() || !motion_.empty(), "standstill signs", "commands, speeds or angles");
    stretch_.motion.resize(motion_.size());
    stretch_.values.resize(picked_.size());
  }

  // First walk: the largest commands and speeds.
  void size_up(const LogBlock& block, std::size_t k, bool starts) {
    for (std::size_t c = 0; c < commands_.size(); ++c) {
      zero_[c] = std::max(zero_[c], kZero * std::abs(block.columns[commands_[c]][k]));
    }
    before_.resize(motion_.size());
    for (std::size_t m = 0; m < motion_.size(); ++m) {
      const double now = block.columns[motion_[m]][k];
      const double speed = !by_angle_ ? now : starts ? 0.0 : (now - before_[m]) / (block.t[k] - time_before_);
      largest_[m] = std::max(largest_[m], std::abs(speed));
      before_[m] = now;
    }
    time_before_ = block.t[k];
  }

  // Second walk.
  void take(const LogBlock& block, std::size_t k, bool starts) {
    const bool rests = at_rest(block, k);
    if (starts || !rests || (!stretch_.t.empty() && block.t[k] - stretch_.t.front() > options_.piece)) {
      finish();
    }
    // Where an angle leaves its place, another stretch may begin at once.
    if (commanded(block, k) || (!rests && !by_angle_)) {
      return;
    }
    stretch_.t.push_back(block.t[k]);
    for (std::size_t m = 0; m < motion_.size(); ++m) {
      stretch_.motion[m].push_back(block.columns[motion_[m]][k]);
    }
    for (std::size_t c = 0; c < picked_.size(); ++c) {
      stretch_.values[c].push_back(block.columns[picked_[c]][k]);
    }
  }

  void finish() {
    judge();
    stretch_.clear();
  }

  [[nodiscard]] Standstill result() const {
    Standstill out;
    out.columns.resize(picked_.size());
    out.stretches = stretches_;
    out.samples = samples_;
    out.seconds = seconds_;
    const std::string signs = fmt::format("{}{}{}", commands_.empty() ? "" : "commands at zero",
                                          commands_.empty() || motion_.empty() ? "" : ", ",
                                          motion_.empty() ? ""
                                          : by_angle_     ? "angles at rest"
                                                          : "speeds near zero");
    out.recognised = stretches_ > 0 ? fmt::format("{} for at least {} s", signs, options_.least_time)
                                    : fmt::format("no stretch of {} s with {}", options_.least_time, signs);
    if (stretches_ == 0) {
      return out;
    }
    const identify::ResidualSummary summary = statistics_.summary(Eigen::MatrixXd::Identity(1, 1));
    for (std::size_t c = 0; c < picked_.size(); ++c) {
      out.columns[c] = column(c, summary);
    }
    return out;
  }

 private:
  [[nodiscard]] bool commanded(const LogBlock& block, std::size_t k) const {
    for (std::size_t c = 0; c < commands_.size(); ++c) {
      if (std::abs(block.columns[commands_[c]][k]) > zero_[c]) {
        return true;
      }
    }
    return false;
  }

  [[nodiscard]] bool at_rest(const LogBlock& block, std::size_t k) const {
    if (commanded(block, k)) {
      return false;
    }
    for (std::size_t m = 0; m < motion_.size(); ++m) {
      const double now = block.columns[motion_[m]][k];
      // An angle may not leave its place by what the mean speed allows within the shortest stretch.
      if (by_angle_ ? !stretch_.t.empty() &&
                          std::abs(now - stretch_.motion[m].front()) > options_.slow * largest_[m] * options_.least_time
                    : std::abs(now) > options_.near * largest_[m]) {
        return false;
      }
    }
    return true;
  }

  // The stretch without its ends, if it is a standstill, goes into the statistics.
  void judge() {
    if (stretch_.t.empty()) {
      return;
    }
    const auto& t = stretch_.t;
    const auto at = [&](double time) {
      return static_cast<std::size_t>(std::lower_bound(t.begin(), t.end(), time) - t.begin());
    };
    const std::size_t first = at(t.front() + options_.trim);
    const std::size_t last = at(t.back() - options_.trim);
    if (last < first + 8 || t[last - 1] - t[first] < options_.least_time) {
      return;
    }
    const std::size_t middle = (first + last) / 2;
    for (std::size_t m = 0; m < motion_.size() && !by_angle_; ++m) {
      for (const double half : {mean(stretch_.motion[m], first, middle), mean(stretch_.motion[m], middle, last)}) {
        if (std::abs(half) > options_.slow * largest_[m]) {
          return;
        }
      }
    }
    RegressionBlock rows;
    rows.resize(last - first, picked_.size(), 1);
    rows.Y.setZero();
    for (std::size_t c = 0; c < picked_.size(); ++c) {
      const auto& x = stretch_.values[c];
      const double centre = mean(x, first, last);
      means_[c].push_back(centre);
      double before = 0.0;
      for (std::size_t k = first; k < last; ++k) {
        const double deviation = x[k] - centre;
        rows.y[static_cast<Eigen::Index>((k - first) * picked_.size() + c)] = deviation;
        neighbours_[c] += k > first ? deviation * before : 0.0;
        squares_[c] += deviation * deviation;
        before = deviation;
      }
    }
    for (std::size_t k = first; k < last; ++k) {
      rows.sample[k - first] = samples_ + k - first;
      rows.t[k - first] = t[k];
    }
    statistics_.add(rows);
    lengths_.push_back(static_cast<double>(last - first));
    ++stretches_;
    samples_ += last - first;
    seconds_ += t[last - 1] - t[first];
  }

  [[nodiscard]] StandstillNoise column(std::size_t c, const identify::ResidualSummary& summary) const {
    StandstillNoise noise;
    const auto count = static_cast<double>(samples_);
    for (std::size_t s = 0; s < stretches_; ++s) {
      noise.offset += lengths_[s] * means_[c][s] / count;
    }
    for (std::size_t s = 0; s < stretches_ && stretches_ > 1; ++s) {
      noise.offset_spread += std::pow(means_[c][s] - noise.offset, 2.0) / static_cast<double>(stretches_ - 1);
    }
    noise.offset_spread = std::sqrt(noise.offset_spread);
    identify::OutputResidual rest = summary.outputs[c];
    // Rounding of the mean is no noise.
    if (!(rest.largest > 1e-12 * std::abs(noise.offset))) {
      noise.kind = StandstillNoise::Kind::constant;
      return noise;
    }
    noise.kind = StandstillNoise::Kind::noisy;
    // A mean was taken off each stretch: of white noise, one degree of freedom.
    const double unbiased = std::sqrt(count / (count - static_cast<double>(stretches_)));
    rest.rms *= unbiased;
    noise.sd = rest.rms;
    noise.relative_sd = std::sqrt(2.0 / rest.effective_instants);
    noise.correlation = neighbours_[c] / squares_[c];
    noise.largest = rest.largest;
    noise.bound = identify::extrapolate(rest, samples_, options_.extrapolation);
    return noise;
  }

  StandstillOptions options_;
  std::vector<std::size_t> commands_;
  bool by_angle_;
  std::vector<std::size_t> motion_, picked_;
  std::vector<double> zero_, largest_, before_;
  double time_before_ = 0.0;
  Stretch stretch_;
  identify::ResidualStatistics statistics_;
  std::vector<std::vector<double>> means_;
  std::vector<double> lengths_, neighbours_, squares_;
  std::size_t stretches_ = 0, samples_ = 0;
  double seconds_ = 0.0;
};

}  // namespace

StandstillSigns standstill_signs(const LogSource& log, const Model& model) {
  const auto columns = [&](std::string model::Joint::*name) {
    std::vector<std::string> found;
    for (const model::Joint& joint : model.joints) {
      if ((joint.*name).empty() || !log.find(joint.*name)) {
        return std::vector<std::string>{};
      }
      found.push_back(joint.*name);
    }
    return found;
  };
  return {.commands = columns(&model::Joint::command),
          .speeds = columns(&model::Joint::speed),
          .angles = columns(&model::Joint::angle)};
}

Standstill standstill_noise(LogSource& log, const StandstillSigns& signs, const std::vector<std::string>& columns,
                            const StandstillOptions& options) {
  check::positive(options.least_time, "least_time");
  check::non_negative(options.trim, "trim");
  check::positive(options.near, "near");
  check::positive(options.slow, "slow");
  check::that(options.piece >= options.least_time + 2.0 * options.trim, "piece", "a whole stretch with its ends");
  check::that(!columns.empty(), "columns", "at least one");
  StandstillGathering gathering(log, signs, columns, options);
  core::for_each_row(log,
                     [&](const LogBlock& block, std::size_t k, bool starts) { gathering.size_up(block, k, starts); });
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) { gathering.take(block, k, starts); });
  gathering.finish();
  return gathering.result();
}

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
