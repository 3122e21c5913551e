#include "common/robot/kinematics/model_identity.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "common/core/joints.hpp"
#include "common/core/printable.hpp"

namespace phantom::robot {
namespace {

constexpr std::string_view kLabelBegin = "phantom_model=1;";
constexpr std::size_t kMaxFile = 100;

std::string hex(std::uint32_t number) {
  std::array<char, 9> text{};
  std::snprintf(text.data(), text.size(), "%08x", number);
  return text.data();
}

std::optional<std::uint32_t> number_in(std::string_view text) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, 16);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

// The end of a path says more than its beginning. A label's own separators are left out.
std::string short_file(const std::string& file) {
  std::string text = file.size() <= kMaxFile ? "" : "…";
  text.append(file, file.size() <= kMaxFile ? 0 : file.size() - kMaxFile);
  std::erase_if(text, [](char c) { return c == ';' || c == '='; });
  return text;
}

/// Returns the value of `key` in a label; nothing if it has none.
std::optional<std::string_view> value_in(std::string_view label, std::string_view key) {
  while (!label.empty()) {
    const auto end = std::min(label.find(';'), label.size());
    const std::string_view field = label.substr(0, end);
    if (field.starts_with(key) && field.size() > key.size() && field[key.size()] == '=')
      return field.substr(key.size() + 1);
    label.remove_prefix(std::min(end + 1, label.size()));
  }
  return std::nullopt;
}

std::vector<std::uint32_t> numbers_in(std::string_view list) {
  std::vector<std::uint32_t> numbers;
  while (!list.empty() && numbers.size() <= core::kMaxJoints) {
    const auto end = std::min(list.find(','), list.size());
    if (const auto number = number_in(list.substr(0, end))) numbers.push_back(*number);
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return numbers;
}

std::string text_of(const Joint& joint) {
  std::array<char, 256> text{};
  const Eigen::Vector3d& p = joint.X_parent_joint.translation_m;
  const Eigen::Vector3d& a = joint.axis;
  std::snprintf(text.data(), text.size(),
                "%s about (%.4g %.4g %.4g), origin (%.4g %.4g %.4g) m, %.4g to %.4g, speed %.4g, effort %.4g",
                joint.type == JointType::kPrismatic ? "prismatic" : "revolute", a.x(), a.y(), a.z(), p.x(),
                p.y(), p.z(), joint.lower, joint.upper, joint.max_speed, joint.max_effort);
  return text.data();
}

// Where a file comes from the network it may hold anything.
std::string file_in(std::string_view label, std::string_view key) {
  const std::string file(value_in(label, key).value_or("?"));
  return core::is_printable(file) ? file : "?";
}

}  // namespace

std::uint32_t add_to_fingerprint(std::uint32_t fingerprint, std::string_view text) {
  for (const char c : text) fingerprint = (fingerprint ^ static_cast<std::uint8_t>(c)) * 16777619U;
  return (fingerprint ^ 0xffU) * 16777619U;  // ends the text
}

std::uint32_t add_to_fingerprint(std::uint32_t fingerprint, double value) {
  constexpr double kMillionth = 1e6, kFarthest = 9e12;
  const double steps = std::isnan(value) ? kFarthest : std::clamp(value, -kFarthest, kFarthest) * kMillionth;
  auto bits = static_cast<std::uint64_t>(std::llround(std::clamp(steps, -9e18, 9e18)));
  for (int i = 0; i < 8; ++i, bits >>= 8U)
    fingerprint = (fingerprint ^ static_cast<std::uint8_t>(bits)) * 16777619U;
  return fingerprint;
}

std::uint32_t add_to_fingerprint(std::uint32_t fingerprint, const geometry::Pose& pose) {
  for (int i = 0; i < 3; ++i) fingerprint = add_to_fingerprint(fingerprint, pose.translation_m[i]);
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row)
      fingerprint = add_to_fingerprint(fingerprint, pose.rotation(row, column));
  return fingerprint;
}

ModelIdentity identify(const SerialArm& arm) {
  ModelIdentity identity;
  identity.base = add_to_fingerprint(kFingerprintStart, arm.base_pose());
  for (const Joint& joint : arm.joints()) {
    std::uint32_t print = add_to_fingerprint(kFingerprintStart, joint.name);
    print = add_to_fingerprint(print, joint.type == JointType::kPrismatic ? "prismatic" : "revolute");
    for (int i = 0; i < 3; ++i) print = add_to_fingerprint(print, joint.axis[i]);
    print = add_to_fingerprint(print, joint.X_parent_joint);
    for (const double limit : {joint.lower, joint.upper, joint.max_speed, joint.max_effort})
      print = add_to_fingerprint(print, limit);
    identity.joints.push_back(print);
    identity.joint_names.push_back(joint.name);
    identity.joint_texts.push_back(text_of(joint));
  }
  return identity;
}

std::uint32_t fingerprint_of_arm(const ModelIdentity& identity) {
  std::uint32_t print = add_to_fingerprint(kFingerprintStart, hex(identity.base));
  for (const std::uint32_t joint : identity.joints) print = add_to_fingerprint(print, hex(joint));
  return print;
}

std::string label_of(const ModelIdentity& identity) {
  std::string label(kLabelBegin);
  const auto add = [&label](const char* key, const std::string& value) {
    label.append(key).append("=").append(value).append(";");
  };
  add("arm", short_file(identity.arm_file));
  add("cell", short_file(identity.cell_file));
  add("cell_print", hex(identity.cell));
  add("base", hex(identity.base));
  std::string joints;
  for (const std::uint32_t joint : identity.joints)
    joints.append(joints.empty() ? "" : ",").append(hex(joint));
  add("joints", joints);
  return label;
}

std::string difference(const ModelIdentity& own, std::string_view label) {
  if (!label.starts_with(kLabelBegin) || own.joints.empty()) return "";
  const auto joints = numbers_in(value_in(label, "joints").value_or(""));
  const std::string files = own.arm_file + " here, " + file_in(label, "arm") + " there";
  if (joints.empty()) return "";
  if (joints.size() != own.joints.size())
    return "its arm has " + std::to_string(joints.size()) + " joints, this one's " +
           std::to_string(own.joints.size()) + " (" + files + ")";
  for (std::size_t j = 0; j < joints.size(); ++j)
    if (joints[j] != own.joints[j])
      return "its arm has another joint " + own.joint_names[j] + " (" + files + "); here it is " +
             own.joint_texts[j];
  const auto base = number_in(value_in(label, "base").value_or(""));
  if (base && *base != own.base) return "its arm stands elsewhere in the cell (" + files + ")";
  const auto cell = number_in(value_in(label, "cell_print").value_or(""));
  if (cell && *cell != 0 && own.cell != 0 && *cell != own.cell)
    return "its cell is another (" + own.cell_file + " here, " + file_in(label, "cell") + " there)";
  return "";
}

}  // namespace phantom::robot
