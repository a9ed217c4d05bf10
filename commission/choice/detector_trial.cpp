// SPDX-License-Identifier: Apache-2.0
#include "commission/choice/detector_trial.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "commission/at_risk/pose_at_risk.hpp"
#include "core/check.hpp"
#include "core/error.hpp"
#include "core/limits.hpp"
#include "core/statistics.hpp"
#include "detector/faults/fault_rows.hpp"
#include "detector/faults/margins.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/multiscale/sum_margins.hpp"
#include "detector/multiscale/sum_response.hpp"
#include "model/filter/regressor_filter.hpp"

namespace wheelwright::commission {
namespace {

constexpr double kHour = 3600.0;          // s
constexpr double kShare = 0.2;            // stated size of a share where none is given
constexpr std::size_t kDelaySteps = 40;   // of the window
constexpr double kLeastOnsetStep = 1e-9;  // s: onsets are where `settled` says

double rows_of_an_hour(double step) { return kHour / check::positive(step, "sampling step"); }

double stated_size(const StatedFault& stated, const FaultType& fault) {
  const double most = std::max(fault.range.upper, -fault.range.lower);
  if (fault.whole) {
    return most;
  }
  check::that(stated.size || fault.unit == "1", "size of " + stated.name, "a size in " + fault.unit);
  const double size = check::positive(stated.size.value_or(kShare), "size of " + stated.name);
  check::that(size <= most, "size of " + stated.name, fmt::format("at most {:g}", most));
  return size;
}

// The bounds' promise, as commission_robot() takes it.
CommissionOptions promise(const TrialOptions& options, const LogTable& log, std::size_t outputs) {
  CommissionOptions commissioning = options.commission;
  commissioning.threads = options.threads;
  commissioning.persistence = {};
  commissioning.noise_mode = filter::NoiseMode::worst_case;
  if (options.false_alarms > 0.0) {
    const auto rows = static_cast<double>(log.rows());
    const double step = core::median_step(log.t);
    commissioning.noise_mode = filter::NoiseMode::statistical;
    commissioning.confidence = hourly_confidence(options.false_alarms, rows, step, options.tried);
    commissioning.extrapolation.risk = options.false_alarms / static_cast<double>(outputs);
    commissioning.extrapolation.horizon = std::max(1.0, rows_of_an_hour(step) / rows);
  }
  return commissioning;
}

// Leaves as onsets the first settled instants from evenly spaced rows of the log on, whatever the filter.
void set_onsets(detector::ReferenceMotion& motion, const LogTable& log, const TrialOptions& options) {
  const double seconds = static_cast<double>(log.rows()) * core::median_step(log.t);
  const double wanted = std::clamp(std::floor(seconds / options.onset_step), 1.0,
                                   static_cast<double>(std::max<std::size_t>(options.most_onsets, 1)));
  std::vector<bool> onsets(motion.instants(), false);
  for (double i = 0.5; i < wanted; i += 1.0) {
    const auto row = static_cast<std::size_t>(i / wanted * static_cast<double>(log.rows()));
    const auto at = static_cast<std::size_t>(std::lower_bound(motion.sample.begin(), motion.sample.end(), row) -
                                             motion.sample.begin());
    if (at < motion.instants() && motion.settled[at]) {
      onsets[at] = true;
    }
  }
  motion.settled = std::move(onsets);
}

// Of the onsets while the robot moves whose window fits; `count`: how many there are.
StatedSizes sizes_of(const detector::FaultMargins& margins, double asked, const std::vector<double>& windows,
                     std::size_t& count) {
  std::vector<double> sizes, delays;
  std::vector<std::vector<double>> within(windows.size());
  for (const detector::OnsetMargin& onset : margins.onsets) {
    if (onset.kind == detector::ManoeuvreKind::standstill || onset.certain.size() < windows.size()) {
      continue;
    }
    sizes.push_back(onset.certain.back());
    for (std::size_t w = 0; w < windows.size(); ++w) {
      within[w].push_back(onset.certain[w]);
    }
    const auto seen = std::find_if(onset.certain.begin(), onset.certain.end(), [&](double x) { return x <= asked; });
    delays.push_back(seen == onset.certain.end() ? core::kInfinity
                                                 : windows[static_cast<std::size_t>(seen - onset.certain.begin())]);
  }
  check::that(!sizes.empty(), "log", "driving that is longer than the window, after the filter has settled");
  count = sizes.size();
  StatedSizes result;
  result.worst = *std::max_element(sizes.begin(), sizes.end());
  result.median = core::median(std::move(sizes));
  result.delay = core::median(std::move(delays));
  for (std::vector<double>& each : within) {
    result.medians.push_back(core::median(std::move(each)));
  }
  return result;
}

// The smaller of the certain sizes, onset by onset.
detector::FaultMargins smaller_of(detector::FaultMargins a, const detector::FaultMargins& b) {
  for (std::size_t k = 0; k < a.onsets.size(); ++k) {
    std::vector<double>& certain = a.onsets[k].certain;
    const std::vector<double>& other = b.onsets[k].certain;
    for (std::size_t w = 0; w < std::min(certain.size(), other.size()); ++w) {
      certain[w] = std::min(certain[w], other[w]);
    }
  }
  return a;
}

class Margins {
 public:
  Margins(const LogTable& log, const OnlineModel& model, const TrialOptions& options)
      : model_(&model),
        options_(&options),
        catalogue_(model::fault_catalogue(model.model, model.estimate, model.robot.effort)),
        rule_(Polytope(model.facets, model.box), model.estimate) {
    TableSource source(log);
    motion_ =
        detector::read_reference(source, RegressorFilter(model.model, model.filter, model.measurement, model.errors));
    if (model.at_risk) {
      drive_ = detector::read_sum_drive(source, model, motion_);
    }
    set_onsets(motion_, log, options);
    for (std::size_t k = 1; k <= kDelaySteps; ++k) {
      windows_.push_back(options.window * static_cast<double>(k) / static_cast<double>(kDelaySteps));
    }
  }

