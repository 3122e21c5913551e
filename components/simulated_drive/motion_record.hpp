#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "components/simulated_drive/simulated_drive.hpp"

namespace phantom::simulated_drive {

const char* name_of(SimulatedDrive::Power power) noexcept;

/// Appends what the drives did to a text file of comma-separated values, so that torque and motion are known
/// at the end of the chain, independent of what a master says of them.
///
/// A row: CLOCK_MONOTONIC in ns, node, power state, torque of the motor at the joint (N·m, behind the gear),
/// the joint's angle (rad) and speed (rad/s). A drive has a row whenever its torque or power state changed
/// since its last one, and every kMax_ns in any case. A row is written with the drive's next step: a
/// longer gap means that the process did not run. Not real-time safe.
class MotionRecord {
 public:
  static constexpr core::Nanoseconds kMax_ns = 20 * core::kNsPerMillisecond;

  /// Errors: kNotFound if the file cannot be opened.
  static core::Expected<MotionRecord> open(const std::filesystem::path& path);

  /// Notes the state of a drive after its step. `index`: its place among the drives of this process.
  void note(std::size_t index, const SimulatedDrive& drive, core::Nanoseconds now_ns);
  /// Hands rows on to the system. Returns false if some were lost, for a disk that is full, say.
  bool flush() noexcept;

 private:
  struct Last {
    core::Nanoseconds time_ns = 0;
    double torque_mille = 0.0;
    SimulatedDrive::Power power = SimulatedDrive::Power::kSwitchOnDisabled;
  };
  struct Close {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
  };
  explicit MotionRecord(std::FILE* file) : file_(file) {}

  std::unique_ptr<std::FILE, Close> file_;
  std::vector<Last> last_;
};

}  // namespace phantom::simulated_drive
