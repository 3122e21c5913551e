#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/core/joints.hpp"
#include "components/master_io/master_io.hpp"

namespace phantom::master_io {

/// Results of one reach.
struct ReachRecord {
  std::int32_t number = -1;
  std::size_t index = 0;  ///< index among the configured reaches
  bool percept = false;
  double start_s = 0.0;
  double contact_s = -1.0;         ///< since the servo began; −1: no contact
  double contact_speed_m_s = 0.0;  ///< speed of the tool in the last slave_state before the contact
  std::uint16_t contact_object = 0;
  double onset_clearance_m =
      -1.0;  ///< clearance when the percept torque first exceeded kFelt_Nm; −1: never, or clearance unknown
  double peak_percept_Nm = 0.0;  ///< greatest of any joint before the contact
  double peak_operator_Nm =
      0.0;  ///< greatest torque of the hand before the contact (at constant velocity: MLT)
};

/// Inputs of the log for one tick.
struct ReachObservation {
  std::int32_t number = -1;
  std::size_t index = 0;
  bool percept = false;
  core::JointArray percept_Nm{}, operator_Nm{};
};

/// Records the session's first reaches without heap allocation.
class ReachLog {
 public:
  static constexpr std::size_t kCapacity = 512;
  static constexpr double kFelt_Nm = 0.02;

  /// Real-time safe: yes.
  void step(const ReachObservation& seen, const messages::SlaveState& slave, double dt_s) noexcept {
    now_s_ += dt_s;
    const bool touches = slave.contact && !touched_;
    if (seen.number >= 0 && (count_ == 0 || records_[count_ - 1].number != seen.number) &&
        count_ < kCapacity) {
      records_[count_] = {};
      records_[count_].number = seen.number;
      records_[count_].index = seen.index;
      records_[count_].percept = seen.percept;
      records_[count_].start_s = now_s_;
      ++count_;
    }
    if (count_ > 0 && records_[count_ - 1].number == seen.number && records_[count_ - 1].contact_s < 0.0) {
      note(records_[count_ - 1], seen, slave, touches);
    }
    touched_ = slave.contact;
    last_speed_m_s_ = slave.tool_speed_m_s;
  }

  std::size_t size() const noexcept { return count_; }
  const ReachRecord& operator[](std::size_t i) const noexcept { return records_[i]; }

 private:
  void note(ReachRecord& record, const ReachObservation& seen, const messages::SlaveState& slave,
            bool touches) const noexcept {
    if (touches) {
      record.contact_s = now_s_;
      record.contact_speed_m_s = last_speed_m_s_;
      record.contact_object = slave.contact_object;
      return;
    }
    const double percept_Nm = greatest(seen.percept_Nm);
    if (record.onset_clearance_m < 0.0 && record.peak_percept_Nm <= kFelt_Nm && percept_Nm > kFelt_Nm) {
      record.onset_clearance_m = slave.clearance_m;
    }
    record.peak_percept_Nm = std::max(record.peak_percept_Nm, percept_Nm);
    record.peak_operator_Nm = std::max(record.peak_operator_Nm, greatest(seen.operator_Nm));
  }
  static double greatest(const core::JointArray& values) noexcept {
    double most = 0.0;
    for (const double value : values) most = std::max(most, std::abs(value));
    return most;
  }

  std::array<ReachRecord, kCapacity> records_{};
  std::size_t count_ = 0;
  double now_s_ = 0.0, last_speed_m_s_ = 0.0;
  bool touched_ = false;
};

}  // namespace phantom::master_io
