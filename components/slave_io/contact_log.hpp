#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/simulation/slave_plant.hpp"

namespace phantom::slave_io {

/// One contact, from its first tick to its last.
struct ContactEpisode {
  double start_s = 0.0;  ///< since the servo began
  double duration_s = 0.0;
  double tool_speed_m_s = 0.0;  ///< in the tick before the contact
  double peak_force_N = 0.0;
  std::uint16_t object = 0;
  Eigen::Vector3d point_W_m = Eigen::Vector3d::Zero();  ///< the point touched first
};

/// Records the session's first contacts without heap allocation.
class ContactLog {
 public:
  static constexpr std::size_t kCapacity = 256;
  /// Contacts less than this time apart count as one (a tool that chatters on a surface).
  static constexpr double kSameTouch_s = 0.05;

  /// Real-time safe: yes.
  void step(const simulation::ContactReport& report, double tool_speed_m_s, double dt_s) noexcept {
    now_s_ += dt_s;
    since_s_ += dt_s;
    if (report.contact) {
      if (since_s_ > kSameTouch_s) {
        ++seen_;
        if (count_ < kCapacity) {
          episodes_[count_++] = {now_s_, 0.0, last_speed_m_s_, 0.0, report.object, report.point_W_m};
        }
      }
      since_s_ = 0.0;
      if (seen_ == count_ && count_ > 0) {
        ContactEpisode& now = episodes_[count_ - 1];
        now.duration_s = now_s_ - now.start_s;
        if (report.force_N > now.peak_force_N) now.peak_force_N = report.force_N;
      }
    }
    last_speed_m_s_ = tool_speed_m_s;
  }

  std::size_t size() const noexcept { return count_; }
  std::uint64_t seen() const noexcept { return seen_; }  ///< contacts, also those beyond the capacity
  const ContactEpisode& operator[](std::size_t i) const noexcept { return episodes_[i]; }

 private:
  std::array<ContactEpisode, kCapacity> episodes_{};
  std::size_t count_ = 0;
  std::uint64_t seen_ = 0;
  double now_s_ = 0.0, since_s_ = 1e9, last_speed_m_s_ = 0.0;
};

}  // namespace phantom::slave_io
