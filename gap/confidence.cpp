// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/confidence.hpp>

#include <algorithm>

namespace wheelwright::gap {

TrackRecord track_record(const Diagnosis& diagnosis) {
  const bool several = diagnosis.causes.size() > 1;
  switch (diagnosis.verdict) {
    case GapVerdict::no_gap: return {.logs = 25, .first = 24, .other = 0, .causes = 0, .present = 0};
    case GapVerdict::explained:
      return several ? TrackRecord{.logs = 39, .first = 33, .other = 0, .causes = 78, .present = 72}
                     : TrackRecord{.logs = 177, .first = 168, .other = 0, .causes = 177, .present = 172};
    case GapVerdict::ambiguous:
      return several ? TrackRecord{.logs = 16, .first = 7, .other = 1, .causes = 33, .present = 18}
                     : TrackRecord{.logs = 23, .first = 18, .other = 3, .causes = 23, .present = 20};
    case GapVerdict::unexplained: return {.logs = 78, .first = 16, .other = 5, .causes = 91, .present = 31};
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
