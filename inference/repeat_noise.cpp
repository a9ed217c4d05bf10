// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/repeat_noise.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <wheelwright/core/check.hpp>
#include <wheelwright/identify/least_squares.hpp>
#include <wheelwright/identify/minimise_scalar.hpp>

namespace wheelwright {
namespace {

constexpr std::size_t kFewest = 50;
constexpr double kGap = 1.5;    // steps
constexpr double kSnap = 0.02;  // steps: shifts this close to a whole number of them are one
constexpr std::size_t kMostForShift = 20000;

// One instant of the first run and where it lies in the second: (1 − w) of row j and w of row j + 1.
struct Match {
  std::size_t row, j;
  double w;
};

class Runs {
 public:
  Runs(LogSource& first, LogSource& second) : first_(read_all(first)), second_(read_all(second)) {
    for (LogTable* log : {&first_, &second_}) {
      if (!log->t.empty()) {
        const double start = log->t.front();
        for (double& t : log->t) {
          t -= start;
        }
      }
    }
    step_ = median_step(first_.t);
    step_of_second_ = median_step(second_.t);
    begins_.assign(second_.rows() + 1, 0);
    for (const std::size_t start : second_.segment_starts) {
      begins_[start] = 1;
    }
  }

  [[nodiscard]] double step() const { return step_; }
  [[nodiscard]] const LogTable& first() const { return first_; }
  [[nodiscard]] const LogTable& second() const { return second_; }

  // Up to `most` instants of the first run that the second covers when its clock is ahead by `shift`.
  [[nodiscard]] std::vector<Match> matches(double shift, std::size_t most) const {
    std::vector<Match> found;
    const auto& t = second_.t;
    std::size_t j = 0;
    const std::size_t stride = std::max<std::size_t>(1, first_.rows() / std::max<std::size_t>(most, 1));
    for (std::size_t row = 0; row < first_.rows(); row += stride) {
      const double time = first_.t[row] + shift;
      while (j + 1 < t.size() && t[j + 1] <= time) {
        ++j;
      }
      const double slack = kSnap * step_of_second_;
      if (j + 1 < t.size() && std::abs(t[j + 1] - time) <= slack) {
        found.push_back({row, j + 1, 0.0});
      } else if (j < t.size() && std::abs(t[j] - time) <= slack) {
        found.push_back({row, j, 0.0});
      } else if (j + 1 < t.size() && t[j] <= time && begins_[j + 1] == 0 && t[j + 1] - t[j] <= kGap * step_of_second_) {
        found.push_back({row, j, (time - t[j]) / (t[j + 1] - t[j])});
      }
    }
    return found;
  }

