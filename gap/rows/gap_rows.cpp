// SPDX-License-Identifier: Apache-2.0
#include "gap/rows/gap_rows.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

#include "core/check.hpp"
#include "core/error.hpp"
#include "core/for_all.hpp"
#include "core/linear_algebra.hpp"
#include "core/statistics.hpp"
#include "gap/rows/drive.hpp"

namespace wheelwright::gap {
namespace {

using Signal = Eigen::VectorXd;

// ∫ signal dt from the first row, trapezoidal; only differences within a segment mean anything.
Signal integral(const Drive& drive, const Signal& signal) {
  Signal sum(signal.size());
  sum[0] = 0.0;
  for (Eigen::Index k = 1; k < signal.size(); ++k) {
    sum[k] = sum[k - 1] + 0.5 * drive.step * (signal[k - 1] + signal[k]);
  }
  return sum;
}

// From one end of each window to the other.
Signal differences(const Windows& windows, const Signal& signal) {
  const auto mean_about = [&](Eigen::Index row) {
    return signal.segment(row - windows.reach, 2 * windows.reach + 1).mean();
  };
  Signal result(static_cast<Eigen::Index>(windows.size()));
  for (std::size_t k = 0; k < windows.size(); ++k) {
    result[static_cast<Eigen::Index>(k)] = mean_about(windows.last[k]) - mean_about(windows.first[k]);
  }
  return result;
}

// Differences of a position, turned into the frame of the heading at each window's middle.
void turn(const Drive& drive, const Windows& windows, const Signal& x, const Signal& y, Increments& to) {
  const Signal dx = differences(windows, x), dy = differences(windows, y);
  to.forward.resize(dx.size());
  to.lateral.resize(dx.size());
  for (Eigen::Index k = 0; k < dx.size(); ++k) {
    const double heading = drive.heading[windows.middle[static_cast<std::size_t>(k)]];
    const double c = std::cos(heading), s = std::sin(heading);
    to.forward[k] = c * dx[k] + s * dy[k];
    to.lateral[k] = c * dy[k] - s * dx[k];
  }
}

bool sees_yaw(const Drive& drive) { return drive.two_wheels() && (drive.has_heading() || drive.gyro.size() > 0); }

// Standard deviations of white noise on a smooth signal, and of what its resolution makes.
struct WhiteNoise {
  double deviation = 0.0;
  double resolution = 0.0;
};

// By the median of |third differences|, whose variance is 20 σ², and the smallest step that occurs.
WhiteNoise noise_of(const Drive& drive, const Signal& signal) {
  std::vector<double> size;
  double resolution = 0.0;
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first + 3; k < last; ++k) {
      size.push_back(std::abs(signal[k] - 3.0 * signal[k - 1] + 3.0 * signal[k - 2] - signal[k - 3]));
      const double step = std::abs(signal[k] - signal[k - 1]);
      if (step > 1e-9 * std::max(1.0, std::abs(signal[k])) && (resolution == 0.0 || step < resolution)) {
        resolution = step;
      }
    }
  }
  if (size.empty()) {
    return {};
  }
  return {core::median(std::move(size)) / (0.6744897501960817 * std::sqrt(20.0)), resolution / std::sqrt(12.0)};
}

}  // namespace

Windows make_windows(const Drive& drive, double length) {
  check::positive(length, "window");
  const auto steps = std::max<Eigen::Index>(2, std::lround(length / drive.step));
  Windows windows;
  windows.reach = steps / 4;
  std::vector<double> t;
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first + windows.reach; k + steps + windows.reach < last; k += steps) {
      windows.first.push_back(k);
      windows.middle.push_back(k + steps / 2);
      windows.last.push_back(k + steps);
      t.push_back(drive.t[k + steps / 2]);
    }
  }
  windows.t = Eigen::Map<const Signal>(t.data(), static_cast<Eigen::Index>(t.size()));
  return windows;
}

