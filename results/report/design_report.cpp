// SPDX-License-Identifier: Apache-2.0
#include "results/report/design_report.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "commission/design/subject.hpp"
#include "commission/physical.hpp"
#include "commission/watch/risk_watch.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "results/report/drawing.hpp"
#include "results/report/page.hpp"
#include "results/words/detect_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {

using design::DesignSubject;

using namespace words;

namespace {

const char* criterion_words(design::WidthCriterion criterion) {
  switch (criterion) {
    case design::WidthCriterion::geometric_mean: return "the geometric mean of the relative widths of the bounds";
    case design::WidthCriterion::mean: return "the mean relative width of the bounds";
    case design::WidthCriterion::largest: break;
  }
  return "the largest relative width of the bounds";
}

std::string planned_for(design::Promise guarantee) {
  return guarantee == design::Promise::at_risk ? ", by what holds at the stated risk" : "";
}

std::string half_width(const Interval& side, double scale, double centre) {
  const double half = 0.5 * (side.upper - side.lower) * scale;
  std::string text = "± " + number(half);
  return centre != 0.0 ? text + fmt::format(" ({})", percent(half / std::abs(centre), 2)) : text;
}

// Bounds of each parameter, in the words of a data sheet where they can be had.
std::string bounds_table(const design::BoundsDesign& design, const DesignSubject& subject) {
  const auto scales = commission::physical_scales(subject.robot, subject.model);
  std::vector<Cell> header = {"Parameter", "unit", numeric("believed"), numeric("promised")};
  if (design.at_risk) {
    header.push_back(numeric(fmt::format("at a risk of {:g}", design.risk)));
  }
  if (subject.known) {
    header.push_back(numeric("model now"));
  }
  if (design.figure_eight) {
    header.push_back(numeric("figure eight"));
    header.push_back(numeric("promised / figure eight"));
  }
  std::vector<std::vector<Cell>> rows;
  for (std::size_t j = 0; j < subject.model.p(); ++j) {
    const model::Parameter& parameter = subject.model.parameters[j];
    const double scale = scales ? (*scales)[j].scale : 1.0;
    const double centre = subject.theta[static_cast<Eigen::Index>(j)] * scale - (scales ? (*scales)[j].offset : 0.0);
    std::vector<Cell> row = {
        escape(spaced(scales ? parameter.physical : parameter.name)),
        escape(scales ? parameter.physical_unit : commission::parameter_unit(subject.robot, parameter)),
        numeric(number(centre)), numeric(half_width(design.promised.sides[j], scale, centre))};
    if (design.at_risk) {
      row.push_back(numeric(half_width(design.at_risk->sides[j], scale, centre)));
    }
    if (subject.known) {
      row.push_back(numeric(half_width(subject.known->sides[j], scale, centre)));
    }
    if (design.figure_eight) {
      const Interval &mine = design.promised.sides[j], &eight = design.promised_eight.sides[j];
      row.push_back(numeric(half_width(eight, scale, centre)));
      row.push_back(numeric(number((mine.upper - mine.lower) / (eight.upper - eight.lower), 2)));
    }
    rows.push_back(std::move(row));
  }
  return table(header, rows) +
         paragraph(
             "Half widths of bounds. Promised: what a log driven along the plan gives at least, whatever "
             "the "
             "noise within its declared bounds, as far as the robot follows its commands: the widest bounds come from "
             "a "
             "log without noise, and those are what is computed.") +
         (design.at_risk
              ? paragraph(fmt::format(
                    "At a risk of {:g}: the same for errors that average out as {}; but for that chance "
                    "all of these bounds will hold.",
                    design.risk,
                    design.at_risk_warrant == core::Warrant::guaranteed ? "the robot file declares"
                                                                        : "the commissioning log shows them"))
              : "") +
         (design.figure_eight
              ? paragraph(fmt::format("Figure eight: the best one for the same aim within the same limits, {} with a "
                                      "period of {}, promised in the same way.",
                                      with_unit(number(design.figure_eight->speed), "m/s"),
                                      with_unit(number(design.figure_eight->period), "s")))
              : "");
}

std::string limits_table(const design::LimitUse& use, const design::MotionLimits& limits,
                         const DesignSubject& subject) {
  const bool axis = subject.model.joints.size() == 1;
  std::vector<std::vector<Cell>> rows;
  const auto add = [&rows](const char* what, const std::string& limit, double share) {
    rows.push_back({what, numeric(limit), numeric(percent(share))});
  };
  add(axis ? "Speed" : "Wheel speed", with_unit(number(limits.joint_speed), axis ? "rad/s or m/s" : "rad/s"),
      use.speed);
  if (limits.joint_acceleration) {
    add(axis ? "Acceleration" : "Wheel acceleration",
        with_unit(number(*limits.joint_acceleration), axis ? "rad/s² or m/s²" : "rad/s²"), use.acceleration);
  }
  if (limits.effort) {
    add("Effort", with_unit(number(*limits.effort), commission::output_unit(subject.robot, "N·m")), use.effort);
  }
  if (limits.radius) {
    add("Distance from the start", with_unit(number(*limits.radius), "m"), use.space);
  }
  if (limits.box) {
    const auto& [x, y] = *limits.box;
    add("Box around the start",
        fmt::format("{} to {} m ahead, {} to {} m to the left", number(x.lower), number(x.upper), number(y.lower),
                    number(y.upper)),
        use.space);
  }
  return table({"Limit", numeric("value"), numeric("used")}, rows);
}

std::string speed_charts(const design::Plan& plan, const Model& model, const TimeAxis& axis) {
  const LogTable commands = design::command_table(plan, model);
  const auto chart = [&](const char* title, const char* unit, const std::vector<const char*>& names) {
    Chart c;
    c.title = title;
    c.unit = unit;
    c.clock = "plan";
    for (std::size_t i = 0; i < names.size(); ++i) {
      c.series.push_back({names[i], commands.column(names[i]), i == 0 ? Line::first : Line::second});
    }
    return figure(c, axis);
  };
  const std::string times = clock("plan", commands.t, {}, axis);
  if (model.joints.size() == 1) {
    return times + chart("Command", "per s", {"command"}) + chart("Position", "", {"position"});
  }
  return times + chart("Wheel-speed commands", "rad/s", {"command_r", "command_l"}) +
         chart("Forward speed v1", "m/s", {"v1"}) + chart("Yaw rate v2", "rad/s", {"v2"});
}

std::vector<std::string> design_words(const design::BoundsDesign& design, const DesignSubject& subject,
                                      const design::MotionLimits& limits) {
  const design::Plan& plan = design.manoeuvre.plan;
  std::vector<std::string> sentences;
  sentences.push_back(
      fmt::format("Drive the table of commands once, from standstill: it takes {}, keeps within {} of "
                  "the start and ends where it began.",
                  with_unit(number(limits.duration), "s"),
                  with_unit(number(std::sqrt(plan.pose.topRows<2>().colwise().squaredNorm().maxCoeff())), "m")));
  sentences.push_back(fmt::format("It was chosen to minimise {}, out of {} manoeuvres within the limits{}.",
                                  criterion_words(design.criterion), count(design.manoeuvre.evaluations),
                                  planned_for(design.guarantee)));
  sentences.push_back(
      "Record the log, then commission with it; the second half of the drive repeats the first backwards, "
      "which tells inertia from friction.");
  sentences.push_back(
      subject.errors ? "What the noise may do was taken from the commissioned model."
                     : "What the noise may do follows from the declared bounds of the sensors, in the worst case.");
  return sentences;
}

std::string faults_table(const design::DetectionDesign& design, const DesignSubject& subject) {
  std::vector<Cell> header = {"Fault", numeric("asked"), numeric("certain from"), numeric("after"), "channel"};
  if (!design.at_risk.empty()) {
    header.push_back(numeric("at the stated risk"));
    header.push_back(numeric("after"));
    header.push_back("by sums of");
  }
  if (design.figure_eight) {
    header.push_back(numeric("figure eight"));
  }
  const std::vector<detector::SumWeight> weights = detector::sum_weights(subject.model);
  std::vector<std::vector<Cell>> rows;
  for (std::size_t k = 0; k < design.promised.size(); ++k) {
    const design::PromisedFault& p = design.promised[k];
    const bool found = std::isfinite(p.smallest);
    const bool sides = p.fault.range.lower < 0.0 && !p.fault.whole;
    std::vector<Cell> row = {
        escape(core::capital(spaced(p.fault.name)) + (sides ? p.side > 0.0 ? ", growing" : ", shrinking" : "")),
        numeric(escape(magnitude_words(p.fault, p.asked))), numeric(escape(magnitude_words(p.fault, p.smallest))),
        numeric(found ? with_unit(number(p.t), "s") : "–"),
        found ? escape(spaced(subject.model.outputs[p.output])) : "–"};
    if (!design.at_risk.empty()) {
      const design::PromisedFault& q = design.at_risk[k];
      const bool seen = std::isfinite(q.smallest);
      row.push_back(numeric(escape(magnitude_words(q.fault, q.smallest))));
      row.push_back(numeric(seen ? with_unit(number(q.t), "s") : "–"));
      row.push_back(
          seen ? escape(fmt::format("{}, {:g} s", commission::sum_words(weights[q.output], subject.model), q.scale))
               : "–");
    }
    if (design.figure_eight) {
      row.push_back(numeric(escape(magnitude_words(p.fault, design.promised_eight[k].smallest))));
    }
    rows.push_back(std::move(row));
  }
  return table(header, rows) +
         paragraph(
             "<span class=\"note\">A robot that is broken by that much before the drive begins raises an alarm within "
             "the time given, whatever its parameters within the model's bounds and the noise within its own, as far "
             "as "
             "its wheels follow the commands.</span>") +
         (design.at_risk.empty()
              ? ""
              : note(fmt::format("At the stated risk: where errors average out as {}, such a fault is missed with a "
                                 "probability of at most {:.2g}.",
                                 design.at_risk_warrant == core::Warrant::guaranteed
                                     ? "the robot file declares"
                                     : "the commissioning log shows them",
                                 design.miss)));
}

std::string separations_table(const gap::DiscriminationDesign& design) {
  std::vector<Cell> header = {"True cause", "told from", numeric("standard deviations"), numeric("found with"),
                              numeric("residual ratio")};
  if (!design.analysed.empty()) {
    header.push_back(numeric("analysed log"));
  }
  if (design.figure_eight) {
    header.push_back(numeric("figure eight"));
  }
  std::vector<std::vector<Cell>> rows;
  for (std::size_t k = 0; k < design.promised.size(); ++k) {
    const gap::RivalSeparation& pair = design.promised[k];
    const double chance = pair.probability();
    std::vector<Cell> row = {escape(spaced(design.rivals[pair.truth].name())),
                             escape(spaced(design.rivals[pair.other].name())), numeric(number(pair.deviations())),
                             numeric(chance > 0.999 ? "> 99.9 %" : percent(chance)), numeric(number(pair.ratio()))};
    if (!design.analysed.empty()) {
      row.push_back(numeric(number(design.analysed[k].deviations())));
    }
    if (design.figure_eight) {
      row.push_back(numeric(number(design.promised_eight[k].deviations())));
    }
    rows.push_back(std::move(row));
  }
  return table(header, rows) +
         paragraph(
             "<span class=\"note\">If the cause on the left is true with its estimated size, the comparison of "
             "residuals is so many standard deviations from preferring the other one, whose parameters, and those of "
             "the "
             "base model, are fitted as well as they can be.</span>");
}

// Path, commands, limits and data: what every design shows.
void add_plan(PageContent& content, const design::Manoeuvre& manoeuvre, const DesignSubject& subject,
              const design::MotionLimits& limits, const ReportContext& context) {
  const LogTable commands = design::command_table(manoeuvre.plan, subject.model);
  const TimeAxis axis(commands.t);
  if (std::string path = driven_path(commands); !path.empty()) {
    content.sections.push_back(
        {"path", "Path",
         path + paragraph("Seen from above; the dot is the start, and the end, the robot facing right.")});
  }
  content.sections.push_back({"speeds", "Commands", speed_charts(manoeuvre.plan, subject.model, axis)});
  content.sections.push_back({"limits", "Limits", limits_table(manoeuvre.use, limits, subject)});
  content.sections.push_back({"data", "Data", provenance(context, axis)});
}

}  // namespace

