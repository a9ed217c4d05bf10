// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/gap_json.hpp>

#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <wheelwright/files/bytes.hpp>
#include <wheelwright/files/json.hpp>
#include <wheelwright/gap/where.hpp>

namespace wheelwright::results {

using files::or_null;

namespace {

const char* name_of(gap::GapSpace space) { return space == gap::GapSpace::dynamic ? "dynamic" : "kinematic"; }

Json causes_json(const std::vector<gap::GapCause>& causes) {
  Json list = Json::array();
  for (const gap::GapCause& cause : causes) {
    Json parameters = Json::object();
    for (const gap::GapEstimate& p : cause.parameters) {
      parameters[p.name] = {{"estimate", or_null(p.estimate)},
                            {"lower", or_null(p.lower)},
                            {"upper", or_null(p.upper)},
                            {"unit", p.unit}};
    }
    list.push_back({{"effect", cause.effect},
                    {"parameters", std::move(parameters)},
                    {"share", or_null(cause.share)},
                    {"parametric", cause.parametric},
                    {"sentence", cause.sentence}});
  }
  return list;
}

Json figures_json(const std::vector<gap::ShrinkFigure>& figures) {
  Json all = Json::object();
  for (const gap::ShrinkFigure& f : figures) {
    all[f.name] = {{"before", or_null(f.before)}, {"after", or_null(f.after)}, {"floor", or_null(f.floor)},
                   {"lower", or_null(f.lower)},   {"upper", or_null(f.upper)}, {"unit", f.unit}};
  }
  return all;
}

Json where_json(const std::vector<gap::GapShare>& where) {
  Json list = Json::array();
  for (const gap::GapShare& s : where) {
    if (s.kind == "channel" || s.kind == "frequency" || gap::is_finding(s)) {
      list.push_back({{"space", name_of(s.space)},
                      {"channel", s.channel},
                      {"regime", s.regime},
                      {"share", or_null(s.share)},
                      {"p_value", or_null(s.p_value)},
                      {"kind", s.kind},
                      {"presence", or_null(s.presence)}});
    }
  }
  return list;
}

Json parametric_json(const std::vector<gap::ParameterShift>& shifts) {
  Json list = Json::array();
  for (const gap::ParameterShift& p : shifts) {
    list.push_back({{"parameter", p.parameter},
                    {"nominal", p.nominal ? or_null(*p.nominal) : Json(nullptr)},
                    {"estimate", or_null(p.estimate)},
                    {"lower", or_null(p.lower)},
                    {"upper", or_null(p.upper)},
                    {"unit", p.unit},
                    {"without_causes", or_null(p.without_causes)}});
  }
  return list;
}

void append(std::string& line, const Eigen::VectorXd& values, Eigen::Index k) {
  line += ',';
  if (k < values.size() && std::isfinite(values[k])) {
    fmt::format_to(std::back_inserter(line), "{:.7g}", values[k]);
  }
}

}  // namespace

const char* name_of(gap::GapVerdict verdict) {
  switch (verdict) {
    case gap::GapVerdict::no_gap: return "no_gap";
    case gap::GapVerdict::explained: return "explained";
    case gap::GapVerdict::ambiguous: return "ambiguous";
    case gap::GapVerdict::unexplained: return "unexplained";
  }
  return "";
}

Json to_json(const Diagnosis& d, const GapFiles& files) {
  Json credible = Json::array(), confusable = Json::array(), contradictions = Json::array();
  for (const gap::CredibleCauses& c : d.credible) {
    credible.push_back(
        {{"effects", c.effects}, {"held_out_error", or_null(c.held_out_error)}, {"p_value", or_null(c.p_value)}});
  }
  for (const gap::ConfusablePair& pair : d.confusable) {
    confusable.push_back({{"effects", {pair.first, pair.second}},
                          {"similarity", or_null(pair.similarity)},
                          {"inseparable", pair.inseparable},
                          {"reason", pair.reason}});
  }
  for (const gap::Contradiction& c : d.contradictions) {
    contradictions.push_back({{"t", c.t}, {"channel", c.channel}, {"weight", c.weight}});
  }
  Json next = nullptr;
  if (files.next_manoeuvre) {
    next = {{"file", files.next_manoeuvre->file}, {"sentence", files.next_manoeuvre->sentence}};
  }
  return {{"schema", kGapSchema},
          {"verdict", name_of(d.verdict)},
          {"summary", d.summary},
          {"causes", causes_json(d.causes)},
          {"credible_set", std::move(credible)},
          {"confusable", std::move(confusable)},
          {"where", where_json(d.where)},
          {"shrink",
           {{"torque_rms", figures_json(d.shrink.torque_rms)},
            {"rollout", figures_json(d.shrink.rollout)},
            {"threshold_width", figures_json(d.shrink.threshold_width)},
            {"smallest_fault", figures_json(d.shrink.smallest_fault)},
            {"fresh_torque_rms", figures_json(d.shrink.fresh_torque_rms)}}},
          {"parametric", parametric_json(d.parametric)},
          {"next_manoeuvre", std::move(next)},
          {"contradictions", std::move(contradictions)},
          {"gap", or_null(d.gap)},
          {"structural", or_null(d.structural)},
          {"remaining", or_null(d.remaining)},
          {"floor_error", or_null(d.floor_error)},
          {"floor_origin", d.floor_origin},
          {"filter", {{"order", 2}, {"alpha", or_null(d.beta)}, {"beta", or_null(d.beta)}}},
          {"not_excited", d.not_excited},
          {"notes", d.notes},
          {"robot", files.robot},
          {"logs", files.logs},
          {"baseline", files.baseline.empty() ? Json(nullptr) : Json(files.baseline)},
          {"residuals", files.residuals.empty() ? Json(nullptr) : Json(files.residuals)},
          {"software", files.software}};
}

void write_residuals(const std::filesystem::path& path, const std::vector<gap::ResidualSeries>& series) {
  files::AtomicFile file(path);
  std::string text = "space,channel,unit,t,signal,nominal,refitted,after,floor\n";
  for (const gap::ResidualSeries& s : series) {
    const std::string head = fmt::format("{},{},{},", name_of(s.space), s.channel, s.unit);
    for (Eigen::Index k = 0; k < s.t.size(); ++k) {
      text += head;
      fmt::format_to(std::back_inserter(text), "{:.6f}", s.t[k]);
      for (const Eigen::VectorXd* values : {&s.signal, &s.nominal, &s.refitted, &s.after}) {
        append(text, *values, k);
      }
      fmt::format_to(std::back_inserter(text), ",{:.7g}\n", s.floor);
      if (text.size() > (std::size_t{1} << 16)) {
        file.write(text);
        text.clear();
      }
    }
  }
  file.write(text);
  file.commit();
}

}  // namespace wheelwright::results
