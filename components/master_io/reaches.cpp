#include "components/master_io/reaches.hpp"

namespace phantom::master_io {
namespace {

using runtime::ConfigReader;

core::JointArray read_pose(const ConfigReader& reach, const std::string& key, const robot::SerialArm& arm) {
  const auto values = reach.numbers(key);
  const std::size_t count = arm.joint_count();
  if (values.size() != count) {
    throw reach.error(key, "has " + std::to_string(values.size()) + " values; allowed: " +
                               std::to_string(count) + ", one per moving joint of the arm");
  }
  core::JointArray pose{};
  for (std::size_t j = 0; j < count; ++j) {
    const auto& joint = arm.joints()[j];
    pose[j] = values[j];
    if (values[j] >= joint.lower && values[j] <= joint.upper) continue;
    throw reach.error(key, "has " + std::to_string(values[j]) + " for " + joint.name + "; allowed: " +
                               std::to_string(joint.lower) + " to " + std::to_string(joint.upper));
  }
  return pose;
}

}  // namespace

std::vector<NamedReach> load_reaches(const std::filesystem::path& path, const robot::SerialArm& arm) {
  const ConfigReader file = ConfigReader::from_file(path);
  std::vector<NamedReach> all;
  for (const auto& item : file.sections("reaches")) {
    all.push_back({{item.text("name"), item.text("object", "")},
                   {read_pose(item, "from", arm), read_pose(item, "target", arm)}});
  }
  if (all.empty())
    throw file.error("reaches", "is missing or empty; allowed: at least one {name, object, from, target}");
  file.finish();
  return all;
}

std::vector<NamedReach> choose_reaches(const ConfigReader& sequence, const std::vector<NamedReach>& all) {
  const auto names = sequence.has("only") ? sequence.texts("only") : std::vector<std::string>{};
  if (names.empty()) return all;
  std::vector<NamedReach> chosen;
  for (const auto& name : names) {
    std::string known;
    const std::size_t before = chosen.size();
    for (const auto& candidate : all) {
      if (candidate.label.name == name) chosen.push_back(candidate);
      known += (known.empty() ? "" : ", ") + candidate.label.name;
    }
    if (chosen.size() == before)
      throw sequence.error("only", "names '" + name + "', which is no reach; allowed: " + known);
  }
  return chosen;
}

}  // namespace phantom::master_io
