// SPDX-License-Identifier: Apache-2.0
#include "study/study_quantity.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <utility>

#include "commission/commission.hpp"
#include "commission/margin_survey.hpp"
#include "commission/physical.hpp"
#include "commission/watch/detector_walk.hpp"
#include "core/error.hpp"
#include "core/limits.hpp"
#include "core/words.hpp"
#include "detector/online_model.hpp"
#include "gap/diagnose.hpp"
#include "model/fault_type.hpp"

namespace wheelwright::study {
namespace {

using Kind = StudyQuantity::Kind;

const std::vector<std::pair<std::string, Kind>>& families() {
  static const std::vector<std::pair<std::string, Kind>> all = {
      {"lower", Kind::lower},
      {"upper", Kind::upper},
      {"width", Kind::width},
      {"estimate", Kind::estimate},
      {"standard_error", Kind::standard_error},
      {"threshold.mean", Kind::threshold_mean},
      {"threshold.peak", Kind::threshold_peak},
      {"smallest_fault", Kind::smallest_fault},
      {"delay", Kind::delay},
      {"false_alarms", Kind::false_alarms},
      {"commissioned", Kind::commissioned},
      {"polytope_over_box", Kind::polytope_over_box},
      {"gap", Kind::gap},
  };
  return all;
}

[[noreturn]] void fail(const std::string& name, const std::string& expected) {
  throw InvalidArgument("quantity " + name + ": expected " + expected);
}

struct Reader {
  const Robot& robot;
  Model model;
  std::vector<StudyQuantity> found = {};

  void read(const std::string& name) {
    for (const auto& [family, kind] : families()) {
      if (name == family || name.starts_with(family + ".")) {
        read_member(name, family, kind, name.size() > family.size() ? name.substr(family.size() + 1) : std::string());
        return;
      }
    }
    std::vector<std::string> known;
    for (const auto& [family, kind] : families()) {
      known.push_back(family);
    }
    fail(name, "one of " + core::listed(known));
  }

  void read_member(const std::string& name, const std::string& family, Kind kind, const std::string& member) {
    StudyQuantity q;
    q.name = name;
    q.kind = kind;
    switch (kind) {
      case Kind::lower:
      case Kind::upper:
      case Kind::width:
      case Kind::estimate:
      case Kind::standard_error: read_parameter(std::move(q), family, member); return;
      case Kind::threshold_mean:
      case Kind::threshold_peak: read_output(std::move(q), family, member); return;
      case Kind::smallest_fault:
      case Kind::delay: read_fault(std::move(q), member); return;
      case Kind::gap:
        if (member != "no_gap" && member != "explained" && member != "ambiguous" && member != "unexplained") {
          fail(name, "gap.no_gap, gap.explained, gap.ambiguous or gap.unexplained");
        }
        q.subject = member;
        break;
      default:
        if (!member.empty()) {
          fail(name, family);
        }
    }
    if (kind == Kind::false_alarms || kind == Kind::polytope_over_box) {
      q.unit = "1";
    }
    found.push_back(std::move(q));
  }

  void read_parameter(StudyQuantity q, const std::string& family, const std::string& member) {
    std::vector<std::string> names;
    const std::size_t before = found.size();
    for (std::size_t j = 0; j < model.p(); ++j) {
      const model::Parameter& parameter = model.parameters[j];
      names.push_back(parameter.name);
      if (member.empty() || member == parameter.name || member == parameter.physical) {
        q.name = family + "." + parameter.name;
        q.unit = commission::parameter_unit(robot, parameter);
        q.index = j;
        found.push_back(q);
      }
    }
    if (found.size() == before) {
      fail(q.name, family + " of one of the parameters " + core::listed(names));
    }
  }

  void read_output(StudyQuantity q, const std::string& family, const std::string& member) {
    const std::size_t before = found.size();
    for (std::size_t i = 0; i < model.n(); ++i) {
      if (member.empty() || member == model.outputs[i]) {
        q.name = family + "." + model.outputs[i];
        q.unit = commission::output_unit(robot, model.output_units[i]);
        q.index = i;
        found.push_back(q);
      }
    }
    if (found.size() == before) {
      fail(q.name, family + " of one of the outputs " + core::listed(model.outputs));
    }
  }

