// SPDX-License-Identifier: Apache-2.0
#include "model/sim/plant.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>
#include <utility>

#include "core/check.hpp"
#include "core/linear_algebra.hpp"
#include "core/random.hpp"
#include "model/effect_law.hpp"

namespace wheelwright::sim {
namespace {

// splitmix64 (Steele, Lea and Flood 2014): spreads seed and stream over all 64 bits.
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31U);
}

}  // namespace

Noise::Noise(std::uint64_t seed, std::uint64_t stream, double bound, NoiseShape shape)
    : generator_(mix(mix(seed) ^ stream)), bound_(check::non_negative(bound, "noise bound")), shape_(shape) {}

double Noise::uniform() { return 2.0 * core::uniform(generator_) - 1.0; }

double Noise::unit() {
  double x = uniform();
  if (shape_ == NoiseShape::two_point) {
    return x < 0.0 ? -1.0 : 1.0;
  }
  if (shape_ == NoiseShape::truncated_gaussian) {
    // Rejection from the uniform: density ∝ exp(−(3x)²/2) on [−1, 1]; 1 − (3x)²/2 lies below it and spares most of exp.
    for (;;) {
      const double height = 0.5 * (uniform() + 1.0);
      if (height <= 1.0 - 4.5 * x * x || height <= std::exp(-4.5 * x * x)) {
        break;
      }
      x = uniform();
    }
  }
  return x;
}

double Noise::measure(double exact) {
  if (bound_ == 0.0) {
    return exact;
  }
  double measured = exact + bound_ * unit();
  while (std::abs(measured - exact) > bound_) {  // the sum was rounded outward
    measured = std::nextafter(measured, exact);
  }
  return measured;
}

namespace {

constexpr double largest_slip = 0.2;

double soft_sign(double x, double x0) { return x0 > 0.0 ? std::clamp(x / x0, -1.0, 1.0) : 0.0; }

bool is_force(const model::RobotEffect& effect) {
  const model::EffectLaw& law = model::effect_law(effect.name);
  return law.mechanism == model::EffectMechanism::term || law.mechanism == model::EffectMechanism::simulation;
}

using TakeOver = void (*)(DriveEffects& effects, const model::RobotEffect& effect);

// 0 where the robot file does not name it.
double given(const model::RobotEffect& effect, const char* parameter) {
  return effect.parameters.contains(parameter) ? effect.value(parameter) : 0.0;
}

// The effects that have a formula here.
const std::map<std::string_view, TakeOver>& own_formulas() {
  using D = DriveEffects;
  using E = model::RobotEffect;
  static const std::map<std::string_view, TakeOver> all = {
      {"coulomb", [](D& d, const E& e) { d.coulomb.array() += given(e, "c"); }},
      {"coulomb_asymmetric", [](D& d, const E& e) { d.coulomb += Eigen::Vector2d(given(e, "c_R"), given(e, "c_L")); }},
      {"torque_bias",
       [](D& d, const E& e) {
         d.bias = {given(e, "b_R"), given(e, "b_L")};
       }},
      {"wheel_out_of_round",
       [](D& d, const E& e) {
         d.round_cos = {given(e, "A_R"), given(e, "A_L")};
         d.round_sin = {given(e, "B_R"), given(e, "B_L")};
       }},
      {"stribeck",
       [](D& d, const E& e) {
         d.stribeck = given(e, "c_s");
         d.stribeck_speed = given(e, "omega_s");
       }},
      {"viscous_asymmetric", [](D& d, const E& e) { d.viscous = given(e, "b"); }},
      {"quadratic_drag",
       [](D& d, const E& e) {
         d.drag = given(e, "c");
         d.drag_yaw = given(e, "c2");
       }},
      {"com_longitudinal", [](D& d, const E& e) { d.com_longitudinal = given(e, "a"); }},
      {"com_lateral", [](D& d, const E& e) { d.com_lateral = given(e, "b"); }},
      {"slope",
       [](D& d, const E& e) {
         d.gravity = {given(e, "g_x"), given(e, "g_y")};
       }},
      {"caster_drag",
       [](D& d, const E& e) {
         d.caster = given(e, "c");
         d.caster_arm = given(e, "p");
       }},
      {"lateral_scrub", [](D& d, const E& e) { d.scrub = given(e, "mu"); }},
      {"load_friction", [](D& d, const E& e) { d.load = given(e, "k"); }},
      {"friction_drift",
       [](D& d, const E& e) {
         d.drift = given(e, "k");
         d.drift_time = given(e, "T");
       }},
      {"longitudinal_slip", [](D& d, const E& e) { d.stiffness = given(e, "stiffness"); }},
  };
  return all;
}

DriveEffects::ByTerms act_by_terms(const Robot& robot, const model::RobotEffect& effect) {
  Robot with = robot;
  with.effects = {effect};
  Robot without = robot;
  without.effects.clear();
  const Model base = model::make_model(without);
  DriveEffects::ByTerms out{model::effect_terms(base, with), {}, {}, core::inverse(base.input)};
  for (const Term& term : out.terms.terms) {
    check::that(term.kind != Term::Kind::acceleration, "effects." + effect.name,
                "no terms of acceleration, for which the simulator has no formula of this effect");
  }
  const auto& known = model::effect_law(effect.name).parameters_of(robot);
  for (const model::Parameter& parameter : out.terms.parameters) {
    const auto law = std::ranges::find(known, parameter.physical, &model::EffectParameterLaw::physical);
    out.sizes.push_back(parameter.per_physical * effect.value(law->name));
    out.times_mass.push_back(law->times_mass);
  }
  return out;
}

// Torques at the wheels; where they jump, at a sign of a speed, they go over as dry friction does.
Eigen::Vector2d torques_of(const DriveEffects::ByTerms& effect, const DifferentialDrive& drive, double mass,
                           double per_torque, const EffectState& x) {
  const std::array<double, 2> speed{x.speed, x.yaw_rate}, wheels{x.wheel_speed[0], x.wheel_speed[1]};
  const auto within = [&](const Eigen::Vector2d& width) {
    const double forward = 0.5 * drive.wheel_radius * (width[0] + width[1]);
    const std::array<double, 2> speed_error{forward, 2.0 * forward / drive.track_width};
    const std::array<double, 2> wheel_error{width[0], width[1]};
    const model::MotionState state{.speed = speed,
                                   .speed_error = speed_error,
                                   .joint_speed = wheels,
                                   .joint_error = wheel_error,
                                   .heading = x.heading};
    Eigen::Vector2d outputs = Eigen::Vector2d::Zero();
    for (const Term& term : effect.terms.terms) {
      const double size = effect.sizes[term.parameter] * (effect.times_mass[term.parameter] ? mass : 1.0);
      const double value =
          term.kind == Term::Kind::speed ? speed[term.coordinate] : model::softened(term.function, state);
      outputs[static_cast<Eigen::Index>(term.output)] += size * term.scale * value;
    }
    return Eigen::Vector2d(effect.wheel_torques * outputs);
  };
  return within(per_torque * within(Eigen::Vector2d::Zero()).cwiseAbs());
}

}  // namespace

