// SPDX-License-Identifier: Apache-2.0
#include "gap/causes/confidence.hpp"

#include <algorithm>

namespace wheelwright::gap {

TrackRecord track_record(const Diagnosis& diagnosis) {
  const bool several = diagnosis.causes.size() > 1;
  switch (diagnosis.verdict) {
    case GapVerdict::no_gap: return {.logs = 25, .first = 24, .other = 0, .causes = 0, .present = 0};
    case GapVerdict::explained:
      return several ? TrackRecord{.logs = 40, .first = 34, .other = 0, .causes = 80, .present = 74}
                     : TrackRecord{.logs = 181, .first = 172, .other = 0, .causes = 181, .present = 176};
    case GapVerdict::ambiguous:
      return several ? TrackRecord{.logs = 16, .first = 7, .other = 1, .causes = 33, .present = 18}
                     : TrackRecord{.logs = 21, .first = 16, .other = 3, .causes = 21, .present = 18};
    case GapVerdict::unexplained: return {.logs = 75, .first = 13, .other = 5, .causes = 87, .present = 27};
  }
  return {};
}

void rate(Diagnosis& diagnosis) {
  const TrackRecord record = track_record(diagnosis);
  const auto share = [&record](int came) { return (came + 0.5) / (record.logs + 1.5); };
  const auto others = static_cast<double>(std::max<std::size_t>(diagnosis.credible.size(), 1) - 1);
  for (std::size_t k = 0; k < diagnosis.credible.size(); ++k) {
    diagnosis.credible[k].probability = k == 0 ? share(record.first) : share(record.other) / others;
  }
  for (GapCause& cause : diagnosis.causes) {
    cause.probability = (record.present + 0.5) / (record.causes + 1.0);
  }
  diagnosis.record = record;
}

}  // namespace wheelwright::gap
