// SPDX-License-Identifier: Apache-2.0
#include "gap/rows/block_gram.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>

#include "core/check.hpp"
#include "core/for_all.hpp"
#include "core/linear_algebra.hpp"

namespace wheelwright::gap {
namespace {

constexpr double kIndependent = 1e-10;  // share of a squared column that the ones before it must leave

using Flags = std::vector<bool>;

// Cholesky factor of A over the unknowns in `use`; those that are not determined leave `use`.
Eigen::MatrixXd factor(const Eigen::MatrixXd& A, Flags& use) {
  const Eigen::Index n = A.rows();
  Eigen::MatrixXd L = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto u = static_cast<std::size_t>(j);
    const double pivot = use[u] ? A(j, j) - L.row(j).head(j).squaredNorm() : 0.0;
    if (!use[u] || !(pivot > kIndependent * A(j, j))) {
      use[u] = false;
      L.row(j).setZero();
      continue;
    }
    L(j, j) = std::sqrt(pivot);
    for (Eigen::Index i = j + 1; i < n; ++i) {
      if (use[static_cast<std::size_t>(i)]) {
        L(i, j) = (A(i, j) - L.row(i).head(j).dot(L.row(j).head(j))) / L(j, j);
      }
    }
  }
  return L;
}

// The solution over the unknowns in `use` (which shrinks to the determined ones), zero elsewhere.
Eigen::VectorXd solve(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, Flags& use) {
  const Eigen::Index n = A.rows();
  const Eigen::MatrixXd L = factor(A, use);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    x[i] = use[static_cast<std::size_t>(i)] ? (b[i] - L.row(i).head(i).dot(x.head(i))) / L(i, i) : 0.0;
  }
  for (Eigen::Index i = n - 1; i >= 0; --i) {
    if (use[static_cast<std::size_t>(i)]) {
      x[i] = (x[i] - L.col(i).tail(n - 1 - i).dot(x.tail(n - 1 - i))) / L(i, i);
    }
  }
  return x;
}

}  // namespace

SignedSolution signed_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const std::vector<int>& sign) {
  const Eigen::Index n = A.rows();
  check::that(A.cols() == n && b.size() == n, "signed_least_squares", "a square matrix and as many right-hand sides");
  check::that(sign.empty() || sign.size() == static_cast<std::size_t>(n), "signed_least_squares sign",
              "one for each unknown");
  const auto count = static_cast<std::size_t>(n);
  const auto bound = [&sign](std::size_t i) { return sign.empty() ? 0 : sign[i]; };
  SignedSolution result;
  Flags use(count, true);
  result.x = solve(A, b, use);
  bool holds = true;
  for (std::size_t i = 0; i < count; ++i) {
    holds = holds && bound(i) * result.x[static_cast<Eigen::Index>(i)] >= 0.0;
  }
  if (!holds) {
    for (std::size_t i = 0; i < count; ++i) {
      use[i] = bound(i) == 0;
    }
    result.x = solve(A, b, use);
    Flags refused(count, false);  // undetermined beside the others
    for (std::size_t turns = 0; turns < 10 * count + 10; ++turns) {
      const Eigen::VectorXd gradient = b - A * result.x;
      std::size_t enter = count;
      double steepest = 0.0;
      for (std::size_t i = 0; i < count; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        const double slope = bound(i) * gradient[k] / std::sqrt(std::max(A(k, k), 1e-300));
        if (bound(i) != 0 && !use[i] && !refused[i] && slope > std::max(steepest, 1e-12 * std::abs(b[k]))) {
          steepest = slope;
          enter = i;
        }
      }
      if (enter == count) {
        break;
      }
      use[enter] = true;
      while (true) {
        Eigen::VectorXd target = solve(A, b, use);
        double share = 1.0;
        for (std::size_t i = 0; i < count; ++i) {
          const auto k = static_cast<Eigen::Index>(i);
          if (bound(i) != 0 && use[i] && bound(i) * target[k] < 0.0) {
            const double from = bound(i) * result.x[k];
            share = std::min(share, from / (from - bound(i) * target[k]));
          }
        }
        if (share >= 1.0) {
          result.x = target;
          refused[enter] = !use[enter];
          break;
        }
        result.x += share * (target - result.x);
        for (std::size_t i = 0; i < count; ++i) {
          const auto k = static_cast<Eigen::Index>(i);
          if (bound(i) != 0 && use[i] && bound(i) * target[k] < 0.0 &&
              bound(i) * result.x[k] <= 1e-14 * std::abs(target[k])) {
            use[i] = false;
            result.x[k] = 0.0;
          }
        }
        if (!use[enter] && share <= 0.0) {
          refused[enter] = true;
        }
      }
    }
  }
  result.zero.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    result.zero[i] = !use[i];
  }
  return result;
}