DriveEffects::DriveEffects(const Robot& robot) {
  forces = std::ranges::any_of(robot.effects, is_force);
  const model::DriveGeometry geometry = model::drive_geometry(robot);
  radius = geometry.radius.array() - robot.wheel_radius;
  track = geometry.track_width - robot.track_width;
  for (const model::RobotEffect& effect : robot.effects) {
    if (const auto own = own_formulas().find(effect.name); own != own_formulas().end()) {
      own->second(*this, effect);
    } else if (model::effect_law(effect.name).mechanism == model::EffectMechanism::term) {
      by_terms.push_back(act_by_terms(robot, effect));
    }
  }
}

DryThreshold dry_threshold(const DriveEffects& e, const DifferentialDrive& drive, const model::DriveParameters& p,
                           double step) {
  const double r = drive.wheel_radius, arm = 0.5 * drive.track_width;
  const double mobility = 2.0 * std::max(1.0 / p.mass, arm * arm / p.yaw_inertia) / (r * r);
  const double friction = e.coulomb.maxCoeff() + std::abs(e.stribeck) + (e.load > 0.0 ? 10.0 * e.load : 0.0);
  return {2.0 * step * friction * mobility, 2.0 * step * std::abs(e.scrub) / (r * p.yaw_inertia),
          2.0 * step * e.caster / r * std::max(1.0 / p.mass, e.caster_arm * e.caster_arm / p.yaw_inertia),
          2.0 * step * mobility};
}

