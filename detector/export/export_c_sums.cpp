// SPDX-License-Identifier: Apache-2.0
#include "detector/export/export_c_sums.hpp"

#include <cmath>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "detector/export/export_c_text.hpp"
#include "detector/multiscale/sum_kernel.hpp"

namespace wheelwright::exporter::c_text {
namespace {

// Of detector/multiscale/scale_detector.cpp.
constexpr double kRoundings = 1e-10;
constexpr double kAlike = 1e-12;
constexpr double kRise = 1.0;

using filter::PredictableRegressor;

std::string numbers_of(const std::vector<double>& x) {
  return list(x.size(), [&](std::size_t k) { return hex(x[k]); });
}

template <typename... Arguments>
std::string line(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  return fmt::format(format, std::forward<Arguments>(arguments)...) + "\n";
}

constexpr std::string_view kBegin = R"(
/* A segment begins: sums are empty. */
static inline void pfx_sums_begin(pfx_sums *s)
{
  int i, k;
  s->oldest = s->waiting_count = 0;
  memset(s->stage, 0, sizeof s->stage);
  memset(s->foreseen, 0, sizeof s->foreseen);
  memset(s->g, 0, sizeof s->g);
  memset(s->g1, 0, sizeof s->g1);
  memset(s->c, 0, sizeof s->c);
  memset(s->c1, 0, sizeof s->c1);
  memset(s->c2, 0, sizeof s->c2);
  memset(s->efforts1, 0, sizeof s->efforts1);
  for (i = 0; i < 4; ++i) {
    s->steps[i] = s->elements.span[s->elements.newest].length;
  }
  for (k = 0; k < PFX_SCALES; ++k) {
    s->scale[k].since = s->scale[k].samples = 0.0;
    memset(&s->scale[k].sum, 0, sizeof s->scale[k].sum);
  }
  s->fading = 0;
}
)";

constexpr std::string_view kForesee = R"(
/* The regressor as it is foreseen, from elements that are old enough: a low-pass filter, led by its own delay. */
static inline void pfx_foresee(pfx_sums *s, const pfx_element *e)
{
  pfx_waiting *next;
  int i, j, k;
  while (s->waiting_count >= PFX_LAG) {
    const pfx_waiting *first = &s->waiting[s->oldest];
    const pfx_waiting *lag = &s->waiting[(s->oldest + s->waiting_count - PFX_LAG) % PFX_WAITING];
    double forgotten;
    if (first->t > lag->t - PFX_CORRELATION) {
      break;
    }
    forgotten = -expm1(-PFX_STAGE_BETA * first->length);
    for (i = 0; i < PFX_CHANNELS; ++i) {
      for (j = 0; j < PFX_PARAMETERS; ++j) {
        s->stage[0][i][j] += forgotten * (first->y[i][j] / first->length - s->stage[0][i][j]);
        for (k = 1; k < PFX_STAGES; ++k) {
          s->stage[k][i][j] += forgotten * (s->stage[k - 1][i][j] - s->stage[k][i][j]);
        }
      }
    }
    s->oldest = (s->oldest + 1) % PFX_WAITING;
    --s->waiting_count;
  }
  for (i = 0; i < PFX_CHANNELS; ++i) {
    for (j = 0; j < PFX_PARAMETERS; ++j) {
      const double last = s->stage[PFX_STAGES - 1][i][j];
      s->foreseen[i][j] = last + PFX_LEAD * (s->stage[PFX_STAGES - 2][i][j] - last);
    }
  }
  if (LEFT_OUT) { /* steps are shorter than they were said to be LOST*/
    return;
  }
  next = &s->waiting[(s->oldest + s->waiting_count) % PFX_WAITING];
  next->t = e->t;
  next->length = e->length;
  pfx_regressor(e, next->y);
  ++s->waiting_count;
}
)";

