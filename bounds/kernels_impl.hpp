// SPDX-License-Identifier: Apache-2.0
/// \file
/// The loops of kernels.hpp for vectors of W doubles. Included by one source file per processor variant; nothing of the
/// standard library is called here, since an inline function compiled for a newer processor could be the one the linker
/// keeps for all.
#pragma once

#include <wheelwright/bounds/kernels.hpp>

namespace wheelwright::bounds::kernels {

template <int W>
struct VectorOf;
template <>
struct VectorOf<2> {
  typedef double Type __attribute__((vector_size(16)));
};
template <>
struct VectorOf<4> {
  typedef double Type __attribute__((vector_size(32)));
};
template <>
struct VectorOf<8> {
  typedef double Type __attribute__((vector_size(64)));
};

template <int W>
struct Loops {
  using Vector = typename VectorOf<W>::Type;
  using Mask = decltype(Vector{} <= Vector{});

  static Vector load(const double* from) {
    Vector v;
    __builtin_memcpy(&v, from, sizeof v);
    return v;
  }
  static void store(double* to, Vector v) { __builtin_memcpy(to, &v, sizeof v); }
  static Vector all(double x) { return x - Vector{}; }
  static bool any(Mask mask) {
    bool found = false;
    for (int k = 0; k < W; ++k) {
      found = found || mask[k] != 0;
    }
    return found;
  }
  static Vector magnitude(Vector v) { return v < 0.0 ? -v : v; }

  static constexpr double kInfinity = __builtin_huge_val();
  static constexpr std::size_t kVectors = kTile / W;

  static void slack(const Rows& rows, const double* x, double* out) {
    for (std::size_t i = 0; i < rows.m; i += W) {
      Vector s = load(rows.b + i);
      for (std::size_t j = 0; j < rows.p; ++j) {
        s -= load(rows.a + j * rows.stride + i) * x[j];
      }
      store(out + i, s);
    }
  }

  static Found most_violated(const Rows& rows, const double* x) {
    Found worst{0, -kInfinity};
    double values[kTile];
    for (std::size_t first = 0; first < rows.m; first += kTile) {
      const std::size_t count = rows.m - first < kTile ? rows.m - first : kTile;
      Vector largest = all(-kInfinity);
      for (std::size_t i = 0; i < count; i += W) {
        const double* a = rows.a + first + i;
        Vector s = load(a) * x[0];
        for (std::size_t j = 1; j < rows.p; ++j) {
          s += load(a + j * rows.stride) * x[j];
        }
        s -= load(rows.b + first + i);
        store(values + i, s);
        largest = s > largest ? s : largest;
      }
      bool better = false;
      for (int k = 0; k < W; ++k) {
        better = better || largest[k] > worst.value;
      }
      for (std::size_t i = 0; better && i < count; ++i) {
        if (values[i] > worst.value) {
          worst = {first + i, values[i]};
        }
      }
    }
    return worst;
  }

  static Found first_blocking(const Rows& rows, const double* slack, const double* d, double pivot, double* along) {
    Found first_row{0, kInfinity};
    for (std::size_t first = 0; first < rows.m; first += kTile) {
      const std::size_t count = rows.m - first < kTile ? rows.m - first : kTile;
      Mask nearer{};
      const Vector limit = all(first_row.value);
      for (std::size_t i = 0; i < count; i += W) {
        const double* a = rows.a + first + i;
        Vector g = load(a) * d[0];
        for (std::size_t j = 1; j < rows.p; ++j) {
          g += load(a + j * rows.stride) * d[j];
        }
        store(along + first + i, g);
        // Divisions only where a row can be nearer than all before: not (slack >= limit·g).
        nearer |= (g > pivot) & ~(load(slack + first + i) >= limit * g);
      }
      const bool wanted = any(nearer);
      for (std::size_t i = first; wanted && i < first + count; ++i) {
        if (along[i] > pivot && !(slack[i] >= first_row.value * along[i])) {
          const double ratio = slack[i] > 0.0 ? slack[i] / along[i] : 0.0;
          if (ratio < first_row.value) {
            first_row = {i, ratio};
          }
        }
      }
    }
    return first_row;
  }

