#include "components/master_io/reaches/reaches.hpp"

#include <algorithm>
#include <iterator>

#include "common/core/text.hpp"

namespace phantom::master_io {
namespace {

using runtime::Fields;

core::JointArray read_pose(const Fields& reach, const std::string& key, const robot::SerialArm& arm) {
  std::vector<double> values;
  reach.numbers(key, values);
  const std::size_t count = arm.joint_count();
  reach.check(values.size() == count, key,
              "has " + std::to_string(values.size()) + " values; allowed: " + std::to_string(count) +
                  ", one per moving joint of the arm");
  core::JointArray pose{};
  for (std::size_t j = 0; j < count; ++j) {
    const auto& joint = arm.joints()[j];
    pose[j] = values[j];
    reach.check(values[j] >= joint.lower && values[j] <= joint.upper, key,
                "has " + std::to_string(values[j]) + " for " + joint.name +
                    "; allowed: " + std::to_string(joint.lower) + " to " + std::to_string(joint.upper));
  }
  return pose;
}

}  // namespace

std::vector<NamedReach> load_reaches(const std::filesystem::path& path, const robot::SerialArm& arm) {
  const Fields file(path, {kReachKeys});
  std::vector<NamedReach> all;
  for (const Fields& item : file.sections("reaches")) {
    NamedReach& made = all.emplace_back();
    made.label = {item.text("name"), item.text("object")};
    made.reach.from = read_pose(item, "from", arm);
    made.reach.target = read_pose(item, "target", arm);
    using enum simulation::GripperAction;
    item.choice("gripper", made.reach.gripper, {{"none", kNone}, {"open", kOpen}, {"close", kClose}});
    if (item.has("hold_s")) made.reach.hold_s = item.value("hold_s", 0.0);
    item.flag("once", made.reach.once);
    item.flag("presses", made.reach.presses);
  }
  file.check(!all.empty(), "reaches",
             "is missing or empty; allowed: at least one {name, object, from, target}");
  file.finish();
  return all;
}

std::vector<NamedReach> choose_reaches(const Fields& sequence, const std::vector<NamedReach>& all) {
  std::vector<std::string> names;
  sequence.texts("only", names);
  const auto checked = [&](const std::vector<NamedReach>& reaches) {
    const auto repeated = [](const NamedReach& reach) { return !reach.reach.once; };
    sequence.check(std::ranges::any_of(reaches, repeated), "only",
                   "leaves only reaches that are made once; allowed: at least one to repeat");
    return reaches;
  };
  if (names.empty()) return checked(all);
  std::vector<NamedReach> chosen;
  for (const auto& name : names) {
    const std::size_t before = chosen.size();
    std::ranges::copy_if(all, std::back_inserter(chosen),
                         [&](const auto& r) { return r.label.name == name; });
    sequence.check(chosen.size() > before, "only",
                   "names '" + name + "', which is no reach; allowed: " +
                       core::listed(all, [](const auto& r) { return r.label.name; }));
  }
  return checked(chosen);
}

}  // namespace phantom::master_io