Eigen::MatrixXd restricted_inverse(const Eigen::MatrixXd& A, const std::vector<bool>& zero) {
  const Eigen::Index n = A.rows();
  check::that(zero.size() == static_cast<std::size_t>(n), "restricted_inverse", "one flag for each unknown");
  Flags use(zero.size());
  for (std::size_t i = 0; i < use.size(); ++i) {
    use[i] = !zero[i];
  }
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    if (use[static_cast<std::size_t>(j)]) {
      inverse.col(j) = solve(A, Eigen::VectorXd::Unit(n, j), use);
    }
  }
  return inverse;
}

namespace {

constexpr Eigen::Index kChunk = 128;   // rows at a time: what is multiplied stays in the cache
constexpr double kDetermined = 1e-10;  // share of a squared column that the ones before it must leave

using Range = SpaceRange;

Eigen::Index first_at(const Eigen::VectorXd& t, double from) {
  return std::lower_bound(t.data(), t.data() + t.size(), from) - t.data();
}

Range rows_within(const RowSpace& space, const std::pair<double, double>& times) {
  const Eigen::Index first = first_at(space.t, times.first);
  return {first, std::max(first, first_at(space.t, times.second))};
}

void check_spaces(const std::vector<RowSpace>& spaces) {
  check::that(!spaces.empty(), "BlockGram spaces", "at least one");
  for (const RowSpace& space : spaces) {
    const std::string what = "RowSpace " + space.name;
    check::positive(space.floor, what + " floor");
    check::that(space.columns.size() == spaces.front().columns.size(), what, "the columns of the first space");
    check::that(space.response.size() == space.t.size(), what + " response", "one value per row");
    check::that(space.response.allFinite() && space.t.allFinite(), what, "finite values");
    check::that(std::is_sorted(space.t.data(), space.t.data() + space.t.size()), what + " t", "ascending times");
    const auto check_column = [&](const Eigen::VectorXd& column, const char* name) {
      check::that(column.size() == 0 || column.size() == space.t.size(), what + name, "one value per row, or none");
      check::that(column.allFinite(), what + name, "finite values");
    };
    std::ranges::for_each(space.columns, [&](const Eigen::VectorXd& column) { check_column(column, " column"); });
    check_column(space.noise, " noise");
    check::that(space.noise_columns.size() <= space.columns.size(), what + " noise_columns", "at most one per column");
    std::ranges::for_each(space.noise_columns, [&](const Eigen::VectorXd& c) { check_column(c, " noise column"); });
  }
}

// Signals of one space and their places in a Gram matrix, ascending.
struct Placed {
  std::vector<const Eigen::VectorXd*> used;
  std::vector<Eigen::Index> index;

  void add(const Eigen::VectorXd& signal, std::size_t place) {
    if (signal.size() > 0) {
      used.push_back(&signal);
      index.push_back(static_cast<Eigen::Index>(place));
    }
  }
};

// Adds the products of the rows of the signals, in units of `floor`, to the lower triangle of `gram`.
void accumulate(const Placed& signals, double floor, Range rows, Eigen::MatrixXd& gram) {
  const auto& [used, index] = signals;
  const auto n = static_cast<Eigen::Index>(used.size());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd chunk(kChunk, n);
  for (Eigen::Index k = rows.first; k < rows.last; k += kChunk) {
    const Eigen::Index m = std::min(kChunk, rows.last - k);
    for (Eigen::Index c = 0; c < n; ++c) {
      chunk.col(c).head(m) = used[static_cast<std::size_t>(c)]->segment(k, m) / floor;
    }
    sum.selfadjointView<Eigen::Lower>().rankUpdate(chunk.topRows(m).transpose());
  }
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = j; i < n; ++i) {
      gram(index[static_cast<std::size_t>(i)], index[static_cast<std::size_t>(j)]) += sum(i, j);
    }
  }
}

Placed columns_and_response(const RowSpace& space) {
  Placed signals;
  for (std::size_t c = 0; c < space.columns.size(); ++c) {
    signals.add(space.columns[c], c);
  }
  signals.add(space.response, space.columns.size());
  return signals;
}

}  // namespace

