// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <nlohmann/json.hpp>

#include <wheelwright/files/suggest.hpp>
#include <wheelwright/robots/robot_file.hpp>
#include <wheelwright/robots/robot_origin.hpp>

namespace wheelwright {
namespace {

constexpr std::size_t widest = 112;

// Lines of a comment, `text` broken at blanks; what could end a comment becomes a blank.
std::string comment(std::string text, const std::string& indent) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' '; }, ' ');
  std::string out;
  std::size_t begin = 0;
  while (begin < text.size()) {
    std::size_t end = text.size();
    if (end - begin > widest) {
      end = text.rfind(' ', begin + widest);
      end = end == std::string::npos || end <= begin ? std::min(text.find(' ', begin + widest), text.size()) : end;
    }
    out += indent + (begin == 0 ? "# " : "#   ") + text.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
  return out;
}

// Keys whose values hold origins of their own.
bool is_group(const std::string& key) {
  return key == "effort" || key == "nominal" || key == "limits" || key == "motor";
}

}  // namespace

std::string robot_yaml(const RobotWithOrigins& made) {
  const auto origin = [&](const std::string& key) {
    const auto it = made.origins.find(key);
    return it == made.origins.end() ? std::string("default") : it->second;
  };
  std::string out =
      comment("A robot file made of " + listed(made.files) + ". Above each value stands where it came from.", "");
  const Json object = to_json(made.robot);
  for (const auto& member : object.items()) {
    if (is_group(member.key())) {
      out += member.key() + ":\n";
      for (const auto& inner : member.value().items()) {
        out += comment(origin(member.key() + "." + inner.key()), "  ");
        out += "  " + inner.key() + ": " + json_text(inner.value(), -1) + "\n";
      }
    } else if (member.key() == "effects") {
      out += "effects:\n";
      for (const Json& effect : member.value()) {
        out += comment(origin("effects." + effect.at("effect").get<std::string>()), "  ");
        out += "  - " + json_text(effect, -1) + "\n";
      }
    } else {
      out += comment(origin(member.key()), "") + member.key() + ": " + json_text(member.value(), -1) + "\n";
    }
  }
  for (const std::string& remark : made.remarks) {
    out += comment(remark, "");
  }
  return out;
}

}  // namespace wheelwright
