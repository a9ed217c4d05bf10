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
constexpr double kShareOfLog = 0.2;    // of the longest segment that a filter may take to settle or to answer

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
  [[nodiscard]] double criterion() const {
    if (instants_ < 50) {
      return std::numeric_limits<double>::infinity();
    }
    double log_sum = 0.0;
    for (const LeastSquares& fit : fits_) {
      const LeastSquaresFit f = fit.solve();
      const double share = f.weighted_tss > 0.0 ? f.weighted_rss / f.weighted_tss : 1.0;
      log_sum += 0.5 * std::log(std::max(share, 1e-24));
    }
    return std::exp(log_sum / static_cast<double>(fits_.size()));
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
  double best = std::numeric_limits<double>::infinity();
  for (const Trial& trial : trials) {
    choice.curve.push_back({trial.design(), trial.criterion()});
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
