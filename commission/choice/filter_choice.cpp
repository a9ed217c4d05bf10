// SPDX-License-Identifier: Apache-2.0
#include "commission/choice/filter_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "core/check.hpp"
#include "identify/least_squares.hpp"
#include "identify/minimise_scalar.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {
namespace {

constexpr std::array kBetas{2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 14.0, 20.0, 30.0, 40.0, 60.0, 80.0, 120.0, 200.0};
constexpr double kMostBetaStep = 0.5;
constexpr double kBeyond = 1.5;          // how far β is refined beyond the first and the last candidate
constexpr double kBetaTolerance = 0.01;  // of log β
constexpr std::size_t kFewestInstants = 50;
constexpr double kExplained = 0.5;   // of the torque: an output with more residual than this carries no information
constexpr double kShareOfLog = 0.2;  // of the longest segment that a filter may take to settle or to answer

// One candidate's filter with a fit for each output.
class Trial {
 public:
  Trial(const Model& model, const Measurement& measurement, const FilterDesign& design,
        const filter::SignalErrors& errors)
      : filter_(model, design, measurement, errors), fits_(model.n(), identify::LeastSquares(model.p())) {
    row_.resize(1, 1, model.p());
  }
  void restart() { filter_.restart(); }
  void step(double t, std::span<const double> sample) {
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
    for (const identify::LeastSquares& fit : fits_) {
      double share = 1.0;
      if (instants_ >= kFewestInstants) {
        const identify::LeastSquaresFit f = fit.solve();
        share = f.weighted_tss > 0.0 ? std::sqrt(f.weighted_rss / f.weighted_tss) : 1.0;
      }
      shares.push_back(std::max(share, 1e-12));
    }
    return shares;
  }
  [[nodiscard]] const FilterDesign& design() const { return filter_.design(); }

 private:
  RegressorFilter filter_;
  std::vector<identify::LeastSquares> fits_;
  RegressionBlock row_;
  std::size_t instants_ = 0;
};

// The β that delay, sampling and the log's length allow.
struct Range {
  double slowest, fastest;
  Range(const Measurement& measurement, int order, const Survey& survey, const FilterChoiceOptions& options) {
    // Measured speeds need no settling; three time constants are what it takes to see a step.
    const double memory = measurement.motion == MotionKind::speed ? 3.0 : FilterDesign{}.settle;
    slowest = std::max(order / options.longest_delay, memory / (kShareOfLog * survey.longest_segment));
    fastest = kMostBetaStep / survey.median_step;
  }
  [[nodiscard]] std::vector<double> candidates() const {
    std::vector<double> betas;
    for (const double beta : kBetas) {
      if (beta >= slowest * (1.0 - 1e-9) && beta <= fastest) {
        betas.push_back(beta);
      }
    }
    return betas;
  }
};

FilterDesign design_of(int order, double beta) { return {.order = order, .alpha = beta, .beta = beta}; }

FilterChoice by_residual(LogSource& log, const Model& model, const Measurement& measurement, int order,
                         const Survey& survey, const FilterChoiceOptions& options) {
  const Range range(measurement, order, survey, options);
  std::vector<Trial> trials;
  filter::SignalErrors errors;
  errors.interpolates = loses_often(survey);  // or slow filters would settle on few rows
  for (const double beta : range.candidates()) {
    trials.emplace_back(model, measurement, design_of(order, beta), errors);
  }
  FilterChoice choice;
  if (trials.empty()) {
    choice.design = design_of(order, std::min(range.slowest, range.fastest));
    choice.reason = "the log is too short, or sampled too slowly, for a choice";
    return choice;
  }
  core::for_each_sample(log, measurement.columns(), [&](const core::LogSample& sample) {
    for (Trial& trial : trials) {
      if (sample.starts) {
        trial.restart();
      }
      trial.step(sample.t, sample.values);
    }
  });
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
    choice.curve.push_back({trials[k].design(), std::exp(log_sum / outputs), {}});
    best = std::min(best, choice.curve.back().criterion);
  }
  choice.design = trials.front().design();
  for (const FilterCandidate& candidate : choice.curve) {
    if (candidate.criterion <= options.tolerance * best) {
      choice.design = candidate.design;
    }
  }
  choice.walks = 1;
  choice.reason = fmt::format("the fastest filter whose residual over torque is within {:.0f} % of the quietest one's",
                              100.0 * (options.tolerance - 1.0));
  return choice;
}

