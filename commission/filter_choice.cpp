// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/filter_choice.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <wheelwright/core/check.hpp>
#include <wheelwright/filter/regression_stream.hpp>
#include <wheelwright/identify/least_squares.hpp>

namespace wheelwright {
namespace {

constexpr std::array kBetas{2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 14.0, 20.0, 30.0, 40.0, 60.0, 80.0, 120.0, 200.0};
constexpr double kMostBetaStep = 0.5;
constexpr std::size_t kFewestInstants = 50;
constexpr double kExplained = 0.5;   // of the torque: an output with more residual than this carries no information
constexpr double kShareOfLog = 0.2;  // of the longest segment that a filter may take to settle or to answer

// One candidate's filter with a fit for each output.
class Trial {
 public:
  Trial(const Model& model, const Measurement& measurement, const FilterDesign& design)
      : filter_(model, design, measurement), fits_(model.n(), LeastSquares(model.p())) {
    row_.resize(1, 1, model.p());
  }
  void restart() { filter_.restart(); }
  void step(double t, const std::vector<double>& sample) {
    if (!filter_.step(t, sample)) {
      return;
    }
    for (std::size_t i = 0; i < fits_.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      row_.Y.row(0) = filter_.row().Y.row(at);
      row_.y[0] = filter_.row().y[at];
      fits_[i].add(row_);
    }
    ++instants_;
  }
  // Residual rms over torque rms of each output.
  [[nodiscard]] std::vector<double> noise() const {
    std::vector<double> shares;
    for (const LeastSquares& fit : fits_) {
      double share = 1.0;
      if (instants_ >= kFewestInstants) {
        const LeastSquaresFit f = fit.solve();
        share = f.weighted_tss > 0.0 ? std::sqrt(f.weighted_rss / f.weighted_tss) : 1.0;
      }
      shares.push_back(std::max(share, 1e-12));
    }
    return shares;
  }
  [[nodiscard]] const FilterDesign& design() const { return filter_.design(); }

 private:
  RegressorFilter filter_;
  std::vector<LeastSquares> fits_;
  RegressionBlock row_;
  std::size_t instants_ = 0;
};

}  // namespace

FilterChoice choose_filter(LogSource& log, const Model& model, const Measurement& measurement, int order,
                           const Survey& survey, const FilterChoiceOptions& options) {
  check::positive(options.longest_delay, "longest_delay");
  check::that(options.tolerance >= 1.0, "tolerance", "at least 1");
  // Measured speeds need no settling; three time constants are what it takes to see a step.
  const double memory = measurement.motion == MotionKind::speed ? 3.0 : FilterDesign{}.settle;
  const double slowest = std::max(order / options.longest_delay, memory / (kShareOfLog * survey.longest_segment));
  const double fastest = kMostBetaStep / survey.median_step;
  std::vector<Trial> trials;
  for (const double beta : kBetas) {
    if (beta >= slowest * (1.0 - 1e-9) && beta <= fastest) {
      trials.emplace_back(model, measurement, FilterDesign{.order = order, .alpha = beta, .beta = beta});
    }
  }
  FilterChoice choice;
  if (trials.empty()) {
    const double beta = std::min(slowest, fastest);
    choice.design = {.order = order, .alpha = beta, .beta = beta};
    return choice;
  }
  std::vector<std::size_t> pick;
  for (const auto& name : measurement.columns()) {
    pick.push_back(*log.find(name));
  }
  std::vector<double> sample(pick.size());
  log.rewind();
  LogBlock block;
  while (log.next(block)) {
    std::size_t segment = 0;
    for (std::size_t k = 0; k < block.rows(); ++k) {
      if (segment < block.segment_starts.size() && block.segment_starts[segment] == k) {
        ++segment;
        for (Trial& trial : trials) {
          trial.restart();
        }
      }
      for (std::size_t c = 0; c < pick.size(); ++c) {
        sample[c] = block.columns[pick[c]][k];
      }
      for (Trial& trial : trials) {
        trial.step(block.t[k], sample);
      }
    }
  }
  log.rewind();
  std::vector<std::vector<double>> noise;
  std::vector<double> least(model.n(), 1.0);
  for (const Trial& trial : trials) {
    noise.push_back(trial.noise());
    for (std::size_t i = 0; i < least.size(); ++i) {
      least[i] = std::min(least[i], noise.back()[i]);
    }
  }
  const bool any_explained = std::ranges::any_of(least, [](double share) { return share < kExplained; });
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < trials.size(); ++k) {
    double log_sum = 0.0;
    double outputs = 0.0;
    for (std::size_t i = 0; i < least.size(); ++i) {
      if (least[i] < kExplained || !any_explained) {
        log_sum += std::log(noise[k][i]);
        outputs += 1.0;
      }
    }
    choice.curve.push_back({trials[k].design(), std::exp(log_sum / outputs)});
    best = std::min(best, choice.curve.back().criterion);
  }
  choice.design = trials.front().design();
  for (const FilterCandidate& candidate : choice.curve) {
    if (candidate.criterion <= options.tolerance * best) {
      choice.design = candidate.design;
    }
  }
  return choice;
}

}  // namespace wheelwright
