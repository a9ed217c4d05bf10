// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/hdf5_attributes.hpp"

#include <array>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "formats/files/words.hpp"
#include "formats/logs/hdf5_log.hpp"
#include "formats/logs/recorded_log.hpp"

namespace wheelwright::logs::hdf5 {
namespace {

constexpr hsize_t most_attributes = 1000;  // of a dataset, each of which has to be looked at
constexpr hssize_t most_attribute_values = 64;
constexpr std::size_t longest_attribute_text = 4096;

/// One attribute, opened.
struct OpenAttribute {
  hid_t id, type;
  hssize_t count;  ///< of its values
};

/// The text of an attribute, of which all strings are equal, without blanks at its ends; nothing where it is none.
std::optional<std::string> text_of(const OpenAttribute& attribute) {
  if (H5Tget_class(attribute.type) != H5T_STRING || attribute.count > most_attribute_values) {
    return std::nullopt;
  }
  const auto count = static_cast<std::size_t>(attribute.count);
  std::vector<std::string> texts(std::max<std::size_t>(count, 1));
  const std::size_t size = H5Tget_size(attribute.type);
  if (H5Tis_variable_str(attribute.type) > 0) {
    std::vector<char*> read(texts.size(), nullptr);
    if (count > 0 && H5Aread(attribute.id, attribute.type, static_cast<void*>(read.data())) < 0) {
      return std::nullopt;
    }
    for (std::size_t k = 0; k < count; ++k) {
      texts[k] = read[k] == nullptr ? "" : read[k];
      H5free_memory(read[k]);
    }
  } else {
    std::string read(size <= longest_attribute_text ? size * texts.size() : 0, '\0');
    if (read.empty() || (count > 0 && H5Aread(attribute.id, attribute.type, read.data()) < 0)) {
      return std::nullopt;
    }
    for (std::size_t k = 0; k < count; ++k) {
      texts[k] = read.substr(k * size, size);
      texts[k] = texts[k].substr(0, texts[k].find('\0'));
    }
  }
  if (std::ranges::count(texts, texts.front()) != std::ssize(texts)) {
    return std::nullopt;
  }
  const std::size_t begin = texts.front().find_first_not_of(" \t\r\n"), end = texts.front().find_last_not_of(" \t\r\n");
  return begin == std::string::npos ? "" : texts.front().substr(begin, end - begin + 1);
}

/// The numbers of an attribute; none where it holds something else, or too many.
std::vector<double> numbers_of(const OpenAttribute& attribute) {
  const H5T_class_t kind = H5Tget_class(attribute.type);
  if ((kind != H5T_INTEGER && kind != H5T_FLOAT) || attribute.count > most_attribute_values ||
      !format_defect(attribute.type).empty()) {
    return {};
  }
  std::vector<double> numbers(static_cast<std::size_t>(attribute.count));
  const bool read = numbers.empty() || H5Aread(attribute.id, H5T_NATIVE_DOUBLE, numbers.data()) >= 0;
  return read ? numbers : std::vector<double>{};
}

/// What an attribute holds, for a message.
std::string attribute_shown(const OpenAttribute& attribute) {
  std::vector<std::string> words;
  for (const double number : numbers_of(attribute)) {
    words.push_back(fmt::format("{:g}", number));
  }
  if (!words.empty()) {
    return core::listed(words);
  }
  const std::optional<std::string> text = text_of(attribute);
  return text ? files::shown(*text) : fmt::format("of {} values of another kind", attribute.count);
}

/// A float that is stored in fewer bits differs from a number of an attribute that has more.
double as_stored(double number, hid_t values) {
  std::array<double, 4> room{number};
  if (H5Tget_class(values) == H5T_FLOAT && H5Tget_size(values) <= sizeof(room) && format_defect(values).empty()) {
    H5Tconvert(H5T_NATIVE_DOUBLE, values, 1, room.data(), nullptr, H5P_DEFAULT);
    H5Tconvert(values, H5T_NATIVE_DOUBLE, 1, room.data(), nullptr, H5P_DEFAULT);
  }
  return room.front();
}

/// Takes in an attribute called `name` of a dataset of such `values`.
void add(DatasetAttributes& to, const std::string& name, const OpenAttribute& attribute, hid_t values) {
  const std::string plain = plain_name(name);
  if (plain == "units" || plain == "unit") {
    const std::optional<std::string> text = text_of(attribute);
    to.clear_unit = to.clear_unit && text && (to.unit.empty() || text->empty() || to.unit == *text);
    to.unit = to.unit.empty() ? text.value_or("") : to.unit;
    return;
  }
  const std::vector<double> numbers = numbers_of(attribute);
  const bool scaling = plain == "scale_factor" || plain == "add_offset";
  if (numbers.empty() || (scaling && (numbers.size() > 1 || !std::isfinite(numbers.front())))) {
    to.defect = fmt::format("has attribute {} {}: expected {}", files::shown(name), attribute_shown(attribute),
                            scaling ? "one finite number" : "numbers");
  } else if (scaling) {
    (plain == "scale_factor" ? to.stored.scale : to.stored.offset) = numbers.front();
  } else {
    for (const double number : numbers) {
      to.stored.missing.push_back(as_stored(number, values));
    }
  }
}

}  // namespace

std::string format_defect(hid_t type) {
  const std::size_t bits = 8 * H5Tget_size(type), precision = H5Tget_precision(type);
  bool usual = H5Tget_offset(type) == 0;
  if (H5Tget_class(type) == H5T_FLOAT) {
    std::size_t sign = 0, exponent = 0, exponent_size = 0, mantissa = 0, mantissa_size = 0;
    H5Tget_fields(type, &sign, &exponent, &exponent_size, &mantissa, &mantissa_size);
    const bool extended = precision == 80 && mantissa_size == 64;  // x87: the first bit of the mantissa is stored
    usual = usual && (extended || precision == bits) && mantissa == 0 && exponent == mantissa_size &&
            sign == exponent + exponent_size && precision == sign + 1 && exponent_size < 16 &&
            H5Tget_ebias(type) == (std::size_t{1} << exponent_size) / 2 - 1 &&
            H5Tget_norm(type) == (extended ? H5T_NORM_NONE : H5T_NORM_IMPLIED);
  } else if (H5Tget_class(type) == H5T_INTEGER) {
    usual = usual && precision == bits;
  }
  return usual ? ""
               : fmt::format(
                     "has numbers of {} bits in a format that no machine has: the file is damaged, or its numbers "
                     "take only some of their bits: expected whole integers or floats of IEEE 754",
                     bits);
}

std::optional<DatasetAttributes> attributes_of(hid_t dataset, hid_t values) {
  static const std::string longer_than_any(std::size_t{1} << 16, 'x');
  DatasetAttributes all;
  H5O_info_t info{};
  if (H5Aexists(dataset, longer_than_any.c_str()) < 0 || H5Oget_info2(dataset, &info, H5O_INFO_NUM_ATTRS) < 0) {
    return std::nullopt;
  }
  if (info.num_attrs > most_attributes) {
    all.defect = fmt::format("has {} attributes: expected at most {}", info.num_attrs, most_attributes);
    return all;
  }
  std::vector<std::string> names;
  const auto visit = [](hid_t, const char* name, const H5A_info_t*, void* to) -> herr_t {
    constexpr std::array<std::string_view, 6> known{"units",      "unit",      "scale_factor",
                                                    "add_offset", "fillvalue", "missing_value"};
    if (std::ranges::find(known, plain_name(name)) != known.end()) {
      static_cast<std::vector<std::string>*>(to)->emplace_back(name);
    }
    return 0;
  };
  if (H5Aiterate2(dataset, H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, visit, &names) < 0) {
    return std::nullopt;
  }
  for (const std::string& name : names) {
    const Handle attribute(H5Aopen(dataset, name.c_str(), H5P_DEFAULT), H5Aclose);
    const Handle type(attribute ? H5Aget_type(attribute.get()) : -1, H5Tclose);
    const Handle space(attribute ? H5Aget_space(attribute.get()) : -1, H5Sclose);
    const hssize_t count = space ? H5Sget_simple_extent_npoints(space.get()) : -1;
    if (!type || count < 0) {
      return std::nullopt;
    }
    add(all, name, {attribute.get(), type.get(), count}, values);
  }
  return all;
}

}  // namespace wheelwright::logs::hdf5