Eigen::VectorXd residual(const RowSpace& space, const Subset& subset, const Eigen::VectorXd& coefficients,
                         Eigen::Index first, Eigen::Index count) {
  Eigen::VectorXd left = space.response.segment(first, count);
  for (const std::size_t c : subset.fixed) {
    if (space.columns[c].size() > 0) {
      left -= space.columns[c].segment(first, count);
    }
  }
  for (Eigen::Index k = 0; k < coefficients.size(); ++k) {
    const Eigen::VectorXd& column = space.columns[subset.columns[static_cast<std::size_t>(k)]];
    if (column.size() > 0) {
      left -= coefficients[k] * column.segment(first, count);
    }
  }
  return left;
}

Eigen::VectorXd residual(const RowSpace& space, const Subset& subset, const Eigen::VectorXd& coefficients) {
  return residual(space, subset, coefficients, 0, space.t.size());
}

// One subset's normal equations, in units of the columns' norms; index [(i, j)][block], i >= j.
struct BlockGram::Problem {
  std::size_t k = 0;
  std::size_t blocks = 0;
  std::vector<double> unit;          // 1/norm of each column
  std::vector<double> ridge;         // of each column, scaled
  std::vector<double> all_A, all_b;  // all inner rows
  std::vector<double> A, b, e;       // of each block
  std::vector<double> x;             // [column][block]: fitted to the other blocks
  Eigen::VectorXd taken;             // of each block: what the columns take of the efforts' noise; empty: nothing

  [[nodiscard]] static std::size_t pair(std::size_t i, std::size_t j) { return i * (i + 1) / 2 + j; }
  // Fits each block's complement by Cholesky, all blocks abreast.
  void solve_without_signs();
  // Fits the complements anew in which a coefficient has the wrong sign.
  void mend_signs(const std::vector<int>& sign);
  [[nodiscard]] Eigen::VectorXd losses() const;
};

void BlockGram::Problem::solve_without_signs() {
  const std::size_t B = blocks;
  std::vector<double> L((k * (k + 1)) / 2 * B), inverse(k * B);
  for (std::size_t j = 0; j < k; ++j) {
    for (std::size_t i = j; i < k; ++i) {
      double* const l = &L[pair(i, j) * B];
      const double* const own = &A[pair(i, j) * B];
      const double total = all_A[pair(i, j)] + (i == j ? ridge[i] : 0.0);
      for (std::size_t c = 0; c < B; ++c) {
        l[c] = total - own[c];
      }
      for (std::size_t m = 0; m < j; ++m) {
        const double* const li = &L[pair(i, m) * B];
        const double* const lj = &L[pair(j, m) * B];
        for (std::size_t c = 0; c < B; ++c) {
          l[c] -= li[c] * lj[c];
        }
      }
      double* const inv = &inverse[j * B];
      if (i == j) {
        for (std::size_t c = 0; c < B; ++c) {
          inv[c] = l[c] > kDetermined ? 1.0 / std::sqrt(l[c]) : 0.0;
        }
      } else {
        for (std::size_t c = 0; c < B; ++c) {
          l[c] *= inv[c];
        }
      }
    }
  }
  x.assign(k * B, 0.0);
  for (std::size_t i = 0; i < k; ++i) {
    double* const xi = &x[i * B];
    for (std::size_t c = 0; c < B; ++c) {
      xi[c] = all_b[i] - b[i * B + c];
    }
    for (std::size_t m = 0; m < i; ++m) {
      for (std::size_t c = 0; c < B; ++c) {
        xi[c] -= L[pair(i, m) * B + c] * x[m * B + c];
      }
    }
    for (std::size_t c = 0; c < B; ++c) {
      xi[c] *= inverse[i * B + c];
    }
  }
  for (std::size_t i = k; i-- > 0;) {
    double* const xi = &x[i * B];
    for (std::size_t m = i + 1; m < k; ++m) {
      for (std::size_t c = 0; c < B; ++c) {
        xi[c] -= L[pair(m, i) * B + c] * x[m * B + c];
      }
    }
    for (std::size_t c = 0; c < B; ++c) {
      xi[c] *= inverse[i * B + c];
    }
  }
}