 private:
  LogTable first_, second_;
  std::vector<char> begins_;
  double step_ = 0.0, step_of_second_ = 0.0;
};

double at(const std::vector<double>& x, const Match& m) {
  return m.w == 0.0 ? x[m.j] : (1.0 - m.w) * x[m.j] + m.w * x[m.j + 1];
}

double variance(const std::vector<double>& x, const std::vector<Match>& matches) {
  double sum = 0.0, squares = 0.0;
  for (const Match& m : matches) {
    sum += x[m.row];
  }
  const double mean = sum / static_cast<double>(matches.size());
  for (const Match& m : matches) {
    squares += (x[m.row] - mean) * (x[m.row] - mean);
  }
  return squares / static_cast<double>(matches.size());
}

// Rms difference of the commands over their spread, of the worst of them; infinite where too little is shared.
double mismatch(const Runs& runs, const std::vector<std::string>& commands, double shift) {
  const auto matches = runs.matches(shift, kMostForShift);
  if (matches.size() < kFewest) {
    return std::numeric_limits<double>::infinity();
  }
  double worst = 0.0;
  for (const auto& name : commands) {
    const auto& a = runs.first().column(name);
    const auto& b = runs.second().column(name);
    double squares = 0.0;
    for (const Match& m : matches) {
      squares += std::pow(a[m.row] - at(b, m), 2.0);
    }
    squares /= static_cast<double>(matches.size());
    const double spread = variance(a, matches);
    worst = std::max(worst, squares == 0.0 ? 0.0
                            : spread > 0.0 ? std::sqrt(squares / spread)
                                           : std::numeric_limits<double>::infinity());
  }
  return worst;
}

struct Alignment {
  double shift = 0.0;
  double mismatch = 0.0;
};

Alignment align(const Runs& runs, const RepeatOptions& options) {
  Alignment best{0.0, mismatch(runs, options.commands, 0.0)};
  const double h = runs.step();
  const auto most = static_cast<long>(options.most_shift / h);
  for (long k = 1; k <= most && best.mismatch > 0.0; ++k) {
    for (const double shift : {static_cast<double>(k) * h, static_cast<double>(-k) * h}) {
      const double value = mismatch(runs, options.commands, shift);
      if (value < best.mismatch) {
        best = {shift, value};
      }
    }
  }
  if (best.mismatch > 0.0 && std::isfinite(best.mismatch)) {
    const ScalarMinimum fine =
        minimise_scalar([&](double shift) { return mismatch(runs, options.commands, shift); }, best.shift - h,
                        best.shift + h, best.shift, {.most_evaluations = 60, .tolerance = 1e-3 * h});
    if (std::abs(fine.x - best.shift) > kSnap * h) {
      best = {fine.x, fine.value};
    }
  }
  return best;
}

RepeatNoise noise_of(const Runs& runs, const std::string& name, const std::vector<Match>& matches,
                     const RepeatOptions& options) {
  const auto& a = runs.first().column(name);
  const auto& b = runs.second().column(name);
  const std::size_t count = matches.size();
  RepeatNoise noise;
  for (const Match& m : matches) {
    noise.offset += (at(b, m) - a[m.row]) / static_cast<double>(count);
  }
  // Differences that have one run's variance, also where the second was interpolated.
  RegressionBlock rows;
  rows.resize(count, 1, 1);
  rows.Y.setZero();
  for (std::size_t k = 0; k < count; ++k) {
    const Match& m = matches[k];
    const double difference = at(b, m) - a[m.row] - noise.offset;
    noise.largest = std::max(noise.largest, std::abs(difference));
    rows.sample[k] = m.row;
    rows.t[k] = runs.first().t[m.row];
    rows.y[static_cast<Eigen::Index>(k)] = difference / std::sqrt(1.0 + m.w * m.w + (1.0 - m.w) * (1.0 - m.w));
  }
  ResidualStatistics statistics(Eigen::VectorXd::Zero(1), Eigen::VectorXd::Ones(1));
  statistics.add(rows);
  const OutputResidual rest = statistics.summary(Eigen::MatrixXd::Identity(1, 1)).outputs[0];
  noise.sd = rest.rms * std::sqrt(static_cast<double>(count) / static_cast<double>(count - 1));
  noise.relative_sd = std::sqrt(2.0 / rest.effective_instants);
  const double spread = variance(a, matches);
  noise.agreement = spread > 0.0 ? 1.0 - noise.sd * noise.sd / spread : 0.0;
  const double squares = rows.y.squaredNorm();
  for (std::size_t lag = 1; lag <= options.lags && lag < count; ++lag) {
    double products = 0.0;
    for (std::size_t k = lag; k < count; ++k) {
      // Rows that are torn apart are no neighbours.
      const bool neighbours = matches[k].row == matches[k - lag].row + lag;
      products += neighbours ? rows.y[static_cast<Eigen::Index>(k)] * rows.y[static_cast<Eigen::Index>(k - lag)] : 0.0;
    }
    noise.autocorrelation.push_back(squares > 0.0 ? products / squares : 0.0);
  }
  const auto fallen = std::find_if(noise.autocorrelation.begin(), noise.autocorrelation.end(),
                                   [](double rho) { return rho < std::exp(-1.0); });
  const auto last = fallen == noise.autocorrelation.end() ? fallen - noise.autocorrelation.begin()
                                                          : fallen - noise.autocorrelation.begin() + 1;
  noise.correlation_time = static_cast<double>(last) * runs.step();
  return noise;
}

}  // namespace

Repeats repeat_noise(LogSource& first, LogSource& second, const std::vector<std::string>& columns,
                     const RepeatOptions& options) {
  check::that(!columns.empty(), "columns", "at least one");
  check::non_negative(options.most_shift, "most_shift");
  check::positive(options.most_mismatch, "most_mismatch");
  check::that(options.least_agreement > 0.0 && options.least_agreement < 1.0, "least_agreement",
              "a number inside (0, 1)");
  check::that(options.lags >= 1, "lags", "at least 1");
  for (const LogSource* log : {&first, &second}) {
    for (const auto* names : {&columns, &options.commands}) {
      for (const auto& name : *names) {
        check::that(log->find(name).has_value(), "log", "a column '" + name + "' in both runs");
      }
    }
  }
  const Runs runs(first, second);
  Repeats result;
  if (runs.first().rows() < kFewest || runs.second().rows() < kFewest) {
    return result;
  }
  if (!options.commands.empty()) {
    const Alignment alignment = align(runs, options);
    result.shift = alignment.shift;
    result.mismatch = alignment.mismatch;
  }
  const auto matches = runs.matches(result.shift, std::numeric_limits<std::size_t>::max());
  result.instants = matches.size();
  if (matches.size() < kFewest) {
    return result;
  }
  double best = 0.0;
  for (const auto& name : columns) {
    result.columns.push_back(noise_of(runs, name, matches, options));
    best = std::max(best, result.columns.back().agreement);
  }
  if (!options.commands.empty()) {
    result.status = result.mismatch <= options.most_mismatch ? RepeatStatus::repeats : RepeatStatus::different_commands;
  } else {
    result.status = best >= options.least_agreement ? RepeatStatus::repeats : RepeatStatus::different_motion;
  }
  return result;
}

}  // namespace wheelwright
