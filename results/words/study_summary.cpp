// SPDX-License-Identifier: Apache-2.0
#include "results/words/study_summary.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "results/words/text.hpp"

namespace wheelwright::words {
namespace {

constexpr std::size_t kFindings = 5;

std::string with_unit(const std::string& unit) { return unit.empty() || unit == "1" ? "" : " " + unit; }

std::string shown(double x) { return words::number(x, 3); }

std::string interval(const study::SobolIndex& index) {
  return fmt::format("{} [{}, {}]", words::decimal(index.estimate, 2), words::decimal(index.lower, 2),
                     words::decimal(index.upper, 2));
}

std::string one_at_a_time_lines(const study::Study& study, const study::OneAtATime& found) {
  std::string out;
  for (const std::size_t i : found.order) {
    const study::StudyInput& input = study.inputs[i];
    const study::InputCurve& curve = found.inputs[i];
    const std::string range = fmt::format("{} … {}{}", shown(input.lower), shown(input.upper), with_unit(input.unit));
    out += "  " + padded(input.name, 26) + padded(range, 26) + shown(curve.low) + " … " + shown(curve.high) + "\n";
  }
  return out;
}

std::string sobol_lines(const study::Study& study, const study::SobolIndices& found) {
  if (found.status != study::SobolStatus::estimated) {
    return found.status == study::SobolStatus::constant ? "  does not depend on the inputs\n"
                                                        : "  too few points have a value for Sobol indices\n";
  }
  std::string out = "  " + padded("share of the variance", 26) + padded("alone", 26) + "with all interactions\n";
  for (std::size_t i = 0; i < found.first.size(); ++i) {
    out += "  " + padded(study.inputs[i].name, 26) + padded(interval(found.first[i]), 26) + interval(found.total[i]) +
           "\n";
  }
  if (found.left_out > 0.0) {
    out += fmt::format("  {} of the base points have no value: the shares are those of the rest\n",
                       words::percent(found.left_out));
  }
  return out;
}

std::string morris_lines(const study::Study& study, const std::vector<study::ElementaryEffects>& found) {
  std::string out =
      "  " + padded("elementary effects", 26) + padded("μ* over the whole range", 26) + "σ (curvature, interactions)\n";
  for (std::size_t i = 0; i < found.size(); ++i) {
    const study::ElementaryEffects& e = found[i];
    out += "  " + padded(study.inputs[i].name, 26) +
           padded(fmt::format("{} [{}, {}]", shown(e.mean_absolute), shown(e.lower), shown(e.upper)), 26) +
           shown(e.deviation) + "\n";
  }
  return out;
}

std::string local_lines(const study::LocalSensitivity& local) {
  if (local.inputs.empty()) {
    return {};
  }
  std::string out = padded("per cent of width per per cent of", 36);
  for (const std::string& parameter : local.parameters) {
    out += padded(parameter, 18);
  }
  out += "\n";
  for (const study::LocalDerivative& input : local.inputs) {
    out += "  " + padded(input.input, 34);
    for (const study::ParameterDerivative& d : input.parameters) {
      out += padded(d.elasticity ? shown(*d.elasticity) : "–", 18);
    }
    out += "\n";
  }
  const std::vector<std::string> kinks = study::not_differentiable(local);
  if (!kinks.empty()) {
    out += fmt::format("  –: not differentiable there ({} in all; the report and the JSON say why)\n", kinks.size());
  }
  return out;
}

}  // namespace

std::string summary(const study::Study& study, const study::StudyResult& result,
                    const std::optional<study::LocalSensitivity>& local) {
  std::string out;
  for (std::size_t q = 0; q < study.quantities.size(); ++q) {
    out += study.quantities[q].name + with_unit(study.quantities[q].unit);
    if (!result.one_at_a_time.empty()) {
      out += ": " + shown(result.one_at_a_time[q].nominal) + " as it is\n" +
             one_at_a_time_lines(study, result.one_at_a_time[q]);
    } else {
      out += "\n";
    }
    if (!result.morris.empty()) {
      out += morris_lines(study, result.morris[q]);
    }
    if (!result.sobol.empty()) {
      out += sobol_lines(study, result.sobol[q]);
    }
  }
  out += local ? local_lines(*local) : std::string();
  std::size_t without = 0;
  for (const study::StudyFinding& finding : result.findings) {
    without += finding.points;
  }
  if (without > 0) {
    out += fmt::format("{} of {} points gave no model:\n", without, result.points);
    for (std::size_t k = 0; k < std::min(kFindings, result.findings.size()); ++k) {
      out += fmt::format("  {:5} {}\n", result.findings[k].points, result.findings[k].sentence);
    }
  }
  return out;
}

}  // namespace wheelwright::words