EffectLoad effect_load(const DriveEffects& e, const DifferentialDrive& drive, const model::DriveParameters& p,
                       const DryThreshold& threshold, const EffectState& s) {
  EffectLoad load;
  const double warm = e.drift * -std::expm1(-s.t / e.drift_time);
  for (Eigen::Index j = 0; j < 2; ++j) {
    const double w = s.wheel_speed[j], slow = w / e.stribeck_speed;
    const double dry =
        e.coulomb[j] * (1.0 - warm) + e.stribeck * std::exp(-slow * slow) + e.load * std::abs(s.torque[j]);
    load.torque[j] = dry * soft_sign(w, threshold.wheel) + e.bias[j] + e.round_cos[j] * std::cos(s.wheel_angle[j]) +
                     e.round_sin[j] * std::sin(s.wheel_angle[j]);
  }
  for (const DriveEffects::ByTerms& effect : e.by_terms) {
    load.torque += torques_of(effect, drive, p.mass, threshold.per_torque, s);
  }
  const double r = drive.wheel_radius, arm = 0.5 * (drive.track_width + e.track), u = s.speed, w = s.yaw_rate;
  const double across = e.caster_arm * w, caster = std::max(std::hypot(u, across), threshold.caster);
  double sum = e.viscous * arm * w / r + e.drag * u * std::abs(u);
  double difference = e.viscous * arm * u / r + e.drag_yaw * w * std::abs(w) + e.scrub * soft_sign(w, threshold.yaw);
  if (caster > 0.0) {
    sum += e.caster * u / caster;
    difference += e.caster * e.caster_arm * across / caster;
  }
  load.force = sum / r - p.mass * e.com_longitudinal * w * w - warm * p.viscous_x * u +
               p.mass * (e.gravity[0] * std::cos(s.heading) + e.gravity[1] * std::sin(s.heading));
  load.moment = difference / r + p.mass * e.com_longitudinal * u * w - warm * p.viscous_yaw * w;
  return load;
}

Eigen::Vector2d slip_share(const DriveEffects& e, const Eigen::Vector2d& force, const Eigen::Vector2d& rim_speed) {
  Eigen::Vector2d share = Eigen::Vector2d::Zero();
  for (Eigen::Index j = 0; j < 2 && e.stiffness > 0.0; ++j) {
    share[j] = std::clamp(std::copysign(1.0, rim_speed[j]) * force[j] / e.stiffness, -largest_slip, largest_slip);
  }
  return share;
}

namespace {

constexpr double longest_runge_kutta_step = 2e-3;    // s
constexpr double longest_step_of_effects = 0.25e-3;  // s
// Gauss-Legendre on [0, 1]: nodes ½ ∓ √15/10, ½; weights 5/18, 4/9, 5/18.
constexpr std::array<double, 3> nodes = {0.1127016653792583, 0.5, 0.8872983346207417};
constexpr std::array<double, 3> weights = {5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0};

// Σ_k z^k / (k + 3)!
double phi3(double z) {
  if (std::abs(z) > 0.5) {
    return ((std::expm1(z) / z - 1.0) / z - 0.5) / z;
  }
  double sum = 1.0;
  for (int k = std::abs(z) < 0.02 ? 8 : 15; k >= 1; --k) {
    sum = 1.0 + sum * z / (k + 3.0);
  }
  return sum / 6.0;
}

}  // namespace

Plant::Plant(const DifferentialDrive& drive, const model::DriveParameters& parameters, std::vector<model::Fault> faults,
             const DriveEffects& effects)
    : drive_(drive),
      parameters_(parameters),
      faults_(std::move(faults)),
      effects_(effects),
      half_track_(0.5 * (drive.track_width + effects.track)) {
  model::validate(parameters_);
  model::validate(faults_, drive_);
  threshold_ = dry_threshold(effects_, drive_, parameters_, longest_step_of_effects);
  for (const model::Fault& fault : faults_) {
    const model::TimeProfile& p = fault.profile;
    const double rise = p.shape == model::TimeProfile::Shape::step ? 0.0 : p.rise_time;
    for (const double t : {p.onset, p.onset + rise, p.end, p.end + rise}) {
      if (std::isfinite(t)) {
        breaks_.push_back(t);
      }
    }
  }
  std::sort(breaks_.begin(), breaks_.end());
  breaks_.erase(std::unique(breaks_.begin(), breaks_.end()), breaks_.end());
  reset({}, 0.0);
}

void Plant::reset(const DriveState& state, double t) {
  state_ = state;
  t_ = t;
  torque_.setZero();
  enter_interval();
}

void Plant::set_time(double t) {
  t_ = t;
  const bool inside =
      (interval_ == 0 || t_ >= breaks_[interval_ - 1]) && (interval_ == breaks_.size() || t_ < breaks_[interval_]);
  if (!inside) {
    enter_interval();
  }
}

