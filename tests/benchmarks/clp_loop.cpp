// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#include <ClpSimplex.hpp>
#pragma GCC diagnostic pop

#include "core/error.hpp"
#include "tests/benchmarks/clp_columns.hpp"
#include "tests/benchmarks/lp_pass.hpp"
#include "tests/benchmarks/lp_peers.hpp"
#include "tests/benchmarks/scaled_rows.hpp"

namespace wheelwright::bench {
namespace {

/// The working set and the 2p programs on it, which differ in their right-hand sides: vertex 2j minimises x_j, 2j + 1
/// maximises it.
class WorkingSet {
 public:
  explicit WorkingSet(const ScaledRows& rows)
      : rows_(rows), points_(2 * rows.p * rows.p), values_(2 * rows.p), bases_(2 * rows.p), joined_(rows.n, false) {
    model_.setPrimalTolerance(1e-10);
    model_.setDualTolerance(1e-10);
    ClpColumns columns;
    columns.add(rows.box);
    columns.load(model_, rows.p);
  }

  /// A row that joins at the next flush(), unless it is there.
  void add(std::size_t row) {
    if (!joined_[row]) {
      joined_[row] = true;
      ++size_;
      rows_.sides(row, [&](const auto& a, double b) { waiting_.add({a.data(), rows_.p}, b + 1.0); });
    }
  }
  /// Whether any row joined.
  bool flush() {
    const bool any = waiting_.size() > 0;
    if (any) {
      waiting_.append(model_);
      waiting_ = {};
    }
    return any;
  }

  void solve() {
    for (std::size_t v = 0; v < values_.size(); ++v) {
      solve(v);
    }
  }

  [[nodiscard]] const std::vector<double>& points() const { return points_; }
  [[nodiscard]] const std::vector<double>& values() const { return values_; }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  void solve(std::size_t v) {
    const double sign = v % 2 == 0 ? -1.0 : 1.0;
    const int row = static_cast<int>(v / 2);
    const auto count = static_cast<std::size_t>(model_.numberColumns()) + rows_.p;
    std::vector<unsigned char>& basis = bases_[v];
    model_.setRowBounds(row, sign, sign);
    if (basis.empty()) {
      model_.dual();
    } else {
      // CLP stores the columns' status before the rows'. New columns are at zero.
      basis.insert(basis.end() - static_cast<std::ptrdiff_t>(rows_.p), count - basis.size(),
                   static_cast<unsigned char>(ClpSimplex::atLowerBound));
      model_.copyinStatus(basis.data());
      model_.primal();
    }
    check_optimal(model_);
    model_.setRowBounds(row, 0.0, 0.0);
    basis.assign(model_.statusArray(), model_.statusArray() + count);
    values_[v] = sign * model_.objectiveValue();
    std::copy_n(model_.dualRowSolution(), rows_.p, points_.data() + v * rows_.p);
  }

  const ScaledRows& rows_;
  ClpSimplex model_;
  ClpColumns waiting_;
  std::vector<double> points_, values_;
  std::vector<std::vector<unsigned char>> bases_;
  std::vector<bool> joined_;
  std::size_t size_ = 0;
};

}  // namespace

std::function<LoopAnswer()> clp_loop(const DriveRows& drive, const LoopOptions& options) {
  return [rows = std::make_shared<const ScaledRows>(drive), options] {
    WorkingSet set(*rows);
    // Evenly spaced, and from both channels in turn.
    const std::size_t stride = std::max<std::size_t>(1, rows->n / options.sample);
    for (std::size_t k = 0; k < rows->n / DriveRows::outputs; k += stride) {
      for (std::size_t i = 0; i < DriveRows::outputs; ++i) {
        set.add(DriveRows::outputs * k + i);
      }
    }
    LoopAnswer answer;
    std::vector<std::vector<Violation>> found;
    while (set.flush()) {
      set.solve();
      if (++answer.passes > options.pass_limit) {
        throw Error("cutting-plane loop: too many passes");
      }
      most_violated(rows->a.data(), rows->c.data(), rows->n, rows->p, set.points(), options.join, options.tolerance,
                    found);
      for (const std::vector<Violation>& list : found) {
        for (const Violation& violation : list) {
          set.add(violation.row);
        }
      }
    }
    answer.hull = rows->unscaled(set.values());
    answer.working_set = set.size();
    return answer;
  };
}

}  // namespace wheelwright::bench
