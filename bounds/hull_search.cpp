// SPDX-License-Identifier: Apache-2.0
#include "bounds/hull_search.hpp"

#include <algorithm>
#include <cmath>
#include <thread>

#include "bounds/kernels.hpp"

namespace wheelwright::bounds {
namespace {

constexpr std::size_t kFirst = 1 << 15;    // rows of the first portion
constexpr std::size_t kLargest = 1 << 18;  // of any: should all of them cut, they are held at once
constexpr std::size_t kChunk = 1 << 13;    // rows that are looked at in one call
constexpr std::size_t kWorthAThread = 1 << 14;
constexpr std::size_t kSparse = 8;    // one row out of so many is worth going after
constexpr double kNear = 0.02;        // share of its bounds that a row at hand leaves at most
constexpr std::size_t kMany = 512;    // rows that come near in one portion: with more of them, fewer will do
constexpr std::size_t kRounds = 100;  // of looks at all rows: a corner whose program fails stays where it is

std::vector<std::size_t> all_of(const Box& box) {
  std::vector<std::size_t> numbers(box.dimension());
  for (std::size_t j = 0; j < numbers.size(); ++j) {
    numbers[j] = j;
  }
  return numbers;
}

}  // namespace

HullSearch::HullSearch(const Box& prior, const Eigen::MatrixXd& information, std::size_t threads)
    : rows_(prior),
      planes_(prior, information, all_of(prior)),
      threads_(threads),
      p_(prior.dimension()),
      near_(kNear),
      Y_(p_),
      dY_(p_) {
  bank_.parameters = p_;
}

/// Takes box and vertices, all of which are to be looked at.
void HullSearch::begin() {
  around_ = planes_.outer_box();
  unit_ = around_.half;
  most_ = 0.0;
  corners_ = points_ = planes_.extreme_points();
}

/// Takes the box, and those vertices that are farther from where they were looked at than rows that are not at hand
/// allow. False where there are none.
bool HullSearch::look_again() {
  around_ = planes_.outer_box();
  const Eigen::MatrixXd now = planes_.extreme_points();
  points_.resizeLike(now);  // an earlier look may have been at fewer
  Eigen::Index count = 0;
  for (Eigen::Index k = 0; k < now.cols(); ++k) {
    double way = 0.0;
    for (std::size_t j = 0; j < p_; ++j) {
      const auto row = static_cast<Eigen::Index>(j);
      const double step = std::abs(now(row, k) - corners_(row, k));
      way = step > 0.0 ? std::max(way, step / unit_[j]) : way;
    }
    if (!(way * most_ <= near_)) {
      corners_.col(k) = now.col(k);
      points_.col(count++) = now.col(k);
    }
  }
  points_.conservativeResize(Eigen::NoChange, count);
  return count > 0;
}

/// Writes those of the rows [first, first + count) that a vertex violates to `found_`.
void HullSearch::examine(const SlabColumns& rows, std::size_t first, std::size_t count) {
  const kernels::Points points{around_.centre.data(),
                               around_.half.data(),
                               around_.least.data(),
                               points_.data(),
                               static_cast<std::size_t>(points_.cols()),
                               1.0 - near_};
  struct Share {
    std::vector<std::uint32_t> found;
    double most = 0.0;
  };
  const auto search = [&](std::size_t begin, std::size_t end, Share& own) {
    std::vector<std::uint32_t> found(kChunk);
    for (std::size_t i = begin; i < end; i += kChunk) {
      const SlabColumns some = rows.part(i, std::min(kChunk, end - i));
      const kernels::Slabs slabs{
          some.Y.data(), some.dY.empty() ? nullptr : some.dY.data(), some.y, some.dy, some.n, p_};
      unsigned char* open = open_.data() + i / kernels::kLanes;
      unsigned char* last = open + (some.n + kernels::kLanes - 1) / kernels::kLanes;
      // Where many rows are read anyway, to leave out some costs more than it saves.
      if (static_cast<std::size_t>(std::count(open, last, 1)) * kernels::kLanes * kSparse > some.n) {
        std::fill(open, last, static_cast<unsigned char>(1));
      }
      const std::size_t these = kernels::best().examine(slabs, points, found.data(), open, &own.most);
      for (std::size_t k = 0; k < these; ++k) {
        own.found.push_back(found[k] + static_cast<std::uint32_t>(i));
      }
    }
  };
  const std::size_t shares = std::max<std::size_t>(1, std::min(threads_, count / kWorthAThread));
  const auto begin = [&](std::size_t s) {
    return first + (s == shares ? count : s * count / shares / kernels::kLanes * kernels::kLanes);
  };
  std::vector<Share> all(shares);
  {
    std::vector<std::jthread> helpers;
    for (std::size_t s = 1; s < shares; ++s) {
      helpers.emplace_back([&, s] { search(begin(s), begin(s + 1), all[s]); });
    }
    search(begin(0), begin(1), all[0]);
  }
  found_.clear();
  for (const Share& each : all) {
    found_.insert(found_.end(), each.found.begin(), each.found.end());
    most_ = std::max(most_, each.most);
  }
}

/// Puts the half-spaces of a row that the box leaves open into the bank.
void HullSearch::offer(const SlabColumns& rows, std::size_t row) {
  bool finite = std::isfinite(rows.y[row]) && std::isfinite(rows.dy[row]);
  for (std::size_t j = 0; j < p_; ++j) {
    Y_[j] = rows.Y[j][row];
    dY_[j] = rows.dY.empty() ? 0.0 : rows.dY[j][row];
    finite = finite && std::isfinite(Y_[j]) && std::isfinite(dY_[j]) && dY_[j] >= 0.0;
  }
  check::that(finite && rows.dy[row] >= 0.0, "regression row", "finite numbers and error bounds >= 0");
  ++candidates_;
  rows_.half_spaces(Y_, dY_, rows.y[row], rows.dy[row], rows.origin(row), upper_, lower_);
  for (const HalfSpace* half_space : {&upper_, &lower_}) {
    double reach = -half_space->b;
    for (std::size_t j = 0; j < p_; ++j) {
      const double a = half_space->a[static_cast<Eigen::Index>(j)];
      reach += a * around_.centre[j] + std::abs(a) * around_.half[j];
    }
    if (reach > 0.0) {
      bank_.add({half_space->a.data(), p_}, half_space->b, half_space->origin);
    }
  }
}

/// Cuts with the rows found; false where the set is proved empty.
bool HullSearch::add(const SlabColumns& rows) {
  for (const std::uint32_t row : found_) {
    offer(rows, row);
  }
  RowBank open;
  open.parameters = p_;
  planes_.add_to_hull(bank_, &open);
  bank_ = std::move(open);
  return !planes_.is_empty();
}

bool HullSearch::cut(const SlabColumns& rows) {
  open_.assign(rows.n / kernels::kLanes + 1, 1);
  near_ = kNear;
  for (std::size_t first = 0, size = 0; first < rows.n; first += size) {
    size = std::min(std::clamp(first, kFirst, kLargest), rows.n - first);
    begin();
    examine(rows, first, size);
    if (!add(rows)) {
      return false;
    }
    near_ = found_.size() > kMany ? 0.5 * near_ : near_;
  }
  begin();
  for (std::size_t round = 0; round < kRounds; ++round) {
    const double most = most_;
    examine(rows, 0, rows.n);
    most_ = round == 0 ? most_ : most;  // in units of the first look, at more rows than later ones
    if (!add(rows)) {
      return false;
    }
    if (!look_again()) {
      break;
    }
  }
  bank_.clear();
  return true;
}

}  // namespace wheelwright::bounds
