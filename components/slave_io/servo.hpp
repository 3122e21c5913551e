#pragma once

#include "common/core/snapshot.hpp"
#include "common/runtime/periodic_loop.hpp"
#include "common/runtime/wake_signal.hpp"
#include "components/slave_io/contact_log.hpp"
#include "components/slave_io/dds_adapter.hpp"
#include "components/slave_io/model.hpp"

namespace phantom::slave_io {

/// The servo thread's work: newest inputs from the inbox, controller, simulated arm, outputs to the outbox.
/// It never calls DDS, allocates or waits.
class Servo {
 public:
  Servo(const ArmModel& model, const Config& config, const teleop::ContactWorld& world, Inbox& inbox);

  /// One tick of `dt_s`, a whole multiple of the period, at `now_ns` on the monotonic clock. Periods that the
  /// loop missed are made up for, up to kMostMadeUp, so that the simulated arm keeps real time. Real-time
  /// safe: yes.
  void tick(double dt_s, core::Nanoseconds now_ns) noexcept;

  static constexpr int kMostMadeUp = 10;
  core::Snapshot<SlaveReport> outbox;                                ///< reader: the thread that publishes
  runtime::WakeSignal published;                                     ///< raised after each tick
  const ContactLog& contacts() const noexcept { return contacts_; }  ///< once the servo thread has ended
  std::size_t contact_point_count() const noexcept { return plant_.contact_point_count(); }

 private:
  Inbox& inbox_;
  double period_s_;
  bool force_sensor_;
  SlaveInputs inputs_;
  SlaveIo controller_;
  teleop::SlavePlant plant_;
  ContactLog contacts_;
};

}  // namespace phantom::slave_io
