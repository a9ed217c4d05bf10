// SPDX-License-Identifier: Apache-2.0
// The loops for vector units: all variants give the same digits, and those of the plain formula.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "bounds/kernels.hpp"
#include "tests/bounds/rows.hpp"

namespace wheelwright::bounds::kernels {
namespace {

using testing_rows::Random;

struct Matrix {
  std::vector<double> a, b;
  Rows rows;
};

Matrix matrix(std::uint64_t seed, std::size_t m, std::size_t p) {
  Random random(seed);
  Matrix result;
  const std::size_t stride = (m + kLanes - 1) / kLanes * kLanes;
  result.a.assign(stride * p, 0.0);
  result.b.assign(stride, std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t j = 0; j < p; ++j) {
      result.a[j * stride + i] = random.symmetric();
    }
    result.b[i] = random.unit();
  }
  result.rows = {result.a.data(), stride, stride, p, result.b.data()};
  return result;
}

struct Columns {
  std::vector<std::vector<double>> Y, dY;
  std::vector<const double*> Y_pointers, dY_pointers;
  std::vector<double> y, dy;

  Columns(std::uint64_t seed, std::size_t n, std::size_t p, bool noisy) {
    Random random(seed);
    for (std::size_t j = 0; j < p; ++j) {
      Y.push_back(random.vector(n));
      dY.push_back(random.vector(n));
      for (double& x : dY.back()) {
        x = 0.05 * std::abs(x);
      }
    }
    y = random.vector(n);
    dy = random.vector(n);
    for (double& x : dy) {
      x = 0.4 + 0.3 * x;
    }
    for (std::size_t j = 0; j < p; ++j) {
      Y_pointers.push_back(Y[j].data());
      dY_pointers.push_back(dY[j].data());
    }
    slabs = {Y_pointers.data(), noisy ? dY_pointers.data() : nullptr, y.data(), dy.data(), n, p};
  }
  Slabs slabs;
};

TEST(Kernels, AreThereForThisProcessor) {
  ASSERT_GE(available().size(), 1u);
  EXPECT_EQ(available().front()->name, std::string("baseline"));
  EXPECT_EQ(&best(), available().back());
}

TEST(Kernels, RowsGiveTheSameDigitsInEveryVariantAndThePlainFormula) {
  for (const std::size_t p : {1, 2, 3, 7, 8, 12}) {
    for (const std::size_t m : {1, 8, 63, 64, 65, 200}) {
      const Matrix given = matrix(100 * p + m, m, p);
      Random random(m);
      const std::vector<double> x = random.vector(p), d = random.vector(p);
      const std::size_t padded = given.rows.m;
      std::vector<double> slack(padded), first_slack, along(padded), first_along;
      Found worst, blocking;
      for (const Table* table : available()) {
        table->slack(given.rows, x.data(), slack.data());
        const Found w = table->most_violated(given.rows, x.data());
        const Found b = table->first_blocking(given.rows, slack.data(), d.data(), 1e-9, along.data());
        if (table == available().front()) {
          first_slack = slack;
          first_along = along;
          worst = w;
          blocking = b;
          // Against the formula, in another order of operations.
          double largest = -1e300, nearest = std::numeric_limits<double>::infinity();
          for (std::size_t i = 0; i < m; ++i) {
            long double product = 0.0L, g = 0.0L;
            for (std::size_t j = 0; j < p; ++j) {
              product += static_cast<long double>(given.a[j * padded + i]) * x[j];
              g += static_cast<long double>(given.a[j * padded + i]) * d[j];
            }
            EXPECT_NEAR(slack[i], static_cast<double>(given.b[i] - product), 1e-14);
            EXPECT_NEAR(along[i], static_cast<double>(g), 1e-14);
            largest = std::max(largest, -slack[i]);
            if (along[i] > 1e-9) {
              nearest = std::min(nearest, std::max(slack[i], 0.0) / along[i]);
            }
          }
          EXPECT_NEAR(w.value, largest, 1e-14);
          EXPECT_EQ(b.value, nearest);
        }
        EXPECT_EQ(slack, first_slack) << table->name;
        EXPECT_EQ(along, first_along) << table->name;
        EXPECT_EQ(w.row, worst.row) << table->name;
        EXPECT_EQ(w.value, worst.value) << table->name;
        EXPECT_EQ(b.row, blocking.row) << table->name;
        EXPECT_EQ(b.value, blocking.value) << table->name;
      }
    }
  }
}

TEST(Kernels, ScansFindTheSameRowsInEveryVariantAndThoseOfThePlainFormula) {
  for (const bool noisy : {false, true}) {
    for (const std::size_t p : {1, 2, 5, 8}) {
      const std::size_t n = 1000 + p;  // with a rest that fills no vector
      Columns given(p, n, p, noisy);
      given.y[17] = std::nan("");
      Random random(p);
      const std::vector<double> centre = random.vector(p), half(p, 0.01), least(p, 0.1), points = random.vector(3 * p),
                                transform = random.vector(p * p);
      const Oblique oblique{centre.data(), half.data(), transform.data()};
      std::vector<double> middle(p), around(p);
      const std::vector<double> nowhere(p, 0.0);
      for (std::size_t j = 0; j < p; ++j) {
        const auto [low, high] = std::minmax({points[j], points[p + j], points[2 * p + j]});
        middle[j] = 0.5 * (low + high);
        around[j] = 0.5 * (high - low) + 1e-12;
      }
      std::vector<std::uint32_t> found(n), first[3];
      std::vector<double> peaks, first_peaks;
      std::vector<unsigned char> first_open;
      double first_most = 0.0;
      for (const Table* table : available()) {
        peaks.assign(p + 1, 0.0);
        const std::size_t counts[] = {
            table->scan(given.slabs, centre.data(), half.data(), least.data(), nullptr, 0.3, found.data(), nullptr), 0,
            0};
        std::vector<std::uint32_t> plain(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(counts[0]));
        std::size_t count = table->scan(given.slabs, centre.data(), half.data(), least.data(), &oblique, 0.3,
                                        found.data(), peaks.data());
        const std::vector<std::uint32_t> slanted(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count));
        // The points' box, so that it decides nothing that they do not.
        const Points at{middle.data(), around.data(), nowhere.data(), points.data(), 3, 1.0};
        std::vector<unsigned char> open(n / kLanes + 1, 1);
        double most = 0.0;
        count = table->examine(given.slabs, at, found.data(), open.data(), &most);
        const std::vector<std::uint32_t> violated(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count));
        count = table->examine(given.slabs, at, found.data(), nullptr, nullptr);
        EXPECT_EQ(violated,
                  std::vector<std::uint32_t>(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count)));
        if (table == available().front()) {
          first[0] = plain;
          first[1] = slanted;
          first[2] = violated;
          first_peaks = peaks;
          first_open = open;
          first_most = most;
          double largest = 0.0;
          for (std::uint32_t i = 0; i < n; ++i) {
            double residual = given.y[i], reach = 0.0, errors = 0.0;
            for (std::size_t j = 0; j < p; ++j) {
              residual -= given.Y[j][i] * middle[j];
              reach += std::abs(given.Y[j][i]) * around[j];
              errors += noisy ? given.dY[j][i] * around[j] : 0.0;
            }
            if (!(std::abs(residual) + reach <= given.dy[i] - 1e-12)) {
              largest = std::max(largest, (reach + errors) / given.dy[i]);
            }
            // What is passed over holds at every point of the box.
            EXPECT_TRUE(open[i / kLanes] != 0 || std::abs(residual) + reach <= given.dy[i] + 1e-12) << i;
          }
          EXPECT_NEAR(most, largest, 1e-12 * largest);
          EXPECT_TRUE(std::includes(plain.begin(), plain.end(), slanted.begin(), slanted.end()));
          for (std::uint32_t i = 0; i < n; ++i) {
            long double residual = given.y[i], reach = 0.0L, allowed = given.dy[i];
            for (std::size_t j = 0; j < p; ++j) {
              residual -= static_cast<long double>(given.Y[j][i]) * centre[j];
              reach += std::abs(given.Y[j][i]) * half[j];
              allowed += noisy ? given.dY[j][i] * least[j] : 0.0;
            }
            const long double excess = std::abs(residual) + reach - allowed - 0.3L;
            if (!(std::abs(excess) < 1e-13L)) {
              EXPECT_EQ(std::binary_search(plain.begin(), plain.end(), i), !(excess <= 0.0L)) << i;
            }
            bool over = false, close = false;
            for (std::size_t k = 0; k < 3; ++k) {
              long double e = given.y[i], room = given.dy[i];
              for (std::size_t j = 0; j < p; ++j) {
                e -= static_cast<long double>(given.Y[j][i]) * points[k * p + j];
                room += noisy ? given.dY[j][i] * std::abs(points[k * p + j]) : 0.0;
              }
              over = over || !(std::abs(e) <= room);
              close = close || std::abs(std::abs(e) - room) < 1e-13L;
            }
            if (!close) {
              EXPECT_EQ(std::binary_search(violated.begin(), violated.end(), i), over) << i;
            }
          }
        }
        EXPECT_EQ(plain, first[0]) << table->name;
        EXPECT_EQ(slanted, first[1]) << table->name;
        EXPECT_EQ(peaks, first_peaks) << table->name;
        EXPECT_EQ(violated, first[2]) << table->name;
        EXPECT_EQ(open, first_open) << table->name;
        EXPECT_EQ(most, first_most) << table->name;
      }
    }
  }
}

}  // namespace
}  // namespace wheelwright::bounds::kernels