  void read_fault(StudyQuantity q, const std::string& member) {
    const std::size_t equals = member.find('=');
    q.subject = member.substr(0, equals);
    const Eigen::VectorXd theta = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(model.p()));
    const std::vector<FaultType> faults = model::fault_catalogue(model, theta, robot.effort);
    q.unit = q.kind == Kind::delay ? "s" : model::find_fault(faults, q.subject).unit;
    if (q.kind == Kind::delay) {
      const std::string text = equals == std::string::npos ? "" : member.substr(equals + 1);
      char* end = nullptr;
      q.size = std::strtod(text.c_str(), &end);
      if (text.empty() || *end != '\0' || !(q.size > 0.0) || !std::isfinite(q.size)) {
        fail(q.name, "delay.FAULT=SIZE with a size > 0 in the unit of the fault");
      }
    } else if (equals != std::string::npos) {
      fail(q.name, "smallest_fault.FAULT without a size");
    }
    found.push_back(std::move(q));
  }
};

bool asks(const std::vector<StudyQuantity>& quantities, std::initializer_list<Kind> kinds) {
  return std::ranges::any_of(quantities,
                             [&](const StudyQuantity& q) { return std::ranges::find(kinds, q.kind) != kinds.end(); });
}

double share_outside(const Commissioning& result) {
  std::size_t outside = 0, instants = 0;
  for (const commission::OutputValidation& v : result.validation) {
    outside += v.outside;
    instants += v.instants;
  }
  return instants > 0 ? static_cast<double>(outside) / static_cast<double>(instants) : core::kNan;
}

struct Thresholds {
  std::vector<double> mean, peak;  // one for each output
};

Thresholds thresholds_over(LogSource& log, const OnlineModel& model) {
  Thresholds t{std::vector<double>(model.model.n(), 0.0), std::vector<double>(model.model.n(), 0.0)};
  std::size_t instants = 0;
  Detector detector = make_detector(model);
  commission::walk_detector(log, detector, [&](std::size_t, double, bool, const Decision& decision) {
    ++instants;
    for (std::size_t i = 0; i < decision.channels.size(); ++i) {
      const double rho = decision.channels[i].threshold.rho();
      t.mean[i] += rho;
      t.peak[i] = std::max(t.peak[i], rho);
    }
  });
  for (std::size_t i = 0; i < t.mean.size(); ++i) {
    t.mean[i] = instants > 0 ? t.mean[i] / static_cast<double>(instants) : core::kNan;
    t.peak[i] = instants > 0 ? t.peak[i] : core::kNan;
  }
  return t;
}

commission::MarginSurvey survey_faults(LogSource& log, const OnlineModel& model,
                                       const std::vector<StudyQuantity>& quantities, const EvaluateOptions& options) {
  commission::MarginSurveyOptions ask;
  ask.map_points = 0;
  ask.margins.most_onsets = options.most_onsets;
  std::vector<double>& windows = ask.margins.windows;
  if (!asks(quantities, {Kind::delay})) {
    windows.clear();
  }
  windows.push_back(options.window);
  std::ranges::sort(windows);
  windows.erase(std::unique(windows.begin(), windows.end()), windows.end());
  for (const StudyQuantity& q : quantities) {
    if ((q.kind == Kind::smallest_fault || q.kind == Kind::delay) &&
        std::ranges::find(ask.faults, q.subject) == ask.faults.end()) {
      ask.faults.push_back(q.subject);
    }
  }
  return commission::survey_margins(log, model, ask);
}

// Of the residual that sees the fault best, on the side on which it sees it worst.
template <typename Answer>
double over_sides(const commission::MarginSurvey& survey, const std::string& fault, const Answer& answer) {
  double best = std::numeric_limits<double>::infinity();
  for (const commission::ResidualMargins& residual : survey.residuals) {
    double worst = 0.0;
    bool seen = false;
    for (const detector::FaultMargins& margins : residual.margins) {
      if (margins.fault.name == fault) {
        seen = true;
        worst = std::max(worst, answer(margins));
      }
    }
    best = seen ? std::min(best, worst) : best;
  }
  return best;
}

double fault_value(const commission::MarginSurvey& survey, const StudyQuantity& q, double window) {
  const auto at = static_cast<std::size_t>(std::ranges::find(survey.windows, window) - survey.windows.begin());
  if (q.kind == Kind::smallest_fault) {
    return over_sides(survey, q.subject,
                      [&](const detector::FaultMargins& margins) { return detector::summarise(margins, at).median; });
  }
  return over_sides(survey, q.subject, [&](const detector::FaultMargins& margins) {
    for (std::size_t w = 0; w < survey.windows.size(); ++w) {
      if (detector::summarise(margins, w).median <= q.size) {
        return survey.windows[w];
      }
    }
    return std::numeric_limits<double>::infinity();
  });
}

void read_off(LogSource& log, const StudyCase& subject, const std::vector<StudyQuantity>& quantities,
              const EvaluateOptions& options, CaseResult& result) {
  commission::CommissionOptions commissioning;
  commissioning.outliers = subject.outliers_allowed;
  commissioning.at_risk = commission::CommissionOptions::AtRisk::nothing;
  const Commissioning c = commission_robot(log, subject.robot, commissioning);
  const bool model = !c.model.facets.empty();
  if (!model) {
    result.finding = c.message;
  }
  std::optional<Thresholds> thresholds;
  std::optional<commission::MarginSurvey> margins;
  std::optional<gap::GapVerdict> verdict;
  if (model && asks(quantities, {Kind::threshold_mean, Kind::threshold_peak})) {
    thresholds = thresholds_over(log, c.model);
  }
  if (model && asks(quantities, {Kind::smallest_fault, Kind::delay})) {
    margins = survey_faults(log, c.model, quantities, options);
  }
  if (asks(quantities, {Kind::gap})) {
    gap::DiagnoseOptions diagnosis;
    diagnosis.shrink = false;
    verdict = diagnose(log, nullptr, subject.robot, diagnosis).verdict;
  }
  for (std::size_t i = 0; i < quantities.size(); ++i) {
    const StudyQuantity& q = quantities[i];
    double& value = result.values[i];
    if (q.kind == Kind::commissioned) {
      value = model ? 1.0 : 0.0;
    } else if (q.kind == Kind::gap) {
      value = gap::to_string(*verdict) == q.subject ? 1.0 : 0.0;
    } else if (model) {
      switch (q.kind) {
        case Kind::lower: value = c.parameters[q.index].lower; break;
        case Kind::upper: value = c.parameters[q.index].upper; break;
        case Kind::width: value = c.parameters[q.index].upper - c.parameters[q.index].lower; break;
        case Kind::estimate: value = c.parameters[q.index].estimate.value_or(core::kNan); break;
        case Kind::standard_error: value = c.parameters[q.index].standard_error.value_or(core::kNan); break;
        case Kind::threshold_mean: value = thresholds->mean[q.index]; break;
        case Kind::threshold_peak: value = thresholds->peak[q.index]; break;
        case Kind::smallest_fault:
        case Kind::delay: value = fault_value(*margins, q, options.window); break;
        case Kind::false_alarms: value = share_outside(c); break;
        case Kind::polytope_over_box: value = c.polytope_over_box; break;
        default: break;
      }
    }
  }
}

}  // namespace