Increments pose_gap(const Drive& drive, const Windows& windows) {
  Increments gap;
  if (!sees_yaw(drive)) {
    return gap;
  }
  const Signal& v1 = drive.coordinates[0].smooth_speed;
  const Signal& v2 = drive.coordinates[1].smooth_speed;
  if (drive.has_pose()) {
    const auto heading = drive.heading.array();
    turn(drive, windows, drive.x - integral(drive, (v1.array() * heading.cos()).matrix()),
         drive.y - integral(drive, (v1.array() * heading.sin()).matrix()), gap);
  }
  const Signal seen = drive.has_heading() ? drive.heading : integral(drive, drive.gyro);
  gap.yaw = differences(windows, seen - integral(drive, v2));
  return gap;
}

Increments increments_of(const Drive& drive, const Windows& windows, const Column& column) {
  Increments increments;
  if (drive.two_wheels() && drive.has_pose() && (column.forward.size() > 0 || column.lateral.size() > 0)) {
    const Eigen::ArrayXd c = drive.heading.array().cos(), s = drive.heading.array().sin();
    Eigen::ArrayXd x = Eigen::ArrayXd::Zero(drive.rows()), y = x;
    if (column.forward.size() > 0) {
      x += column.forward.array() * c;
      y += column.forward.array() * s;
    }
    if (column.lateral.size() > 0) {
      x -= column.lateral.array() * s;
      y += column.lateral.array() * c;
    }
    turn(drive, windows, integral(drive, x.matrix()), integral(drive, y.matrix()), increments);
  }
  if (sees_yaw(drive) && column.yaw.size() > 0) {
    increments.yaw = differences(windows, integral(drive, column.yaw));
  }
  return increments;
}

IncrementNoise pose_noise(const Drive& drive, Eigen::Index reach) {
  IncrementNoise noise;
  const double of_two = std::sqrt(2.0);
  const auto of_mean = [&](const Signal& signal) {
    const WhiteNoise white = noise_of(drive, signal);
    return std::max(white.deviation / std::sqrt(static_cast<double>(2 * reach + 1)), white.resolution);
  };
  if (drive.has_pose()) {
    const double position = std::hypot(of_mean(drive.x), of_mean(drive.y)) / of_two;
    noise.forward = noise.lateral = of_two * position;
  }
  if (drive.has_heading()) {
    noise.yaw = of_two * of_mean(drive.heading);
  }
  return noise;
}

IncrementNoise repeatability(const Drive& drive, const Windows& windows, const Increments& gap, std::size_t fewest) {
  if (gap.yaw.size() == 0 || windows.size() < fewest) {
    return {};
  }
  constexpr double kNear = 0.05;
  constexpr std::size_t kMostWindows = 2000;
  constexpr Eigen::Index kApart = 4;  // neighbours share a pose, and their errors
  const std::size_t stride = windows.size() / kMostWindows + 1;
  const auto count = static_cast<Eigen::Index>((windows.size() + stride - 1) / stride);
  Eigen::Matrix<double, 6, Eigen::Dynamic> motion(6, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const std::size_t at = static_cast<std::size_t>(k) * stride;
    Eigen::Index row = 0;
    for (const std::size_t c : {0, 1}) {
      const Signal& v = drive.coordinates[c].smooth_speed;
      const double unit = std::max(core::rms(v), 1e-12);
      for (const auto* place : {&windows.first, &windows.middle, &windows.last}) {
        motion(row++, k) = v[(*place)[at]] / unit;
      }
    }
  }
  IncrementNoise sum;
  std::size_t pairs = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    double nearest = 6.0 * kNear * kNear;
    Eigen::Index other = -1;
    for (Eigen::Index k = kApart; k <= count - kApart; ++k) {
      const Eigen::Index j = (i + k) % count;  // from i onwards: equals pair with another one each
      const double distance = (motion.col(i) - motion.col(j)).squaredNorm();
      if (distance < nearest) {
        nearest = distance;
        other = j;
      }
    }
    if (other < 0) {
      continue;
    }
    const auto a = i * static_cast<Eigen::Index>(stride), b = other * static_cast<Eigen::Index>(stride);
    const auto half_square = [a, b](const Signal& g) { return g.size() > 0 ? 0.5 * std::pow(g[a] - g[b], 2) : 0.0; };
    sum.forward += half_square(gap.forward);
    sum.lateral += half_square(gap.lateral);
    sum.yaw += half_square(gap.yaw);
    ++pairs;
  }
  if (pairs < fewest) {
    return {};
  }
  const auto root = [pairs](double squares) { return std::sqrt(squares / static_cast<double>(pairs)); };
  return {root(sum.forward), root(sum.lateral), root(sum.yaw)};
}

