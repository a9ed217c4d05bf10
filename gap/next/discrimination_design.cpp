// SPDX-License-Identifier: Apache-2.0
#include "gap/next/discrimination_design.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <fmt/format.h>

#include "commission/design/stages.hpp"
#include "core/check.hpp"
#include "core/error.hpp"
#include "core/random.hpp"
#include "gap/effort_units.hpp"
#include "gap/next/further_drive.hpp"

namespace wheelwright::gap {
namespace {

constexpr int kProbes = 12;          // random manoeuvres on which pairs are looked at first
constexpr double kContained = 1e-4;  // share of a signature that counts as imitated
constexpr double kAbsorbed = 3e-4;   // share of a signature below which θ takes it up but for errors of sampling
constexpr double kNotTold = 1.64;    // standard deviations: one chance in twenty of going wrong
constexpr double kWanted = 3.0;      // deviations worth driving for

// Which ordered pairs any of some random manoeuvres tells apart.
std::vector<bool> find_decidable(const design::DesignSubject& subject, const design::MotionLimits& limits,
                                 const std::vector<Rival>& rivals, const std::vector<Effect>& catalogue,
                                 const PlannedNoise& noise, const design::DesignOptions& options) {
  const design::StageFamily family(subject, limits, options.stages);
  std::mt19937_64 generator(options.seed);
  std::vector<bool> decidable(rivals.size() * (rivals.size() - 1), false);
  for (int k = 0; k < kProbes; ++k) {
    std::vector<double> x(family.dimension());
    std::ranges::generate(x, [&] { return core::uniform(generator); });
    const std::vector<RivalSeparation> pairs =
        discrimination(planned_drive(family.plan(x, subject.step), subject), rivals, catalogue, noise);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      decidable[i] = decidable[i] || (pairs[i].share > kContained && pairs[i].kept > kAbsorbed);
    }
  }
  return decidable;
}

double least(const std::vector<RivalSeparation>& pairs, const std::vector<bool>& decidable) {
  double value = INFINITY;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (decidable.empty() || decidable[i]) {
      value = std::min(value, pairs[i].deviations());
    }
  }
  return std::isfinite(value) ? value : 0.0;
}

std::string stage_of(double v, double w, double time) {
  const bool drives = std::abs(v) >= 0.005, turns = std::abs(w) >= 0.005;
  std::string what = drives ? fmt::format("{} at {:.2f} m/s", v > 0.0 ? "forwards" : "backwards", std::abs(v)) : "";
  if (turns) {
    what += fmt::format("{}turning {} at {:.2f} rad/s", drives ? ", " : "on the spot, ", w > 0.0 ? "left" : "right",
                        std::abs(w));
  }
  return fmt::format("{:.1f} s {}", time, drives || turns ? what : "at rest");
}

std::size_t coefficients(const Rival& rival) {
  std::size_t count = 0;
  for (const RivalCause& cause : rival.causes) {
    count += cause.coefficients.size() + cause.shape.size();
  }
  return count;
}

std::vector<InseparablePair> find_inseparable(const DiscriminationDesign& design,
                                              const std::vector<Effect>& catalogue) {
  std::vector<InseparablePair> found;
  const std::size_t n = design.rivals.size();
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = a + 1; b < n; ++b) {
      bool decidable = false, absorbed = false;
      double worst = INFINITY;
      for (std::size_t i = 0; i < design.promised.size(); ++i) {
        const RivalSeparation& pair = design.promised[i];
        if (std::minmax(pair.truth, pair.other) == std::minmax(a, b) && design.decidable[i]) {
          decidable = true;
          worst = std::min(worst, pair.deviations());
        }
        absorbed = absorbed || ((pair.truth == a || pair.truth == b) && pair.kept <= kAbsorbed);
      }
      if (!decidable || worst < kNotTold) {
        const Rival &first = design.rivals[a], &second = design.rivals[b];
        const bool special = !decidable && !absorbed && coefficients(first) != coefficients(second);
        found.push_back({a, b, !decidable, special, splitting_measurement(first, second, catalogue)});
      }
    }
  }
  return found;
}

