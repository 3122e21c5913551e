#include "components/phantom_sensing/tools/dds_adapter_replay.hpp"

#include <algorithm>
#include <deque>
#include <iostream>
#include <map>
#include <optional>
#include <variant>

#include "common/core/errors.hpp"
#include "common/dds/endpoints/cdr.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/recording/mcap_reader.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/process/process.hpp"
#include "components/phantom_sensing/dds_adapter_messages.hpp"
#include "components/phantom_sensing/model.hpp"

namespace phantom::phantom_sensing {
namespace {

constexpr std::size_t kMaxStates = 5000, kMaxVersions = 4, kMaxDifferences = 10;
// Topics are recorded independently: an output can be recorded before its inputs.
constexpr std::uint64_t kPatience_ns = 500'000'000;

using Name = std::pair<std::uint64_t, std::uint64_t>;  // of a stamp: session, sequence number

/// An output of the recorded component.
struct Output {
  std::variant<msg::DragField, msg::Percept, msg::InterestPoints, msg::SensingReply> sample;
  std::vector<std::uint8_t> bytes;
  std::uint64_t log_time_ns = 0;
  const msg::Stamp& stamp() const {
    return std::visit([](const auto& s) -> const msg::Stamp& { return s.stamp(); }, sample);
  }
};

/// Returns whether the recorded bytes equal the replayed ones. RTPS pads a sample with meaningless bytes to a
/// multiple of four.
bool is_same(const std::vector<std::uint8_t>& made, const std::vector<std::uint8_t>& recorded) {
  const std::size_t padded = (made.size() + 3) / 4 * 4;
  return (recorded.size() == made.size() || recorded.size() == padded) &&
         std::equal(made.begin(), made.end(), recorded.begin());
}

class Replay {
 public:
  Replay(const PhantomModel& model, const PerceptSettings& settings, ContactRegister contacts)
      : model_(model), settings_(settings), contacts_(std::move(contacts)), parts_(model, settings) {}

  void take(const std::string& topic, const recording::Message& message) {
    if (topic == dds::kSlaveState.name) {
      if_sound(dds::kSlaveState, message,
               [this](const messages::SlaveState& state) { keep(state, states_); });
    } else if (topic == dds::kGripperState.name) {
      if_sound(dds::kGripperState, message,
               [this](const messages::GripperState& gripper) { keep(gripper, grippers_); });
    } else if (topic == dds::kWorkspaceBrick.name) {
      if_sound(dds::kWorkspaceBrick, message, [this](const messages::WorkspaceBrick& brick) {
        (void)assembler_.put_brick(brick.key, brick.version, brick.voxels_zstd);
      });
      keep_version();
    } else if (topic == dds::kWorkspaceVersion.name) {
      if_sound(dds::kWorkspaceVersion, message, [this](const messages::WorkspaceVersion& version) {
        if (assembler_.commit(version.description)) carried_[version.description.version] = version.carried;
      });
      keep_version();
    } else if (topic == dds::kMeshChunk.name) {
      if_sound(dds::kMeshChunk, message,
               [this](const messages::MeshChunk& chunk) { (void)parts_.put(chunk); });
      keep_version();
    } else if (topic == dds::kSensingCommand.name) {
      if_sound(dds::kSensingCommand, message, [this](const messages::SensingCommand& command) {
        commands_[{command.stamp.session, command.stamp.sequence_number}] = command;
      });
    } else if (!await(dds::kDragField, topic, message) && !await(dds::kPercept, topic, message) &&
               !await(dds::kInterestPoints, topic, message)) {
      await(dds::kSensingReply, topic, message);
    }
    settle(message.log_time_ns > kPatience_ns ? message.log_time_ns - kPatience_ns : 0);
  }

  ReplayReport finish() {
    settle(~0ULL);
    return std::move(report_);
  }

 private:
  template <class T>
  static std::optional<T> decoded(const dds::TopicSpec<T>& topic, const recording::Message& message) {
    static const dds::CdrCodec codec(topic);
    T sample;
    if (!codec.decode(message.data, &sample)) return {};
    return sample;
  }

