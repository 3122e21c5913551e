#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot {

/// Fingerprints of the arm and the cell that a process works with, so that hosts with different files are
/// found. Lengths and angles count to 1e-6.
struct ModelIdentity {
  std::string arm_file, cell_file;       ///< where they were read, for messages
  std::uint32_t cell = 0;                ///< of the cell; 0: not known
  std::uint32_t base = 0;                ///< of the arm's place in the cell
  std::vector<std::uint32_t> joints;     ///< of each joint: name, type, axis, origin, limits
  std::vector<std::string> joint_names;  ///< for messages
  std::vector<std::string> joint_texts;  ///< what each has, for messages
};

/// Returns the identity of an arm. The files and the cell are left to the caller.
ModelIdentity identify(const SerialArm& arm);

/// Adds to a fingerprint (FNV-1a of 32 bits), which begins with kFingerprintStart.
inline constexpr std::uint32_t kFingerprintStart = 2166136261U;
std::uint32_t add_to_fingerprint(std::uint32_t fingerprint, std::string_view text);
std::uint32_t add_to_fingerprint(std::uint32_t fingerprint, double value);
std::uint32_t add_to_fingerprint(std::uint32_t fingerprint, const geometry::Pose& pose);

/// Returns one number for the whole arm: base and joints.
std::uint32_t fingerprint_of_arm(const ModelIdentity& identity);

/// Returns the text by which a process announces its model to others, in USER_DATA of its writers.
std::string label_of(const ModelIdentity& identity);

/// Returns by what the model of another process differs from `own`, in one sentence that names files, joint
/// and what it has here; empty: by nothing, or the other's label does not say. `label`: as label_of() makes
/// it, from the network.
std::string difference(const ModelIdentity& own, std::string_view label);

}  // namespace phantom::robot
