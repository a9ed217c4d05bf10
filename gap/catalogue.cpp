// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/catalogue.hpp>

#include <iterator>
#include <utility>

namespace wheelwright {
namespace {

std::vector<Effect> catalogue_of(std::size_t joints) {
  std::vector<Effect> all = friction_effects(joints);
  for (auto* group : {&geometry_effects, &actuator_effects}) {
    std::vector<Effect> more = group(joints);
    all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  }
  return all;
}

}  // namespace

std::vector<Effect> effect_catalogue() { return catalogue_of(2); }

std::vector<Effect> effect_catalogue(const Model& model) { return catalogue_of(model.joints.size()); }

}  // namespace wheelwright
