// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tests/world/rivals.hpp"

namespace wheelwright::reality {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

Column zero(const Signals& g) {
  const VectorXd none = VectorXd::Zero(g.rows());
  return {none, none, none, none};
}

Column torque_column(VectorXd s, VectorXd d) {
  const VectorXd none = VectorXd::Zero(s.size());
  return {std::move(s), std::move(d), none, none};
}

/// A torque on the right and one on the left wheel.
Column wheel_column(const VectorXd& r, const VectorXd& l) { return torque_column(r + l, r - l); }

VectorXd sign(const VectorXd& u, double width = 0.02) { return (u / width).array().tanh(); }

VectorXd rate_of(const VectorXd& u, double period) {
  VectorXd out = VectorXd::Zero(u.size());
  const Index n = u.size() - 2;
  out.segment(1, n) = (u.tail(n) - u.head(n)) / (2.0 * period);
  return out;
}

Guess one(Column column) { return {{std::move(column)}, {}, 0.0}; }

Guess shifted(const Signals& g, double time) {
  Guess guess;
  const double rows = time / g.period;
  for (std::size_t i = 0; i < 2; ++i) {
    guess.torque[i].resize(g.rows());
    for (Eigen::Index k = 0; k < g.rows(); ++k) {
      const double place = std::clamp(static_cast<double>(k) - rows, 0.0, static_cast<double>(g.rows()) - 1.001);
      const auto j = static_cast<Eigen::Index>(place);
      const double part = place - static_cast<double>(j);
      guess.torque[i][k] = (1.0 - part) * g.torque[i][j] + part * g.torque[i][j + 1];
    }
  }
  return guess;
}

Guess lagged(const Signals& g, double time) {
  // First-order response to a command that is constant over each interval, averaged over the interval.
  Guess guess;
  const double h = g.period;
  const double keep = std::exp(-h / time);
  const double mean = time / h * (1.0 - keep);
  for (std::size_t i = 0; i < 2; ++i) {
    guess.torque[i].resize(g.rows());
    double state = 0.0;
    for (Eigen::Index k = 0; k < g.rows(); ++k) {
      const double u = g.torque[i][k];
      guess.torque[i][k] = u + (state - u) * mean;
      state = u + (state - u) * keep;
    }
  }
  return guess;
}

VectorXd after_reversal(const VectorXd& torque, double period, double time) {
  VectorXd out = VectorXd::Zero(torque.size());
  double since = 1e9;
  for (Eigen::Index k = 1; k < torque.size(); ++k) {
    since = torque[k] * torque[k - 1] < 0.0 ? 0.0 : since + period;
    out[k] = since < time ? torque[k] : 0.0;
  }
  return out;
}

/// Speeds and accelerations of a side as the model's: what a wrong scale ε of that side adds, and its torque.
Column scale_column(const RobotDesign& robot, const Signals& g, std::size_t side, bool radius) {
  const double r = robot.radius;
  const double arm = robot.half_track;
  const double f1 = 2.0 * robot.damping / (r * r);
  const double f3 = f1 * arm * arm;
  const double hand = side == right ? 1.0 : -1.0;
  Column column = zero(g);
  column.v1 = 0.5 * r * g.speed[side];
  column.v2 = hand * 0.5 * r / arm * g.speed[side];
  const VectorXd a1 = 0.5 * r * g.acceleration[side];
  const VectorXd a2 = hand * 0.5 * r / arm * g.acceleration[side];
  column.s = r * (robot.mass * a1 + f1 * column.v1);
  column.d = r / arm * (robot.yaw_inertia * a2 + f3 * column.v2);
  if (radius) {
    column.s += g.torque[side];
    column.d += hand * g.torque[side];
  }
  return column;
}

Guess drift(const Signals& g, double time) {
  const VectorXd grown = (1.0 - (-g.t / time).array().exp()).matrix();
  const VectorXd r = grown.cwiseProduct(g.speed[right]);
  const VectorXd l = grown.cwiseProduct(g.speed[left]);
  const VectorXd sr = grown.cwiseProduct(sign(g.speed[right]));
  const VectorXd sl = grown.cwiseProduct(sign(g.speed[left]));
  return {{wheel_column(r, l), wheel_column(sr, sl)}, {}, 0.0};
}

Guess caster(const RobotDesign& robot, const Signals& g, double place) {
  const VectorXd across = place * g.v2;
  const VectorXd speed = (g.v1.array().square() + across.array().square()).sqrt().max(0.003);
  return one(torque_column(g.v1.cwiseQuotient(speed), place / robot.half_track * across.cwiseQuotient(speed)));
}

std::vector<Rival> structural_rivals(const RobotDesign& robot) {
  const double typical = robot.typical_torque();
  const double arm = robot.half_track;
  return {
      {"coulomb", [](const RobotDesign&, const Signals& g,
                     double) { return one(wheel_column(sign(g.speed[right]), sign(g.speed[left]))); }},
      {"coulomb_asymmetric",
       [](const RobotDesign&, const Signals& g, double) {
         const VectorXd none = VectorXd::Zero(g.rows());
         return Guess{{wheel_column(sign(g.speed[right]), none), wheel_column(none, sign(g.speed[left]))}, {}, 0.0};
       }},
      {"stribeck",
       [](const RobotDesign&, const Signals& g, double edge) {
         const auto bell = [&](const VectorXd& w) -> VectorXd {
           return (-(w / edge).array().square()).exp().matrix().cwiseProduct(sign(w));
         };
         return one(wheel_column(bell(g.speed[right]), bell(g.speed[left])));
       },
       0.05 * robot.wheel_speed, 0.5 * robot.wheel_speed},
      {"viscous_asymmetric",
       [arm](const RobotDesign&, const Signals& g, double) { return one(torque_column(arm * g.v2, g.v1)); }},
      {"quadratic_drag",
       [](const RobotDesign&, const Signals& g, double) {
         const VectorXd none = VectorXd::Zero(g.rows());
         return Guess{{torque_column(g.v1.cwiseProduct(g.v1.cwiseAbs()), none),
                       torque_column(none, g.v2.cwiseProduct(g.v2.cwiseAbs()))},
                      {},
                      0.0};
       }},
      {"com_longitudinal",
       [arm](const RobotDesign&, const Signals& g, double) {
         return one(torque_column(-g.v2.cwiseProduct(g.v2), g.v1.cwiseProduct(g.v2) / arm));
       }},
      {"com_lateral",
       [arm](const RobotDesign&, const Signals& g, double) { return one(torque_column(g.a2, g.a1 / arm)); }},
      {"torque_gain_asymmetric",
       [](const RobotDesign&, const Signals& g, double) { return one(torque_column(g.d, g.s)); }},
      {"torque_bias",
       [](const RobotDesign&, const Signals& g, double) {
         const VectorXd ones = VectorXd::Ones(g.rows());
         const VectorXd none = VectorXd::Zero(g.rows());
         return Guess{{torque_column(ones, none), torque_column(none, ones)}, {}, 0.0};
       }},
      {"slope",
       [](const RobotDesign&, const Signals& g, double) {
         const VectorXd none = VectorXd::Zero(g.rows());
         return Guess{
             {torque_column(g.heading.array().cos(), none), torque_column(g.heading.array().sin(), none)}, {}, 0.0};
       }},
      {"actuator_lag", [](const RobotDesign&, const Signals& g, double time) { return lagged(g, time); }, 0.001, 0.2},
      {"delay", [](const RobotDesign&, const Signals& g, double time) { return shifted(g, time); }, 0.001, 0.2},
      {"sensor_time_offset",
       [](const RobotDesign&, const Signals& g, double time) {
         Guess guess = shifted(g, time);
         guess.late = time;
         return guess;
       },
       -0.15, 0.15},
      {"torque_deadzone",
       [](const RobotDesign&, const Signals& g, double width) {
         return one(wheel_column(g.torque[right].cwiseMax(-width).cwiseMin(width),
                                 g.torque[left].cwiseMax(-width).cwiseMin(width)));
       },
       0.01 * typical, 1.5 * typical},
      {"saturation",
       [](const RobotDesign&, const Signals& g, double limit) {
         Guess guess;
         for (std::size_t i = 0; i < 2; ++i) {
           guess.torque[i] = g.torque[i].cwiseMax(-limit).cwiseMin(limit);
         }
         return guess;
       },
       0.5 * typical, robot.effort_limit},
      {"backlash",
       [](const RobotDesign&, const Signals& g, double time) {
         return one(wheel_column(after_reversal(g.torque[right], g.period, time),
                                 after_reversal(g.torque[left], g.period, time)));
       },
       0.01, 0.3},
      {"load_friction",
       [](const RobotDesign&, const Signals& g, double) {
         return one(wheel_column(g.torque[right].cwiseAbs().cwiseProduct(sign(g.speed[right])),
                                 g.torque[left].cwiseAbs().cwiseProduct(sign(g.speed[left]))));
       }},
      {"battery_sag",
       [](const RobotDesign&, const Signals& g, double) {
         const VectorXd load = g.torque[right].cwiseAbs() + g.torque[left].cwiseAbs();
         return Guess{{torque_column(g.t.cwiseProduct(g.s), g.t.cwiseProduct(g.d)),
                       torque_column(load.cwiseProduct(g.s), load.cwiseProduct(g.d))},
                      {},
                      0.0};
       }},
      {"friction_drift", [](const RobotDesign&, const Signals& g, double time) { return drift(g, time); }, 10.0, 200.0},
      {"caster_drag", [](const RobotDesign& r, const Signals& g, double place) { return caster(r, g, place); },
       0.3 * arm, 2.0 * arm},
      {"lateral_scrub", [](const RobotDesign&, const Signals& g,
                           double) { return one(torque_column(VectorXd::Zero(g.rows()), sign(g.v2, 0.01))); }},
      {"wheel_out_of_round",
       [](const RobotDesign&, const Signals& g, double) {
         const VectorXd none = VectorXd::Zero(g.rows());
         Guess guess;
         for (const bool cosine : {true, false}) {
           const VectorXd r = cosine ? VectorXd(g.angle[right].array().cos()) : VectorXd(g.angle[right].array().sin());
           const VectorXd l = cosine ? VectorXd(g.angle[left].array().cos()) : VectorXd(g.angle[left].array().sin());
           guess.columns.push_back(wheel_column(r, none));
           guess.columns.push_back(wheel_column(none, l));
         }
         return guess;
       }},
  };
}

std::vector<Rival> kinematic_rivals(const RobotDesign& robot) {
  const double arm = robot.half_track;
  std::vector<Rival> all{{"longitudinal_slip",
                          [arm](const RobotDesign& design, const Signals& g, double) {
                            Column column = zero(g);
                            const VectorXd r = g.speed[right].cwiseAbs().cwiseProduct(g.torque[right]);
                            const VectorXd l = g.speed[left].cwiseAbs().cwiseProduct(g.torque[left]);
                            column.v1 = 0.5 * design.radius * (r + l);
                            column.v2 = 0.5 * design.radius / arm * (r - l);
                            // The body, which lags behind its wheels, is what has the mass.
                            const double f1 = 2.0 * design.damping / (design.radius * design.radius);
                            column.s = design.radius * (design.mass * rate_of(column.v1, g.period) + f1 * column.v1);
                            column.d = design.radius / arm *
                                       (design.yaw_inertia * rate_of(column.v2, g.period) + f1 * arm * arm * column.v2);
                            return one(column);
                          }},
                         {"wheel_radius",
                          [](const RobotDesign&, const Signals& g, double) {
                            Column column = zero(g);
                            column.v1 = g.v1;
                            column.v2 = g.v2;
                            column.s = 2.0 * g.s;
                            column.d = 2.0 * g.d;
                            return one(column);
                          },
                          0.0, 0.0, true},
                         {"track_width",
                          [](const RobotDesign& design, const Signals& g, double) {
                            Column column = zero(g);
                            column.v2 = g.v2;
                            const double f3 = 2.0 * design.damping * std::pow(design.half_track / design.radius, 2);
                            column.d =
                                design.radius / design.half_track * (2.0 * design.yaw_inertia * g.a2 + 2.0 * f3 * g.v2);
                            return one(column);
                          },
                          0.0, 0.0, true}};
  for (const auto& [name, radius] : {std::pair{"wheel_radius_asymmetric", true}, {"encoder_scale", false}}) {
    all.push_back({name,
                   [radius = radius](const RobotDesign& design, const Signals& g, double side) {
                     return one(scale_column(design, g, side > 0.0 ? right : left, radius));
                   },
                   -1.0, 1.0, !radius});
  }
  return all;
}

std::vector<Rival> parametric_rivals(const RobotDesign& robot) {
  const double ratio = robot.half_track;
  return {{"payload",
           [](const RobotDesign&, const Signals& g, double) {
             const VectorXd none = VectorXd::Zero(g.rows());
             return Guess{{torque_column(g.a1, none), torque_column(none, g.a2)}, {}, 0.0};
           },
           0.0, 0.0, true},
          {"armature",
           [ratio](const RobotDesign&, const Signals& g, double) { return one(torque_column(g.a1, ratio * g.a2)); },
           0.0, 0.0, true},
          {"viscous",
           [ratio](const RobotDesign&, const Signals& g, double) { return one(torque_column(g.v1, ratio * g.v2)); },
           0.0, 0.0, true},
          {"torque_gain", [](const RobotDesign&, const Signals& g, double) { return one(torque_column(g.s, g.d)); },
           0.0, 0.0, true}};
}

}  // namespace

std::vector<Rival> rivals(const RobotDesign& robot) {
  std::vector<Rival> all;
  for (const auto& some : {structural_rivals(robot), kinematic_rivals(robot), parametric_rivals(robot)}) {
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

bool nests(std::string_view rival, std::string_view truth) {
  return rival == truth || (rival == "coulomb_asymmetric" && truth == "coulomb") ||
         (rival == "payload" && truth == "armature");
}

}  // namespace wheelwright::reality
