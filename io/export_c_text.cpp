// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/io/export_c_text.hpp>

namespace wheelwright::c_text {

const std::string_view kCompiler = R"(#include <math.h>
#include <string.h>

#if defined(__FAST_MATH__)
#error "the thresholds are guaranteed bounds: do not compile them with -ffast-math"
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

/* z1' = -beta z1 + u, z2' = -beta z2 + z1. */
typedef struct pfx_cascade {
  double z1, z2;
} pfx_cascade;

/* Weights of one step of the exact discretisation; computed anew only when the step changes. */
typedef struct pfx_weights {
  double step, decay;
  double held1, held2;   /* of a constant input */
  double begin1, begin2; /* of the beginning of a linear input */
  double end1, end2;     /* of its end */
  double slope1, slope2; /* of its increment, for the filter of its derivative */
} pfx_weights;
)";

const std::string_view kWeights =
    R"(static inline void pfx_fill_weights(pfx_weights *w, double h, double decay, double i0, double i1, double i2)
{
  w->step = h;
  w->decay = decay;
  w->held1 = h * i0;
  w->held2 = h * h * i1;
  w->begin1 = h * i1;
  w->begin2 = h * h * i2;
  w->end1 = h * (i0 - i1);
  w->end2 = h * h * (i1 - i2);
  w->slope1 = i0;
  w->slope2 = h * i1;
}

/* Weights of a step of h seconds: the integrals of w^n exp(-x w) over [0, 1], x = beta h, n = 0, 1, 2. */
static inline void pfx_change_step(pfx_weights *w, double h)
{
  const double x = PFX_BETA * h;
  const double decay = exp(-x);
  double i0, i1, i2;
  if (x < 1.0) {
    double term = 1.0, sum = 1.0 / 3.0;
    int k;
    for (k = 1; k <= 18; ++k) {
      term *= -x / k;
      sum += term / (k + 3);
    }
    i2 = sum;
    i1 = 0.5 * (x * i2 + decay);
    i0 = x * i1 + decay;
  } else {
    i0 = (1.0 - decay) / x;
    i1 = (i0 - decay) / x;
    i2 = (2.0 * i1 - decay) / x;
  }
  pfx_fill_weights(w, h, decay, i0, i1, i2);
}
)";

const std::string_view kCascade = R"(/* One step on which the input adds add1 to z1 and add2 to z2. */
static inline void pfx_advance(pfx_cascade *c, const pfx_weights *w, double add1, double add2)
{
  c->z2 = w->decay * (c->z2 + w->step * c->z1) + add2;
  c->z1 = w->decay * c->z1 + add1;
}

/* One step with an input that is linear from begin to end. */
static inline void pfx_linear(pfx_cascade *c, const pfx_weights *w, double begin, double end)
{
  pfx_advance(c, w, w->begin1 * begin + w->end1 * end, w->begin2 * begin + w->end2 * end);
}
)";

const std::string_view kHull = R"(/* Largest a.theta over the interval hull of the feasible set, rounded outward. */
static inline double pfx_support_of_hull(const double *a)
{
  double sum = 0.0, magnitude = 0.0;
  int j, zero = 1;
  for (j = 0; j < PFX_PARAMETERS; ++j) {
    const double low = a[j] * pfx_lower[j], high = a[j] * pfx_upper[j];
    const double term = low < high ? high : low;
    sum += term;
    magnitude += fabs(term);
    zero = zero && a[j] == 0.0;
  }
  return magnitude == 0.0 && zero ? 0.0 : sum + (PFX_HULL_ROUNDING * magnitude + PFX_HULL_UNDERFLOW);
}
)";

const std::string_view kFollow =
    R"(/* Largest a.theta over one group of q parameters: from the vertex that was best last time along edges to the best one, at
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
    R"(/* [lower, upper] of the residual without a fault, for the regressor row y that is wrong by at most dy, and torque that is
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
    if (dy[j] > 0.0 && pfx_lower[j] < 0.0 && pfx_upper[j] > 0.0) {
      extra += dy[j] * pfx_largest[j];
    }
  }
  for (j = 0; j < PFX_PARAMETERS; ++j) {
    direction[j] = y[j] + (pfx_lower[j] >= 0.0 ? dy[j] : pfx_upper[j] <= 0.0 ? -dy[j] : 0.0);
  }
  above = pfx_support(s, direction, (2 * channel) % PFX_SLOTS);
  for (j = 0; j < PFX_PARAMETERS; ++j) {
    direction[j] = -y[j] + (pfx_lower[j] >= 0.0 ? dy[j] : pfx_upper[j] <= 0.0 ? -dy[j] : 0.0);
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

}  // namespace wheelwright::c_text
