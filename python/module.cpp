// SPDX-License-Identifier: Apache-2.0
#include "python/module.hpp"

#include <cmath>
#include <exception>
#include <string>

#include <nlohmann/json.hpp>

#include "core/check.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/software.hpp"

namespace wheelwright::python {

void LongWork::breathe() {
  using namespace std::chrono_literals;
  {
    const std::lock_guard hold(watch_);
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < 100ms) {
      return;
    }
    last_ = now;
  }
  ask([] {
    if (PyErr_CheckSignals() != 0) {
      throw py::error_already_set();
    }
  });
}

void LongWork::tell(std::string_view text, double share) {
  breathe();
  if (progress_.is_none()) {
    return;
  }
  ask([&] { progress_(share, std::string(text)); });
}

py::object to_python(const Json& value) {
  switch (value.type()) {
    case Json::value_t::object: {
      py::dict out;
      for (const auto& [key, member] : value.items()) {
        out[py::str(key)] = to_python(member);
      }
      return out;
    }
    case Json::value_t::array: {
      py::list out(value.size());
      for (std::size_t i = 0; i < value.size(); ++i) {
        out[i] = to_python(value[i]);
      }
      return out;
    }
    case Json::value_t::string: {
      const std::string& text = value.get_ref<const std::string&>();
      return py::reinterpret_steal<py::object>(
          PyUnicode_DecodeUTF8(text.data(), static_cast<py::ssize_t>(text.size()), "replace"));
    }
    case Json::value_t::boolean: return py::bool_(value.get<bool>());
    case Json::value_t::number_integer: return py::int_(value.get<std::int64_t>());
    case Json::value_t::number_unsigned: return py::int_(value.get<std::uint64_t>());
    case Json::value_t::number_float: {
      const double number = value.get<double>();
      return std::isfinite(number) ? py::object(py::float_(number)) : py::object(py::none());
    }
    default: return py::none();
  }
}

Json to_json(const py::handle& value, const std::string& what) {
  std::string text;
  try {
    text = py::module_::import("json").attr("dumps")(value).cast<std::string>();
  } catch (const py::error_already_set& error) {
    throw InvalidArgument(what + ": " + error.what() + ": expected values that JSON can hold");
  }
  return files::parse_json(text, what);
}

namespace {

// An exception class of the package, which is also of the built-in class `also`.
template <typename Exception>
py::object mirror(py::module_& m, const char* name, const py::tuple& bases, const char* doc) {
  static py::exception<Exception> mirrored(m, name, bases);
  mirrored.attr("__module__") = "wheelwright";
  mirrored.attr("__doc__") = doc;
  return mirrored;
}

// What every class of the package derives from.
PyTypeObject* base_of_all() { return reinterpret_cast<PyTypeObject*>(py::detail::get_internals().instance_base); }

// An object that was never initialised holds no value, and reading it is undefined. `Class.__new__(Class)` is refused
// by Python itself where a class has a tp_new of its own and the one that is called is its base's.
void refuse_bare_objects(const py::module_& m) {
  for (const auto& [name, member] : m.attr("__dict__").cast<py::dict>()) {
    auto* const type = reinterpret_cast<PyTypeObject*>(member.ptr());
    if (PyType_Check(member.ptr()) != 0 && type->tp_base == base_of_all()) {
      type->tp_new = [](PyTypeObject* of, PyObject* arguments, PyObject* named) {
        return base_of_all()->tp_new(of, arguments, named);
      };
    }
  }
}

}  // namespace

}  // namespace wheelwright::python

PYBIND11_MODULE(_core, m) {
  namespace py = pybind11;
  using namespace wheelwright::python;
  m.doc() = "The compiled part of the package wheelwright.";
  m.attr("software") = wheelwright::results::software();
  const py::object value_error = py::reinterpret_borrow<py::object>(PyExc_ValueError);
  const py::object exception = py::reinterpret_borrow<py::object>(PyExc_Exception);
  static const py::object error =
      mirror<wheelwright::Error>(m, "Error", py::make_tuple(exception), "Base of every exception of the package.");
  static const py::object argument = mirror<wheelwright::InvalidArgument>(
      m, "InvalidArgument", py::make_tuple(error, value_error),
      "An argument is outside its documented domain: a shape, a range, a number that is not finite.");
  static const py::object input = mirror<wheelwright::InputError>(
      m, "InputError", py::make_tuple(error, value_error),
      "A file or table holds something that cannot be used. The message names file, line or key, the value, and what "
      "was expected.");
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(thrown);
    } catch (const wheelwright::InputError& e) {
      PyErr_SetString(input.ptr(), e.what());
    } catch (const wheelwright::InvalidArgument& e) {
      PyErr_SetString(argument.ptr(), e.what());
    } catch (const wheelwright::Error& e) {
      PyErr_SetString(error.ptr(), e.what());
    }
  });
  bind_robot(m);
  bind_log(m);
  bind_bounds(m);
  bind_commission(m);
  bind_filter(m);
  bind_detector(m);
  bind_margins(m);
  bind_gap(m);
  bind_sim(m);
  bind_doctor(m);
  bind_study(m);
  refuse_bare_objects(m);
}
