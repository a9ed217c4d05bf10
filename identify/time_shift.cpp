// SPDX-License-Identifier: Apache-2.0
#include "identify/time_shift.hpp"

#include <algorithm>
#include <cmath>

#include <ceres/jet.h>

#include "core/check.hpp"

namespace wheelwright::identify {
namespace {

using ShiftJet = ceres::Jet<double, 1>;

constexpr double kSettle = 6.0;  // time constants after which e^{−6} = 0.2 % is left of how a lag began

// One step h of T z' + z = u with u linear from `begin` to `end`: z = decay z + begin u_0 + end u_1.
template <typename T>
struct LagStep {
  T decay, begin, end;
  LagStep(const T& constant, double h) {
    using std::exp;
    constexpr double kForgotten = 40.0;  // e^{−40} < ε: nothing is left of the state
    if (h > kForgotten * constant) {
      decay = T(0.0);
      end = 1.0 - constant / h;
      begin = constant / h;
    } else {
      const T x = h / constant;
      decay = exp(-x);
      const T mean = (1.0 - decay) / x;
      begin = mean - decay;
      end = 1.0 - mean;
    }
  }
};

// The lag of the rows of `u` (n rows an instant), each segment from its first value. `out(row)` takes each row.
template <typename T, typename Out>
void lag(const Eigen::Ref<const core::RowMatrix>& u, std::size_t n, const std::vector<double>& t,
         const std::vector<std::size_t>& starts, const T& constant, Out out) {
  using Rows = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;
  const auto height = static_cast<Eigen::Index>(n);
  for (std::size_t s = 0; s + 1 < starts.size(); ++s) {
    Rows z = u.middleRows(static_cast<Eigen::Index>(starts[s]) * height, height).template cast<T>();
    out(starts[s], z);
    for (std::size_t k = starts[s] + 1; k < starts[s + 1]; ++k) {
      const LagStep<T> step(constant, t[k] - t[k - 1]);
      const auto before = u.middleRows(static_cast<Eigen::Index>(k - 1) * height, height);
      const auto now = u.middleRows(static_cast<Eigen::Index>(k) * height, height);
      for (Eigen::Index i = 0; i < z.rows(); ++i) {
        for (Eigen::Index j = 0; j < z.cols(); ++j) {
          z(i, j) = step.decay * z(i, j) + step.begin * before(i, j) + step.end * now(i, j);
        }
      }
      out(k, z);
    }
  }
}

}  // namespace

TimeShiftedRows::TimeShiftedRows(const RegressionBlock& rows, TimeEffect effect, double lower, double upper)
    : effect_(effect), lower_(lower), upper_(upper), outputs_(rows.outputs), t_(rows.t), Y_(rows.Y) {
  check::that(check::finite(lower, "lower") < check::finite(upper, "upper"), "time shift", "lower < upper");
  check::that(effect == TimeEffect::delay || lower >= 0.0, "time constant of a lag", "bounds >= 0");
  check::that(rows.outputs > 0 && rows.Y.rows() == rows.rows() && rows.y.size() == rows.rows() &&
                  rows.sample.size() == rows.instants(),
              "time shift", "rows whose shapes agree");
  for (std::size_t k = 0; k < t_.size(); ++k) {
    if (k == 0 || rows.sample[k] != rows.sample[k - 1] + 1) {
      starts_.push_back(k);
    }
  }
  starts_.push_back(t_.size());
  keep_.assign(t_.size(), false);
  for (std::size_t s = 0; s + 1 < starts_.size(); ++s) {
    const double first = t_[starts_[s]];
    const double last = t_[starts_[s + 1] - 1];
    for (std::size_t k = starts_[s]; k < starts_[s + 1]; ++k) {
      keep_[k] = effect == TimeEffect::delay ? t_[k] - upper >= first && t_[k] - lower <= last && last > first
                                             : t_[k] - first >= kSettle * upper;
      if (keep_[k]) {
        kept_.push_back(k);
      }
    }
  }
  check::that(!kept_.empty(), "time shift", "segments longer than the largest shift");
  const auto n = static_cast<Eigen::Index>(outputs_);
  core::RowMatrix y = rows.y;
  if (effect == TimeEffect::actuator_lag) {
    lagged_.resize(Y_.rows(), Y_.cols());
    const core::RowMatrix plain = y;
    const auto into = [&](core::RowMatrix& m) {
      return
          [&m, n](std::size_t k, const Eigen::MatrixXd& z) { m.middleRows(static_cast<Eigen::Index>(k) * n, n) = z; };
    };
    lag<double>(Y_, outputs_, t_, starts_, upper, into(lagged_));
    lag<double>(plain, outputs_, t_, starts_, upper, into(y));
  }
  response_.resize(static_cast<Eigen::Index>(kept_.size()) * n);
  for (std::size_t k = 0; k < kept_.size(); ++k) {
    response_.segment(static_cast<Eigen::Index>(k) * n, n) =
        y.middleRows(static_cast<Eigen::Index>(kept_[k]) * n, n).col(0);
  }
}

VariableProjectionOptions TimeShiftedRows::options() const {
  VariableProjectionOptions options;
  options.lower = Eigen::VectorXd::Constant(1, lower_);
  options.upper = Eigen::VectorXd::Constant(1, upper_);
  return options;
}

bool TimeShiftedRows::evaluate(const Eigen::VectorXd& shape, bool derivatives, SeparableValues& at) const {
  const double value = shape[0];
  if (!(value >= lower_ && value <= upper_)) {
    return false;
  }
  const auto n = static_cast<Eigen::Index>(outputs_);
  const Eigen::Index p = Y_.cols();
  at.offset.resize(0);
  at.offset_by.clear();
  at.columns.resize(response_.size(), p);
  at.columns_by.assign(derivatives ? 1 : 0, Eigen::MatrixXd(response_.size(), p));
  const auto rows_of = [&](std::size_t k) { return Y_.middleRows(static_cast<Eigen::Index>(k) * n, n); };
  Eigen::Index next = 0;
  const auto put = [&](const auto& entry) {
    for (Eigen::Index i = 0; i < n; ++i, ++next) {
      for (Eigen::Index j = 0; j < p; ++j) {
        const ShiftJet e = entry(i, j);
        at.columns(next, j) = e.a;
        if (derivatives) {
          at.columns_by[0](next, j) = e.v[0];
        }
      }
    }
  };
  const ShiftJet shift(value, 0);
  if (effect_ == TimeEffect::effort_lag) {
    lag<ShiftJet>(Y_, outputs_, t_, starts_, shift, [&](std::size_t k, const auto& z) {
      if (keep_[k]) {
        put([&](Eigen::Index i, Eigen::Index j) { return z(i, j); });
      }
    });
    return true;
  }
  if (effect_ == TimeEffect::actuator_lag) {
    const ShiftJet share = shift / upper_;
    for (const std::size_t k : kept_) {
      const auto lagged = lagged_.middleRows(static_cast<Eigen::Index>(k) * n, n);
      const auto now = rows_of(k);
      put([&](Eigen::Index i, Eigen::Index j) { return (1.0 - share) * lagged(i, j) + share * now(i, j); });
    }
    return true;
  }
  for (std::size_t s = 0; s + 1 < starts_.size(); ++s) {
    std::size_t cell = starts_[s];  // t[cell] <= t − T <= t[cell + 1]
    for (std::size_t k = starts_[s]; k < starts_[s + 1]; ++k) {
      if (!keep_[k]) {
        continue;
      }
      const double when = t_[k] - value;
      while (cell + 2 < starts_[s + 1] && t_[cell + 1] <= when) ++cell;
      const double h = t_[cell + 1] - t_[cell];
      const ShiftJet u = (t_[k] - shift - t_[cell]) / h;
      const std::size_t a = cell > starts_[s] ? cell - 1 : cell;
      const std::size_t b = cell + 2 < starts_[s + 1] ? cell + 2 : cell + 1;
      const double left = h / (t_[cell + 1] - t_[a]);
      const double right = h / (t_[b] - t_[cell]);
      const ShiftJet h00 = (1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u);
      const ShiftJet h10 = u * (1.0 - u) * (1.0 - u);
      const ShiftJet h01 = u * u * (3.0 - 2.0 * u);
      const ShiftJet h11 = u * u * (u - 1.0);
      const auto y0 = rows_of(a);
      const auto y1 = rows_of(cell);
      const auto y2 = rows_of(cell + 1);
      const auto y3 = rows_of(b);
      // Numbers rather than jets: this is where the time goes.
      for (Eigen::Index i = 0; i < n; ++i, ++next) {
        for (Eigen::Index j = 0; j < p; ++j) {
          const double from = y1(i, j), to = y2(i, j), slope = left * (to - y0(i, j)), end = right * (y3(i, j) - from);
          at.columns(next, j) = h00.a * from + h10.a * slope + h01.a * to + h11.a * end;
          if (derivatives) {
            at.columns_by[0](next, j) = h00.v[0] * from + h10.v[0] * slope + h01.v[0] * to + h11.v[0] * end;
          }
        }
      }
    }
  }
  return true;
}

}  // namespace wheelwright::identify
