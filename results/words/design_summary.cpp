// SPDX-License-Identifier: Apache-2.0
#include "results/words/design_summary.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "commission/physical.hpp"
#include "results/words/detect_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::words {
namespace {

std::string planned_for(design::Promise guarantee) {
  return guarantee == design::Promise::at_risk ? "  planned for what holds at the stated risk\n" : "";
}

}  // namespace

std::string summary(const design::BoundsDesign& design, const design::DesignSubject& subject) {
  const auto scales = commission::physical_scales(subject.robot, subject.model);
  std::string out = fmt::format("{:.1f} s, within {:.2f} m of the start; {} manoeuvres were looked at\n",
                                design.manoeuvre.plan.t(design.manoeuvre.plan.samples() - 1),
                                design.manoeuvre.plan.reach(), design.manoeuvre.evaluations);
  out += fmt::format("  {:<20} {:>12}{}{}{}\n", "half widths", "promised",
                     design.at_risk ? fmt::format(" {:>12}", fmt::format("risk {:g}", design.risk)) : "",
                     subject.known ? fmt::format(" {:>12}", "model now") : "",
                     design.figure_eight ? fmt::format(" {:>14}", "figure eight") : "");
  for (std::size_t j = 0; j < subject.model.p(); ++j) {
    const model::Parameter& parameter = subject.model.parameters[j];
    const double scale = scales ? std::abs((*scales)[j].scale) : 1.0;
    const auto half = [&](const Box& box) { return 0.5 * scale * (box.sides[j].upper - box.sides[j].lower); };
    out += fmt::format("  {:<20} {:>12.4g}", scales ? parameter.physical : parameter.name, half(design.promised));
    if (design.at_risk) {
      out += fmt::format(" {:>12.4g}", half(*design.at_risk));
    }
    if (subject.known) {
      out += fmt::format(" {:>12.4g}", half(*subject.known));
    }
    if (design.figure_eight) {
      out += fmt::format(" {:>14.4g}", half(design.promised_eight));
    }
    out += "  " + (scales ? parameter.physical_unit : commission::parameter_unit(subject.robot, parameter)) + "\n";
  }
  return out + planned_for(design.guarantee);
}

std::string summary(const design::DetectionDesign& design) {
  const design::Plan& plan = design.manoeuvre.plan;
  std::string out = fmt::format("{:.1f} s, within {:.2f} m of the start; {} manoeuvres were looked at\n",
                                plan.t(plan.samples() - 1), plan.reach(), design.manoeuvre.evaluations);
  const bool at_risk = !design.at_risk.empty();
  out += fmt::format("  {:<26} {:>10} {:>12} {:>8}{}{}\n", "certainly found from", "asked", "promised", "after",
                     at_risk ? fmt::format(" {:>12} {:>8}", "at the risk", "after") : "",
                     design.figure_eight ? fmt::format(" {:>14}", "figure eight") : "");
  for (std::size_t k = 0; k < design.promised.size(); ++k) {
    const design::PromisedFault& p = design.promised[k];
    out += fmt::format("  {:<26} {:>10} {:>12} {:>8}", p.fault.name + (p.side > 0.0 ? " +" : " -"),
                       magnitude_words(p.fault, p.asked),
                       std::isfinite(p.smallest) ? magnitude_words(p.fault, p.smallest) : "none",
                       std::isfinite(p.smallest) ? fmt::format("{:.2f} s", p.t) : "");
    if (at_risk) {
      const design::PromisedFault& q = design.at_risk[k];
      out += fmt::format(" {:>12} {:>8}", std::isfinite(q.smallest) ? magnitude_words(q.fault, q.smallest) : "none",
                         std::isfinite(q.smallest) ? fmt::format("{:.2f} s", q.t) : "");
    }
    if (design.figure_eight) {
      const double eight = design.promised_eight[k].smallest;
      out += fmt::format(" {:>14}", std::isfinite(eight) ? magnitude_words(p.fault, eight) : "none");
    }
    out += "\n";
  }
  if (at_risk) {
    out += fmt::format("  at the risk: such a fault is missed with a probability of at most {:.2g}\n", design.miss);
  }
  return out + planned_for(design.guarantee);
}

std::string summary(const gap::DiscriminationDesign& design) {
  const design::Plan& plan = design.manoeuvre.plan;
  std::string out = fmt::format("{:.1f} s, within {:.2f} m of the start; {} manoeuvres were looked at\n",
                                plan.t(plan.samples() - 1), plan.reach(), design.manoeuvre.evaluations);
  for (const std::string& stage : design.stages) {
    out += "  " + stage + "\n";
  }
  out += fmt::format("  {:<52} {:>12}{}\n", "standard deviations from going wrong", "promised",
                     design.figure_eight ? fmt::format(" {:>14}", "figure eight") : "");
  for (std::size_t k = 0; k < design.promised.size(); ++k) {
    const gap::RivalSeparation& pair = design.promised[k];
    out +=
        fmt::format("  {:<52} {:>12.2f}",
                    design.rivals[pair.truth].name() + ", not " + design.rivals[pair.other].name(), pair.deviations());
    out += design.figure_eight ? fmt::format(" {:>14.2f}\n", design.promised_eight[k].deviations()) : "\n";
  }
  for (const std::string& sentence : design.sentences) {
    out += sentence + "\n";
  }
  return out;
}

}  // namespace wheelwright::words
