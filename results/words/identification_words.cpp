// SPDX-License-Identifier: Apache-2.0
#include "results/words/identification_words.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "core/statistics.hpp"
#include "core/words.hpp"
#include "identify/noise_level.hpp"

namespace wheelwright::words {

using commission::Identification;
using commission::ShapeFinding;
using commission::ShapeKind;
using identify::Excitation;

namespace {

constexpr double kFarApart = 3.0;      // standard errors between two estimates that should agree
constexpr double kManyOutliers = 3.0;  // times the share of small weights that Gaussian residuals have
constexpr double kLoose = 0.1;         // half of a 95 % interval over the estimate
constexpr double kOtherTrack = 0.01;   // relative difference of track widths that is worth a word

std::string spoken(std::string name) {
  std::ranges::replace(name, '_', ' ');
  return name;
}

std::string sentence(const std::string& text) {
  return text.empty() || text.ends_with('.') ? core::capital(text) : core::capital(text) + ".";
}

double half_interval(const Identification& r, std::size_t j) {
  const auto at = static_cast<Eigen::Index>(j);
  const identify::ResidualSummary& s = r.fit.residuals;
  return at < s.standard_error.size()
             ? core::student_quantile(r.confidence, std::max(s.freedom, 1.0)) * s.standard_error[at]
             : std::numeric_limits<double>::infinity();
}

// Indices of the parameters in `state`.
std::vector<std::size_t> in_state(const Identification& r, Excitation state) {
  std::vector<std::size_t> list;
  for (std::size_t j = 0; j < r.fit.excitation.size(); ++j) {
    if (r.fit.excitation[j].state == state) {
      list.push_back(j);
    }
  }
  return list;
}

std::string names_of(const Identification& r, const std::vector<std::size_t>& list) {
  const auto shown = shown_parameters(r);
  std::vector<std::string> names;
  for (const std::size_t j : list) {
    names.push_back(spoken(shown[j].name));
  }
  return core::enumerated(names);
}

// The shape that explains most, of those that matter.
const ShapeFinding* strongest(const Identification& r) {
  const ShapeFinding* best = nullptr;
  for (const ShapeFinding& shape : r.shapes) {
    if (matters(shape) && (best == nullptr || shape.residual_ratio < best->residual_ratio)) {
      best = &shape;
    }
  }
  return best;
}

const char* kind_words(const ShapeFinding& shape) {
  switch (shape.kind) {
    case ShapeKind::delay:
      return shape.estimate < 0.0 ? "a delay of the motion against the effort"
                                  : "a delay of the effort against the motion";
    case ShapeKind::effort_lag: return "a lag of the measured effort";
    case ShapeKind::actuator_lag: return "a lag between commanded and acting effort";
    case ShapeKind::stribeck_speed: break;
  }
  return "a Stribeck bend of the friction";
}

// A number of seconds as people say it.
std::string value_text(const ShapeFinding& shape, double value) {
  return shape.unit == "s" ? fmt::format("{:.3g} ms", 1e3 * value) : fmt::format("{:.3g} {}", value, shape.unit);
}

double half_interval(const ShapeFinding& shape) {
  return core::student_quantile(0.95, std::max(shape.freedom, 1.0)) * shape.standard_error;
}

// Best and least known parameter, by half interval over estimate.
std::string spread_sentence(const Identification& r) {
  const auto shown = shown_parameters(r);
  std::vector<std::pair<double, std::size_t>> spread;
  for (const std::size_t j : in_state(r, Excitation::identified)) {
    const double value = std::abs(shown[j].value(r.fit.estimate[static_cast<Eigen::Index>(j)]));
    const double half = std::abs(shown[j].scale.scale) * half_interval(r, j);
    if (value > 0.0 && std::isfinite(half)) {
      spread.emplace_back(half / value, j);
    }
  }
  if (spread.empty()) {
    return {};
  }
  const auto [best, worst] = std::ranges::minmax(spread);
  const auto part = [&](const std::pair<double, std::size_t>& s) {
    return fmt::format("{} (± {:.2g} %)", spoken(shown[s.second].name), 100.0 * s.first);
  };
  return spread.size() == 1
             ? fmt::format("Known: {} at {:g} %.", part(best), 100.0 * r.confidence)
             : fmt::format("Best known is {}, least {}, at {:g} %.", part(best), part(worst), 100.0 * r.confidence);
}

std::string regions_sentence(const Identification& r) {
  const inference::RegionRow* student = nullptr;
  std::vector<std::string> parts;
  const auto widest = [&](const inference::RegionRow& row) {
    double ratio = 0.0;
    for (Eigen::Index j = 0; j < row.lower.size(); ++j) {
      const double own = student->upper[j] - student->lower[j];
      ratio = own > 0.0 ? std::max(ratio, (row.upper[j] - row.lower[j]) / own) : ratio;
    }
    return ratio;
  };
  for (const inference::RegionRow& row : r.regions.rows) {
    if (!row.available) {
      continue;
    }
    if (row.method == inference::RegionMethod::student_t) {
      student = &row;
    } else if (student != nullptr) {
      const double ratio = widest(row);
      parts.push_back(std::isfinite(ratio)
                          ? fmt::format("{} up to {:.2g} times as wide",
                                        spoken(std::string(inference::to_string(row.method))), ratio)
                          : fmt::format("{} unbounded", spoken(std::string(inference::to_string(row.method)))));
    }
  }
  return parts.empty() ? std::string()
                       : fmt::format(
                             "Against the intervals of Student's t, those of {}: what they assume stands "
                             "beside them.",
                             core::enumerated(parts));
}

// Where least squares and the fit that ignores outliers differ.
std::string robust_sentence(const Identification& r) {
  if (r.robust.status == inference::RobustStatus::infeasible) {
    return "The physical constraints contradict each other: there is no robust fit.";
  }
  if (r.robust.estimate.size() == 0 || r.fit.choice.candidates.empty() || !r.fit.choice.candidates[0].estimate.usable) {
    return {};
  }
  const identify::Estimate& plain = r.fit.choice.candidates[0].estimate;
  const auto shown = shown_parameters(r);
  double furthest = 0.0;
  std::size_t which = 0;
  for (const std::size_t j : in_state(r, Excitation::identified)) {
    const auto at = static_cast<Eigen::Index>(j);
    const double error = plain.standard_error[at];
    const double apart = error > 0.0 ? std::abs(r.robust.estimate[at] - plain.theta[at]) / error : 0.0;
    if (apart > furthest) {
      furthest = apart;
      which = j;
    }
  }
  if (furthest <= kFarApart) {
    return fmt::format(
        "A fit that gives little weight to outliers agrees with least squares within {:.2g} standard "
        "errors.",
        std::max(furthest, 0.1));
  }
  return fmt::format(
      "A fit that gives little weight to outliers moves {} by {:.2g} standard errors: some rows pull the estimate.",
      spoken(shown[which].name), furthest);
}

bool has_outliers(const Identification& r) {
  return std::ranges::any_of(r.robust.outputs, [](const inference::OutputWeights& w) {
    return w.gaussian_share > 0.0 && w.down_weighted > kManyOutliers * w.gaussian_share;
  });
}

std::string information_sentence(const Identification& r) {
  const auto shown = shown_parameters(r);
  if (r.information.windows.empty()) {
    return {};
  }
  std::size_t least = r.information.parameters.size();
  for (std::size_t j = 0; j < r.information.parameters.size(); ++j) {
    const inference::ParameterInformation& p = r.information.parameters[j];
    if (p.information > 0.0 &&
        (least == r.information.parameters.size() || p.seconds < r.information.parameters[least].seconds)) {
      least = j;
    }
  }
  if (least >= shown.size()) {
    return {};
  }
  return fmt::format(
      "Of the {:.0f} s, {:.2g} s carry 80 % of the information on {}, the parameter that the fewest "
      "seconds tell.",
      r.information.seconds, r.information.parameters[least].seconds, spoken(shown[least].name));
}

std::string quantity(const inference::KinematicQuantity& q) {
  return fmt::format("{:.5g} m (95 %: {:.5g} to {:.5g} m)", q.estimate, q.lower, q.upper);
}

std::string kinematics_sentence(const Identification& r) {
  if (!r.kinematics) {
    return {};
  }
  const inference::KinematicQuantity& at_nominal = r.kinematics->track_at_nominal_radius;
  if (at_nominal.state == inference::KinematicState::not_identified) {
    return sentence("the pose does not tell the track width: " + at_nominal.reason);
  }
  std::string text = fmt::format(
      "The heading turns as a track width of {} at the robot file's wheel radius would have it", quantity(at_nominal));
  if (r.kinematics->radius_right.state == inference::KinematicState::identified) {
    text += fmt::format("; the wheel radii are {} right and {} left", quantity(r.kinematics->radius_right),
                        quantity(r.kinematics->radius_left));
  }
  return text + ".";
}

// What would show the parameters that the log does not show.
void add_unseen(const Identification& r, std::vector<std::string>& steps) {
  std::vector<bool> named(r.fit.excitation.size(), false);
  for (const inference::UnseenDirection& u : r.identifiability.unseen) {
    std::string step = sentence(u.words);
    for (const std::string& manoeuvre : u.manoeuvres) {
      step.append(" ").append(sentence(manoeuvre));
    }
    steps.push_back(step);
    for (const Eigen::Index j : u.members) {
      named[static_cast<std::size_t>(j)] = true;
    }
  }
  const auto shown = shown_parameters(r);
  for (const Excitation state : {Excitation::not_excited, Excitation::indistinct}) {
    for (const std::size_t j : in_state(r, state)) {
      if (!named[j]) {
        steps.push_back(sentence(spoken(shown[j].name) + ": " + r.fit.excitation[j].reason));
      }
    }
  }
}

void add_shape(const Identification& r, std::vector<std::string>& steps) {
  const ShapeFinding* shape = strongest(r);
  if (shape == nullptr) {
    return;
  }
  const std::string residual =
      fmt::format("it takes the residual to {:.2g} % of what it is without", 100.0 * shape->residual_ratio);
  if (shape->kind == ShapeKind::delay) {
    const bool motion = shape->estimate < 0.0;
    steps.push_back(fmt::format(
        "Check the clocks: the {} comes {} late ({}){}. Estimates that ignore it are biased: shift the time stamps and "
        "identify again.",
        motion ? "motion" : "effort", value_text(*shape, std::abs(shape->estimate)), residual,
        motion ? ", or the logged effort is a command that acts that much later" : ""));
  } else if (shape->kind == ShapeKind::stribeck_speed) {
    steps.push_back(fmt::format(
        "Friction bends at {} ({}): slow driving is not what viscous and dry friction say. Drive faster, or expect "
        "larger residuals there.",
        value_text(*shape, shape->estimate), residual));
  } else {
    steps.push_back(
        fmt::format("There is {} of {} ({}). Log the effort that acts (measured current) with its sensor's lag taken "
                    "out, or expect "
                    "biased estimates of inertia.",
                    kind_words(*shape), value_text(*shape, shape->estimate), residual));
  }
}

void add_noise(const Identification& r, std::vector<std::string>& steps) {
  if (r.fit.choice.in_doubt) {
    steps.emplace_back(
        "Noise of the motion may bias the estimate. Log the commanded speeds (command_r, command_l: they become "
        "instruments), or state encoder_counts_per_turn or noise: in the robot file.");
  }
  for (const commission::ColumnNoise& n : r.noise) {
    const bool loud = n.known && n.known->unit == n.unit && n.choice.method == inference::NoiseMethod::differences &&
                      n.choice.meaning == inference::NoiseMeaning::estimate && n.choice.sd > n.known->bound;
    if (loud) {
      steps.push_back(
          fmt::format("{} is noisier than its bound {} ({:.2g} {}): its standard deviation is {:.2g}. Raise "
                      "the bound in the robot file; bounds stand on it.",
                      n.column, n.known->origin, n.known->bound, n.unit, n.choice.sd));
    }
  }
}

void add_outliers(const Identification& r, std::vector<std::string>& steps) {
  if (!has_outliers(r) || r.robust.episodes.empty()) {
    return;
  }
  const inference::Episode& e = r.robust.episodes.front();
  steps.push_back(
      fmt::format("Residuals have heavy tails; the worst is at {:.2f} s ({:.2g} robust standard deviations). "
                  "Look at what happened there: a knock, slip, a lost message.",
                  e.worst_time, std::abs(e.worst)));
}

void add_loose(const Identification& r, std::vector<std::string>& steps) {
  const auto shown = shown_parameters(r);
  for (const std::size_t j : in_state(r, Excitation::identified)) {
    const double value = std::abs(shown[j].value(r.fit.estimate[static_cast<Eigen::Index>(j)]));
    const double half = std::abs(shown[j].scale.scale) * half_interval(r, j);
    if (half > kLoose * value) {
      const std::string& excite = r.setting.model.parameters[j].excite;
      steps.push_back(fmt::format(
          "{} is known to ± {:.2g} % only: a longer log helps{}. `wheelwright design` plans a "
          "drive.",
          core::capital(spoken(shown[j].name)), 100.0 * half / value, excite.empty() ? "" : ", and to " + excite));
    }
  }
}

void add_kinematics(const Identification& r, std::vector<std::string>& steps) {
  if (!r.kinematics) {
    return;
  }
  const inference::KinematicQuantity& t = r.kinematics->track_at_nominal_radius;
  const double nominal = r.setting.robot.track_width;
  if (t.state == inference::KinematicState::identified && (t.lower > nominal || t.upper < nominal) &&
      std::abs(t.estimate - nominal) > kOtherTrack * nominal) {
    steps.push_back(fmt::format(
        "The robot file's track width of {:.4g} m is not what the yaw rate goes by: with its wheel radius, that is "
        "{:.4g} m. A robot that skids has an effective track wider than its own.",
        nominal, t.estimate));
  }
}

}  // namespace

std::vector<ShownParameter> shown_parameters(const Identification& r) {
  const commission::Setting& s = r.setting;
  const auto scales = commission::physical_scales(s.robot, s.model);
  std::vector<ShownParameter> shown;
  for (std::size_t j = 0; j < s.model.p(); ++j) {
    const model::Parameter& p = s.model.parameters[j];
    shown.push_back(scales ? ShownParameter{p.physical, p.physical_unit, (*scales)[j]}
                           : ShownParameter{p.name, commission::parameter_unit(s.robot, p), {}});
  }
  return shown;
}

std::vector<inference::ActiveConstraint> binding(const inference::ConstrainedFit& fit) {
  std::vector<inference::ActiveConstraint> list;
  std::ranges::copy_if(fit.active, std::back_inserter(list),
                       [](const inference::ActiveConstraint& a) { return a.multiplier > 0.0; });
  return list;
}

bool matters(const ShapeFinding& shape) {
  if (shape.state != identify::ShapeState::identified || !(shape.residual_ratio < kShapeMatters)) {
    return false;
  }
  return shape.kind == ShapeKind::stribeck_speed || std::abs(shape.estimate) > half_interval(shape);
}

IdentificationStanding standing(const Identification& r) {
  if (!r.effort) {
    return r.kinematics && r.kinematics->track_at_nominal_radius.state == inference::KinematicState::identified
               ? IdentificationStanding::good
               : IdentificationStanding::bad;
  }
  if (r.fit.choice.candidates.empty() || in_state(r, Excitation::not_excited).size() == r.fit.excitation.size()) {
    return IdentificationStanding::bad;
  }
  const bool whole = in_state(r, Excitation::identified).size() == r.fit.excitation.size();
  return whole && !r.fit.choice.in_doubt && strongest(r) == nullptr ? IdentificationStanding::good
                                                                    : IdentificationStanding::caution;
}

std::string in_words(const ShapeFinding& shape) {
  const std::string name = core::capital(spoken(shape.name)) + ": ";
  const bool stribeck = shape.kind == ShapeKind::stribeck_speed;
  const std::string explains =
      fmt::format("the residual with it is {:.3g} % of that without", 100.0 * shape.residual_ratio);
  if (!shape.converged) {
    return name + "the search did not end; no value is given.";
  }
  switch (shape.state) {
    case identify::ShapeState::flat: return name + "the log does not show it: any value explains it equally well.";
    case identify::ShapeState::at_upper:
      return name + (stribeck
                         ? fmt::format("the log does not show it: the best is the largest that was tried, {}, which "
                                       "is no bend at low speed ({}).",
                                       value_text(shape, shape.estimate), explains)
                         : fmt::format("the largest that was tried, {}, is the best ({}): it is beyond, or something "
                                       "else is missing.",
                                       value_text(shape, shape.estimate), explains));
    case identify::ShapeState::at_lower:
      if (stribeck) {
        return name + fmt::format("the log does not show it: the best is the smallest that was tried, {} ({}).",
                                  value_text(shape, shape.estimate), explains);
      }
      return name + (shape.searched.lower < 0.0
                         ? fmt::format("the most negative that was tried, {}, is the best ({}): it is beyond, or "
                                       "something else is missing.",
                                       value_text(shape, shape.estimate), explains)
                         : std::string("none: the log is explained best without it."));
    case identify::ShapeState::identified: break;
  }
  const double half = half_interval(shape);
  const std::string value = fmt::format("{} ± {}", value_text(shape, shape.estimate), value_text(shape, half));
  if (!stribeck && std::abs(shape.estimate) <= half) {
    return name + fmt::format("none: {} holds zero.", value);
  }
  return name + value +
         (matters(shape) ? fmt::format("; {}.", explains) : fmt::format(", of no consequence: {}.", explains));
}

std::string verdict(const Identification& r) {
  if (!r.effort) {
    return standing(r) == IdentificationStanding::good
               ? "Kinematics only: the log has no efforts, its pose tells the effective track width."
               : "The log has no efforts, and its pose does not tell the track width.";
  }
  if (standing(r) == IdentificationStanding::bad) {
    return "The log shows no parameter.";
  }
  const std::size_t p = r.fit.excitation.size();
  const std::vector<std::size_t> unseen = in_state(r, Excitation::not_excited),
                                 small = in_state(r, Excitation::indistinct);
  std::string text = unseen.empty() && small.empty()
                         ? fmt::format("All {} parameters are identified", p)
                         : fmt::format("{} of {} parameters are identified", p - unseen.size() - small.size(), p);
  if (!unseen.empty()) {
    text += "; not shown: " + names_of(r, unseen);
  }
  if (!small.empty()) {
    text += "; not told from zero: " + names_of(r, small);
  }
  if (const ShapeFinding* shape = strongest(r)) {
    text += fmt::format("; but the model leaves out {} ({})", kind_words(*shape),
                        value_text(*shape, std::abs(shape->estimate)));
  } else if (r.fit.choice.in_doubt) {
    text += "; but noise of the motion may bias them";
  }
  return text + ".";
}

std::vector<std::string> findings(const Identification& r) {
  std::vector<std::string> list;
  const auto add = [&list](std::string text) {
    if (!text.empty()) {
      list.push_back(std::move(text));
    }
  };
  if (r.effort && standing(r) != IdentificationStanding::bad) {
    add(spread_sentence(r));
    add("Estimated by " + r.fit.choice.reason + ".");
    add(regions_sentence(r));
    add(robust_sentence(r));
    for (const inference::ActiveConstraint& a : binding(r.constrained)) {
      add(sentence(a.words));
    }
    const auto matter = std::ranges::count_if(r.shapes, matters);
    for (const ShapeFinding& shape : r.shapes) {
      if (matters(shape)) {
        add(in_words(shape));
      }
    }
    add(matter > 1 ? "Each of these was tried alone: they may be one and the same." : "");
    add(information_sentence(r));
  }
  add(kinematics_sentence(r));
  return list;
}

std::vector<std::string> next_steps(const Identification& r) {
  std::vector<std::string> steps;
  if (!r.effort) {
    add_kinematics(r, steps);
    steps.emplace_back("For mass, inertia and friction, log the wheels' torque, current or voltage too.");
    return steps;
  }
  add_shape(r, steps);
  add_unseen(r, steps);
  add_noise(r, steps);
  add_outliers(r, steps);
  add_loose(r, steps);
  add_kinematics(r, steps);
  for (const inference::RegionRow& row : r.regions.rows) {
    if (row.available && row.remark.find("short") != std::string::npos) {
      steps.push_back("Drive longer: " + row.remark + ".");
      break;
    }
  }
  if (steps.empty()) {
    steps.emplace_back(
        standing(r) == IdentificationStanding::bad
            ? "Drive so that every parameter shows: speed up and brake, drive curves, in both directions, for a minute "
              "or "
              "more."
            : "Nothing is missing. `wheelwright commission` makes bounds and thresholds of the same log.");
  }
  return steps;
}

}  // namespace wheelwright::words