Eigen::VectorXd picked(const Eigen::VectorXd& signal, const std::vector<Eigen::Index>& rows) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    values[static_cast<Eigen::Index>(k)] = signal[rows[k]];
  }
  return values;
}

namespace {

// Rows of efforts that are used: settled, moving, `step` apart.
std::vector<Eigen::Index> effort_rows(const Drive& drive, const GapRowOptions& options) {
  if (!drive.has_efforts) {
    return {};
  }
  Mask use = settled(drive, options.beta);
  if (options.skip_rest) {
    use = use && moving(drive, options.beta);
  }
  return rows_apart(drive, use, options.row_step, options.beta);
}

RowSpace pose_space(std::string name, const Eigen::VectorXd& t, const Eigen::VectorXd& values, double floor) {
  RowSpace space;
  space.name = std::move(name);
  space.t = t;
  space.response = values;
  space.floor = floor;
  return space;
}

void subtract(GapRows& rows, const std::vector<Eigen::VectorXd>& part) {
  for (std::size_t s = 0; s < rows.spaces.size(); ++s) {
    if (part[s].size() > 0) {
      rows.spaces[s].response -= part[s];
    }
  }
}

bool has_effort_noise(const Drive& drive) {
  return std::ranges::any_of(drive.joints, [](const JointSignals& joint) { return joint.effort_noise.size() > 0; });
}

// `noisy` − `part`; empty where nothing differs.
Eigen::VectorXd difference(const Eigen::VectorXd& noisy, const Eigen::VectorXd& part) {
  return noisy.size() == 0 || part.size() == 0 || noisy == part ? Eigen::VectorXd() : Eigen::VectorXd(noisy - part);
}

bool same_efforts(const std::vector<Column>& a, const std::vector<Column>& b) {
  return std::ranges::equal(a, b, [](const Column& one, const Column& other) {
    return one.effort == other.effort && one.effort_rate == other.effort_rate;
  });
}

// What the noise of the efforts is in the responses of the rows of `drive`, which have `healthy` taken off.
void add_noise(GapRows& rows, const Drive& drive, const std::vector<Eigen::VectorXd>& outputs,
               const std::vector<FittedEffect>& healthy, const GapRowOptions& options) {
  const Drive noisy = with_effort_noise(drive);
  const std::vector<Eigen::VectorXd> noisy_outputs = filtered_outputs(noisy, options.beta);
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    rows.spaces[i].noise = picked(noisy_outputs[i] - outputs[i], rows.instants);
  }
  for (const FittedEffect& effect : healthy) {
    const std::vector<Eigen::VectorXd> part = rows_of(drive, rows, effect, options),
                                       noisy_part = rows_of(noisy, rows, effect, options);
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      if (const Eigen::VectorXd own = difference(noisy_part[i], part[i]); own.size() > 0) {
        rows.spaces[i].noise -= own;
      }
    }
  }
}

// `centre`, with each continuous coordinate moved towards its neighbours on `grid` in `points` steps each way, one
// coordinate at a time.
std::vector<std::vector<double>> shapes_about(const Effect& effect, const std::vector<std::vector<double>>& grid,
                                              const std::vector<double>& centre, int points) {
  std::vector<std::vector<double>> shapes{centre};
  for (std::size_t k = 0; k < centre.size(); ++k) {
    const ShapeParameter& parameter = effect.shapes[k];
    if (parameter.discrete) {
      continue;
    }
    std::set<double> values;
    for (const std::vector<double>& point : grid) {
      if (!parameter.both_signs || point[k] * centre[k] > 0.0) {
        values.insert(point[k]);
      }
    }
    const auto at = values.find(centre[k]);
    if (at == values.end()) {
      continue;
    }
    const auto towards = [&](double neighbour) {
      for (int step = 1; step <= points; ++step) {
        const double share = static_cast<double>(step) / (points + 1);
        std::vector<double> shape = centre;
        shape[k] = parameter.logarithmic ? centre[k] * std::pow(neighbour / centre[k], share)
                                         : centre[k] + share * (neighbour - centre[k]);
        shapes.push_back(std::move(shape));
      }
    };
    if (at != values.begin()) {
      towards(*std::prev(at));
    }
    if (std::next(at) != values.end()) {
      towards(*std::next(at));
    }
  }
  return shapes;
}

