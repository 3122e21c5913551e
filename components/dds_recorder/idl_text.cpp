#include "components/dds_recorder/idl_text.hpp"

#include <set>
#include <sstream>

#include "components/dds_recorder/idl_files.hpp"

namespace phantom::dds_recorder {
namespace {

const char* file_named(const std::string& name) {
  for (const IdlFile& file : kIdlFiles) {
    if (name == file.name) return file.text;
  }
  return nullptr;
}

/// Appends the file's text. Replaces each include by the text of the included file, once per file.
void append_resolved(const char* text, std::set<std::string>& included, std::string& out) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] != '#') {
      out += line + '\n';
      continue;
    }
    const auto quote = line.find('"');
    if (line.rfind("#include", 0) != 0 || quote == std::string::npos) continue;  // include guards
    const std::string name = line.substr(quote + 1, line.rfind('"') - quote - 1);
    const char* other = file_named(name);
    if (other != nullptr && included.insert(name).second) append_resolved(other, included, out);
  }
}

}  // namespace

std::string idl_of(const std::string& type_name) {
  constexpr const char* kModule = "phantom::msg::";
  if (type_name.rfind(kModule, 0) != 0) return {};
  const std::string definition = "struct " + type_name.substr(std::string(kModule).size()) + " {";
  for (const IdlFile& file : kIdlFiles) {
    if (std::string(file.text).find(definition) == std::string::npos) continue;
    std::string text;
    std::set<std::string> included{file.name};
    append_resolved(file.text, included, text);
    return text;
  }
  return {};
}

}  // namespace phantom::dds_recorder
