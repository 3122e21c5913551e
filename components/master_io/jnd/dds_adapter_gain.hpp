#pragma once

#include <memory>

#include "common/core/network.hpp"
#include "common/messages/arm_bounds.hpp"
#include "components/master_io/jnd/measurement.hpp"

namespace phantom::master_io {

/// The drag of the running master_io, by operator_command (percept gain of one joint) and master_state.
class RunningDrag : public ComparedDrag {
 public:
  /// `joint`: index from 0. Waits for nothing. Throws dds::DdsError.
  RunningDrag(const core::NetworkOptions& network, const messages::ArmBounds& arm, int joint);
  ~RunningDrag() override;

  /// Waits for master_io's answer for 5 s at most. Also once a stop is requested, so that G can be restored.
  core::Status set_gain(double gain) override;
  /// Errors: no state for 3 s (kUnavailable); a stop of this process is requested.
  core::Expected<messages::Received<messages::MasterState>> next() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::master_io