// `centres`, and what they are with every other value of the discrete coordinates.
std::set<std::vector<double>> with_all_kinds(const Effect& effect, const std::vector<std::vector<double>>& grid,
                                             std::set<std::vector<double>> centres) {
  for (std::size_t k = 0; k < effect.shapes.size(); ++k) {
    if (!effect.shapes[k].discrete) {
      continue;
    }
    const std::set<std::vector<double>> before = centres;
    for (std::vector<double> shape : before) {
      for (const std::vector<double>& point : grid) {
        shape[k] = point[k];
        centres.insert(shape);
      }
    }
  }
  return centres;
}

}  // namespace

GapRows make_gap_rows(const Drive& drive, const NoiseFloor& floor, const std::vector<FittedEffect>& healthy,
                      const GapRowOptions& options) {
  const auto n = drive.model.n();
  check::that(static_cast<std::size_t>(floor.efforts.size()) == n, "NoiseFloor::efforts", "one per output");
  check::that(drive.theta.size() == static_cast<Eigen::Index>(drive.model.p()), "Drive::theta",
              "predict_efforts first");
  GapRows rows;
  rows.parameters = drive.model.p();
  rows.instants = effort_rows(drive, options);
  if (drive.has_efforts && rows.instants.size() < 50) {
    throw InputError("the log has " + std::to_string(rows.instants.size()) +
                     " usable instants: at least 50 in motion are needed; " + why_few_rows(drive, options.beta));
  }
  const Eigen::VectorXd t = picked(drive.t, rows.instants);
  const std::vector<Eigen::VectorXd> y = filtered_outputs(drive, options.beta);
  const std::vector<std::vector<Eigen::VectorXd>> Y = filtered_regressor(drive, options.beta);
  for (std::size_t i = 0; i < n; ++i) {
    RowSpace space;
    space.name = drive.model.outputs[i];
    space.t = t;
    space.floor = floor.efforts[static_cast<Eigen::Index>(i)];
    space.response = picked(y[i], rows.instants);
    rows.signal.push_back(space.response);
    for (std::size_t j = 0; j < rows.parameters; ++j) {
      space.columns.push_back(Y[j][i].size() > 0 ? picked(Y[j][i], rows.instants) : Eigen::VectorXd());
      if (space.columns.back().size() > 0) {
        space.response -= drive.theta[static_cast<Eigen::Index>(j)] * space.columns.back();
      }
    }
    rows.spaces.push_back(std::move(space));
    rows.kinds.push_back(GapSpace::dynamic);
  }
  rows.windows = make_windows(drive, options.window);
  const Increments gap = pose_gap(drive, rows.windows);
  const auto add = [&](const char* name, const Eigen::VectorXd& values, double noise) {
    if (values.size() == 0 || !(noise > 0.0)) {
      return;
    }
    rows.spaces.push_back(pose_space(name, rows.windows.t, values, noise));
    rows.spaces.back().columns.resize(rows.parameters);
    rows.signal.push_back(values);
    rows.kinds.push_back(GapSpace::kinematic);
  };
  add("forward", gap.forward, floor.increments.forward);
  add("lateral", gap.lateral, floor.increments.lateral);
  add("yaw", gap.yaw, floor.increments.yaw);
  if (!drive.has_efforts && rows.windows.size() < 50) {
    throw InputError(
        "the log has no efforts, and " + std::to_string(rows.windows.size()) +
        " windows in which the pose can be compared with the wheels: at least 50 are needed; drive longer");
  }
  for (const FittedEffect& effect : healthy) {
    subtract(rows, rows_of(drive, rows, effect, options));
  }
  if (has_effort_noise(drive)) {
    add_noise(rows, drive, y, healthy, options);
  }
  return rows;
}