constexpr std::string_view kWeigh = R"(
/* Weights of the newest element. */
static inline void pfx_weigh(pfx_sums *s, const pfx_element *e)
{
  const double since = (e->t - s->elements.t0) / PFX_RISE, share = 1.0 < since ? 1.0 : since;
  const double rise = share * share * (3.0 - 2.0 * share);
  double torque[PFX_CHANNELS];
  int i, j, k;
  memcpy(s->g1, s->g, sizeof s->g);
  memcpy(s->c2, s->c1, sizeof s->c);
  memcpy(s->c1, s->c, sizeof s->c);
  for (i = 0; i < PFX_CHANNELS; ++i) {
    torque[i] = s->foreseen[i][0] * pfx_theta[0];
    for (j = 1; j < PFX_PARAMETERS; ++j) {
      torque[i] += s->foreseen[i][j] * pfx_theta[j];
    }
  }
  for (j = 0; j < PFX_JOINTS; ++j) {
    const double effort = pfx_to_joint(j, torque);
    for (i = 0; i < PFX_CHANNELS; ++i) {
      s->g[i][2 * j] = rise * pfx_to_joints[j][i];
      s->g[i][2 * j + 1] = effort * pfx_to_joints[j][i];
    }
  }
  for (j = 0; j < PFX_PARAMETERS; ++j) {
    for (i = 0; i < PFX_CHANNELS; ++i) {
      double sum = pfx_inverse[i][0] * s->foreseen[0][j];
      for (k = 1; k < PFX_CHANNELS; ++k) {
        sum += pfx_inverse[i][k] * s->foreseen[k][j];
      }
      s->g[i][2 * PFX_JOINTS + j] = pfx_theta[j] * sum;
    }
  }
  for (i = 0; i < PFX_CHANNELS; ++i) {
    pfx_weighted(s, pfx_slope_gain[i], s->c[i]);
  }
)";

// averaged_radius().
constexpr std::string_view kRadius = R"(
/* What errors that average out may add up to: v is the sum of their variances for small multiples, all for any. */
static inline double pfx_averaged(double v, double all, double usual, int k)
{
  double by_risk = pfx_cost[k] / (usual * PFX_FIRST_MULTIPLE), by_variance = 0.5 * usual * PFX_FIRST_MULTIPLE;
  double least = HUGE_VAL;
  int i;
  for (i = 0; i < PFX_MULTIPLES; ++i) {
    const double bound = by_risk + by_variance * (i <= PFX_USUAL_MULTIPLE ? v : all);
    least = bound < least ? bound : least;
    by_risk *= 0.5;
    by_variance *= 2.0;
  }
  return least;
}
)";

constexpr std::string_view kInterface = R"(
/* Forgets all samples: the next one starts a segment. */
static inline void pfx_sums_restart(pfx_sums *s)
{
  s->started = 0;
  pfx_forget(&s->elements);
  s->looks = s->alarm = 0;
}

/* To be called once, before all else. */
static inline void pfx_sums_init(pfx_sums *s)
{
  int k;
  memset(s, 0, sizeof *s);
  for (k = 0; k < PFX_SCALES; ++k) {
    s->scale[k].decay = 1.0;
  }
  pfx_sums_restart(s);
}
)";

}  // namespace

SumsWriter::SumsWriter(const detector::ScaleDetector& sums, const FilterWriter& elements)
    : sums_(sums),
      elements_(elements),
      risk_(sums.risk()),
      model_(sums.elements().model()),
      constants_(sums.constants()),
      varied_(constants_.averages && constants_.effort.deviation < constants_.effort.bound),
      polytope_(sums.rule().kind() == detector::ParameterSetKind::polytope) {}

std::string SumsWriter::words() const {
  std::string text;
  text += line(
      " * Beside that one there is the detector at a stated risk: sums of what the model leaves, over {} scales of",
      risk_.scales.size());
  text += line(
      " * {:g} to {:g} s, where errors of efforts average out. It is expected to raise {:.3g} false alarms a second.",
      risk_.scales.front(), risk_.scales.back(), sums_.options().false_alarms);
  text += line(" * It asks for a state of its own, and is used alike, with the same samples:");
  text += line(" *");
  text += line(" *   pfx_sums sums;");
  text += line(" *   pfx_sums_init(&sums);");
  text += line(" *   ...");
  text += line(" *     if (pfx_sums_step(&sums, t, sample)) look at sums.look[0] to sums.look[sums.looks - 1];");
  text += line(" *     if (sums.alarm) stop();");
  text += line(" *");
  text += line(" * Its parameters are in {}{}.", polytope_ ? "the set" : "the box of the set",
               fmt::format(" at a risk of {:g}", risk_.risk));
  for (std::size_t q = 0; q < model_.p(); ++q) {
    const Interval& side = risk_.box.sides[q];
    text += line(" *   {}: {} in [{:.6g}, {:.6g}]", q, plain(model_.parameters[q].name), side.lower, side.upper);
  }
  text += line(" * Sums:");
  for (std::size_t w = 0; w < sums_.weights().size(); ++w) {
    text += line(" *   {}: {}", w, plain(sums_.weights()[w].name));
  }
  return text;
}

