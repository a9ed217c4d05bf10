// SPDX-License-Identifier: Apache-2.0
#include "app/units.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/words.hpp"

namespace wheelwright::app {
namespace {

// A quantity is value · multiply / divide, so that "5 cm" is 5/100, the double nearest to 0.05.
struct Unit {
  std::string name;
  double multiply = 1.0;
  double divide = 1.0;
};

using Units = std::vector<Unit>;

const Units& units_of(const std::string& si) {
  static const double pi = std::numbers::pi;
  static const std::map<std::string, Units> table = {
      {"s", {{"s"}, {"ms", 1.0, 1e3}, {"us", 1.0, 1e6}, {"min", 60.0}, {"h", 3600.0}}},
      {"m", {{"m"}, {"cm", 1.0, 100.0}, {"mm", 1.0, 1e3}, {"km", 1e3}, {"in", 254.0, 1e4}}},
      {"rad", {{"rad"}, {"mrad", 1.0, 1e3}, {"deg", pi, 180.0}, {"°", pi, 180.0}}},
      {"rad/s", {{"rad/s"}, {"deg/s", pi, 180.0}, {"rpm", 2.0 * pi, 60.0}}},
      {"rad/s²", {{"rad/s²"}, {"deg/s²", pi, 180.0}}},
      {"m/s", {{"m/s"}, {"cm/s", 1.0, 100.0}, {"mm/s", 1.0, 1e3}, {"km/h", 10.0, 36.0}}},
      {"m/s²", {{"m/s²"}, {"cm/s²", 1.0, 100.0}}},
      {"Hz", {{"Hz"}, {"kHz", 1e3}, {"1/s"}}},
      {"1/s", {{"1/s"}}},
      {"kg", {{"kg"}, {"g", 1.0, 1e3}}},
      {"N·m", {{"N·m"}, {"mN·m", 1.0, 1e3}}},
      {"A", {{"A"}, {"mA", 1.0, 1e3}}},
      {"V", {{"V"}, {"mV", 1.0, 1e3}}},
      {"1", {{"1"}, {"%", 1.0, 100.0}}},
  };
  static const Units none;
  const auto found = table.find(si);
  return found == table.end() ? none : found->second;
}

// "rad/s^2" and "rad/s2" are rad/s², "N*m" and "Nm" are N·m.
std::string plain(std::string_view unit) {
  std::string out;
  for (std::size_t k = 0; k < unit.size();) {
    if (unit.substr(k, 2) == "²") {
      out += '2';
      k += 2;
    } else if (unit.substr(k, 2) == "·") {
      k += 2;
    } else {
      if (unit[k] != '*' && unit[k] != '^' && unit[k] != ' ') {
        out += unit[k];
      }
      ++k;
    }
  }
  return out;
}

}  // namespace

double quantity(std::string_view text, std::string_view unit, std::string_view option) {
  const std::string si(unit);
  const Units own = {{si}};
  const Units& units = units_of(si).empty() ? own : units_of(si);
  std::string_view rest = text;
  while (!rest.empty() && rest.front() == ' ') {
    rest.remove_prefix(1);
  }
  double number = 0.0;
  const char* const behind = files::parse_number(rest.data(), rest.data() + rest.size(), number);
  if (behind != nullptr && std::isfinite(number)) {
    const std::string name = plain({behind, static_cast<std::size_t>(rest.data() + rest.size() - behind)});
    for (const Unit& each : units) {
      if (name.empty() || name == plain(each.name)) {
        const double value = name.empty() ? number : number * each.multiply / each.divide;
        if (std::isfinite(value)) {
          return value;
        }
      }
    }
  }
  std::vector<std::string> names;
  for (const Unit& each : units) {
    names.push_back(each.name);
  }
  const std::string expected = si == "1" ? "a number, or one with %"
                               : names.size() > 1
                                   ? fmt::format("a number in {}, or one with a unit: {}", si, core::listed(names))
                                   : "a number in " + si;
  throw InputError(
      fmt::format("{}{}{}: expected {}", option, option.empty() ? "" : ": ", files::shown(text), expected));
}

}  // namespace wheelwright::app