std::size_t add_column(std::vector<RowSpace>& spaces, std::vector<Eigen::VectorXd> parts) {
  for (std::size_t s = 0; s < spaces.size(); ++s) {
    spaces[s].columns.push_back(std::move(parts[s]));
  }
  return spaces.front().columns.size() - 1;
}

std::vector<Eigen::VectorXd> rows_of(const Drive& drive, const GapRows& rows, const Column& column,
                                     const GapRowOptions& options) {
  std::vector<Eigen::VectorXd> parts(rows.spaces.size());
  const std::size_t n = drive.model.n();
  for (std::size_t i = 0; i < n; ++i) {
    Eigen::VectorXd sum;
    if (i < column.effort.size() && column.effort[i].size() > 0) {
      sum = filtered(drive, options.beta, column.effort[i]);
    }
    if (i < column.effort_rate.size() && column.effort_rate[i].size() > 0) {
      const Eigen::VectorXd rate = filtered_rate(drive, options.beta, column.effort_rate[i]);
      sum = sum.size() > 0 ? Eigen::VectorXd(sum + rate) : rate;
    }
    if (sum.size() > 0) {
      parts[i] = picked(sum, rows.instants);
    }
  }
  if (rows.spaces.size() > n) {
    const Increments moved = increments_of(drive, rows.windows, column);
    for (std::size_t s = n; s < rows.spaces.size(); ++s) {
      const std::string& name = rows.spaces[s].name;
      parts[s] = name == "forward" ? moved.forward : name == "lateral" ? moved.lateral : moved.yaw;
    }
  }
  return parts;
}

std::vector<Eigen::VectorXd> rows_of(const Drive& drive, const GapRows& rows, const FittedEffect& fitted,
                                     const GapRowOptions& options) {
  std::vector<Eigen::VectorXd> sum(rows.spaces.size());
  const std::vector<Column> columns = fitted.effect.columns(drive, fitted.shape);
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const double factor = fitted.effect.unit_coefficient ? 1.0 : fitted.coefficients[static_cast<Eigen::Index>(c)];
    const std::vector<Eigen::VectorXd> part = rows_of(drive, rows, columns[c], options);
    for (std::size_t s = 0; s < sum.size(); ++s) {
      if (part[s].size() > 0) {
        sum[s] = sum[s].size() > 0 ? Eigen::VectorXd(sum[s] + factor * part[s]) : Eigen::VectorXd(factor * part[s]);
      }
    }
  }
  return sum;
}

ShapeGrids all_shapes(const std::vector<Effect>& catalogue, const Drive& drive) {
  ShapeGrids grids;
  for (const Effect& effect : catalogue) {
    grids.push_back(applicability(effect, drive).applies ? shape_grid(effect, drive)
                                                         : std::vector<std::vector<double>>());
  }
  return grids;
}

ShapeGrids finer_shapes(const std::vector<Effect>& catalogue, const ShapeGrids& grids, const CandidateTable& table,
                        const std::vector<CauseSet>& looked_at, std::size_t sets, int points) {
  // Shapes to look closer at, by effect.
  std::vector<std::set<std::vector<double>>> centres(catalogue.size());
  std::size_t of_this_size = 0;
  for (std::size_t k = 0; k < looked_at.size(); ++k) {
    const std::size_t size = looked_at[k].members.size();
    of_this_size = k > 0 && size == looked_at[k - 1].members.size() ? of_this_size + 1 : 0;
    if (size > 1 && of_this_size >= sets) {
      continue;
    }
    for (const std::size_t c : looked_at[k].members) {
      centres[table.candidates[c].effect].insert(table.candidates[c].shape);
    }
  }
  ShapeGrids finer(catalogue.size());
  for (std::size_t e = 0; e < catalogue.size(); ++e) {
    std::set<std::vector<double>> found;
    for (const std::vector<double>& centre : with_all_kinds(catalogue[e], grids[e], centres[e])) {
      for (std::vector<double>& shape : shapes_about(catalogue[e], grids[e], centre, points)) {
        found.insert(std::move(shape));
      }
    }
    if (found.empty() && !grids[e].empty()) {
      found.insert(grids[e].begin(), grids[e].end());
    }
    finer[e].assign(found.begin(), found.end());
  }
  return finer;
}