std::string SumsWriter::constants() const {
  const PredictableRegressor& foreseen = sums_.foreseen();
  std::string text;
  text += line("#define PFX_SUMS {}         /* sums over each scale */", sums_.weights().size());
  text += line("#define PFX_SCALES {}", risk_.scales.size());
  text += line("#define PFX_CHECKS {} /* looks at a sum, in the time of its scale */", hex(sums_.options().checks));
  text += line("#define PFX_LAG {}          /* elements between the newest and those that foresee it */",
               PredictableRegressor::kLag);
  text += line("#define PFX_STAGES {}", PredictableRegressor::kOrder);
  text += line("#define PFX_WAITING {}", foreseen.room());
  text += line("#define PFX_STAGE_BETA {} /* 1/s */", hex(foreseen.beta()));
  text += line("#define PFX_LEAD {}", hex(foreseen.lead() * foreseen.beta()));
  text += line("#define PFX_CORRELATION {} /* s, of the errors */", hex(foreseen.correlation()));
  text += line("#define PFX_ALIKE {} /* steps whose decays are not computed anew */", hex(kAlike));
  text +=
      line("#define PFX_MULTIPLES {}    /* at which errors that average out are bounded, each twice the one before */",
           detector::kMultiples);
  text += line("#define PFX_USUAL_MULTIPLE {} /* the last for which small variances hold */", detector::kUsualMultiple);
  text += line("#define PFX_FIRST_MULTIPLE {} /* of the usual one */", hex(detector::kFirstMultiple));
  text += line("#define PFX_RISE {} /* s, in which weights rise at a segment's start */", hex(kRise));
  return text;
}

std::string SumsWriter::types() const {
  std::string text = R"(
/* A sum that was looked at. */
typedef struct pfx_look {
  int sum, scale;   /* which */
  double value;     /* weighted sum of what the model leaves */
  double threshold; /* of a healthy robot |value| is below; of a sum that is far inside, by the set's box */
  double excess;    /* by which it stands outside: > 0 is an alarm */
  double c0, c1;    /* by c0 a fault of size 1 would have moved it, had it always been there; (c0 + c1 x) exp(-x) of it
                       remain after x scales */
} pfx_look;

/* An element that is not yet old enough. */
typedef struct pfx_waiting {
  double t, length, y[PFX_CHANNELS][PFX_PARAMETERS];
} pfx_waiting;

/* Polynomials of age / scale, times exp(-age / scale), of every sum. */
typedef struct pfx_sum {
  double y0[PFX_SUMS], y1[PFX_SUMS]; /* effort */
  double p0[PFX_PARAMETERS][PFX_SUMS], p1[PFX_PARAMETERS][PFX_SUMS]; /* regressor */
  double r0[PFX_SUMS], r1[PFX_SUMS]; /* what a fault adds */
  double l0[PFX_SUMS], l1[PFX_SUMS]; /* what errors add at worst */
  VARIEDdouble q0[PFX_SUMS], q1[PFX_SUMS], q2[PFX_SUMS]; /* variance of the efforts' errors */
  double u0[PFX_SUMS], u1[PFX_SUMS], u2[PFX_SUMS]; /* squares of the weights of errors of the motion */
} pfx_sum;

typedef struct pfx_scale {
  double decay, delta; /* of the last step */
  double since;        /* s, the last look */
  double samples;      /* that are in the sums */
  pfx_sum sum;
} pfx_scale;

/* What the detector at a stated risk remembers; all of it is set by pfx_sums_init. */
typedef struct pfx_sums {
  int looks, alarm;                         /* sums that were looked at with the last sample; one of them is outside */
  pfx_look look[PFX_SUMS * PFX_SCALES];     /* those */
  int started;                              /* a sample was seen */
  pfx_elements elements;
  int oldest, waiting_count;
  pfx_waiting waiting[PFX_WAITING];
  double stage[PFX_STAGES][PFX_CHANNELS][PFX_PARAMETERS], foreseen[PFX_CHANNELS][PFX_PARAMETERS];
  double g[PFX_CHANNELS][PFX_SUMS], g1[PFX_CHANNELS][PFX_SUMS]; /* weights of the last two elements */
  double c[PFX_CHANNELS][PFX_SUMS], c1[PFX_CHANNELS][PFX_SUMS], c2[PFX_CHANNELS][PFX_SUMS]; /* and of slopes */
  double efforts1[PFX_SUMS];                /* squares of the weights of efforts, of the element before */
  double steps[4];                          /* the newest last, s */
  int fading;                               /* elements since pfx_fade */
  pfx_scale scale[PFX_SCALES];
)";
  constexpr std::string_view kVaried = "VARIED";
  text.replace(text.find(kVaried), kVaried.size(),
               varied_
                   ? "double v0[PFX_SUMS], v1[PFX_SUMS], v2[PFX_SUMS]; /* variance of the efforts' errors, for small "
                     "multiples */\n  "
                   : "");
  if (elements_.nodes()) {
    text += line("  double before; /* s, the step before the newest element */");
  }
  if (elements_.bridged()) {
    text += line("  double cut[PFX_SUMS]; /* what leaving the newest element out adds to errors */");
  }
  if (polytope_ && !sums_.rule().table()->graphs().empty()) {
    text += line("  unsigned short place[{}][PFX_RISK_SLOTS]; /* the vertex that was best last time */",
                 sums_.rule().table()->graphs().size());
  }
  return text + "} pfx_sums;\n";
}