void Plant::enter_interval() {
  interval_ = static_cast<std::size_t>(std::upper_bound(breaks_.begin(), breaks_.end(), t_) - breaks_.begin());
  double middle = 0.0;
  if (!breaks_.empty()) {
    const double first = interval_ == 0 ? breaks_.front() - 2.0 : breaks_[interval_ - 1];
    const double last = interval_ == breaks_.size() ? breaks_.back() + 2.0 : breaks_[interval_];
    middle = 0.5 * (first + last);
  }
  fault_ = fault_at(middle);
  moving_ = !fault_.radius_rate.isZero(0.0) || !fault_.slip_rate.isZero(0.0) || fault_.matched_rate != 0.0 ||
            fault_.unmatched_rate != 0.0;
  exact_ = !effects_.forces && !moving_ && fault_.slip.isZero(0.0) && fault_.matched == 0.0 &&
           fault_.unmatched == 0.0 && parameters_.viscous_x == parameters_.viscous_y;
}

model::FaultState Plant::fault_at(double t) const {
  model::FaultState fault = model::fault_state(faults_, t);
  fault.radius += effects_.radius;
  return fault;
}

Eigen::Vector2d Plant::wheel_speed() const { return wheel_speed(state_, moving_ ? fault_at(t_) : fault_, torque_); }

Eigen::Vector2d Plant::wheel_speed(const DriveState& state, const model::FaultState& fault,
                                   const Eigen::Vector2d& torque) const {
  const double c = std::cos(state.pose[2]), s = std::sin(state.pose[2]);
  const double rolling = state.forward_speed - (c * fault.slip[0] + s * fault.slip[1] + fault.matched);
  const double turning = half_track_ * (state.yaw_rate - fault.slip[2]);
  const double right = drive_.wheel_radius + fault.radius[0], left = drive_.wheel_radius + fault.radius[1];
  Eigen::Vector2d speed((rolling + turning) / right, (rolling - turning) / left);
  if (effects_.stiffness > 0.0) {
    const Eigen::Vector2d slip = slip_share(effects_, {torque[0] / right, torque[1] / left}, speed);
    speed = speed.cwiseProduct(Eigen::Vector2d::Ones() + slip);
  }
  return speed;
}

Plant::Derivative Plant::derivative(const DriveState& state, const model::FaultState& fault,
                                    const Eigen::Vector2d& torque, double t) const {
  const double c = std::cos(state.pose[2]), s = std::sin(state.pose[2]);
  const double across = -s * fault.slip[0] + c * fault.slip[1] - fault.unmatched;
  const double x_rate = state.forward_speed * c - across * s, y_rate = state.forward_speed * s + across * c;
  const Eigen::Vector2d wheels = wheel_speed(state, fault, torque);
  EffectLoad load;
  if (effects_.forces) {
    load = effect_load(effects_, drive_, parameters_, threshold_,
                       {t, state.forward_speed, state.yaw_rate, state.pose[2], wheels, state.wheel_angle, torque});
  }
  const double right = (torque[0] - load.torque[0]) / (drive_.wheel_radius + fault.radius[0]);
  const double left = (torque[1] - load.torque[1]) / (drive_.wheel_radius + fault.radius[1]);
  const double friction = c * parameters_.viscous_x * x_rate + s * parameters_.viscous_y * y_rate;
  const double force = right + left - friction - load.force;
  const double moment = half_track_ * (right - left) - parameters_.viscous_yaw * state.yaw_rate - load.moment;
  double forward = force / parameters_.mass, yaw = moment / parameters_.yaw_inertia;
  if (effects_.com_lateral != 0.0) {  // [m −mb; −mb I] [u̇; θ̈] = [force; moment]
    const double m = parameters_.mass, inertia = parameters_.yaw_inertia, coupling = m * effects_.com_lateral;
    const double determinant = m * inertia - coupling * coupling;
    forward = (inertia * force + coupling * moment) / determinant;
    yaw = (coupling * force + m * moment) / determinant;
  }
  return {state.yaw_rate * across + forward, yaw, {x_rate, y_rate, state.yaw_rate}, wheels};
}

void Plant::advance(const Eigen::Vector2d& torque, const Eigen::Vector2d& torque_end, double h) {
  const Eigen::Vector2d slope = (torque_end - torque) / h;
  const double end = t_ + h;
  double done = 0.0;
  while (done < h) {
    const double to_break =
        interval_ < breaks_.size() ? breaks_[interval_] - t_ : std::numeric_limits<double>::infinity();
    const bool cut = to_break < h - done;
    const double piece = cut ? to_break : h - done;
    if (exact_) {
      exact_step(torque + done * slope, slope, piece);
    } else {
      runge_kutta(torque + done * slope, slope, piece);
    }
    done = cut ? done + piece : h;
    t_ = cut ? breaks_[interval_] : end;
    if (interval_ < breaks_.size() && t_ >= breaks_[interval_]) {
      enter_interval();
    }
  }
  torque_ = torque_end;
}

