#include "components/master_io/jnd/dds_adapter_gain.hpp"

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>

#include "common/core/text.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/topics.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/operator_client.hpp"
#include "common/messages/requester.hpp"
#include "common/messages/topic_receiver.hpp"
#include "common/runtime/process/signals.hpp"

namespace phantom::master_io {
namespace {

constexpr double kAnswer_s = 5.0, kSilent_s = 3.0;
constexpr std::chrono::milliseconds kLookAtStop{50};
constexpr std::size_t kMaxWaiting = 4096;  // states

}  // namespace

struct RunningDrag::Impl {
  Impl(const core::NetworkOptions& network, const messages::ArmBounds& arm, int joint_index)
      : joint(joint_index),
        participant("operator_command_line", network),
        client(participant),
        states(participant, dds::kMasterState, arm,
               [this](const messages::Received<messages::MasterState>& state) {
                 {
                   const std::lock_guard lock(mutex);
                   if (waiting.size() >= kMaxWaiting) waiting.pop_front();
                   waiting.push_back(state);
                 }
                 changed.notify_one();
               }) {}

  int joint;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<messages::Received<messages::MasterState>> waiting;  // oldest first
  dds::Participant participant;
  messages::OperatorClient client;
  messages::TopicSubscriber<msg::MasterState> states;
};

RunningDrag::RunningDrag(const core::NetworkOptions& network, const messages::ArmBounds& arm, int joint)
    : impl_(std::make_unique<Impl>(network, arm, joint)) {}

RunningDrag::~RunningDrag() = default;

core::Status RunningDrag::set_gain(double gain) {
  messages::OperatorCommand command{.kind = teleop::CommandKind::kSetPerceptGain,
                                    .value = gain,
                                    .joint = impl_->joint,
                                    .issuer = messages::requester_name("master_io jnd")};
  const auto answers = impl_->client.ask(command, kAnswer_s);
  if (!answers.done()) return {core::ErrorCode::kUnavailable, teleop::command_words(answers)};
  const std::lock_guard lock(impl_->mutex);
  impl_->waiting.clear();  // of the gain before
  return core::Status::ok();
}

core::Expected<messages::Received<messages::MasterState>> RunningDrag::next() {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::duration<double>(kSilent_s);
  std::unique_lock lock(impl_->mutex);
  while (impl_->waiting.empty()) {
    if (runtime::stop_requested()) break;
    if (std::chrono::steady_clock::now() >= give_up)
      return core::Status(
          core::ErrorCode::kUnavailable,
          core::formatted("no master_state of a master_io with this arm for %g s", kSilent_s));
    impl_->changed.wait_for(lock, kLookAtStop);
  }
  if (runtime::stop_requested()) return core::Status(core::ErrorCode::kFailedPrecondition, "interrupted");
  messages::Received<messages::MasterState> state = impl_->waiting.front();
  impl_->waiting.pop_front();
  return state;
}

}  // namespace phantom::master_io