std::string SumsWriter::tables() const {
  const Eigen::VectorXd& theta = sums_.rule().estimate();
  std::string text =
      "\n/* Numbers of the sums: scales (s), risk of a look, parameters, what errors are multiplied by. */\n";
  text += line("static const double pfx_scale_time[PFX_SCALES] = {};", numbers_of(risk_.scales));
  text += line("static const double pfx_cost[PFX_SCALES] = {};", numbers_of(constants_.cost));
  if (varied_) {
    text += line("static const double pfx_reach[PFX_SCALES][PFX_SUMS] = {};",
                 numbers(Eigen::MatrixXd(detector::SumKernel::kLargest * constants_.usual.transpose())));
  }
  text += line("static const double pfx_usual[PFX_SCALES][PFX_SUMS] = {};",
               numbers(Eigen::MatrixXd(constants_.usual.transpose())));
  text += line("static const double pfx_theta[PFX_PARAMETERS] = {};", numbers(theta));
  text += line("static const double pfx_rounded[PFX_PARAMETERS] = {}; /* |theta| at most, times a rounding */",
               numbers(Eigen::VectorXd(kRoundings * constants_.largest)));
  if (!sums_.options().exact_thresholds) {
    text += line("static const double pfx_risk_half[PFX_PARAMETERS] = {};", numbers(constants_.half));
  }
  text += line("static const double pfx_inverse[PFX_CHANNELS][PFX_CHANNELS] = {};", numbers(constants_.inverse));
  text += line("static const double pfx_to_joints[PFX_JOINTS][PFX_CHANNELS] = {};", numbers(constants_.to_joints));
  text += line("static const double pfx_from_joints[PFX_JOINTS][PFX_CHANNELS] = {};",
               numbers(Eigen::MatrixXd(model_.input.transpose())));
  text += line("static const double pfx_slope_gain[PFX_CHANNELS][PFX_CHANNELS] = {};", numbers(constants_.slope_gain));
  return text;
}

std::string SumsWriter::foresee() const {
  std::string text(kForesee);
  const auto put = [&](std::string_view name, std::string_view by) { text.replace(text.find(name), name.size(), by); };
  const bool bridged = elements_.bridged();
  put("LEFT_OUT", bridged ? "s->waiting_count == PFX_WAITING || !e->known" : "s->waiting_count == PFX_WAITING");
  put("LOST", bridged ? "or nothing is known of it " : "");
  return elements_.regressor() + std::string(kBegin) + text;
}

std::string SumsWriter::weigh() const {
  return R"(
/* Output by output, times the weights of the newest element, added up for every sum. */
static inline void pfx_weighted(const pfx_sums *s, const double *output, double *sum)
{
  int i, w;
  for (w = 0; w < PFX_SUMS; ++w) {
    sum[w] = output[0] * s->g[0][w];
  }
  for (i = 1; i < PFX_CHANNELS; ++i) {
    for (w = 0; w < PFX_SUMS; ++w) {
      sum[w] += output[i] * s->g[i][w];
    }
  }
}

/* From channels to joint j. */
static inline double pfx_to_joint(int j, const double *channel)
{
  double sum = pfx_to_joints[j][0] * channel[0];
  int i;
  for (i = 1; i < PFX_CHANNELS; ++i) {
    sum += pfx_to_joints[j][i] * channel[i];
  }
  return sum;
}
)" + std::string(kWeigh) +
         left_out() + "}\n";
}

