// SPDX-License-Identifier: Apache-2.0
#include "study/study.hpp"

#include <algorithm>
#include <charconv>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "commission/setting.hpp"
#include "core/check.hpp"

namespace wheelwright::study {
namespace {

Eigen::Index inputs_of(const Study& study) { return static_cast<Eigen::Index>(study.inputs.size()); }

// The values of a method's points.
Eigen::MatrixXd of_part(const Eigen::MatrixXd& values, const StudyDesign& design, const StudyDesign::Part& part) {
  Eigen::MatrixXd rows(part.count, values.cols());
  for (Eigen::Index row = 0; row < part.count; ++row) {
    const std::size_t item = design.items[static_cast<std::size_t>(part.first + row)];
    rows.row(row) = values.row(static_cast<Eigen::Index>(item));
  }
  return rows;
}

double value_at(const StudyInput& input, double u, double nominal) {
  return u == nominal ? input.nominal : value(input, u);
}

void number_items(StudyDesign& design) {
  std::map<std::vector<double>, std::size_t> known;
  for (Eigen::Index row = 0; row < design.points.rows(); ++row) {
    const Eigen::VectorXd point = design.points.row(row);
    const auto [at, is_new] = known.try_emplace({point.begin(), point.end()}, design.rows.size());
    if (is_new) {
      design.rows.push_back(static_cast<std::size_t>(row));
    }
    design.items.push_back(at->second);
  }
}

}  // namespace

std::string settle_filter(StudyCase& subject, const std::vector<std::string>& inputs) {
  const bool varied = std::ranges::any_of(inputs, [](const std::string& name) { return name.starts_with("filter."); });
  if (!varied || subject.robot.filter.beta) {
    return {};
  }
  const LogTable table = drive_of_case(subject);
  TableSource log(table);
  const FilterDesign design = commission::settle(log, subject.robot).filter;
  subject.robot.filter.order = design.order;
  subject.robot.filter.beta = design.beta;
  if (std::ranges::find(inputs, "filter.alpha") != inputs.end()) {
    subject.robot.filter.alpha = subject.robot.filter.alpha.value_or(design.alpha);
  }
  return fmt::format(
      "the filter's nominal constants were chosen from the drive: order {}, β = {:.4g} 1/s, {}", design.order,
      design.beta,
      subject.robot.filter.alpha ? fmt::format("α = {:.4g} 1/s", *subject.robot.filter.alpha) : "α the same as β");
}

Eigen::VectorXd nominal_point(const std::vector<StudyInput>& inputs) {
  Eigen::VectorXd point(static_cast<Eigen::Index>(inputs.size()));
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    point[static_cast<Eigen::Index>(i)] = std::clamp(coordinate(inputs[i], inputs[i].nominal), 0.0, 1.0);
  }
  return point;
}

StudyDesign design_of(const Study& study) {
  const Eigen::Index k = inputs_of(study);
  check::that(k > 0, "inputs", "at least one");
  const StudyMethods& methods = study.methods;
  check::that(methods.local || methods.one_at_a_time || methods.morris || methods.sobol || methods.grid, "methods",
              "at least one of local, one_at_a_time, morris, sobol and grid");
  std::vector<Eigen::MatrixXd> parts;
  Eigen::Index count = 0;
  const auto add = [&](StudyDesign::Part& part, Eigen::MatrixXd points) {
    part = {count, points.rows()};
    count += points.rows();
    parts.push_back(std::move(points));
  };
  StudyDesign design;
  if (methods.one_at_a_time) {
    add(design.one_at_a_time, one_at_a_time_design(nominal_point(study.inputs), *methods.one_at_a_time));
  }
  if (methods.morris) {
    add(design.morris, morris_design(k, *methods.morris));
  }
  if (methods.sobol) {
    add(design.sobol, sobol_design(k, *methods.sobol));
  }
  if (methods.grid) {
    add(design.grid, grid_design(*methods.grid));
  }
  design.points.resize(count, k);
  Eigen::Index at = 0;
  for (const Eigen::MatrixXd& part : parts) {
    design.points.middleRows(at, part.rows()) = part;
    at += part.rows();
  }
  number_items(design);
  return design;
}

