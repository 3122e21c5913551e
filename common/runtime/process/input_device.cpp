#include "common/runtime/process/input_device.hpp"

#include <algorithm>
#include <filesystem>

namespace phantom::runtime {

std::vector<std::string> input_files() {
  std::error_code none;
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/input", none)) {
    if (entry.path().filename().string().starts_with("event")) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string input_name(int fd) {
  char name[128] = "";
  return ioctl(fd, EVIOCGNAME(sizeof name), name) > 0 ? name : "";
}

}  // namespace phantom::runtime
