#pragma once

#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "common/dds/admission/delay_monitor.hpp"
#include "common/dds/admission/refusal_log.hpp"
#include "common/dds/admission/source_guard.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/model_check.hpp"

namespace phantom::messages {

/// What becomes of samples of a process that works with another arm or cell: refused, or passed on and marked
/// (of_other_model), so that a stop in them is heeded.
enum class OtherModel { kRefused, kMarked };

/// Receives a topic that one process writes at a time. Passes on the samples that its codec accepts, that are
/// newer than the last, that come from the followed process (dds::SourceGuard), and, of a periodic topic,
/// that were not held up on their way (dds::DelayMonitor). Counts the other samples, and logs them at
/// intervals. Include the topic's codec, too.
template <class Message>
class CheckedReader {
 public:
  using Sample = std::remove_cvref_t<decltype(*from_idl(std::declval<const Message&>(), ArmBounds()))>;
  using OnSample = std::function<void(const Sample&, core::Nanoseconds received_ns)>;
  /// Returns why a valid sample cannot be used by this receiver, or an empty string if it can.
  using Refusal = std::function<std::string(const Sample&)>;

  /// `arm`: the arm that samples must describe. Callbacks run on the middleware's thread, as dds::Reader's.
  /// Throws dds::DdsError.
  CheckedReader(dds::Participant& participant, const dds::TopicSpec<Message>& topic, ArmBounds arm,
                OnSample on_sample, Refusal refusal = {}, OtherModel other_model = OtherModel::kRefused)
      : other_model_(other_model),
        model_check_(topic.name, arm.identity),
        arm_(std::move(arm)),
        on_sample_(std::move(on_sample)),
        refusal_(std::move(refusal)),
        periodic_(topic.qos.deadline_ms > 0),
        refusals_(topic.name),
        reader_(participant, topic,
                [this](const Message& message, const dds::SampleInfo& info) { return take(message, info); }) {
  }

  /// Returns whether another process writes the topic, too. Thread-safe.
  bool has_rival(core::Nanoseconds now_ns) const noexcept { return source_.has_rival(now_ns); }
  /// Return the session of the other process that wrote last, and how many samples of others were refused
  /// since the start; 0 if there were none. Thread-safe.
  std::uint64_t rival_session() const noexcept { return source_.rival_session(); }
  std::uint64_t rival_samples() const noexcept { return source_.rival_samples(); }
  /// Returns whether the newest sample's process works with another arm or cell. For `on_sample`.
  bool of_other_model() const noexcept { return model_check_.differs(); }
  /// Returns how it differs; empty: not at all. Thread-safe.
  std::string model_difference() const { return model_check_.difference(); }
  /// Returns by how many seconds this host's wall clock is ahead of that of the followed process's host;
  /// nothing before the first sample of a periodic topic. Thread-safe.
  std::optional<double> clock_difference_s() const noexcept { return delay_.clock_difference_s(); }

 private:
  bool take(const Message& message, const dds::SampleInfo& info) {
    const auto sample = from_idl(message, arm_);
    std::string why = sample.status().message();
    model_check_.look(info.model_label);
    if (sample && model_check_.differs() && other_model_ == OtherModel::kRefused)
      why = model_check_.difference();
    if (sample && why.empty() && refusal_) why = refusal_(*sample);
    if (why.empty()) {
      const char* reason = dds::reason(source_.assess(message.stamp(), info.received_ns));
      if (reason == nullptr && periodic_ && delay_.is_late(message.stamp(), info.received_ns, core::utc_ns()))
        reason = "it was held up on its way for more than a second: by the network, or by this process";
      if (reason == nullptr) {
        on_sample_(*sample, info.received_ns);
        return true;
      }
      why = reason;
    }
    refusals_.refused(why, info.received_ns);
    return false;
  }

  OtherModel other_model_;
  ModelCheck model_check_;
  ArmBounds arm_;
  OnSample on_sample_;
  Refusal refusal_;
  bool periodic_;
  dds::SourceGuard source_;
  dds::DelayMonitor delay_;
  dds::RefusalLog refusals_;
  dds::Reader<Message> reader_;
};

}  // namespace phantom::messages
