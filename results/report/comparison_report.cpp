// SPDX-License-Identifier: Apache-2.0
#include "results/report/comparison_report.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "core/words.hpp"
#include "results/report/drawing.hpp"
#include "results/report/page.hpp"
#include "results/words/comparison_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {
using namespace words;
namespace {

using commission::ModelComparison;
using commission::ParameterChange;
using commission::SetComparison;

// The intervals of a parameter in both sets on one scale, one above the other.
std::string bars(const ParameterChange& parameter) {
  constexpr double width = 330.0, left = 62.0, right = width - 8.0;
  Axis at{left, right};
  for (const Interval& side : {parameter.before, parameter.after}) {
    at.take(side.lower);
    at.take(side.upper);
  }
  at.high = at.high > at.low ? at.high : at.low + 1.0;
  std::string out = open_svg(width, 48.0, "intervals of " + parameter.quantity + " before and after");
  double y = 14.0;
  for (const auto& [name, side] : {std::pair("before", parameter.before), std::pair("after", parameter.after)}) {
    out += svg_text(left - 8.0, y + 4.0, "end", name);
    out += fmt::format("<line class=\"axis\" x1=\"{0}\" x2=\"{1}\" y1=\"{2}\" y2=\"{2}\"/>", left, right, y);
    out += fmt::format("<rect class=\"bar\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"12\"/>", at(side.lower),
                       y - 6.0, std::max(at(side.upper) - at(side.lower), 1.0));
    y += 20.0;
  }
  return out + "</svg>";
}

std::string interval_cell(const Interval& x) {
  const auto [lower, upper] = outward(x.lower, x.upper);
  return escape(lower + " to " + upper);
}

std::string set_section(const SetComparison& sets) {
  std::vector<Cell> header = {"parameter", "", numeric("before"), numeric("after"), numeric("change")};
  header.push_back(sets.compatible ? numeric("both, if nothing has changed") : Cell(""));
  std::vector<std::vector<Cell>> rows;
  for (const ParameterChange& each : sets.parameters) {
    rows.push_back({escape(quantity_words(each)), bars(each), numeric(interval_cell(each.before)),
                    numeric(interval_cell(each.after)), numeric(interval_cell(each.change)),
                    each.together ? numeric(interval_cell(*each.together)) : Cell(each.certain() ? "changed" : "")});
  }
  return paragraph(escape(sets.compatible ? "One set of parameters explains both logs."
                                          : "Proved: no one set of parameters explains both logs.")) +
         table(header, rows) +
         note(
             "Change: after minus before, whatever else has changed. An interval without 0 is a change for "
             "certain.");
}

std::string guesses_section(const std::vector<commission::GuessChange>& guesses) {
  std::vector<std::vector<Cell>> rows;
  for (const commission::GuessChange& each : guesses) {
    const auto cell = [](const commission::BestGuess& guess) { return numeric(escape(value_words(guess))); };
    const std::string unit = unit_of(each.before.unit);
    rows.push_back({escape(spaced(each.before.quantity) + (unit.empty() ? "" : ", " + unit)), cell(each.before),
                    cell(each.after), numeric(number(each.standard_errors(), 2)),
                    Cell(each.told() ? "more than chance" : "")});
  }
  return table({"parameter", numeric("before"), numeric("after"), numeric("change, standard errors"), ""}, rows) +
         note(fmt::format("By least squares, ± two standard errors. A change is told beyond {:.0f} of them: by "
                          "statistics, not for certain.",
                          commission::kToldStandardErrors));
}

}  // namespace

std::string comparison_report(const ModelComparison& comparison, const ComparisonContext& context) {
  PageContent content;
  content.title = context.title;
  content.status = comparison.changed() || !comparison.likely().empty() ? "caution" : "good";
  content.verdict = core::capital(words::verdict(comparison)) + ".";
  content.sentences = words::explanations(comparison);
  if (const std::string rest = words::not_compared(comparison); !rest.empty()) {
    content.sentences.push_back(rest);
  }
  content.sentences.insert(content.sentences.end(), context.remarks.begin(), context.remarks.end());
  const auto telling = comparison.telling();
  content.warrant = (telling.empty() ? comparison.sets.front() : *telling.front()).warrant;
  int number = 0;
  for (const SetComparison& sets : comparison.sets) {
    content.sections.push_back({fmt::format("set_{}", ++number), core::capital(set_words(sets)), set_section(sets)});
  }
  if (!comparison.guesses.empty()) {
    content.sections.push_back({"guesses", "Best guesses", guesses_section(comparison.guesses)});
  }
  content.sections.push_back({"files", "Files", definitions({{"before", context.before}, {"after", context.after}})});
  content.software = context.software;
  return page(content);
}

}  // namespace wheelwright::report