  [[nodiscard]] std::vector<StatedMargin> operator()(detector::Persistence persistence) const {
    std::vector<FaultType> faults;
    std::vector<double> asked;
    for (const StatedFault& stated : options_->faults) {
      faults.push_back(model::find_fault(catalogue_, stated.name));
      asked.push_back(stated_size(stated, faults.back()));
    }
    const auto all = detector::margins_along(motion_, faults, rule_,
                                             [this](const FaultType& fault) {
                                               return std::make_unique<detector::FaultFilter>(fault, model_->model,
                                                                                              model_->filter, motion_);
                                             },
                                             {.windows = windows_,
                                              .onset_step = kLeastOnsetStep,
                                              .most_onsets = motion_.instants(),
                                              .persistence = persistence,
                                              .threads = options_->threads});
    const std::vector<detector::FaultMargins> sums = by_sums(faults, all.front().onsets);
    std::vector<StatedMargin> result;
    std::size_t of = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const detector::FaultMargins& margins = all[i];
      while (faults[of].name != margins.fault.name) {
        ++of;
      }
      if (margins.largest() >= asked[of]) {
        StatedMargin stated;
        static_cast<StatedSizes&>(stated) = sizes_of(margins, asked[of], windows_, stated.onsets);
        stated.fault = margins.fault.name;
        stated.unit = margins.fault.unit;
        stated.side = margins.side;
        stated.asked = asked[of];
        if (!sums.empty()) {
          std::size_t count = 0;
          stated.at_risk = sizes_of(sums[i], asked[of], windows_, count);
          stated.either = sizes_of(smaller_of(margins, sums[i]), asked[of], windows_, count);
        }
        result.push_back(std::move(stated));
      }
    }
    return result;
  }

  // SumDrive::miss; nothing where nothing is said at a risk.
  [[nodiscard]] std::optional<double> miss() const { return drive_ ? std::optional(drive_->miss) : std::nullopt; }

 private:
  // In the order of margins_along(); empty where nothing is said at a risk.
  [[nodiscard]] std::vector<detector::FaultMargins> by_sums(const std::vector<FaultType>& faults,
                                                            const std::vector<detector::OnsetMargin>& onsets) const {
    if (!drive_) {
      return {};
    }
    std::vector<std::size_t> instants;
    for (const detector::OnsetMargin& onset : onsets) {
      instants.push_back(onset.instant);
    }
    std::vector<detector::FaultMargins> sums = detector::margins_at_risk(
        *drive_, *model_, motion_, faults, instants, {.windows = windows_, .threads = options_->threads});
    for (detector::FaultMargins& margins : sums) {
      for (std::size_t k = 0; k < onsets.size(); ++k) {
        margins.onsets[k].kind = onsets[k].kind;
        margins.onsets[k].certain.resize(onsets[k].certain.size(), core::kInfinity);
      }
    }
    return sums;
  }

  const OnlineModel* model_;
  const TrialOptions* options_;
  std::vector<FaultType> catalogue_;
  detector::ThresholdRule rule_;
  detector::ReferenceMotion motion_;
  std::optional<detector::SumDrive> drive_;  // at a stated risk
  std::vector<double> windows_;
};

Guarantee guarantee_of(const Commissioning& result) {
  switch (result.model.warrant) {
    case core::Warrant::guaranteed: return Guarantee::never;
    case core::Warrant::statistical: return Guarantee::hourly;
    case core::Warrant::extrapolated: return Guarantee::extrapolated;
  }
  return Guarantee::extrapolated;
}

}  // namespace

