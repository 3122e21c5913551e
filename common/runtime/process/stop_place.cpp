#include "common/runtime/process/stop_place.hpp"

#include <cstdlib>
#include <system_error>

namespace phantom::runtime {
namespace {

std::filesystem::path from_environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

std::vector<std::filesystem::path> former_places() {
  std::vector<std::filesystem::path> places;
  if (const auto given = from_environment("STATE_DIRECTORY"); !given.empty()) places.push_back(given);
  if (const auto given = from_environment("XDG_STATE_HOME"); !given.empty())
    places.push_back(given / "phantom");
  if (const auto home = from_environment("HOME"); !home.empty())
    places.push_back(home / ".local" / "state" / "phantom");
  return places;
}

}  // namespace

StopPlace stop_place(const std::filesystem::path& state_dir, const std::filesystem::path& root) {
  if (!state_dir.empty()) return {.folder = state_dir};
  if (const auto given = from_environment("PHANTOM_STATE_DIR"); !given.empty()) return {.folder = given};
  std::error_code absent;
  if (const auto packaged = root / "var/lib/phantom/stops"; std::filesystem::exists(packaged, absent))
    return {.folder = packaged, .former = former_places()};
  return {.folder = root / "var/tmp/phantom", .shared = true, .former = former_places()};
}

void make_stop_folder(const std::filesystem::path& folder, bool shared) noexcept {
  std::error_code problem;
  if (std::filesystem::create_directories(folder, problem) && shared)
    std::filesystem::permissions(folder, std::filesystem::perms::all | std::filesystem::perms::sticky_bit,
                                 problem);
}

}  // namespace phantom::runtime
