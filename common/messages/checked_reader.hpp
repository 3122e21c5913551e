#pragma once

#include <functional>
#include <string>
#include <type_traits>
#include <utility>

#include "common/dds/admission/refusal_log.hpp"
#include "common/dds/admission/source_guard.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/arm_bounds.hpp"

namespace phantom::messages {

/// Receives a topic that one process writes at a time. Passes on the samples that its codec accepts, that are
/// newer than the last, and that come from the followed process (dds::SourceGuard). Counts the other samples,
/// and logs them at intervals. Include the topic's codec, too.
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
                OnSample on_sample, Refusal refusal = {})
      : arm_(std::move(arm)),
        on_sample_(std::move(on_sample)),
        refusal_(std::move(refusal)),
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

 private:
  bool take(const Message& message, const dds::SampleInfo& info) {
    const auto sample = from_idl(message, arm_);
    std::string why = sample.status().message();
    if (sample && refusal_) why = refusal_(*sample);
    if (why.empty()) {
      const char* reason = dds::reason(source_.assess(message.stamp(), info.received_ns));
      if (reason == nullptr) {
        on_sample_(*sample, info.received_ns);
        return true;
      }
      why = reason;
    }
    refusals_.refused(why, info.received_ns);
    return false;
  }

  ArmBounds arm_;
  OnSample on_sample_;
  Refusal refusal_;
  dds::SourceGuard source_;
  dds::RefusalLog refusals_;
  dds::Reader<Message> reader_;
};

}  // namespace phantom::messages