void BlockGram::Problem::mend_signs(const std::vector<int>& sign) {
  if (sign.empty()) {
    return;
  }
  const auto n = static_cast<Eigen::Index>(k);
  for (std::size_t c = 0; c < blocks; ++c) {
    bool wrong = false;
    for (std::size_t i = 0; i < k; ++i) {
      wrong = wrong || sign[i] * x[i * blocks + c] < 0.0;
    }
    if (!wrong) {
      continue;
    }
    Eigen::MatrixXd rest(n, n);
    Eigen::VectorXd right(n);
    for (std::size_t i = 0; i < k; ++i) {
      const auto r = static_cast<Eigen::Index>(i);
      right[r] = all_b[i] - b[i * blocks + c];
      for (std::size_t j = 0; j <= i; ++j) {
        const double value = all_A[pair(i, j)] + (i == j ? ridge[i] : 0.0) - A[pair(i, j) * blocks + c];
        rest(r, static_cast<Eigen::Index>(j)) = rest(static_cast<Eigen::Index>(j), r) = value;
      }
    }
    const SignedSolution mended = signed_least_squares(rest, right, sign);
    for (std::size_t i = 0; i < k; ++i) {
      x[i * blocks + c] = mended.x[static_cast<Eigen::Index>(i)];
    }
  }
}

Eigen::VectorXd BlockGram::Problem::losses() const {
  Eigen::VectorXd loss = Eigen::Map<const Eigen::VectorXd>(e.data(), static_cast<Eigen::Index>(blocks));
  for (std::size_t i = 0; i < k; ++i) {
    const double* const xi = &x[i * blocks];
    for (std::size_t c = 0; c < blocks; ++c) {
      loss[static_cast<Eigen::Index>(c)] -= 2.0 * xi[c] * b[i * blocks + c];
    }
    for (std::size_t j = 0; j <= i; ++j) {
      const double twice = i == j ? 1.0 : 2.0;
      for (std::size_t c = 0; c < blocks; ++c) {
        loss[static_cast<Eigen::Index>(c)] += twice * xi[c] * x[j * blocks + c] * A[pair(i, j) * blocks + c];
      }
    }
  }
  if (taken.size() > 0) {
    loss += taken;
  }
  return loss.cwiseMax(0.0);
}

BlockGram::BlockGram(const std::vector<RowSpace>& spaces, const BlockOptions& options) : blocks_(options.blocks) {
  check_spaces(spaces);
  check::that(blocks_ >= 2, "BlockOptions::blocks", "at least two");
  check::non_negative(options.purge, "BlockOptions::purge");
  check::non_negative(options.shortest, "BlockOptions::shortest");
  columns_ = spaces.front().columns.size();
  double begin = std::numeric_limits<double>::infinity(), end = -begin;
  for (const RowSpace& space : spaces) {
    if (space.t.size() > 0) {
      begin = std::min(begin, space.t[0]);
      end = std::max(end, space.t[space.t.size() - 1]);
      all_rows_ += static_cast<double>(space.t.size());
    }
  }
  check::that(all_rows_ > 0, "BlockGram spaces", "at least one row");
  if (static_cast<double>(blocks_) * options.shortest > end - begin) {
    blocks_ = std::clamp<std::size_t>(static_cast<std::size_t>((end - begin) / options.shortest),
                                      std::min(std::max<std::size_t>(2, options.fewest), blocks_), blocks_);
  }
  const double length = (end - begin) / static_cast<double>(blocks_);
  for (std::size_t b = 0; b < blocks_; ++b) {
    const double from = begin + static_cast<double>(b) * length;
    interiors_.emplace_back(b == 0 ? begin : from + options.purge,
                            b + 1 == blocks_ ? std::nextafter(end, 2.0 * std::abs(end) + 1.0)
                                             : begin + (static_cast<double>(b) + 1.0) * length - options.purge);
  }
  const std::size_t pairs = (columns_ + 1) * (columns_ + 2) / 2;
  gram_.assign(pairs * lanes(), 0.0);
  rows_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(blocks_));
  std::vector<std::vector<Range>> cores(blocks_, std::vector<Range>(spaces.size()));
  core::for_all(blocks_, options.threads, [&](std::size_t b) {
    const auto size = static_cast<Eigen::Index>(columns_ + 1);
    Eigen::MatrixXd within = Eigen::MatrixXd::Zero(size, size), near = within;
    const auto border = [&](const RowSpace& space, std::size_t which) {
      return which == blocks_ ? space.t.size() : first_at(space.t, begin + static_cast<double>(which) * length);
    };
    for (std::size_t s = 0; s < spaces.size(); ++s) {
      const RowSpace& space = spaces[s];
      const Range block{border(space, b), border(space, b + 1)};
      Range& core = cores[b][s];
      core = rows_within(space, interiors_[b]);
      core.first = std::min(core.first, block.last);
      core.last = std::max(core.first, std::min(core.last, block.last));
      const Placed signals = columns_and_response(space);
      accumulate(signals, space.floor, core, within);
      accumulate(signals, space.floor, {block.first, core.first}, near);
      accumulate(signals, space.floor, {core.last, block.last}, near);
      rows_[static_cast<Eigen::Index>(b)] += static_cast<double>(core.last - core.first);
    }
    std::size_t p = 0;
    for (Eigen::Index i = 0; i < size; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j, ++p) {
        gram_[p * lanes() + b] = within(i, j);
        gram_[p * lanes() + blocks_ + b] = near(i, j);
      }
    }
  });
  check::that(rows_.sum() > 0.0, "BlockOptions", "blocks longer than twice the purge");
  for (std::size_t p = 0; p < pairs; ++p) {
    double* const lane = &gram_[p * lanes()];
    double near = 0.0;
    for (std::size_t b = 0; b < blocks_; ++b) {
      lane[inner()] += lane[b];
      near += lane[blocks_ + b];
    }
    lane[all()] = lane[inner()] + near;
  }
  accumulate_noise(spaces, cores, options.threads);
}