  /// Passes a recorded sample to `use` if it is valid.
  template <class T, class Use>
  static void if_sound(const dds::TopicSpec<T>& topic, const recording::Message& message, Use use) {
    const auto recorded = decoded(topic, message);
    if (!recorded) return;
    if (const auto sample = messages::from_idl(*recorded)) use(*sample);
  }

  /// The newest kMaxStates samples of a topic, by their names.
  template <class Sample>
  struct Kept {
    std::map<Name, messages::Received<Sample>> samples;
    std::deque<Name> order;
  };

  template <class Sample>
  static void keep(const Sample& sample, Kept<Sample>& kept) {
    const Name name{sample.stamp.session, sample.stamp.sequence_number};
    if (kept.samples.emplace(name, messages::Received<Sample>(sample, 0)).second) kept.order.push_back(name);
    if (kept.order.size() <= kMaxStates) return;
    kept.samples.erase(kept.order.front());
    kept.order.pop_front();
  }

  void keep_version() {
    const auto& current = assembler_.current();
    if (!current || (!versions_.empty() && versions_.back().voxels == current)) return;
    const auto skin = parts_.skin_with(carried_[current->version]);
    if (!skin) return;  // a mesh is still to come
    carried_.erase(carried_.begin(), carried_.find(current->version));
    versions_.push_back({current, assembler_.greatest_neighbour_mu(), *skin});
    if (versions_.size() > kMaxVersions) versions_.pop_front();
  }

  template <class T>
  bool await(const dds::TopicSpec<T>& spec, const std::string& topic, const recording::Message& message) {
    if (topic != spec.name) return false;
    if (auto sample = decoded(spec, message))
      waiting_.push_back(
          {std::move(*sample), {message.data.begin(), message.data.end()}, message.log_time_ns});
    return true;
  }

  /// Processes what was recorded before `until_ns`, in the order of the component's own clock.
  void settle(std::uint64_t until_ns) {
    if (waiting_.empty() || waiting_.front().log_time_ns >= until_ns) return;
    std::stable_sort(waiting_.begin(), waiting_.end(), [](const Output& a, const Output& b) {
      return a.stamp().session() == b.stamp().session() &&
             a.stamp().monotonic_ns() < b.stamp().monotonic_ns();
    });
    std::size_t done = 0;
    for (; done < waiting_.size() && waiting_[done].log_time_ns < until_ns; ++done)
      std::visit([&](const auto& sample) { process(sample, waiting_[done]); }, waiting_[done].sample);
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(done));
  }

  void process(const msg::SensingReply& message, const Output&) {
    const auto reply = messages::from_idl(message);
    if (!reply || !reply->done) return;
    const auto command = commands_.find({reply->command.session, reply->command.sequence_number});
    if (command != commands_.end() && (reply->request == messages::SensingRequest::kAllowContact ||
                                       reply->request == messages::SensingRequest::kForbidContact))
      contacts_.handle(command->second, reply->stamp.monotonic_ns);
  }

  void process(const msg::DragField& field, const Output& output) {
    if (!tick(field.slave_echo(), field.workspace_version(), field.valid(), field.stamp(),
              &field.gripper_echo())) {
      ++report_.drag_field.without_inputs;
      return;
    }
    info_.model_age_s = field.model_age_s();
    msg::DragField made = messages::to_idl(drag_field_of(outputs_, info_, model_.arm.joint_count()));
    compare(dds::kDragField, made, field.stamp(), output, report_.drag_field);
  }

  void process(const msg::Percept& percept, const Output& output) {
    if (!tick(percept.slave_echo(), percept.workspace_version(), percept.valid(), percept.stamp(), nullptr)) {
      ++report_.percept.without_inputs;
      return;
    }
    msg::Percept made = messages::to_idl(percept_of(outputs_, info_, model_.arm.joint_count()));
    made.tick_s(percept.tick_s());
    made.condition(percept.condition());
    compare(dds::kPercept, made, percept.stamp(), output, report_.percept);
  }

