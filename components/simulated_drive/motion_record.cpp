#include "components/simulated_drive/motion_record.hpp"

#include <cerrno>
#include <cstring>

namespace phantom::simulated_drive {

const char* name_of(SimulatedDrive::Power power) noexcept {
  constexpr const char* kNames[] = {"disabled",   "ready",          "switched_on", "enabled",
                                    "quick_stop", "fault_reaction", "fault"};
  return kNames[static_cast<std::size_t>(power)];
}

core::Expected<MotionRecord> MotionRecord::open(const std::filesystem::path& path) {
  std::FILE* file = std::fopen(path.c_str(), "a");
  if (file == nullptr) return core::Status::not_found(path.string() + ": " + std::strerror(errno));
  return MotionRecord(file);
}

void MotionRecord::note(std::size_t index, const SimulatedDrive& drive, core::Nanoseconds now_ns) {
  if (index >= last_.size()) last_.resize(index + 1);
  Last& last = last_[index];
  const bool changed = last.torque_mille != drive.torque_mille() || last.power != drive.power();
  if (!changed && now_ns - last.time_ns < kMax_ns) return;
  last = {now_ns, drive.torque_mille(), drive.power()};
  const MotorParameters& motor = drive.motor().parameters();
  std::fprintf(file_.get(), "%lld,%d,%s,%.6g,%.6f,%.6g,%s\n", static_cast<long long>(now_ns), drive.node(),
               name_of(drive.power()), drive.torque_mille() * 1e-3 * motor.rated_torque_Nm * motor.gear_ratio,
               drive.motor().joint_rad(), drive.motor().joint_rad_s(), drive.lies() ? "false" : "true");
}

bool MotionRecord::flush() noexcept {
  const bool written = std::fflush(file_.get()) == 0 && std::ferror(file_.get()) == 0;
  std::clearerr(file_.get());
  return written;
}

}  // namespace phantom::simulated_drive
