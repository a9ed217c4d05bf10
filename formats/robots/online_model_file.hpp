// SPDX-License-Identifier: Apache-2.0
/// \file
/// Reader of the on-line part of model.json, which `wheelwright commission` writes.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "detector/learnt_model.hpp"
#include "formats/files/json.hpp"

namespace wheelwright::robots {

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kModelSchema = "wheelwright/model/1";

/// Reads the on-line part of a model.json back. Throws InputError, naming file and key, when it is no such file, when
/// it holds no model (its status says why), or when a number is missing or impossible.
[[nodiscard]] OnlineModel read_model(const std::filesystem::path& path);

/// The same from JSON; `file` is for messages.
[[nodiscard]] OnlineModel model_from_json(const Json& json, const std::string& file);

/// Parts of model.json, for those who read more of it. All throw InputError, naming file and key.
///
/// The document's root, after a look at its schema.
[[nodiscard]] files::JsonPlace model_root(const Json& json, const std::string& file);
/// Warrant of the numbers of a model; for a model file without one, as its noise implies.
[[nodiscard]] core::Warrant model_warrant(const files::JsonPlace& root);
/// The word of the member `warrant` of `place`; `absent` where there is none, as in files from before there was one.
[[nodiscard]] core::Warrant warrant_at(const files::JsonPlace& place, core::Warrant absent);
/// The list at the member `assumptions` of `place`; empty where there is none.
[[nodiscard]] std::vector<core::Assumption> assumptions_at(const files::JsonPlace& place);
[[nodiscard]] FilterDesign filter_at(const files::JsonPlace& place);
[[nodiscard]] Measurement measurement_at(const files::JsonPlace& place, const Model& model, const Robot& robot);
/// Bounds on the motion, those on the effort left out.
[[nodiscard]] filter::SignalErrors motion_errors_at(const files::JsonPlace& place, const Model& model);
/// The members A and b.
[[nodiscard]] std::vector<bounds::HalfSpace> facets_at(const files::JsonPlace& place, std::size_t p);
[[nodiscard]] Box box_at(const files::JsonPlace& place, std::size_t p);
/// The channel in the section `kinematic`; nothing where it holds no model.
[[nodiscard]] std::optional<detector::KinematicModel> kinematic_from_json(const files::JsonPlace& place);
/// What a detector at a stated risk needs, from the section `at_risk`.
[[nodiscard]] detector::RiskModel risk_at(const files::JsonPlace& place, const Model& model);
/// True if each of the `outputs` of an object `noise` has the origin "declared", and there is one.
[[nodiscard]] bool all_declared(const files::JsonPlace& noise);

}  // namespace wheelwright::robots

namespace wheelwright {
using robots::read_model;
}  // namespace wheelwright