  void process(const msg::InterestPoints& points, const Output& output) {
    if (!tick(points.slave_echo(), points.workspace_version(), points.valid(), points.stamp(), nullptr)) {
      ++report_.interest_points.without_inputs;
      return;
    }
    msg::InterestPoints made = messages::to_idl(interest_points_of(outputs_, info_, model_));
    made.condition(points.condition());
    compare(dds::kInterestPoints, made, points.stamp(), output, report_.interest_points);
  }

  /// Runs the tick that `echo` names. Returns false if its inputs are missing. A percept names no gripper: it
  /// belongs to the tick of the drag field before it. Where that one was lost, only an arm without fingers
  /// gives it again.
  bool tick(const msg::Echo& echo, std::uint64_t version, bool valid, const msg::Stamp& stamp,
            const msg::Echo* gripper_echo) {
    const Name name{echo.session(), echo.sequence_number()};
    if (gripper_echo == nullptr && ticked_ && name == *ticked_ && outputs_.valid == valid &&
        outputs_.workspace_version == version)
      return true;
    if (stamp.session() != session_) {  // the component was restarted
      session_ = stamp.session();
      sensing_.emplace(model_, settings_);
      before_ = {};
    }
    ticked_.reset();
    const auto state = states_.samples.find(name);
    std::shared_ptr<CarryingSkin> skin;
    const SensedWorkspace workspace = version_of(version, skin);
    const Name gripper_name =
        gripper_echo != nullptr ? Name{gripper_echo->session(), gripper_echo->sequence_number()} : Name{};
    const auto gripper = grippers_.samples.find(gripper_name);
    if (gripper_echo == nullptr && model_.has_fingers()) return false;
    if (gripper_name.second != 0 && gripper == grippers_.samples.end()) return false;
    if ((name.second != 0 && state == states_.samples.end()) || (version != 0 && workspace.voxels == nullptr))
      return false;
    contacts_.end_old(stamp.monotonic_ns());
    StepInputs inputs;
    inputs.workspace = workspace;
    inputs.state_valid = valid;
    inputs.allowed = contacts_.permits().at(stamp.monotonic_ns());
    info_ = {};
    if (state != states_.samples.end()) info_.slave = state->second;
    if (gripper_name.second != 0) {
      inputs.fingers = fingers_of(gripper->second);
      info_.gripper = gripper->second.stamp;
    }
    info_.allowed_contacts = inputs.allowed.size();
    if (valid) {
      inputs.position = info_.slave.position;
      inputs.velocity = info_.slave.velocity;
      inputs.dt_s = elapsed_s(before_, info_.slave);
      before_ = info_.slave;
    }
    sensing_->step(inputs, outputs_);
    worn_ = skin;  // only now the one before may go
    ticked_ = name;
    return true;
  }

  SensedWorkspace version_of(std::uint64_t version, std::shared_ptr<CarryingSkin>& skin) const {
    for (const Version& kept : versions_) {
      if (kept.voxels->version != version) continue;
      skin = kept.skin;
      return {kept.voxels.get(), kept.greatest_neighbour_mu, skin ? &skin->sensing : nullptr};
    }
    return {};
  }

  template <class T>
  void compare(const dds::TopicSpec<T>& topic, T& made, const msg::Stamp& stamp, const Output& recorded,
               ReplayedTopic& counts) {
    static const dds::CdrCodec codec(topic);
    made.stamp(stamp);
    std::vector<std::uint8_t> bytes;
    if (codec.encode(&made, bytes) && is_same(bytes, recorded.bytes)) {
      ++counts.equal;
      return;
    }
    if (counts.different++ > 0 || report_.differences.size() >= kMaxDifferences) return;
    const std::size_t common = std::min(bytes.size(), recorded.bytes.size());
    const auto at = std::mismatch(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(common),
                                  recorded.bytes.begin());
    report_.differences.push_back(std::string(topic.name) + " " + std::to_string(stamp.sequence_number()) +
                                  " is the first that differs, from byte " +
                                  std::to_string(at.first - bytes.begin()) + " of " +
                                  std::to_string(recorded.bytes.size()) + " on");
  }

