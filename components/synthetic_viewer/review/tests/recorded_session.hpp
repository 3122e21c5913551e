#pragma once
// Recordings that tests write: of any samples, and of a session in which everything happens.

#include <filesystem>
#include <map>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>

#include "common/dds/endpoints/cdr.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/living.hpp"
#include "common/recording/mcap_writer.hpp"
#include "common/recording/recordings.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"

namespace phantom::synthetic_viewer::test {

/// Writes a recording as dds_recorder does.
class RecordingWriter {
 public:
  static constexpr core::Nanoseconds kBegin_ns = 1'700'000'000 * core::kNsPerSecond;

  /// Replaces the file if it is there.
  explicit RecordingWriter(const std::filesystem::path& file, std::size_t chunk_bytes = 16384)
      : sink_((std::filesystem::remove(file), recording::FileSink::create(file).value())),
        writer_(*sink_, {.profile = "", .library = "test", .chunk_bytes = chunk_bytes, .zstd_level = 1}) {}

  /// `t_s`: from kBegin_ns. `process`: who writes.
  template <class T>
  void put(const dds::TopicSpec<T>& topic, T message, double t_s, unsigned process = 1) {
    if constexpr (requires { message.stamp(); }) {
      message.stamp().sequence_number(++numbers_[{topic.name, process}]);
      message.stamp().session(1000 + process);
      message.stamp().monotonic_ns(core::from_seconds(t_s) + 1);
    }
    put_as_it_is(topic, message, t_s, process);
  }
  template <class T>
  void put_as_it_is(const dds::TopicSpec<T>& topic, const T& message, double t_s, unsigned process = 1) {
    static const dds::CdrCodec codec(topic);  // of this type
    recording::Bytes bytes;
    if (!codec.encode(&message, bytes)) throw std::runtime_error("cannot be encoded");
    put_bytes(topic.name, bytes, t_s, process);
  }
  void put_bytes(const std::string& topic, const recording::Bytes& bytes, double t_s, unsigned process = 1) {
    const auto at_ns = static_cast<std::uint64_t>(kBegin_ns + core::from_seconds(t_s));
    put_at(topic, bytes, at_ns, process);
  }
  void put_at(const std::string& topic, const recording::Bytes& bytes, std::uint64_t at_ns,
              unsigned process = 1, bool carried_over = false) {
    const std::string key = topic + std::to_string(process) + (carried_over ? "c" : "");
    if (!channels_.contains(key)) {
      const std::string byte = (process < 16 ? "0" : "") + std::to_string(process);
      recording::StringMap about{{"writer", byte + ".00.00.00.00.00.00.00.00.00.00.01|00.00.07.03"}};
      if (carried_over) about["carried_over"] = "yes";
      if (const auto named = partitions.find(process); named != partitions.end())
        about[recording::kPartition] = named->second;
      channels_[key] =
          writer_.add_channel({.topic = topic, .message_encoding = "cdr", .metadata = about}).value();
    }
    if (!writer_.write(recording::Message{
            .channel_id = channels_[key], .log_time_ns = at_ns, .publish_time_ns = at_ns, .data = bytes}))
      throw std::runtime_error("cannot be written");
  }
  /// In which DDS partition a process writes; without an entry the recording does not say.
  std::map<unsigned, std::string> partitions;

  void finish() {
    if (!writer_.finish() || !sink_->sync()) throw std::runtime_error("cannot be finished");
  }

