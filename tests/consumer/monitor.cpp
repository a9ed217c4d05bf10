// SPDX-License-Identifier: Apache-2.0
/// \file
/// monitor MODEL LOG.csv: the on-line part of a commissioned model alone, fed row by row. Exit code 1: an alarm, 0:
/// none.

#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <wheelwright/core/error.hpp>
#include <wheelwright/detector/online_model.hpp>
#include <wheelwright/formats/robots/online_model_file.hpp>

namespace {

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) {
    fields.push_back(field);
  }
  return fields;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) {
    return 2;
  }
  try {
    const wheelwright::OnlineModel model = wheelwright::read_model(arguments[1]);
    wheelwright::TorqueDetector detector = wheelwright::make_detector(model);
    std::ifstream log(arguments[2]);
    std::string line;
    std::getline(log, line);
    std::map<std::string, std::size_t> position;
    for (const std::string& name : fields_of(line)) {
      position.emplace(name, position.size());
    }
    std::vector<double> sample(model.measurement.columns().size());
    bool fault = false;
    std::size_t decisions = 0;
    while (std::getline(log, line)) {
      const std::vector<std::string> row = fields_of(line);
      std::size_t k = 0;
      for (const std::string& name : model.measurement.columns()) {
        sample[k++] = std::stod(row.at(position.at(name)));
      }
      const wheelwright::Decision& decision = detector.step(std::stod(row.at(position.at("t"))), sample);
      decisions += decision.valid ? 1 : 0;
      fault = fault || decision.fault;
    }
    std::cout << decisions << " decisions\n";
    return decisions == 0 ? 2 : fault ? 1 : 0;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
}
