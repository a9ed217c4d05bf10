// SPDX-License-Identifier: Apache-2.0
#include "tests/guarantee/judge.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "bounds/feasible_set.hpp"
#include "commission/assumptions.hpp"
#include "commission/commission.hpp"
#include "commission/margin_survey.hpp"
#include "commission/watch/detector_walk.hpp"
#include "core/regression.hpp"
#include "detector/faults/isolation.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/online_model.hpp"

namespace wheelwright::guarantee {
namespace {

using Wide = __float128;  // holds products of doubles exactly

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void check_truth(const Scene& scene, const Commissioning& result, Verdict& verdict) {
  std::vector<Wide> theta;
  for (const commission::ParameterResult& p : result.parameters) {
    const auto truth = scene.truth.find(p.parameter.physical);
    if (truth == scene.truth.end()) {
      verdict.outside += p.parameter.physical + "(unknown) ";
      theta.push_back(0);
      continue;
    }
    const Wide value = static_cast<Wide>(truth->second) * static_cast<Wide>(p.parameter.per_physical);
    theta.push_back(value);
    if (value < static_cast<Wide>(p.lower) || value > static_cast<Wide>(p.upper)) {
      verdict.outside += p.parameter.physical + " ";
    }
    if (p.parameter.physical == "mass" || p.parameter.physical == "inertia") {
      verdict.width = (p.upper - p.lower) / static_cast<double>(value);
    }
  }
  for (const bounds::HalfSpace& facet : result.model.facets) {
    Wide sum = 0;
    for (std::size_t j = 0; j < theta.size(); ++j) {
      sum += static_cast<Wide>(facet.a[static_cast<Eigen::Index>(j)]) * theta[j];
    }
    verdict.facet_cuts = verdict.facet_cuts || sum > static_cast<Wide>(facet.b);
  }
}

// Width of the mass for rows without any error but the sensors' worst case, at the stamps of the log: exact filtered
// motion, errors of the size of the kernels' L1 norms, nothing between samples. Dry friction of a joint at rest is any
// number up to that of one in motion.
double oracle_width(const Case& c, const Scene& scene, const Commissioning& result) {
  const double beta = result.model.filter.beta, alpha = result.model.filter.alpha, a2 = alpha * alpha;
  const bool axis = c.truth.axis;
  const bool speeds = c.sense == Sense::speed || c.sense == Sense::whole_rpm;
  const double to_body = axis ? 1.0 : c.truth.radius;  // two wheels of r/2 each
  const double e = std::exp(1.0);
  const double rate_norm = 2.0 * a2 / (e * beta), level_norm = a2 / (beta * beta);
  const double n_acceleration = to_body * c.motion_bound * (speeds ? rate_norm : 2.0 * a2 * (1.0 + std::exp(-2.0)));
  const double n_speed = to_body * c.motion_bound * (speeds ? level_norm : rate_norm);
  const double n_effort = (axis ? 1.0 : 2.0) * *scene.robot.noise.effort.value * level_norm;
  const double per = axis ? 1.0 : c.truth.radius;
  const double mass = per * c.truth.mass, viscous = per * c.truth.viscous_linear;

  RegressionBlock block;
  const Eigen::Index p = c.truth.coulomb > 0.0 ? 3 : 2;
  block.outputs = 1;
  block.parameters = static_cast<std::size_t>(p);
  std::vector<double> rows, doubts;
  std::array<double, 3> once{}, twice{};  // of the speed, the signs, what is not known of these
  std::size_t k = 0;
  for (std::size_t i = 1; i < scene.exact_t.size() && k < scene.learned.rows(); ++i) {
    const double h = scene.exact_t[i] - scene.exact_t[i - 1];
    const double decay = std::exp(-beta * h);
    const auto middle = [i](const std::vector<double>& x) { return 0.5 * (x[i] + x[i - 1]); };
    const double in[] = {middle(scene.exact_speed), middle(scene.exact_sign),
                         middle(scene.exact_resting) + 0.5 * std::abs(scene.exact_sign[i] - scene.exact_sign[i - 1])};
    for (std::size_t s = 0; s < 3; ++s) {
      twice[s] = decay * twice[s] + decay * h * once[s] + in[s] * (1.0 - decay - beta * h * decay) / (beta * beta);
      once[s] = decay * once[s] + in[s] * (1.0 - decay) / beta;
    }
    if (scene.exact_t[i] >= scene.learned.t[k] - 0.25 * h) {
      if (speeds || beta * scene.learned.t[k] >= result.model.filter.settle) {
        rows.insert(rows.end(), {a2 * (once[0] - beta * twice[0]), a2 * twice[0]});
        if (p > 2) {
          rows.push_back(a2 * twice[1]);
          doubts.push_back(a2 * twice[2]);
        }
        block.t.push_back(scene.learned.t[k]);
        block.sample.push_back(k);
      }
      ++k;
    }
  }
  if (block.t.empty()) {
    return 0.0;
  }
  const auto n = static_cast<Eigen::Index>(block.t.size());
  block.Y = Eigen::Map<const core::RowMatrix>(rows.data(), n, p);
  block.dY.resize(n, p);
  block.dY.col(0).setConstant(n_acceleration);
  block.dY.col(1).setConstant(n_speed);
  Eigen::VectorXd theta(p);
  theta.head(2) << mass, viscous;
  if (p > 2) {
    block.dY.col(2) = Eigen::Map<const Eigen::VectorXd>(doubts.data(), n);
    theta[2] = c.truth.coulomb;
  }
  block.y = block.Y * theta;
  block.dy = Eigen::VectorXd::Constant(n, n_effort);
  Box prior;
  for (const char* physical : {axis ? "inertia" : "mass", axis ? "viscous" : "viscous_linear", "coulomb"}) {
    for (std::size_t j = 0; j < result.parameters.size(); ++j) {
      if (result.parameters[j].parameter.physical == physical) prior.sides.push_back(result.prior.sides[j]);
    }
  }
  core::RegressionTable table(std::move(block));
  if (prior.dimension() < static_cast<std::size_t>(p)) {
    return 0.0;  // the model knows no dry friction
  }
  prior.sides.resize(static_cast<std::size_t>(p));
  const FeasibleSet set = feasible_set(table, prior);
  return set.status == FeasibleSet::Status::nonempty ? (set.hull.sides[0].upper - set.hull.sides[0].lower) / mass : 0.0;
}

void watch(const LogTable& log, const OnlineModel& model, Verdict& verdict) {
  Detector detector = make_detector(model);
  std::vector<const std::vector<double>*> columns;
  for (const std::string& column : model.measurement.columns()) {
    columns.push_back(&log.column(column));
  }
  std::vector<double> sample(columns.size());
  bool alarmed = false;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    for (std::size_t j = 0; j < columns.size(); ++j) {
      sample[j] = (*columns[j])[k];
    }
    const Decision& decision = detector.step(log.t[k], sample);
    ++verdict.watched;
    verdict.decisions += decision.valid ? 1 : 0;
    verdict.alarms += decision.fault ? 1 : 0;
    verdict.events += decision.fault && !alarmed ? 1 : 0;
    if (decision.fault && verdict.first_alarm < 0.0) {
      verdict.first_alarm = log.t[k];
    }
    alarmed = decision.fault;
  }
}

// Whether a detector alarms between `onset` and `end`.
bool sees(const OnlineModel& model, const LogTable& log, double onset, double end) {
  Detector detector = make_detector(model);
  const std::vector<std::string> names = model.measurement.columns();
  std::vector<double> sample(names.size());
  bool seen = false;
  for (std::size_t k = 0; k < log.rows() && log.t[k] <= end; ++k) {
    for (std::size_t i = 0; i < names.size(); ++i) sample[i] = log.column(names[i])[k];
    const bool alarm = detector.step(log.t[k], sample).fault;
    seen = seen || (alarm && log.t[k] >= onset);
  }
  return seen;
}

// Whether what is said of the first alarm leaves the fault possible, of its size and at its time.
bool isolated(const OnlineModel& model, const LogTable& log, const FaultType& fault, const Breakdown& truth) {
  TableSource source(log);
  const Detection detection = detect(source, make_detector(model));
  if (detection.events.empty() || detection.events.front().start < truth.onset) {
    return true;  // a false alarm is told elsewhere
  }
  const detector::Event& event = detection.events.front();
  const RegressorFilter filter(model.model, model.filter, model.measurement, model.errors);
  const detector::ReferenceMotion motion = detector::read_reference(source, filter);
  const detector::Isolation isolation =
      detector::isolate(motion, filter, Polytope(model.facets, model.box), {fault}, event.start, event.alarm);
  const detector::FaultFinding& found = isolation.findings.front();
  return found.verdict == detector::FaultFinding::Verdict::consistent &&
         (!found.magnitude || found.magnitude->contains(truth.size)) &&
         (found.onset.contains(truth.onset) || (found.earlier && truth.onset < found.onset.lower));
}

// Faults of sizes that margins call certain within a window: each has to be seen, and must not be excluded.
void try_faults(Case c, const OnlineModel& model, Verdict& verdict) {
  using Kind = Breakdown::Kind;
  constexpr std::array<Kind, 3> kKinds = {Kind::effort_loss, Kind::effort_bias, Kind::encoder_scale};
  constexpr double kWindowSteps = 100.0;
  constexpr std::size_t kOnsets = 6;
  constexpr std::size_t kMostRows = 5000;  // of the drive
  const double window = kWindowSteps / c.rate;
  const std::string side = c.truth.axis ? "" : "_right";
  const auto fault_of = [&](Kind kind) { return name(kind) + side; };
  c.watch_rows = std::min(c.watch_rows, kMostRows);
  const LogTable healthy = play(c).watched;
  TableSource log(healthy);
  commission::MarginSurveyOptions options;
  options.margins.windows = {window};
  options.margins.onset_step = (healthy.t.back() - healthy.t.front()) / static_cast<double>(kOnsets);
  options.margins.most_onsets = kOnsets;
  for (const Kind kind : kKinds) options.faults.push_back(fault_of(kind));
  options.map_points = 0;
  const commission::MarginSurvey survey = commission::survey_margins(log, model, options);
  for (const commission::ResidualMargins& residual : survey.residuals) {
    for (const detector::FaultMargins& fault : residual.margins) {
      const Kind kind =
          *std::find_if(kKinds.begin(), kKinds.end(), [&](Kind k) { return fault_of(k) == fault.fault.name; });
      bool looked = false;
      for (const detector::OnsetMargin& onset : fault.onsets) {
        if (residual.name != "torque" || onset.certain.empty() || !(onset.certain[0] < fault.largest())) {
          continue;
        }
        const Breakdown breakdown{kind, onset.t, fault.side * onset.certain[0]};
        const LogTable broken = watch_broken(c, breakdown);
        FaultTally& tally = verdict.faults[static_cast<std::size_t>(kind)];
        const double end = onset.t + window + 2.0 / c.rate;
        const bool seen = sees(model, broken, onset.t, end);
        ++tally.certain;
        tally.missed += seen ? 0 : 1;
        // A lost effort scales what a smooth effort strays from its straight line, too, which the declared bound, of
        // healthy efforts, does not cover.
        const bool kept = kind != Kind::effort_loss || c.changes != Changes::smooth;
        if (seen && !looked && kept) {
          looked = true;
          ++tally.isolated;
          tally.excluded += isolated(model, broken, fault.fault, breakdown) ? 0 : 1;
        }
      }
    }
  }
}

}  // namespace

