// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/words/margin_words.hpp>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <wheelwright/core/limits.hpp>
#include <wheelwright/core/words.hpp>

namespace wheelwright::words {
namespace {

// What is best known of one fault on one side in one manoeuvre, over the residuals.
struct Best {
  detector::MarginSummary summary;
  std::string residual;
};

Best best_of(const commission::MarginSurvey& survey, const detector::FaultMargins& of, std::size_t window,
             detector::ManoeuvreKind kind) {
  Best best;
  for (const commission::ResidualMargins& residual : survey.residuals) {
    for (const detector::FaultMargins& each : residual.margins) {
      if (each.fault.name == of.fault.name && each.side == of.side) {
        const detector::MarginSummary summary = detector::summarise(each, window, kind);
        if (summary.onsets > 0 && (best.residual.empty() || summary.worst < best.summary.worst ||
                                   (summary.worst == best.summary.worst && summary.best < best.summary.best))) {
          best = {summary, residual.name};
        }
      }
    }
  }
  return best;
}

// The first window in which `size` is certain at every onset of the manoeuvre, s.
double delay_of(const commission::MarginSurvey& survey, const detector::FaultMargins& of, detector::ManoeuvreKind kind,
                double size) {
  for (std::size_t w = 0; w < survey.windows.size(); ++w) {
    const Best best = best_of(survey, of, w, kind);
    if (!best.residual.empty() && best.summary.worst <= size) {
      return survey.windows[w];
    }
  }
  return survey.windows.back();
}

// "wheel radius (+)".
std::string name_of(const detector::FaultMargins& of) {
  std::string name = of.fault.name;
  std::replace(name.begin(), name.end(), '_', ' ');
  if (!of.fault.whole && of.fault.range.lower < 0.0) {
    name += of.side > 0.0 ? " (+)" : " (−)";
  }
  return name;
}

std::string sentence(const commission::MarginSurvey& survey, const detector::FaultMargins& of) {
  const std::size_t window = shown_window(survey);
  std::vector<std::string> seen, at_best, unseen;
  for (const auto& [kind, onsets] : survey.manoeuvres) {
    const Best best = best_of(survey, of, window, kind);
    if (best.residual.empty()) {
      continue;
    }
    const std::string where(detector::manoeuvre_words(kind));
    if (std::isfinite(best.summary.worst)) {
      const std::string size = of.fault.whole ? "" : "from " + magnitude_words(of.fault, best.summary.worst) + " on ";
      seen.push_back(fmt::format("{}within {:g} s while {} ({})", size, delay_of(survey, of, kind, best.summary.worst),
                                 where, best.residual));
    } else if (std::isfinite(best.summary.best)) {
      const std::string share = fmt::format("{} of {}", best.summary.certain, best.summary.onsets);
      at_best.push_back(of.fault.whole ? fmt::format("{} ({})", where, share)
                                       : fmt::format("{} (from {} on at {})", where,
                                                     magnitude_words(of.fault, best.summary.most), share));
    } else {
      unseen.push_back(where);
    }
  }
  std::string out = name_of(of) + ": ";
  out += seen.empty() ? "not certain to be seen at every moment of any manoeuvre"
                      : "certainly seen " + core::enumerated(seen);
  if (!at_best.empty()) {
    out += fmt::format("; at some moments only while {}", core::enumerated(at_best));
  }
  if (!unseen.empty()) {
    out += fmt::format("; not certain while {}", core::enumerated(unseen));
  }
  return out + ".";
}

}  // namespace

std::string magnitude_words(const detector::FaultType& fault, double magnitude) {
  if (!std::isfinite(magnitude)) {
    return "–";
  }
  // Upwards: a size that is printed is certain.
  const double scale = fault.unit == "1" ? 100.0 : 1.0, value = magnitude * scale;
  const double step = value > 0.0 ? std::pow(10.0, std::floor(std::log10(value)) - 1.0) : 1.0;
  const double shown = std::ceil(value / step * (1.0 - 1e-12)) * step;
  return fmt::format("{:.6g} {}", shown, fault.unit == "1" ? "%" : fault.unit);
}

std::string certain_words(const detector::FaultMargins& margins, std::size_t window, detector::ManoeuvreKind kind) {
  const detector::MarginSummary summary = detector::summarise(margins, window, kind);
  if (summary.onsets == 0) {
    return "";
  }
  if (!std::isfinite(summary.best)) {
    return "–";
  }
  if (margins.fault.whole) {
    return summary.certain == summary.onsets ? "yes" : fmt::format("at {} of {}", summary.certain, summary.onsets);
  }
  const std::string size = magnitude_words(margins.fault, summary.most);
  return summary.certain == summary.onsets ? size
                                           : fmt::format("{} at {} of {}", size, summary.certain, summary.onsets);
}

std::size_t shown_window(const commission::MarginSurvey& survey) {
  std::size_t shown = 0;
  for (std::size_t w = 0; w < survey.windows.size(); ++w) {
    shown = survey.windows[w] <= 1.0 ? w : shown;
  }
  return shown;
}

std::string certain_meaning(core::Warrant warrant) {
  return warrant == core::Warrant::guaranteed
             ? "“Certain” is meant as guaranteed: for all parameters that the commissioning "
               "log allows and for every noise "
               "within the sensors’ declared bounds, while the assumptions listed hold."
         : warrant == core::Warrant::statistical
             ? "“Certain” is meant statistically: for all parameters that the "
               "commissioning log allows, at the confidence "
               "at which the sensors’ declared noise was taken through the filter."
             : "“Certain” is extrapolated: it takes the noise bounds that were learnt "
               "from the commissioning log for true "
               "and holds as far as noise and driving stay like that log.";
}

std::vector<RiskSizes> risk_sizes(const commission::MarginSurvey& survey) {
  std::vector<RiskSizes> all;
  if (!survey.at_risk) {
    return all;
  }
  // The median within the longest window up to `within`.
  const auto median = [](const detector::FaultMargins& margins, const std::vector<double>& windows, double within) {
    const auto end = std::ranges::upper_bound(windows, within);
    return end == windows.begin()
               ? core::kInfinity
               : detector::summarise(margins, static_cast<std::size_t>(end - windows.begin()) - 1).median;
  };
  const auto words = [](const detector::FaultMargins& margins, double size) {
    return margins.fault.whole && std::isfinite(size) ? std::string("yes") : magnitude_words(margins.fault, size);
  };
  for (const detector::FaultMargins& margins : survey.at_risk->margins) {
    RiskSizes sizes{name_of(margins), {}, {}};
    bool any = false;
    for (const double within : kRiskWindows) {
      double worst_case = core::kInfinity;
      for (const commission::ResidualMargins& residual : survey.residuals) {
        for (const detector::FaultMargins& each : residual.margins) {
          if (each.fault.name == margins.fault.name && each.side == margins.side) {
            worst_case = std::min(worst_case, median(each, survey.windows, within));
          }
        }
      }
      const double size = median(margins, survey.at_risk->windows, within);
      sizes.worst_case.push_back(words(margins, worst_case));
      sizes.at_risk.push_back(words(margins, size));
      any = any || std::isfinite(size);
    }
    if (any) {
      all.push_back(std::move(sizes));
    }
  }
  return all;
}

std::string risk_meaning(const commission::RiskMargins& margins) {
  return fmt::format(
      "“At the stated risk” is meant for all parameters that the set at a risk of {:g} allows, while the errors "
      "average "
      "out as the robot file declares: a fault of that size, in a drive whose encoders read like this one, is missed "
      "with a probability of at most {:.2g}.",
      margins.risk, margins.miss);
}

std::vector<std::string> margin_sentences(const commission::MarginSurvey& survey) {
  std::vector<std::string> sentences;
  for (const detector::FaultMargins& of : survey.residuals.front().margins) {
    sentences.push_back(sentence(survey, of));
  }
  return sentences;
}

}  // namespace wheelwright::words
