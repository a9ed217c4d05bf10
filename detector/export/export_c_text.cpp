// SPDX-License-Identifier: Apache-2.0
#include "detector/export/export_c_text.hpp"

#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "core/check.hpp"
#include "core/words.hpp"

namespace wheelwright::exporter::c_text {

std::string hex(double x) {
  if (std::isinf(x)) {
    return x > 0.0 ? "HUGE_VAL" : "-HUGE_VAL";
  }
  check::finite(x, "a number of the exported detector");
  return fmt::format("{:a}", x);
}

std::string plain(std::string text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kWords = {
      {{"·", "*"}, {"²", "^2"}, {"³", "^3"}, {"Ω", "Ohm"}, {"−", "-"}, {"*/", "* /"}, {"/*", "/ *"}}};
  for (const auto& [from, to] : kWords) {
    core::replace_all(text, from, to);
  }
  for (char& c : text) {
    c = c >= ' ' && c <= '~' ? c : '?';
  }
  return text;
}

std::string combination(const Eigen::MatrixXd& matrix, std::size_t row, const char* x) {
  std::string text;
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    text += (j == 0 ? "" : " + ") + hex(matrix(static_cast<Eigen::Index>(row), j)) + fmt::format(" * {}[{}]", x, j);
  }
  return text;
}

std::string numbers(const Eigen::VectorXd& x) {
  return list(static_cast<std::size_t>(x.size()), [&](std::size_t i) { return hex(x[static_cast<Eigen::Index>(i)]); });
}

std::string numbers(const Eigen::MatrixXd& x) {
  return list(static_cast<std::size_t>(x.rows()),
              [&](std::size_t i) { return numbers(Eigen::VectorXd(x.row(static_cast<Eigen::Index>(i)))); });
}

const std::string_view kCompiler = R"(#include <math.h>
#include <string.h>

#if defined(__FAST_MATH__)
#error "the thresholds are rounded outward: do not compile them with -ffast-math"
#endif
#if defined(__clang__) || !defined(__GNUC__)
#pragma STDC FP_CONTRACT OFF
#endif
)";

const std::string_view kTypes = R"(/* What one channel says at one instant. */
typedef struct pfx_channel {
  double residual;  /* measured minus predicted, both filtered */
  double predicted; /* what the model expects */
  double lower;     /* without a fault the residual is not below this ... */
  double upper;     /* ... and not above this */
  double dead_zone; /* |residual| where it is outside the threshold, else 0 */
  int outside;      /* whether it is */
  int alarm;        /* whether it was often enough (persistence) */
} pfx_channel;

/* What the detector says at one instant. */
typedef struct pfx_decision {
  int valid; /* 0 until the filter has settled: nothing is known yet, all the rest is 0 */
  int fault; /* an alarm stands in some channel */
  pfx_channel channel[PFX_CHANNELS];
} pfx_decision;
)";

const std::string_view kSmoothKernel =
    "/* One filtered signal: sums of impulses with the weights exp(-beta x), x exp(-beta x) and "
    R"(exp(-gamma x), x their age. */
typedef struct pfx_cascade {
  double z1, z2, fast;
} pfx_cascade;

/* Weights of one step; computed anew only when its length changes. */
typedef struct pfx_weights {
  double step, decay, fast;
} pfx_weights;

static inline void pfx_prepare(pfx_weights *w, double h)
{
  if (h != w->step) {
    w->step = h;
    w->decay = exp(-(PFX_BETA * h));
    w->fast = exp(-PFX_GAMMA * h);
  }
}

/* An impulse q, and then a step. */
static inline void pfx_take(pfx_cascade *c, const pfx_weights *w, double q)
{
  c->z1 += q;
  c->z2 = w->decay * (c->z2 + w->step * c->z1);
  c->z1 = w->decay * c->z1;
  c->fast = w->fast * (c->fast + q);
}

/* The filtered signal now. */
static inline double pfx_value(const pfx_cascade *c)
{
  return PFX_GAIN * (PFX_SLOW * c->z2 - PFX_QUICK * (c->z1 - c->fast));
}
)";

