// SPDX-License-Identifier: Apache-2.0
#include "commission/choice/detector_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "commission/survey.hpp"
#include "core/check.hpp"
#include "core/error.hpp"
#include "core/for_all.hpp"
#include "core/limits.hpp"
#include "identify/minimise_scalar.hpp"
#include "model/fault_type.hpp"
#include "model/filter/measurement.hpp"

namespace wheelwright::commission {

using core::kInfinity;

namespace {

constexpr double kFastestStep = 0.5;       // βh
constexpr double kShareToSettle = 0.2;     // of the longest segment that a filter may take to settle
constexpr double kSpeedMemory = 3.0;       // time constants of a filter on speeds
constexpr double kChoiceTolerance = 0.01;  // of log β
constexpr double kSameBeta = 1e-9;         // relative

struct Wish {
  FilterDesign filter;
  std::string origin;
};

FilterDesign equal_poles(int order, double beta) { return {.order = order, .alpha = beta, .beta = beta}; }

std::vector<StatedFault> faults_for(const Robot& robot, const std::vector<StatedFault>& stated) {
  if (!stated.empty()) {
    return stated;
  }
  const auto named = [](model::FaultKind kind) { return StatedFault{std::string(to_string(kind))}; };
  if (!model::on_two_wheels(robot)) {
    return {named(model::FaultKind::effort_loss)};
  }
  return {named(model::FaultKind::wheel_radius), named(model::FaultKind::wheel_radius_right)};
}

// The β worth trying for one order, slowest first.
std::vector<double> grid(int order, const Measurement& measurement, const Survey& seen,
                         const DetectorChoiceOptions& options) {
  const double memory = measurement.motion == MotionKind::speed ? kSpeedMemory : FilterDesign{}.settle;
  const double fastest = kFastestStep / check::positive(seen.median_step, "sampling step of the log");
  const double slowest =
      std::min(std::max(order / options.trial.window, memory / (kShareToSettle * seen.longest_segment)), fastest);
  if (!(slowest < fastest)) {
    return {fastest};
  }
  const double steps = std::ceil(std::log(fastest / slowest) / std::log(options.beta_factor));
  std::vector<double> betas;
  for (double k = 0.0; k <= steps; k += 1.0) {
    betas.push_back(slowest * std::pow(fastest / slowest, k / steps));
  }
  return betas;
}

std::vector<Wish> wishes(const LogTable& log, const Robot& robot, const DetectorChoiceOptions& options,
                         std::vector<std::string>& notes) {
  std::vector<Wish> all;
  const Model model = model::make_model(robot);
  for (const int order : {1, 2}) {
    TableSource source(log);
    Measurement measurement;
    try {
      measurement = filter::find_measurement(source, robot, model, order);
    } catch (const InvalidArgument& error) {
      notes.push_back(fmt::format("order {} is left out: {}", order, error.what()));
      continue;
    }
    const Survey seen = survey(source, measurement);
    for (const double beta : grid(order, measurement, seen, options)) {
      all.push_back({equal_poles(order, beta), "grid"});
    }
    if (order == 1) {
      all.push_back({equal_poles(1, 20.0), "the paper's"});
    }
    if (order != robot.filter.order.value_or(2)) {
      continue;
    }
    if (robot.filter.beta) {
      all.push_back({equal_poles(order, *robot.filter.beta), "the robot file's"});
    } else {
      // As settle() asks: for the widest model that the robot may have.
      Robot wide = robot;
      wide.parameters = robot.parameters.value_or(model::possible_parameters(robot));
      const FilterChoice taken = choose_filter(source, model::make_model(wide), measurement, order, seen,
                                               options.trial.commission.filter_choice);
      all.push_back({taken.design, "what commissioning takes"});
    }
  }
  return all;
}

std::string named(const StatedMargin& margin) { return margin.fault + (margin.side > 0.0 ? " +" : " −"); }

// The sizes that count.
const StatedSizes& counted(const StatedMargin& margin, bool either) {
  return either && margin.either ? *margin.either : static_cast<const StatedSizes&>(margin);
}

void rate(DetectorCandidate& candidate, const std::vector<std::string>& hopeless, bool either) {
  candidate.size = candidate.delay = candidate.faults.size() > hopeless.size() ? 0.0 : kInfinity;
  candidate.size_at_risk.reset();
  for (const StatedMargin& margin : candidate.faults) {
    if (std::ranges::find(hopeless, named(margin)) == hopeless.end()) {
      const StatedSizes& sizes = counted(margin, either);
      candidate.size = std::max(candidate.size, sizes.median / margin.asked);
      candidate.delay = std::max(candidate.delay, sizes.delay);
    }
    if (margin.at_risk) {
      candidate.size_at_risk = std::max(candidate.size_at_risk.value_or(0.0), margin.at_risk->median / margin.asked);
    }
  }
}

std::optional<double> risk_spread(const std::vector<DetectorCandidate>& candidates) {
  std::map<std::string, Interval> sizes;
  std::size_t told = 0;
  for (const DetectorCandidate& candidate : candidates) {
    told += candidate.size_at_risk ? 1 : 0;
    for (const StatedMargin& margin : candidate.faults) {
      if (margin.at_risk) {
        const double size = margin.at_risk->median;
        Interval& range = sizes.try_emplace(named(margin), Interval{size, size}).first->second;
        range = {std::min(range.lower, size), std::max(range.upper, size)};
      }
    }
  }
  if (told < 2) {
    return std::nullopt;
  }
  double spread = 0.0;
  for (const auto& [name, range] : sizes) {
    spread = range.lower < kInfinity ? std::max(spread, range.upper / range.lower - 1.0) : spread;
  }
  return spread;
}

std::vector<std::string> hopeless_among(const std::vector<DetectorCandidate>& candidates, bool either) {
  std::vector<std::string> seen, hopeless;
  for (const DetectorCandidate& candidate : candidates) {
    for (const StatedMargin& margin : candidate.faults) {
      if (counted(margin, either).median < kInfinity) {
        seen.push_back(named(margin));
      }
    }
  }
  for (const DetectorCandidate& candidate : candidates) {
    for (const StatedMargin& margin : candidate.faults) {
      if (std::ranges::find(seen, named(margin)) == seen.end() &&
          std::ranges::find(hopeless, named(margin)) == hopeless.end()) {
        hopeless.push_back(named(margin));
      }
    }
  }
  return hopeless;
}

double least_size(const std::vector<DetectorCandidate>& candidates) {
  double least = kInfinity;
  for (const DetectorCandidate& candidate : candidates) {
    least = std::min(least, candidate.size);
  }
  return least;
}

void put_in_order(std::vector<DetectorCandidate>& candidates, double tie) {
  const double least = least_size(candidates);
  const auto best = std::min_element(candidates.begin(), candidates.end(),
                                     [&](const auto& a, const auto& b) { return better(a, b, least, tie); });
  std::rotate(candidates.begin(), best, best + 1);
  std::stable_sort(candidates.begin() + 1, candidates.end(), [](const auto& a, const auto& b) {
    return std::pair(!a.failure.empty(), a.size) < std::pair(!b.failure.empty(), b.size);
  });
}

std::string assumption(Guarantee guarantee, double false_alarms) {
  switch (guarantee) {
    case Guarantee::never:
      return "no false alarm, ever, while the robot is the model's and noise stays inside its declared bounds, "
             "whatever "
             "it does there";
    case Guarantee::hourly:
      return fmt::format(
          "a false alarm in an hour of driving has a probability of at most {:g}, learning and choosing from this log "
          "counted in, while the robot "
          "is the model's and noise is independent from sample to sample, of zero mean and inside its declared bounds "
          "(an encoder's rounding is that only while wheels turn by several counts a sample)",
          false_alarms);
    case Guarantee::extrapolated:
      return "noise is not declared, or the log contradicts an assumption: bounds are extrapolated from this log, and "
             "the promise holds as far as driving to come is like it; declare `noise:` in the robot file for one that "
             "stands on the sensors";
  }
  return {};
}

class Search {
 public:
  Search(LogTable log, const Robot& robot, const DetectorChoiceOptions& options)
      : log_(std::move(log)), robot_(&robot), at_risk_(options.trial.commission.at_risk), options_(options) {
    options_.trial.faults = faults_for(robot, options.trial.faults);
    options_.trial.commission.at_risk = std::min(options.trial.commission.at_risk, CommissionOptions::AtRisk::detector);
    validate(options_.trial, robot);
    check::that(options.beta_factor > 1.0, "beta_factor", "a number > 1");
    check::that(options.tie >= 0.0, "tie", "a number >= 0");
    choice_.faults = options_.trial.faults;
    choice_.window = options.trial.window;
    choice_.false_alarms = options.trial.false_alarms;
    choice_.either = options.either;
    choice_.tie = options.tie;
  }