StudyCase case_at(const Study& study, const Eigen::VectorXd& point) {
  StudyCase subject = study.subject;
  const Eigen::VectorXd nominal = nominal_point(study.inputs);
  for (std::size_t i = 0; i < study.inputs.size(); ++i) {
    const StudyInput& input = study.inputs[i];
    const auto at = static_cast<Eigen::Index>(i);
    set_input(subject, input.name, value_at(input, point[at], nominal[at]));
  }
  return subject;
}

std::string name_of_point(const Study& study, const Eigen::VectorXd& point) {
  const Eigen::VectorXd nominal = nominal_point(study.inputs);
  std::string name;
  for (std::size_t i = 0; i < study.inputs.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    name += fmt::format("{}{} = {}", i > 0 ? ", " : "", study.inputs[i].name,
                        value_at(study.inputs[i], point[at], nominal[at]));
  }
  return name;
}

CaseResult evaluate_point(const Study& study, const Eigen::VectorXd& point) {
  try {
    return evaluate_case(case_at(study, point), study.quantities, study.evaluate);
  } catch (const Error& error) {
    CaseResult result;
    result.finding = error.what();
    for (const StudyQuantity& quantity : study.quantities) {
      result.values.push_back(
          quantity.kind == StudyQuantity::Kind::commissioned ? 0.0 : std::numeric_limits<double>::quiet_NaN());
    }
    return result;
  }
}

std::string text_of(const CaseResult& result) {
  return fmt::format("{}\n{}", fmt::join(result.values, " "), result.finding);
}

CaseResult case_result(std::string_view text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  CaseResult result;
  const char* at = text.data();
  const char* const last = text.data() + end;
  while (at != last) {
    double x = 0.0;
    const auto [next, error] = std::from_chars(at, last, x);
    check::that(error == std::errc() && (next == last || *next == ' '), "result", "numbers with blanks between them");
    result.values.push_back(x);
    at = next == last ? last : next + 1;
  }
  if (end < text.size()) {
    result.finding = text.substr(end + 1);
  }
  return result;
}

StudyValues::StudyValues(const Study& study, const StudyDesign& design) : study_(&study), design_(&design) {
  values_.setConstant(static_cast<Eigen::Index>(design.rows.size()), static_cast<Eigen::Index>(study.quantities.size()),
                      std::numeric_limits<double>::quiet_NaN());
}

void StudyValues::put(std::size_t item, const CaseResult& result) {
  check::that(result.values.size() == study_->quantities.size(), "result", "a value for each quantity");
  for (std::size_t q = 0; q < result.values.size(); ++q) {
    values_(static_cast<Eigen::Index>(item), static_cast<Eigen::Index>(q)) = result.values[q];
  }
  if (!result.finding.empty()) {
    const auto at = std::ranges::find(findings_, result.finding, &StudyFinding::sentence);
    if (at == findings_.end()) {
      findings_.push_back({result.finding, 1});
    } else {
      ++at->points;
    }
  }
}

StudyResult StudyValues::result() const {
  const StudyMethods& methods = study_->methods;
  const Eigen::Index k = inputs_of(*study_);
  StudyResult result;
  result.points = design_->rows.size();
  if (methods.one_at_a_time) {
    result.one_at_a_time = one_at_a_time(of_part(values_, *design_, design_->one_at_a_time), k, *methods.one_at_a_time);
  }
  if (methods.morris) {
    result.morris = morris_effects(of_part(values_, *design_, design_->morris), k, *methods.morris);
  }
  if (methods.sobol) {
    result.sobol = sobol_indices(of_part(values_, *design_, design_->sobol), k, *methods.sobol);
  }
  result.grid = of_part(values_, *design_, design_->grid);
  result.findings = findings_;
  std::ranges::stable_sort(result.findings, std::ranges::greater(), &StudyFinding::points);
  return result;
}

}  // namespace wheelwright::study