const std::string_view kSoftKernel =
    "/* One filtered signal: sums of impulses with the weights exp(-beta x), x exp(-beta x) and "
    R"(exp(-gamma x), x their age. */
typedef struct pfx_cascade {
  double z1, z2, fast, soft;
} pfx_cascade;

/* Weights of one step; computed anew only when its length changes. */
typedef struct pfx_weights {
  double step, decay, fast, soft;
} pfx_weights;

static inline void pfx_prepare(pfx_weights *w, double h)
{
  if (h != w->step) {
    w->step = h;
    w->decay = exp(-(PFX_BETA * h));
    w->fast = exp(-PFX_GAMMA * h);
    w->soft = exp(-PFX_SOFT * h);
  }
}

/* An impulse q, and then a step. */
static inline void pfx_take(pfx_cascade *c, const pfx_weights *w, double q)
{
  c->z1 += q;
  c->z2 = w->decay * (c->z2 + w->step * c->z1);
  c->z1 = w->decay * c->z1;
  c->fast = w->fast * (c->fast + q);
  c->soft = w->soft * (c->soft + q);
}

/* The weights of all impulses so far end here, by and by: soft is what they lose, exp(-PFX_SOFT x) times those now. */
static inline void pfx_cut(pfx_cascade *c)
{
  c->z1 -= c->soft;
  c->fast -= c->soft;
  c->soft = 0.0;
}

/* The filtered signal now. */
static inline double pfx_value(const pfx_cascade *c)
{
  return PFX_GAIN * (PFX_SLOW * c->z2 - PFX_QUICK * (c->z1 - c->fast));
}
)";

const std::string_view kNodeKernel =
    R"(/* One filtered signal: sums of impulses with the weights exp(-beta x) and x exp(-beta x), x their age. */
typedef struct pfx_cascade {
  double z1, z2;
} pfx_cascade;

/* Weights of one step; computed anew only when its length changes. */
typedef struct pfx_weights {
  double step, decay;
} pfx_weights;

static inline void pfx_prepare(pfx_weights *w, double h)
{
  if (h != w->step) {
    w->step = h;
    w->decay = exp(-(PFX_BETA * h));
  }
}

/* An impulse q, and then a step. */
static inline void pfx_take(pfx_cascade *c, const pfx_weights *w, double q)
{
  c->z1 += q;
  c->z2 = w->decay * (c->z2 + w->step * c->z1);
  c->z1 = w->decay * c->z1;
}

/* The filtered signal now. */
static inline double pfx_value(const pfx_cascade *c)
{
  return PFX_GAIN * c->z2;
}
)";

const std::string_view kFirstOrderKernel = R"(/* One filtered signal: z1' = -beta z1 + u. */
typedef struct pfx_cascade {
  double z1;
} pfx_cascade;

/* Weights of one step; computed anew only when its length changes. */
typedef struct pfx_weights {
  double step, decay;
  double increment1; /* of the integral of u over the step */
} pfx_weights;

/* increment1: the integral of exp(-x w) over w in [0, 1], x = beta h. */
static inline void pfx_prepare(pfx_weights *w, double h)
{
  const double x = PFX_BETA * h;
  if (h == w->step) {
    return;
  }
  w->step = h;
  w->decay = exp(-x);
  if (x < 1.0) {
    double term = 1.0, sum = 1.0 / 3.0;
    int k;
    for (k = 1; k <= 18; ++k) {
      term *= -x / k;
      sum += term / (k + 3);
    }
    w->increment1 = x * (0.5 * (x * sum + w->decay)) + w->decay;
  } else {
    w->increment1 = (1.0 - w->decay) / x;
  }
}

/* A step over which the integral of the signal is q. */
static inline void pfx_take(pfx_cascade *c, const pfx_weights *w, double q)
{
  c->z1 = w->decay * c->z1 + w->increment1 * q;
}

/* The filtered signal now. */
static inline double pfx_value(const pfx_cascade *c)
{
  return PFX_GAIN * c->z1;
}
)";