  [[nodiscard]] DetectorChoice operator()() {
    try_grid();
    refine();
    put_in_order(choice_.candidates, options_.tie);
    if (!(choice_.candidates.front().size < kInfinity)) {
      choice_.notes.push_back("no filter is certain to see a stated fault within the window, whenever it sets in");
      return std::move(choice_);
    }
    vary();
    put_in_order(choice_.candidates, options_.tie);
    choice_.risk_spread = risk_spread(choice_.candidates);
    const FilterDesign filter = choice_.candidates.front().filter;
    const Guarantee guarantee = choice_.candidates.front().guarantee;
    TrialOptions trial = options_.trial;
    trial.false_alarms = guarantee == Guarantee::never ? 0.0 : trial.false_alarms;
    choice_.chosen = commissioned(filter, trial);
    if (at_risk_ == CommissionOptions::AtRisk::reach && choice_.chosen && choice_.chosen->model.at_risk) {
      TableSource source(log_);
      choice_.chosen->reach = risk_reach(source, choice_.chosen->model, {.threads = trial.threads});
    }
    choice_.notes.push_back(assumption(guarantee, trial.false_alarms));
    tell("done", 1.0);
    return std::move(choice_);
  }

 private:
  void tell(std::string_view stage, double share) const {
    if (options_.progress) {
      options_.progress(stage, share);
    }
  }

