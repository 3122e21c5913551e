#include "common/dds/endpoints/profiles.hpp"

#include <tinyxml2.h>

#include <array>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fstream>
#include <mutex>
#include <sstream>
#include <string_view>

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

constexpr std::string_view kDefaults =
#include "phantom_contract/qos_profiles.inc"
    ;

/// Puts what `from` says into `to`: an element replaces that of its name, but one that holds elements is
/// merged into it.
void merge(const tinyxml2::XMLElement& from, tinyxml2::XMLElement& to) {
  for (const auto* one = from.FirstChildElement(); one != nullptr; one = one->NextSiblingElement()) {
    auto* const other = to.FirstChildElement(one->Name());
    if (other != nullptr && one->FirstChildElement() != nullptr && other->FirstChildElement() != nullptr) {
      merge(*one, *other);
      continue;
    }
    auto* const copy = one->DeepClone(to.GetDocument());
    if (other == nullptr) {
      to.InsertEndChild(copy);
    } else {
      to.InsertAfterChild(other, copy);
      to.DeleteChild(other);
    }
  }
}

tinyxml2::XMLElement* profile_named(tinyxml2::XMLElement& profiles, const char* end, const char* name) {
  for (auto* one = profiles.FirstChildElement(end); one != nullptr; one = one->NextSiblingElement(end)) {
    if (one->Attribute("profile_name", name) != nullptr) return one;
  }
  return nullptr;
}

}  // namespace

std::string default_profiles() { return std::string(kDefaults); }

std::string overridden_profiles(const std::string& place, const std::string& overrides) {
  const auto refuse = [&](int line, const std::string& why) {
    throw DdsError(place + ":" + std::to_string(line) + ": QoS profiles: " + why);
  };
  tinyxml2::XMLDocument defaults, site;
  defaults.Parse(with_names_of_this_version(default_profiles()).c_str());
  if (site.Parse(with_names_of_this_version(overrides).c_str()) != tinyxml2::XML_SUCCESS)
    refuse(site.ErrorLineNum(), "no XML: " + std::string(site.ErrorName()));
  auto* const profiles = defaults.RootElement()->FirstChildElement("profiles");
  auto* const root = site.RootElement();
  if (root == nullptr) refuse(1, "no element <profiles>");
  auto* const own = std::string_view(root->Name()) == "profiles" ? root : root->FirstChildElement("profiles");
  if (own == nullptr) refuse(root->GetLineNum(), "no element <profiles>");
  for (const auto* one = own->FirstChildElement(); one != nullptr; one = one->NextSiblingElement()) {
    const std::string_view end = one->Name();
    if (end != "data_writer" && end != "data_reader")
      refuse(one->GetLineNum(), "<" + std::string(end) + ">; allowed: <data_writer>, <data_reader>");
    const char* const name = one->Attribute("profile_name");
    auto* const known = name != nullptr ? profile_named(*profiles, one->Name(), name) : nullptr;
    if (known == nullptr)
      refuse(one->GetLineNum(),
             "no topic is called '" + std::string(name != nullptr ? name : "") + "'; idl/ has them");
    merge(*one, *known);
  }
  tinyxml2::XMLPrinter printer(nullptr, true);
  defaults.Print(&printer);
  return printer.CStr();
}

std::string with_names_of_this_version(std::string profiles) {
  for (const ElementName& name : kRenamed) {
    const char* const known = fast_dds::kTimesInSnakeCase ? name.snake_case : name.camel_case;
    const char* const other = fast_dds::kTimesInSnakeCase ? name.camel_case : name.snake_case;
    for (const char* const begin : {"<", "</"})
      replace_all(profiles, begin + std::string(other) + ">", begin + std::string(known) + ">");
  }
  return profiles;
}

// The factory keeps profiles for the process's life and refuses a second set with the same names, so what it
// has accepted is loaded once.
void load_profiles(const std::filesystem::path& file) {
  take_over_fast_dds_log();
  static std::mutex mutex;
  static std::string loaded;
  const std::lock_guard lock(mutex);
  if (!std::filesystem::is_regular_file(file))
    throw core::MissingError(file.string() + ": QoS profiles: no such file");
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  const std::string profiles = overridden_profiles(file.string(), text.str());
  if (profiles == loaded) return;
  auto* factory = eprosima::fastdds::dds::DomainParticipantFactory::get_instance();
  if (!fast_dds::ok(factory->load_XML_profiles_string(profiles.data(), profiles.size()))) {
    eprosima::fastdds::dds::Log::Flush();
    throw DdsError(file.string() +
                   ": QoS profiles: the file is refused by Fast DDS (one bad element rejects the whole "
                   "file; the lines above name it)");
  }
  loaded = profiles;
}

}  // namespace phantom::dds
