// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/warrant_json.hpp>

#include <nlohmann/json.hpp>

#include <wheelwright/files/words.hpp>

namespace wheelwright {
namespace {

constexpr Words<Warrant, 3> kWarrantWords{{{Warrant::guaranteed, warrant_word(Warrant::guaranteed)},
                                           {Warrant::extrapolated, warrant_word(Warrant::extrapolated)},
                                           {Warrant::statistical, warrant_word(Warrant::statistical)}}};
constexpr Words<AssumptionVerdict, 3> kVerdictWords{{{AssumptionVerdict::holds, "holds"},
                                                     {AssumptionVerdict::not_tested, "not_tested"},
                                                     {AssumptionVerdict::fails, "fails"}}};

}  // namespace

Warrant warrant_at(const JsonPlace& place, Warrant absent) {
  return place.has("warrant") ? value_of(kWarrantWords, place.at("warrant")) : absent;
}

Json assumptions_json(const std::vector<Assumption>& assumptions) {
  Json list = Json::array();
  for (const Assumption& a : assumptions) {
    list.push_back({{"id", a.id},
                    {"statement", a.statement},
                    {"declared_by", a.declared_by},
                    {"test", a.test},
                    {"verdict", word_of(kVerdictWords, a.verdict)},
                    {"detail", a.detail}});
  }
  return list;
}

std::vector<Assumption> assumptions_at(const JsonPlace& place) {
  std::vector<Assumption> list;
  if (!place.has("assumptions")) {
    return list;
  }
  const JsonPlace all = place.at("assumptions");
  for (std::size_t k = 0; k < all.size(); ++k) {
    const JsonPlace each = all.at(k);
    list.push_back({.id = each.at("id").text(),
                    .statement = each.at("statement").text(),
                    .declared_by = each.at("declared_by").text(),
                    .test = each.at("test").text(),
                    .verdict = value_of(kVerdictWords, each.at("verdict")),
                    .detail = each.at("detail").text()});
  }
  return list;
}

}  // namespace wheelwright