std::string design_report(const design::DetectionDesign& design, const DesignSubject& subject,
                          const design::MotionLimits& limits, const ReportContext& context) {
  PageContent content;
  content.title = context.title.empty() ? "Inspection of " + subject.robot.name : context.title;
  content.status = "good";
  content.verdict =
      fmt::format("An inspection drive of {}: what it is certain to find.", with_unit(number(limits.duration), "s"));
  content.sentences = {
      "Drive the table of commands once, from standstill, and let `wheelwright detect` look at the log: no alarm means "
      "that no fault below is there in the size given.",
      fmt::format(
          "It was chosen to make the largest of these sizes small, each relative to the one asked for, out of {} "
          "manoeuvres within the limits{}.",
          count(design.manoeuvre.evaluations), planned_for(design.guarantee))};
  content.software = context.software;
  content.warrant = subject.warrant;
  content.sections.push_back({"faults", "What is certainly found", faults_table(design, subject)});
  add_plan(content, design.manoeuvre, subject, limits, context);
  return page(content);
}

std::string design_report(const gap::DiscriminationDesign& design, const DesignSubject& subject,
                          const design::MotionLimits& limits, const ReportContext& context) {
  PageContent content;
  content.title = context.title.empty() ? "Manoeuvre to tell causes apart for " + subject.robot.name : context.title;
  const bool told = design.inseparable.empty();
  content.status = "good";
  content.verdict =
      fmt::format("A manoeuvre of {} that tells {} causes apart{}.", with_unit(number(limits.duration), "s"),
                  count(design.rivals.size()), told ? "" : ", as far as a log of this kind can");
  std::string stages = "Stages: ";
  for (std::size_t k = 0; k < design.stages.size(); ++k) {
    stages += (k > 0 ? "; " : "") + design.stages[k];
  }
  content.sentences = {"Drive the table of commands once, from standstill, and let `wheelwright gap` look at the log.",
                       stages + "."};
  content.sentences.insert(content.sentences.end(), design.sentences.begin(), design.sentences.end());
  content.software = context.software;
  content.warrant = subject.warrant;
  content.sections.push_back({"pairs", "How well causes are told apart", separations_table(design)});
  add_plan(content, design.manoeuvre, subject, limits, context);
  return page(content);
}

std::string design_report(const design::BoundsDesign& design, const DesignSubject& subject,
                          const design::MotionLimits& limits, const ReportContext& context) {
  PageContent content;
  content.title = context.title.empty() ? "Manoeuvre for " + subject.robot.name : context.title;
  content.status = "good";
  content.verdict = "A manoeuvre for narrow bounds.";
  if (design.figure_eight) {
    const double mine =
        design::combined(design::relative_widths(design.promised, subject), design::WidthCriterion::geometric_mean);
    const double eight = design::combined(design::relative_widths(design.promised_eight, subject),
                                          design::WidthCriterion::geometric_mean);
    content.verdict = fmt::format(
        "A manoeuvre whose bounds are, in the geometric mean, {} as wide as those of the best figure eight.",
        percent(mine / eight, 2));
  }
  content.sentences = design_words(design, subject, limits);
  content.software = context.software;
  content.warrant = subject.warrant;
  content.sections.push_back({"bounds", "Promised bounds", bounds_table(design, subject)});
  add_plan(content, design.manoeuvre, subject, limits, context);
  return page(content);
}

}  // namespace wheelwright::report
