#pragma once

#include "common/core/snapshot.hpp"
#include "components/audio_percept/audio_percept.hpp"

namespace phantom::audio_percept {

/// Passes the newest samples from the middleware's threads to the audio thread. Each member has one writer
/// and one reader.
struct Inbox {
  core::Snapshot<messages::Received<messages::Percept>> percept;
  core::Snapshot<messages::Received<messages::MasterState>> master;
  core::Snapshot<messages::Received<messages::SlaveState>> slave;
  core::Snapshot<AlertSample> alerts;
  core::Snapshot<CommandSample> command;
  core::Snapshot<ViewSample> view;

  /// Copies the newest samples to `inputs`. Real-time safe: yes.
  void collect(Inputs& inputs) noexcept {
    percept.read(inputs.percept);
    master.read(inputs.master);
    slave.read(inputs.slave);
    alerts.read(inputs.alerts);
    command.read(inputs.command);
    view.read(inputs.view);
  }
};

}  // namespace phantom::audio_percept