std::vector<std::string> words(const DiscriminationDesign& design) {
  std::vector<std::string> sentences;
  const auto pair_words = [&](const RivalSeparation& pair) {
    return fmt::format("{} from {}", design.rivals[pair.truth].name(), design.rivals[pair.other].name());
  };
  if (const auto worst = design.worst()) {
    const RivalSeparation& pair = design.promised[*worst];
    sentences.push_back(fmt::format(
        "It tells {} by {:.1f} standard deviations: if the first is true, the comparison of residuals finds it with a "
        "probability of {}, and the residual that the second leaves is {:.3g} times as large.",
        pair_words(pair), pair.deviations(),
        pair.probability() > 0.999 ? "more than 99.9 %" : fmt::format("{:.3g} %", 100.0 * pair.probability()),
        pair.ratio()));
    if (!design.analysed.empty()) {
      const double before = least(design.analysed, design.decidable);
      sentences.push_back(fmt::format(
          "On the log that was analysed the hardest pair is {:.1f} standard deviations apart: the gain is {}.", before,
          before > 0.0 ? fmt::format("{:.3g}-fold", pair.deviations() / before) : "from nothing"));
    }
    if (!design.promised_eight.empty()) {
      sentences.push_back(
          fmt::format("The best figure eight within the same limits promises {:.1f} for the hardest pair.",
                      least(design.promised_eight, design.decidable)));
    }
    if (pair.deviations() < kWanted && pair.deviations() > 0.0) {
      const double times = std::ceil(std::pow(kWanted / pair.deviations(), 2));
      sentences.push_back(fmt::format(
          "One drive is not enough to be sure: {:.0f} of them, in one log, make {:.0f} standard deviations.", times,
          kWanted));
    }
  }
  for (const InseparablePair& pair : design.inseparable) {
    const Rival &first = design.rivals[pair.first], &second = design.rivals[pair.second];
    if (pair.special_case) {
      const bool less = coefficients(first) < coefficients(second);
      sentences.push_back(
          fmt::format("At these sizes {} is {} with more parameters than are needed: the simpler one will do.",
                      (less ? second : first).name(), (less ? first : second).name()));
      continue;
    }
    sentences.push_back(fmt::format("{} and {} {}; what would split them: {}.", first.name(), second.name(),
                                    pair.by_any_motion
                                        ? "cannot be told apart by a log of this kind, however the robot is driven"
                                        : "are not told apart by one drive within these limits",
                                    pair.measurement));
  }
  return sentences;
}

}  // namespace

std::optional<std::size_t> DiscriminationDesign::worst() const {
  std::optional<std::size_t> index;
  for (std::size_t i = 0; i < promised.size(); ++i) {
    if (decidable[i] && (!index || promised[i].delta < promised[*index].delta)) {
      index = i;
    }
  }
  return index;
}

design::PlanObjective tell_apart(const design::DesignSubject& subject, const std::vector<Rival>& rivals,
                                 const std::vector<Effect>& catalogue, const PlannedNoise& noise,
                                 std::vector<bool> decidable) {
  check::that(decidable.empty() || decidable.size() == rivals.size() * (rivals.size() - 1), "decidable",
              "one for each ordered pair");
  return [&subject, rivals, catalogue, noise, decidable](const design::Plan& plan) {
    return -least(discrimination(planned_drive(plan, subject), rivals, catalogue, noise), decidable);
  };
}

design::DesignSubject in_torques(const design::DesignSubject& subject) {
  const TorqueView view = in_torques(subject.robot);
  if (!view.physical || view.logged == model::EffortKind::torque) {
    return subject;
  }
  design::DesignSubject out = subject;
  const double scale = view.torque_per_effort;
  const auto times = [scale](Box& box) {
    for (Interval& side : box.sides) {
      side = Interval{scale, scale} * side;
    }
  };
  out.robot = view.robot;
  out.model = model::make_model(view.robot);
  out.theta *= scale;
  times(out.effort_box);
  times(out.prior);
  if (out.known) {
    times(*out.known);
  }
  if (out.errors) {
    out.errors->output *= scale;
  }
  out.averaging.reset();
  return out;
}

design::MotionLimits limits_in_torques(design::MotionLimits limits, const design::DesignSubject& subject) {
  const TorqueView view = in_torques(subject.robot);
  if (view.physical && limits.effort) {
    *limits.effort *= view.torque_per_effort;
  }
  return limits;
}

