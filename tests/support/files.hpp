#pragma once

#include <stdlib.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

namespace phantom::test {

/// A folder of this process alone, for what its tests write; goes with the process.
inline const std::filesystem::path& own_folder() {
  struct Folder {
    Folder() {
      std::string pattern = (std::filesystem::temp_directory_path() / "phantom_test_XXXXXX").string();
      if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error(pattern + ": cannot be made");
      path = pattern;
    }
    ~Folder() {
      std::error_code ignored;
      if (getpid() == owner) std::filesystem::remove_all(path, ignored);
    }
    std::filesystem::path path;
    pid_t owner = getpid();
  };
  static const Folder folder;
  return folder.path;
}

/// An empty folder in own_folder(), for a test whose files have names.
inline std::filesystem::path new_folder() {
  static int number = 0;
  const auto folder = own_folder() / ("folder_" + std::to_string(++number));
  std::filesystem::create_directory(folder);
  return folder;
}

/// `text` with the first `from` in it replaced. One that is not there is the test's mistake.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("not found: " + from);
  return text.replace(at, from.size(), to);
}
inline std::string all_replaced(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

/// What stands in a file; nothing if it is not there, as a log may not be yet.
inline std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// The same of a file that must be there.
inline std::string text_of(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) throw std::logic_error(file.string() + ": cannot be read");
  return read_text(file);
}

/// A new file with this text in own_folder().
inline std::filesystem::path new_file(const std::string& text, const std::string& extension = ".yaml") {
  static int number = 0;
  const auto file = own_folder() / (std::to_string(++number) + extension);
  std::ofstream(file) << text;
  return file;
}

/// A copy of a file with the first `from` in it replaced. A text that is not there is the test's mistake.
inline std::filesystem::path changed(const std::filesystem::path& file, const std::string& from,
                                     const std::string& to) {
  return new_file(replaced(text_of(file), from, to), file.extension());
}

}  // namespace phantom::test