void BlockGram::accumulate_noise(const std::vector<RowSpace>& spaces, const std::vector<std::vector<Range>>& cores,
                                 std::size_t threads) {
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> index(columns_, kNone);
  for (const RowSpace& space : spaces) {
    for (std::size_t c = 0; c < space.noise_columns.size(); ++c) {
      if (space.noise_columns[c].size() > 0 && index[c] == kNone) {
        index[c] = noise_columns_++;
      }
    }
  }
  if (noise_columns_ == 0) {
    return;
  }
  for (std::size_t& place : index) {
    place = std::min(place, noise_columns_);
  }
  noise_index_ = std::move(index);
  const std::size_t size = noise_columns_ + 1;
  noise_gram_.assign(size * (size + 1) / 2 * blocks_, 0.0);
  core::for_all(blocks_, threads, [&](std::size_t b) {
    const auto n = static_cast<Eigen::Index>(size);
    Eigen::MatrixXd within = Eigen::MatrixXd::Zero(n, n);
    for (std::size_t s = 0; s < spaces.size(); ++s) {
      Placed signals;
      for (std::size_t c = 0; c < spaces[s].noise_columns.size(); ++c) {
        signals.add(spaces[s].noise_columns[c], noise_index_[c]);
      }
      signals.add(spaces[s].noise, noise_columns_);
      Eigen::MatrixXd own = Eigen::MatrixXd::Zero(n, n);
      accumulate(signals, spaces[s].floor, cores[b][s], own);
      within += own;
    }
    std::size_t p = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j, ++p) {
        noise_gram_[p * blocks_ + b] = within(i, j);
      }
    }
  });
}

// Sets what the columns of a solved problem take of the efforts' noise ε, δ being that noise in them with their
// coefficients: 2 ε·δ − δ·δ. Columns that add noise are left as they are.
void BlockGram::set_taken(const Subset& subset, Problem& q) const {
  if (noise_columns_ == 0) {
    return;
  }
  struct Part {
    std::size_t place;
    const double* x;  // of each block; null: 1
    double unit;
    [[nodiscard]] double factor(std::size_t block) const { return x == nullptr ? 1.0 : unit * x[block]; }
  };
  std::vector<Part> parts;
  for (const std::size_t f : subset.fixed) {
    if (noise_index_[f] < noise_columns_) {
      parts.push_back({noise_index_[f], nullptr, 1.0});
    }
  }
  for (std::size_t i = 0; i < q.k; ++i) {
    if (noise_index_[subset.columns[i]] < noise_columns_) {
      parts.push_back({noise_index_[subset.columns[i]], &q.x[i * blocks_], q.unit[i]});
    }
  }
  if (parts.empty()) {
    return;
  }
  Eigen::VectorXd taken = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(blocks_));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const double* const along = noise_products(noise_columns_, parts[i].place);
    for (std::size_t c = 0; c < blocks_; ++c) {
      taken[static_cast<Eigen::Index>(c)] += 2.0 * parts[i].factor(c) * along[c];
    }
    for (std::size_t j = 0; j <= i; ++j) {
      const double* const both = noise_products(parts[i].place, parts[j].place);
      const double twice = i == j ? 1.0 : 2.0;
      for (std::size_t c = 0; c < blocks_; ++c) {
        taken[static_cast<Eigen::Index>(c)] -= twice * parts[i].factor(c) * parts[j].factor(c) * both[c];
      }
    }
  }
  if (taken.sum() > 0.0) {
    q.taken = std::move(taken);
  }
}

