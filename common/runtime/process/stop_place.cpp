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

StopPlace place_of_host(const std::filesystem::path& root) {
  if (const auto given = from_environment("PHANTOM_STATE_DIR"); !given.empty()) return {.folder = given};
  std::error_code absent;
  const auto shared = root / "var/tmp/phantom", packaged = root / "var/lib/phantom/stops";
  StopPlace place{.folder = shared, .shared = true, .former = former_places()};
  if (std::filesystem::exists(packaged, absent)) {
    // A stop from before the packages were installed holds, too.
    place.former.push_back(shared);
    place.folder = packaged;
    place.shared = false;
  }
  return place;
}

}  // namespace

StopPlace stop_place(const std::filesystem::path& state_dir, const std::filesystem::path& root) {
  StopPlace host = place_of_host(root);
  if (state_dir.empty()) return host;
  std::error_code problem;
  const auto given = std::filesystem::weakly_canonical(std::filesystem::absolute(state_dir), problem);
  if (given == std::filesystem::weakly_canonical(host.folder, problem)) return host;
  return {.folder = problem ? state_dir : given, .host = host.folder, .host_shared = host.shared};
}

void make_stop_folder(const std::filesystem::path& folder, bool shared) noexcept {
  std::error_code problem;
  if (std::filesystem::create_directories(folder, problem) && shared)
    std::filesystem::permissions(folder, std::filesystem::perms::all | std::filesystem::perms::sticky_bit,
                                 problem);
}

}  // namespace phantom::runtime
