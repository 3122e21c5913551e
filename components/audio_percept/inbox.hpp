#pragma once

#include "common/core/snapshot.hpp"
#include "components/audio_percept/audio_percept.hpp"

namespace phantom::audio_percept {

/// Newest samples on their way from the middleware's threads to the audio thread. One writer per member, one
/// reader.
struct Inbox {
  core::Snapshot<PerceptSample> percept;
  core::Snapshot<LinkSample> master, slave;
  core::Snapshot<AlertSample> alerts;
  core::Snapshot<CommandSample> command;
  core::Snapshot<ViewSample> view;

  /// Brings `inputs` up to date. Real-time safe: yes.
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