 private:
  std::unique_ptr<recording::FileSink> sink_;
  recording::McapWriter writer_;
  std::map<std::string, std::uint16_t> channels_;
  std::map<std::pair<std::string, unsigned>, std::uint64_t> numbers_;
};

/// A session of `seconds` s, with all that makes a reader's state depend on what came before: lost samples,
/// a second process, damaged samples, a stop, alerts, a successor of the server, commands for views.
/// `rate_hz`: of states. The same for the same seed.
inline void write_session(RecordingWriter& writer, const std::vector<double>& home, std::size_t links,
                          double seconds, double rate_hz, unsigned seed) {
  std::mt19937 random(seed);
  const auto chance = [&](double share) { return std::uniform_real_distribution<>(0, 1)(random) < share; };
  const auto draw = [&](double from, double to) {
    return std::uniform_real_distribution<>(from, to)(random);
  };
  const auto object = [&](std::uint16_t id, const char* name, double t_s, unsigned server) {
    messages::WorkspaceObject made{id, name, 77U + id, {}, {0.5F, 0.5F, 0.5F}};
    made.X_WO.translation_m.x() = draw(-0.5, 0.5);
    writer.put(dds::kWorkspaceObject, messages::to_idl(made), t_s, server);
    return made.X_WO;
  };
  const auto version = [&](std::uint64_t number, double t_s, unsigned server) {
    messages::WorkspaceVersion made;
    made.cell = "two_plates";
    made.description.version = number;
    made.description.grid.voxel_size_m = 0.005;
    made.description.grid.size_vox = {100, 100, 100};
    made.description.palette_Pa_s_per_m = {0.0F, 1.0F};
    writer.put(dds::kWorkspaceVersion, messages::to_idl(made), t_s, server);
  };
  object(1, "upright", 0.0, 9);
  // What a depth camera finds of an object, and a thing that it sees.
  messages::PoseFinding finding{.id = 2, .verdict = messages::PoseVerdict::kElsewhere, .camera = "above"};
  finding.corrected_WO = finding.X_WO = object(2, "floor", 0.0, 9);
  finding.shift_m = 0.1;
  const auto find = [&](double t_s, messages::PoseVerdict verdict) {
    finding.verdict = verdict;
    writer.put(dds::kPoseFinding, messages::to_idl(finding), t_s, 7);
  };
  const auto see = [&](double t_s, messages::LiveStanding standing) {
    const messages::LiveObject thing{messages::kFirstLiveObjectId, standing, "bucket"};
    writer.put(dds::kLiveObject, messages::to_idl(thing), t_s, 9);
  };
  version(1, 0.001, 9);
  messages::SlaveState arm;
  arm.joint_count = static_cast<std::uint32_t>(home.size());
  std::copy(home.begin(), home.end(), arm.position.begin());
  std::uint32_t alert = 0;
  bool open = false;
  const auto samples = static_cast<std::int64_t>(seconds * rate_hz);
  for (std::int64_t i = 0; i < samples; ++i) {
    const double t_s = 0.01 + static_cast<double>(i) / rate_hz;
    const bool stopped = t_s > 0.4 * seconds && t_s < 0.5 * seconds;
    const bool silent = t_s > 0.7 * seconds && t_s < 0.73 * seconds;  // a gap in all states
    if (!silent) {
      arm.state = stopped ? teleop::LinkState::kStopped : teleop::LinkState::kCoupled;
      arm.stop = stopped ? teleop::StopRecord{.id = 5, .cause = teleop::StopCause::kEmergency}
                         : teleop::StopRecord{};
      arm.position[0] = home[0] + draw(-0.1, 0.1);
      arm.contact = chance(0.02);
      auto message = messages::to_idl(arm);
      if (chance(0.01))
        writer.put_bytes(dds::kSlaveState.name, recording::Bytes(40, 0xee), t_s);
      else if (chance(0.01))
        writer.put_as_it_is(dds::kSlaveState, message, t_s);  // without a number
      else
        writer.put(dds::kSlaveState, message, t_s);
      if (chance(0.004)) writer.put(dds::kSlaveState, message, t_s, 2);  // a second process
      messages::MasterState master;
      master.state = arm.state;
      master.joint_count = arm.joint_count;
      for (std::size_t j = 0; j < home.size(); ++j) {
        master.percept_torque_Nm[j] = draw(-2, 2);
        master.feedback_torque_Nm[j] = draw(-1, 1);
      }
      writer.put(dds::kMasterState, messages::to_idl(master), t_s + 1e-4);
      messages::Percept percept;
      percept.valid = !chance(0.05);
      if (!percept.valid) percept.condition = messages::PerceptCondition::kStateStale;
      percept.joint_count = arm.joint_count;
      if (percept.valid) percept.closeness = draw(0, 1), percept.speed_m_s = draw(0, 0.6), percept.object = 1;
      percept.mu_Pa_s_per_m = percept.closeness;
      writer.put(dds::kPercept, messages::to_idl(percept), t_s + 2e-4);
    }
    if (i % 10 == 0) {
      messages::SkinPercept skin;
      skin.valid = true;
      skin.patch_m = 0.05;
      skin.greatest_mu_Pa_s_per_m = 1.0;
      skin.patch_count = 10;
      for (std::uint32_t link = 1; link < links; ++link)
        if (chance(0.3)) skin.felt.push_back({link, {0.1F, 0, 0}, static_cast<float>(draw(0.1, 1))});
      writer.put(dds::kSkinPercept, messages::to_idl(skin), t_s + 3e-4);
    }
    if (chance(0.03)) {
      messages::HitAlert hit;
      hit.alert = open ? alert : ++alert;
      hit.cleared = open;
      open = !open;
      hit.rule = percept::HitRule::kVeryClose;
      hit.link = 1;
      hit.link_name = "arm";
      hit.object = 1;
      hit.look_at_m = {draw(-0.2, 0.2), 0, 0.5};
      hit.pgv = {0, 0.02, 0};
      writer.put(dds::kHitAlert, messages::to_idl(hit), t_s + 4e-4);
    }
    if (i % static_cast<std::int64_t>(std::max(1.0, rate_hz / 2)) == 0) {
      for (const auto& [name, process] :
           {std::pair("slave_io", 1U), {"wva_server", t_s < 0.3 * seconds ? 9U : 8U}}) {
        messages::ComponentStatus status;
        status.component = name;
        status.host = "host";
        status.message = std::to_string(i);
        status.state = core::ComponentState::kRunning;
        writer.put(dds::kComponentStatus, messages::to_idl(status), t_s + 5e-4, process);
      }
    }
    const auto is_at = [&](double share) {
      return i == static_cast<std::int64_t>(share * seconds * rate_hz);
    };
    if (is_at(0.15)) see(t_s, messages::LiveStanding::kTracked);
    if (is_at(0.2)) find(t_s, messages::PoseVerdict::kElsewhere);
    if (is_at(0.55)) see(t_s, messages::LiveStanding::kFrozen);
    if (is_at(0.6)) find(t_s, messages::PoseVerdict::kAgrees);
    if (is_at(0.8)) see(t_s, messages::LiveStanding::kLost);
    if (is_at(0.3)) {  // the server's successor
      object(1, "upright", t_s, 8);
      object(3, "pump", t_s, 8);
      version(2, t_s, 8);
    }
    if (chance(0.01)) {
      messages::OperatorCommand command;
      command.kind = chance(0.5) ? teleop::CommandKind::kViewNode : teleop::CommandKind::kViewHold;
      command.value = chance(0.5) ? 1 : 0;
      writer.put(dds::kOperatorCommand, messages::to_idl(command), t_s + 6e-4);
    }
  }
}

}  // namespace phantom::synthetic_viewer::test