void BlockGram::check_subset(const Subset& subset) const {
  const auto inside = [this](std::size_t c) { return c < columns_; };
  check::that(std::ranges::all_of(subset.columns, inside) && std::ranges::all_of(subset.fixed, inside), "Subset",
              "indices of columns");
  check::that(subset.sign.empty() || subset.sign.size() == subset.columns.size(), "Subset::sign",
              "one for each column, or none");
  check::that(subset.precision.empty() || subset.precision.size() == subset.columns.size(), "Subset::precision",
              "one for each column, or none");
  check::that(std::ranges::all_of(subset.precision, [](double p) { return p >= 0.0; }), "Subset::precision",
              "numbers >= 0");
}

BlockGram::Problem BlockGram::gather(const Subset& subset) const {
  check_subset(subset);
  Problem q;
  const std::size_t B = blocks_;
  q.k = subset.columns.size();
  q.blocks = B;
  q.unit.resize(q.k);
  q.ridge.assign(q.k, 0.0);
  q.all_A.resize(q.k * (q.k + 1) / 2);
  q.all_b.resize(q.k);
  q.A.resize(q.all_A.size() * B);
  q.b.resize(q.k * B);
  for (std::size_t i = 0; i < q.k; ++i) {
    const double square = at(subset.columns[i], subset.columns[i])[inner()];
    const double prior = subset.precision.empty() ? 0.0 : subset.precision[i];
    q.unit[i] = square + prior > 0.0 ? 1.0 / std::sqrt(square + prior) : 0.0;
    q.ridge[i] = prior * q.unit[i] * q.unit[i];
  }
  for (std::size_t i = 0; i < q.k; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const double* const lane = at(subset.columns[i], subset.columns[j]);
      const double unit = q.unit[i] * q.unit[j];
      const std::size_t p = Problem::pair(i, j);
      q.all_A[p] = unit * lane[inner()];
      for (std::size_t c = 0; c < B; ++c) {
        q.A[p * B + c] = unit * lane[c];
      }
    }
    const double* const response = at(subset.columns[i], columns_);
    q.all_b[i] = q.unit[i] * response[inner()];
    for (std::size_t c = 0; c < B; ++c) {
      q.b[i * B + c] = q.unit[i] * response[c];
    }
    for (const std::size_t f : subset.fixed) {
      const double* const lane = at(subset.columns[i], f);
      q.all_b[i] -= q.unit[i] * lane[inner()];
      for (std::size_t c = 0; c < B; ++c) {
        q.b[i * B + c] -= q.unit[i] * lane[c];
      }
    }
  }
  q.e.assign(at(columns_, columns_), at(columns_, columns_) + B);
  for (const std::size_t f : subset.fixed) {
    const double* const response = at(columns_, f);
    for (std::size_t c = 0; c < B; ++c) {
      q.e[c] -= 2.0 * response[c];
    }
    for (const std::size_t g : subset.fixed) {
      const double* const lane = at(f, g);
      for (std::size_t c = 0; c < B; ++c) {
        q.e[c] += lane[c];
      }
    }
  }
  return q;
}

BlockGram::Problem BlockGram::held_out(const Subset& subset) const {
  Problem problem = gather(subset);
  problem.solve_without_signs();
  problem.mend_signs(subset.sign);
  set_taken(subset, problem);
  return problem;
}

Eigen::VectorXd BlockGram::held_out_loss(const Subset& subset) const { return held_out(subset).losses(); }

Eigen::MatrixXd BlockGram::held_out_coefficients(const Subset& subset) const {
  const Problem problem = held_out(subset);
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::MatrixXd coefficients = Eigen::Map<const Rows>(problem.x.data(), static_cast<Eigen::Index>(problem.k),
                                                        static_cast<Eigen::Index>(blocks_));
  for (std::size_t i = 0; i < problem.k; ++i) {
    coefficients.row(static_cast<Eigen::Index>(i)) *= problem.unit[i];
  }
  return coefficients;
}