double hourly_confidence(double false_alarms, double rows, double step, std::size_t tried) {
  check::that(false_alarms > 0.0 && false_alarms < 1.0, "false alarms an hour", "a probability inside (0, 1)");
  check::that(rows >= 1.0, "rows", "at least 1");
  check::that(tried >= 1, "tried", "at least 1");
  return 1.0 - false_alarms * rows / (static_cast<double>(tried) * rows + rows_of_an_hour(step));
}

void validate(const TrialOptions& options, const Robot& robot) {
  check::positive(options.window, "window");
  check::positive(options.onset_step, "onset_step");
  check::that(options.false_alarms >= 0.0 && options.false_alarms < 1.0, "false alarms an hour",
              "a probability in [0, 1); 0 stands for never");
  check::that(!options.faults.empty(), "faults", "at least one");
  const Model model = model::make_model(robot);
  Eigen::VectorXd middle(static_cast<Eigen::Index>(model.p()));
  const model::PriorBox prior = model::prior_box(robot, model);
  for (std::size_t j = 0; j < model.p(); ++j) {
    middle[static_cast<Eigen::Index>(j)] = 0.5 * (prior.bounds[j].lower + prior.bounds[j].upper);
  }
  const auto catalogue = model::fault_catalogue(model, middle, robot.effort);
  for (const StatedFault& stated : options.faults) {
    const FaultType& fault = model::find_fault(catalogue, stated.name);
    if (fault.theta.size() == 0) {  // the range of a lost mass depends on the robot that is found
      static_cast<void>(stated_size(stated, fault));
    }
    check::that(std::ranges::count(options.faults, stated.name, &StatedFault::name) == 1, "faults",
                stated.name + " once");
  }
}

namespace {

// Until commissioning has said more.
DetectorCandidate candidate_with(const FilterDesign& filter, const std::string& origin, const TrialOptions& options) {
  DetectorCandidate candidate{.filter = filter, .persistence = {}, .origin = origin};
  candidate.guarantee = options.false_alarms > 0.0 ? Guarantee::hourly : Guarantee::never;
  return candidate;
}

}  // namespace

std::vector<DetectorCandidate> candidates_of(const LogTable& log, const Commissioning& commissioning,
                                             const FilterDesign& filter,
                                             const std::vector<detector::Persistence>& persistences,
                                             const std::string& origin, const TrialOptions& options) {
  DetectorCandidate candidate = candidate_with(filter, origin, options);
  try {
    candidate.guarantee = guarantee_of(commissioning);
    candidate.failure = commissioning.model.facets.empty() ? commissioning.message : std::string();
    if (candidate.failure.empty()) {
      std::vector<DetectorCandidate> candidates;
      const Margins margins(log, commissioning.model, options);
      for (const detector::Persistence& persistence : persistences) {
        candidates.push_back(candidate);
        candidates.back().persistence = persistence;
        candidates.back().faults = margins(persistence);
        candidates.back().miss = margins.miss();
        if (const auto& at_risk = commissioning.model.at_risk) {
          candidates.back().risk_warrant = at_risk->warrant;
        }
      }
      return candidates;
    }
  } catch (const Error& error) {
    candidate.failure = error.what();
  }
  return {candidate};
}

Trial try_detector(const LogTable& log, const Robot& robot, const FilterDesign& filter,
                   const std::vector<detector::Persistence>& persistences, const std::string& origin,
                   const TrialOptions& options) {
  validate(options, robot);
  Robot wished = robot;
  wished.filter = {.order = filter.order, .alpha = filter.alpha, .beta = filter.beta};
  Trial trial;
  try {
    TableSource source(log);
    trial.commissioning = commission_robot(source, wished, promise(options, log, model::make_model(robot).n()));
  } catch (const Error& error) {
    trial.candidates.push_back(candidate_with(filter, origin, options));
    trial.candidates.back().failure = error.what();
    return trial;
  }
  trial.candidates = candidates_of(log, *trial.commissioning, filter, persistences, origin, options);
  return trial;
}

std::shared_ptr<const KinematicPart> kinematic_part_of(const LogTable& log, const Robot& robot, int order,
                                                       const TrialOptions& options) {
  validate(options, robot);
  Robot wished = robot;
  wished.filter.order = order;
  try {
    TableSource source(log);
    return std::make_shared<const KinematicPart>(
        make_kinematic_part(source, wished, promise(options, log, model::make_model(robot).n())));
  } catch (const Error&) {
    return nullptr;
  }
}

}  // namespace wheelwright::commission