std::vector<std::string> stage_words(const design::Plan& plan, const Model& model) {
  constexpr double kShortest = 0.1;  // s
  const Eigen::Index middle = plan.samples() / 2;
  std::vector<std::string> stages;
  for (Eigen::Index k = 0; k < middle;) {
    Eigen::Index end = k + 1;
    while (end < middle && (plan.speed.col(end) - plan.speed.col(k)).cwiseAbs().maxCoeff() < 1e-9) {
      ++end;
    }
    const double time = plan.step * static_cast<double>(end - k);
    const bool rests = plan.speed.col(k).isZero(1e-9);
    if (time >= kShortest && !rests) {
      const double v = plan.speed(0, k);
      stages.push_back(model.heading_coordinate >= 0 ? stage_of(v, plan.speed(model.heading_coordinate, k), time)
                                                     : fmt::format("{:.1f} s {} at {:.3g}", time,
                                                                   v > 0.0 ? "forwards" : "backwards", std::abs(v)));
    }
    k = end;
  }
  stages.push_back("then the same way back, reversed");
  return stages;
}

std::string splitting_measurement(const Rival& a, const Rival& b, const std::vector<Effect>& catalogue) {
  DirectMeasurement by = DirectMeasurement::none;
  bool parametric = false;
  for (const Rival* rival : {&a, &b}) {
    for (const RivalCause& cause : rival->causes) {
      const Effect* const effect = find_effect(catalogue, cause.effect);
      const bool in_both = std::ranges::count(a.causes, cause.effect, &RivalCause::effect) > 0 &&
                           std::ranges::count(b.causes, cause.effect, &RivalCause::effect) > 0;
      if (!in_both && effect != nullptr) {
        by = std::min(by, effect->measured_by);
        parametric = parametric || effect->parametric;
      }
    }
  }
  switch (by) {
    case DirectMeasurement::lengths:
      return "the wheels' circumference and the track measured with a tape, or the pose in the log";
    case DirectMeasurement::weight:
      return "scales under the wheels, or a baseline log of the healthy robot driven with the same torque constants";
    case DirectMeasurement::pull:
      return "a spring balance that holds the robot while it pulls, which compares torque as logged with a known force";
    case DirectMeasurement::timing:
      return "motor current at a higher rate on the clock of the encoders, which shows when torque really begins";
    case DirectMeasurement::turned_round:
      return "the same drive with the robot turned by half a turn, or a spirit level";
    case DirectMeasurement::lifted_wheels:
      return "the wheels driven lifted off the ground: what remains is in bearings and gears, what goes is on the "
             "floor";
    case DirectMeasurement::none: break;
  }
  return parametric ? "a baseline log of the healthy robot, or nominal values that can be trusted"
                    : "a sensor that sees one of them directly";
}

DiscriminationDesign design_for_discrimination(const design::DesignSubject& subject, const design::MotionLimits& limits,
                                               const std::vector<Rival>& rivals, const std::vector<Effect>& catalogue,
                                               const PlannedNoise& noise, const design::DesignOptions& options,
                                               const Drive* analysed) {
  DiscriminationDesign design;
  design.rivals = rivals;
  design.decidable = find_decidable(subject, limits, rivals, catalogue, noise, options);
  const bool any = std::ranges::find(design.decidable, true) != design.decidable.end();
  // Where nothing can be told apart, what is designed is the first manoeuvre that there is.
  design::DesignOptions search = options;
  if (!any) {
    search.samples = search.descents = search.steps = 1;
  }
  const design::PlanObjective objective = tell_apart(subject, rivals, catalogue, noise, design.decidable);
  design.manoeuvre = design::design_manoeuvre(subject, limits, objective, search);
  const auto pairs = [&](const design::Plan& plan) {
    return discrimination(planned_drive(plan, subject), rivals, catalogue, noise);
  };
  design.promised = pairs(design.manoeuvre.plan);
  if (any && analysed == nullptr && subject.model.on_two_wheels) {
    design.figure_eight = design::find_figure_eight(subject, limits, objective);
  }
  if (design.figure_eight) {
    design.figure_eight_plan = design::plan_of(*design.figure_eight, subject, limits.duration, subject.step);
    design.promised_eight = pairs(*design.figure_eight_plan);
  }
  if (analysed != nullptr) {
    design.analysed = discrimination(*analysed, rivals, catalogue, noise, DriveKind::logged);
  }
  design.inseparable = find_inseparable(design, catalogue);
  design.stages = stage_words(design.manoeuvre.plan, subject.model);
  design.sentences = words(design);
  return design;
}

}  // namespace wheelwright::gap