// Lines of pfx_weigh: an element that is not known is taken away from a sum that is smooth.
std::string SumsWriter::left_out() const {
  if (!elements_.bridged()) {
    return "";
  }
  const double size = 2.0 * risk_.errors.motion.bound * std::sqrt(static_cast<double>(model_.joints.size()));
  std::string text = "  memset(s->cut, 0, sizeof s->cut);\n  if (!e->known) {\n";
  text +=
      line("    const double by = {}{};", hex(size), elements_.nodes() ? " * (1.0 / e->before + 1.0 / e->step)" : "");
  text += R"(    for (j = 0; j < PFX_SUMS; ++j) {
      double sum = s->c[0][j] * s->c[0][j];
      for (i = 1; i < PFX_CHANNELS; ++i) {
        sum += s->c[i][j] * s->c[i][j];
      }
      s->cut[j] = by * sqrt(sum);
    }
    memset(s->g, 0, sizeof s->g);
  }
)";
  return text;
}

// Lines of pfx_sums_take: what stands beside a sum for certain.
std::string SumsWriter::worst() const {
  const bool nodes = elements_.nodes();
  const double effort = constants_.averages ? risk_.errors.effort.bias : risk_.errors.effort.bound;
  std::string text;
  const auto each = [&](const std::string& body) { text += "  for (w = 0; w < PFX_SUMS; ++w) {\n" + body + "  }\n"; };
  each(fmt::format("    straight[w] = {} * fabs(residual[w]){};\n    turning[w] = efforts[w] = 0.0;\n", hex(kRoundings),
                   elements_.bridged() ? " + s->cut[w]" : ""));
  text += "  for (j = 0; j < PFX_PARAMETERS; ++j) {\n    for (w = 0; w < PFX_SUMS; ++w) {\n";
  text += "      straight[w] += pfx_rounded[j] * fabs(rows[j][w]);\n    }\n  }\n";
  text += "  for (j = 0; j < PFX_JOINTS; ++j) {\n    for (w = 0; w < PFX_SUMS; ++w) {\n";
  text += line("      straight[w] += {} * e->length * fabs(joint[j][w]);", hex(effort));
  text += "      efforts[w] += joint[j][w] * joint[j][w];\n    }\n  }\n";
  for (std::size_t i = 0; i < model_.n(); ++i) {
    const std::string doubted = elements_.doubted() ? fmt::format("e->torque_doubt[{}]", i) : "";
    const double gain = constants_.speed_gain[static_cast<Eigen::Index>(i)];
    std::string doubt = doubted;
    if (!nodes && gain > 0.0) {
      doubt += (doubted.empty() ? "" : " + ") +
               fmt::format("{} * e->length * {}", hex(gain), hex(risk_.errors.motion.bound));
    }
    if (!doubt.empty()) {
      text += line("  by = {};", doubt);
      each(fmt::format("    straight[w] += by * fabs(s->g[{}][w]);\n", i));
    }
  }
  const auto bent = [&](std::size_t i) {
    each(
        fmt::format("    straight[w] += by * fabs(s->g[{0}][w] - s->g1[{0}][w]);\n"
                    "    turning[w] += by * fabs(s->g1[{0}][w]);\n",
                    i));
  };
  std::size_t function = 0;
  for (const Term& term : model_.terms) {
    const double theta = constants_.largest[static_cast<Eigen::Index>(term.parameter)];
    if (term.kind == Term::Kind::function) {
      text += line("  by = {} * e->term_error[{}];", hex(theta), function++);
      each(fmt::format("    straight[w] += by * fabs(s->g[{}][w]);\n", term.output));
    } else if (term.kind == Term::Kind::speed && elements_.moving() && !nodes) {
      text += line("  by = {} * e->motion_doubt[{}];", hex(theta * std::abs(term.scale)), term.coordinate);
      each(fmt::format("    straight[w] += by * fabs(s->g[{}][w]);\n", term.output));
    } else if (term.kind == Term::Kind::speed && elements_.moving()) {
      text += line("  by = {} * e->motion_doubt_before[{}] / e->before;", hex(theta * std::abs(term.scale)),
                   term.coordinate);
      bent(term.output);
    }
  }
  if (nodes) {
    for (std::size_t i = 0; i < model_.n(); ++i) {
      text += line("  by = {};", hex(constants_.speed_gain[static_cast<Eigen::Index>(i)] * risk_.errors.motion.bound));
      bent(i);
    }
  }
  return text;
}

