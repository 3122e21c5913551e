#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "common/core/snapshot.hpp"
#include "common/dds/admission/delay_monitor.hpp"
#include "common/dds/admission/refusal_log.hpp"
#include "common/dds/admission/source_guard.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/model_check.hpp"
#include "common/messages/received.hpp"

namespace phantom::messages {

/// What becomes of samples of a process that works with another arm or cell: refused, or passed on and marked
/// (TopicSubscriber::of_other_model), so that a stop in them is heeded.
enum class OtherModel { kRefused, kMarked };

/// What a receiver asks of samples besides their codec.
template <class Sample>
struct ReceiverRules {
  /// How long the followed process may be silent before another one is followed.
  core::Nanoseconds hold_ns = dds::SourceGuard::kHold_ns;
  /// Returns why a valid sample cannot be used, or an empty string if it can; null: it always can.
  std::function<std::string(const Sample&)> refusal;
  OtherModel other_model = OtherModel::kRefused;  ///< live alone: a recording carries no labels of models
};

/// Decides which samples of one topic are used, live and of a recording alike: those that the topic's codec
/// accepts, that are newer than the last, and that come from the followed process (dds::SourceGuard). Reads
/// no clock. A plain value: a copy goes on by itself. Include the topic's codec, too.
template <class Message>
class TopicReceiver {
 public:
  using Sample = std::remove_cvref_t<decltype(*from_idl(std::declval<const Message&>(), ArmBounds()))>;
  using Rules = ReceiverRules<Sample>;

  /// `arm`: the arm that samples must describe; by default any.
  TopicReceiver(std::shared_ptr<const ArmBounds> arm, Rules rules = {})  // NOLINT: implicit by intent
      : arm_(std::move(arm)),
        refusal_(std::move(rules.refusal)),
        other_model_(rules.other_model),
        source_(rules.hold_ns) {}
  TopicReceiver(ArmBounds arm = {}, Rules rules = {})  // NOLINT: implicit by intent
      : TopicReceiver(std::make_shared<const ArmBounds>(std::move(arm)), std::move(rules)) {}

  /// Returns the sample, or why it is refused. One thread. Allocates in refusals only, unless the sample
  /// itself does.
  core::Expected<Received<Sample>> take(const Message& message, core::Nanoseconds received_ns) {
    return checked(message, received_ns, [&] { return source_.assess(message.stamp(), received_ns); });
  }
  /// The same, of a topic that is written on events (dds::SourceGuard::assess_event).
  core::Expected<Received<Sample>> take(const Message& message, core::Nanoseconds received_ns,
                                        const dds::SourceGuard& periodic) {
    return checked(message, received_ns,
                   [&] { return source_.assess_event(message.stamp(), received_ns, periodic); });
  }
  /// Returns who is followed, and who else writes the topic.
  const dds::SourceGuard& source() const noexcept { return source_; }
  const ArmBounds& arm() const noexcept { return *arm_; }
  OtherModel other_model() const noexcept { return other_model_; }

 private:
  core::Expected<Received<Sample>> checked(const Message& message, core::Nanoseconds received_ns,
                                           const auto& assess) {
    auto sample = from_idl(message, *arm_);
    if (!sample) return sample.status();
    if (std::string why = refusal_ ? refusal_(*sample) : std::string(); !why.empty())
      return core::Status::invalid_argument(std::move(why));
    if (const char* why = dds::reason(assess())) return core::Status::invalid_argument(why);
    return Received<Sample>(std::move(sample).value(), received_ns);
  }

  std::shared_ptr<const ArmBounds> arm_;
  std::function<std::string(const Sample&)> refusal_;
  OtherModel other_model_;
  dds::SourceGuard source_;
};

/// Receives a topic that one process writes at a time: passes on what its TopicReceiver accepts, of processes
/// that work with the same arm and cell, and, of a periodic topic, what was not held up on its way
/// (dds::DelayMonitor). Counts what is refused, and logs it at intervals.
template <class Message>
class TopicSubscriber {
 public:
  using Sample = typename TopicReceiver<Message>::Sample;
  using OnSample = std::function<void(const Received<Sample>&)>;

  /// `on_sample` runs on the middleware's thread, as dds::Reader's. `periodic`: of a topic that is written on
  /// events, the source of a periodic topic of the same process; it must outlive this. Throws dds::DdsError.
  TopicSubscriber(dds::Participant& participant, const dds::TopicSpec<Message>& topic,
                  TopicReceiver<Message> receiver, OnSample on_sample,
                  const dds::SourceGuard* periodic = nullptr)
      : receiver_(std::move(receiver)),
        on_sample_(std::move(on_sample)),
        periodic_(periodic),
        is_periodic_(topic.qos.deadline_ms > 0),
        model_check_(topic.name, receiver_.arm().identity),
        refusals_(topic.name),
        reader_(participant, topic,
                [this](const Message& message, const dds::SampleInfo& info) { return take(message, info); }) {
  }
  /// Writes the samples to a snapshot, which must outlive this.
  template <std::uint32_t Readers>
  TopicSubscriber(dds::Participant& participant, const dds::TopicSpec<Message>& topic,
                  TopicReceiver<Message> receiver, core::Snapshot<Received<Sample>, Readers>& newest)
      : TopicSubscriber(participant, topic, std::move(receiver),
                        [&newest](const Received<Sample>& sample) { newest.write(sample); }) {}

  /// Returns who is followed, and who else writes the topic; only what is marked thread-safe may be asked.
  const dds::SourceGuard& source() const noexcept { return receiver_.source(); }
  /// Returns whether the newest sample's process works with another arm or cell. For `on_sample`.
  bool of_other_model() const noexcept { return model_check_.differs(); }
  /// Returns how it differs; empty: not at all. Thread-safe.
  std::string model_difference() const { return model_check_.difference(); }
  /// Returns by how many seconds this host's wall clock is ahead of that of the followed process's host;
  /// nothing before the first sample of a periodic topic. Thread-safe.
  std::optional<double> clock_difference_s() const noexcept { return delay_.clock_difference_s(); }

 private:
  bool refuse(const std::string& why, const dds::SampleInfo& info) {
    refusals_.refused(why, info.received_ns);
    return false;
  }
  bool take(const Message& message, const dds::SampleInfo& info) {
    model_check_.look(info.model_label, info.received_ns);
    if (model_check_.differs() && receiver_.other_model() == OtherModel::kRefused)
      return refuse(model_check_.difference(), info);
    const auto sample = periodic_ != nullptr ? receiver_.take(message, info.received_ns, *periodic_)
                                             : receiver_.take(message, info.received_ns);
    if (!sample) return refuse(sample.status().message(), info);
    if (is_periodic_ && delay_.is_late(message.stamp(), info.received_ns, core::utc_ns()))
      return refuse("it was held up on its way for more than a second: by the network, or by this process",
                    info);
    on_sample_(*sample);
    return true;
  }

  TopicReceiver<Message> receiver_;
  OnSample on_sample_;
  const dds::SourceGuard* periodic_;
  bool is_periodic_;
  ModelCheck model_check_;
  dds::DelayMonitor delay_;
  dds::RefusalLog refusals_;
  dds::Reader<Message> reader_;
};

}  // namespace phantom::messages