namespace {

constexpr double kMostPieces = 9.0e15;  // of one block: their numbers are exact in a double

// What the noise of the efforts is in the columns of the subset together; empty: nothing.
Eigen::VectorXd noise_in_columns(const RowSpace& space, const Subset& subset, const Eigen::VectorXd& coefficients,
                                 Range rows) {
  Eigen::VectorXd sum;
  const auto add = [&](std::size_t c, double factor) {
    if (c < space.noise_columns.size() && space.noise_columns[c].size() > 0) {
      const Eigen::VectorXd part = factor * space.noise_columns[c].segment(rows.first, rows.last - rows.first);
      sum = sum.size() > 0 ? Eigen::VectorXd(sum + part) : part;
    }
  };
  for (const std::size_t c : subset.fixed) {
    add(c, 1.0);
  }
  for (std::size_t k = 0; k < subset.columns.size(); ++k) {
    add(subset.columns[k], coefficients[static_cast<Eigen::Index>(k)]);
  }
  return space.noise.size() > 0 ? sum : Eigen::VectorXd();
}

}  // namespace

Eigen::VectorXd held_out_pieces(const BlockGram& gram, const std::vector<RowSpace>& spaces, const Subset& subset,
                                double length) {
  check::positive(length, "held_out_pieces length");
  const Eigen::MatrixXd coefficients = gram.held_out_coefficients(subset);
  std::vector<double> losses, taken_of;
  for (std::size_t block = 0; block < gram.blocks(); ++block) {
    if (!(gram.rows()[static_cast<Eigen::Index>(block)] > 0.0)) {
      continue;
    }
    const auto [from, to] = gram.interiors()[block];
    const auto pieces = static_cast<std::int64_t>(std::clamp((to - from) / length, 1.0, kMostPieces));
    std::vector<Range> ranges;
    std::int64_t rows_inside = 0;
    for (const RowSpace& space : spaces) {
      ranges.push_back(rows_within(space, gram.interiors()[block]));
      rows_inside += ranges.back().last - ranges.back().first;
    }
    std::map<std::int64_t, std::pair<double, double>> sums;  // losses, and what is taken of the noise
    for (std::int64_t piece = 0; pieces <= rows_inside && piece < pieces; ++piece) {
      sums[piece] = {0.0, 0.0};
    }
    for (std::size_t s = 0; s < spaces.size(); ++s) {
      const RowSpace& space = spaces[s];
      const Range rows = ranges[s];
      const Eigen::VectorXd block_coefficients = coefficients.col(static_cast<Eigen::Index>(block));
      const Eigen::VectorXd left = residual(space, subset, block_coefficients, rows.first, rows.last - rows.first);
      const Eigen::VectorXd noise = noise_in_columns(space, subset, block_coefficients, rows);
      for (Eigen::Index k = 0; k < left.size(); ++k) {
        const double place = (space.t[rows.first + k] - from) / (to - from) * static_cast<double>(pieces);
        const double taken = noise.size() > 0 ? noise[k] * (2.0 * space.noise[rows.first + k] - noise[k]) : 0.0;
        auto& [loss, taken_sum] = sums[std::min(static_cast<std::int64_t>(place), pieces - 1)];
        loss += std::pow(left[k] / space.floor, 2);
        taken_sum += taken / (space.floor * space.floor);
      }
    }
    for (const auto& [piece, sum] : sums) {
      losses.push_back(sum.first);
      taken_of.push_back(sum.second);
    }
  }
  const Eigen::Map<const Eigen::VectorXd> loss(losses.data(), std::ssize(losses)), taken(taken_of.data(), loss.size());
  return taken.sum() > 0.0 ? Eigen::VectorXd(loss + taken) : Eigen::VectorXd(loss);
}

double BlockGram::held_out_error(const Subset& subset) const { return held_out_loss(subset).sum() / rows_.sum(); }