const std::string_view kSpeedKernel = R"(/* One filtered signal: z1' = -beta z1 + u, z2' = -beta z2 + z1. */
typedef struct pfx_cascade {
  double z1, z2;
} pfx_cascade;

/* Weights of one step; computed anew only when its length changes. */
typedef struct pfx_weights {
  double step, decay;
  double increment1, increment2; /* of the integral of u over the step */
} pfx_weights;

/* With the integrals of w^n exp(-x w) over [0, 1], x = beta h, n = 0, 1. */
static inline void pfx_prepare(pfx_weights *w, double h)
{
  const double x = PFX_BETA * h;
  double i1;
  if (h == w->step) {
    return;
  }
  w->step = h;
  w->decay = exp(-x);
  if (x < 1.0) {
    double term = 1.0, sum = 1.0 / 3.0;
    int k;
    for (k = 1; k <= 18; ++k) {
      term *= -x / k;
      sum += term / (k + 3);
    }
    i1 = 0.5 * (x * sum + w->decay);
    w->increment1 = x * i1 + w->decay;
  } else {
    w->increment1 = (1.0 - w->decay) / x;
    i1 = (w->increment1 - w->decay) / x;
  }
  w->increment2 = h * i1;
}

/* A step over which the integral of the signal is q. */
static inline void pfx_take(pfx_cascade *c, const pfx_weights *w, double q)
{
  c->z2 = w->decay * (c->z2 + w->step * c->z1) + w->increment2 * q;
  c->z1 = w->decay * c->z1 + w->increment1 * q;
}

/* The filtered signal now. */
static inline double pfx_value(const pfx_cascade *c)
{
  return PFX_GAIN * c->z2;
}
)";

const std::string_view kFade =
    "/* Numbers that only fade end as denormal ones, for ever, which take a processor many times as long: of `size` "
    R"(bytes of
 * doubles, what is far below all rounding is taken for 0. */
static inline void pfx_fade(void *doubles, size_t size)
{
  char *at = (char *)doubles, *const end = at + size;
  double x;
  for (; at != end; at += sizeof x) {
    memcpy(&x, at, sizeof x);
)";
const std::string_view kFaded = R"(      x = 0.0;
      memcpy(at, &x, sizeof x);
    }
  }
}
)";

const std::string_view kMajorant =
    "/* Sum of impulses with the weight (1 - x + x^2 / 2) exp(-x), x beta times their age: bounds what "
    R"(the slope of the kernel
 * makes of them. */
typedef struct pfx_majorant {
  double s0, s1, s2;
} pfx_majorant;

/* A step with x = beta h, and then an impulse q. */
static inline void pfx_majorant_take(pfx_majorant *m, double decay, double x, double q)
{
  m->s2 = decay * (m->s2 + x * (2.0 * m->s1 + x * m->s0));
  m->s1 = decay * (m->s1 + x * m->s0);
  m->s0 = decay * m->s0 + q;
}

static inline double pfx_majorant_value(const pfx_majorant *m)
{
  return m->s0 - m->s1 + 0.5 * m->s2;
}
)";

const std::string_view kHull = R"(/* Largest a.theta over the interval hull of a set, rounded outward. */
static inline double pfx_support_of_hull(const double *lower, const double *upper, const double *a)
{
  double sum = 0.0, magnitude = 0.0;
  int j, zero = 1;
  for (j = 0; j < PFX_PARAMETERS; ++j) {
    const double low = a[j] * lower[j], high = a[j] * upper[j];
    const double term = low < high ? high : low;
    sum += term;
    magnitude += fabs(term);
    zero = zero && a[j] == 0.0;
  }
  return magnitude == 0.0 && zero ? 0.0 : sum + (PFX_HULL_ROUNDING * magnitude + PFX_HULL_UNDERFLOW);
}
)";

const std::string_view kFollow =
    "/* Largest a.theta over one group of q parameters: from the vertex that was best last time along "
    R"(edges to the best one, at
 * most PFX_EDGES of them. A vertex has q * q multipliers per unit of a, then its place, its doubt, what a
 * negative multiplier costs, and how steep its edges are (q numbers each). Wherever the walk ends the bound holds. */
