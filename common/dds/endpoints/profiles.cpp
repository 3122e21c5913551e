#include "common/dds/endpoints/profiles.hpp"

#include <array>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fstream>
#include <mutex>
#include <set>
#include <sstream>

#include "common/dds/endpoints/fast_dds_log.hpp"
#include "common/dds/endpoints/participant.hpp"
#include "fast_dds/types.hpp"

namespace phantom::dds {
namespace {

struct ElementName {
  const char *camel_case, *snake_case;
};
constexpr std::array kRenamed{ElementName{"initialHeartbeatDelay", "initial_heartbeat_delay"},
                              ElementName{"heartbeatPeriod", "heartbeat_period"},
                              ElementName{"nackResponseDelay", "nack_response_delay"},
                              ElementName{"nackSupressionDuration", "nack_supression_duration"},
                              ElementName{"initialAcknackDelay", "initial_acknack_delay"},
                              ElementName{"heartbeatResponseDelay", "heartbeat_response_delay"}};

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

}  // namespace

std::string with_names_of_this_version(std::string profiles) {
  for (const ElementName& name : kRenamed) {
    const char* const known = fast_dds::kTimesInSnakeCase ? name.snake_case : name.camel_case;
    const char* const other = fast_dds::kTimesInSnakeCase ? name.camel_case : name.snake_case;
    for (const char* const begin : {"<", "</"})
      replace_all(profiles, begin + std::string(other) + ">", begin + std::string(known) + ">");
  }
  return profiles;
}

// The factory keeps profiles for the process's life and refuses a second file with the same names, so each
// file that it has accepted is loaded once.
void load_profiles(const std::filesystem::path& file) {
  take_over_fast_dds_log();
  static std::mutex mutex;
  static std::set<std::filesystem::path> loaded;
  const std::lock_guard lock(mutex);
  if (!std::filesystem::is_regular_file(file))
    throw core::MissingError(file.string() + ": QoS profiles: no such file");
  const auto known_as = std::filesystem::canonical(file);
  if (loaded.contains(known_as)) return;
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  const std::string profiles = with_names_of_this_version(text.str());
  auto* factory = eprosima::fastdds::dds::DomainParticipantFactory::get_instance();
  if (!fast_dds::ok(factory->load_XML_profiles_string(profiles.data(), profiles.size()))) {
    eprosima::fastdds::dds::Log::Flush();
    throw DdsError(file.string() +
                   ": QoS profiles: the file is refused by Fast DDS (one bad element rejects the whole "
                   "file; the lines above name it)");
  }
  loaded.insert(known_as);
}

}  // namespace phantom::dds