std::string SumsWriter::take() const {
  const bool nodes = elements_.nodes();
  const filter::SampleClass& effort = constants_.effort;
  const double least = varied_ ? effort.multiplicity * effort.deviation * effort.deviation : constants_.square;
  std::string text = R"(
/* Adds the newest element to all sums. */
static inline void pfx_sums_take(pfx_sums *s, const pfx_element *e)
{
  double y[PFX_CHANNELS][PFX_PARAMETERS], column[PFX_CHANNELS];
  double rows[PFX_PARAMETERS][PFX_SUMS], residual[PFX_SUMS], joint[PFX_JOINTS][PFX_SUMS], response[PFX_SUMS];
  double straight[PFX_SUMS], turning[PFX_SUMS], efforts[PFX_SUMS], square[PFX_SUMS];
  double BYlongest, h, length;
  int i, j, k, w;
  pfx_regressor(e, y);
  for (j = 0; j < PFX_PARAMETERS; ++j) {
    for (i = 0; i < PFX_CHANNELS; ++i) {
      column[i] = y[i][j];
    }
    pfx_weighted(s, column, rows[j]);
  }
  pfx_weighted(s, e->torque, residual);
  for (j = 0; j < PFX_JOINTS; ++j) {
    pfx_weighted(s, pfx_from_joints[j], joint[j]);
  }
)";
  const std::string beside = worst();
  text.replace(text.find("BY"), 2, beside.find("by = ") != std::string::npos ? "by, " : "");
  text += beside;
  text += R"(  for (j = 0; j < PFX_JOINTS; ++j) {
    response[2 * j] = joint[j][2 * j] * e->length;
    response[2 * j + 1] = joint[j][2 * j + 1] * pfx_to_joint(j, e->torque);
  }
  for (j = 0; j < PFX_PARAMETERS; ++j) {
    response[2 * PFX_JOINTS + j] = rows[j][2 * PFX_JOINTS + j] * pfx_theta[j];
  }
  for (i = 0; i < 3; ++i) {
    s->steps[i] = s->steps[i + 1];
  }
  s->steps[3] = e->step;
  longest = s->steps[0];
  for (i = 1; i < 4; ++i) {
    longest = longest < s->steps[i] ? s->steps[i] : longest;
  }
)";
  text += line("  h = {};", nodes ? "e->before" : "e->step");
  text += line("  length = {} * longest;", nodes ? "0.5 * (s->steps[1] + s->steps[2])" : "s->steps[2]");
  if (varied_) {
    text += "  for (w = 0; w < PFX_SUMS; ++w) {\n";
    text += line("    spread[w] = {} * longest * sqrt(s->efforts1[w]);",
                 hex(effort.multiplicity * (effort.bound + effort.bias) / 3.0));
    text += "  }\n";
    text.replace(text.find("square[PFX_SUMS];"), 17, "square[PFX_SUMS], small[PFX_SUMS], spread[PFX_SUMS];");
  }
  text += "  for (w = 0; w < PFX_SUMS; ++w) {\n";
  text += line("    square[w] = length * {} * s->efforts1[w];", hex(constants_.square));
  text += "  }\n";
  text += R"(  for (k = 0; k < PFX_SCALES; ++k) {
    pfx_scale *scale = &s->scale[k];
    pfx_sum *m = &scale->sum;
    const double x = h / pfx_scale_time[k], decay_before = scale->decay;
    double d, dd;
    if (fabs(x - scale->delta) > PFX_ALIKE * x) {
      scale->delta = x;
      scale->decay = exp(-x);
    }
    d = scale->decay;
    dd = d * d;
    for (w = 0; w < PFX_SUMS; ++w) {
      m->y0[w] = d * (m->y0[w] + x * m->y1[w]);
      m->y1[w] = d * m->y1[w] + residual[w];
      m->r0[w] = d * (m->r0[w] + x * m->r1[w]);
      m->r1[w] = d * m->r1[w] + response[w];
    }
    for (j = 0; j < PFX_PARAMETERS; ++j) {
      for (w = 0; w < PFX_SUMS; ++w) {
        m->p0[j][w] = d * (m->p0[j][w] + x * m->p1[j][w]);
        m->p1[j][w] = d * m->p1[j][w] + rows[j][w];
      }
    }
    for (w = 0; w < PFX_SUMS; ++w) {
      m->l0[w] = d * (m->l0[w] + x * m->l1[w]) + x * turning[w];
      m->l1[w] = d * m->l1[w] + straight[w] + x * turning[w];
    }
)";
  if (varied_) {
    text += "    for (w = 0; w < PFX_SUMS; ++w) {\n";
    text += "      const double left = 1.0 - pfx_reach[k][w] * spread[w];\n";
    text += line("      small[w] = length * {0} * s->efforts1[w] / (left < {1} ? {1} : left);", hex(least),
                 hex(least / constants_.square));
    text += R"(    }
    for (w = 0; w < PFX_SUMS; ++w) {
      const double v2 = m->v2[w] + small[w];
      m->v0[w] = dd * (m->v0[w] + x * m->v1[w] + x * x * v2);
      m->v1[w] = dd * (m->v1[w] + 2.0 * x * v2);
      m->v2[w] = dd * v2;
    }
)";
  }
  text += R"(    for (w = 0; w < PFX_SUMS; ++w) {
      const double q2 = m->q2[w] + square[w];
      m->q0[w] = dd * (m->q0[w] + x * m->q1[w] + x * x * q2);
      m->q1[w] = dd * (m->q1[w] + 2.0 * x * q2);
      m->q2[w] = dd * q2;
      m->u0[w] = d * (m->u0[w] + x * m->u1[w] + x * x * m->u2[w]);
      m->u1[w] = d * (m->u1[w] + 2.0 * x * m->u2[w]);
      m->u2[w] = d * m->u2[w];
    }
    {
)";
  if (nodes) {
    text += R"(      const double d2 = decay_before * d, x2 = (h + s->steps[1]) / pfx_scale_time[k];
      const double before = 1.0 / s->steps[1], after = 1.0 / h, middle = -(before + after);
      const double f2 = before * d2, f1 = middle * d, h2 = before * d2 * x2, h1 = middle * d * x;
      for (i = 0; i < PFX_CHANNELS; ++i) {
        for (w = 0; w < PFX_SUMS; ++w) {
          const double a1 = f2 * s->c2[i][w] + f1 * s->c1[i][w] + after * s->c[i][w];
          const double a0 = h2 * s->c2[i][w] + h1 * s->c1[i][w];
)";
  } else {
    text += R"(      const double h1 = d * x;
      for (i = 0; i < PFX_CHANNELS; ++i) {
        for (w = 0; w < PFX_SUMS; ++w) {
          const double a1 = d * s->c1[i][w] - s->c[i][w];
          const double a0 = h1 * s->c1[i][w];
)";
    constexpr std::string_view kBefore = ", decay_before = scale->decay";
    text.replace(text.find(kBefore), kBefore.size(), "");
  }
  text += R"(          m->u0[w] += a0 * a0;
          m->u1[w] += 2.0 * a0 * a1;
          m->u2[w] += a1 * a1;
        }
      }
    }
    scale->samples = d * scale->samples + 1.0;
    scale->since += h;
  }
  memcpy(s->efforts1, efforts, sizeof efforts);
}
)";
  return text;
}