  void try_grid() {
    const std::vector<Wish> all = wishes(log_, *robot_, options_, choice_.notes);
    check::that(!all.empty(), "log", "columns for a filter of order 1 or 2");
    choice_.candidates.resize(all.size());
    tried_.resize(all.size());
    options_.trial.tried = all.size() + options_.most_refinements;
    TrialOptions trial = options_.trial;
    trial.threads = 1;
    core::for_all(parts_.size(), options_.trial.threads,
                  [&](std::size_t k) { parts_[k] = kinematic_part_of(log_, *robot_, static_cast<int>(k) + 1, trial); });
    core::for_all(
        all.size(), options_.trial.threads,
        [&](std::size_t i) {
          const FilterDesign& filter = all[i].filter;
          Trial tried = try_detector(log_, *robot_, filter, {{}}, all[i].origin, with_part(trial, filter));
          choice_.candidates[i] = tried.candidates.front();
          tried_[i] = {filter, trial.false_alarms, std::move(tried.commissioning)};
        },
        [&](std::size_t begun) {
          tell("trying filters", 0.7 * static_cast<double>(begun) / static_cast<double>(all.size()));
        });
    choice_.hopeless = hopeless_among(choice_.candidates, options_.either);
    for (DetectorCandidate& candidate : choice_.candidates) {
      rate(candidate, choice_.hopeless, options_.either);
    }
  }

  // log β between the neighbours of the best candidate.
  void refine() {
    const double least = least_size(choice_.candidates);
    const auto best = std::ranges::find(choice_.candidates, least, &DetectorCandidate::size);
    if (!(least < kInfinity) || options_.most_refinements == 0) {
      return;
    }
    const FilterDesign start = best->filter;
    double lower = start.beta, upper = start.beta, below = 0.0, above = kInfinity;
    for (const DetectorCandidate& candidate : choice_.candidates) {
      const double beta = candidate.filter.beta;
      if (candidate.filter.order == start.order && candidate.origin == "grid") {
        below = beta < start.beta ? std::max(below, beta) : below;
        above = beta > start.beta ? std::min(above, beta) : above;
      }
    }
    lower = below > 0.0 ? below : lower;
    upper = above < kInfinity ? above : upper;
    if (!(std::log(upper / lower) > kChoiceTolerance)) {
      return;
    }
    std::size_t done = 0;
    const double centre = std::clamp(std::log(start.beta), std::log(lower), std::log(upper));
    static_cast<void>(identify::minimise_scalar(
        [&](double log_beta) {
          if (log_beta == centre) {
            return least;
          }
          const FilterDesign design = equal_poles(start.order, std::exp(log_beta));
          for (const DetectorCandidate& known : choice_.candidates) {
            if (known.filter.order == design.order && std::abs(known.filter.beta / design.beta - 1.0) < kSameBeta) {
              return known.size;
            }
          }
          tell("refining", 0.7 + 0.2 * static_cast<double>(++done) / static_cast<double>(options_.most_refinements));
          return add(design, {{}}, "refined", options_.trial);
        },
        std::log(lower), std::log(upper), centre,
        {.most_evaluations = options_.most_refinements + 1, .tolerance = kChoiceTolerance}));
  }