BlockFit BlockGram::fit(const Subset& subset) const {
  check_subset(subset);
  const auto n = static_cast<Eigen::Index>(subset.columns.size());
  Eigen::VectorXd unit(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t c = subset.columns[static_cast<std::size_t>(i)];
    const double prior = subset.precision.empty() ? 0.0 : subset.precision[static_cast<std::size_t>(i)];
    unit[i] = square(c) + prior > 0.0 ? 1.0 / std::sqrt(square(c) + prior) : 0.0;
  }
  const auto entry = [this](std::size_t i, std::size_t j, std::size_t block) {
    const double* const lane = at(i, j);
    return block == blocks_ ? lane[all()] : lane[block] + lane[blocks_ + block];
  };
  const auto equations = [&](std::size_t block, Eigen::MatrixXd& A, Eigen::VectorXd& b) {
    A.resize(n, n);
    b.resize(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::size_t c = subset.columns[static_cast<std::size_t>(i)];
      b[i] = entry(c, columns_, block);
      for (const std::size_t f : subset.fixed) {
        b[i] -= entry(c, f, block);
      }
      b[i] *= unit[i];
      for (Eigen::Index j = 0; j <= i; ++j) {
        A(i, j) = A(j, i) = unit[i] * unit[j] * entry(c, subset.columns[static_cast<std::size_t>(j)], block);
      }
    }
  };
  Eigen::MatrixXd A, own;
  Eigen::VectorXd b, score;
  equations(blocks_, A, b);
  Eigen::VectorXd ridge = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n && !subset.precision.empty(); ++i) {
    ridge[i] = subset.precision[static_cast<std::size_t>(i)] * unit[i] * unit[i];
  }
  const Eigen::MatrixXd H = A + Eigen::MatrixXd(ridge.asDiagonal());
  const SignedSolution solution = signed_least_squares(H, b, subset.sign);
  BlockFit fit;
  fit.at_bound = solution.zero;
  fit.coefficients = unit.cwiseProduct(solution.x);

  const Eigen::MatrixXd inverse = restricted_inverse(H, solution.zero);
  Eigen::MatrixXd covariance = inverse * ridge.asDiagonal() * inverse;
  const auto blocks = static_cast<double>(blocks_);
  for (std::size_t c = 0; c < blocks_; ++c) {
    equations(c, own, score);
    score -= own * solution.x;
    const Eigen::VectorXd change = restricted_inverse(H - own, solution.zero) * score;
    covariance += (blocks - 1.0) / blocks * change * change.transpose();
  }
  fit.covariance = unit.asDiagonal() * covariance * unit.asDiagonal();

  double sum = square(columns_);
  for (const std::size_t f : subset.fixed) {
    sum -= 2.0 * product(columns_, f);
    for (const std::size_t g : subset.fixed) {
      sum += product(f, g);
    }
  }
  sum += solution.x.dot(A * solution.x) - 2.0 * solution.x.dot(b);
  fit.mean_square = std::max(0.0, sum) / all_rows_;
  fit.held_out_loss = held_out_loss(subset);
  fit.held_out_error = fit.held_out_loss.sum() / rows_.sum();
  return fit;
}

namespace {

Eigen::MatrixXd products(const BlockGram& gram, const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) {
  Eigen::MatrixXd m(static_cast<Eigen::Index>(a.size()), static_cast<Eigen::Index>(b.size()));
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    for (Eigen::Index j = 0; j < m.cols(); ++j) {
      m(i, j) = gram.product(a[static_cast<std::size_t>(i)], b[static_cast<std::size_t>(j)]);
    }
  }
  return m;
}

}  // namespace

Eigen::MatrixXd remainder(const BlockGram& gram, const std::vector<std::size_t>& of,
                          const std::vector<std::size_t>& on) {
  Eigen::MatrixXd rest = products(gram, of, of);
  if (of.empty() || on.empty()) {
    return rest;
  }
  Eigen::MatrixXd A = products(gram, on, on);
  const Eigen::VectorXd unit = A.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
  A = unit.asDiagonal() * A * unit.asDiagonal();
  A.diagonal().array() += 1e-10;
  const Eigen::MatrixXd c = unit.asDiagonal() * products(gram, on, of);
  rest -= c.transpose() * core::LdltFactors(A).solve(c);
  return rest;
}

double signed_rank(const Eigen::VectorXd& differences) {
  std::vector<Eigen::Index> order;
  for (Eigen::Index k = 0; k < differences.size(); ++k) {
    if (differences[k] != 0.0) {
      order.push_back(k);
    }
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return std::abs(differences[a]) < std::abs(differences[b]); });
  double positive = 0.0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    positive += differences[order[k]] > 0.0 ? static_cast<double>(k + 1) : 0.0;
  }
  const auto n = static_cast<double>(order.size());
  return order.empty() ? 0.0 : (positive - n * (n + 1.0) / 4.0) / std::sqrt(n * (n + 1.0) * (2.0 * n + 1.0) / 24.0);
}

}  // namespace wheelwright::gap