Plant::Response Plant::response(double a, double time) {
  const double z = -a * time;
  const double f3 = phi3(z), f2 = 0.5 + z * f3, f1 = 1.0 + z * f2;
  return {1.0 + z * f1, time * f1, time * time * f2, time * time * time * f3};
}

void Plant::prepare(double h) {
  if (h == prepared_step_) {
    return;
  }
  const double a1 = parameters_.viscous_x / parameters_.mass, a2 = parameters_.viscous_yaw / parameters_.yaw_inertia;
  for (std::size_t i = 0; i < 4; ++i) {
    const double time = i < 3 ? nodes[i] * h : h;
    forward_[i] = response(a1, time);
    yaw_[i] = response(a2, time);
  }
  prepared_step_ = h;
}

void Plant::exact_step(const Eigen::Vector2d& torque, const Eigen::Vector2d& slope, double h) {
  prepare(h);
  const double right = drive_.wheel_radius + fault_.radius[0], left = drive_.wheel_radius + fault_.radius[1];
  const double half_track = half_track_;
  const double f0 = (torque[0] / right + torque[1] / left) / parameters_.mass;
  const double f1 = (slope[0] / right + slope[1] / left) / parameters_.mass;
  const double g0 = half_track * (torque[0] / right - torque[1] / left) / parameters_.yaw_inertia;
  const double g1 = half_track * (slope[0] / right - slope[1] / left) / parameters_.yaw_inertia;
  const double u = state_.forward_speed, w = state_.yaw_rate;

  double dx = 0.0, dy = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double ui = forward_[i].decay * u + forward_[i].i1 * f0 + forward_[i].i2 * f1;
    const double heading = state_.pose[2] + yaw_[i].i1 * w + yaw_[i].i2 * g0 + yaw_[i].i3 * g1;
    dx += weights[i] * ui * std::cos(heading);
    dy += weights[i] * ui * std::sin(heading);
  }
  const Response& fe = forward_[3];
  const Response& ye = yaw_[3];
  const double distance = fe.i1 * u + fe.i2 * f0 + fe.i3 * f1;
  const double turn = ye.i1 * w + ye.i2 * g0 + ye.i3 * g1;
  state_.forward_speed = fe.decay * u + fe.i1 * f0 + fe.i2 * f1;
  state_.yaw_rate = ye.decay * w + ye.i1 * g0 + ye.i2 * g1;
  state_.pose += Eigen::Vector3d(h * dx, h * dy, turn);
  state_.wheel_angle += Eigen::Vector2d((distance + half_track * turn) / right, (distance - half_track * turn) / left);
}

void Plant::runge_kutta(const Eigen::Vector2d& torque, const Eigen::Vector2d& slope, double h) {
  const double longest = effects_.forces ? longest_step_of_effects : longest_runge_kutta_step;
  const int steps = std::max(1, static_cast<int>(std::ceil(h / longest)));
  const double step = h / steps;
  const auto moved = [](const DriveState& from, const Derivative& d, double by) {
    return DriveState{from.forward_speed + by * d.forward, from.yaw_rate + by * d.yaw, from.pose + by * d.pose,
                      from.wheel_angle + by * d.angle};
  };
  for (int i = 0; i < steps; ++i) {
    const double s = i * step;
    const auto at = [&](double by) { return moving_ ? fault_at(t_ + s + by) : fault_; };
    const auto rate = [&](const DriveState& state, const model::FaultState& fault, double by) {
      return derivative(state, fault, torque + (s + by) * slope, t_ + s + by);
    };
    const model::FaultState middle = at(0.5 * step);
    const Derivative k1 = rate(state_, at(0.0), 0.0);
    const Derivative k2 = rate(moved(state_, k1, 0.5 * step), middle, 0.5 * step);
    const Derivative k3 = rate(moved(state_, k2, 0.5 * step), middle, 0.5 * step);
    const Derivative k4 = rate(moved(state_, k3, step), at(step), step);
    state_ = moved(state_,
                   {(k1.forward + 2.0 * k2.forward + 2.0 * k3.forward + k4.forward) / 6.0,
                    (k1.yaw + 2.0 * k2.yaw + 2.0 * k3.yaw + k4.yaw) / 6.0,
                    (k1.pose + 2.0 * k2.pose + 2.0 * k3.pose + k4.pose) / 6.0,
                    (k1.angle + 2.0 * k2.angle + 2.0 * k3.angle + k4.angle) / 6.0},
                   step);
  }
}

}  // namespace wheelwright::sim
