// SPDX-License-Identifier: Apache-2.0
#include "results/words/identification_summary.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "results/words/identification_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::words {
namespace {

constexpr std::size_t kWidth = 110;  // of a line of words

// `text` in lines, the first one after `first` and the others as deep.
std::string wrapped(std::string_view text, const std::string& first) {
  const std::string indent(text_width(first), ' ');
  std::string out = first, line;
  const auto flush = [&] {
    out += line + "\n";
    line.clear();
  };
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    const std::string_view word = text.substr(at, end - at);
    if (!line.empty() && text_width(line) + text_width(word) + 1 + indent.size() > kWidth) {
      flush();
      out += indent;
    }
    line += line.empty() ? "" : " ";
    line += word;
    at = end + 1;
  }
  flush();
  return out;
}

// A table as rows of cells, the first column set to the left and the others to the right.
std::string aligned(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> width;
  for (const auto& row : rows) {
    width.resize(std::max(width.size(), row.size()), 0);
    for (std::size_t c = 0; c < row.size(); ++c) {
      width[c] = std::max(width[c], text_width(row[c]));
    }
  }
  std::string out;
  for (const auto& row : rows) {
    std::string line = " ";
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string blanks(width[c] - text_width(row[c]), ' ');
      line += c == 0 ? " " + row[c] + blanks : "  " + blanks + row[c];
    }
    out += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return out;
}

// How many digits after the point show `spread` with two digits.
int decimals(double spread) {
  return spread > 0.0 && std::isfinite(spread) ? std::clamp(1 - static_cast<int>(std::floor(std::log10(spread))), 0, 12)
                                               : 4;
}

std::string fixed_number(double x, int digits) { return std::isfinite(x) ? fmt::format("{:.{}f}", x, digits) : "-"; }

// Estimators and intervals by method are the lines; one block for each parameter keeps lines short.
std::string comparison(const commission::Identification& r) {
  const auto shown = shown_parameters(r);
  const identify::EstimatorChoice& choice = r.fit.choice;
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> header = {""}, units = {""};
  std::vector<int> digits;
  for (std::size_t j = 0; j < shown.size(); ++j) {
    header.push_back(words::spaced(shown[j].name));
    units.push_back(shown[j].unit);
    const auto at = static_cast<Eigen::Index>(j);
    const Eigen::VectorXd& error = r.fit.residuals.standard_error;
    digits.push_back(decimals(at < error.size() ? std::abs(shown[j].scale.scale) * error[at] : 0.0));
  }
  rows.push_back(header);
  rows.push_back(units);
  const auto excluded = [&](std::size_t j) { return r.fit.excitation[j].state == identify::Excitation::not_excited; };
  const auto line = [&](std::string name, const Eigen::VectorXd& theta) {
    std::vector<std::string> row = {std::move(name)};
    for (std::size_t j = 0; j < shown.size(); ++j) {
      const auto at = static_cast<Eigen::Index>(j);
      row.push_back(excluded(j) || at >= theta.size() ? "-" : fixed_number(shown[j].value(theta[at]), digits[j]));
    }
    rows.push_back(row);
  };
  for (std::size_t c = 0; c < choice.candidates.size(); ++c) {
    const identify::Estimate& e = choice.candidates[c].estimate;
    if (e.usable) {
      line(words::spaced(identify::to_string(e.estimator)) + (c == choice.chosen ? " (taken)" : ""), e.theta);
    }
  }
  line("robust", r.robust.estimate);
  if (!binding(r.constrained).empty()) {
    line("physically consistent", r.constrained.estimate);
  }
  for (const inference::RegionRow& region : r.regions.rows) {
    if (!region.available) {
      continue;
    }
    for (const bool upper : {false, true}) {
      line(upper ? "  to"
                 : fmt::format("{} {:g} %{}", words::spaced(inference::to_string(region.method)),
                               100.0 * region.confidence, region.all_at_once ? ", all at once" : ""),
           upper ? region.upper : region.lower);
    }
  }
  return aligned(rows);
}

std::string promises(const commission::Identification& r) {
  std::string out;
  for (const inference::RegionRow& row : r.regions.rows) {
    const std::string name = "  " + words::spaced(inference::to_string(row.method)) + ": ";
    out += wrapped(
        row.available ? row.promise + (row.remark.empty() ? "" : "; " + row.remark) : "not available: " + row.remark,
        name);
  }
  return out;
}

std::string noise_lines(const commission::Identification& r) {
  std::string out;
  for (const commission::ColumnNoise& n : r.noise) {
    const bool of_angles = n.known && (n.known->unit != n.unit || n.known->origin == "half an encoder count" ||
                                       r.setting.measurement.motion == MotionKind::angle);
    std::string text = n.known ? fmt::format("{}: ± {:.2g} {}", n.known->origin, n.known->bound, n.known->unit) : "";
    const bool effort =
        std::ranges::find(r.setting.measurement.effort_columns, n.column) != r.setting.measurement.effort_columns.end();
    if (!n.known || effort || !of_angles) {
      text += text.empty() ? "" : "; ";
      text += n.choice.method == inference::NoiseMethod::none
                  ? "not found: " + n.choice.reason
                  : fmt::format("standard deviation {:.2g} {} by {} ({})", n.choice.sd, n.unit,
                                inference::to_string(n.choice.method), n.choice.assumption);
    }
    out += wrapped(text, "  " + n.column + ": ");
  }
  return out;
}

}  // namespace

std::string summary(const commission::Identification& r) {
  std::string text = wrapped(r.setting.robot.name + ": " + verdict(r), "");
  for (const std::string& finding : findings(r)) {
    text += wrapped(finding, "  ");
  }
  if (r.effort && !r.fit.choice.candidates.empty()) {
    text.append("\n").append(comparison(r)).append("\nwhat the intervals promise\n").append(promises(r));
  }
  if (!r.noise.empty()) {
    text.append("\nnoise\n").append(noise_lines(r));
  }
  if (!r.shapes.empty()) {
    text += "\nlooked for beside the model\n";
    for (const commission::ShapeFinding& shape : r.shapes) {
      text += wrapped(in_words(shape), "  ");
    }
  }
  text += "\nnext\n";
  for (const std::string& step : next_steps(r)) {
    text += wrapped(step, "  - ");
  }
  for (const std::string& note : r.notes) {
    text += wrapped(note, "  note: ");
  }
  return text;
}

}  // namespace wheelwright::words