CandidateTable add_catalogue(GapRows& rows, const Drive& drive, const std::vector<Effect>& catalogue,
                             const ShapeGrids& shapes, const GapRowOptions& options) {
  CandidateTable table;
  for (std::size_t j = 0; j < rows.parameters; ++j) {
    table.base.push_back(j);
  }
  struct Task {
    std::size_t effect;
    std::vector<double> shape;
    std::vector<std::vector<Eigen::VectorXd>> parts;  // [column][space]
    std::vector<std::vector<Eigen::VectorXd>> noise;  // likewise; empty: none of its columns has noise
  };
  std::vector<Task> tasks;
  for (std::size_t e = 0; e < catalogue.size(); ++e) {
    table.names.push_back(catalogue[e].name);
    for (const std::vector<double>& shape : shapes[e]) {
      tasks.push_back({e, shape, {}, {}});
    }
  }
  const Drive noisy = has_effort_noise(drive) ? with_effort_noise(drive) : Drive();
  std::vector<bool> noise(catalogue.size(), false);  // in some column of the effect
  for (std::size_t e = 0; e < catalogue.size() && noisy.rows() > 0; ++e) {
    const auto differs = [&](const std::vector<double>& shape) {
      return !same_efforts(catalogue[e].columns(drive, shape), catalogue[e].columns(noisy, shape));
    };
    // A limit takes something of the efforts at some of its shapes only.
    noise[e] = catalogue[e].unit_coefficient ? std::ranges::any_of(shapes[e], differs)
                                             : !shapes[e].empty() && differs(shapes[e][shapes[e].size() / 2]);
  }
  core::for_all(tasks.size(), options.threads, [&](std::size_t k) {
    Task& task = tasks[k];
    const Effect& effect = catalogue[task.effect];
    const std::vector<Column> columns = effect.columns(drive, task.shape);
    for (const Column& column : columns) {
      task.parts.push_back(rows_of(drive, rows, column, options));
    }
    if (!noise[task.effect]) {
      return;
    }
    const std::vector<Column> noisy_columns = effect.columns(noisy, task.shape);
    task.noise.resize(columns.size(), std::vector<Eigen::VectorXd>(rows.spaces.size()));
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const std::vector<Eigen::VectorXd> noisy_parts = rows_of(noisy, rows, noisy_columns[c], options);
      for (std::size_t i = 0; i < drive.model.n(); ++i) {
        task.noise[c][i] = difference(noisy_parts[i], task.parts[c][i]);
      }
    }
  });
  for (Task& task : tasks) {
    const Effect& effect = catalogue[task.effect];
    Candidate candidate;
    candidate.effect = task.effect;
    candidate.shape = std::move(task.shape);
    candidate.unit_coefficient = effect.unit_coefficient;
    candidate.beside = static_cast<std::size_t>(std::ranges::count(effect.shapes, true, &ShapeParameter::beside));
    for (std::size_t c = 0; c < task.parts.size(); ++c) {
      candidate.columns.push_back(add_column(rows.spaces, std::move(task.parts[c])));
      for (std::size_t i = 0; i < drive.model.n() && !task.noise.empty(); ++i) {
        rows.spaces[i].noise_columns.resize(rows.spaces[i].columns.size());
        rows.spaces[i].noise_columns.back() = std::move(task.noise[c][i]);
      }
      candidate.sign.push_back(c < effect.parameters.size() ? effect.parameters[c].sign : 0);
      if (c >= effect.parameters.size() || !effect.parameters[c].beside) {
        candidate.own.push_back(candidate.columns.back());
      }
    }
    table.candidates.push_back(std::move(candidate));
  }
  return table;
}

}  // namespace wheelwright::gap
