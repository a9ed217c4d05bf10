// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/sensitivity_report.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/report/chart.hpp>
#include <wheelwright/report/data_sections.hpp>
#include <wheelwright/report/page.hpp>
#include <wheelwright/report/sensitivity_drawings.hpp>
#include <wheelwright/words/text.hpp>

namespace wheelwright::report {

using study::Study;

using namespace words;

namespace {

constexpr std::size_t kCurves = 4;     // of a quantity, the inputs that swing it most
constexpr std::size_t kSentences = 6;  // at the head of the page
constexpr std::size_t kFindings = 10;
constexpr double kLarge = 0.05;  // share of left-out points from which indices mean little

AxisLabel axis(const study::StudyQuantity& quantity) { return {quantity.name, unit_of(quantity.unit)}; }
AxisLabel axis(const study::StudyInput& input) { return {input.name, unit_of(input.unit)}; }

std::string range_of(const study::StudyInput& input) {
  return words::with_unit(fmt::format("{} … {}", number(input.lower), number(input.upper)), unit_of(input.unit));
}

std::vector<std::string> names_of(const Study& study) {
  std::vector<std::string> names;
  for (const study::StudyInput& input : study.inputs) {
    names.push_back(input.name);
  }
  return names;
}

// The input that matters most for a quantity, in a sentence; empty where no method says it.
std::string sentence(const Study& study, const study::StudyResult& result, std::size_t q) {
  const study::StudyQuantity& quantity = study.quantities[q];
  if (!result.sobol.empty() && result.sobol[q].status == study::SobolStatus::estimated) {
    const auto& total = result.sobol[q].total;
    const auto most = std::ranges::max_element(total, {}, &study::SobolIndex::estimate);
    return fmt::format("{}: most of its variance comes with {} (total index {}, 95 % interval {} to {})", quantity.name,
                       study.inputs[static_cast<std::size_t>(most - total.begin())].name, decimal(most->estimate, 2),
                       decimal(most->lower, 2), decimal(most->upper, 2));
  }
  if (!result.one_at_a_time.empty() && !result.one_at_a_time[q].order.empty()) {
    const study::OneAtATime& found = result.one_at_a_time[q];
    const study::InputCurve& curve = found.inputs[found.order.front()];
    if (!std::isfinite(curve.swing) || curve.swing == 0.0) {
      return {};
    }
    const study::StudyInput& input = study.inputs[found.order.front()];
    return fmt::format("{}: {} as it is; {} swings it most, {} to {} for {}", quantity.name,
                       words::with_unit(number(found.nominal), unit_of(quantity.unit)), input.name, number(curve.low),
                       number(curve.high), range_of(input));
  }
  return {};
}

std::string curves(const Study& study, const study::OneAtATime& found, const study::StudyQuantity& quantity) {
  std::string out;
  for (std::size_t k = 0; k < std::min(kCurves, found.order.size()); ++k) {
    const std::size_t i = found.order[k];
    const study::InputCurve& curve = found.inputs[i];
    if (!(curve.swing > 0.0)) {
      continue;
    }
    Eigen::VectorXd x(curve.coordinates.size());
    for (Eigen::Index at = 0; at < x.size(); ++at) {
      x[at] = study::value(study.inputs[i], curve.coordinates[at]);
    }
    out += "<div>" +
           sensitivity_curve(x, curve.values, study.inputs[i].nominal, found.nominal, study.inputs[i].logarithmic,
                             axis(study.inputs[i]), axis(quantity)) +
           "</div>";
  }
  return out;
}

std::string sobol_part(const Study& study, const study::SobolIndices& found) {
  if (found.status == study::SobolStatus::constant) {
    return paragraph("It does not depend on the inputs.");
  }
  if (found.status == study::SobolStatus::too_few) {
    return paragraph("Too few points have a value for shares of the variance.");
  }
  std::string out = "<div>" + sobol_bars(found, names_of(study)) + "</div>";
  if (found.left_out > kLarge) {
    out +=
        paragraph(escape(percent(found.left_out)) +
                  " of the base points have no value and are left out: the shares are those of the rest, whose inputs "
                  "are no longer independent; they mean little.");
  }
  return out;
}

std::string maps(const Study& study, const study::StudyResult& result, std::size_t q) {
  if (!study.methods.grid) {
    return {};
  }
  const study::Grid& grid = *study.methods.grid;
  std::vector<Eigen::Index> varied;
  for (std::size_t i = 0; i < grid.levels.size(); ++i) {
    if (grid.levels[i] > 1) {
      varied.push_back(static_cast<Eigen::Index>(i));
    }
  }
  if (varied.size() < 2) {
    return {};
  }
  std::vector<Eigen::Index> middle;
  for (const Eigen::Index levels : grid.levels) {
    middle.push_back(levels / 2);
  }
  const study::GridMap map =
      study::grid_map(grid, result.grid.col(static_cast<Eigen::Index>(q)), varied[0], varied[1], middle);
  const auto values = [&](const Eigen::VectorXd& coordinates, Eigen::Index i) {
    Eigen::VectorXd x(coordinates.size());
    for (Eigen::Index at = 0; at < x.size(); ++at) {
      x[at] = study::value(study.inputs[static_cast<std::size_t>(i)], coordinates[at]);
    }
    return x;
  };
  return "<div>" +
         sensitivity_map(map, values(map.x, varied[0]), values(map.y, varied[1]),
                         axis(study.inputs[static_cast<std::size_t>(varied[0])]),
                         axis(study.inputs[static_cast<std::size_t>(varied[1])]), axis(study.quantities[q])) +
         "</div>";
}

Section quantity_section(const Study& study, const study::StudyResult& result, std::size_t q) {
  const study::StudyQuantity& quantity = study.quantities[q];
  std::string body;
  if (!result.one_at_a_time.empty()) {
    body += "<h3>One input at a time</h3><div class=\"pairs\"><div>" +
            tornado(result.one_at_a_time[q], names_of(study), axis(quantity)) + "</div>" +
            curves(study, result.one_at_a_time[q], quantity) + "</div>";
  }
  if (!result.sobol.empty()) {
    body += "<h3>Shares of its variance</h3>" + sobol_part(study, result.sobol[q]);
  }
  if (!result.morris.empty()) {
    body += "<h3>Elementary effects</h3><div>" + morris_scatter(result.morris[q], names_of(study), axis(quantity)) +
            "</div>";
  }
  const std::string map = maps(study, result, q);
  body += map.empty() ? "" : "<h3>Map</h3>" + map;
  return {"quantity-" + std::to_string(q),
          words::with_unit(quantity.name, quantity.unit == "1" ? "" : "in " + quantity.unit), body};
}

std::string one_sided(const study::OneSided& derivative) {
  const bool both = derivative.left == derivative.right ||
                    std::abs(derivative.left - derivative.right) <= 1e-6 * std::abs(derivative.left);
  return both ? number(derivative.right) : number(derivative.left) + " / " + number(derivative.right);
}

Section local_section(const study::LocalSensitivity& local) {
  std::vector<Cell> header = {"Input"};
  for (std::size_t j = 0; j < local.parameters.size(); ++j) {
    header.push_back(
        numeric(escape(spaced(local.parameters[j])) + "<small>width, " + escape(local.units[j]) + "</small>"));
  }
  std::vector<std::vector<Cell>> rows;
  for (const study::LocalDerivative& input : local.inputs) {
    std::vector<Cell> row = {escape(input.input) + "<small>" +
                             escape(words::with_unit(number(input.value), unit_of(input.unit))) + "</small>"};
    for (const study::ParameterDerivative& d : input.parameters) {
      row.push_back(numeric(escape(one_sided(d.width)) +
                            (d.elasticity ? "<small>elasticity " + escape(number(*d.elasticity)) + "</small>"
                                          : "<small>not differentiable</small>")));
    }
    rows.push_back(std::move(row));
  }
  std::string body = local.inputs.empty() ? std::string() : table(header, rows);
  body += warrant_note(local.warrant);
  body += paragraph(
      "<span class=\"note\">Rate at which the width of each interval of bounds changes with an input, from the "
      "multipliers of the linear programs that bound it: exact for this log as long as the same samples hold the "
      "bounds. "
      "Two numbers are the rates below and above the value. Elasticity: per cent of width per per cent of the "
      "input.</span>");
  const std::vector<std::string> kinks = study::not_differentiable(local);
  if (!kinks.empty()) {
    body += "<h3>Where there is no derivative</h3>" + bullets(kinks);
  }
  return {"local", "Derivatives of the bounds", body + bullets(local.notes)};
}

Section inputs_section(const Study& study) {
  std::vector<std::vector<Cell>> rows;
  for (const study::StudyInput& input : study.inputs) {
    rows.push_back({escape(input.name), numeric(escape(number(input.lower))), numeric(escape(number(input.nominal))),
                    numeric(escape(number(input.upper))), escape(unit_of(input.unit)),
                    input.logarithmic ? "logarithmic" : "linear"});
  }
  return {"inputs", "Inputs",
          table({"Input", numeric("from"), numeric("nominal"), numeric("to"), "Unit", "Scale"}, rows)};
}

}  // namespace

std::string sensitivity_report(const Study& study, const study::StudyResult& result,
                               const std::optional<study::LocalSensitivity>& local,
                               const std::vector<std::string>& notes, const ReportContext& context) {
  PageContent content;
  content.title = study.name.empty() ? "Sensitivity of " + study.subject.robot.name : study.name;
  content.software = context.software;
  std::size_t without = 0;
  for (const study::StudyFinding& finding : result.findings) {
    without += finding.points;
  }
  content.status = without == 0 ? "good" : "caution";
  content.verdict =
      fmt::format("{}, {} evaluated", plural(study.inputs.size(), "input"), plural(result.points, "point"));
  for (std::size_t q = 0; q < study.quantities.size() && content.sentences.size() < kSentences; ++q) {
    const std::string said = sentence(study, result, q);
    if (!said.empty()) {
      content.sentences.push_back(said);
    }
  }
  if (without > 0) {
    content.sentences.push_back(fmt::format("{} of {} points gave no model", count(without), count(result.points)));
  }
  for (std::size_t q = 0; q < study.quantities.size(); ++q) {
    content.sections.push_back(quantity_section(study, result, q));
  }
  if (local) {
    content.sections.push_back(local_section(*local));
  }
  content.sections.push_back(inputs_section(study));
  if (without > 0) {
    std::vector<std::string> found;
    for (std::size_t k = 0; k < std::min(kFindings, result.findings.size()); ++k) {
      found.push_back(fmt::format("{}: {}", plural(result.findings[k].points, "point"), result.findings[k].sentence));
    }
    content.sections.push_back({"findings", "Points without a model", bullets(found)});
  }
  content.sections.push_back({"provenance", "Where this came from", bullets(notes) + provenance(context, TimeAxis())});
  return page(content);
}

}  // namespace wheelwright::report