  static double excess(const Slabs& slabs, std::size_t i, const double* centre, const double* half,
                       const double* least) {
    double residual = slabs.y[i], reach = 0.0, allowed = slabs.dy[i];
    for (std::size_t j = 0; j < slabs.p; ++j) {
      const double Y = slabs.Y[j][i];
      residual -= Y * centre[j];
      reach += (Y < 0.0 ? -Y : Y) * half[j];
      if (slabs.dY != nullptr) {
        allowed += slabs.dY[j][i] * least[j];
      }
    }
    return (residual < 0.0 ? -residual : residual) + reach - allowed;
  }

  static double peak(const double* column, std::size_t n, double least) {
    Vector largest = all(least);
    std::size_t i = 0;
    for (; i + W <= n; i += W) {
      const Vector v = magnitude(load(column + i));
      largest = v > largest ? v : largest;
    }
    for (int k = 0; k < W; ++k) {
      least = largest[k] > least ? largest[k] : least;
    }
    for (; i < n; ++i) {
      const double v = column[i] < 0.0 ? -column[i] : column[i];
      least = v > least ? v : least;
    }
    return least;
  }

  /// Peaks are looked for in stretches that stay in the cache until they are scanned.
  static constexpr std::size_t kStretch = 32 * kTile;

  static void raise(const Slabs& slabs, std::size_t first, std::size_t count, double* peaks) {
    for (std::size_t j = 0; j <= slabs.p; ++j) {
      peaks[j] = peak((j < slabs.p ? slabs.Y[j] : slabs.y) + first, count, peaks[j]);
    }
  }

  /// Rows i … i + W − 1: |y − Y·c| + Σ|(YT)_k| half_k.
  static Vector oblique_reach(const Slabs& slabs, std::size_t i, const Oblique& box) {
    const std::size_t p = slabs.p;
    Vector residual = load(slabs.y + i), reach{};
    for (std::size_t j = 0; j < p; ++j) {
      residual -= load(slabs.Y[j] + i) * box.centre[j];
    }
    for (std::size_t k = 0; k < p; ++k) {
      const double* column = box.transform + k * p;
      Vector g = load(slabs.Y[0] + i) * column[0];
      for (std::size_t j = 1; j < p; ++j) {
        g += load(slabs.Y[j] + i) * column[j];
      }
      reach += magnitude(g) * box.half[k];
    }
    return magnitude(residual) + reach;
  }

  static double oblique_reach_of_one(const Slabs& slabs, std::size_t i, const Oblique& box) {
    double residual = slabs.y[i], reach = 0.0;
    for (std::size_t j = 0; j < slabs.p; ++j) {
      residual -= slabs.Y[j][i] * box.centre[j];
    }
    for (std::size_t k = 0; k < slabs.p; ++k) {
      double g = slabs.Y[0][i] * box.transform[k * slabs.p];
      for (std::size_t j = 1; j < slabs.p; ++j) {
        g += slabs.Y[j][i] * box.transform[k * slabs.p + j];
      }
      reach += (g < 0.0 ? -g : g) * box.half[k];
    }
    return (residual < 0.0 ? -residual : residual) + reach;
  }

  static std::size_t scan(const Slabs& slabs, const double* centre, const double* half, const double* least,
                          const Oblique* oblique, double floor, std::uint32_t* found, double* peaks) {
    std::size_t count = 0, first = 0;
    for (; first + kTile <= slabs.n; first += kTile) {
      if (peaks != nullptr && first % kStretch == 0) {
        raise(slabs, first, slabs.n - first < kStretch ? slabs.n - first : kStretch, peaks);
      }
      Vector residual[kVectors], reach[kVectors];
      for (std::size_t k = 0; k < kVectors; ++k) {
        residual[k] = load(slabs.y + first + k * W);
        reach[k] = Vector{};
      }
      for (std::size_t j = 0; j < slabs.p; ++j) {
        const double* column = slabs.Y[j] + first;
        const double c = centre[j], h = half[j];
        for (std::size_t k = 0; k < kVectors; ++k) {
          const Vector Y = load(column + k * W);
          residual[k] -= Y * c;
          reach[k] += magnitude(Y) * h;
        }
      }
      for (std::size_t k = 0; k < kVectors; ++k) {
        Vector allowed = load(slabs.dy + first + k * W);
        for (std::size_t j = 0; slabs.dY != nullptr && j < slabs.p; ++j) {
          allowed += load(slabs.dY[j] + first + k * W) * least[j];
        }
        const Vector e = magnitude(residual[k]) + reach[k] - allowed;
        Mask over = ~(e <= floor);
        if (oblique != nullptr && any(over)) {
          over &= ~(oblique_reach(slabs, first + k * W, *oblique) - allowed <= floor);
        }
        if (any(over)) {
          for (int i = 0; i < W; ++i) {
            found[count] = static_cast<std::uint32_t>(first + k * W) + static_cast<std::uint32_t>(i);
            count += over[i] != 0 ? 1 : 0;
          }
        }
      }
    }
    if (peaks != nullptr && first < slabs.n && first % kStretch == 0) {
      raise(slabs, first, slabs.n - first, peaks);
    }
    for (; first < slabs.n; ++first) {
      bool over = !(excess(slabs, first, centre, half, least) <= floor);
      if (over && oblique != nullptr) {
        double allowed = slabs.dy[first];
        for (std::size_t j = 0; slabs.dY != nullptr && j < slabs.p; ++j) {
          allowed += slabs.dY[j][first] * least[j];
        }
        over = !(oblique_reach_of_one(slabs, first, *oblique) - allowed <= floor);
      }
      if (over) {
        found[count++] = static_cast<std::uint32_t>(first);
      }
    }
    return count;
  }

