// SPDX-License-Identifier: Apache-2.0
#include "results/gap_json.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/json.hpp"
#include "gap/next/discrimination.hpp"
#include "gap/next_drive.hpp"
#include "gap/where.hpp"

namespace wheelwright::results {

using files::or_null;

namespace {

const char* name_of(gap::GapSpace space) { return space == gap::GapSpace::dynamic ? "dynamic" : "kinematic"; }

Json estimates_json(const std::vector<gap::GapEstimate>& estimates) {
  Json parameters = Json::object();
  for (const gap::GapEstimate& p : estimates) {
    parameters[p.name] = {
        {"estimate", or_null(p.estimate)}, {"lower", or_null(p.lower)}, {"upper", or_null(p.upper)}, {"unit", p.unit}};
  }
  return parameters;
}

Json causes_json(const std::vector<gap::GapCause>& causes) {
  Json list = Json::array();
  for (const gap::GapCause& cause : causes) {
    Json laws = Json::array();
    for (const gap::GapLaw& law : cause.laws) {
      laws.push_back(
          {{"effect", law.effect}, {"parameters", estimates_json(law.parameters)}, {"sentence", law.sentence}});
    }
    list.push_back({{"effect", cause.effect},
                    {"family", cause.family.empty() ? Json(nullptr) : Json(cause.family)},
                    {"laws", std::move(laws)},
                    {"parameters", estimates_json(cause.parameters)},
                    {"share", or_null(cause.share)},
                    {"parametric", cause.parametric},
                    {"probability", or_null(cause.probability)},
                    {"sentence", cause.sentence}});
  }
  return list;
}

Json record_json(const std::optional<gap::TrackRecord>& record) {
  if (!record) {
    return nullptr;
  }
  return {{"logs", record->logs},
          {"first", record->first},
          {"other", record->other},
          {"causes", record->causes},
          {"present", record->present}};
}

Json visible_json(const std::vector<gap::VisibleSize>& sizes) {
  Json list = Json::array();
  for (const gap::VisibleSize& v : sizes) {
    list.push_back({{"effect", v.effect}, {"parameter", v.parameter}, {"size", or_null(v.size)}, {"unit", v.unit}});
  }
  return list;
}

Json misfit_json(const std::optional<gap::HealthyMisfit>& misfit) {
  if (!misfit) {
    return nullptr;
  }
  return {{"share", or_null(misfit->share)},
          {"channel", misfit->channel},
          {"regime", misfit->regime.empty() ? Json(nullptr) : Json(misfit->regime)},
          {"known", misfit->known},
          {"helping", misfit->helping}};
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

Json to_json(const Diagnosis& d, const GapFiles& files) {
  Json credible = Json::array(), confusable = Json::array(), contradictions = Json::array();
  for (const gap::CredibleCauses& c : d.credible) {
    credible.push_back({{"effects", c.effects},
                        {"held_out_error", or_null(c.held_out_error)},
                        {"p_value", or_null(c.p_value)},
                        {"probability", or_null(c.probability)},
                        {"answer", c.answer},
                        {"trifles", c.trifles}});
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
          {"verdict", gap::to_string(d.verdict)},
          {"summary", d.summary},
          {"causes", causes_json(d.causes)},
          {"credible_set", std::move(credible)},
          {"track_record", record_json(d.record)},
          {"visible", visible_json(d.visible)},
          {"healthy_misfit", misfit_json(d.misfit)},
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
          {"simulator", files.simulator.empty() ? Json(nullptr) : Json(files.simulator)},
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

namespace {

std::optional<double> estimate(const files::JsonPlace& parameters, const std::string& name) {
  return parameters.has(name) ? std::optional(parameters.at(name).at("estimate").number()) : std::nullopt;
}

// Takes what `parameters` has of the cause, by "prefix + parameter".
void take(gap::RivalCause& cause, const Effect& effect, const files::JsonPlace& parameters, const std::string& prefix) {
  for (std::size_t c = 0; c < effect.parameters.size(); ++c) {
    cause.coefficients[c] = estimate(parameters, prefix + effect.parameters[c].name).value_or(cause.coefficients[c]);
  }
  for (std::size_t s = 0; s < effect.shapes.size(); ++s) {
    cause.shape[s] = estimate(parameters, prefix + effect.shapes[s].name).value_or(cause.shape[s]);
  }
}

// Whether `parameters` has just those of the law, by "effect.parameter".
bool follows(const Effect& law, const files::JsonPlace& parameters) {
  const std::string prefix = law.name + ".";
  const auto has = [&](const auto& parameter) { return parameters.has(prefix + parameter.name); };
  const auto of_effect = [&](const std::string& name) { return name.starts_with(prefix); };
  return std::ranges::all_of(law.parameters, has) && std::ranges::all_of(law.shapes, has) &&
         static_cast<std::size_t>(std::ranges::count_if(parameters.keys(), of_effect)) ==
             law.parameters.size() + law.shapes.size();
}

// Makes the law that has the parameters of a member of the credible set the first of its name.
void prefer_its_laws(std::vector<Effect>& catalogue, const std::vector<std::string>& effects,
                     const files::JsonPlace& member) {
  if (!member.has("parameters")) {
    return;
  }
  const files::JsonPlace parameters = member.at("parameters");
  for (const std::string& name : effects) {
    const auto law = std::ranges::find_if(
        catalogue, [&](const Effect& effect) { return effect.name == name && follows(effect, parameters); });
    if (law != catalogue.end()) {
      std::rotate(catalogue.begin(), law, law + 1);
    }
  }
}

void take_noise(const files::JsonPlace& root, const Model& model, gap::PlannedNoise& noise) {
  if (!root.has("filter") || !root.at("filter").has("beta") || !root.has("shrink")) {
    return;
  }
  std::vector<double> floors;
  const files::JsonPlace figures = root.at("shrink").at("torque_rms");
  for (const std::string& output : model.outputs) {
    if (figures.has(output) && figures.at(output).has("floor") && figures.at(output).at("floor").number() > 0.0) {
      floors.push_back(figures.at(output).at("floor").number());
    }
  }
  if (floors.size() == model.n()) {
    noise.output = floors;
    const files::JsonPlace beta = root.at("filter").at("beta");
    noise.beta = beta.number();
    if (!(noise.beta > 0.0)) {
      beta.fail("a rate > 0 in 1/s");
    }
  }
}

}  // namespace

std::vector<gap::Rival> rivals_of_gap(const std::filesystem::path& file, std::vector<Effect>& catalogue,
                                      const gap::Drive& drive, gap::PlannedNoise& noise) {
  return rivals_of_gap(files::read_json(file), file.string(), catalogue, drive, noise);
}

std::vector<gap::Rival> rivals_of_gap(const Json& json, const std::string& file, std::vector<Effect>& catalogue,
                                      const gap::Drive& drive, gap::PlannedNoise& noise) {
  const files::JsonPlace root(json, file);
  if (root.at("schema").text() != "wheelwright/gap/1") {
    root.at("schema").fail("wheelwright/gap/1, a result of wheelwright gap");
  }
  take_noise(root, drive.model, noise);
  const files::JsonPlace causes = root.at("causes"), credible = root.at("credible_set");
  std::set<std::string> best;
  for (std::size_t k = 0; k < causes.size(); ++k) {
    best.insert(causes.at(k).at("effect").text());
  }
  std::vector<gap::Rival> rivals;
  for (std::size_t i = 0; i < credible.size(); ++i) {
    const std::vector<std::string> effects = credible.at(i).at("effects").texts();
    prefer_its_laws(catalogue, effects, credible.at(i));
    const bool known = std::ranges::all_of(effects, [&](const std::string& name) {
      const Effect* effect = gap::find_effect(catalogue, name);
      return effect != nullptr && gap::applicability(*effect, drive).applies;
    });
    if (effects.empty() || !known) {
      continue;
    }
    gap::Rival rival = gap::typical_rival(effects, catalogue, drive);
    if (credible.at(i).has("parameters")) {
      for (gap::RivalCause& cause : rival.causes) {
        take(cause, *gap::find_effect(catalogue, cause.effect), credible.at(i).at("parameters"), cause.effect + ".");
      }
    } else if (std::set<std::string>(effects.begin(), effects.end()) == best) {
      for (std::size_t k = 0; k < causes.size(); ++k) {
        const std::string name = causes.at(k).at("effect").text();
        take(*std::ranges::find(rival.causes, name, &gap::RivalCause::effect), *gap::find_effect(catalogue, name),
             causes.at(k).at("parameters"), "");
      }
    }
    rivals.push_back(std::move(rival));
  }
  if (rivals.size() < 2) {
    throw InputError(file + ": /credible_set: expected at least two sets of causes to tell apart");
  }
  return rivals;
}

void add_rivals(Json& result, const gap::NextDrive& next) {
  for (const gap::Rival& rival : next.rivals) {
    std::vector<std::string> effects;
    Json parameters = Json::object();
    for (const gap::RivalCause& cause : rival.causes) {
      const Effect& effect = *std::ranges::find(next.laws, cause.effect, &Effect::name);
      const auto add = [&](const auto& parameter, double value) {
        parameters[effect.name + "." + parameter.name] = {{"estimate", value}, {"unit", parameter.unit}};
      };
      for (std::size_t c = 0; c < cause.coefficients.size(); ++c) {
        add(effect.parameters[c], cause.coefficients[c]);
      }
      for (std::size_t s = 0; s < cause.shape.size(); ++s) {
        add(effect.shapes[s], cause.shape[s]);
      }
      effects.push_back(cause.effect);
    }
    std::ranges::sort(effects);
    for (Json& member : result["credible_set"]) {
      auto own = member["effects"].get<std::vector<std::string>>();
      std::ranges::sort(own);
      if (own == effects) {
        member["parameters"] = parameters;
      }
    }
  }
}

}  // namespace wheelwright::results