static inline void pfx_follow(const double *numbers, const unsigned short *next, const unsigned char *index,
                              const double *half, int q, const double *direction, unsigned short *place,
                              double *value, double *magnitude, double *slack)
{
  const int stride = q * q + 4 * q;
  double a[PFX_LARGEST_GROUP], mu[PFX_LARGEST_GROUP];
  double size = 0.0, sum = 0.0, product = 0.0;
  const double *at;
  int left, k, r;
  for (k = 0; k < q; ++k) {
    a[k] = direction[index[k]];
    sum += fabs(a[k]);
    size += fabs(a[k]) * half[k];
  }
  if (sum == 0.0) {
    return;
  }
  for (left = PFX_EDGES;; --left) {
    const double *penalty, *weight;
    double cost = 0.0, steepest = 0.0;
    int leaving = 0;
    at = numbers + (long)*place * stride;
    penalty = at + q * q + 2 * q;
    weight = penalty + q;
    for (r = 0; r < q; ++r) {
      mu[r] = at[r] * a[0];
    }
    for (k = 1; k < q; ++k) {
      for (r = 0; r < q; ++r) {
        mu[r] += at[k * q + r] * a[k];
      }
    }
    for (r = 0; r < q; ++r) {
      if (mu[r] < 0.0) {
        cost -= mu[r] * penalty[r];
        if (mu[r] * weight[r] < steepest) {
          steepest = mu[r] * weight[r];
          leaving = r;
        }
      }
    }
    if (cost <= PFX_TIGHT * size || left == 0) {
      *slack += cost;
      break;
    }
    *place = next[(long)*place * q + leaving];
  }
  for (k = 0; k < q; ++k) {
    product += a[k] * at[q * q + k];
    *slack += fabs(a[k]) * at[q * q + q + k];
  }
  *value += product;
  *magnitude += fabs(product);
}
)";

const std::string_view kThreshold =
    "/* [lower, upper] of the residual without a fault, for the regressor row y that is wrong by at most "
    R"(dy, and torque that is
 * wrong by at most output; rounded outward. */
static inline void pfx_threshold(pfx_state *s, const double *y, const double *dy, double output, int channel,
                                 double *lower, double *upper)
{
  double direction[PFX_PARAMETERS];
  double extra = output, predicted = 0.0, magnitude = output, reach = 0.0, above, below, rounding;
  int j;
  for (j = 0; j < PFX_PARAMETERS; ++j) {
    const double term = y[j] * pfx_estimate[j];
    predicted += term;
    magnitude += fabs(term);
    reach += (fabs(y[j]) + dy[j]) * pfx_largest[j];
    if (dy[j] > 0.0 && pfx_sign[j] == 0.0) {
      extra += dy[j] * pfx_largest[j];
    }
  }
  for (j = 0; j < PFX_PARAMETERS; ++j) {
    direction[j] = y[j] + pfx_sign[j] * dy[j];
  }
  above = pfx_support(s, direction, (2 * channel) % PFX_SLOTS);
  for (j = 0; j < PFX_PARAMETERS; ++j) {
    direction[j] = -y[j] + pfx_sign[j] * dy[j];
  }
  below = pfx_support(s, direction, (2 * channel + 1) % PFX_SLOTS);
  magnitude += extra + 2.0 * reach;
  rounding = PFX_ROUNDING * magnitude;
  *lower = -below - predicted - extra - rounding;
  *upper = above - predicted + extra + rounding;
}
)";

const std::string_view kPersistence =
    R"(/* Whether at least PFX_PERSISTENCE_K of the last PFX_PERSISTENCE_N instants were outside. */
static inline int pfx_persistent(unsigned long long *window, int outside)
{
  unsigned long long left;
  int count = 0;
  *window = (*window << 1) | (unsigned long long)outside;
  for (left = *window & PFX_PERSISTENCE_MASK; left != 0; left &= left - 1) {
    ++count;
  }
  return count >= PFX_PERSISTENCE_K;
}
)";

}  // namespace wheelwright::exporter::c_text