  static constexpr std::size_t kMostColumns = 32;

  /// Rows i … i + W − 1: whether one of the points exceeds what is allowed, or is not a number.
  static Mask exceeded(const Slabs& slabs, std::size_t i, const double* points, std::size_t count) {
    const std::size_t p = slabs.p;
    Vector Y[kMostColumns];
    for (std::size_t j = 0; j < p; ++j) {
      Y[j] = load(slabs.Y[j] + i);
    }
    const Vector y = load(slabs.y + i), dy = load(slabs.dy + i);
    Mask over{};
    for (std::size_t k = 0; k < count; ++k) {
      const double* x = points + k * p;
      Vector even = y - Y[0] * x[0], odd{};
      for (std::size_t j = 1; j + 1 < p; j += 2) {
        odd -= Y[j] * x[j];
        even -= Y[j + 1] * x[j + 1];
      }
      if (p % 2 == 0) {
        odd -= Y[p - 1] * x[p - 1];
      }
      Vector excess = magnitude(even + odd) - dy;
      for (std::size_t j = 0; slabs.dY != nullptr && j < p; ++j) {
        excess -= load(slabs.dY[j] + i) * (x[j] < 0.0 ? -x[j] : x[j]);
      }
      over |= ~(excess <= 0.0);
    }
    return over;
  }

  static std::size_t violated(const Slabs& slabs, const double* points, std::size_t count, std::uint32_t* found) {
    std::size_t total = 0, i = 0;
    const auto report = [&](std::size_t first, Mask over) {
      for (int k = 0; any(over) && k < W; ++k) {
        found[total] = static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(k);
        total += over[k] != 0 ? 1 : 0;
      }
    };
    for (; i + W <= slabs.n; i += W) {
      report(i, exceeded(slabs, i, points, count));
    }
    for (; i < slabs.n; ++i) {
      double Y[kMostColumns], dY[kMostColumns];
      for (std::size_t j = 0; j < slabs.p; ++j) {
        Y[j] = slabs.Y[j][i];
        dY[j] = slabs.dY != nullptr ? slabs.dY[j][i] : 0.0;
      }
      bool over = false;
      for (std::size_t k = 0; k < count; ++k) {
        const double* x = points + k * slabs.p;
        double even = slabs.y[i] - Y[0] * x[0], odd = 0.0;
        for (std::size_t j = 1; j + 1 < slabs.p; j += 2) {
          odd -= Y[j] * x[j];
          even -= Y[j + 1] * x[j + 1];
        }
        if (slabs.p % 2 == 0) {
          odd -= Y[slabs.p - 1] * x[slabs.p - 1];
        }
        double excess = (even + odd < 0.0 ? -(even + odd) : even + odd) - slabs.dy[i];
        for (std::size_t j = 0; slabs.dY != nullptr && j < slabs.p; ++j) {
          excess -= dY[j] * (x[j] < 0.0 ? -x[j] : x[j]);
        }
        over = over || !(excess <= 0.0);
      }
      if (over) {
        found[total++] = static_cast<std::uint32_t>(i);
      }
    }
    return total;
  }

  static constexpr Table table(const char* name) {
    return {name, &slack, &most_violated, &first_blocking, &scan, &violated};
  }
};

}  // namespace wheelwright::bounds::kernels