  // The chosen filter under other rules, and under the strict guarantee where that was not asked for.
  void vary() {
    tell("comparing rules", 0.9);
    const FilterDesign filter = choice_.candidates.front().filter;
    const bool declared = choice_.candidates.front().guarantee == Guarantee::hourly;
    add(filter, options_.persistences, "the chosen filter", options_.trial);
    if (declared) {
      TrialOptions strict = options_.trial;
      strict.false_alarms = 0.0;
      add(filter, {{}}, "the chosen filter", strict);
    }
  }

  double add(const FilterDesign& filter, const std::vector<detector::Persistence>& persistences,
             const std::string& origin, const TrialOptions& trial) {
    if (persistences.empty()) {
      return kInfinity;
    }
    double least = kInfinity;
    for (DetectorCandidate& candidate : try_out(filter, persistences, origin, trial)) {
      rate(candidate, choice_.hopeless, options_.either);
      least = std::min(least, candidate.size);
      choice_.candidates.push_back(std::move(candidate));
    }
    return least;
  }

  // A commissioning that was made on the way.
  struct Tried {
    FilterDesign filter;
    double false_alarms = 0.0;
    std::optional<Commissioning> commissioning;
  };

  [[nodiscard]] const Tried* find_tried(const FilterDesign& filter, double false_alarms) const {
    const auto at = std::ranges::find_if(tried_, [&](const Tried& tried) {
      return tried.filter.order == filter.order && tried.filter.alpha == filter.alpha &&
             tried.filter.beta == filter.beta && tried.false_alarms == false_alarms;
    });
    return at == tried_.end() ? nullptr : &*at;
  }

  // The kinematic parts are those of options_.trial.
  [[nodiscard]] TrialOptions with_part(TrialOptions trial, const FilterDesign& filter) const {
    if (trial.false_alarms == options_.trial.false_alarms) {
      trial.commission.kinematic_part = parts_.at(static_cast<std::size_t>(filter.order - 1));
    }
    return trial;
  }

  [[nodiscard]] std::vector<DetectorCandidate> try_out(const FilterDesign& filter,
                                                       const std::vector<detector::Persistence>& persistences,
                                                       const std::string& origin, const TrialOptions& trial) {
    const Tried* known = find_tried(filter, trial.false_alarms);
    if (known != nullptr && known->commissioning) {
      return candidates_of(log_, *known->commissioning, filter, persistences, origin, trial);
    }
    Trial tried = try_detector(log_, *robot_, filter, persistences, origin, with_part(trial, filter));
    tried_.push_back({filter, trial.false_alarms, std::move(tried.commissioning)});
    return tried.candidates;
  }

  [[nodiscard]] std::optional<Commissioning> commissioned(const FilterDesign& filter, const TrialOptions& trial) {
    const Tried* known = find_tried(filter, trial.false_alarms);
    return known != nullptr ? known->commissioning
                            : try_detector(log_, *robot_, filter, {{}}, "", with_part(trial, filter)).commissioning;
  }

  LogTable log_;
  const Robot* robot_;
  CommissionOptions::AtRisk at_risk_;  // of the chosen one
  DetectorChoiceOptions options_;
  DetectorChoice choice_;
  std::array<std::shared_ptr<const KinematicPart>, 2> parts_;  // of filters of order 1 and 2
  std::vector<Tried> tried_;
};

}  // namespace

bool better(const DetectorCandidate& a, const DetectorCandidate& b, double least, double tie) {
  const auto key = [&](const DetectorCandidate& candidate) {
    const bool tied = candidate.size <= least * (1.0 + tie);
    // k of n has the same bounds as 1 of 1, and no earlier alarm: it never comes first.
    return std::tuple(!candidate.failure.empty(), !tied, tied ? candidate.delay : candidate.size, candidate.size,
                      candidate.persistence.n);
  };
  return key(a) < key(b);
}

DetectorChoice choose_detector(LogSource& log, const Robot& robot, const DetectorChoiceOptions& options) {
  return Search(read_all(log), robot, options)();
}

}  // namespace wheelwright::commission
