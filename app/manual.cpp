// SPDX-License-Identifier: Apache-2.0
#include "app/manual.hpp"

#include <cctype>
#include <sstream>

#include <fmt/format.h>

#include "core/words.hpp"

namespace wheelwright::app {
namespace {

// The code point that begins at text[k], and its length; text is UTF-8, since it is this program's own.
std::pair<unsigned, std::size_t> code_point(const std::string& text, std::size_t k) {
  const auto byte = [&](std::size_t at) { return static_cast<unsigned>(static_cast<unsigned char>(text[at])); };
  const unsigned first = byte(k);
  const std::size_t length = first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  unsigned code = length == 1 ? first : first & (0xFFu >> (length + 1));
  for (std::size_t j = 1; j < length && k + j < text.size(); ++j) {
    code = (code << 6) | (byte(k + j) & 0x3Fu);
  }
  return {code, length};
}

// Text as roff takes it for itself: nothing in it is a request or an escape. A hyphen that may be typed stays a hyphen.
std::string literal(const std::string& text) {
  std::string out;
  for (std::size_t k = 0; k < text.size();) {
    const auto [code, length] = code_point(text, k);
    if (length > 1) {
      out += fmt::format("\\[u{:04X}]", code);
    } else if (text[k] == '\\') {
      out += "\\e";
    } else if (text[k] == '-') {
      out += "\\-";
    } else {
      out += text[k];
    }
    k += length;
  }
  if (out.starts_with('.') || out.starts_with('\'')) {
    out.insert(0, "\\&");
  }
  return out;
}

std::string upper(std::string text) {
  for (char& c : text) {
    c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return text;
}

std::string lower_first(std::string text) {
  if (text.size() > 1 && std::islower(static_cast<unsigned char>(text[1])) != 0) {
    text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  }
  return text;
}

std::string header(const std::string& name, const std::string& description, const std::string& version) {
  return fmt::format(".TH {} 1 \"\" \"{}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n", upper(literal(name)),
                     literal(version), literal(name), literal(lower_first(first_sentence(description))));
}

std::string paragraphs(const std::string& text) {
  std::string out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    out += line.empty() ? ".PP\n" : literal(line) + "\n";
  }
  return out;
}

std::string synopsis(const CommandWords& command) {
  std::string out = fmt::format(".SH SYNOPSIS\n.B wheelwright {}\n", literal(command.name));
  for (const OptionWords& option : command.options) {
    const std::string dots = option.repeated ? "..." : "";
    if (option.positional()) {
      const std::string one = "\\fI" + literal(option.value) + "\\fR" + dots;
      out += option.required ? one + "\n" : "[" + one + "]\n";
    } else if (option.required) {
      out += fmt::format("\\fB{}\\fR \\fI{}\\fR{}\n", literal(option.names.back()), literal(option.value), dots);
    }
  }
  return out + "[\\fIOPTION\\fR]...\n";
}

std::string options(const CommandWords& command) {
  std::string out;
  for (const OptionWords& option : command.options) {
    out += ".TP\n";
    std::string names;
    for (const std::string& name : option.names) {
      names += (names.empty() ? "" : ", ") + ("\\fB" + literal(name) + "\\fR");
    }
    const std::string value = option.value.empty() ? "" : "\\fI" + literal(option.value) + "\\fR";
    out += names + (names.empty() || value.empty() ? "" : " ") + value + "\n";
    std::string words = option.description;
    if (!option.choices.empty()) {
      words += "; one of " + core::listed(option.choices);
    }
    if (option.required && !option.positional()) {
      words += " (required)";
    } else if (!option.otherwise.empty()) {
      words += " (default: " + option.otherwise + ")";
    }
    out += literal(words) + "\n";
  }
  return out.empty() ? "" : ".SH OPTIONS\n" + out;
}

// "Examples:" opens a section, lines that begin with blanks are typed, "Exit code:" is the exit status.
std::string footer(const std::string& text) {
  std::string out;
  bool typed = false;
  bool section = false;
  const auto end_typed = [&] {
    out += typed ? ".EE\n" : "";
    typed = false;
  };
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) {
      end_typed();
      out += section ? ".PP\n" : "";
    } else if (line == "Examples:") {
      end_typed();
      out += ".SH EXAMPLES\n";
      section = true;
    } else if (line.starts_with("Exit code: ")) {
      end_typed();
      out += ".SH EXIT STATUS\n" + literal(line.substr(11)) + "\n";
      section = true;
    } else if (line.starts_with("  ")) {
      out += typed ? "" : ".EX\n";
      typed = true;
      out += literal(line) + "\n";
    } else {
      end_typed();
      out += section ? "" : ".SH NOTES\n";
      section = true;
      out += literal(line) + "\n";
    }
  }
  end_typed();
  // A paragraph before a section, or at the end, holds nothing.
  for (const char* empty : {".PP\n.SH", ".PP\n.PP"}) {
    for (std::size_t at = out.find(empty); at != std::string::npos; at = out.find(empty)) {
      out.erase(at, 4);
    }
  }
  return out.ends_with(".PP\n") ? out.substr(0, out.size() - 4) : out;
}

constexpr const char* kStatus =
    ".SH EXIT STATUS\n0 done; 1 the answer to the question is no; 2 bad usage or input; 3 internal failure.\n";

}  // namespace

std::string manual_page(const CommandWords& command, const std::string& version) {
  const std::string below = footer(command.footer);
  return header("wheelwright-" + command.name, command.description, version) + synopsis(command) + ".SH DESCRIPTION\n" +
         paragraphs(command.description) + options(command) + below +
         (below.find(".SH EXIT STATUS") == std::string::npos ? kStatus : "") + ".SH SEE ALSO\n.BR wheelwright (1)\n";
}

std::string manual_page(const ProgramWords& program, const std::string& version) {
  std::string out = header("wheelwright", program.program.description, version) +
                    ".SH SYNOPSIS\n.B wheelwright\n\\fICOMMAND\\fR [\\fIOPTION\\fR]... [\\fIARGUMENT\\fR]...\n" +
                    ".SH DESCRIPTION\n" + paragraphs(program.program.description) + ".SH COMMANDS\n";
  std::string see;
  for (const CommandWords& command : program.commands) {
    out += fmt::format(".TP\n\\fB{}\\fR\n{}\n", literal(command.name), literal(first_sentence(command.description)));
    see += fmt::format("{}.BR wheelwright\\-{} (1)", see.empty() ? "" : " ,\n", literal(command.name));
  }
  return out + options(program.program) + footer(program.program.footer) + kStatus + ".SH SEE ALSO\n" + see + "\n";
}

}  // namespace wheelwright::app
