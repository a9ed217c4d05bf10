// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/margins_report.hpp>

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/commission/margin_words.hpp>
#include <wheelwright/report/margin_drawings.hpp>
#include <wheelwright/report/page.hpp>
#include <wheelwright/report/signals.hpp>
#include <wheelwright/report/text.hpp>
#include <wheelwright/report/time_axis.hpp>
#include <wheelwright/report/warrant_section.hpp>

namespace wheelwright {

using namespace report;

namespace {

std::string name_of(const FaultMargins& margins) {
  const bool sides = !margins.fault.whole && margins.fault.range.lower < 0.0;
  return words(margins.fault.name) + (sides ? margins.side > 0.0 ? ", growing" : ", shrinking" : "");
}

std::string margins_table(const MarginSurvey& survey, const ResidualMargins& residual) {
  const std::size_t window = shown_window(survey);
  std::vector<Cell> header = {"Fault"};
  for (const auto& [kind, count] : survey.manoeuvres) {
    header.push_back(
        numeric(capital(std::string(words(kind))) + fmt::format("<small>{}</small>", plural(count, "onset"))));
  }
  std::vector<std::vector<Cell>> rows;
  for (const FaultMargins& margins : residual.margins) {
    std::vector<Cell> row = {escape(capital(name_of(margins))) + "<small>" + escape(margins.fault.sentence) +
                             "</small>"};
    for (const auto& [kind, count] : survey.manoeuvres) {
      row.push_back(numeric(escape(certain_words(margins, window, kind))));
    }
    rows.push_back(std::move(row));
  }
  std::string out = warrant_note(residual.warrant) + table(header, rows);
  if (!residual.blind.empty()) {
    std::vector<std::string> names;
    for (const std::string& name : residual.blind) {
      names.push_back(words(name));
    }
    out += paragraph("Leaves no trace in this residual, whatever its size: " + escape(list(names)) + ".");
  }
  return out +
         paragraph(fmt::format(
             "<span class=\"note\">Size from which on the fault raises an alarm within {:g} s, for every θ of the "
             "feasible set and all noise within its bounds, whenever it sets in during such driving, or at so many "
             "of the moments that were tried; –: at none. The rule is {} of {} instants.</span>",
             survey.windows[window], survey.persistence.k, survey.persistence.n));
}

std::string curves(const MarginSurvey& survey, const ResidualMargins& residual) {
  std::string out;
  for (const FaultMargins& margins : residual.margins) {
    const std::string drawing = margins.fault.whole ? "" : delay_curves(margins, survey);
    if (!drawing.empty()) {
      out += "<div><h3>" + escape(capital(name_of(margins))) + "</h3>" + drawing + "</div>";
    }
  }
  return "<div class=\"pairs\">" + out + "</div>" +
         paragraph(
             "<span class=\"note\">Thick: certain at half of the onsets of the manoeuvre; thin: at every one. A "
             "size reads the other way round, too: how long a fault of that size can go unseen.</span>");
}

std::string maps(const ResidualMargins& residual, const CommissionedModel& model) {
  std::string out;
  const auto& names = model.model.coordinates;
  const std::string first = names.front(), second = names.size() > 1 ? names[1] : "";
  for (const FaultMaps& each : residual.maps) {
    const auto margins = std::find_if(residual.margins.begin(), residual.margins.end(), [&](const FaultMargins& m) {
      return m.fault.name == each.fault && m.side == each.side;
    });
    if (margins == residual.margins.end() || margins->fault.whole) {
      continue;
    }
    const std::string speeds = margin_map(each.speeds, margins->fault, first, second);
    const std::string accelerations =
        margin_map(each.accelerations, margins->fault, "d" + first + "/dt", second.empty() ? "" : "d" + second + "/dt");
    if (!speeds.empty() || !accelerations.empty()) {
      out += "<div><h3>" + escape(capital(name_of(*margins))) + "</h3>" + speeds + accelerations + "</div>";
    }
  }
  return "<div class=\"pairs\">" + out + "</div>" +
         paragraph(
             "<span class=\"note\">Smallest certain size where the robot keeps its speed (left), and where it "
             "keeps accelerating at the drive's typical speeds (right), m/s and rad/s, over the range of the "
             "drive: drive there to check the robot.</span>");
}

}  // namespace

std::string margins_report(const MarginSurvey& survey, const CommissionedModel& model, const ReportContext& context) {
  const TimeAxis axis(context.signals ? context.signals->t : std::vector<double>{});
  PageContent content;
  content.title = context.title.empty() ? "What is certainly seen: " + model.robot.name : context.title;
  content.status = "good";
  content.verdict = "Faults that this robot's detector is certain to see in this drive.";
  content.warrant = model.warrant;
  content.sentences.push_back(certain_meaning(model.warrant));
  content.sentences.push_back(
      fmt::format("Every size below is about {} of driving.", with_unit(number(survey.seconds), "s")));
  if (!survey.without_kinematic.empty()) {
    content.sentences.push_back("There is no kinematic residual: " + survey.without_kinematic +
                                ". Slip across the heading cannot be promised while driving straight.");
  }
  content.software = context.software;
  const std::vector<std::string> sentences = margin_sentences(survey);
  if (!sentences.empty()) {
    content.sentences.push_back("For one: " + sentences.front());
  }
  for (const ResidualMargins& residual : survey.residuals) {
    content.sections.push_back({residual.name, capital(residual.name) + " residual", margins_table(survey, residual)});
    content.sections.push_back(
        {residual.name + "-delay", "How soon: " + residual.name + " residual", curves(survey, residual)});
    if (!residual.maps.empty()) {
      content.sections.push_back({residual.name + "-map", "Where it shows best", maps(residual, model)});
    }
  }
  content.sections.push_back({"words", "In words", bullets(sentences)});
  if (context.signals) {
    content.sections.push_back({"signals", "Raw signals", signal_charts(*context.signals, {}, axis, context.rows)});
  }
  if (std::string given = assumptions_section(survey.assumptions); !given.empty()) {
    content.sections.push_back({"assumptions", "Assumptions", std::move(given)});
  }
  content.sections.push_back({"data", "Data", provenance(context, axis)});
  return page(content);
}

}  // namespace wheelwright