// Refines β between the neighbours of the best of `curve`'s candidates, of which those of its order are at hand.
void refine(FilterEvaluation& evaluate, const Range& range, FilterChoice& choice, std::size_t best,
            std::size_t most_evaluations) {
  const FilterCandidate start = choice.curve[best];
  const int order = start.design.order;
  const auto same_order = [&](std::size_t k) {
    return k < choice.curve.size() && choice.curve[k].design.order == order;
  };
  const double beta = start.design.beta;
  const double lower =
      best > 0 && same_order(best - 1) ? choice.curve[best - 1].design.beta : std::max(range.slowest, beta / kBeyond);
  const double upper =
      same_order(best + 1) ? choice.curve[best + 1].design.beta : std::min(range.fastest, beta * kBeyond);
  if (most_evaluations == 0 || !(std::log(upper / lower) > kBetaTolerance)) {
    return;
  }
  const double centre = std::clamp(std::log(beta), std::log(lower), std::log(upper));
  static_cast<void>(identify::minimise_scalar(
      [&](double log_beta) {
        if (log_beta == centre) {
          return start.criterion;
        }
        const FilterDesign design = design_of(order, std::exp(log_beta));
        const FilterValue value = evaluate({design}).front();
        choice.curve.push_back({design, value.criterion, value.parts});
        return value.criterion;
      },
      std::log(lower), std::log(upper), centre, {.most_evaluations = most_evaluations, .tolerance = kBetaTolerance}));
}

FilterChoice by_evaluation(LogSource& log, const Model& model, const Measurement& measurement, int given,
                           const Survey& survey, const FilterChoiceOptions& options) {
  const std::vector<int> orders = options.orders.empty() ? std::vector<int>{given} : options.orders;
  FilterCriterionOptions for_criterion = options.for_criterion;
  for_criterion.step = for_criterion.step > 0.0 ? for_criterion.step : survey.median_step;
  FilterEvaluation evaluate(log, model, measurement, options.criterion, for_criterion);
  std::vector<FilterDesign> designs;
  for (const int order : orders) {
    check::that(order == 2 || (order == 1 && measurement.motion == MotionKind::speed), "filter order",
                "2, or 1 where speeds are measured");
    for (const double beta : Range(measurement, order, survey, options).candidates()) {
      designs.push_back(design_of(order, beta));
    }
  }
  FilterChoice choice;
  choice.criterion = options.criterion;
  if (!designs.empty()) {
    const std::vector<FilterValue> values = evaluate(designs);
    for (std::size_t k = 0; k < designs.size(); ++k) {
      choice.curve.push_back({designs[k], values[k].criterion, values[k].parts});
    }
  }
  const auto less = [](const FilterCandidate& a, const FilterCandidate& b) { return a.criterion < b.criterion; };
  const auto best = std::ranges::min_element(choice.curve, less);
  if (best == choice.curve.end() || !std::isfinite(best->criterion)) {
    choice = by_residual(log, model, measurement, given, survey, options);
    choice.reason += designs.empty() ? "" : "; the criterion that was asked for has no value on this log";
    choice.walks += evaluate.walks();
    return choice;
  }
  const int order = best->design.order;
  refine(evaluate, Range(measurement, order, survey, options), choice,
         static_cast<std::size_t>(best - choice.curve.begin()), options.most_refinements);
  choice.design = std::ranges::min_element(choice.curve, less)->design;
  std::ranges::stable_sort(choice.curve, [](const FilterCandidate& a, const FilterCandidate& b) {
    return std::pair(a.design.order, a.design.beta) < std::pair(b.design.order, b.design.beta);
  });
  choice.walks = evaluate.walks();
  choice.reason = fmt::format("of {} filters with a delay up to {} s, order {} with β = {:.3g} 1/s has the {}",
                              choice.curve.size(), options.longest_delay, order, choice.design.beta,
                              options.criterion == FilterCriterion::predicted_error
                                  ? "least predicted error of the parameters (geometric mean)"
                                  : "narrowest threshold over torque (geometric mean over outputs)");
  return choice;
}

}  // namespace

FilterChoice choose_filter(LogSource& log, const Model& model, const Measurement& measurement, int order,
                           const Survey& survey, const FilterChoiceOptions& options) {
  check::positive(options.longest_delay, "longest_delay");
  check::that(options.tolerance >= 1.0, "tolerance", "at least 1");
  return options.criterion == FilterCriterion::residual_over_torque
             ? by_residual(log, model, measurement, order, survey, options)
             : by_evaluation(log, model, measurement, order, survey, options);
}

}  // namespace wheelwright::commission
