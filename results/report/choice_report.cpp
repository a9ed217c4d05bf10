// SPDX-License-Identifier: Apache-2.0
#include "results/report/choice_report.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/limits.hpp"
#include "core/words.hpp"
#include "results/report/commission_report.hpp"
#include "results/report/drawing.hpp"
#include "results/words/detect_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {
using namespace words;
namespace {

using commission::DetectorCandidate;
using commission::DetectorChoice;

// Size over β of candidates that decide at once, a mark for each: squares of order 1, circles of order 2.
std::string curve(const DetectorChoice& choice) {
  std::vector<const DetectorCandidate*> shown;
  constexpr double width = 560.0, height = 260.0, left = 62.0, right = width - 14.0, top = 14.0, bottom = height - 44.0;
  Axis x{left, right};
  Range size;
  for (const DetectorCandidate& each : choice.candidates) {
    if (std::isfinite(each.size) && each.size > 0.0 && each.persistence.n == 1) {
      shown.push_back(&each);
      x.take(std::log10(each.filter.beta));
      size.take(std::log10(each.size));
    }
  }
  if (shown.size() < 2 || !(x.low < x.high)) {
    return "";
  }
  x.pad(0.05);
  const double room = std::max(0.1 * (size.high - size.low), 0.02);
  const Axis y{{size.low - room, size.high + room}, bottom, top};
  std::string out = open_svg(width, height, "largest certain size over the stated one, for each candidate filter");
  for (const double tick : logarithmic_ticks(std::pow(10.0, x.low), std::pow(10.0, x.high), true)) {
    const double at = x(std::log10(tick));
    out += fmt::format("<line class=\"axis\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/>", at, top, bottom) +
           svg_text(at, bottom + 15.0, "middle", number(tick, 1));
  }
  std::vector<double> sizes = logarithmic_ticks(std::pow(10.0, y.low), std::pow(10.0, y.high), true);
  if (sizes.size() < 3) {
    sizes = {std::pow(10.0, size.low), std::pow(10.0, 0.5 * (size.low + size.high)), std::pow(10.0, size.high)};
  }
  for (const double tick : sizes) {
    const double at = y(std::log10(tick));
    out += fmt::format("<line class=\"axis\" x1=\"{1}\" x2=\"{2}\" y1=\"{0:.1f}\" y2=\"{0:.1f}\"/>", at, left, right) +
           svg_text(left - 5.0, at + 4.0, "end", number(tick, sizes.size() < 4 ? 2 : 1));
  }
  for (const DetectorCandidate* each : shown) {
    const double at = x(std::log10(each->filter.beta)), up = y(std::log10(each->size));
    const bool chosen = each == &choice.candidates.front();
    const double r = chosen ? 5.5 : 3.5;
    const char* mark = chosen ? "dot chosen" : "dot";
    out += each->filter.order == 1
               ? fmt::format("<rect class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{}\" height=\"{}\"/>", mark, at - r,
                             up - r, 2.0 * r, 2.0 * r)
               : fmt::format("<circle class=\"{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\"/>", mark, at, up, r);
    out += chosen ? svg_text(at + 9.0, up + 14.0, "start", "chosen", true) : "";
  }
  out += svg_text(0.5 * (left + right), height - 8.0, "middle", "β, 1/s (circle: order 2; square: order 1)");
  out += fmt::format(
      "<text x=\"14\" y=\"{0}\" transform=\"rotate(-90 14 {0})\" text-anchor=\"middle\">certain size / stated "
      "size</text></svg>",
      0.5 * (top + bottom));
  return out;
}

std::string against(const DetectorCandidate& each, const DetectorCandidate& chosen) {
  if (!each.failure.empty()) {
    return each.failure;
  }
  if (!std::isfinite(each.size)) {
    return "not certain";
  }
  return &each == &chosen ? "chosen" : fmt::format("{:+.1f} % of size", 100.0 * (each.size / chosen.size - 1.0));
}

std::string section(const DetectorChoice& choice) {
  const DetectorCandidate& chosen = choice.candidates.front();
  const bool at_risk = std::ranges::any_of(choice.candidates,
                                           [](const DetectorCandidate& each) { return each.size_at_risk.has_value(); });
  const auto value = [](double x) { return numeric(std::isfinite(x) ? number(x) : "–"); };
  std::vector<Cell> header = {"filter", numeric("β, 1/s"), numeric("alarm at"), numeric("certain size"),
                              numeric("delay, s")};
  if (at_risk) {
    header.push_back(numeric("certain size at the risk"));
  }
  header.insert(header.end(), {"against the chosen one", "origin"});
  std::vector<std::vector<Cell>> rows;
  for (const DetectorCandidate& each : choice.candidates) {
    std::vector<Cell> row = {fmt::format("order {}", each.filter.order), value(each.filter.beta),
                             numeric(fmt::format("{} of {}", each.persistence.k, each.persistence.n)), value(each.size),
                             value(each.delay)};
    if (at_risk) {
      row.push_back(value(each.size_at_risk.value_or(core::kInfinity)));
    }
    row.insert(row.end(), {escape(against(each, chosen)), escape(each.origin)});
    rows.push_back(std::move(row));
  }
  std::vector<std::string> asked;
  for (const commission::StatedFault& fault : choice.faults) {
    asked.push_back(spaced(fault.name) + (fault.size ? " of " + number(*fault.size) : ""));
  }
  std::string body = paragraph(escape(
      fmt::format("Asked: {}, within {} s. A size is the smallest that is certain to be seen within that time at half "
                  "of the onsets, over "
                  "the one that was asked for; of all faults the worst counts. Below 1 every fault is seen in time.",
                  core::enumerated(asked), number(choice.window))));
  body += curve(choice) + table(header, rows);
  std::vector<std::string> said = choice_sentences(choice);
  for (const std::string& name : choice.hopeless) {
    said.push_back(fmt::format("{} does not count: no candidate is certain to see it at half of the onsets.",
                               core::capital(spaced(name))));
  }
  for (const std::string& note : choice.notes) {
    said.push_back(core::capital(note) + ".");
  }
  return body + bullets(said);
}

}  // namespace

std::string choice_report(const DetectorChoice& choice, CommissionContext context) {
  context.title = "Choice of a detector for " + choice.chosen->model.robot.name;
  context.lead.push_back({"choice", "Choice", section(choice)});
  return commission_report(*choice.chosen, context);
}

}  // namespace wheelwright::report