const char* name(Verdict::End end) {
  static constexpr const char* kNames[] = {"guaranteed", "intervals", "learnt", "empty", "refused"};
  return kNames[static_cast<std::size_t>(end)];
}

Verdict judge(const Case& c, const JudgeOptions& options) {
  const Scene scene = play(c, options.oracle);
  Verdict verdict;
  verdict.rows = scene.learned.rows();
  const auto start = std::chrono::steady_clock::now();
  try {
    TableSource log(scene.learned);
    const Commissioning result = commission_robot(log, scene.robot);
    verdict.commission_seconds = seconds_since(start);
    verdict.message = result.message;
    switch (result.status) {
      case Commissioning::Status::empty:
      case Commissioning::Status::contradicted: verdict.end = Verdict::End::empty; return verdict;
      case Commissioning::Status::nothing: verdict.end = Verdict::End::refused; return verdict;
      case Commissioning::Status::done:
      case Commissioning::Status::partial: break;
    }
    verdict.end = result.model.warrant == core::Warrant::guaranteed                   ? Verdict::End::guaranteed
                  : commission::interval_warrant(result) == core::Warrant::guaranteed ? Verdict::End::intervals
                                                                                      : Verdict::End::learnt;
    for (const core::Assumption& assumption : result.assumptions) {
      if (assumption.verdict == core::AssumptionVerdict::fails) {
        verdict.failing += (verdict.failing.empty() ? "" : " ") + assumption.id;
      }
    }
    check_truth(scene, result, verdict);
    const auto watching = std::chrono::steady_clock::now();
    watch(scene.watched, result.model, verdict);
    verdict.watch_seconds = seconds_since(watching);
    const bool whole = c.lost == 0.0 && c.sense != Sense::mean_speed;
    if (options.faults && whole && c.broken == Broken::none && verdict.end == Verdict::End::guaranteed) {
      try_faults(c, result.model, verdict);
    }
    if (options.oracle && result.model.filter.order == 2) {
      verdict.oracle = oracle_width(c, scene, result);
    }
  } catch (const std::exception& e) {
    verdict.end = Verdict::End::refused;
    verdict.message = e.what();
    verdict.commission_seconds = seconds_since(start);
  }
  return verdict;
}

}  // namespace wheelwright::guarantee