std::string SumsWriter::look() const {
  std::string text(kRadius);
  text += R"(
/* Looks at the sums over scale k. */
static inline void pfx_sums_look(pfx_sums *s, int k)
{
  const pfx_scale *scale = &s->scale[k];
  const pfx_sum *m = &scale->sum;
  double direction[PFX_PARAMETERS], opposite[PFX_PARAMETERS];
)";
  text += line("  int {}j, w;", elements_.nodes() ? "i, " : "");
  if (elements_.nodes()) {
    text += line("  const double last = scale->delta * scale->decay / s->before;");
  }
  text += R"(  for (w = 0; w < PFX_SUMS; ++w) {
    pfx_look *look = &s->look[s->looks++];
    const double all = 0.0 < m->q0[w] ? m->q0[w] : 0.0, u = 0.0 < m->u0[w] ? m->u0[w] : 0.0;
)";
  text += line("    const double v = {};", varied_ ? "0.0 < m->v0[w] ? m->v0[w] : 0.0" : "all");
  text += R"(    const double averaged = all > 0.0 ? pfx_averaged(v, all, pfx_usual[k][w], k) : 0.0;
    double predicted = 0.0, newest, angles, radius, below, above, up, down;
    for (j = 0; j < PFX_PARAMETERS; ++j) {
      direction[j] = m->p0[j][w];
      predicted += direction[j] * pfx_theta[j];
    }
)";
  if (elements_.nodes()) {
    text += R"(    newest = s->c1[0][w] * s->c1[0][w];
    for (i = 1; i < PFX_CHANNELS; ++i) {
      newest += s->c1[i][w] * s->c1[i][w];
    }
    newest = last * sqrt(newest);
)";
  } else {
    text += "    newest = 0.0;\n";
  }
  text += line("    angles = {} * {} * (sqrt((scale->samples + 2.0) * u) + newest);", hex(risk_.errors.motion.bound),
               hex(std::sqrt(static_cast<double>(model_.joints.size()))));
  text += line("    radius = (m->l0[w] + angles + averaged) * {};", hex(1.0 + kRoundings));
  text += R"(    look->sum = w;
    look->scale = k;
    look->value = m->y0[w] - predicted;
    look->c0 = m->r0[w];
    look->c1 = m->r1[w];
)";
  if (!sums_.options().exact_thresholds) {
    text += R"(    if (fabs(look->value) <= radius) { /* inside, whatever the set: its box will do */
      double box = 0.0;
      for (j = 0; j < PFX_PARAMETERS; ++j) {
        box += fabs(direction[j]) * pfx_risk_half[j];
      }
      look->threshold = radius + box;
      look->excess = fabs(look->value) - radius - box;
      continue;
    }
)";
  }
  text += R"(    for (j = 0; j < PFX_PARAMETERS; ++j) {
      opposite[j] = -direction[j];
    }
    below = pfx_risk_support(s, opposite, (2 * w + 1) % PFX_RISK_SLOTS);
    above = pfx_risk_support(s, direction, 2 * w % PFX_RISK_SLOTS);
    up = above - predicted + radius;
    down = predicted + below + radius;
    look->threshold = look->value >= 0.0 ? up : down;
    up = look->value - up;
    down = -look->value - down;
    look->excess = up < down ? down : up;
    s->alarm = s->alarm || look->excess > 0.0;
  }
}
)";
  return text;
}