  struct Version {
    std::shared_ptr<const workspace::Workspace> voxels;
    double greatest_neighbour_mu;
    std::shared_ptr<CarryingSkin> skin;
  };
  const PhantomModel& model_;
  const PerceptSettings& settings_;
  ContactRegister contacts_;
  CarriedParts parts_;
  std::map<std::uint64_t, std::vector<messages::CarriedObject>> carried_;  // by version
  std::shared_ptr<CarryingSkin> worn_;
  std::optional<PhantomSensing> sensing_;
  workspace::WorkspaceAssembler assembler_;
  std::deque<Version> versions_;
  Kept<messages::SlaveState> states_;
  Kept<messages::GripperState> grippers_;
  std::map<Name, messages::SensingCommand> commands_;
  std::deque<Output> waiting_;
  std::uint64_t session_ = 0;
  std::optional<Name> ticked_;  // the tick that produced outputs_ and info_
  SlaveSample before_;
  StepOutputs outputs_;
  TickInfo info_;
  ReplayReport report_;
};

void print(const char* topic, const ReplayedTopic& counts) {
  std::cout << "  " << topic << ": " << counts.equal << " equal bit for bit, " << counts.different
            << " different, " << counts.without_inputs << " without their inputs in the recording\n";
}

}  // namespace

ReplayReport replay_recording(const std::vector<std::filesystem::path>& files, const PhantomModel& model,
                              const PerceptSettings& settings, ContactRegister contacts) {
  Replay replay(model, settings, std::move(contacts));
  for (const auto& file : files) {
    const auto reader = recording::McapReader::open(file);
    if (!reader && reader.status().code() == core::ErrorCode::kNotFound)
      throw core::MissingError(reader.status().message());
    if (!reader) throw core::ConfigError(reader.status().message());
    recording::MessageCursor cursor(*reader);
    for (recording::Message message; cursor.next(message);)
      replay.take(reader->channels().at(message.channel_id).topic, message);
    // What is missing would be taken for a difference of the percepts.
    if (!cursor.problems().empty() || reader->chunks_left_out() > 0)
      throw std::runtime_error(file.string() +
                               ": chunks of it cannot be read; dds_recorder check names them");
  }
  return replay.finish();
}

void add_options(runtime::Command app, ReplayRequest& request) {
  app.option("--recording", request.recordings, "MCAP files of dds_recorder, in their order").required();
  app.option("--cell", request.cell, "cell file, as it was when the recording was made").required();
  app.option("--arm", request.arm, "arm of the cell, if it has several");
}

int run_replay(const ReplayRequest& request, Config config) {
  if (!config.other_arms.empty())
    throw core::ConfigError(
        config.file.string() +
        ": other_arms: their states are in no recording of this arm's partition, so its percepts "
        "cannot be made again; allowed: none");
  if (std::ranges::any_of(config.shares, [](const ShareConfig& share) { return !share.cell.empty(); }))
    throw core::ConfigError(
        config.file.string() +
        ": sharing.shares: what a share has sensed in a workspace of its own is in no recording "
        "of the arm's partition; allowed: shares without a cell");
  if (!request.arm.empty()) config.arm = request.arm;
  const auto cell = runtime::load_checked_cell(request.cell);
  const auto model = load_model(cell, config);
  const ReplayReport report =
      replay_recording(request.recordings, model, config.percept, contacts_of_cell(cell, config, model));
  std::cout << (report.ok() ? "as recorded\n" : "not as recorded\n");
  print("drag_field", report.drag_field);
  print("percept", report.percept);
  print("interest_points", report.interest_points);
  for (const std::string& difference : report.differences) std::cout << "  " << difference << '\n';
  if (report.drag_field.different + report.percept.different > 0)
    std::cout << "  are cell, arm and parameters those of the recording?\n";
  return report.ok() ? runtime::kExitDone : runtime::kExitFailed;
}

}  // namespace phantom::phantom_sensing