std::vector<StudyQuantity> study_quantities(const std::vector<std::string>& names, const Robot& robot) {
  static const std::vector<std::string> usual = {"width", "threshold.mean", "smallest_fault.wheel_radius",
                                                 "false_alarms", "commissioned"};
  Reader reader{robot, model::make_model(robot)};
  for (const std::string& name : names.empty() ? usual : names) {
    if (names.empty() && name.starts_with("smallest_fault") && !model::on_two_wheels(robot)) {
      continue;
    }
    reader.read(name);
  }
  return std::move(reader.found);
}

CaseResult evaluate_case(const StudyCase& subject, const std::vector<StudyQuantity>& quantities,
                         const EvaluateOptions& options) {
  CaseResult result;
  result.values.assign(quantities.size(), core::kNan);
  const auto without_model = [&](const std::string& why) {
    result.finding = why;
    for (std::size_t i = 0; i < quantities.size(); ++i) {
      result.values[i] = quantities[i].kind == Kind::commissioned ? 0.0 : core::kNan;
    }
  };
  try {
    const LogTable table = drive_of_case(subject);
    TableSource log(table);
    read_off(log, subject, quantities, options, result);
  } catch (const Error& error) {
    without_model(error.what());
  }
  return result;
}

}  // namespace wheelwright::study