std::string SumsWriter::interface() const {
  std::string text(kInterface);
  text += R"(
/* Takes the sample at time t (s); whether sums were looked at. */
static inline int pfx_sums_step(pfx_sums *s, double t, const double sample[PFX_INPUTS])
{
  pfx_element element;
  int any, k;
  s->looks = s->alarm = 0;
  if (!pfx_whole(t, sample)) {
    return 0;
  }
)";
  text += line("  if (s->started && (!(t > s->elements.sample[0].t){})) {{",
               sums_.elements().measurement().nominal_step > 0.0 ? " || t - s->elements.sample[0].t > PFX_GAP" : "");
  text += R"(    pfx_sums_restart(s);
  }
  s->started = 1;
  any = pfx_take_sample(&s->elements, t, sample);
  if (s->elements.began) {
    pfx_sums_begin(s);
  }
  if (!any) {
    return 0;
  }
  pfx_make(&s->elements, &element);
)";
  if (elements_.nodes()) {
    text += line("  s->before = element.before;");
  }
  text += R"(  pfx_foresee(s, &element);
  pfx_weigh(s, &element);
  pfx_sums_take(s, &element);
)";
  text += line("  s->fading = (s->fading + 1) % {};", filter::kFade);
  text += R"(  if (s->fading == 0) {
    pfx_fade(s->stage, sizeof s->stage);
    pfx_fade(s->g, sizeof s->g);
    pfx_fade(s->g1, sizeof s->g1);
    pfx_fade(s->c, sizeof s->c);
    pfx_fade(s->c1, sizeof s->c1);
    pfx_fade(s->c2, sizeof s->c2);
    pfx_fade(s->efforts1, sizeof s->efforts1);
    for (k = 0; k < PFX_SCALES; ++k) {
      pfx_fade(&s->scale[k].sum, sizeof s->scale[k].sum);
    }
  }
  for (k = 0; k < PFX_SCALES; ++k) {
    if (s->scale[k].since * PFX_CHECKS >= pfx_scale_time[k]) {
      s->scale[k].since = 0.0;
      pfx_sums_look(s, k);
    }
  }
  return s->looks > 0;
}
)";
  return text;
}

std::string SumsWriter::functions() const { return foresee() + weigh() + take() + look() + interface(); }

}  // namespace wheelwright::exporter::c_text
