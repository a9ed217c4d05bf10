// SPDX-License-Identifier: Apache-2.0
/// \file
/// The loops of kernels.hpp for vectors of W doubles. Included by one source file per processor variant; nothing of the
/// standard library is called here, since an inline function compiled for a newer processor could be the one the linker
/// keeps for all.
#pragma once

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "bounds/kernels.hpp"

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
  /// One bit of each lane.
  static unsigned bits(Mask mask) {
#if defined(__AVX512DQ__)
    if constexpr (W == 8) {
      return static_cast<unsigned>(_mm512_movepi64_mask(reinterpret_cast<__m512i>(mask)));
    }
#endif
#if defined(__AVX__)
    if constexpr (W == 4) {
      return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask)));
    }
#endif
#if defined(__SSE2__)
    if constexpr (W == 2) {
      return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(mask)));
    }
#endif
    unsigned result = 0;
    for (int k = 0; k < W; ++k) {
      result |= mask[k] != 0 ? 1U << k : 0U;
    }
    return result;
  }
  static bool any(Mask mask) { return bits(mask) != 0; }
  static Vector magnitude(Vector v) {
    const auto sign = reinterpret_cast<Mask>(v) & 0x7fffffffffffffffLL;
    return reinterpret_cast<Vector>(sign);
  }

  static constexpr double kInfinity = __builtin_huge_val();

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

  /// Rows i, i + 1, … of a column: W of them, or (not Full) the first `lanes` and zeros.
  template <bool Full>
  static Vector take(const double* from, std::size_t lanes) {
    if constexpr (Full) {
      return load(from);
    } else {
      Vector v{};
      for (std::size_t k = 0; k < lanes; ++k) {
        v[k] = from[k];
      }
      return v;
    }
  }

  /// A vector of rows: their columns are held where their number P is known and dY is zero; P = 0: any number, read
  /// anew.
  template <int P, bool Full>
  struct Group {
    const Slabs& slabs;
    std::size_t i, lanes;
    Vector held[P + (P == 0 ? 1 : 0)];

    Group(const Slabs& all, std::size_t first, std::size_t count) : slabs(all), i(first), lanes(count) {
      for (std::size_t j = 0; P > 0 && j < P; ++j) {
        held[j] = take<Full>(slabs.Y[j] + i, lanes);
      }
    }
    [[nodiscard]] std::size_t p() const { return P > 0 ? P : slabs.p; }
    [[nodiscard]] Vector Y(std::size_t j) const {
      if constexpr (P > 0) {
        return held[j];
      } else {
        return take<Full>(slabs.Y[j] + i, lanes);
      }
    }
    [[nodiscard]] bool noisy() const { return P == 0 && slabs.dY != nullptr; }
    [[nodiscard]] Vector dY(std::size_t j) const { return take<Full>(slabs.dY[j] + i, lanes); }
    [[nodiscard]] Vector y() const { return take<Full>(slabs.y + i, lanes); }
    [[nodiscard]] Vector dy() const { return take<Full>(slabs.dy + i, lanes); }
    /// dy + Σ dY_j least_j.
    [[nodiscard]] Vector allowed(const double* least) const {
      Vector sum = dy();
      for (std::size_t j = 0; noisy() && j < p(); ++j) {
        sum += dY(j) * least[j];
      }
      return sum;
    }
    /// |y − Y·c| + Σ|(YT)_k| half_k.
    [[nodiscard]] Vector oblique_reach(const Oblique& box) const {
      Vector residual = y(), reach{};
      for (std::size_t j = 0; j < p(); ++j) {
        residual -= Y(j) * box.centre[j];
      }
      for (std::size_t k = 0; k < p(); ++k) {
        const double* column = box.transform + k * p();
        Vector g = Y(0) * column[0];
        for (std::size_t j = 1; j < p(); ++j) {
          g += Y(j) * column[j];
        }
        reach += magnitude(g) * box.half[k];
      }
      return magnitude(residual) + reach;
    }
  };

  /// Calls `each(group, first, lanes)` for all rows; group() loads them.
  template <int P, class Each>
  static void in_groups(const Slabs& slabs, const Each& each) {
    std::size_t first = 0;
    for (; first + W <= slabs.n; first += W) {
      each([&] { return Group<P, true>(slabs, first, W); }, first, W);
    }
    if (first < slabs.n) {
      const std::size_t rest = slabs.n - first;
      each([&] { return Group<P, false>(slabs, first, rest); }, first, rest);
    }
  }

  static std::size_t report(unsigned over, std::size_t first, std::size_t lanes, std::uint32_t* found) {
    std::size_t count = 0;
    for (std::size_t k = 0; k < lanes; ++k) {
      found[count] = static_cast<std::uint32_t>(first + k);
      count += over >> k & 1U;
    }
    return count;
  }

  template <int P, bool Peaks>
  static std::size_t scan_of(const Slabs& slabs, const double* centre, const double* half, const double* least,
                             const Oblique* oblique, double floor, std::uint32_t* found, double* peaks) {
    std::size_t count = 0;
    Vector top[P + 1] = {};
    in_groups<P>(slabs, [&](const auto& group, std::size_t first, std::size_t lanes) {
      const auto rows = group();
      if (Peaks && P == 0 && first % kStretch == 0) {
        const std::size_t left = slabs.n - first;
        raise(slabs, first, left < kStretch ? left : kStretch, peaks);
      }
      Vector residual = rows.y(), reach{};
      if constexpr (Peaks && P > 0) {
        const Vector y = magnitude(residual);
        top[P] = y > top[P] ? y : top[P];
      }
      for (std::size_t j = 0; j < rows.p(); ++j) {
        const Vector Y = rows.Y(j), size = magnitude(Y);
        residual -= Y * centre[j];
        reach += size * half[j];
        if constexpr (Peaks && P > 0) {
          top[j] = size > top[j] ? size : top[j];
        }
      }
      const Vector allowed = rows.allowed(least);
      Mask over = ~(magnitude(residual) + reach - allowed <= floor);
      if (oblique != nullptr && any(over)) {
        over &= ~(rows.oblique_reach(*oblique) - allowed <= floor);
      }
      if (any(over)) {
        count += report(bits(over), first, lanes, found + count);
      }
    });
    for (std::size_t j = 0; Peaks && P > 0 && j <= P; ++j) {
      for (int k = 0; k < W; ++k) {
        peaks[j] = top[j][k] > peaks[j] ? top[j][k] : peaks[j];
      }
    }
    return count;
  }

  template <int P>
  static std::size_t examine_of(const Slabs& slabs, const Points& at, std::uint32_t* found, unsigned char* open,
                                double* most) {
    std::size_t count = 0;
    Vector largest = all(most != nullptr ? *most : 0.0);
    bool any_of_lanes = false;
    in_groups<P>(slabs, [&](const auto& group, std::size_t first, std::size_t lanes) {
      if (open != nullptr && open[first / kLanes] == 0) {
        return;
      }
      const auto rows = group();
      Vector residual = rows.y(), reach{};
      for (std::size_t j = 0; j < rows.p(); ++j) {
        const Vector Y = rows.Y(j);
        residual -= Y * at.centre[j];
        reach += magnitude(Y) * at.half[j];
      }
      const Vector least = rows.allowed(at.least);
      const Mask beyond = ~(magnitude(residual) + reach <= least);
      const bool matters = any(beyond);
      any_of_lanes = (first % kLanes != 0 && any_of_lanes) || matters;
      if (open != nullptr && ((first + W) % kLanes == 0 || lanes < W)) {
        open[first / kLanes] = any_of_lanes ? 1 : 0;
      }
      if (!matters) {
        return;
      }
      for (std::size_t j = 0; rows.noisy() && j < rows.p(); ++j) {
        reach += rows.dY(j) * at.half[j];
      }
      const Vector ratio = reach / least;
      largest = (beyond & (ratio > largest)) ? ratio : largest;
      Mask over{};
      const Vector y = rows.y(), dy = rows.dy();
      const auto hold = [&](const double* x, Vector e) {
        Vector allowed = dy;
        for (std::size_t j = 0; rows.noisy() && j < rows.p(); ++j) {
          allowed += rows.dY(j) * (x[j] < 0.0 ? -x[j] : x[j]);
        }
        over |= ~(magnitude(e) <= allowed * at.share);
      };
      for (std::size_t k = 0; k < at.count; k += 2) {
        const double* x = at.points + k * rows.p();
        const double* z = k + 1 < at.count ? x + rows.p() : x;
        Vector e = y, f = y;
        for (std::size_t j = 0; j < rows.p(); ++j) {
          const Vector Y = rows.Y(j);
          e -= Y * x[j];
          f -= Y * z[j];
        }
        hold(x, e);
        hold(z, f);
      }
      over &= beyond;
      if (any(over)) {
        count += report(bits(over), first, lanes, found + count);
      }
    });
    for (int k = 0; most != nullptr && k < W; ++k) {
      *most = largest[k] > *most ? largest[k] : *most;
    }
    return count;
  }

  /// Up to how many columns the loops are compiled for their number.
  static constexpr int kFixed = 12;

  template <int P>
  static std::size_t scan_with(const Slabs& slabs, const double* centre, const double* half, const double* least,
                               const Oblique* oblique, double floor, std::uint32_t* found, double* peaks) {
    if constexpr (P > 0) {
      if (slabs.p != P || slabs.dY != nullptr) {
        return scan_with<P - 1>(slabs, centre, half, least, oblique, floor, found, peaks);
      }
    }
    return peaks != nullptr ? scan_of<P, true>(slabs, centre, half, least, oblique, floor, found, peaks)
                            : scan_of<P, false>(slabs, centre, half, least, oblique, floor, found, peaks);
  }

  template <int P>
  static std::size_t examine_with(const Slabs& slabs, const Points& at, std::uint32_t* found, unsigned char* open,
                                  double* most) {
    if constexpr (P > 0) {
      if (slabs.p != P || slabs.dY != nullptr) {
        return examine_with<P - 1>(slabs, at, found, open, most);
      }
    }
    return examine_of<P>(slabs, at, found, open, most);
  }

  static constexpr Table table(const char* name) {
    return {name, &slack, &most_violated, &first_blocking, &scan_with<kFixed>, &examine_with<kFixed>};
  }
};

}  // namespace wheelwright::bounds::kernels
