// SPDX-License-Identifier: Apache-2.0
#include "gap/effort_units.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "commission/physical.hpp"
#include "core/error.hpp"

namespace wheelwright::gap {
namespace {

using model::EffortKind;

// With 1 N·m counted as "E": N is E/m, kg is E·s²/m².
constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kUnits{{{"N·m", "E"},
                                                                               {"N·m²", "E·m"},
                                                                               {"N·s/m", "E·s/m²"},
                                                                               {"N·m·s/rad", "E·s/rad"},
                                                                               {"N·m²·s²/rad²", "E·m·s²/rad²"},
                                                                               {"1/(N·m)", "1/E"},
                                                                               {"kg", "E·s²/m²"},
                                                                               {"kg·m²", "E·s²"},
                                                                               {"N", "E/m"}}};
constexpr std::string_view kMassUnit = "_kg";

void add_to(Interval& interval, double offset) {
  interval.lower += offset;
  interval.upper += offset;
}

}  // namespace

TorqueView in_torques(const Robot& robot) {
  TorqueView view{robot, robot.effort, true, 1.0, {}};
  if (robot.effort == EffortKind::torque) {
    return view;
  }
  const Model model = model::make_model(robot);
  const auto scales = commission::physical_scales(robot, model);
  view.robot.effort = EffortKind::torque;
  view.physical = scales.has_value();
  if (!scales) {
    view.robot.nominal.clear();
    const model::PriorBox prior = model::prior_box(robot, model);
    for (std::size_t j = 0; j < model.p(); ++j) {
      const double per_physical = model.parameters[j].per_physical;
      view.robot.prior[model.parameters[j].physical] = {prior.bounds[j].lower / per_physical,
                                                        prior.bounds[j].upper / per_physical};
    }
    return view;
  }
  view.torque_per_effort = 1.0 / *model::effort_per_torque(robot);
  for (std::size_t j = 0; j < model.p(); ++j) {
    const double offset = (*scales)[j].offset;
    const std::string& name = model.parameters[j].physical;
    if (offset == 0.0) {
      continue;
    }
    view.back_emf[name] = offset;
    if (const auto nominal = view.robot.nominal.find(name); nominal != view.robot.nominal.end()) {
      nominal->second += offset;
    }
    if (const auto prior = view.robot.prior.find(name); prior != view.robot.prior.end()) {
      add_to(prior->second, offset);
    }
  }
  model::NoiseBound& noise = view.robot.noise.effort;
  for (std::optional<double>* of : {&noise.value, &noise.bias, &noise.deviation}) {
    if (*of) {
      **of *= view.torque_per_effort;
    }
  }
  if (const auto limit = view.robot.limits.find("effort"); limit != view.robot.limits.end()) {
    limit->second *= view.torque_per_effort;
  }
  return view;
}

void to_torques(LogTable& log, const TorqueView& view) {
  if (view.logged == EffortKind::torque) {
    return;
  }
  // Torques that are logged beside are not what the robot file asks for.
  for (const model::Joint& joint : model::make_model(view.robot).joints) {
    const auto other = std::ranges::find(log.names, joint.torque);
    if (other != log.names.end()) {
      *other += "_logged";
    }
    const auto effort = std::ranges::find(log.names, model::effort_column(joint, view.logged));
    if (effort == log.names.end()) {
      continue;
    }
    for (double& value : log.columns[static_cast<std::size_t>(effort - log.names.begin())]) {
      value *= view.torque_per_effort;
    }
    *effort = joint.torque;
  }
}

void tell_units(Drive& drive, const TorqueView& view) {
  drive.efforts_flowed = view.logged == EffortKind::current;
  for (std::string& unit : drive.model.output_units) {
    unit = effort_unit(view, unit);
  }
}

std::string effort_unit(const TorqueView& view, const std::string& unit) {
  if (view.physical) {
    return unit;
  }
  const char effort = view.logged == EffortKind::current ? 'A' : 'V';
  const auto known = std::ranges::find(kUnits, unit, &std::pair<std::string_view, std::string_view>::first);
  if (known != kUnits.end()) {
    std::string told(known->second);
    std::ranges::replace(told, 'E', effort);
    return told;
  }
  const bool of_effort = unit.find('N') != std::string::npos || unit.find("kg") != std::string::npos;
  return of_effort ? unit + " (" + effort + " for N·m)" : unit;
}

void from_torques(Diagnosis& diagnosis, const Robot& robot, const TorqueView& view) {
  if (view.logged == EffortKind::torque) {
    return;
  }
  if (!view.physical) {
    const Model model = model::make_model(robot);
    const auto tell = [&view](std::string& name, std::string& unit) {
      unit = effort_unit(view, unit);
      if (name.ends_with(kMassUnit)) {
        name.resize(name.size() - kMassUnit.size());
      }
    };
    for (GapCause& cause : diagnosis.causes) {
      for (GapEstimate& estimate : cause.parameters) {
        tell(estimate.name, estimate.unit);
      }
      for (GapLaw& law : cause.laws) {
        for (GapEstimate& estimate : law.parameters) {
          tell(estimate.name, estimate.unit);
        }
      }
    }
    for (VisibleSize& size : diagnosis.visible) {
      tell(size.parameter, size.unit);
    }
    for (ParameterShift& shift : diagnosis.parametric) {
      const auto parameter = std::ranges::find(model.parameters, shift.parameter, &model::Parameter::physical);
      if (parameter == model.parameters.end()) {
        continue;
      }
      shift.parameter = parameter->name;
      shift.unit = commission::parameter_unit(robot, *parameter);
      for (double* of : {&shift.without_causes, &shift.estimate, &shift.lower, &shift.upper}) {
        *of *= parameter->per_physical;
      }
    }
    diagnosis.notes.push_back(
        std::string("efforts are in ") + (view.logged == EffortKind::current ? "A" : "V") +
        ", and so is all that is told of them: masses and frictions in kg and N·m need the motor's constants in the "
        "robot file (motor: torque_constant, gear_ratio" +
        (view.logged == EffortKind::voltage ? ", resistance, back_emf)" : ")") +
        (robot.nominal.empty() ? "" : "; without them its nominal values say nothing about this log"));
  }
  for (ParameterShift& shift : diagnosis.parametric) {
    if (const auto offset = view.back_emf.find(shift.parameter); offset != view.back_emf.end()) {
      for (double* of : {&shift.without_causes, &shift.estimate, &shift.lower, &shift.upper}) {
        *of -= offset->second;
      }
      if (shift.nominal) {
        *shift.nominal -= offset->second;
      }
    }
  }
  if (!diagnosis.improved) {
    return;
  }
  Robot& improved = *diagnosis.improved;
  improved.effort = robot.effort;
  improved.noise = robot.noise;
  improved.limits = robot.limits;
  if (!view.physical) {
    improved.nominal = robot.nominal;
    improved.prior = robot.prior;
  }
  for (const auto& [name, offset] : view.back_emf) {
    if (const auto nominal = improved.nominal.find(name); nominal != improved.nominal.end()) {
      nominal->second = std::max(nominal->second - offset, 0.0);
    }
    if (const auto prior = improved.prior.find(name); prior != improved.prior.end()) {
      add_to(prior->second, -offset);
    }
  }
  try {
    static_cast<void>(model::make_model(improved));
  } catch (const InvalidArgument& error) {
    diagnosis.notes.push_back(std::string("no improved robot file: ") + error.what());
    diagnosis.improved.reset();
  }
}

}  // namespace wheelwright::gap
